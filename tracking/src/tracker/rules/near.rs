//! The active set: the tracks inside the field of view of the device that reports. A report costs only what they cost.
//!
//! ```text
//!   ┌─────┬─────┬─────┐
//!   │  ·  │     │ ·   │     cells with every track that is there, or soon will be;
//!   ├─────╭─────╮─────┤     those near a device are looked for in the cells around it: a coarse gate
//!   │     │●  · │  ·  │
//!   └─────╰─────╯─────┘
//! ```
//!
//! A track outside every field of view is not predicted until a device covers it again, or until all tracks are asked
//! for. What lies behind the walls that a device sees is outside its field of view ([`Reach`]), except tracks that this
//! device has detected itself.

use super::RuleTracker;
use super::associate::GATE_M;
use super::track::Track;
use crate::cells::Cells;
use crate::geometry::Point;
use crate::observation::{LATE_S, Observation, View};
use crate::site::Site;

/// The cells are valid for reports that are at most so much older, s: the oldest in use, plus a scan.
const BEFORE_S: f64 = LATE_S + 0.3;

/// The cells are also valid for reports that are at most so much newer, s; then all tracks are put anew.
const AFTER_S: f64 = 1.0;

/// Beams of a sector, as far as which a module's reach is the same: a twentieth of its view.
const SECTOR: usize = 32;

/// The cells in which the tracks are: as exact as needed to find those near a module.
#[derive(Debug, Default)]
pub struct Near {
    cells: Cells,
    /// The rectangle in which each track was put, in the order of the tracks.
    put: Vec<(Point, Point)>,
    /// From when to when the cells are true, s.
    true_s: Option<(f64, f64)>,
    /// Those near the module of the observation, in the order of the tracks.
    pub now: Vec<usize>,
}

impl Near {
    /// Over a site.
    #[must_use]
    pub fn over(site: &Site) -> Self {
        let modules = site.modules.iter().filter(|module| module.placed).map(|module| module.pose().at);
        let walls = site.walls.iter().flat_map(|wall| wall.points.iter().copied().map(Point::from));
        Self { cells: Cells::over(modules.chain(walls)), ..Self::default() }
    }

    /// Puts all tracks anew, for reports about `at_s`.
    fn put_all(&mut self, tracks: &[Track], at_s: f64) {
        self.cells.clear();
        self.put.clear();
        self.true_s = Some((at_s - BEFORE_S, at_s + AFTER_S));
        self.put_new(tracks);
    }

    /// Puts the tracks that are new since the last time.
    fn put_new(&mut self, tracks: &[Track]) {
        let Some(true_s) = self.true_s else { return };
        for track in tracks.iter().skip(self.put.len()) {
            let rectangle = whereabouts(track, true_s);
            self.cells.put(self.put.len() as u32, rectangle);
            self.put.push(rectangle);
        }
    }

    /// Puts the tracks anew that were near and have moved, and adds the new ones.
    fn settle(&mut self, tracks: &[Track]) {
        let Some(true_s) = self.true_s else { return };
        self.put_new(tracks);
        for &index in &self.now {
            let (Some(track), Some(put)) = (tracks.get(index), self.put.get_mut(index)) else { continue };
            let rectangle = whereabouts(track, true_s);
            if !self.cells.are_same(*put, rectangle) {
                self.cells.take_out(index as u32, *put);
                self.cells.put(index as u32, rectangle);
                *put = rectangle;
            }
        }
    }

    /// A track is gone; those after it are one place further ahead.
    fn forget(&mut self, index: usize) {
        if index < self.put.len() {
            let rectangle = self.put.remove(index);
            self.cells.take_out(index as u32, rectangle);
            self.cells.close_up(index as u32);
        }
        self.now.retain(|&near| near != index);
        self.now.iter_mut().filter(|near| **near > index).for_each(|near| *near -= 1);
    }
}

/// How far a module sees, all around.
struct Reach<'a> {
    view: &'a View,
    forward: Point,
    /// To the farthest wall or empty place of each sector, m.
    sectors_m: Vec<f64>,
    /// Of all of them, m.
    farthest_m: f64,
}

impl<'a> Reach<'a> {
    fn of(observation: &'a Observation) -> Self {
        let farthest_mm = |ranges_mm: &[u16]| ranges_mm.iter().copied().max().unwrap_or(0);
        let mut sectors_mm: Vec<u16> = observation.background_mm.chunks(SECTOR).map(farthest_mm).collect();
        for (sector_mm, empty_mm) in sectors_mm.iter_mut().zip(observation.empty_mm.chunks(SECTOR)) {
            *sector_mm = farthest_mm(empty_mm).max(*sector_mm);
        }
        let sectors_m: Vec<f64> = sectors_mm.iter().map(|&range_mm| f64::from(range_mm) * 0.001).collect();
        let nearest_mm = observation.detections.iter().map(|seen| seen.candidate.near_mm).max().unwrap_or(0);
        let farthest_m = sectors_m.iter().copied().fold(f64::from(nearest_mm) * 0.001, f64::max);
        Self { view: &observation.view, forward: observation.view.forward(), sectors_m, farthest_m }
    }

