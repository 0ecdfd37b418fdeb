//! What is seen by whom, when nobody is in the way.
//!
//! ```text
//!   . 1 1 1 2 2 .      a grid; each cell knows which modules see its middle
//!   . 1 2 2 2 2 .      (backgrounds end at walls: what lies behind is seen by nobody)
//! ```

use serde::Serialize;

use crate::geometry::{Point, bounds};
use crate::sighting::View;

/// Side of a cell, m.
const CELL_M: f64 = 0.25;

/// Most cells: 160 m by 160 m; a larger place has larger cells.
const MOST: f64 = 400_000.0;

/// A grid of who sees what.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Coverage {
    /// Lower left corner.
    pub x: f64,
    /// Lower left corner.
    pub y: f64,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Cells in a row.
    pub columns: usize,
    /// How many modules see each cell, row by row, from the lowest.
    pub seen_by: Vec<u8>,
    /// Square metres seen by at least one, and by at least two modules.
    pub seen_m2: [f64; 2],
}

/// Who sees what: each module's view and up to which range each beam is empty with nobody there, m.
#[must_use]
pub fn coverage(modules: &[(View, Vec<f64>)]) -> Coverage {
    let corner = |(view, empty_m): &(View, Vec<f64>)| -> Vec<Point> {
        let end = |(beam, range_m): (usize, &f64)| {
            let bearing_rad = view.geometry.bearing_rad(u16::try_from(beam).unwrap_or(u16::MAX));
            view.place(f64::from(bearing_rad), *range_m)
        };
        empty_m.iter().enumerate().map(end).collect()
    };
    let Some((low, high)) = bounds(modules.iter().flat_map(corner)) else { return Coverage::default() };
    let size = high - low;
    let cell_m = CELL_M.max((size.x * size.y / MOST).sqrt());
    let (columns, rows) = ((size.x / cell_m).ceil() as usize, (size.y / cell_m).ceil() as usize);
    let sees = |(view, empty_m): &(View, Vec<f64>), at: Point| {
        let (range_m, beam) = view.beam_at(at);
        beam.and_then(|beam| empty_m.get(usize::from(beam))).is_some_and(|empty_m| range_m < *empty_m)
    };
    let middle = |index: usize| {
        let (column, row) = (index % columns.max(1), index / columns.max(1));
        low + Point::new(column as f64 + 0.5, row as f64 + 0.5) * cell_m
    };
    let count = |index: usize| {
        let at = middle(index);
        u8::try_from(modules.iter().filter(|module| sees(module, at)).count()).unwrap_or(u8::MAX)
    };
    let seen_by: Vec<u8> = (0..columns * rows).map(count).collect();
    let at_least = |most: u8| seen_by.iter().filter(|seen| **seen >= most).count() as f64 * cell_m * cell_m;
    let seen_m2 = [at_least(1), at_least(2)];
    Coverage { x: low.x, y: low.y, cell_m, columns, seen_by, seen_m2 }
}
