//! Whether a counting line is seen: its cells, in the order of the line.
//!
//! ```text
//!   from ├──┬──┬──┬──┬──┬──┤ to      a cell of 0.2 m is seen for 2 s after a module last saw it empty, or a body in it
//!        │  │▒▒│  │▒▒│▒▒│▒▒│         known: no gap is as wide as a body · unknown: nothing is seen · else partly
//!        └──┴──┴──┴──┴──┴──┘
//! ```

use super::zone::{CELL_M, Cell, SEEN_S, Zone};
use crate::geometry::{Point, bounds};
use crate::occupancy::ZoneKnown;
use crate::site::line::CountingLine;

/// So many cells that are not seen, side by side, are narrower than a body of 0.45 m.
const NARROW: usize = 2;

/// A line as a zone that is never told of.
pub fn of(line: &CountingLine) -> Zone {
    let (from, to) = line.ends();
    let cells = (line.length_m() / CELL_M).round().max(1.0);
    let middle = |cell: u32| Cell::new(from + (to - from) * ((f64::from(cell) + 0.5) / cells));
    let around = bounds([from, to]).unwrap_or_default();
    Zone::of_cells(line.name.clone(), false, (0..cells as u32).map(middle).collect(), around)
}

/// How much of it is known at `at_s`.
pub fn known(line: &Zone, at_s: f64) -> ZoneKnown {
    let (mut gap, mut widest, mut seen) = (0, 0, 0);
    for cell in &line.cells {
        let is_seen = at_s - cell.seen_s < SEEN_S;
        gap = if is_seen { 0 } else { gap + 1 };
        widest = widest.max(gap);
        seen += usize::from(is_seen);
    }
    match seen {
        _ if at_s < line.known_s => ZoneKnown::Unknown,
        0 => ZoneKnown::Unknown,
        _ if widest > NARROW => ZoneKnown::Partly,
        _ => ZoneKnown::Known,
    }
}

/// Notes that a body stands at `middle`: that it is there is what is to be seen.
pub fn note_body(cells: &mut [Cell], middle: Point, reach_m: f64, at_s: f64) {
    for cell in cells.iter_mut().filter(|cell| (cell.middle - middle).length() < reach_m) {
        cell.seen_s = cell.seen_s.max(at_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_known_while_no_body_passes_through_what_is_not_seen() {
        let line = CountingLine { name: "front".into(), from: [0.0, 0.0], to: [0.0, 2.0] };
        let mut strip = of(&line);
        assert_eq!(strip.cells.len(), 10);
        assert_eq!(known(&strip, 5.0), ZoneKnown::Unknown, "never seen");
        strip.cells.iter_mut().for_each(|cell| cell.seen_s = 5.0);
        assert_eq!([known(&strip, 6.9), known(&strip, 7.1)], [ZoneKnown::Known, ZoneKnown::Unknown]);
        strip.cells[3].seen_s = 0.0;
        strip.cells[4].seen_s = 0.0;
        assert_eq!(known(&strip, 6.0), ZoneKnown::Known, "0.4 m are hidden");
        strip.cells[5].seen_s = 0.0;
        assert_eq!(known(&strip, 6.0), ZoneKnown::Partly, "0.6 m are");
        note_body(&mut strip.cells, Point::new(0.1, 0.9), 0.3, 6.0);
        assert_eq!(known(&strip, 6.0), ZoneKnown::Known, "a body there is what hides them");
    }
}
