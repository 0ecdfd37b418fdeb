//! How many people are in each zone, how sure that is, and how much of the zone was seen.
//!
//! ```text
//!   tracks ─▶ inside? existence ─▶ P(0), P(1), …          count: confirmed and occluded tracks inside
//!   observations ─▶ cells of 0.2 m, seen when last ─▶ share    known · partly · unknown
//! ```
//!
//! An unexplained track, which was never seen to enter and has not moved, is in the distribution and not in the
//! count; in a zone that is `secure` it is in both. A part of another track is in neither, anywhere.
//!
//! Which beam of a module points at a cell does not change, so that is worked out once a module; what lies behind its
//! walls is left out, once a background. So a scan costs as many cells as that module can see, however large the zones
//! are and however many others there are.
//!
//! *Unknown* is never *empty*: with no module looking, nothing is known, whatever the tracks say.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::cells::Areas;
use crate::geometry::{Point, bounds, inside};
use crate::jsonl::{ZoneKnown, ZoneLine};
use crate::observation::{Observation, View};
use crate::site::Site;
use crate::tracker::{LifeCycle, Origin, TrackState};

/// Side of a cell, m: a body.
const CELL_M: f64 = 0.2;

/// In the zone of a door, cells so near to the middle of a candidate are seen, m: a body hides what is under it, and
/// that it is there is what is to be seen.
const BODY_M: f64 = 0.3;

/// A candidate wider than this is a body, m: half a narrow one.
const WIDE_M: f64 = 0.15;

/// A cell that was last seen so long ago is not seen, s.
const SEEN_S: f64 = 2.0;

/// Seen share from which a zone is known.
const KNOWN: f64 = 0.8;

/// Seen share under which nothing is known.
const UNKNOWN: f64 = 0.1;

/// Probability that an unexplained track that has not moved since it appeared is a person: people bring things as often
/// as people in their arms.
const UNEXPLAINED: f64 = 0.5;

/// The zones of a site.
#[derive(Debug)]
pub struct Zones {
    zones: Vec<Zone>,
    /// Their polygons, in the same order.
    areas: Areas,
    /// Those before a door, which unlocks only if nearly all of them is seen.
    guarded: Vec<usize>,
    /// What each module can see of them, by its number in the site.
    reaches: BTreeMap<usize, Reach>,
}

#[derive(Debug)]
struct Zone {
    name: String,
    secure: bool,
    cells: Vec<Cell>,
    /// The rectangle around them.
    around: (Point, Point),
}

#[derive(Debug)]
struct Cell {
    middle: Point,
    seen_s: f64,
}

/// The cells in a module's view.
#[derive(Debug)]
struct Reach {
    view: Arc<View>,
    /// First those before the background, then those behind it, each in the order of their beams.
    cells: Box<[InView]>,
    before: usize,
    background_mm: Arc<[u16]>,
}

/// A cell in a module's view.
#[derive(Clone, Copy, Debug)]
struct InView {
    zone: u32,
    cell: u32,
    /// The beam that points at its middle, and how far it has to be empty for the cell to be, mm.
    beam: u16,
    empty_mm: u16,
}

