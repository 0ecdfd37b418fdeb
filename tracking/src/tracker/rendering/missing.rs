//! People who are missing: lost on their way in, behind others. What comes into view inside may be one of them.
//! A body that was still tentative is one as likely as it existed.
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

/// Least existence that is expected: half of what a body begins with outside. With less it was looked for in vain.
const LEAST: f64 = 0.05;

/// Most that are kept: three groups of twenty.
const KEPT: usize = 64;

/// One who was lost walks no faster, m/s, and is not farther from there at once, m: a brisk walk, and as far as a lost track lags behind.
const WALKS_MPS: f64 = 1.5;
const LAGS_M: f64 = 0.5;

/// Density of a person who is missing, times 2π, 1/m²: anywhere on 2π m².
pub const DENSITY: f64 = 1.0;

/// See the module.
#[derive(Debug, Default)]
pub struct Missing {
    /// The newest is the last.
    lost: Vec<Lost>,
}

/// Where and when one was lost, and how likely it was there.
#[derive(Debug)]
struct Lost {
    at: Point,
    at_s: f64,
    existence: f64,
}

impl Lost {
    fn may_be_at(&self, place: Point, now_s: f64) -> bool {
        (place - self.at).length() <= LAGS_M + WALKS_MPS * (now_s - self.at_s)
    }
}

impl Missing {
    /// Notes where one was lost that was there with this probability.
    pub fn note(&mut self, at: Point, existence: f64, at_s: f64) {
        if existence < LEAST {
            return;
        }
        if self.lost.len() >= KEPT {
            self.lost.remove(0);
        }
        self.lost.push(Lost { at, at_s, existence });
    }

    /// Expects those no longer who were lost long ago.
    pub fn forget(&mut self, now_s: f64) {
        self.lost.retain(|lost| now_s - lost.at_s < EXPECTED_S);
    }

    /// Probability that at least one is missing who may be at a place.
    pub fn chance_at(&self, place: Point, now_s: f64) -> f64 {
        let near = self.lost.iter().filter(|lost| lost.may_be_at(place, now_s));
        1.0 - near.map(|lost| 1.0 - lost.existence).product::<f64>()
    }

    /// The nearest who may be at a place is missing no more.
    pub fn find(&mut self, place: Point, now_s: f64) {
        let near = self.lost.iter().enumerate().filter(|(_, lost)| lost.may_be_at(place, now_s));
        let distances = near.map(|(number, lost)| (number, (place - lost.at).length()));
        if let Some((number, _)) = distances.min_by(|one, other| one.1.total_cmp(&other.1)) {
            self.lost.remove(number);
        }
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
        for (step_m, expected) in [(-0.03, 1.0), (0.03, 0.0)] {
            let mut bench = Bench::within(ROOM);
            let x = |scan: i32| 3.4 - step_m * f64::from(20 - scan);
            (0..20).for_each(|scan| bench.shows(&[(x(scan).min(3.8), 0.0)]));
            assert_eq!(bench.tracks().len(), 1, "{step_m}");
            (0..30).for_each(|_| bench.shows(&[]));
            assert!(bench.tracks().is_empty());
            let chance = bench.tracker.missing.chance_at(Point::new(2.5, 0.0), bench.now_s + 1.0);
            assert_eq!(chance, expected, "{step_m}");
        }
    }

    #[test]
    fn where_a_person_is_missing_one_comes_into_view_at_once() {
        let found_after_s = |is_missing: bool| {
            let mut bench = Bench::within(ROOM);
            if is_missing {
                bench.tracker.missing.note(Point::new(1.6, 0.0), 1.0, 0.0);
            }
            let found = (0..40).find(|_| {
                bench.shows(&[(1.5, 0.0)]);
                !bench.tracks().is_empty()
            });
            assert_eq!(bench.tracker.missing.chance_at(Point::new(1.5, 0.0), bench.now_s), 0.0);
            f64::from(found.unwrap()) * SCAN_S
        };
        let (missing, complete) = (found_after_s(true), found_after_s(false));
        assert!(missing < 0.6 && complete >= 2.0, "{missing} {complete}");
    }

    #[test]
    fn one_who_was_lost_and_is_seen_outside_is_missing_no_more() {
        let mut bench = Bench::within(ROOM);
        let before = Point::new(3.4, 0.0);
        bench.tracker.missing.note(before, 0.5, 0.0);
        bench.shows(&[(3.6, 0.0)]);
        assert_eq!(bench.tracker.missing.chance_at(before, bench.now_s), 0.5);
        (0..20).for_each(|_| bench.shows(&[(3.6, 0.0)]));
        assert_eq!((bench.tracks().len(), bench.tracker.missing.chance_at(before, bench.now_s)), (1, 0.0));
    }

    #[test]
    fn one_who_was_lost_is_expected_for_a_while_as_far_as_people_walk() {
        let mut missing = Missing::default();
        let (lost, on) = (Point::new(0.0, -1.5), Point::new(0.0, 0.5));
        assert_eq!(missing.chance_at(lost, 5.0), 0.0);
        missing.note(lost, 1.0, 5.0);
        assert_eq!([lost, on].map(|place| missing.chance_at(place, 5.0)), [1.0, 0.0]);
        assert_eq!(missing.chance_at(on, 6.1), 1.0);
        missing.forget(14.9);
        assert_eq!(missing.chance_at(on, 14.9), 1.0);
        missing.forget(15.1);
        assert_eq!(missing.chance_at(on, 15.1), 0.0);
    }

    #[test]
    fn one_who_is_found_is_expected_no_more() {
        let mut missing = Missing::default();
        let (one, other) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0));
        missing.note(one, 1.0, 0.0);
        missing.note(other, 1.0, 0.0);
        missing.find(Point::new(0.9, 0.0), 1.0);
        assert_eq!([one, other].map(|place| missing.chance_at(place, 0.1)), [1.0, 0.0]);
        missing.find(one, 1.0);
        missing.find(one, 1.0);
        assert_eq!(missing.chance_at(one, 1.0), 0.0);
    }

    #[test]
    fn several_that_were_hardly_there_are_one_person_together() {
        let mut missing = Missing::default();
        let place = Point::new(0.0, 0.0);
        missing.note(place, 0.04, 0.0);
        assert_eq!(missing.chance_at(place, 0.0), 0.0);
        missing.note(place, 0.5, 0.0);
        missing.note(place, 0.2, 0.0);
        assert!((missing.chance_at(place, 0.0) - 0.6).abs() < 1e-12);
        missing.find(place, 0.0);
        assert!(missing.chance_at(place, 0.0) < 0.6);
    }

    #[test]
    fn of_many_that_are_lost_the_oldest_are_forgotten() {
        let mut missing = Missing::default();
        (0..1000).for_each(|number| missing.note(Point::new(f64::from(number), 0.0), 1.0, 0.0));
        let chances = [0.0, 935.0, 936.0, 999.0].map(|x| missing.chance_at(Point::new(x, 0.0), 0.0));
        assert_eq!((missing.lost.len(), chances), (KEPT, [0.0, 0.0, 1.0, 1.0]));
    }
}
