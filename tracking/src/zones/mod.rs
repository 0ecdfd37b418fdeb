//! How many people are in each zone, how sure that is, and how much of the zone was seen.
//!
//! ```text
//!   tracks ─▶ existence, share inside ─▶ P(0), P(1), …    count: confirmed and occluded tracks whose mean is inside
//!   observations ─▶ cells of 0.2 m, seen when last ─▶ share    known · partly · unknown
//! ```
//!
//! An unexplained track, which was never seen to enter and has not moved, is in the distribution and not in the
//! count; in a zone that is `secure` it is in both. A tentative track is in the distribution only. A part of another
//! track is in neither, anywhere.
//!
//! Which beam of a module points at a cell does not change, so that is worked out once a module; what lies behind its
//! walls is left out, once a background. So a scan costs as many cells as that module can see, however large the zones
//! are and however many others there are.
//!
//! *Unknown* is never *empty*: with no module looking, nothing is known, whatever the tracks say.

pub mod facts;
mod panels;
mod presence;
mod reach;
mod strip;
pub mod verdict;
mod zone;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub use zone::SEEN_S;

use crate::cells::Areas;
use crate::floor::Reading;
use crate::geometry::Point;
use crate::observation::{Observation, View};
use crate::occupancy::{ZoneKnown, ZoneLine};
use crate::site::Site;
use crate::site::change::SiteChange;
use crate::tracker::TrackState;
use facts::ZoneFacts;
use panels::Panels;
use presence::Presence;
use reach::{InView, Reach};
use zone::Zone;
use zone::edit::Before;

/// In the zone of a door and on a counting line, cells so near to the middle of a candidate are seen, m: a body hides what is under it, and
/// that it is there is what is to be seen.
const BODY_M: f64 = 0.3;

/// A candidate wider than this is a body, m: half a narrow one.
const WIDE_M: f64 = 0.15;

/// The zones of a site.
#[derive(Debug)]
pub struct Zones {
    /// Those of the site, then its counting lines.
    zones: Vec<Zone>,
    /// The polygons of the site's zones, in the same order.
    areas: Areas,
    /// Where no person is counted, and nothing has to be seen.
    excluded: Areas,
    /// Those before a door, which unlocks only if they are known, and counting lines.
    guarded: Vec<usize>,
    /// What each module can see of them, by its number in the site.
    reaches: BTreeMap<usize, Reach>,
    /// Those on each floor, by its number in the site.
    floors: BTreeMap<usize, Panels>,
}

