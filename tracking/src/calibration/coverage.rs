//! The coverage map: which device sees which part of the site when no person is in the way.
//!
//! ```text
//!   . 1 1 1 2 2 .      a grid; each cell knows its area: 1 is seen by shelf and table, 2 by shelf
//!   . 1 2 2 2 2 .      (backgrounds end at walls: what lies behind is seen by none)
//! ```

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::geometry::{Point, bounds};
use crate::observation::View;

/// Side of a cell, m.
const CELL_M: f64 = 0.25;

/// Most cells: 160 m by 160 m; a larger place has larger cells.
const MOST: f64 = 400_000.0;

/// A grid of which modules see what.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Coverage {
    /// Lower left corner.
    pub x: f64,
    /// Lower left corner.
    pub y: f64,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Cells in a row.
    pub columns: usize,
    /// The area of each cell, row by row, from the lowest: 0 is seen by no module, 1 is the first of `areas`.
    pub seen_by: Vec<usize>,
    /// What is seen by the same modules, the largest first.
    pub areas: Vec<Area>,
    /// Square metres seen by at least one, and by at least two modules.
    pub seen_m2: [f64; 2],
}

/// What is seen by the same modules.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CoverageArea")]
pub struct Area {
    /// Their names, in the order of the site; at least one.
    pub modules: Vec<String>,
    /// How large it is, m².
    pub m2: f64,
}

/// A module: its name, its view, and up to which range each beam is empty when no person is there, m.
pub type Seer = (String, View, Vec<f64>);

/// Finds which modules see what.
#[must_use]
pub fn coverage(modules: &[Seer]) -> Coverage {
    let corner = |(_, view, empty_m): &Seer| -> Vec<Point> {
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
    let sees = |(_, view, empty_m): &Seer, at: Point| {
        let (range_m, beam) = view.beam_at(at);
        beam.and_then(|beam| empty_m.get(usize::from(beam))).is_some_and(|empty_m| range_m < *empty_m)
    };
    let middle = |index: usize| {
        let (column, row) = (index % columns.max(1), index / columns.max(1));
        low + Point::new(column as f64 + 0.5, row as f64 + 0.5) * cell_m
    };
    let by = |index: usize| -> Vec<&str> {
        let at = middle(index);
        modules.iter().filter(|module| sees(module, at)).map(|module| module.0.as_str()).collect()
    };
    let cells: Vec<Vec<&str>> = (0..columns * rows).map(by).collect();
    let mut counts: BTreeMap<&[&str], usize> = BTreeMap::new();
    cells.iter().filter(|by| !by.is_empty()).for_each(|by| *counts.entry(by).or_default() += 1);
    let mut sorted: Vec<(&[&str], usize)> = counts.into_iter().collect();
    sorted.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let places: BTreeMap<&[&str], usize> = sorted.iter().map(|(by, _)| *by).zip(1..).collect();
    let m2 = |count: usize| count as f64 * cell_m * cell_m;
    let area = |(by, count): &(&[&str], usize)| Area {
        modules: by.iter().map(|name| (*name).to_owned()).collect(),
        m2: m2(*count),
    };
    let at_least = |most: usize| m2(cells.iter().filter(|by| by.len() >= most).count());
    Coverage {
        x: low.x,
        y: low.y,
        cell_m,
        columns,
        seen_by: cells.iter().map(|by| places.get(by.as_slice()).copied().unwrap_or(0)).collect(),
        areas: sorted.iter().map(area).collect(),
        seen_m2: [at_least(1), at_least(2)],
    }
}

#[cfg(test)]
mod tests {
    use kehai::scan::{Geometry, URG_04LX};

    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn a_cell_knows_who_sees_it() {
        // Two modules 4 m apart that look at each other, each 3 m far: the middle 2 m are seen by both.
        let geometry = Geometry::new(URG_04LX).unwrap();
        let module = |name: &str, x: f64, yaw_rad: f64| {
            let pose = Pose { at: Point::new(x, 0.0), yaw_rad };
            let view = View { module: 0, pose, height_m: 0.6, geometry, upside_down: false };
            (name.to_owned(), view, vec![3.0; 2000])
        };
        let found = coverage(&[module("left", 0.0, 0.0), module("right", 4.0, std::f64::consts::PI)]);
        let who = |x: f64, y: f64| -> Vec<String> {
            let (column, row) =
                (((x - found.x) / found.cell_m) as usize, ((y - found.y) / found.cell_m) as usize);
            let area = found.seen_by[row * found.columns + column];
            area.checked_sub(1).map_or_else(Vec::new, |area| found.areas[area].modules.clone())
        };
        assert_eq!(who(0.7, 0.0), ["left"]);
        assert_eq!(who(2.0, 0.0), ["left", "right"]);
        assert_eq!(who(3.3, 0.0), ["right"]);
        assert_eq!(who(2.0, 2.9), [""; 0]);
        let total: f64 = found.areas.iter().map(|area| area.m2).sum();
        assert!(
            (total - found.seen_m2[0]).abs() < 1e-9
                && found.areas.is_sorted_by(|one, other| one.m2 >= other.m2)
        );
    }
}
