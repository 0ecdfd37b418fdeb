//! A segment as a depth camera's front end finds it, and what it covers and hides.
//!
//! ```text
//!        ╭──╮ outline     ░░ hidden: what lies behind it, and half a body to either side
//!   ◩────┤  ├░░░░░░░
//!        ╰──╯
//! ```

use crate::geometry::Point;

/// Half a body's width, m.
const HALF_M: f64 = 0.25;

/// A segment: a cluster of points as a body.
#[derive(Clone, PartialEq, Debug)]
pub struct Seen {
    /// Middle of its points, m, x forward and y left of the camera.
    pub at: Point,
    /// Convex outline from above, m.
    pub outline: Vec<Point>,
    /// Its highest point above the floor, m.
    pub top_m: f64,
    /// Volume of what is seen, litres.
    pub volume_l: f64,
}

/// What the camera sees of the place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sight {
    /// Tangent of the angle from the axis to the image's left and right edge.
    pub aside: f64,
    /// Height of the lens, m, and tangent of the angle to the upper edge.
    pub lens_m: f64,
    /// See `lens_m`.
    pub up: f64,
}

impl Seen {
    /// How far a place is outside its outline, m.
    pub(super) fn off_m(&self, place: Point) -> f64 {
        (self.nearest(place) - place).length()
    }

    /// The place itself within the outline, else the nearest on it.
    pub(super) fn nearest(&self, place: Point) -> Point {
        let sides = self.outline.iter().zip(self.outline.iter().cycle().skip(1));
        let mut is_inside = self.outline.len() > 2;
        let mut nearest = self.at;
        for (from, to) in sides {
            let (side, to_place) = (*to - *from, place - *from);
            is_inside &= side.cross(to_place) >= 0.0;
            let share = (to_place.dot(side) / side.dot(side).max(1e-12)).clamp(0.0, 1.0);
            let on = *from + side * share;
            if (on - place).length() < (nearest - place).length() {
                nearest = on;
            }
        }
        if is_inside { place } else { nearest }
    }

    /// Whether a body at this place is behind it, at least in part.
    pub(super) fn hides(&self, place: Point) -> bool {
        let slopes = || self.outline.iter().map(|corner| corner.y / corner.x.max(0.1));
        let (low, high) = (slopes().fold(f64::MAX, f64::min), slopes().fold(f64::MIN, f64::max));
        let margin = HALF_M / place.x.max(0.1);
        let slope = place.y / place.x.max(0.1);
        self.at.x < place.x && slope > low - margin && slope < high + margin
    }
}
