//! Whether a door knows what happens: what troubles it, since when all is well, and how sure the count is.
//!
//! ```text
//!   trouble ──▶ well ── 2 s ──▶ trusted          a doubtful track for 0.6 s, or a changed site: no match yet
//! ```

use super::SETTLED_S;
use crate::door::terms::Trouble;
use crate::site::door::Fail;

/// A doubtful track, perhaps no person, that is in the zone for so long, s, makes the count unsure; if it is gone for
/// so long, s, it was no person.
const DOUBT_S: f64 = 0.6;
const DOUBT_GAP_S: f64 = 0.35;

/// Whether what the tracker says can be used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trust {
    /// What is wrong, while the door has failed.
    pub(super) trouble: Option<Trouble>,
    /// What the lock does meanwhile.
    pub(super) fail: Fail,
    /// s.
    pub(super) well_since_s: Option<f64>,
    /// Since when hardly anything of the zone is seen, s.
    blind_since_s: Option<f64>,
}

impl Trust {
    pub(super) const fn starting(fail: Fail) -> Self {
        Self { trouble: Some(Trouble::Starting), fail, well_since_s: None, blind_since_s: None }
    }

    /// For how long hardly anything of the zone has been seen, s.
    pub(super) fn blind_s(&mut self, is_blind: bool, now_s: f64) -> f64 {
        let since_s = *self.blind_since_s.get_or_insert(now_s);
        if !is_blind {
            self.blind_since_s = None;
        }
        now_s - since_s
    }
}

/// How sure the count is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Certainty {
    /// Since when the number matches, s.
    pub(super) match_since_s: Option<f64>,
    /// No match counts before, s.
    pub(super) not_before_s: f64,
    /// When a doubtful track was in the zone last, s.
    doubted_s: f64,
    doubt_since_s: Option<f64>,
}

impl Certainty {
    pub(super) const fn new() -> Self {
        let never_s = f64::NEG_INFINITY;
        Self { match_since_s: None, not_before_s: never_s, doubted_s: never_s, doubt_since_s: None }
    }

    /// Lines were missing up to `now_s`: what held before need not have held since, and in a changed site no time has passed in which
    /// people were found.
    pub(super) fn interrupt(&mut self, now_s: f64) {
        self.match_since_s = None;
        if now_s < self.not_before_s {
            self.not_before_s = now_s + SETTLED_S;
        }
    }

    /// Notes whether a doubtful track is in the zone: perhaps a person who touches another, or crouches.
    pub(super) fn doubt(&mut self, is_doubtful: bool, now_s: f64) {
        if is_doubtful {
            self.doubted_s = now_s;
            self.doubt_since_s.get_or_insert(now_s);
        } else if now_s - self.doubted_s > DOUBT_GAP_S {
            self.doubt_since_s = None;
        }
    }

    /// Whether the count must not be believed.
    pub(super) fn is_in_doubt(&self, now_s: f64) -> bool {
        now_s < self.not_before_s || self.doubt_since_s.is_some_and(|since_s| now_s - since_s >= DOUBT_S)
    }
}