    /// Whether a part of a circle is nearer than the walls behind it.
    fn is_open(&self, middle: Point, radius_m: f64) -> bool {
        let geometry = &self.view.geometry;
        let offset = middle - self.view.pose.at;
        let distance_m = offset.length();
        if distance_m < 1.5 * radius_m {
            return true;
        }
        // Up to two thirds an arc sine is at most 1.1 of its argument.
        let half = 1.1 * radius_m / distance_m;
        let local = Point::new(offset.dot(self.forward), offset.dot(self.forward.left()));
        let bearing = local.angle_rad() - f64::from(geometry.bearing_rad(0));
        let beam_rad = f64::from(geometry.beam_rad());
        let (from, to) = ((bearing - half) / beam_rad, (bearing + half) / beam_rad);
        if to < 0.0 || from >= f64::from(geometry.beams()) {
            return false;
        }
        let (from, to) = (from.max(0.0) as usize / SECTOR, to as usize / SECTOR);
        let sectors_m = self.sectors_m.iter().take(to + 1).skip(from);
        sectors_m.into_iter().any(|reach_m| distance_m < reach_m + radius_m)
    }
}

/// The rectangle in which a track is between two times.
fn whereabouts(track: &Track, (from_s, until_s): (f64, f64)) -> (Point, Point) {
    if let Some(cloud) = &track.cloud {
        let (middle, radius_m) = cloud.around();
        let reach = Point::new(radius_m, radius_m);
        return (middle - reach, middle + reach);
    }
    let (one, other) = (track.motion.place(from_s), track.motion.place(until_s));
    (Point::new(one.x.min(other.x), one.y.min(other.y)), Point::new(one.x.max(other.x), one.y.max(other.y)))
}

impl RuleTracker {
    /// Finds the tracks within reach of an observation's module, and brings their existence up to date.
    pub(super) fn find_near(&mut self, observation: &Observation) {
        let reach = Reach::of(observation);
        let reach_m = reach.farthest_m + GATE_M;
        let (at, at_s, module) = (observation.view.pose.at, observation.start_s, observation.view.module);
        let Self { near, tracks, scan, .. } = self;
        if near.true_s.is_none_or(|(from_s, until_s)| !(from_s..until_s).contains(&at_s)) {
            near.put_all(tracks, at_s);
        }
        near.now.clear();
        let span = Point::new(reach_m, reach_m);
        for index in near.cells.near((at - span, at + span)) {
            let Some(track) = tracks.get_mut(index).filter(|track| track.near_in != *scan) else { continue };
            let (middle, radius_m) = match &track.cloud {
                Some(cloud) => cloud.around(),
                None => (track.motion.place(at_s), 0.0),
            };
            let is_within = (middle - at).length() < reach_m + radius_m;
            if is_within && (track.known_to(module) || reach.is_open(middle, GATE_M + radius_m)) {
                track.near_in = *scan;
                near.now.push(index);
            }
        }
        near.now.sort_unstable();
        self.catch_up();
    }

    /// Adds a track that was found by other means to those that are near.
    pub(super) fn is_near(&mut self, index: usize) {
        if let Err(place) = self.near.now.binary_search(&index) {
            self.near.now.insert(place, index);
        }
    }

    /// Puts the near tracks into the cells where they are now.
    pub(super) fn settle(&mut self) {
        self.near.settle(&self.tracks);
    }

    /// The place of a track among all: they are in the order of their numbers.
    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.tracks.binary_search_by_key(&id, |track| track.id).ok()
    }

    /// Takes a track out.
    pub(super) fn remove(&mut self, index: usize) -> Track {
        self.near.forget(index);
        self.tracks.remove(index)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::kehai::scan::{Geometry, URG_04LX};

    use super::*;

    /// A module at the origin that looks along x, with walls at 3 m but for a door before it.
    fn with_a_door(door: std::ops::Range<usize>) -> Observation {
        let view = View::at_origin();
        let beams = usize::from(view.geometry.beams());
        let background_mm = (0..beams).map(|beam| if door.contains(&beam) { 9000 } else { 3000 }).collect();
        Observation {
            view: Arc::new(view),
            start_s: 0.0,
            detections: Vec::new(),
            empty_mm: Vec::new(),
            background_mm,
        }
    }

    #[test]
    fn what_walls_hide_is_out_of_reach() {
        let middle = usize::from(Geometry::new(URG_04LX).unwrap().beams()) / 2;
        let observation = with_a_door(middle - 10..middle + 10);
        let reach = Reach::of(&observation);
        let is_open = |x, y| reach.is_open(Point::new(x, y), 0.8);
        assert!(is_open(2.0, 2.0), "in the room");
        assert!(is_open(2.5, 2.5), "a step behind the wall");
        assert!(!is_open(4.0, 4.0), "in the next room");
        assert!(is_open(8.0, 0.0) && is_open(8.0, 0.9), "behind the door");
        assert!(!is_open(-8.0, 0.0), "where the module does not look");
        assert!(is_open(-1.0, 0.0), "behind the module, and near");
    }
}
