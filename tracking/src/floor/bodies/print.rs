//! What a foot presses as it is set: where, and which way it points.
//!
//! ```text
//!   ▪▪▪     heel to toes along x: the axis is (1, 0); along y it is (−1, 0), as a turn by 180° is a whole turn of it
//!   ▪▪▪
//! ```

use crate::floor::Patch;
use crate::geometry::Point;

/// Variance of a place on a panel of 0.08 m, along and across, m².
const PANEL_M2: f64 = 0.001;

/// A foot as it is set: the panels that nothing else explains.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Print {
    pub at: Point,
    pub panels: usize,
    /// See [`Plan::coarse_m`](crate::floor::Plan::coarse_m).
    pub coarse_m: f64,
    /// Which way it points, at twice its angle, as heel and toes look alike; longer, up to 1, the longer it is.
    pub axis: Point,
}

impl Print {
    /// The print of these panels.
    pub(super) fn of(patch: &Patch) -> Self {
        let around = patch.panels.iter().map(|panel| *panel - patch.middle);
        let (axis, size) = around.fold((Point::default(), PANEL_M2), |(axis, size), from| {
            let doubled = Point::new(from.x * from.x - from.y * from.y, 2.0 * from.x * from.y);
            (axis + doubled, size + from.dot(from))
        });
        Self {
            at: patch.middle,
            panels: patch.panels.len(),
            coarse_m: patch.coarse_m,
            axis: axis * (1.0 / size),
        }
    }
}