impl Zones {
    /// Of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let guarded = |zone: &crate::site::Zone| site.doors.iter().any(|door| door.zone == zone.name);
        let guarded = (0..).zip(&site.zones).filter(|(_, zone)| guarded(zone)).map(|(number, _)| number);
        Self {
            guarded: guarded.collect(),
            areas: Areas::of(site.zones.iter().map(crate::site::Zone::corners).collect()),
            zones: site.zones.iter().map(Zone::new).collect(),
            reaches: BTreeMap::new(),
        }
    }

    /// Notes what a module saw.
    pub fn observe(&mut self, observation: &Observation) {
        let Self { zones, reaches, guarded, .. } = self;
        let reach = match reaches.entry(observation.view.module) {
            std::collections::btree_map::Entry::Occupied(known) => {
                let known = known.into_mut();
                if !Arc::ptr_eq(&known.view, &observation.view) {
                    *known = Reach::of(&observation.view, zones);
                }
                known
            }
            std::collections::btree_map::Entry::Vacant(new) => {
                new.insert(Reach::of(&observation.view, zones))
            }
        };
        reach.end_at(&observation.background_mm);
        let mut see = |in_view: &InView| {
            let empty_mm = observation.empty_mm.get(usize::from(in_view.beam));
            if empty_mm.is_some_and(|empty_mm| *empty_mm > in_view.empty_mm)
                && let Some(zone) = zones.get_mut(in_view.zone as usize)
                && let Some(cell) = zone.cells.get_mut(in_view.cell as usize)
            {
                cell.seen_s = cell.seen_s.max(observation.start_s);
            }
        };
        reach.before().iter().for_each(&mut see);
        // Something may stand where no background is known, or behind it.
        let geometry = &observation.view.geometry;
        for candidate in observation.detections.iter().map(|seen| &seen.candidate) {
            let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
            reach.behind(first, last).for_each(&mut see);
        }
        for &number in guarded.iter() {
            let Some(zone) = zones.get_mut(number) else { continue };
            for seen in observation.detections.iter().filter(|seen| seen.width_m > WIDE_M) {
                let middle = Point::new(seen.centre.x, seen.centre.y);
                for cell in zone.cells.iter_mut().filter(|cell| (cell.middle - middle).length() < BODY_M) {
                    cell.seen_s = cell.seen_s.max(observation.start_s);
                }
            }
        }
    }

    /// What is known of each zone at `at_s`, by its name.
    #[must_use]
    pub fn lines(&self, tracks: &[TrackState], at_s: f64) -> BTreeMap<String, ZoneLine> {
        let mut inside = vec![Vec::new(); self.zones.len()];
        for track in tracks {
            for zone in self.areas.around(track.at) {
                if let Some(inside) = inside.get_mut(zone) {
                    inside.push(track);
                }
            }
        }
        let lines = self.zones.iter().zip(inside);
        lines.map(|(zone, inside)| (zone.name.clone(), zone.line(&inside, at_s))).collect()
    }
}

impl Reach {
    fn of(view: &Arc<View>, zones: &[Zone]) -> Self {
        let range_max_m = f64::from(view.geometry.parts().range_max_mm) * 0.001;
        let reaches = |(_, zone): &(u32, &Zone)| {
            let (low, high) = zone.around;
            let at = view.pose.at;
            let nearest = Point::new(at.x.clamp(low.x, high.x), at.y.clamp(low.y, high.y));
            (nearest - at).length() <= range_max_m + CELL_M
        };
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
    fn end_at(&mut self, background_mm: &Arc<[u16]>) {
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

    fn before(&self) -> &[InView] {
        self.cells.get(..self.before).unwrap_or_default()
    }

    /// Cells of some beams behind the background.
    fn behind(&self, first: u16, last: u16) -> impl Iterator<Item = &InView> {
        let behind = self.cells.get(self.before..).unwrap_or_default();
        let from = behind.partition_point(|in_view| in_view.beam < first);
        behind.iter().skip(from).take_while(move |in_view| in_view.beam <= last)
    }
}

impl Zone {
    fn new(zone: &crate::site::Zone) -> Self {
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
        Self { name: zone.name.clone(), secure: zone.secure, cells, around: (low, high) }
    }

    /// The record of this zone, from the tracks inside.
    fn line(&self, tracks: &[&TrackState], at_s: f64) -> ZoneLine {
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
        ZoneLine { count, p, seen_share, state }
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
            let zone: crate::site::Zone = toml::from_str(&text).unwrap();
            Zone::new(&zone).line(&[track], 10.0)
        };
        let counted = |track, secure| (line(track, secure).count, line(track, secure).p);
        assert_eq!(counted(&unexplained, false), (0, vec![0.5, 0.5]));
        assert_eq!(counted(&unexplained, true), (1, vec![0.0, 1.0]));
        assert_eq!(counted(&part, false), (0, vec![1.0]));
        assert_eq!(counted(&part, true), (0, vec![1.0]));
    }

    #[test]
    fn a_zone_nobody_looks_at_is_unknown() {
        let zone: crate::site::Zone =
            toml::from_str("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]").unwrap();
        let zone = Zone::new(&zone);
        assert_eq!(zone.cells.len(), 25);
        assert_eq!(zone.line(&[], 10.0).state, ZoneKnown::Unknown);
    }
}
