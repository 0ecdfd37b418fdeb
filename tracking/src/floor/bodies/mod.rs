//! Patches to bodies, followed from footfall to footfall.
//!
//! ```text
//!   reading ─▶ patches ─▶ hypotheses, each: which body has set which foot ─▶ the likeliest one's bodies
//! ```
//!
//! | file | what |
//! |---|---|
//! | `body` | one body between its feet |
//! | `print` | what a foot presses as it is set |
//! | `step` | where it sets its next foot |
//! | `hypothesis` | one explanation of all patches |
//!
//! One foot more than the feet that stood there says that a body has set it, not which. Where two bodies could have,
//! both are believed until their next steps tell. A body without a foot of its own shares a patch with another, for as
//! long as one is near; else it has left the floor.

mod body;
mod hypothesis;
mod print;
mod step;

use std::collections::BTreeMap;

use self::hypothesis::Hypothesis;
use super::patches::Patch;
use crate::explanation::Explanation;
use crate::tracker::TrackId;

/// Most bodies of a floor: its 1024 panels are 6.5 m².
const BODIES_MAX: usize = 32;

/// Explanations that are kept: two steps of two bodies that could each have been either's, and as many that are nearly
/// the same.
const HYPOTHESES: usize = 16;

/// One that is so much less likely than the best is given up, in natural logarithms: one in 20 000.
const GIVEN_UP: f64 = 10.0;

/// The bodies on a floor.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    /// The likeliest first.
    hypotheses: Vec<Hypothesis>,
    newest: TrackId,
    /// Number of the newest hypothesis.
    branched: u64,
}

impl Bodies {
    /// Takes the patches of a reading at `at_s`. Readings come in the order of time.
    pub fn observe(&mut self, patches: &[Patch], at_s: f64) {
        let mut before = std::mem::take(&mut self.hypotheses);
        if before.is_empty() {
            before.push(Hypothesis::default());
        }
        // A patch begins a body under the same number in all hypotheses.
        let (mut numbers, newest) = (BTreeMap::new(), &mut self.newest);
        let mut number = |patch: usize| {
            *numbers.entry(patch).or_insert_with(|| {
                *newest += 1;
                *newest
            })
        };
        let mut grown: Vec<Hypothesis> = Vec::new();
        for hypothesis in before {
            let mut children = hypothesis.grow(patches, at_s, HYPOTHESES, &mut number);
            // The likeliest goes on under the number of its parent.
            for child in children.iter_mut().skip(1) {
                self.branched += 1;
                child.branch(self.branched);
            }
            grown.extend(children);
        }
        grown.sort_by(|one, other| one.surprise.total_cmp(&other.surprise));
        let least = grown.first().map_or(0.0, |best| best.surprise);
        for mut hypothesis in grown {
            hypothesis.surprise -= least;
            let is_known = self.hypotheses.iter().any(|kept| kept.is_as(&hypothesis));
            if !is_known && hypothesis.surprise < GIVEN_UP && self.hypotheses.len() < HYPOTHESES {
                self.hypotheses.push(hypothesis);
            }
        }
    }

    /// All explanations of who has set which foot, with their bodies at `at_s`; the likeliest first.
    #[must_use]
    pub fn explanations(&self, at_s: f64) -> Vec<Explanation> {
        self.hypotheses.iter().map(|hypothesis| hypothesis.explanation(at_s)).collect()
    }
}

#[cfg(test)]
mod tests;
