//! What a module sees of the ground: which cells, and behind which crowds.
//!
//! ```text
//!   module ●───────▷ cell            seen: in its view, near enough for the clothes of the people there,
//!          ●───▷(person)   · cell    and neither a wall nor a body of the crowd stands before it
//! ```
//!
//! The beam to a cell and how far it goes are the laboratory's own, [`Caster`]: what is planned with is what is simulated.

use super::bits::Bits;
use super::ground::Ground;
use super::{Mount, Task};
use crate::world::raycast::{Caster, Thing};
use kehai_emulator::source::Revolution;
pub use kehai_tracking::ground::SIDES;
use kehai_tracking::ground::side;

/// A beam goes as far as a cell if what it meets is not farther before the cell's middle than half its side.
const SHARE_OF_CELL: f64 = 0.5;

/// What a module sees.
#[derive(Clone, PartialEq, Debug)]
pub struct Sight {
    /// Cells seen among people, crowd after crowd: number [`Ground::bit`].
    pub among: Bits,
    /// Side by side, the cells from which the module is on that side.
    pub towards: [Bits; SIDES],
    /// Cells seen in the empty room.
    pub empty: Bits,
}

/// What a module at a place sees; `things` is what stands still on the site.
#[must_use]
pub fn sight(task: &Task, ground: &Ground, things: &[Thing], place: &Mount) -> Sight {
    let optics = task.model.optics();
    let geometry = optics.geometry;
    let caster = Caster::new(place.pose, place.height_m, geometry, things);
    let reach_m = optics.reach_m(task.clothes, 1.0).min(f64::from(geometry.range_max_mm) * 1e-3);
    let entry_of = |at| caster.entry_of(at).filter(|(_, distance_m)| *distance_m <= reach_m);
    let in_view: Vec<(usize, usize, f64)> = ground
        .cells
        .iter()
        .enumerate()
        .filter_map(|(cell, place)| entry_of(place.at).map(|(entry, distance_m)| (cell, entry, distance_m)))
        .collect();
    let mut empty = Bits::new(ground.cells.len());
    let mut towards: [Bits; SIDES] = std::array::from_fn(|_| empty.clone());
    for (cell, ..) in &in_view {
        empty.set(*cell);
        if let Some(side) = towards.get_mut(side(ground.cells[*cell].at, place.pose.at)) {
            side.set(*cell);
        }
    }
    let mut among = Bits::new(ground.bits());
    if in_view.is_empty() {
        return Sight { among, towards, empty };
    }
    let slack_m = SHARE_OF_CELL * ground.cell_m;
    let now = Revolution { start_us: 0, period_us: geometry.period_us, earliest_us: 0 };
    for (crowd, people) in ground.crowds.iter().enumerate() {
        let seen = caster.cast(now, people, &[]);
        for (cell, entry, distance_m) in &in_view {
            let met_m = seen.get(*entry).copied().flatten().map_or(f64::INFINITY, |seen| seen.range_m);
            let bit = ground.bit(crowd, *cell);
            if met_m > distance_m - slack_m && ground.open.has(bit) {
                among.set(bit);
            }
        }
    }
    Sight { among, towards, empty }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A module on one side of all cells that sees these, of 64 or 128 bits.
    pub fn sight(side: usize, bits: &[usize]) -> Sight {
        let len = if bits.iter().any(|bit| *bit >= 64) { 128 } else { 64 };
        let of = |numbers: &[usize]| {
            let mut bits = Bits::new(len);
            numbers.iter().for_each(|number| bits.set(*number));
            bits
        };
        let all: Vec<usize> = (0..64).collect();
        let mut cells = Bits::new(64);
        all.iter().for_each(|cell| cells.set(*cell));
        let towards = std::array::from_fn(|own| if own == side { cells.clone() } else { Bits::new(64) });
        Sight { among: of(bits), towards, empty: cells }
    }
}
