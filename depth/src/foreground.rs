//! What stands in front of the background: its pixels as points in the ground frame.
//!
//! ```text
//!   wall ┃      ● ≥ 10 cm nearer than the background: foreground
//!        ┃◦       ◦ nearer by less: the wall's own noise
//!   ─────┸──────────── below the floor margin: the floor's own noise, shoes
//!
//!   body ▓▓▓   ·  ▒ wall      a flying pixel, between both sides of an edge, has no neighbour at its depth
//! ```

use crate::background::Background;
use crate::camera::{Camera, Place};
use crate::frame::{Frame, is_measured};

/// What counts as foreground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// How much nearer than the background, mm.
    pub nearer_mm: u16,
    /// Greatest depth, mm: beyond it the noise of such cameras exceeds `nearer_mm`.
    pub reach_mm: u16,
    /// Least height above the floor, m.
    pub above_m: f32,
    /// A pixel must have one beside, above or below it that is no deeper or nearer than this, mm; None: all are taken.
    pub fellow_mm: Option<u16>,
}

impl Limits {
    /// The paper's 10 cm and 5 m. The margin above the floor is as large as the step: a floor seen 10 cm too near
    /// stands less than that above itself. A fellow is within three deviations of two pixels' difference at 5 m, of a
    /// noise of 0.29 %: a flying pixel rarely is.
    pub const USUAL: Self = Self { fellow_mm: Some(60), ..Self::PAPER };

    /// As in the paper: flying pixels are taken.
    pub const PAPER: Self = Self { nearer_mm: 100, reach_mm: 5000, above_m: 0.1, fellow_mm: None };
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
        if limits.fellow_mm.is_some_and(|within_mm| !has_fellow(frame, column, row, within_mm)) {
            continue;
        }
        let place = camera.place(column, row, depth_mm);
        if place[2] >= limits.above_m {
            points.push(Point { column, place });
        }
    }
    points
}

/// Whether one of the four neighbours is at the same depth, give or take `within_mm`.
fn has_fellow(frame: &Frame, column: usize, row: usize, within_mm: u16) -> bool {
    let at = |column: usize, row: usize| {
        let is_inside = column < frame.width() && row < frame.height();
        let index = row.checked_mul(frame.width())?.checked_add(column)?;
        frame.depth_mm().get(index).copied().filter(|value_mm| is_inside && is_measured(*value_mm))
    };
    let Some(own_mm) = at(column, row) else { return false };
    let around =
        [(column.wrapping_sub(1), row), (column + 1, row), (column, row.wrapping_sub(1)), (column, row + 1)];
    around.into_iter().filter_map(|(column, row)| at(column, row)).any(|mm| mm.abs_diff(own_mm) <= within_mm)
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
        of(&frame, &still(SMALL.width, vec![behind_mm; pixels]), &SMALL, &Limits::PAPER).len()
    }

    #[test]
    fn a_flying_pixel_has_no_fellow_and_is_dropped() {
        let pixels = SMALL.width * SMALL.height;
        let mut values = vec![4000; pixels];
        // A body two pixels wide, a pixel in empty air beside it, and one alone in the corner.
        for (index, value_mm) in [(2440, 2000), (2441, 2030), (2442, 2900), (0, 1000)] {
            values[index] = value_mm;
        }
        let frame = Frame::new(SMALL.width, SMALL.height, values, 0).unwrap();
        let background = still(SMALL.width, vec![4000; pixels]);
        let found = |limits: &Limits| of(&frame, &background, &SMALL, limits).len();
        assert_eq!((found(&Limits::PAPER), found(&Limits::USUAL)), (4, 2));
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
