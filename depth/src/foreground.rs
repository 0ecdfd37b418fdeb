//! What stands in front of the background: its pixels as points in the ground frame.
//!
//! ```text
//!   wall ┃      ● ≥ 10 cm nearer than the background: foreground
//!        ┃◦       ◦ nearer by less: the wall's own noise
//!   ─────┸──────────── below the floor margin: the floor's own noise, shoes
//! ```

use crate::background::Background;
use crate::camera::{Camera, Place};
use crate::frame::Frame;

/// What counts as foreground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// How much nearer than the background, mm.
    pub nearer_mm: u16,
    /// Greatest depth, mm: beyond it the noise of such cameras exceeds `nearer_mm`.
    pub reach_mm: u16,
    /// Least height above the floor, m.
    pub above_m: f32,
}

impl Limits {
    /// The paper's 10 cm and 5 m. The margin above the floor is as large as the step: a floor seen 10 cm too near
    /// stands less than that above itself.
    pub const USUAL: Self = Self { nearer_mm: 100, reach_mm: 5000, above_m: 0.1 };
}

/// A pixel of the foreground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Point {
    /// Column of the image.
    pub column: usize,
    /// Where it is.
    pub place: Place,
}

/// The foreground of a frame. Where the background is unknown, whatever is within reach stands out: an open door
/// returns nothing, a person in it does.
#[must_use]
pub fn of(frame: &Frame, background: &Background, camera: &Camera, limits: &Limits) -> Vec<Point> {
    let mut points = Vec::new();
    for (column, row, depth_mm) in frame.measured() {
        if depth_mm > limits.reach_mm {
            continue;
        }
        let behind_mm = background.depth_mm(column, row);
        if behind_mm.is_some_and(|behind_mm| depth_mm.saturating_add(limits.nearer_mm) > behind_mm) {
            continue;
        }
        let place = camera.place(column, row, depth_mm);
        if place[2] >= limits.above_m {
            points.push(Point { column, place });
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::background::still;
    use crate::camera::SMALL;

    /// One pixel of a camera that looks straight ahead, 1 m up; the background behind it.
    fn found(depth_mm: u16, behind_mm: u16, row: usize) -> usize {
        let pixels = SMALL.width * SMALL.height;
        let mut values = vec![0; pixels];
        values[row * SMALL.width + 40] = depth_mm;
        let frame = Frame::new(SMALL.width, SMALL.height, values, 0).unwrap();
        of(&frame, &still(SMALL.width, vec![behind_mm; pixels]), &SMALL, &Limits::USUAL).len()
    }

    #[test]
    fn ten_centimetres_in_front_is_foreground_and_less_is_not() {
        assert_eq!((found(2900, 3000, 30), found(2901, 3000, 30), found(3500, 3000, 30)), (1, 0, 0));
    }

    #[test]
    fn what_is_beyond_5_m_is_dropped_and_an_unknown_background_hides_nothing() {
        assert_eq!((found(5000, 9000, 30), found(5001, 9000, 30)), (1, 0));
        assert_eq!((found(5000, 0, 30), found(0, 0, 30)), (1, 0));
    }

    #[test]
    fn what_lies_on_the_floor_is_dropped() {
        // The lowest row looks 26.9° down: it meets the floor at a depth of 1.94 m.
        assert_eq!((found(1700, 9000, 59), found(1900, 9000, 59)), (1, 0));
    }
}
