//! True people and tracks at one time: the input of all scores.
//!
//! ```text
//! Frame  truth   (id, place, beams) …    as the world and the tracker say it
//!        tracks  (id, place, covariance) …
//! Judged indices in the run instead of numbers, and every distance between them
//! ```

use std::collections::BTreeMap;

use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{PersonLine, TrackLine};
use kehai_tracking::tracker::{LifeCycle, TrackState};

use crate::run::SeenPerson;

/// From this number of beams on a person counts as visible.
pub const VISIBLE_BEAMS: u32 = 10;

/// True people and tracks at one time.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// s.
    pub t_s: f64,
    /// True people.
    pub truth: &'a [Target],
    /// Tracks of the tracker.
    pub tracks: &'a [Estimate],
}

/// One person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Never used for another person.
    pub id: u64,
    /// Middle of the body, m.
    pub at: Point,
    /// Beams of the sensor that saw this person best within the last 0.2 s, where they were counted.
    pub beams: Option<u32>,
}

/// One track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Never used for another track.
    pub id: u64,
    /// m.
    pub at: Point,
    /// Covariance of the place: xx, xy, yy in m².
    pub covariance_m2: Option<[f64; 3]>,
    /// Where in its life.
    pub state: LifeCycle,
}

impl From<&PersonLine> for Target {
    fn from(person: &PersonLine) -> Self {
        Self { id: person.id, at: Point::new(person.x, person.y), beams: person.beams }
    }
}

impl From<&SeenPerson> for Target {
    fn from(person: &SeenPerson) -> Self {
        Self { id: u64::from(person.id), at: Point::new(person.x, person.y), beams: Some(person.beams) }
    }
}

impl From<&TrackLine> for Estimate {
    fn from(track: &TrackLine) -> Self {
        Self { id: track.id, at: Point::new(track.x, track.y), covariance_m2: track.cov, state: track.state }
    }
}

impl From<&TrackState> for Estimate {
    fn from(track: &TrackState) -> Self {
        Self { id: track.id, at: track.at, covariance_m2: Some(track.covariance_m2), state: track.state }
    }
}

/// The people and tracks judged in one frame, by their indices in the run, with all distances between them.
#[derive(Clone, Debug, Default)]
pub struct Judged {
    /// Index of each person.
    pub(super) people: Vec<usize>,
    /// Index of each track.
    pub(super) tracks: Vec<usize>,
    /// m, person by person.
    pub(super) distances_m: Vec<f64>,
}

impl Judged {
    /// Distance of the frame's `person`-th person and `track`-th track, m.
    pub(super) fn distance_m(&self, person: usize, track: usize) -> f64 {
        self.distances_m[person * self.tracks.len() + track]
    }
}

/// Numbers become indices in the order of their appearance; how often each was there.
#[derive(Clone, Debug, Default)]
pub struct Ids {
    pub(super) index: BTreeMap<u64, usize>,
    pub(super) frames: Vec<u64>,
}

impl Ids {
    pub(super) fn index_of(&mut self, id: u64) -> usize {
        let next = self.index.len();
        let index = *self.index.entry(id).or_insert(next);
        if index == next {
            self.frames.push(0);
        }
        self.frames[index] += 1;
        index
    }
}

/// `part / whole`; none if `whole` is zero.
pub(super) fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}
