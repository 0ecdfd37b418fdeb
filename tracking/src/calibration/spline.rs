//! The walk as a smooth curve: a uniform cubic B-spline over time.
//!
//! ```text
//!      c1 ●                        position, velocity: sums of four control points each
//!        ╱  ╲__●c2                 acceleration at a knot: (c0 − 2·c1 + c2) / h²
//!   c0 ●  ~~~~    ╲__● c3
//!        └─ h ─┘
//! ```

use crate::geometry::Point;

/// Between two knots, s: a walker turns in half a second.
pub const KNOT_S: f64 = 0.25;

/// One σ of a walker's acceleration along each axis, m/s²: starts and turns within a second.
pub const ACCELERATION_M_S2: f64 = 1.2;

/// Control points on a time line.
#[derive(Clone, Debug)]
pub struct Spline {
    from_s: f64,
    pub points: Vec<Point>,
}

/// Four control points from `first` on, with their weights for position (1) and velocity (1/s).
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub first: usize,
    pub position: [f64; 4],
    pub velocity: [f64; 4],
}

impl Spline {
    /// One that reaches from `from_s` to `to_s`, all at 0.
    pub fn new(from_s: f64, to_s: f64) -> Self {
        let spans = ((to_s - from_s) / KNOT_S).ceil().max(1.0) as usize;
        Self { from_s, points: vec![Point::default(); spans + 3] }
    }

    /// Where a time is on it; times beyond its ends are taken to be there.
    pub fn place(&self, at_s: f64) -> Place {
        let spans = self.points.len() - 3;
        let along = ((at_s - self.from_s) / KNOT_S).clamp(0.0, spans as f64);
        let first = (along as usize).min(spans - 1);
        let u = along - first as f64;
        let (u2, u3) = (u * u, u * u * u);
        let position = [
            (1.0 - u) * (1.0 - u) * (1.0 - u) / 6.0,
            (3.0 * u3 - 6.0 * u2 + 4.0) / 6.0,
            (-3.0 * u3 + 3.0 * u2 + 3.0 * u + 1.0) / 6.0,
            u3 / 6.0,
        ];
        let velocity = [
            -(1.0 - u) * (1.0 - u) / 2.0,
            (9.0 * u2 - 12.0 * u) / 6.0,
            (-9.0 * u2 + 6.0 * u + 3.0) / 6.0,
            u2 / 2.0,
        ]
        .map(|weight| weight / KNOT_S);
        Place { first, position, velocity }
    }

    /// A sum of its control points.
    pub fn sum(&self, first: usize, weights: &[f64; 4]) -> Point {
        let parts = self.points.iter().skip(first).zip(weights);
        parts.fold(Point::default(), |sum, (&point, &weight)| sum + point * weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_walk_is_itself_and_its_velocity_is_the_walker_s() {
        let mut spline = Spline::new(10.0, 14.0);
        for (index, point) in spline.points.iter_mut().enumerate() {
            // Control point i belongs to the time of knot i − 1.
            *point = Point::new(1.0 + 0.8 * KNOT_S * (index as f64 - 1.0), 2.0);
        }
        for at_s in [10.0, 10.1, 11.37, 13.99, 14.0] {
            let place = spline.place(at_s);
            let at = spline.sum(place.first, &place.position);
            let velocity = spline.sum(place.first, &place.velocity);
            assert!((at.x - 1.0 - 0.8 * (at_s - 10.0)).abs() < 1e-12 && (at.y - 2.0).abs() < 1e-12, "{at:?}");
            assert!((velocity.x - 0.8).abs() < 1e-12 && velocity.y.abs() < 1e-12, "{velocity:?}");
        }
    }
}
