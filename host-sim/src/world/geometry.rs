//! Beams and the shapes a beam can hit, in the plane the sensor sweeps.
//!
//! ```text
//!        y                         beam: origin, unit direction
//!        │   segment ╲             segment: two end points
//!        │            ╲            ellipse: centre, direction of its long axis, two half axes
//!   beam ●───────────▶ × hit       disc: an ellipse with equal axes
//!        └──────────────── x       (metres, counter-clockwise, as the site)
//! ```

use super::superellipse;
pub use kehai_tracking::geometry::{Point, Pose, wrapped};

/// A half line along which light travels.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Where it starts.
    pub origin: Point,
    /// Where it goes, of length 1.
    pub direction: Point,
}

/// Where a beam meets a surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Meeting {
    /// Distance from the beam's origin.
    pub range_m: f64,
    /// Cosine of the angle to the surface's normal, 0 (grazing) to 1 (square on).
    pub incidence: f64,
}

/// A shape in the plane.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Outline {
    /// A straight piece of wall.
    Segment(Point, Point),
    /// A filled ellipse: a torso, an arm, a leg, a pillar.
    Ellipse {
        /// Its middle.
        centre: Point,
        /// Unit vector along the axis that `half_axes_m.0` belongs to.
        axis: Point,
        /// Half axes, along `axis` and across it.
        half_axes_m: (f64, f64),
    },
    /// A filled superellipse: a coat.
    Superellipse {
        /// Its middle.
        centre: Point,
        /// Unit vector along the axis that `half_axes_m.0` belongs to.
        axis: Point,
        /// Half axes, along `axis` and across it.
        half_axes_m: (f64, f64),
        /// 2 for an ellipse, more for a box with round corners.
        exponent: f64,
    },
}

impl Outline {
    /// A filled circle.
    #[must_use]
    pub const fn disc(centre: Point, radius_m: f64) -> Self {
        Self::Ellipse { centre, axis: Point::new(1.0, 0.0), half_axes_m: (radius_m, radius_m) }
    }

    /// Where `beam` first meets the shape from outside.
    #[must_use]
    pub fn meet(&self, beam: &Beam) -> Option<Meeting> {
        match *self {
            Self::Segment(from, to) => meet_segment(beam, from, to),
            Self::Ellipse { centre, axis, half_axes_m } => meet_ellipse(beam, centre, axis, half_axes_m),
            Self::Superellipse { centre, axis, half_axes_m, exponent } => {
                let met =
                    superellipse::meet((beam.origin, beam.direction), centre, axis, half_axes_m, exponent);
                met.map(|(range_m, incidence)| Meeting { range_m, incidence })
            }
        }
    }

    /// Middle and radius of a circle that holds the shape.
    #[must_use]
    pub fn bounds(&self) -> (Point, f64) {
        match *self {
            Self::Segment(from, to) => ((from + to) * 0.5, (to - from).length() * 0.5),
            Self::Ellipse { centre, half_axes_m: (along, across), .. } => (centre, along.max(across)),
            Self::Superellipse { centre, half_axes_m: (along, across), .. } => (centre, along.hypot(across)),
        }
    }
}

