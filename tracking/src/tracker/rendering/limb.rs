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

/// Bodies that began within this time came together, s: the second may be a person who never is elsewhere than beside the first.
const TOGETHER_S: f64 = 0.4;

impl Rendering {
    /// Whether a body is nearer than this to a confirmed one that is older.
    pub(super) fn has_elder(&self, index: usize, within_m: f64) -> bool {
        self.is_beside(index, within_m, |elder, body| elder.begun_s < body.begun_s - TOGETHER_S)
    }

    /// Whether a body is nearer than this to a confirmed one of which, and of it, this holds.
    fn is_beside(&self, index: usize, within_m: f64, holds: impl Fn(&Body, &Body) -> bool) -> bool {
        self.bodies.get(index).is_some_and(|body| {
            let at = body.cloud.moments().at;
            let mut others = self.bodies.iter().filter(|other| other.confirmed && holds(other, body));
            others.any(|other| (other.cloud.moments().at - at).length() < within_m)
        })
    }

    /// Whether a body may be a limb of a confirmed one, also of one with which it came: people come into view with an arm stretched out.
    pub(super) fn may_be_limb(&self, index: usize) -> bool {
        self.model.has(Part::Limbs)
            && self.bodies.get(index).is_some_and(|body| !body.confirmed)
            && self.is_beside(index, REACH.end, |_, _| true)
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
        let at = body.cloud.moments().at;
        let is_armed = |elder: &Body| {
            elder.confirmed
                && (elder.cloud.moments().at - at).length() < REACH.end
                && elder.cloud.samples().iter().any(|sample| sample.arm.is_some())
        };
        let armed = self.bodies.iter().enumerate().filter(|(_, elder)| is_armed(elder));
        let torso = |(number, elder): (usize, &Body)| {
            Some((number, render_torso(elder, scan, &self.window(elder, scan)?, self.edge)))
        };
        armed.filter_map(torso).collect()
    }
}
