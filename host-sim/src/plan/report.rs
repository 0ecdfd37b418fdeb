//! What is said of a layout: zone by zone and cell by cell.
//!
//! ```text
//!   Seen, among crowds ─▶ share of each cell's crowds ─▶ picture     ─▶ zones: by one, from two sides, blind m²
//! ```

use super::bits::Bits;
use super::layout::{Layout, Survey};
use super::seen::Seen;
use crate::picture::coverage::CellShown;

/// How much of an area is seen with people standing about, and how much by no module at all.
#[derive(Clone, PartialEq, Debug, Default, serde::Serialize)]
pub struct Share {
    /// The zone's name; empty for all zones together.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub zone: String,
    /// Its area, m².
    pub m2: f64,
    /// By at least one module, 0 to 1.
    pub one: f64,
    /// From at least two sides.
    pub two: f64,
    /// Not seen even in the empty room, m².
    pub blind_m2: f64,
}

impl Survey {
    /// All cells as a layout sees them.
    #[must_use]
    pub fn cells(&self, layout: &Layout) -> Vec<CellShown> {
        let (among, empty) = (self.among(layout), self.empty(layout));
        let share = |bits: &Bits, cell: usize| {
            let open = (0..self.ground.crowds.len()).map(|crowd| self.ground.bit(crowd, cell));
            let (seen, of) = open
                .filter(|bit| self.ground.open.has(*bit))
                .fold((0_u32, 0_u32), |(seen, of), bit| (seen + u32::from(bits.has(bit)), of + 1));
            f64::from(seen) / f64::from(of.max(1))
        };
        let shown = |(cell, place): (usize, &super::ground::Cell)| CellShown {
            at: place.at,
            seen: [share(&among.one, cell), share(&among.two, cell)],
            is_blind: !empty.has(cell),
        };
        self.ground.cells.iter().enumerate().map(shown).collect()
    }

    /// All zones together, then each of them.
    #[must_use]
    pub fn shares(&self, layout: &Layout) -> Vec<Share> {
        let shown = self.cells(layout);
        let cell_m2 = self.ground.cell_m * self.ground.cell_m;
        let of = |zone: Option<usize>| {
            let own = self
                .ground
                .cells
                .iter()
                .zip(&shown)
                .filter(|(cell, _)| zone.is_none_or(|zone| cell.zone == zone));
            let own: Vec<&CellShown> = own.map(|(_, shown)| shown).collect();
            let mean =
                |by: usize| own.iter().map(|cell| cell.seen[by]).sum::<f64>() / own.len().max(1) as f64;
            Share {
                zone: zone
                    .and_then(|zone| self.ground.zones.get(zone))
                    .map(|zone| zone.name.clone())
                    .unwrap_or_default(),
                m2: own.len() as f64 * cell_m2,
                one: mean(0),
                two: mean(1),
                blind_m2: own.iter().filter(|cell| cell.is_blind).count() as f64 * cell_m2,
            }
        };
        std::iter::once(None).chain((0..self.ground.zones.len()).map(Some)).map(of).collect()
    }

    fn among(&self, layout: &Layout) -> Seen {
        self.choice().seen(&layout.places)
    }

    fn empty(&self, layout: &Layout) -> Bits {
        let mut empty = Bits::new(self.ground.cells.len());
        let new = layout.places.iter().filter_map(|place| self.sights.get(*place));
        new.chain(&self.kept).for_each(|sight| empty.add(&sight.empty));
        empty
    }
}
