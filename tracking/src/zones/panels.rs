//! The cells of all zones on a floor of pressure panels.
//!
//! ```text
//!   ┌─────────┐ cell, 0.2 m      seen: every panel with its middle in it works, and so does the one under its middle,
//!   │▪ ▪ ▪    │ panels, 0.08 m   for long enough that a body on them has been found
//!   │▪ ✕ ▪    │ ✕ does not work: the cell is not seen
//!   └─────────┘
//! ```

use super::zone::{CELL_M, Cell, Zone};
use crate::floor::{FOUND_S, Plan, Reading};
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
    /// When each panel last did not work, s.
    faulty_s: Vec<f64>,
    /// The newest reading, s.
    read_s: f64,
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
        let never_s = f64::NEG_INFINITY;
        Self { plan: *plan, cells, faulty_s: vec![never_s; plan.panels()], read_s: never_s }
    }

    /// Whether it is that of this floor.
    pub fn is_of(&self, plan: &Plan) -> bool {
        self.plan == *plan
    }

    /// Notes that its panels were read, except for those that do not work or have not worked for [`FOUND_S`]. Of one that
    /// has just stopped working nothing is known at once: a person who stood on it has no body any more. Before all on
    /// the floor have been found (`has_found`) none is seen. Which do not work is noted all the same: a foot on one that
    /// works a moment later has not been found by then.
    pub fn read(&mut self, zones: &mut [Zone], reading: &Reading, has_found: bool) {
        let mut stopped = vec![false; self.faulty_s.len()];
        for ((panel, faulty_s), stopped) in self.faulty_s.iter_mut().enumerate().zip(&mut stopped) {
            if !reading.works(panel) {
                *stopped = *faulty_s < self.read_s;
                *faulty_s = reading.at_s;
            }
        }
        self.read_s = reading.at_s;
        let has_stopped = |panels: &[usize]| panels.iter().any(|panel| stopped.get(*panel) == Some(&true));
        self.note(zones, f64::NEG_INFINITY, has_stopped);
        if !has_found {
            return;
        }
        let works = |panel: &usize| {
            self.faulty_s.get(*panel).is_some_and(|faulty_s| reading.at_s - faulty_s >= FOUND_S)
        };
        self.note(zones, reading.at_s, |panels| panels.iter().all(works));
    }

    /// Nothing is known of them any more.
    pub fn forget(&self, zones: &mut [Zone]) {
        self.note(zones, f64::NEG_INFINITY, |_| true);
    }

    /// Notes a time for each cell over panels that are `wanted`.
    fn note(&self, zones: &mut [Zone], at_s: f64, wanted: impl Fn(&[usize]) -> bool) {
        for OnFloor { zone, cell, panels } in &self.cells {
            if let Some(zone) = zones.get_mut(*zone)
                && let Some(cell) = zone.cells.get_mut(*cell)
                && wanted(panels)
            {
                cell.note(at_s);
            }
        }
    }
}
