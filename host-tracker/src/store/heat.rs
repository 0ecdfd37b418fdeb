//! How long people were where: the paths of a time, cell by cell.
//!
//! ```text
//!   path ●───────●──●            each piece of a path is an even walk: its time goes to the cells it passes, in steps of
//!        │ ▪ ▪ ▪ │▪ │            half a cell
//!        └ 1.2 s ┘
//! ```
//!
//! A time in which a person was hidden is not told of any cell: where that was is only believed. Paths are read one part after the
//! other, so that a month needs no more memory than a minute.

use schemars::JsonSchema;
use serde::Serialize;

use super::path::Place;
use super::reader::Reader;
use kehai_tracking::geometry::{Point, bounds};
use kehai_tracking::site::{Site, Wall, Zone};

/// Side of a cell, m: half a body's width, and that of the coverage.
const CELL_M: f64 = 0.25;

/// Most cells: 2500 m²; a larger site has larger cells.
const CELLS_MAX: f64 = 40_000.0;

/// Most steps of one piece of a path: one that is longer is no walk, and its steps are longer.
const STEPS_MAX: f64 = 1000.0;

/// The rectangle of cells around a site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Frame {
    /// Lower left corner, m.
    pub x: f64,
    /// Lower left corner, m.
    pub y: f64,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Cells in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl Frame {
    /// Around the zones of a site; around its walls, too, if it has no zone.
    #[must_use]
    pub fn around(site: &Site) -> Self {
        let zones = site.zones.iter().flat_map(Zone::corners);
        let walls = site.walls.iter().flat_map(Wall::sides).flat_map(|(from, to)| [from, to]);
        let Some((low, high)) = bounds(zones).or_else(|| bounds(walls)) else { return Self::default() };
        let size = high - low;
        let cell_m = CELL_M.max((size.x * size.y / CELLS_MAX).sqrt());
        let cells = |length_m: f64| ((length_m / cell_m).ceil() as usize).max(1);
        Self { x: low.x, y: low.y, cell_m, columns: cells(size.x), rows: cells(size.y) }
    }

    /// The number of the cell a place is in, row by row.
    #[must_use]
    pub fn cell_at(&self, at: Point) -> Option<usize> {
        let number = |offset_m: f64, count: usize| {
            let number = (offset_m / self.cell_m).floor();
            (number >= 0.0 && number < count as f64).then_some(number as usize)
        };
        Some(number(at.y - self.y, self.rows)? * self.columns + number(at.x - self.x, self.columns)?)
    }

    /// The middle of each cell, row by row.
    pub fn middles(&self) -> impl Iterator<Item = Point> + '_ {
        let middle = |cell: usize| {
            let (column, row) = (cell % self.columns.max(1), cell / self.columns.max(1));
            Point::new(self.x, self.y) + Point::new(column as f64 + 0.5, row as f64 + 0.5) * self.cell_m
        };
        (0..self.columns * self.rows).map(middle)
    }
}

/// How long people were where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heat {
    /// Of each cell, row by row, s; two people count twice.
    pub cells: Vec<f64>,
    /// For how long people were hidden, s: where is not known.
    pub hidden_s: f64,
    /// And beside all cells.
    pub outside_s: f64,
}

/// How long people were where from `from_ms` to `to_ms`.
///
/// # Errors
/// What SQLite says.
pub fn heat(reader: &Reader, (from_ms, to_ms): (u64, u64), frame: &Frame) -> rusqlite::Result<Heat> {
    let mut heat = Heat { cells: vec![0.0; frame.columns * frame.rows], ..Heat::default() };
    reader.each_path(from_ms, to_ms, |places| {
        for piece in places.windows(2) {
            heat.add(piece[0], piece[1], (from_ms, to_ms), frame);
        }
    })?;
    Ok(heat)
}

