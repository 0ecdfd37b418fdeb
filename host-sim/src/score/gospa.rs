//! GOSPA (Rahmathullah, García-Fernández and Svensson 2017) with p = 2, c = 1 m, α = 2.
//!
//! ```text
//! GOSPA² = Σ d²  over the pairs nearer than c      localisation
//!        + c²/2  for every person left over         missed
//!        + c²/2  for every track left over          false         pairs chosen so that the sum is least
//! ```

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::assign;
use super::frame::Judged;

/// Cut-off, m.
const CUT_OFF_M: f64 = 1.0;
/// What one too many or too few costs, m².
const ODD_M2: f64 = CUT_OFF_M * CUT_OFF_M / 2.0;

/// Sums over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames.
    pub frames: u64,
    /// Sum of the frames' GOSPA, m.
    pub gospa_m: f64,
    /// Sum of the squared distances of the pairs, m².
    pub localisation_m2: f64,
    /// Sum for people left over, m².
    pub missed_m2: f64,
    /// Sum for tracks left over, m².
    pub false_m2: f64,
}

impl Tally {
    /// Adds a frame.
    pub fn frame(&mut self, judged: &Judged) {
        let (people, tracks) = (judged.people.len(), judged.tracks.len());
        let saved_m2 = |row: usize, column: usize| {
            let distance_m = judged.distance_m(row, column);
            (CUT_OFF_M * CUT_OFF_M - distance_m * distance_m).max(0.0)
        };
        let pairs = assign::heaviest(people, tracks, |row, column| assign::quantised(saved_m2(row, column)));
        let square = |&(row, column): &(usize, usize)| judged.distance_m(row, column).powi(2);
        let localisation_m2: f64 = pairs.iter().map(square).sum();
        let missed_m2 = (people - pairs.len()) as f64 * ODD_M2;
        let false_m2 = (tracks - pairs.len()) as f64 * ODD_M2;
        *self += &Self {
            frames: 1,
            gospa_m: (localisation_m2 + missed_m2 + false_m2).sqrt(),
            localisation_m2,
            missed_m2,
            false_m2,
        };
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.frames += other.frames;
        self.gospa_m += other.gospa_m;
        self.localisation_m2 += other.localisation_m2;
        self.missed_m2 += other.missed_m2;
        self.false_m2 += other.false_m2;
    }
}
