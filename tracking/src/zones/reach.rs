//! The cells of all zones in a module's view.
//!
//! ```text
//!   module ●───beam───▷ cell  cell │ cell        before the background, then behind it,
//!                                  │ wall        each in the order of their beams
//! ```

use std::sync::Arc;

use super::zone::{CELL_M, Zone};
use crate::geometry::Point;
use crate::observation::View;

/// The cells in a module's view.
#[derive(Debug)]
pub struct Reach {
    pub view: Arc<View>,
    /// First those before the background, then those behind it, each in the order of their beams.
    pub cells: Box<[InView]>,
    pub before: usize,
    pub background_mm: Arc<[u16]>,
}

/// A cell in a module's view.
#[derive(Clone, Copy, Debug)]
pub struct InView {
    pub zone: u32,
    pub cell: u32,
    /// The beam that points at its middle, and how far it has to be empty for the cell to be, mm.
    pub beam: u16,
    pub empty_mm: u16,
}

impl Reach {
    pub fn of(view: &Arc<View>, zones: &[Zone]) -> Self {
        let range_max_m = f64::from(view.geometry.parts().range_max_mm) * 0.001;
        let reaches = |(_, zone): &(u32, &Zone)| zone.distance_m(view.pose.at) <= range_max_m + CELL_M;
        let numbered = (0..).zip(zones).filter(reaches).flat_map(|(zone, whole)| {
            (0..).zip(&whole.cells).map(move |(number, cell)| (zone, number, cell.middle))
        });
        let in_view = |(zone, cell, middle): (u32, u32, Point)| {
            if (middle - view.pose.at).length() > range_max_m + CELL_M {
                return None;
            }
            let (distance_m, beam) = view.beam_at(middle);
            let empty_mm = ((distance_m - 0.5 * CELL_M) * 1000.0).clamp(0.0, f64::from(u16::MAX)) as u16;
            Some(InView { zone, cell, beam: beam?, empty_mm })
        };
        let cells = numbered.filter_map(in_view).collect();
        let mut reach = Self { view: Arc::clone(view), cells, before: 0, background_mm: Arc::default() };
        reach.sort();
        reach
    }

    /// Finds out what is before the background, if that has changed.
    pub fn end_at(&mut self, background_mm: &Arc<[u16]>) {
        if Arc::ptr_eq(&self.background_mm, background_mm) {
            return;
        }
        self.background_mm = Arc::clone(background_mm);
        self.sort();
    }

    fn sort(&mut self) {
        let Self { cells, background_mm, .. } = self;
        let is_behind = |in_view: &InView| {
            let background_mm = background_mm.get(usize::from(in_view.beam));
            background_mm.is_none_or(|background_mm| *background_mm <= in_view.empty_mm)
        };
        cells.sort_unstable_by_key(|in_view| (is_behind(in_view), in_view.beam));
        self.before = cells.partition_point(|in_view| !is_behind(in_view));
    }

    pub fn before(&self) -> &[InView] {
        self.cells.get(..self.before).unwrap_or_default()
    }

    /// Cells of some beams behind the background.
    pub fn behind(&self, first: u16, last: u16) -> impl Iterator<Item = &InView> {
        let behind = self.cells.get(self.before..).unwrap_or_default();
        let from = behind.partition_point(|in_view| in_view.beam < first);
        behind.iter().skip(from).take_while(move |in_view| in_view.beam <= last)
    }
}
