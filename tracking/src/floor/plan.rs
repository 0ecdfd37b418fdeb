//! Where the panels of a floor are.
//!
//! ```text
//!        rows
//!         ▲   ┌──┬──┬──┐
//!         │   ├──┼──┼──┤
//!         │   ├──┼──┼──┤
//!   corner ●  └──┴──┴──┘ ─▶ columns, along the yaw
//! ```

use crate::geometry::{Point, Pose};
use crate::site::floor::Floor;

/// Side of a panel of paper B's floor, m.
const PITCH_M: f64 = 0.08;

/// A floor's place, and its panels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// The outer corner of panel (0, 0); columns go along the yaw, rows to the left of it.
    pub corner: Pose,
    /// Columns.
    pub columns: u8,
    /// Rows.
    pub rows: u8,
    /// Side of a panel, m.
    pub pitch_m: f64,
}

impl From<&Floor> for Plan {
    fn from(floor: &Floor) -> Self {
        let Floor { columns, rows, pitch_m, .. } = *floor;
        Self { corner: floor.corner(), columns, rows, pitch_m }
    }
}

impl Plan {
    /// Number of panels.
    #[must_use]
    pub fn panels(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// How much farther its corner is from the middle of a panel than in paper B's floor, m: what is known of feet is measured
    /// on such panels, and so much less of where one stands. 0 for panels that are not larger.
    #[must_use]
    pub fn coarse_m(&self) -> f64 {
        (self.pitch_m - PITCH_M).max(0.0) * std::f64::consts::FRAC_1_SQRT_2
    }

    /// The middle of a panel.
    #[must_use]
    pub fn middle(&self, panel: usize) -> Point {
        let columns = usize::from(self.columns).max(1);
        let (column, row) = ((panel % columns) as f64, (panel / columns) as f64);
        self.corner.to_site(Point::new((column + 0.5) * self.pitch_m, (row + 0.5) * self.pitch_m))
    }

    /// The panel at a place of the site; None beside the floor.
    #[must_use]
    pub fn panel_at(&self, at: Point) -> Option<usize> {
        let (offset, along) = (at - self.corner.at, Point::towards(self.corner.yaw_rad));
        let number = |metres: f64, most: u8| {
            let number = (metres / self.pitch_m).floor();
            (number >= 0.0 && number < f64::from(most)).then_some(number as usize)
        };
        let column = number(offset.dot(along), self.columns)?;
        let row = number(offset.dot(along.left()), self.rows)?;
        Some(row * usize::from(self.columns) + column)
    }
}
