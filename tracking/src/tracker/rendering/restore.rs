//! People from before a restart: no scan has spoken for them since, so they come back hidden.
//!
//! ```text
//!   last known ●──▶            samples   ·  · ·
//!   age 8 s                             · ·▒▒· ·    as wide as a person may have gone since, on this side of walls
//!                                        ·  · ·     seen empty: deleted · a hit: the same person
//! ```

use super::body::{Body, SURE, UNSEEN_S};
use super::cloud::{Cloud, SAMPLES};
use super::ground::{Passage, Sighting};
use super::sample::Sample;
use super::{BODIES, Rendering};
use crate::geometry::Point;
use crate::tracker::{DRIFT_MPS, TrackState};

/// Log odds that they are still there: thirty to one, so that two seconds of an empty room are needed to forget them.
const STILL_THERE: f64 = 0.5 * SURE;

/// So often a place is drawn until one is on the same side of all walls; then it is where the person was.
const DRAWS: usize = 8;

impl Rendering {
    /// Restores the people that were known `age_s` before `at_s`, under new numbers.
    pub(super) fn take_back(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        let room = BODIES.saturating_sub(self.bodies.len());
        for person in people.iter().take(room) {
            let [xx, _, yy] = person.covariance_m2;
            let drift_m = DRIFT_MPS * age_s;
            let spread_m = (0.5 * (xx + yy) + drift_m * drift_m).sqrt();
            let count = SAMPLES / self.model.detail.divisor();
            let samples = (0..count).map(|_| self.sample_near(person.at, spread_m)).collect();
            let mut body = Body::begin(self.next_id, STILL_THERE, Cloud::new(samples, at_s));
            self.next_id += 1;
            let plan = &self.terrain.plan;
            body.confirmed = true;
            body.supported_s = at_s - age_s.max(2.0 * UNSEEN_S);
            let inside = plan.enclosed.around(person.at).next();
            body.sighting = Sighting { inside, passage: Passage::None, comes_in: false };
            self.bodies.push(body);
        }
    }

    /// A sample that stands somewhere around a place.
    fn sample_near(&mut self, place: Point, spread_m: f64) -> Sample {
        let (walls, random) = (&self.terrain.plan.walls, &mut self.random);
        let reached = (0..DRAWS).find_map(|_| {
            let (x, y) = random.pair();
            let drawn = place + Point::new(x, y) * spread_m;
            (!walls.between(place, drawn)).then_some(drawn)
        });
        let heading = Point::towards(random.uniform() * core::f64::consts::TAU);
        let at = reached.unwrap_or(place);
        Sample::new(at, Point::default(), heading)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Bench;
    use super::*;
    use crate::tracker::{LifeCycle, PERSON, Tracker};

    fn person(x: f64, y: f64) -> TrackState {
        TrackState { at: Point::new(x, y), ..PERSON }
    }

    #[test]
    fn people_come_back_hidden_as_far_as_they_may_have_gone() {
        let mut bench = Bench::new();
        bench.tracker.restore(&[person(-1.0, 0.0), person(2.0, 0.0)], 4.0, 0.0);
        let tracks = bench.tracker.tracks(0.0);
        assert_eq!(tracks.len(), 2);
        for (track, x) in tracks.iter().zip([-1.0, 2.0]) {
            assert_eq!(track.state, LifeCycle::Occluded);
            assert!(track.existence > 0.9 && track.reason.contains("restart"), "{track:?}");
            assert!((track.at - Point::new(x, 0.0)).length() < 0.5, "{track:?}");
            let variances = [track.covariance_m2[0], track.covariance_m2[2]];
            assert!(variances.iter().all(|variance_m2| (3.0..5.5).contains(variance_m2)), "{track:?}");
        }
    }

    #[test]
    fn no_person_comes_back_behind_a_wall() {
        let mut bench = Bench::within("[[wall]]\npoints = [[0, 1], [4, 1]]");
        bench.tracker.restore(&[person(2.0, 0.7)], 4.0, 0.0);
        let samples = bench.tracker.bodies[0].cloud.samples();
        let walls = &bench.tracker.terrain.plan.walls;
        assert!(samples.iter().all(|sample| !walls.between(Point::new(2.0, 0.7), sample.at)));
    }

    #[test]
    fn who_is_still_there_is_found_under_one_number() {
        let mut bench = Bench::new();
        bench.tracker.restore(&[person(2.0, 0.0)], 2.0, 0.0);
        for _ in 0..20 {
            bench.now_s += 0.001;
            bench.shows(&[(2.2, 0.5)]);
        }
        let tracks = bench.tracks();
        assert_eq!(tracks.len(), 1, "{tracks:?}");
        assert!((tracks[0].id, tracks[0].reason) == (1, "seen"), "{tracks:?}");
    }

    #[test]
    fn who_has_left_is_forgotten() {
        let mut bench = Bench::new();
        bench.tracker.restore(&[person(2.0, 0.0)], 2.0, 0.0);
        (0..100).for_each(|_| bench.shows(&[]));
        assert!(bench.tracks().is_empty(), "{:?}", bench.tracks());
    }
}
