//! Duplicate tracks: two tracks of one person are always detected one at a time, at the same place.
//!
//! ```text
//!   scans    1 2 3 4 5 6 …
//!   one      ●   ●   ●         never both in one scan, nearer than two bodies can be: after a dozen scans
//!   other      ●   ●   ●       the track that came last is occluded somewhere near
//! ```

use super::occlusion::Cloud;
use super::track::Track;
use super::{RuleTracker, TWINS_M};
use crate::geometry::Point;

/// Nearer than this they are one even if two candidates were seen: a torso and its arm, m.
const ONE_BODY_M: f64 = 0.25;

/// After so many scans in which only one of two tracks was detected they are one person.
const TWIN_SCANS: u32 = 12;

impl RuleTracker {
    /// Separates two tracks that are always detected one at a time at the same place: they are one person, and the
    /// track that came there last is occluded somewhere near.
    pub(super) fn part_twins(&mut self, now_s: f64) {
        let hit = |track: &Track| track.hit_in == self.scan;
        let seen = |track: &Track| track.near_in == self.scan && track.is_seen();
        let near = self.near.now.iter().copied().filter(|&index| seen(&self.tracks[index]));
        let places: Vec<(usize, Point)> =
            near.map(|index| (index, self.tracks[index].motion.place(now_s))).collect();
        for &(one, place) in &places {
            // Some may have become occluded in the meantime.
            if !self.tracks[one].is_seen() {
                continue;
            }
            let nearest = places
                .iter()
                .filter(|&&(other, _)| other != one && self.tracks[other].is_seen())
                .map(|&(other, at)| (other, (at - place).length()))
                .min_by(|one, two| one.1.total_cmp(&two.1))
                .filter(|(_, distance_m)| *distance_m < TWINS_M);
            let Some((other, distance_m)) = nearest else {
                self.tracks[one].twin = 0;
                continue;
            };
            match (hit(&self.tracks[one]), hit(&self.tracks[other])) {
                (true, true) if distance_m > ONE_BODY_M => self.tracks[one].twin = 0,
                (false, false) => {}
                _ => {
                    let track = &mut self.tracks[one];
                    if track.twin == 0 {
                        track.twin_since_s = now_s;
                    }
                    track.twin += 1;
                }
            }
            if self.tracks[one].twin >= TWIN_SCANS
                && self.tracks[one].emerged_s >= self.tracks[other].emerged_s
            {
                let track = &mut self.tracks[one];
                let mut motion = track.motion.clone();
                motion.covariance += nalgebra::Matrix4::identity() * (0.3 * 0.3);
                track.cloud = Some(Cloud::new(now_s, &motion, now_s, &self.plan.walls, track.id));
                track.reason = "taken for another person";
                // The detections since then were of the other track.
                track.last_hit_s = track.last_hit_s.min(track.twin_since_s);
                track.twin = 0;
                self.tracks[other].twin = 0;
            }
        }
    }
}
