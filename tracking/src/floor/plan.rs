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

impl Plan {
    /// Number of panels.
    #[must_use]
    pub fn panels(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// The middle of a panel.
    #[must_use]
    pub fn middle(&self, panel: usize) -> Point {
        let columns = usize::from(self.columns).max(1);
        let (column, row) = ((panel % columns) as f64, (panel / columns) as f64);
        self.corner.to_site(Point::new((column + 0.5) * self.pitch_m, (row + 0.5) * self.pitch_m))
    }
}
