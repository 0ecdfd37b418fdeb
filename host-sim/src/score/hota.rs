//! HOTA (Luiten and others 2021), over distances: detection and association in one figure.
//!
//! ```text
//! similarity  S = max(0, 1 − d / 1 m)              levels α = 0.05, 0.10 … 0.95: a pair counts from S ≥ α on
//! DetA(α) = TP / (TP + FN + FP)                    AssA(α) = mean over the pairs of how much of both
//! HOTA = mean over α of √(DetA(α) · AssA(α))                 lives the two spend together
//! ```
//!
//! Within a frame, pairs are chosen by similarity times how well the two go together over the whole run:
//! that is known at the end only, so the frames are kept until then. As TrackEval does it, pooling included.

use std::collections::BTreeMap;
use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::assign;
use super::frame::{Ids, Judged};

/// Distance at which two are no longer alike, m.
const REACH_M: f64 = 1.0;
/// Number of levels.
pub const LEVELS: usize = 19;

/// The level with this index.
fn level(index: usize) -> f64 {
    0.05 * (index + 1) as f64
}

/// Keeps one run.
#[derive(Clone, Debug, Default)]
pub struct Hota {
    frames: Vec<Judged>,
    /// Similarity of person and track, relative to the other pairs of either, summed over the frames.
    together: BTreeMap<(usize, usize), f64>,
}

/// Sums over runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// People, frame by frame.
    pub people: u64,
    /// Tracks, frame by frame.
    pub tracks: u64,
    /// By level: pairs.
    pub pairs: [u64; LEVELS],
    /// By level: sum over the pairs of their association.
    pub association: [f64; LEVELS],
}

/// The three figures, each the mean over the levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scores {
    /// HOTA.
    pub hota: f64,
    /// Its detection part.
    pub detection: f64,
    /// Its association part.
    pub association: f64,
}

fn similarity(judged: &Judged, person: usize, track: usize) -> f64 {
    (1.0 - judged.distance_m(person, track) / REACH_M).max(0.0)
}

impl Hota {
    /// Adds a frame.
    pub fn frame(&mut self, judged: Judged) {
        let (rows, columns) = (judged.people.len(), judged.tracks.len());
        let of_person = |row| (0..columns).map(|column| similarity(&judged, row, column)).sum::<f64>();
        let of_track = |column| (0..rows).map(|row| similarity(&judged, row, column)).sum::<f64>();
        for row in 0..rows {
            for column in 0..columns {
                let alike = similarity(&judged, row, column);
                if alike > 0.0 {
                    *self.together.entry((judged.people[row], judged.tracks[column])).or_default() +=
                        alike / (of_person(row) + of_track(column) - alike);
                }
            }
        }
        self.frames.push(judged);
    }

    /// The sums.
    #[must_use]
    pub fn tally(&self, people: &Ids, tracks: &Ids) -> Tally {
        let lives = |pair: &(usize, usize)| (people.frames[pair.0] + tracks.frames[pair.1]) as f64;
        let alignment: BTreeMap<_, _> =
            self.together.iter().map(|(pair, sum)| (*pair, sum / (lives(pair) - sum))).collect();
        let mut tally = Tally {
            people: people.frames.iter().sum(),
            tracks: tracks.frames.iter().sum(),
            ..Tally::default()
        };
        let mut matches: BTreeMap<(usize, usize), [u64; LEVELS]> = BTreeMap::new();
        for judged in &self.frames {
            let ids = |row: usize, column: usize| (judged.people[row], judged.tracks[column]);
            let chosen = assign::heaviest(judged.people.len(), judged.tracks.len(), |row, column| {
                let aligned = alignment.get(&ids(row, column)).copied().unwrap_or(0.0);
                assign::quantised(aligned * similarity(judged, row, column))
            });
            for (row, column) in chosen {
                let alike = similarity(judged, row, column);
                let own = matches.entry(ids(row, column)).or_default();
                for (index, pairs) in own.iter_mut().enumerate() {
                    *pairs += u64::from(alike >= level(index) - f64::EPSILON);
                }
            }
        }
        for (pair, own) in &matches {
            for (index, &number) in own.iter().enumerate() {
                tally.pairs[index] += number;
                let number = number as f64;
                tally.association[index] += number * number / (lives(pair) - number);
            }
        }
        tally
    }
}

impl Tally {
    /// The figures; none if there was neither a person nor a track.
    #[must_use]
    pub fn scores(&self) -> Option<Scores> {
        if self.people + self.tracks == 0 {
            return None;
        }
        let mut sum = Scores { hota: 0.0, detection: 0.0, association: 0.0 };
        for (&pairs, &association) in self.pairs.iter().zip(&self.association) {
            let detection = pairs as f64 / (self.people + self.tracks - pairs) as f64;
            let association = if pairs == 0 { 0.0 } else { association / pairs as f64 };
            sum.hota += (detection * association).sqrt();
            sum.detection += detection;
            sum.association += association;
        }
        let mean = |sum: f64| sum / LEVELS as f64;
        Some(Scores {
            hota: mean(sum.hota),
            detection: mean(sum.detection),
            association: mean(sum.association),
        })
    }
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.people += other.people;
        self.tracks += other.tracks;
        for (own, other) in self.pairs.iter_mut().zip(&other.pairs) {
            *own += other;
        }
        for (own, other) in self.association.iter_mut().zip(&other.association) {
            *own += other;
        }
    }
}
