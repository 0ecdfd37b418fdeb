//! Two bodies do not share a place: how far a sample enters the others.
//!
//! ```text
//!     ╭───╮╭───╮            support radii s₁, s₂ along the line of centres; overlap o = s₁ + s₂ − distance
//!     │ s₁┼┼s₂ │            likelihood 1 − r + r · mean over the other's samples of exp(−o² / 2σ²)
//!     ╰───╯╰───╯
//! ```

use super::body::Body;
use super::sample::Sample;
use crate::geometry::Point;

/// Deviation of the overlap that two bodies may have, m: clothes.
const SOFT_M: f64 = 0.05;

/// Half axes of the part of a body that no other enters, m.
const CORE_M: (f64, f64) = (0.235, 0.13);

/// Room that two bodies leave each other even front to back, m: feet and a bent arm. A hidden body is not the arm of
/// the next one.
const ROOM_M: f64 = 0.40;

/// Samples by which a body keeps others out.
const KEEPERS: usize = 4;

/// Bodies whose mean is farther from a cloud than its spread and this hardly enter it, m: one that may be anywhere keeps little out.
const NEAR_M: f64 = 1.1;

/// Another body, as it keeps a sample out.
#[derive(Clone, Debug)]
pub struct Keeper {
    existence: f64,
    middle: Point,
    /// No body that is farther from the middle enters a sample, m.
    near_m: f64,
    /// Places and headings of some.
    samples: Vec<(Point, Point)>,
}

impl Keeper {
    /// By some samples of a body.
    pub fn of(body: &Body) -> Self {
        let some = body.cloud.samples().iter().step_by((body.cloud.samples().len() / KEEPERS).max(1));
        Self::new(body.existence(), some.map(|sample| (sample.at, sample.heading)).collect())
    }

    fn new(existence: f64, samples: Vec<(Point, Point)>) -> Self {
        let sum = samples.iter().fold(Point::default(), |sum, (at, _)| sum + *at);
        let middle = sum * (1.0 / samples.len().max(1) as f64);
        let spread_m = samples.iter().map(|(at, _)| (*at - middle).length()).fold(0.0, f64::max);
        Self { existence, middle, near_m: spread_m + 2.0 * CORE_M.0, samples }
    }

    /// Log likelihood that a sample at a place does not overlap it.
    fn apart(&self, at: Point, heading: Point) -> f64 {
        let off = self.middle - at;
        if off.dot(off) > self.near_m * self.near_m {
            return 0.0;
        }
        let allowed = |&(other, other_heading): &(Point, Point)| {
            let offset = other - at;
            let square_m2 = offset.dot(offset);
            if square_m2 > 4.0 * CORE_M.0 * CORE_M.0 {
                return 1.0;
            }
            let distance_m = square_m2.sqrt();
            let towards = offset * (1.0 / distance_m.max(1e-6));
            let room_m = (support(heading, towards) + support(other_heading, towards)).max(ROOM_M);
            let overlap_m = room_m - distance_m;
            if overlap_m <= 0.0 { 1.0 } else { libm::exp(-0.5 * (overlap_m / SOFT_M) * (overlap_m / SOFT_M)) }
        };
        let mean = self.samples.iter().map(allowed).sum::<f64>() / self.samples.len().max(1) as f64;
        if mean >= 1.0 { 0.0 } else { libm::log(1.0 - self.existence + self.existence * mean) }
    }
}

/// The other bodies that one may enter.
pub fn keepers(bodies: &[Body], index: usize) -> Vec<Keeper> {
    let Some(body) = bodies.get(index) else { return Vec::new() };
    let own = body.cloud.moments();
    let reach_m = NEAR_M + 2.0 * own.variance_m2().sqrt();
    let square_m2 = |sample: &Sample| (sample.at - own.at).dot(sample.at - own.at);
    let spread_m = body.cloud.samples().iter().map(square_m2).fold(0.0, f64::max).sqrt();
    let others = bodies.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, body)| body);
    let near = others.filter(|body| {
        let off = body.cloud.moments().at - own.at;
        off.dot(off) < reach_m * reach_m
    });
    let near = near.map(Keeper::of);
    near.filter(|keeper| (keeper.middle - own.at).length() < keeper.near_m + spread_m).collect()
}

/// Log likelihood of not overlapping the other bodies.
pub fn apart(at: Point, heading: Point, keepers: &[Keeper]) -> f64 {
    keepers.iter().map(|keeper| keeper.apart(at, heading)).sum()
}

/// Support radius of a body in a direction, m.
fn support(heading: Point, towards: Point) -> f64 {
    let (across, along) = (towards.dot(heading.left()) * CORE_M.0, towards.dot(heading) * CORE_M.1);
    (across * across + along * along).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeper(existence: f64) -> [Keeper; 1] {
        [Keeper::new(existence, vec![(Point::new(1.0, 0.0), Point::new(0.0, 1.0))])]
    }

    #[test]
    fn two_bodies_do_not_share_a_place() {
        let heading = Point::new(0.0, 1.0);
        assert!(apart(Point::new(1.02, 0.0), heading, &keeper(1.0)) < -5.0);
        assert_eq!(apart(Point::new(1.6, 0.0), heading, &keeper(1.0)), 0.0);
    }

    #[test]
    fn a_body_that_hardly_exists_hardly_keeps_others_out() {
        let heading = Point::new(0.0, 1.0);
        let weak = apart(Point::new(1.02, 0.0), heading, &keeper(0.1));
        assert!((weak - libm::log(0.9)).abs() < 0.01, "{weak}");
    }

    #[test]
    fn bodies_stand_nearer_to_each_other_back_to_back_than_side_by_side() {
        let beside = apart(Point::new(0.59, 0.0), Point::new(0.0, 1.0), &keeper(1.0));
        let behind = [Keeper::new(1.0, vec![(Point::new(1.0, 0.0), Point::new(1.0, 0.0))])];
        let near = apart(Point::new(0.8, 0.0), Point::new(1.0, 0.0), &behind);
        let behind = apart(Point::new(0.59, 0.0), Point::new(1.0, 0.0), &behind);
        assert!(beside < -0.5 && behind == 0.0, "{beside} {behind}");
        assert!(near < -5.0, "they leave each other room: {near}");
    }
}
