//! The cells of all zones on a floor of pressure panels.
//!
//! ```text
//!   ┌─────────┐ cell, 0.2 m      seen: every panel with its middle in it works, and so does the one under its middle
//!   │▪ ▪ ▪    │ panels, 0.08 m
//!   │▪ ✕ ▪    │ ✕ does not work: the cell is not seen
//!   └─────────┘
//! ```

use super::zone::{CELL_M, Cell, Zone};
use crate::floor::Plan;
use crate::geometry::Point;

/// A cell on a floor.
#[derive(Clone, Debug)]
struct OnFloor {
    zone: usize,
    cell: usize,
    panels: Vec<usize>,
}

/// The cells on a floor.
#[derive(Clone, Debug)]
pub struct Panels {
    plan: Plan,
    cells: Vec<OnFloor>,
}

impl Panels {
    /// Of the floor `plan`.
    pub fn of(plan: &Plan, zones: &[Zone]) -> Self {
        let mut cells = Vec::new();
        let middles: Vec<(Point, usize)> =
            (0..plan.panels()).map(|panel| (plan.middle(panel), panel)).collect();
        for (zone, whole) in zones.iter().enumerate() {
            for (cell, Cell { middle, .. }) in whole.cells.iter().enumerate() {
                let Some(under) = plan.panel_at(*middle) else { continue };
                let is_in = |at: Point| {
                    let off = at - *middle;
                    off.x.abs() <= 0.5 * CELL_M && off.y.abs() <= 0.5 * CELL_M
                };
                let within = middles.iter().filter(|(at, _)| is_in(*at)).map(|(_, panel)| *panel);
                cells.push(OnFloor { zone, cell, panels: std::iter::once(under).chain(within).collect() });
            }
        }
        Self { plan: *plan, cells }
    }

    /// Whether it is that of this floor.
    pub fn is_of(&self, plan: &Plan) -> bool {
        self.plan == *plan
    }

    /// Notes that its panels were read at `at_s`, except for those that do not work. Negative infinity
    /// is no time: nothing is known any more.
    pub fn read(&self, zones: &mut [Zone], at_s: f64, works: impl Fn(usize) -> bool) {
        for OnFloor { zone, cell, panels } in &self.cells {
            if let Some(zone) = zones.get_mut(*zone)
                && let Some(cell) = zone.cells.get_mut(*cell)
                && panels.iter().all(|panel| works(*panel))
            {
                cell.note(at_s);
            }
        }
    }
}
