//! Births: what is left over is a limb of somebody, somebody hidden who comes out, or, with enough evidence, new.
//!
//! ```text
//!   left over ─▶ beside somebody seen ──────────▶ his arm, bag or leg
//!             ─▶ tentative, gathers evidence ───▶ confirmed
//!                 └ inside an enclosed zone, away from its entries: the likeliest of the hidden, if any could be here
//! ```

use super::ideas::Idea;
use super::track::{SURE, Track};
use super::{AGILITY, Kehai, associate, cost};
use crate::geometry::Point;
use crate::sighting::{Seen, Sighting};
use crate::trackers::kalman::Kinematics;

/// Forgotten after so long without a candidate, s.
pub const PATIENCE_S: f64 = 0.6;

/// Evidence that makes somebody: eight whole wide candidates, 0.4 s with two modules.
const ENOUGH: f64 = 4.0;

/// A narrow candidate so near to somebody seen is a part of him, m: an arm's reach.
const REACH_M: f64 = 0.5;

/// A wide one, m: two bodies cannot be nearer.
const BODY_M: f64 = 0.3;

/// Nobody is born nearer to somebody, m.
const ROOM_M: f64 = 0.4;

/// Nearer to an entry than this somebody may just have come, m.
const ENTRY_M: f64 = 0.35;

/// How fast somebody hidden may have walked, m/s.
const WALK_MPS: f64 = 1.0;

impl Kehai {
    /// Takes away what belongs to people already seen in this scan.
    pub(super) fn drop_limbs(&self, sighting: &Sighting, pieces: &[Seen], taken: &mut [bool]) {
        let seen: Vec<Point> = self
            .tracks
            .iter()
            .filter(|track| track.confirmed && !track.is_hidden())
            .map(|track| track.motion.place(sighting.start_s))
            .collect();
        for (piece, taken) in pieces.iter().zip(taken.iter_mut()).filter(|(_, taken)| !**taken) {
            let centre = Point::new(piece.centre.x, piece.centre.y);
            let reach_m = if piece.candidate.narrow { REACH_M } else { BODY_M };
            *taken = seen.iter().any(|&place| {
                (place - centre).length() < reach_m || (place - piece.chord_middle()).length() < reach_m
            });
        }
    }

    /// Lets appearances grow on what is left, and new ones begin.
    pub(super) fn grow(&mut self, sighting: &Sighting, pieces: &[Seen], taken: &mut [bool]) {
        let tentative: Vec<usize> =
            (0..self.tracks.len()).filter(|&index| !self.tracks[index].confirmed).collect();
        let free: Vec<usize> = (0..pieces.len()).filter(|&index| !taken[index]).collect();
        let assigned = associate::assign(
            &vec![super::UNASSIGNED; tentative.len()],
            free.len(),
            super::UNASSIGNED,
            |row, column| cost(&self.tracks[tentative[row]], &pieces[free[column]]),
        );
        let mut ready = Vec::new();
        for (row, column) in assigned.into_iter().enumerate() {
            let Some(column) = column else { continue };
            let (track, index) = (tentative[row], free[column]);
            taken[index] = true;
            self.hit(track, index, sighting, pieces, taken);
            let gain = self.evidence(&pieces[index], self.tracks[track].id);
            let track = &mut self.tracks[track];
            track.existence += gain;
            if track.existence >= ENOUGH && track.width_m >= 0.2 {
                ready.push(track.id);
            }
        }
        for id in ready {
            self.confirm(id);
        }
        for index in 0..pieces.len() {
            if !taken[index] {
                taken[index] = true;
                self.begin(&pieces[index], sighting.view.module);
            }
        }
    }

    /// How much a candidate speaks for somebody of its own.
    fn evidence(&self, seen: &Seen, own: u32) -> f64 {
        let centre = Point::new(seen.centre.x, seen.centre.y);
        let beside = |track: &Track| {
            track.id != own
                && track.confirmed
                && !track.is_hidden()
                && (track.motion.place(seen.at_s) - centre).length() < ROOM_M
        };
        if self.tracks.iter().any(beside) {
            return -0.2;
        }
        match (seen.candidate.narrow, seen.is_whole()) {
            (false, true) => 0.5,
            (false, false) => 0.3,
            (true, _) => 0.1,
        }
    }

    fn begin(&mut self, seen: &Seen, module: usize) {
        let centre = Point::new(seen.centre.x, seen.centre.y);
        let motion = Kinematics::new(seen.at_s, seen.centre, &seen.covariance, 1.0, AGILITY);
        self.tracks.push(Track {
            id: self.next_id,
            motion,
            cloud: None,
            confirmed: !self.ideas.has(Idea::StrictBirths),
            existence: if self.ideas.has(Idea::StrictBirths) { 0.0 } else { 2.0 },
            first_s: seen.at_s,
            last_hit_s: seen.at_s,
            first_at: centre,
            width_m: seen.width_m,
            seen_by: 1 << (module % 128),
            reason: "appeared",
            twin: 0,
            emerged_s: seen.at_s,
        });
        self.next_id += 1;
    }

    /// Makes an appearance somebody: new, or one of the hidden.
    fn confirm(&mut self, id: u32) {
        let Some(index) = self.tracks.iter().position(|track| track.id == id) else { return };
        let track = &self.tracks[index];
        let (at_s, at) = (track.last_hit_s, track.motion.place(track.last_hit_s));
        let interior = self.is_enclosed(track.first_at) && self.entry_m(track.first_at) > ENTRY_M;
        if interior && self.ideas.has(Idea::Relink) {
            let likeliest = self
                .tracks
                .iter()
                .enumerate()
                .filter(|(_, other)| other.confirmed && other.is_hidden() && !track.was_beside(other))
                .map(|(other, hidden)| {
                    let last = hidden.motion.place(hidden.last_hit_s);
                    let reach_m = 0.5 + WALK_MPS * (at_s - hidden.last_hit_s).max(0.0);
                    (other, (last - at).length() / reach_m)
                })
                .filter(|(_, effort)| *effort < 1.0)
                .min_by(|one, two| one.1.total_cmp(&two.1));
            if let Some((hidden, _)) = likeliest {
                let found = self.tracks[index].clone();
                let hidden = &mut self.tracks[hidden];
                hidden.motion = found.motion;
                hidden.cloud = None;
                hidden.last_hit_s = found.last_hit_s;
                hidden.seen_by |= found.seen_by;
                hidden.existence = SURE;
                hidden.reason = "came out of hiding";
                hidden.emerged_s = found.last_hit_s;
                hidden.twin = 0;
                self.tracks.remove(index);
                return;
            }
            if track.existence < 2.0 * ENOUGH {
                return;
            }
        }
        let track = &mut self.tracks[index];
        track.confirmed = true;
        track.existence = SURE * 0.5;
        track.reason = "seen";
    }
}
