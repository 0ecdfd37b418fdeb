//! Points, poses, lines and polygons in the plane of a site: metres, radians, counter-clockwise.
//!
//! ```text
//!        y                    pose: where a sensor is, and where its front step points
//!        │    ╲ ▲ forward     segment: two ends; a polygon: its corners, in order, closed by itself
//!        │  left ●
//!        └──────────── x
//! ```

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul, Sub};

use nalgebra::{Matrix2, Vector2};

/// The same direction as an angle between −π and π.
#[must_use]
pub fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * ((angle_rad + PI) / TAU).floor()
}

/// A place or a vector in the plane, in metres.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Point {
    /// Metres along the site's x axis.
    pub x: f64,
    /// Metres along the site's y axis.
    pub y: f64,
}

impl Point {
    /// A point from its coordinates.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The unit vector that points along `angle_rad`.
    #[must_use]
    pub fn towards(angle_rad: f64) -> Self {
        let (sine, cosine) = libm::sincos(angle_rad);
        Self::new(cosine, sine)
    }

    /// Scalar product.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// How far `other` turns to the left of `self`: the z part of the vector product.
    #[must_use]
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Distance from the origin.
    #[must_use]
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// The vector, or one of the same direction that is so long.
    #[must_use]
    pub fn at_most(self, length: f64) -> Self {
        let square = self.dot(self);
        if square > length * length { self * (length / square.sqrt()) } else { self }
    }

    /// Direction of the vector, counter-clockwise from x.
    #[must_use]
    pub fn angle_rad(self) -> f64 {
        libm::atan2(self.y, self.x)
    }

    /// The vector turned a quarter to the left.
    #[must_use]
    pub const fn left(self) -> Self {
        Self { x: -self.y, y: self.x }
    }
}

impl Add for Point {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl Sub for Point {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl Mul<f64> for Point {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

impl From<[f64; 2]> for Point {
    fn from([x, y]: [f64; 2]) -> Self {
        Self { x, y }
    }
}

/// Where a sensor is and where its front step points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// Its axis in the site.
    pub at: Point,
    /// Direction of the front step, counter-clockwise from the site's x axis.
    pub yaw_rad: f64,
}

impl Pose {
    /// A point of the sensor's frame (x forward, y left) in the site's.
    #[must_use]
    pub fn to_site(&self, point: Point) -> Point {
        self.to_site_ahead(self.forward(), point)
    }

    /// As [`to_site`](Self::to_site), for many points: `forward` is [`forward`](Self::forward).
    #[must_use]
    pub fn to_site_ahead(&self, forward: Point, point: Point) -> Point {
        self.at + forward * point.x + forward.left() * point.y
    }

    /// The direction of the front step in the site.
    #[must_use]
    pub fn forward(&self) -> Point {
        Point::towards(self.yaw_rad)
    }

