//! A zone: its cells, and its line from what was seen of them and the tracks inside.
//!
//! ```text
//!   ┌──┬──┬──┐   a cell is a body wide, and seen for 2 s after a module last saw it empty
//!   │▒▒│  │▒▒│   share of them that is seen ─▶ known · partly · unknown
//!   └──┴──┴──┘   tracks inside, each with its existence ─▶ P(0), P(1), …
//! ```

use crate::geometry::{Point, bounds, inside};
use crate::occupancy::{Found, ZoneKnown, ZoneLine};
use crate::site;
use crate::tracker::{LifeCycle, Origin, TrackState};

/// Side of a cell, m: a body.
pub const CELL_M: f64 = 0.2;

/// A cell that was last seen so long ago is not seen, s.
const SEEN_S: f64 = 2.0;

/// Seen share from which a zone is known.
const KNOWN: f64 = 0.8;

/// Seen share under which nothing is known.
const UNKNOWN: f64 = 0.1;

/// Probability that an unexplained track that has not moved since it appeared is a person: people bring things as often
/// as people in their arms.
const UNEXPLAINED: f64 = 0.5;

/// A zone.
#[derive(Debug)]
pub struct Zone {
    pub name: String,
    pub secure: bool,
    pub cells: Vec<Cell>,
    /// The rectangle around them.
    pub around: (Point, Point),
    /// Before this time nothing is known of it, s.
    pub known_s: f64,
}

/// A part of a zone.
#[derive(Debug)]
pub struct Cell {
    pub middle: Point,
    pub seen_s: f64,
}

impl Cell {
    /// Cells of two zones at one place have the same.
    pub fn place(&self) -> (i64, i64) {
        ((self.middle.x / CELL_M).floor() as i64, (self.middle.y / CELL_M).floor() as i64)
    }
}

impl Zone {
    pub fn new(zone: &site::Zone) -> Self {
        let polygon = zone.corners();
        let (low, high) = bounds(polygon.iter().copied()).unwrap_or_default();
        let mut cells = Vec::new();
        let size = high - low;
        let (columns, rows) = ((size.x / CELL_M).ceil() as u32, (size.y / CELL_M).ceil() as u32);
        for row in 0..rows {
            for column in 0..columns {
                let offset = Point::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * CELL_M;
                let middle = low + offset;
                if inside(middle, &polygon) {
                    cells.push(Cell { middle, seen_s: f64::NEG_INFINITY });
                }
            }
        }
        let known_s = f64::NEG_INFINITY;
        Self { name: zone.name.clone(), secure: zone.secure, cells, around: (low, high), known_s }
    }

    /// From a place to the rectangle around it, m.
    pub fn distance_m(&self, at: Point) -> f64 {
        let (low, high) = self.around;
        (Point::new(at.x.clamp(low.x, high.x), at.y.clamp(low.y, high.y)) - at).length()
    }

    /// The record of this zone, from the tracks inside.
    pub fn line(&self, tracks: &[&TrackState], at_s: f64) -> ZoneLine {
        if at_s < self.known_s {
            return ZoneLine::unknown();
        }
        let mut count = 0;
        let mut p = vec![1.0];
        for track in tracks {
            match track.origin {
                // Shown, and never counted: the track that it is a part of stands for both.
                Origin::PartOf(_) => {}
                // Perhaps a thing: the count may be higher by one.
                Origin::Unexplained if !self.secure => add(&mut p, UNEXPLAINED * track.existence),
                Origin::Entered if track.state == LifeCycle::Tentative => {}
                Origin::Unexplained | Origin::Entered => {
                    count += 1;
                    add(&mut p, track.existence);
                }
            }
        }
        let seen = self.cells.iter().filter(|cell| at_s - cell.seen_s < SEEN_S).count();
        let seen_share = seen as f64 / self.cells.len().max(1) as f64;
        let state = match seen_share {
            share if share >= KNOWN => ZoneKnown::Known,
            share if share < UNKNOWN => ZoneKnown::Unknown,
            _ => ZoneKnown::Partly,
        };
        ZoneLine::new(Found { count, p }, seen_share, state)
    }
}

/// Adds one more person, who is there with probability `existence`.
fn add(p: &mut Vec<f64>, existence: f64) {
    p.push(0.0);
    for number in (0..p.len()).rev() {
        let one_less = if number == 0 { 0.0 } else { p[number - 1] };
        p[number] = p[number] * (1.0 - existence) + one_less * existence;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distribution_is_that_of_independent_people() {
        let mut p = vec![1.0];
        add(&mut p, 1.0);
        add(&mut p, 0.5);
        assert_eq!(p, [0.0, 0.5, 0.5]);
    }

    #[test]
    fn an_unexplained_track_counts_only_where_it_is_secure_and_a_part_nowhere() {
        let unexplained = TrackState {
            id: 1,
            at: Point::new(0.5, 0.5),
            velocity: Point::default(),
            covariance_m2: [0.01, 0.0, 0.01],
            state: LifeCycle::Tentative,
            existence: 1.0,
            reason: "unexplained",
            origin: Origin::Unexplained,
        };
        let part = TrackState { origin: Origin::PartOf(1), ..unexplained };
        let line = |track: &TrackState, secure: bool| {
            let text =
                format!("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]\nsecure = {secure}");
            let zone: site::Zone = toml::from_str(&text).unwrap();
            let mut zone = Zone::new(&zone);
            zone.cells.iter_mut().for_each(|cell| cell.seen_s = 10.0);
            zone.line(&[track], 10.0)
        };
        let counted = |track, secure| {
            let line = line(track, secure);
            (line.count(), line.p().to_vec())
        };
        assert_eq!(counted(&unexplained, false), (Some(0), vec![0.5, 0.5]));
        assert_eq!(counted(&unexplained, true), (Some(1), vec![0.0, 1.0]));
        assert_eq!(counted(&part, false), (Some(0), vec![1.0]));
        assert_eq!(counted(&part, true), (Some(0), vec![1.0]));
    }

    #[test]
    fn a_zone_nobody_looks_at_is_unknown() {
        let zone: site::Zone =
            toml::from_str("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]").unwrap();
        let zone = Zone::new(&zone);
        assert_eq!(zone.cells.len(), 25);
        assert_eq!(zone.line(&[], 10.0).state(), ZoneKnown::Unknown);
    }
}
