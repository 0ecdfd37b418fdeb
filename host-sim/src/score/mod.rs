//! How good a tracker is: its tracks against the truth, in the figures the literature uses.
//!
//! ```text
//! Frame ─▶ region ─▶ Judged ─┬─▶ clear       MOTA, MOTP, switches, precision, recall, errors, NEES
//!  truth   who is judged     ├─▶ identity    IDF1
//!  tracks                    ├─▶ hota        HOTA, DetA, AssA
//!                            ├─▶ gospa       GOSPA and its parts
//!       └─▶ counting         └─▶ trajectory  paper D's identification precision and recall
//!           how many in the area            ╲
//!                                            Tally ─▶ pooled over runs ─▶ Figures
//! ```
//!
//! One [`Scorer`] a run. What it leaves is a [`Tally`]: sums only, so that runs are pooled by adding theirs.
//! Every figure of it agrees with py-motmetrics and TrackEval (`tests/score_reference.rs`).

pub mod assign;
pub mod clear;
pub mod counting;
pub mod figures;
pub mod gospa;
pub mod hota;
pub mod identity;
pub mod pairing;
pub mod region;
pub mod statistics;
pub mod trajectory;

use std::collections::BTreeMap;
use std::ops::AddAssign;

use host_tracker::geometry::Point;
use host_tracker::jsonl::{PersonLine, TrackLine};
use host_tracker::trackers::{LifeCycle, TrackState};

pub use self::counting::CountLog;
pub use self::figures::Figures;
pub use self::region::Region;
use crate::run::Somebody;

/// From this number of beams on somebody counts as visible.
pub const VISIBLE_BEAMS: u32 = 10;

/// Everybody at one time.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// s.
    pub t_s: f64,
    /// Who is there.
    pub truth: &'a [Target],
    /// What the tracker says.
    pub tracks: &'a [Estimate],
}

/// One person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Never used for anybody else.
    pub id: u64,
    /// Middle of the body, m.
    pub at: Point,
    /// Beams of the sensor that saw this person best within the last 0.2 s, where they were counted.
    pub beams: Option<u32>,
}

/// One track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Never used for anybody else.
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

impl From<&Somebody> for Target {
    fn from(person: &Somebody) -> Self {
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
        Self {
            id: u64::from(track.id),
            at: track.at,
            covariance_m2: Some(track.covariance_m2),
            state: track.state,
        }
    }
}

/// What is judged, and how strictly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// A track farther than this from a person is not that person, m.
    pub gate_m: f64,
    /// Where people and tracks are judged; everywhere without it. See [`region`].
    pub region: Option<Region>,
    /// Where people are counted; the region without it.
    pub area: Option<Region>,
    /// Whether tentative tracks are judged as well.
    pub tentative: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { gate_m: 0.5, region: None, area: None, tentative: false }
    }
}

impl Settings {
    /// Whether a track is judged at all.
    fn takes(&self, track: &Estimate) -> bool {
        self.tentative || track.state != LifeCycle::Tentative
    }
}

/// Judges one run, frame by frame.
#[derive(Debug)]
pub struct Scorer {
    settings: Settings,
    people: Ids,
    tracks: Ids,
    counts: CountLog,
    clear: clear::Clear,
    identity: identity::Identity,
    hota: hota::Hota,
    gospa: gospa::Tally,
    trajectory: trajectory::Trajectories,
}

impl Scorer {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            people: Ids::default(),
            tracks: Ids::default(),
            counts: CountLog::new(settings.area.or(settings.region), settings.tentative),
            clear: clear::Clear::default(),
            identity: identity::Identity::default(),
            hota: hota::Hota::default(),
            gospa: gospa::Tally::default(),
            trajectory: trajectory::Trajectories::default(),
        }
    }

    /// Takes the next frame, in the order of time.
    pub fn frame(&mut self, frame: &Frame) {
        self.counts.frame(frame);
        let (truth, tracks) = region::judged(frame, &self.settings);
        let judged = Judged {
            people: truth.iter().map(|person| self.people.see(person.id)).collect(),
            tracks: tracks.iter().map(|track| self.tracks.see(track.id)).collect(),
            distances_m: truth
                .iter()
                .flat_map(|person| tracks.iter().map(|track| (person.at - track.at).length()))
                .collect(),
        };
        let matches = self.clear.frame(&judged, &truth, &tracks, self.settings.gate_m);
        self.identity.frame(&judged, self.settings.gate_m);
        self.hota.frame(judged.clone());
        self.gospa.frame(&judged);
        self.trajectory.frame(&judged, &matches);
    }

    /// What came out, and how many were counted when.
    #[must_use]
    pub fn finish(self) -> (Tally, CountLog) {
        let tally = Tally {
            runs: 1,
            counting: self.counts.tally(),
            clear: self.clear.tally(),
            identity: self.identity.tally(&self.people, &self.tracks),
            hota: self.hota.tally(&self.people, &self.tracks),
            gospa: self.gospa,
            trajectory: self.trajectory.tally(&self.people, &self.tracks),
        };
        (tally, self.counts)
    }
}

/// Sums over one run or many: add tallies to pool them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Runs in it.
    pub runs: u64,
    /// Counting.
    pub counting: counting::Tally,
    /// CLEAR MOT.
    pub clear: clear::Tally,
    /// IDF1.
    pub identity: identity::Tally,
    /// HOTA.
    pub hota: hota::Tally,
    /// GOSPA.
    pub gospa: gospa::Tally,
    /// Paper D.
    pub trajectory: trajectory::Tally,
}

impl AddAssign<&Self> for Tally {
    fn add_assign(&mut self, other: &Self) {
        self.runs += other.runs;
        self.counting += &other.counting;
        self.clear += &other.clear;
        self.identity += &other.identity;
        self.hota += &other.hota;
        self.gospa += &other.gospa;
        self.trajectory += &other.trajectory;
    }
}

/// Those judged in one frame, by their indices in the run, with every distance between them.
#[derive(Clone, Debug, Default)]
pub struct Judged {
    /// Index of each person.
    people: Vec<usize>,
    /// Index of each track.
    tracks: Vec<usize>,
    /// m, person by person.
    distances_m: Vec<f64>,
}

impl Judged {
    /// Distance of the frame's `person`-th person and `track`-th track, m.
    fn distance_m(&self, person: usize, track: usize) -> f64 {
        self.distances_m[person * self.tracks.len() + track]
    }
}

/// Numbers become indices in the order of their appearance; how often each was there.
#[derive(Clone, Debug, Default)]
pub struct Ids {
    index: BTreeMap<u64, usize>,
    frames: Vec<u64>,
}

impl Ids {
    fn see(&mut self, id: u64) -> usize {
        let next = self.index.len();
        let index = *self.index.entry(id).or_insert(next);
        if index == next {
            self.frames.push(0);
        }
        self.frames[index] += 1;
        index
    }
}

/// `part / whole`, where there is a whole.
fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

#[cfg(test)]
mod tests;