    /// A point of the site in the sensor's frame (x forward, y left).
    #[must_use]
    pub fn to_sensor(&self, point: Point) -> Point {
        let forward = self.forward();
        let offset = point - self.at;
        Point::new(offset.dot(forward), offset.dot(forward.left()))
    }
}

/// How far `point` is from the straight piece `from` → `to`, m.
#[must_use]
pub fn distance_to_segment(point: Point, from: Point, to: Point) -> f64 {
    let side = to - from;
    let share = ((point - from).dot(side) / side.dot(side).max(1e-12)).clamp(0.0, 1.0);
    (point - (from + side * share)).length()
}

/// Whether the straight pieces `a` and `b` cross.
#[must_use]
pub fn cross(a: (Point, Point), b: (Point, Point)) -> bool {
    let turn = |from: Point, to: Point, point: Point| (to - from).cross(point - from);
    turn(a.0, a.1, b.0) * turn(a.0, a.1, b.1) < 0.0 && turn(b.0, b.1, a.0) * turn(b.0, b.1, a.1) < 0.0
}

/// How far two segments are from each other, m; 0 where they cross.
#[must_use]
pub fn segments_apart_m(one: (Point, Point), other: (Point, Point)) -> f64 {
    if cross(one, other) {
        return 0.0;
    }
    let ends = [
        distance_to_segment(one.0, other.0, other.1),
        distance_to_segment(one.1, other.0, other.1),
        distance_to_segment(other.0, one.0, one.1),
        distance_to_segment(other.1, one.0, one.1),
    ];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

/// Whether `point` is inside the polygon, by the number of sides to its right.
#[must_use]
pub fn inside(point: Point, polygon: &[Point]) -> bool {
    let mut within = false;
    for (index, &to) in polygon.iter().enumerate() {
        let from = polygon[(index + polygon.len() - 1) % polygon.len()];
        if (from.y > point.y) != (to.y > point.y)
            && point.x < from.x + (to.x - from.x) * (point.y - from.y) / (to.y - from.y)
        {
            within = !within;
        }
    }
    within
}

/// The square of a distance in sigmas, and the determinant of its covariance; that of a matrix that is none is far.
#[must_use]
pub fn mahalanobis(offset: Point, covariance: Matrix2<f64>) -> (f64, f64) {
    let offset = Vector2::new(offset.x, offset.y);
    let inverse = covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
    let (away, size_m4) = ((offset.transpose() * inverse * offset).x, covariance.determinant());
    if away >= 0.0 && size_m4 > 0.0 { (away, size_m4) } else { (f64::INFINITY, f64::INFINITY) }
}

/// The lowest and the highest corner of the upright rectangle around all points; None without any.
#[must_use]
pub fn bounds(points: impl IntoIterator<Item = Point>) -> Option<(Point, Point)> {
    points.into_iter().fold(None, |around, at| {
        let (low, high) = around.unwrap_or((at, at));
        Some((Point::new(low.x.min(at.x), low.y.min(at.y)), Point::new(high.x.max(at.x), high.y.max(at.y))))
    })
}

/// The polygon's centre of area; of one without area the mean of its corners.
#[must_use]
pub fn centroid(polygon: &[Point]) -> Point {
    let (mut area, mut sum) = (0.0, Point::default());
    for (index, &to) in polygon.iter().enumerate() {
        let from = polygon[(index + polygon.len() - 1) % polygon.len()];
        let part = from.cross(to);
        area += part;
        sum = sum + (from + to) * part;
    }
    if area.abs() > 1e-9 {
        return sum * (1.0 / (3.0 * area));
    }
    polygon.iter().fold(Point::default(), |sum, &corner| sum + corner) * (1.0 / polygon.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point; 4] =
        [Point::new(-1.0, -1.0), Point::new(1.0, -1.0), Point::new(1.0, 1.0), Point::new(-1.0, 1.0)];

    #[test]
    fn a_square_holds_its_inside_only() {
        assert!(inside(Point::new(0.9, -0.9), &SQUARE) && !inside(Point::new(1.1, 0.0), &SQUARE));
        assert!(!inside(Point::new(0.0, 1.1), &SQUARE));
        assert!(centroid(&SQUARE).length() < 1e-12);
    }

    #[test]
    fn bounds_hold_all_points() {
        assert_eq!(
            bounds([Point::new(3.0, -1.0), Point::new(1.0, 2.0)]),
            Some((Point::new(1.0, -1.0), Point::new(3.0, 2.0)))
        );
        assert_eq!(bounds([]), None);
    }

    #[test]
    fn distance_is_to_the_nearest_point_of_the_piece() {
        let (from, to) = (Point::new(0.0, 0.0), Point::new(2.0, 0.0));
        assert_eq!(distance_to_segment(Point::new(1.0, 0.5), from, to), 0.5);
        assert_eq!(distance_to_segment(Point::new(5.0, 4.0), from, to), 5.0);
    }

    #[test]
    fn pieces_cross_inside_both_only() {
        let piece = |x1, y1, x2, y2| (Point::new(x1, y1), Point::new(x2, y2));
        assert!(cross(piece(-1.0, 0.0, 1.0, 0.0), piece(0.0, -1.0, 0.0, 1.0)));
        assert!(!cross(piece(-1.0, 0.0, 1.0, 0.0), piece(2.0, -1.0, 2.0, 1.0)));
    }

    #[test]
    fn frames_turn_there_and_back() {
        let pose = Pose { at: Point::new(-1.0, 2.0), yaw_rad: std::f64::consts::FRAC_PI_2 };
        let ahead = pose.to_site(Point::new(1.0, 0.25));
        assert!((ahead - Point::new(-1.25, 3.0)).length() < 1e-12);
        assert!((pose.to_sensor(ahead) - Point::new(1.0, 0.25)).length() < 1e-12);
    }

    #[test]
    fn angles_wrap_to_the_shorter_turn() {
        assert!((wrapped(3.5) - (3.5 - TAU)).abs() < 1e-12);
        assert!((wrapped(-3.5) - (TAU - 3.5)).abs() < 1e-12);
        assert!(wrapped(-7.0 * PI / 2.0).abs() - PI / 2.0 < 1e-12);
    }
}
