//! Where a beam meets a superellipse: a box with round corners, as a coat is.
//!
//! ```text
//!    |x / a|ⁿ + |y / b|ⁿ = 1         n = 2 an ellipse, 4 nearly a box
//!
//!   f(t) = |x(t) / a|ⁿ + |y(t) / b|ⁿ along the beam is convex: its least value by golden sections, then the first
//!   t with f(t) = 1 by bisection
//! ```

use kehai_tracking::geometry::Point;

/// Steps of the search for the deepest point: to a ten-thousandth of the span.
const SECTIONS: u32 = 24;

/// Steps of the bisection: to a micrometre.
const BISECTIONS: u32 = 24;

/// (√5 − 1) / 2.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Where a beam from `from` towards the unit vector `towards` first meets the filled superellipse from outside: the
/// distance, m, and the cosine of the incidence.
#[must_use]
pub fn meet(
    (from, towards): (Point, Point),
    centre: Point,
    axis: Point,
    (along_m, across_m): (f64, f64),
    exponent: f64,
) -> Option<(f64, f64)> {
    let squeeze = |vector: Point| Point::new(vector.dot(axis) / along_m, vector.dot(axis.left()) / across_m);
    let (origin, direction) = (squeeze(from - centre), squeeze(towards));
    let level = |t: f64| {
        let place = origin + direction * t;
        libm::pow(place.x.abs(), exponent) + libm::pow(place.y.abs(), exponent)
    };
    // The whole shape is within √2 of the middle in this frame.
    let middle = -origin.dot(direction) / direction.dot(direction);
    let reach = std::f64::consts::SQRT_2 / direction.length();
    let (mut low, mut high) = ((middle - reach).max(0.0), middle + reach);
    if high <= 0.0 || level(0.0) < 1.0 {
        return None;
    }
    let outside = low;
    let (mut one, mut other) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_one, mut at_other) = (level(one), level(other));
    for _ in 0..SECTIONS {
        if at_one < at_other {
            (high, other, at_other) = (other, one, at_one);
            one = high - GOLDEN * (high - low);
            at_one = level(one);
        } else {
            (low, one, at_one) = (one, other, at_other);
            other = low + GOLDEN * (high - low);
            at_other = level(other);
        }
    }
    let deepest = (low + high) * 0.5;
    if level(deepest) > 1.0 {
        return None;
    }
    let (mut before, mut within) = (outside, deepest);
    for _ in 0..BISECTIONS {
        let half = (before + within) * 0.5;
        if level(half) > 1.0 { before = half } else { within = half }
    }
    let touch = origin + direction * within;
    let slope = |x: f64| libm::pow(x.abs(), exponent - 1.0) * x.signum();
    let normal = axis * (slope(touch.x) / along_m) + axis.left() * (slope(touch.y) / across_m);
    let incidence = (towards.dot(normal) / normal.length().max(1e-12)).abs();
    Some((within, incidence))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_high_exponent_is_nearly_a_box_and_the_corner_is_nearer_than_an_ellipse_s() {
        let (centre, axis, half) = (Point::new(3.0, 0.0), Point::new(1.0, 0.0), (0.2, 0.3));
        let at = |exponent, y: f64| {
            let beam = (Point::new(0.0, y), Point::new(1.0, 0.0));
            meet(beam, centre, axis, half, exponent).map(|(range_m, _)| range_m)
        };
        assert!((at(4.0, 0.0).unwrap() - 2.8).abs() < 1e-5);
        assert!(at(4.0, 0.25).unwrap() < at(2.0, 0.25).unwrap() - 0.03);
        assert_eq!(at(4.0, 0.31), None);
    }

    #[test]
    fn it_is_not_seen_from_within_nor_behind_the_sensor() {
        let from = |x: f64| {
            let beam = (Point::new(x, 0.0), Point::new(1.0, 0.0));
            meet(beam, Point::new(3.0, 0.0), Point::new(1.0, 0.0), (0.2, 0.3), 3.0)
        };
        assert_eq!(from(3.1), None);
        assert_eq!(from(3.5), None);
        assert!(from(0.0).is_some());
    }
}
