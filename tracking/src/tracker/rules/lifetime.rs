//! Missed detections: what a scan says about tracks it did not detect, existence decay, and deletion.
//!
//! ```text
//!   place seen empty ─▶ existence falls           missed for 0.3 s ─▶ occlusion: a particle filter
//!   place not seen   ─▶ nothing                   occluded in the open ─▶ half of it is left after 15 s
//! ```

use std::cell::LazyCell;

use super::RuleTracker;
use super::ablation::Idea;
use super::birth::PATIENCE_S;
use super::line_of_sight::Eye;
use super::occlusion::{Cloud, PLACES};
use super::track::{NOBODY, OCCLUDED_S, Track};
use crate::observation::Observation;

/// Weight of a missed detection by a module that never detected the track, against 1 for one that did: beams pass over
/// children.
const UNKNOWN: f64 = 0.2;

/// The existence of an occluded track decays faster after so long without a module that looks there, s.
const UNCOVERED_S: f64 = 0.5;

/// Half-life of an occluded track's existence in the open, s, and where no module looks.
const HALF_LIFE_S: (f64, f64) = (15.0, 3.0);

/// What one such half-life takes, as log-odds: from sure to deleted in three.
const HALVES: f64 = 4.2;

impl RuleTracker {
    /// Updates every track within reach that the observation did not detect.
    pub(super) fn miss(&mut self, observation: &Observation) {
        let eye = LazyCell::new(|| Eye::of(observation));
        let seen_now = self.seen_places(observation.start_s);
        let end_s = observation.start_s + f64::from(observation.view.geometry.period_us()) * 1e-6;
        let (free_space, shadow) = (self.ideas.has(Idea::FreeSpace), self.ideas.has(Idea::Shadow));
        for &index in &self.near.now {
            let track = &mut self.tracks[index];
            if track.hit_in == self.scan || track.near_in != self.scan {
                continue;
            }
            let known = track.known_to(observation.view.module);
            let factor = if known { 1.0 } else { UNKNOWN };
            let Some(cloud) = &mut track.cloud else {
                let look = eye.at_body(track.motion.place(end_s));
                if free_space && look.judged() > 0.8 && look.through > 0.7 {
                    track.existence -= 0.8 * factor;
                    track.reason = "its place is seen empty";
                }
                continue;
            };
            cloud.predict(end_s, &self.plan.walls);
            let enters = cloud.enters();
            let mut covered = 0;
            let likelihood = |place| {
                let (look, would_see) = eye.at_point(place);
                covered += usize::from(would_see);
                let crowded = seen_now.iter().any(|(_, other)| (*other - place).length() < 0.3);
                let beside = if !enters && self.plan.walls.beside(place) { 0.4 } else { 1.0 };
                (1.0 - 0.8 * look.through).min(beside) * if crowded { 0.8 } else { 1.0 }
            };
            let left = if shadow { cloud.weigh(likelihood) } else { cloud.expect(likelihood) };
            if free_space && left < 0.5 {
                track.existence += libm::log(left.max(0.1) * 2.0) * factor;
                track.reason = "its place is seen empty";
            }
            if 2 * covered >= PLACES {
                track.covered_s = track.covered_s.max(end_s);
            }
        }
    }

    /// Lets time pass up to `now_s` for the near tracks: a track without a recent detection is occluded, and its
    /// existence decays in the open.
    pub(super) fn fade_near(&mut self, now_s: f64) {
        for place in 0..self.near.now.len() {
            self.pass(self.near.now[place], now_s);
        }
    }

    /// Deletes the near tracks whose existence is too low.
    pub(super) fn bury_near(&mut self, now_s: f64) {
        for place in (0..self.near.now.len()).rev() {
            self.bury(self.near.now[place], now_s);
        }
    }

    /// Lets time pass for all tracks, and deletes those whose existence is too low.
    pub(super) fn fade_all(&mut self, now_s: f64) {
        for index in 0..self.tracks.len() {
            self.pass(index, now_s);
        }
        for index in (0..self.tracks.len()).rev() {
            self.bury(index, now_s);
        }
    }

    /// Brings the near tracks up to date with the time in which no module reached them.
    pub(super) fn catch_up(&mut self) {
        for place in (0..self.near.now.len()).rev() {
            let index = self.near.now[place];
            self.fade(index, self.passed_s);
            self.bury(index, self.passed_s);
        }
    }

    /// Brings all other tracks up to date.
    pub(super) fn catch_up_all(&mut self) {
        for index in (0..self.tracks.len()).rev() {
            if self.near.now.binary_search(&index).is_err() {
                self.fade(index, self.passed_s);
                self.bury(index, self.passed_s);
            }
        }
    }

    /// Index of the track with this number, if it is not to be deleted.
    pub(super) fn find(&mut self, id: u32) -> Option<usize> {
        let index = self.index_of(id)?;
        self.fade(index, self.passed_s);
        (!is_nobody(&self.tracks[index], self.passed_s)).then_some(index)
    }

    fn pass(&mut self, index: usize, now_s: f64) {
        if self.tracks[index].is_occluded() {
            self.fade(index, now_s);
            return;
        }
        let track = &mut self.tracks[index];
        if track.near_in == self.scan && now_s - track.last_hit_s > OCCLUDED_S {
            let cloud = Cloud::new(now_s, &track.motion, track.last_hit_s, &self.plan.walls, track.id);
            track.cloud = Some(cloud);
            track.reason = "hidden";
            track.faded_s = now_s;
            track.covered_s = now_s;
        }
    }

    fn fade(&mut self, index: usize, now_s: f64) {
        let Some(cloud) = &self.tracks[index].cloud else { return };
        let is_enclosed = self.is_enclosed(cloud.around().0);
        let track = &mut self.tracks[index];
        if !is_enclosed {
            let covered = now_s - track.covered_s < UNCOVERED_S;
            let half_life_s = if covered { HALF_LIFE_S.0 } else { HALF_LIFE_S.1 };
            track.existence -= HALVES * (now_s - track.faded_s).max(0.0) / half_life_s;
        }
        track.faded_s = track.faded_s.max(now_s);
        if !self.ideas.has(Idea::Persistence) && now_s - track.last_hit_s > 1.0 {
            track.existence = NOBODY;
        }
    }

    fn bury(&mut self, index: usize, now_s: f64) {
        if is_nobody(&self.tracks[index], now_s) {
            self.remove(index);
        }
    }
}

/// Whether a track is to be deleted.
fn is_nobody(track: &Track, now_s: f64) -> bool {
    let forgotten = !track.confirmed && now_s - track.last_hit_s >= PATIENCE_S;
    forgotten || track.existence <= NOBODY
}
