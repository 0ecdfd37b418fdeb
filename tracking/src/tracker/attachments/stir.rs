//! Person or thing: a person who stands and waits shifts about; a thing that was put down does not.
//!
//! ```text
//!   static for, s             person   0 1 2 0 1 0 1 1 2 3 0     falls again and again while all of it is in view
//!                             chair    4 5 6 7 8 9 10 11 12 …    only grows; begins anew after an occlusion
//! ```
//!
//! The device reports for how long the beams on a candidate have held their ranges. Only candidates that the same
//! device sees whole in scan after scan are compared, so that a person who passes before a chair does not make it
//! stir. Legs do not count: a track may change from one person's leg to another's.

use crate::observation::Detection;

/// Two scans of one module are no farther apart than this, s: two and a half periods.
const NEXT_S: f64 = 0.25;

/// It has stirred when it was still for so much longer in the scan before, 0.1 s.
const FALLS_DS: u16 = 3;

/// A track that stirs so often is a person.
const STIRRINGS: u32 = 3;

/// A candidate that is still for so long is a thing, 0.1 s: the times counted before were not its own.
const THING_DS: u16 = 50;

/// How often a track has stirred.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stirring {
    times: u32,
    before: Option<Before>,
}

/// The scan before.
#[derive(Clone, Copy, Debug)]
struct Before {
    module: usize,
    at_s: f64,
    static_ds: u16,
}

impl Stirring {
    /// Takes a candidate.
    pub fn update(&mut self, seen: &Detection, module: usize) {
        let static_ds = seen.candidate.static_ds;
        let is_leg = seen.candidate.narrow && seen.is_whole();
        if static_ds >= THING_DS || is_leg {
            self.times = 0;
        }
        if seen.candidate.narrow || !seen.is_whole() {
            self.before = self.before.filter(|before| before.module != module);
            return;
        }
        let before = self.before.filter(|before| seen.at_s - before.at_s < NEXT_S);
        if before.is_some_and(|before| before.module != module) {
            return;
        }
        if before.is_some_and(|before| before.static_ds >= static_ds + FALLS_DS) {
            self.times += 1;
        }
        self.before = Some(Before { module, at_s: seen.at_s, static_ds });
    }

    /// The next candidate is compared with none: the modules have other numbers. How often it has stirred stays.
    pub const fn begin_anew(&mut self) {
        self.before = None;
    }

    /// Whether it has stirred often enough to be a person.
    #[must_use]
    pub const fn is_somebody(&self) -> bool {
        self.times >= STIRRINGS
    }
}
