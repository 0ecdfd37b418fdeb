//! Why a zone is known or not: who is in it, and which parts of it are not seen, behind what, since when.
//!
//! ```text
//!   ┌───────────────┐   cells that are not seen, each with the module nearest to seeing it and why it does not;
//!   │ ▒▒▒           │   neighbours with the same reason are a patch:
//!   │ ▒▒▒      ░░   │   ▒ 1.4 m², behind a thing, as `left` sees it, never seen
//!   └───────────────┘   ░ 0.5 m², behind person 4, seen 3 s ago
//! ```

use std::collections::HashMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::glance::{Glance, Scene, Why, best};
use super::round::{ago_s, hundredth};
use crate::geometry::Point;
use crate::occupancy::ZoneKnown;
use crate::site::Site;
use crate::tracker::TrackState;
use crate::zones::facts::{Inside, UnseenCell, ZoneFacts};
use crate::zones::verdict::Verdict;

/// Most patches that are told, the largest first; the area of the others is told together.
pub const PATCHES_MAX: usize = 16;

/// A part of a zone that is not seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Patch {
    /// Its area, m²; of a line its length, m.
    pub size: f64,
    /// A cell near its middle.
    pub at: [f64; 2],
    /// Why the module does not see it that is nearest to seeing it.
    pub why: Why,
    /// That module; none where none reaches it.
    pub module: Option<String>,
    /// When some of it was seen last, s ago; none if never.
    pub seen_ago_s: Option<f64>,
    /// The middles of its cells.
    pub cells: Vec<[f64; 2]>,
}

/// Why a zone is as it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZoneReasons {
    /// Its name.
    pub name: String,
    /// Whether it is a counting line.
    pub is_line: bool,
    /// How much is known.
    pub state: ZoneKnown,
    /// How many are counted in it; null where that is not known, and of a line.
    pub count: Option<u32>,
    /// Why; null of a line.
    pub verdict: Option<Verdict>,
    /// Share of it that is seen.
    pub seen_share: f64,
    /// Its area, m²; of a line its length, m.
    pub size: f64,
    /// Who may be in it.
    pub inside: Vec<Inside>,
    /// What of it is not seen, the largest first.
    pub unseen: Vec<Patch>,
    /// What of it is not seen beside those, m² or m.
    pub unseen_more: f64,
    /// Side of a cell, m.
    pub cell_m: f64,
}

type Key = (Why, Option<usize>);

/// Explains a zone at `at_s`.
#[must_use]
pub fn explain(
    facts: &ZoneFacts,
    glances: &[Glance],
    site: &Site,
    tracks: &[TrackState],
    at_s: f64,
) -> ZoneReasons {
    let scene = Scene::of(site, tracks, at_s);
    let why = |cell: &UnseenCell| match best(glances, cell.middle, 0.5 * facts.cell_m, &scene) {
        // It has been seen just now, or not for long enough.
        (Why::Seen, module) => (Why::NotJudged, module),
        other => other,
    };
    let reasons: HashMap<(i32, i32), (usize, Key)> =
        facts.unseen.iter().enumerate().map(|(number, cell)| (cell.at, (number, why(cell)))).collect();
    let mut taken = vec![false; facts.unseen.len()];
    let mut patches = Vec::new();
    for number in 0..facts.unseen.len() {
        let own = patch(number, facts, &reasons, &mut taken);
        let Some((_, key)) = facts.unseen.get(number).and_then(|cell| reasons.get(&cell.at)) else {
            continue;
        };
        if !own.is_empty() {
            patches.push(told(&own, *key, facts, site, at_s));
        }
    }
    patches.sort_by(|one, other| other.size.total_cmp(&one.size));
    let more = patches.split_off(PATCHES_MAX.min(patches.len()));
    ZoneReasons {
        name: facts.name.clone(),
        is_line: facts.is_line,
        state: facts.state,
        count: facts.count,
        verdict: facts.verdict,
        seen_share: hundredth(facts.seen_share),
        size: hundredth(facts.size),
        inside: facts.inside.clone(),
        unseen: patches,
        unseen_more: hundredth(more.iter().map(|patch| patch.size).sum()),
        cell_m: facts.cell_m,
    }
}

/// The cells around one that touch it, directly or by others, and have the same reason; none if it is taken.
fn patch<'a>(
    first: usize,
    facts: &'a ZoneFacts,
    reasons: &HashMap<(i32, i32), (usize, Key)>,
    taken: &mut [bool],
) -> Vec<&'a UnseenCell> {
    let mut own = Vec::new();
    let Some(key) = facts.unseen.get(first).and_then(|cell| reasons.get(&cell.at)).map(|(_, key)| *key)
    else {
        return own;
    };
    let mut open = vec![first];
    while let Some(number) = open.pop() {
        let (Some(cell), Some(taken)) = (facts.unseen.get(number), taken.get_mut(number)) else { continue };
        if std::mem::replace(taken, true) {
            continue;
        }
        own.push(cell);
        let (x, y) = cell.at;
        let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
        let same = beside.iter().filter_map(|at| reasons.get(at)).filter(|(_, other)| *other == key);
        open.extend(same.map(|(number, _)| *number));
    }
    own
}

fn told(own: &[&UnseenCell], (why, module): Key, facts: &ZoneFacts, site: &Site, at_s: f64) -> Patch {
    let count = own.len().max(1) as f64;
    let middle = own.iter().fold(Point::default(), |sum, cell| sum + cell.middle) * (1.0 / count);
    let far_m = |cell: &&&UnseenCell| (cell.middle - middle).length();
    // The mean of a patch may lie outside it.
    let near = own
        .iter()
        .min_by(|one, other| far_m(one).total_cmp(&far_m(other)))
        .map_or(middle, |cell| cell.middle);
    let seen_s = own.iter().map(|cell| cell.seen_s).fold(f64::NEG_INFINITY, f64::max);
    let each = if facts.is_line { facts.cell_m } else { facts.cell_m * facts.cell_m };
    Patch {
        size: hundredth(count * each),
        at: [near.x, near.y].map(hundredth),
        why,
        module: module.and_then(|module| site.modules.get(module)).map(|module| module.name.clone()),
        seen_ago_s: ago_s(seen_s, at_s),
        cells: own.iter().map(|cell| [cell.middle.x, cell.middle.y].map(hundredth)).collect(),
    }
}
