//! People who are missing: lost on their way in, behind others. What comes into view inside may be one of them.
//!
//! ```text
//!      A B C         they stand inside, and hide what is behind them
//!   ┄┄┄┄┄┄┄┄┄┄┄      entry
//!       ╳ D          was on its way in, and is looked for in vain: its track ends, and D is inside all the same
//! ```
//!
//! Recycling, as in Poisson multi-Bernoulli filters (Williams, Hybrid Poisson and multi-Bernoulli filters, 2012): the probability
//! of a track that ends goes to that of the people of whom no track is known.

use crate::geometry::Point;

/// For so long a person who was lost is expected, s. With 30 and 100 s, of ten people in a crowd one too many is counted more often.
const EXPECTED_S: f64 = 10.0;

/// One who was lost walks no faster, m/s, and is not farther from there at once, m: a brisk walk, and as far as a lost track lags behind.
const WALKS_MPS: f64 = 1.5;
const LAGS_M: f64 = 0.5;

/// Density of a person who is missing, times 2π, 1/m²: anywhere on 2π m².
pub const DENSITY: f64 = 1.0;

/// See the module.
#[derive(Debug, Default)]
pub struct Missing {
    /// Where each was lost, and when, s.
    lost: Vec<(Point, f64)>,
}

impl Missing {
    /// Notes where one was lost.
    pub fn note(&mut self, place: Point, now_s: f64) {
        self.lost.push((place, now_s));
    }

    /// Expects those no longer who were lost long ago.
    pub fn forget(&mut self, now_s: f64) {
        self.lost.retain(|(_, lost_s)| now_s - lost_s < EXPECTED_S);
    }

    /// Whether one may be at a place.
    pub fn may_be_at(&self, place: Point, now_s: f64) -> bool {
        self.nearest(place, now_s).is_some()
    }

    /// The one who may be at a place is missing no more.
    pub fn find(&mut self, place: Point, now_s: f64) {
        if let Some(number) = self.nearest(place, now_s) {
            self.lost.remove(number);
        }
    }

    fn nearest(&self, place: Point, now_s: f64) -> Option<usize> {
        let distances = self.lost.iter().map(|&(lost, lost_s)| {
            let distance_m = (place - lost).length();
            (distance_m, distance_m <= LAGS_M + WALKS_MPS * (now_s - lost_s))
        });
        let near = distances.enumerate().filter(|(_, (_, is_near))| *is_near);
        near.min_by(|(_, one), (_, other)| one.0.total_cmp(&other.0)).map(|(number, _)| number)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Bench, SCAN_S};
    use super::*;

    const ROOM: &str = "[[zone]]\nname = 'a'\npolygon = [[0, -2], [3, -2], [3, 2], [0, 2]]\nenclosed = true\n\
        [[entry]]\nname = 'e'\nline = [[3, -2], [3, 2]]\nzone = 'a'";

    #[test]
    fn one_whose_track_ends_on_the_way_in_is_missing_and_one_who_walked_away_is_not() {
        for (step_m, expected) in [(-0.03, true), (0.03, false)] {
            let mut bench = Bench::within(ROOM);
            let x = |scan: i32| 3.4 - step_m * f64::from(20 - scan);
            (0..20).for_each(|scan| bench.shows(&[(x(scan).min(3.8), 0.0)]));
            assert_eq!(bench.tracks().len(), 1, "{step_m}");
            (0..30).for_each(|_| bench.shows(&[]));
            assert!(bench.tracks().is_empty());
            let may_be_inside = bench.tracker.missing.may_be_at(Point::new(2.5, 0.0), bench.now_s + 1.0);
            assert_eq!(may_be_inside, expected, "{step_m}");
        }
    }

    #[test]
    fn where_a_person_is_missing_one_comes_into_view_at_once() {
        let found_after_s = |is_missing: bool| {
            let mut bench = Bench::within(ROOM);
            if is_missing {
                bench.tracker.missing.note(Point::new(1.6, 0.0), 0.0);
            }
            let found = (0..40).find(|_| {
                bench.shows(&[(1.5, 0.0)]);
                !bench.tracks().is_empty()
            });
            assert!(!bench.tracker.missing.may_be_at(Point::new(1.5, 0.0), bench.now_s));
            f64::from(found.unwrap()) * SCAN_S
        };
        let (missing, complete) = (found_after_s(true), found_after_s(false));
        assert!(missing < 0.6 && complete >= 2.0, "{missing} {complete}");
    }

    #[test]
    fn one_who_was_lost_is_expected_for_a_while_as_far_as_people_walk() {
        let mut missing = Missing::default();
        let (lost, on) = (Point::new(0.0, -1.5), Point::new(0.0, 0.5));
        assert!(!missing.may_be_at(lost, 5.0));
        missing.note(lost, 5.0);
        assert!(missing.may_be_at(lost, 5.0) && !missing.may_be_at(on, 5.0));
        assert!(missing.may_be_at(on, 6.1));
        missing.forget(14.9);
        assert!(missing.may_be_at(on, 14.9));
        missing.forget(15.1);
        assert!(!missing.may_be_at(on, 15.1));
    }

    #[test]
    fn one_who_is_found_is_expected_no_more() {
        let mut missing = Missing::default();
        let (one, other) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0));
        missing.note(one, 0.0);
        missing.note(other, 0.0);
        missing.find(Point::new(0.9, 0.0), 1.0);
        assert!(!missing.may_be_at(other, 0.1) && missing.may_be_at(one, 0.1));
        missing.find(one, 1.0);
        missing.find(one, 1.0);
        assert!(!missing.may_be_at(one, 1.0));
    }
}