fn meet_segment(beam: &Beam, from: Point, to: Point) -> Option<Meeting> {
    let side = to - from;
    let offset = from - beam.origin;
    let crossing = beam.direction.cross(side);
    if crossing == 0.0 {
        return None;
    }
    let range_m = offset.cross(side) / crossing;
    let share = offset.cross(beam.direction) / crossing;
    let incidence = crossing.abs() / side.length();
    (range_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(Meeting { range_m, incidence })
}

fn meet_ellipse(beam: &Beam, centre: Point, axis: Point, (along, across): (f64, f64)) -> Option<Meeting> {
    // In the frame in which the ellipse is the unit circle.
    let squeeze = |vector: Point| Point::new(vector.dot(axis) / along, vector.dot(axis.left()) / across);
    let origin = squeeze(beam.origin - centre);
    let direction = squeeze(beam.direction);
    let (a, b, c) = (direction.dot(direction), origin.dot(direction), origin.dot(origin) - 1.0);
    let root = b * b - a * c;
    if root < 0.0 || c < 0.0 || b >= 0.0 {
        return None;
    }
    let range_m = (-b - root.sqrt()) / a;
    let touch = origin + direction * range_m;
    let normal = axis * (touch.x / along) + axis.left() * (touch.y / across);
    let incidence = (beam.direction.dot(normal) / normal.length()).abs();
    Some(Meeting { range_m, incidence })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(x: f64, y: f64, angle_deg: f64) -> Beam {
        Beam { origin: Point::new(x, y), direction: Point::towards(angle_deg.to_radians()) }
    }

    #[test]
    fn a_wall_is_met_where_it_stands_and_not_beside_its_ends() {
        let wall = Outline::Segment(Point::new(2.0, -1.0), Point::new(2.0, 1.0));
        let square = wall.meet(&beam(0.0, 0.0, 0.0)).unwrap();
        assert!((square.range_m - 2.0).abs() < 1e-12 && (square.incidence - 1.0).abs() < 1e-12);
        let slanted = wall.meet(&beam(1.5, 0.0, 60.0)).unwrap();
        assert!((slanted.range_m - 1.0).abs() < 1e-12 && (slanted.incidence - 0.5).abs() < 1e-12);
        assert_eq!(wall.meet(&beam(0.0, 0.0, 30.0)), None);
        assert_eq!(wall.meet(&beam(0.0, 0.0, 180.0)), None);
        assert_eq!(wall.meet(&beam(0.0, 0.0, 90.0)), None);
    }

    #[test]
    fn an_ellipse_is_met_on_its_near_side_whatever_its_heading() {
        for heading_deg in [0.0, 35.0, 90.0, 200.0] {
            let axis = Point::towards(f64::to_radians(heading_deg));
            let body = Outline::Ellipse { centre: Point::new(3.0, 0.0), axis, half_axes_m: (0.22, 0.14) };
            for angle_deg in [-2.0, 0.0, 1.5] {
                let ray = beam(0.0, 0.0, angle_deg);
                let meeting = body.meet(&ray).unwrap();
                let offset = ray.direction * meeting.range_m - Point::new(3.0, 0.0);
                let (u, v) = (offset.dot(axis) / 0.22, offset.dot(axis.left()) / 0.14);
                assert!((u * u + v * v - 1.0).abs() < 1e-9, "the point lies on the outline");
                assert!(meeting.range_m < 3.0 && meeting.incidence > 0.3);
            }
            assert_eq!(body.meet(&beam(0.0, 0.0, 6.0)), None);
            assert_eq!(body.meet(&beam(0.0, 0.0, 180.0)), None);
        }
    }

    #[test]
    fn a_superellipse_with_an_exponent_of_two_is_the_ellipse() {
        let (centre, axis, half_axes_m) = (Point::new(3.0, 0.1), Point::towards(0.6), (0.15, 0.25));
        let ellipse = Outline::Ellipse { centre, axis, half_axes_m };
        let coat = Outline::Superellipse { centre, axis, half_axes_m, exponent: 2.0 };
        let mut met = 0;
        for step in -80..=80 {
            let beam = Beam { origin: Point::default(), direction: Point::towards(f64::from(step) * 0.002) };
            match (coat.meet(&beam), ellipse.meet(&beam)) {
                (Some(one), Some(other)) => {
                    met += 1;
                    assert!((one.range_m - other.range_m).abs() < 1e-4, "{step}: {one:?} {other:?}");
                    assert!((one.incidence - other.incidence).abs() < 0.02, "{step}: {one:?} {other:?}");
                }
                (None, None) => {}
                // A grazing beam.
                (one, other) => {
                    let incidence = one.or(other).map_or(0.0, |meeting| meeting.incidence);
                    assert!(incidence < 0.05, "{step}: {one:?} {other:?}");
                }
            }
        }
        assert!(met > 50, "{met}");
    }

    #[test]
    fn a_sensor_inside_a_shape_does_not_see_it() {
        assert_eq!(Outline::disc(Point::new(0.0, 0.0), 0.5).meet(&beam(0.1, 0.0, 0.0)), None);
    }
}
