//! Exchange of numbers: after a scan, each number goes to the body that is most likely to have come from where that number was.
//!
//! ```text
//!   before   ·A·      ·B·        A's cloud takes B's outline, and B's cloud the outline that A left
//!   after    ·B·      ·A·        both moved far: with the numbers exchanged, both hardly moved
//! ```
//!
//! Clouds are updated one after another, so the first may take an outline that is the next one's. Where two bodies are
//! follows from the scan; which of them is which, from where both were.

use super::body::Body;
use super::cloud::relative;
use super::sample::Sample;
use crate::geometry::Point;

/// A body that moved less in one scan may well have walked, m: 1.5 m/s for a tenth of a second.
const WALKED_M: f64 = 0.15;

/// Numbers are exchanged between bodies nearer than this, m.
const NEAR_M: f64 = 1.2;

/// Kernel around a sample of the cloud before the scan, m: what a body moves in a scan, and the error of its outline.
const KERNEL_M: f64 = 0.12;

/// Log odds from which on the numbers are exchanged.
const CLEAR: f64 = 1.0;

/// Least density, so that the comparison does not depend on the tails of two clouds, 1/m².
const FLOOR: f64 = 1e-6;

/// One sample in so many stands for its cloud.
const SOME: usize = 3;

/// Where a number was before the scan.
#[derive(Clone, Debug)]
pub struct Before {
    /// Its place among the bodies.
    index: usize,
    mean: Point,
    /// Some of the samples.
    places: Vec<Point>,
}

impl Before {
    /// Of the body at a place among all.
    pub fn of(index: usize, body: &Body) -> Self {
        let place = |sample: &Sample| sample.at;
        Self {
            index,
            mean: body.cloud.moments().at,
            places: body.cloud.samples().iter().step_by(SOME).map(place).collect(),
        }
    }

    /// Log density of being at a place now.
    fn density(&self, at: Point) -> f64 {
        let kernel = |place: &Point| {
            let off = *place - at;
            relative(-0.5 * off.dot(off) / (KERNEL_M * KERNEL_M))
        };
        let sum: f64 = self.places.iter().map(kernel).sum();
        libm::log(
            FLOOR + sum / (self.places.len().max(1) as f64 * core::f64::consts::TAU * KERNEL_M * KERNEL_M),
        )
    }
}

/// Exchanges the numbers of pairs of bodies. `before` holds where some of them were.
pub fn rename(bodies: &mut [Body], before: &mut [Before]) {
    let place = |was: &Before| bodies.get(was.index).map_or(was.mean, |body| body.cloud.moments().at);
    let now: Vec<Point> = before.iter().map(place).collect();
    let confirmed: Vec<bool> =
        before.iter().map(|was| bodies.get(was.index).is_some_and(|body| body.confirmed)).collect();
    for one in 0..before.len() {
        if !confirmed[one] || (now[one] - before[one].mean).length() < WALKED_M {
            continue;
        }
        let gain = |other: usize| {
            let (own, its) = (&before[one], &before[other]);
            own.density(now[other]) + its.density(now[one]) - own.density(now[one]) - its.density(now[other])
        };
        let others = (0..before.len())
            .filter(|&other| other != one && confirmed[other] && (now[one] - now[other]).length() < NEAR_M);
        let best = others.map(|other| (gain(other), other)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((gain, other)) = best
            && gain > CLEAR
        {
            let (first, second) = (before[one].index, before[other].index);
            let id = bodies[first].id;
            bodies[first].id = bodies[second].id;
            bodies[second].id = id;
            before.swap(one, other);
            (before[one].index, before[other].index) = (first, second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cloud::Cloud;
    use super::*;

    /// A confirmed body, all of it at one place.
    fn body(id: u64, x: f64) -> Body {
        let sample = Sample::new(Point::new(x, 0.0), Point::default(), Point::new(0.0, 1.0));
        Body { confirmed: true, ..Body::begin(id, 5.0, Cloud::new(vec![sample; 6], 0.0)) }
    }

    /// Numbers after a scan, of two bodies that were and are at these places.
    fn renamed(were: [f64; 2], are: [f64; 2]) -> [u64; 2] {
        let mut before: Vec<Before> =
            were.iter().enumerate().map(|(index, &x)| Before::of(index, &body(0, x))).collect();
        let mut bodies = [body(1, are[0]), body(2, are[1])];
        rename(&mut bodies, &mut before);
        bodies.map(|body| body.id)
    }

    #[test]
    fn bodies_that_took_each_others_outline_exchange_their_numbers() {
        assert_eq!(renamed([0.0, 0.6], [0.55, 0.05]), [2, 1]);
    }

    #[test]
    fn bodies_that_stay_keep_their_numbers() {
        assert_eq!(renamed([0.0, 0.3], [0.05, 0.32]), [1, 2]);
    }

    #[test]
    fn a_body_that_jumps_to_an_empty_place_keeps_its_number() {
        assert_eq!(renamed([0.0, 0.8], [0.4, 0.8]), [1, 2]);
    }

    #[test]
    fn tentative_bodies_have_no_number_to_exchange() {
        let mut before: Vec<Before> =
            [0.0, 0.6].iter().enumerate().map(|(index, &x)| Before::of(index, &body(0, x))).collect();
        let mut bodies = [body(1, 0.55), Body { confirmed: false, ..body(2, 0.05) }];
        rename(&mut bodies, &mut before);
        assert_eq!(bodies.map(|body| body.id), [1, 2]);
    }
}
