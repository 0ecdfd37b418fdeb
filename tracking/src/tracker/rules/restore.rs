//! Tracks from before a restart: unobserved since, so they come back as occluded.
//!
//! ```text
//!   last known ●──▶            particles  ·  · ·
//!   age 8 s                              · ·▒▒· ·    as wide as a person may have gone since
//!                                         ·  · ·     seen empty: deleted · a detection: the same person
//! ```

use nalgebra::{Matrix2, Vector2};

use super::occlusion::Cloud;
use super::track::{SURE, Track};
use super::{PROCESS_NOISE, RuleTracker};
use crate::geometry::Point;
use crate::tracker::attachments::stir::Stirring;
use crate::tracker::history::SeenBy;
use crate::tracker::kalman::Kinematics;
use crate::tracker::{DRIFT_MPS, TrackState};

/// Log-odds that they are still there: as sure as a fresh birth, twenty to one.
const STILL_THERE: f64 = 0.5 * SURE;

impl RuleTracker {
    /// Restores the people that were known `age_s` before `at_s`, under new numbers.
    pub(super) fn take_back(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        for person in people {
            let place = Vector2::new(person.at.x, person.at.y);
            let [xx, xy, yy] = person.covariance_m2;
            let drift_m = DRIFT_MPS * age_s;
            let spread = Matrix2::new(xx, xy, xy, yy) + Matrix2::identity() * (drift_m * drift_m);
            let motion = Kinematics::new(at_s, place, &spread, 0.0, PROCESS_NOISE);
            let cloud = Cloud::new(at_s, &motion, at_s, &self.plan.walls, self.next_id);
            let at = Point::new(person.at.x, person.at.y);
            self.tracks.push(Track {
                id: self.next_id,
                motion,
                cloud: Some(cloud),
                confirmed: true,
                existence: STILL_THERE,
                first_s: at_s,
                last_hit_s: at_s,
                first_at: at,
                width_m: 0.0,
                seen_by: SeenBy::default(),
                hit_in: 0,
                near_in: 0,
                faded_s: at_s,
                covered_s: at_s,
                beside: None,
                rest: (at, at_s),
                is_inside: self.is_enclosed(at),
                unexplained: None,
                still_s: f64::NEG_INFINITY,
                stirring: Stirring::default(),
                size: None,
                company: None,
                part_of: None,
                faces: None,
                reason: "known before a restart, not seen since",
                twin: 0,
                twin_since_s: at_s,
                emerged_s: at_s,
            });
            self.next_id += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::site::Site;
    use crate::tracker::rules::ablation::Ideas;
    use crate::tracker::{LifeCycle, PERSON, Tracker};

    fn person(x: f64) -> TrackState {
        TrackState { at: Point::new(x, 0.0), ..PERSON }
    }

    #[test]
    fn people_come_back_hidden_where_they_were_and_fade_if_no_module_sees_them() {
        let mut tracker = RuleTracker::new(&Arc::new(Site::default()), Ideas::default());
        tracker.restore(&[person(-1.0), person(2.0)], 10.0, 0.0);
        let tracks = tracker.tracks(0.1);
        assert_eq!(tracks.len(), 2);
        for (track, x) in tracks.iter().zip([-1.0, 2.0]) {
            assert_eq!(track.state, LifeCycle::Occluded);
            assert!((track.at - Point::new(x, 0.0)).length() < 2.0 && track.covariance_m2[0] > 1.0);
            assert!(track.existence > 0.9 && track.reason.contains("restart"));
        }
        assert!(tracker.tracks(600.0).is_empty());
    }
}
