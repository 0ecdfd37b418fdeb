//! IDF1 (Ristani and others 2016): one track for each person over the whole run, chosen as well as possible.
//!
//! ```text
//!            track 5   track 7        frames in which they are within the gate
//! person 1      80        15     ─▶   1 ↔ 5, 2 ↔ 7: IDTP = 80 + 60
//! person 2       0        60          IDF1 = 2 IDTP / (frames of people + frames of tracks)
//! ```

use std::collections::BTreeMap;
use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::assign;
use super::frame::{Ids, Judged};

/// Judges one run.
#[derive(Clone, Debug, Default)]
pub struct Identity {
    /// Frames in which this person and this track are within the gate.
    near: BTreeMap<(usize, usize), u64>,
}

/// Sums over runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames in which a person is its one track.
    pub matches: u64,
    /// People, frame by frame.
    pub people: u64,
    /// Tracks, frame by frame.
    pub tracks: u64,
}

impl Identity {
    /// Adds a frame.
    pub fn frame(&mut self, judged: &Judged, gate_m: f64) {
        for (person, &row) in judged.people.iter().enumerate() {
            for (track, &column) in judged.tracks.iter().enumerate() {
                if judged.distance_m(person, track) <= gate_m {
                    *self.near.entry((row, column)).or_default() += 1;
                }
            }
        }
    }

    /// The sums.
    #[must_use]
    pub fn tally(&self, people: &Ids, tracks: &Ids) -> Tally {
        let frames = |row, column| self.near.get(&(row, column)).copied().unwrap_or(0);
        let pairs = assign::heaviest(people.frames.len(), tracks.frames.len(), |row, column| {
            frames(row, column) as i64
        });
        Tally {
            matches: pairs.into_iter().map(|(row, column)| frames(row, column)).sum(),
            people: people.frames.iter().sum(),
            tracks: tracks.frames.iter().sum(),
        }
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.matches += other.matches;
        self.people += other.people;
        self.tracks += other.tracks;
    }
}