impl Heat {
    /// Adds an even walk from one place to another, as far as it lies within a time.
    fn add(&mut self, from: Place, to: Place, (begin_ms, end_ms): (u64, u64), frame: &Frame) {
        let whole_ms = to.at_ms.saturating_sub(from.at_ms) as f64;
        let (first_ms, last_ms) = (from.at_ms.max(begin_ms), to.at_ms.min(end_ms));
        if last_ms <= first_ms || whole_ms <= 0.0 {
            return;
        }
        let long_s = (last_ms - first_ms) as f64 * 1e-3;
        if to.hidden {
            self.hidden_s += long_s;
            return;
        }
        let place = |at: Place| Point::new(f64::from(at.x_mm), f64::from(at.y_mm)) * 1e-3;
        let at =
            |at_ms: f64| place(from) + (place(to) - place(from)) * ((at_ms - from.at_ms as f64) / whole_ms);
        let (first_ms, last_ms) = (first_ms as f64, last_ms as f64);
        let length_m = (at(last_ms) - at(first_ms)).length();
        let steps = (length_m / (0.5 * frame.cell_m)).ceil().clamp(1.0, STEPS_MAX);
        for step in 0..steps as u32 {
            let share = (f64::from(step) + 0.5) / steps;
            let cell = frame.cell_at(at(first_ms + (last_ms - first_ms) * share));
            let sum_s = cell.and_then(|cell| self.cells.get_mut(cell)).unwrap_or(&mut self.outside_s);
            *sum_s += long_s / steps;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        Frame { x: 0.0, y: 0.0, cell_m: 0.25, columns: 8, rows: 4 }
    }

    fn place(at_ms: u64, x_mm: i32, hidden: bool) -> Place {
        Place { at_ms, x_mm, y_mm: 100, hidden }
    }

    #[test]
    fn the_time_of_a_walk_goes_to_the_cells_it_passes_and_none_is_lost() {
        let mut heat = Heat { cells: vec![0.0; 32], ..Heat::default() };
        // Two metres in eight seconds, from one end of the lowest row to the other.
        heat.add(place(1000, 0, false), place(9000, 2000, false), (0, 100_000), &frame());
        assert!(heat.cells[..8].iter().all(|s| (s - 1.0).abs() < 1e-9), "{heat:?}");
        // Of a stand of ten seconds only those that are asked for.
        heat.add(place(9000, 1900, false), place(19_000, 1900, false), (0, 12_000), &frame());
        assert!((heat.cells[7] - 4.0).abs() < 1e-9, "{heat:?}");
        heat.add(place(0, 0, false), place(2000, 0, true), (0, 9000), &frame());
        heat.add(place(0, -500, false), place(3000, -500, false), (0, 9000), &frame());
        assert_eq!((heat.hidden_s, heat.outside_s), (2.0, 3.0));
        assert!((heat.cells.iter().sum::<f64>() - 11.0).abs() < 1e-9);
        let before = heat.clone();
        heat.add(place(5, 0, false), place(5, 9, false), (0, 9000), &frame());
        heat.add(place(5, 0, false), place(9, 9, false), (10, 9000), &frame());
        assert_eq!(heat, before, "no time");
    }

    #[test]
    fn cells_lie_around_the_zones_and_grow_with_them() {
        let site = |size_m: u32| -> Site {
            let corners = format!("[[1, 1], [{0}, 1], [{0}, {0}], [1, {0}]]", size_m + 1);
            toml::from_str(&format!("[[zone]]\nname = \"hall\"\npolygon = {corners}")).unwrap()
        };
        let small = Frame::around(&site(3));
        assert_eq!((small.x, small.cell_m, small.columns, small.rows), (1.0, 0.25, 12, 12));
        let middles: Vec<Point> = small.middles().collect();
        assert!(middles.iter().enumerate().all(|(cell, at)| small.cell_at(*at) == Some(cell)));
        assert_eq!(small.cell_at(Point::new(0.9, 2.0)), None);
        let large = Frame::around(&site(400));
        assert!(large.columns * large.rows <= 41_000 && large.cell_m > 1.9, "{large:?}");
        assert_eq!(Frame::around(&Site::default()), Frame::default());
    }
}
