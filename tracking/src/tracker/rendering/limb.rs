//! Limbs: what appears within reach of a confirmed body may be an arm of it. To be a person it has to show more than an arm does.
//!
//! ```text
//!   ╭───╮      ▪        a hand on a table, up to 20 cm with its sleeve: a datum of silhouette is 15 cm
//!   ╰───╯─ ─ ─
//!   ╭───╮    ╭───╮      a person shows two or three, and each module that sees the place shows some
//!   ╰───╯    ╰───╯
//! ```

use super::body::Body;
use super::field::{Field, render_torso};
use super::ray::most_of_a_datum;
use super::sample::REACH;
use super::scan::Scan;
use super::{Part, Rendering};

/// Data that a limb would explain: a forearm that slopes is 10 by 14 cm, more with a sleeve, and its edges are soft.
const LIMB_DATA: f64 = 1.5;

/// Bodies that began within this time came together, s: the second need not have been elsewhere to be a person.
const TOGETHER_S: f64 = 0.4;

impl Rendering {
    /// Whether a body is nearer than this to a confirmed one that is older.
    pub(super) fn has_elder(&self, index: usize, within_m: f64) -> bool {
        let is_younger = |body: &Body| {
            let mut near = self.confirmed_near(body, within_m);
            near.any(|(_, elder)| elder.begun_s < body.begun_s - TOGETHER_S)
        };
        self.bodies.get(index).is_some_and(is_younger)
    }

    /// The confirmed bodies that are nearer to a body than this, m, with their places among all.
    pub(super) fn confirmed_near(&self, body: &Body, within_m: f64) -> impl Iterator<Item = (usize, &Body)> {
        let at = body.cloud.moments().at;
        let is_near =
            move |other: &Body| other.confirmed && (other.cloud.moments().at - at).length() < within_m;
        self.bodies.iter().enumerate().filter(move |(_, other)| is_near(other))
    }

    /// Whether a body may be a limb of a confirmed one, also of one with which it came: people come into view with an arm stretched out.
    pub(super) fn may_be_limb(&self, index: usize) -> bool {
        let is_in_reach =
            |body: &Body| !body.confirmed && self.confirmed_near(body, REACH.end).next().is_some();
        self.model.has(Part::Limbs) && self.bodies.get(index).is_some_and(is_in_reach)
    }

    /// What a scan says of the existence of a body that may be a limb: what goes beyond a limb.
    pub(super) fn beyond_a_limb(&self, index: usize, evidence: f64) -> f64 {
        if evidence > 0.0 && self.may_be_limb(index) {
            (evidence - LIMB_DATA * most_of_a_datum()).max(0.0)
        } else {
            evidence
        }
    }

    /// The confirmed bodies within whose reach a body that may be a limb is, without the arms that they stretch out: with one, a
    /// body explains its neighbour's outline, and the neighbour stays unknown.
    pub(super) fn unarmed(&self, index: usize, scan: &Scan) -> Vec<(usize, Field)> {
        let Some(body) = self.bodies.get(index).filter(|_| self.may_be_limb(index)) else {
            return Vec::new();
        };
        let is_armed = |other: &Body| other.cloud.samples().iter().any(|sample| sample.arm.is_some());
        let armed = self.confirmed_near(body, REACH.end).filter(|(_, other)| is_armed(other));
        let torso = |(number, other): (usize, &Body)| {
            Some((number, render_torso(other, scan, &self.window(other, scan)?, self.edge)))
        };
        armed.filter_map(torso).collect()
    }
}