impl Zones {
    /// Of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let guarded = |zone: &crate::site::Zone| site.doors.iter().any(|door| door.zone == zone.name);
        let guarded = (0..).zip(&site.zones).filter(|(_, zone)| guarded(zone)).map(|(number, _)| number);
        let lines = (0..site.lines.len()).map(|line| site.zones.len() + line);
        let excluded = site.excluded();
        let zone = |zone: &crate::site::Zone| {
            let mut zone = Zone::new(zone);
            zone.cells.retain(|cell| !excluded.hold(cell.middle));
            zone
        };
        Self {
            guarded: guarded.chain(lines).collect(),
            areas: Areas::of(site.zones.iter().map(crate::site::Zone::corners).collect()),
            zones: site.zones.iter().map(zone).chain(site.lines.iter().map(strip::of)).collect(),
            excluded,
            reaches: BTreeMap::new(),
            floors: BTreeMap::new(),
        }
    }

    /// Goes on in a site that was edited. What was seen stays seen; zones within reach of a module that was moved, where it
    /// stood or where it stands, are unknown until `known_s`.
    pub fn change_site(&mut self, change: &SiteChange<'_>, known_s: f64) {
        let mut new = Self::new(change.now);
        let latest =
            |time_s: fn(&Zone) -> f64| self.zones.iter().map(time_s).fold(f64::NEG_INFINITY, f64::max);
        let (unknown_until_s, found_s) = (latest(|zone| zone.known_s), latest(|zone| zone.found_s));
        new.zones.iter_mut().for_each(|zone| (zone.known_s, zone.found_s) = (unknown_until_s, found_s));
        let is_excluded_alike = change.before.excludes == change.now.excludes;
        let before = Before::of(&self.zones);
        for (zone, now) in new.zones.iter_mut().zip(&change.now.zones) {
            let same = |was: &crate::site::Zone| {
                is_excluded_alike && was.name == now.name && was.polygon == now.polygon
            };
            let number = change.before.zones.iter().position(same);
            if let Some(was) = number.and_then(|number| self.zones.get_mut(number)) {
                zone.go_on(was);
                continue;
            }
            zone.inherit(&before);
        }
        new.zones.iter_mut().skip(change.now.zones.len()).for_each(|line| line.inherit(&before));
        for (number, was, is) in change.moved() {
            // A module that was not heard yet has not seen anything.
            let Some(reach) = self.reaches.get(&number) else { continue };
            let range_m = f64::from(reach.view.geometry.parts().range_max_mm) * 0.001;
            let is_within =
                |zone: &&mut Zone| [was, is].iter().any(|module| zone.distance_m(module.pose().at) < range_m);
            new.zones.iter_mut().filter(is_within).for_each(|zone| zone.known_s = zone.known_s.max(known_s));
        }
        *self = new;
    }

    /// A module looks again after a gap: until `found_s`, in s, people in its view may not have been found again.
    pub fn look_again(&mut self, view: &Arc<View>, found_s: f64) {
        let cells = &reach(&mut self.reaches, &self.zones, view).cells;
        let in_view: BTreeSet<u32> = cells.iter().map(|in_view| in_view.zone).collect();
        for (_, zone) in (0..).zip(&mut self.zones).filter(|(number, _)| in_view.contains(number)) {
            zone.look_again(found_s);
        }
    }

    /// Notes what a module saw.
    pub fn observe(&mut self, observation: &Observation) {
        let Self { zones, reaches, guarded, .. } = self;
        let reach = reach(reaches, zones, &observation.view);
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
                strip::note_body(&mut zone.cells, middle, BODY_M, observation.start_s);
            }
        }
    }

    /// Notes that a floor was read: people on it press panels, and so all of it is seen but for panels that do not work,
    /// once all who are on it have been found (`has_found`).
    pub fn read(&mut self, reading: &Reading, has_found: bool) {
        let Self { zones, floors, .. } = self;
        if !floors.get(&reading.floor).is_some_and(|panels| panels.is_of(&reading.plan)) {
            floors.insert(reading.floor, Panels::of(&reading.plan, zones));
        }
        if let Some(panels) = floors.get_mut(&reading.floor) {
            panels.read(zones, reading, has_found);
        }
    }

    /// A floor has fallen silent: nothing is known of what it showed.
    pub fn forget(&mut self, floor: usize) {
        if let Some(panels) = self.floors.get(&floor) {
            panels.forget(&mut self.zones);
        }
    }

    /// What is known of each zone at `at_s`, by its name.
    #[must_use]
    pub fn lines(&mut self, tracks: &[TrackState], at_s: f64) -> BTreeMap<String, ZoneLine> {
        let inside = self.inside(tracks);
        let lines = self.zones.iter_mut().zip(inside);
        lines.map(|(zone, inside)| (zone.name.clone(), zone.line(&inside, at_s))).collect()
    }

    /// The tracks that may be in each zone, in the order of the zones; none in an excluded area.
    fn inside<'a>(&self, tracks: &'a [TrackState]) -> Vec<Vec<Presence<'a>>> {
        let mut inside = vec![Vec::new(); self.areas.len()];
        for track in tracks.iter().filter(|track| !self.excluded.hold(track.at)) {
            presence::place(track, &self.areas, &mut inside);
        }
        inside
    }

    /// Of a zone, to be explained; none if there is none of this name.
    #[must_use]
    pub fn zone_facts(&self, name: &str, tracks: &[TrackState], at_s: f64) -> Option<ZoneFacts> {
        let inside = self.inside(tracks);
        let mut all = self.zones.iter().zip(&inside);
        all.find(|(zone, _)| zone.name == name).map(|(zone, inside)| facts::of_zone(zone, inside, at_s))
    }

    /// Of the counting line of this number, to be explained.
    #[must_use]
    pub fn line_facts(&self, number: usize, at_s: f64) -> Option<ZoneFacts> {
        self.zones.get(self.areas.len() + number).map(|line| facts::of_line(line, at_s))
    }

    /// How much of each counting line is known at `at_s`, in the order of the site.
    pub fn counting_lines(&self, at_s: f64) -> impl Iterator<Item = ZoneKnown> {
        self.zones.iter().skip(self.areas.len()).map(move |line| strip::known(line, at_s))
    }
}

/// What a module sees of the zones, worked out anew when its view has changed.
fn reach<'a>(reaches: &'a mut BTreeMap<usize, Reach>, zones: &[Zone], view: &Arc<View>) -> &'a mut Reach {
    let reach = reaches.entry(view.module).or_insert_with(|| Reach::of(view, zones));
    if !Arc::ptr_eq(&reach.view, view) {
        *reach = Reach::of(view, zones);
    }
    reach
}
