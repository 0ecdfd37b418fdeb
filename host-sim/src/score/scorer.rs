//! Judges a run frame by frame. Its result consists of sums only, so that runs are pooled by addition.
//!
//! ```text
//! Frame ─▶ region ─▶ Judged ─▶ clear, identity, hota, gospa, trajectory, counting ─▶ Tally + Tally + … ─▶ Figures
//! ```

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::counting::{self, CountLog};
use super::frame::{Frame, Ids, Judged};
use super::region::{self, Settings};
use super::{clear, gospa, hota, identity, trajectory};

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

    /// Adds the next frame, in the order of time.
    pub fn frame(&mut self, frame: &Frame) {
        self.counts.frame(frame);
        let (truth, tracks) = region::judged(frame, &self.settings);
        let judged = Judged {
            people: truth.iter().map(|person| self.people.index_of(person.id)).collect(),
            tracks: tracks.iter().map(|track| self.tracks.index_of(track.id)).collect(),
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

    /// The tally, and the counts over time.
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
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
