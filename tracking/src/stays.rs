//! Stays: which person is in which zone since when, and how long they stayed once they have left.
//!
//! ```text
//!        zone edge
//!   ─ ─ ─ ─│─ ─ ─ ─      between the two dashed lines a person keeps its side: noise is no coming and going
//!   out  ◀ │ ▶  in       each 0.15 m from the edge
//!   ─ ─ ─ ─│─ ─ ─ ─
//! ```
//!
//! A person is a track that the zone counts ([`Role`]). One that is lost has left every zone when it was there last.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cells::Areas;
use crate::geometry::{Point, distance_to_segment};
use crate::site::{Site, Zone};
use crate::tracker::{TrackId, TrackState};
use crate::zones::verdict::Role;

/// How far into a zone, or out of it, a person must be to have crossed its edge, m: half a body. Noise is less.
const CROSSED_M: f64 = 0.15;

/// Upper bounds of the parts of the distribution of stays, s: a passage, a glance, a talk, a visit, up to a working day.
pub const BOUNDS_S: [f64; 8] = [5.0, 15.0, 60.0, 300.0, 900.0, 3600.0, 14_400.0, 28_800.0];

/// A person has entered a zone, or left it.
#[derive(Clone, PartialEq, Debug)]
pub struct Change {
    /// Name of the zone.
    pub zone: String,
    /// The track of that person.
    pub track: TrackId,
    /// When, s.
    pub at_s: f64,
    /// Since when it was inside, s, if it has left.
    pub since_s: Option<f64>,
}

/// How long people have stayed in a zone, since the start.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct DwellLine {
    /// The zone.
    pub zone: String,
    /// Stays that have ended.
    pub stays: u64,
    /// All of them together, s.
    pub sum_s: f64,
    /// How many were at most as long as each of [`BOUNDS_S`], and longer than the bound before; longer ones are in none.
    pub parts: [u64; BOUNDS_S.len()],
}

#[derive(Debug)]
struct Inside {
    zones: BTreeMap<usize, f64>,
    there_s: f64,
}

/// Who is in which zone.
#[derive(Debug, Default)]
pub struct Stays {
    names: Vec<String>,
    areas: Areas,
    /// Which of them are secure.
    secure: Vec<bool>,
    /// Where a person counts as being in no zone.
    excluded: Areas,
    people: BTreeMap<TrackId, Inside>,
    dwell: BTreeMap<String, DwellLine>,
}

impl Stays {
    /// In the zones of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let mut stays = Self::default();
        stays.change_site(site);
        stays
    }

    /// In other zones: stays go on in those that have kept their name and place; in others all begin anew.
    pub fn change_site(&mut self, site: &Site) {
        let corners: Vec<Vec<Point>> = site.zones.iter().map(Zone::corners).collect();
        let is_same = |(name, before): (&String, usize)| {
            let same = |(zone, now): (&Zone, &Vec<Point>)| {
                zone.name == *name && self.areas.corners(before) == now.as_slice()
            };
            site.zones.iter().zip(&corners).position(same)
        };
        let kept: Vec<Option<usize>> = self.names.iter().zip(0..).map(is_same).collect();
        for person in self.people.values_mut() {
            let zones = std::mem::take(&mut person.zones).into_iter();
            let stays = |(zone, since_s): (usize, f64)| Some((kept.get(zone).copied()??, since_s));
            person.zones = zones.filter_map(stays).collect();
        }
        self.names = site.zones.iter().map(|zone| zone.name.clone()).collect();
        self.secure = site.zones.iter().map(|zone| zone.secure).collect();
        self.areas = Areas::of(corners);
        self.excluded = site.excluded();
        self.dwell.retain(|name, _| self.names.contains(name));
    }

    /// Takes all tracks at `at_s`; returns who has entered and left.
    pub fn observe(&mut self, tracks: &[TrackState], at_s: f64) -> Vec<Change> {
        let mut changes = Vec::new();
        let is_counted =
            |track: &TrackState, secure| Role::of(track.origin, track.state, secure).is_counted();
        for track in tracks.iter().filter(|track| is_counted(track, true)) {
            let new = || Inside { zones: BTreeMap::new(), there_s: at_s };
            let person = self.people.entry(track.id).or_insert_with(new);
            person.there_s = at_s;
            let (areas, excluded, secure, at) = (&self.areas, &self.excluded, &self.secure, track.at);
            let counts = |zone: usize| secure.get(zone).is_some_and(|&secure| is_counted(track, secure));
            let is_excluded = excluded.around(at).any(|area| is_clear(excluded.corners(area), at));
            let mut gone = BTreeMap::new();
            person.zones.retain(|&zone, since_s| {
                let is_out = is_excluded
                    || !counts(zone)
                    || (!areas.is_in(zone, at) && is_clear(areas.corners(zone), at));
                if is_out {
                    gone.insert(zone, *since_s);
                }
                !is_out
            });
            for zone in areas.around(at).filter(|&zone| counts(zone) && !excluded.hold(at)) {
                if let Entry::Vacant(new) = person.zones.entry(zone)
                    && is_clear(areas.corners(zone), at)
                {
                    new.insert(at_s);
                    changes.extend(self.names.get(zone).map(|name| entered(name, track.id, at_s)));
                }
            }
            changes.extend(self.left(track.id, &gone, at_s));
        }
        // Also after the clock was set back.
        let is_gone = |person: &Inside| person.there_s.total_cmp(&at_s).is_ne();
        let gone: Vec<TrackId> =
            self.people.iter().filter(|(_, person)| is_gone(person)).map(|(id, _)| *id).collect();
        for id in gone {
            if let Some(person) = self.people.remove(&id) {
                changes.extend(self.left(id, &person.zones, person.there_s));
            }
        }
        changes
    }

    /// How long people have stayed in each zone that a person has left.
    #[must_use]
    pub fn dwell(&self) -> Vec<DwellLine> {
        self.dwell.values().cloned().collect()
    }

    fn left(&mut self, track: TrackId, zones: &BTreeMap<usize, f64>, at_s: f64) -> Vec<Change> {
        let mut changes = Vec::new();
        for (zone, since_s) in zones {
            let Some(name) = self.names.get(*zone) else { continue };
            let dwell = self
                .dwell
                .entry(name.clone())
                .or_insert_with(|| DwellLine { zone: name.clone(), ..DwellLine::default() });
            let stay_s = (at_s - since_s).max(0.0);
            dwell.stays += 1;
            dwell.sum_s += stay_s;
            let part = BOUNDS_S.iter().zip(&mut dwell.parts).find(|(bound_s, _)| stay_s <= **bound_s);
            if let Some((_, count)) = part {
                *count += 1;
            }
            changes.push(Change { zone: name.clone(), track, at_s, since_s: Some(*since_s) });
        }
        changes
    }
}

/// Whether a place is so far from all sides of a zone that noise does not carry it across.
fn is_clear(corners: &[Point], at: Point) -> bool {
    let mut sides = corners.iter().zip(corners.iter().cycle().skip(1));
    sides.all(|(&from, &to)| distance_to_segment(at, from, to) > CROSSED_M)
}

fn entered(zone: &str, track: TrackId, at_s: f64) -> Change {
    Change { zone: zone.to_owned(), track, at_s, since_s: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::{LifeCycle, Origin};

    fn person(id: TrackId, x: f64) -> TrackState {
        TrackState {
            id,
            at: Point::new(x, 1.0),
            velocity: Point::default(),
            covariance_m2: [0.01, 0.0, 0.01],
            state: LifeCycle::Confirmed,
            existence: 1.0,
            reason: "",
            origin: Origin::Entered,
        }
    }

    fn stays() -> Stays {
        Stays::new(
            &toml::from_str("[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]").unwrap(),
        )
    }

    #[test]
    fn a_stay_is_from_well_inside_to_well_outside() {
        let mut stays = stays();
        let mut at = |x: f64, at_s: f64| {
            let changes = stays.observe(&[person(7, x)], at_s);
            changes.iter().map(|change| (change.at_s, change.since_s)).collect::<Vec<_>>()
        };
        assert_eq!(at(-1.0, 0.0), []);
        assert_eq!(at(0.1, 1.0), [], "noise");
        assert_eq!(at(0.2, 2.0), [(2.0, None)]);
        assert_eq!(at(-0.1, 3.0), [], "noise");
        assert_eq!(at(-0.2, 14.0), [(14.0, Some(2.0))]);
        let [dwell] = &stays.dwell()[..] else { panic!("one zone") };
        assert_eq!((dwell.stays, dwell.sum_s, dwell.parts[..3].to_vec()), (1, 12.0, vec![0, 1, 0]));
    }

    #[test]
    fn a_lost_track_has_left_when_it_was_there_last_and_a_tentative_track_is_no_person() {
        let mut stays = stays();
        let shade = TrackState { state: LifeCycle::Tentative, ..person(8, 2.0) };
        assert_eq!(stays.observe(&[person(7, 2.0), shade], 1.0).len(), 1);
        stays.observe(&[person(7, 2.0)], 2.0);
        let left = Change { zone: "hall".into(), track: 7, at_s: 2.0, since_s: Some(1.0) };
        assert_eq!(stays.observe(&[], 9.0), [left]);
        assert_eq!(stays.observe(&[], 10.0), []);
    }

    #[test]
    fn a_person_who_is_gone_after_the_clock_was_set_back_has_left() {
        let mut stays = stays();
        stays.observe(&[person(7, 2.0), person(8, 2.0)], 1000.0);
        let left = stays.observe(&[person(8, 2.0)], 400.0);
        let left: Vec<_> = left.iter().map(|change| (change.track, change.at_s, change.since_s)).collect();
        assert_eq!(left, [(7, 1000.0, Some(1000.0))]);
        assert_eq!(stays.observe(&[person(8, 2.0)], 400.1), []);
    }

    #[test]
    fn a_track_that_was_never_seen_to_come_in_stays_where_it_is_counted() {
        let zones = "[[zone]]\nname = \"lobby\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]
            [[zone]]\nname = \"lock\"\nsecure = true\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]";
        let mut stays = Stays::new(&toml::from_str(zones).unwrap());
        let mut at = |origin, state, at_s: f64| {
            let changes = stays.observe(&[TrackState { origin, state, ..person(7, 2.0) }], at_s);
            changes.into_iter().map(|change| (change.zone, change.since_s)).collect::<Vec<_>>()
        };
        let (lobby, lock) = ("lobby".to_owned(), "lock".to_owned());
        assert_eq!(at(Origin::Unexplained, LifeCycle::Tentative, 1.0), [(lock.clone(), None)]);
        assert_eq!(at(Origin::Entered, LifeCycle::Confirmed, 2.0), [(lobby.clone(), None)], "it has moved");
        assert_eq!(at(Origin::Unexplained, LifeCycle::Tentative, 3.0), [(lobby, Some(2.0))]);
        assert_eq!(at(Origin::PartOf(1), LifeCycle::Confirmed, 4.0), [(lock, Some(1.0))]);
    }

    #[test]
    fn whoever_steps_into_an_excluded_area_has_left_the_zone() {
        let mut stays = Stays::new(
            &toml::from_str(
                "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]\n[[exclude]]\npolygon = [[2, 0], [4, 0], [4, 4], [2, 4]]",
            )
            .unwrap(),
        );
        let mut at = |x: f64, at_s: f64| stays.observe(&[person(7, x)], at_s).len();
        assert_eq!([at(1.9, 0.0), at(2.1, 1.0), at(2.2, 2.0), at(2.1, 3.0), at(1.9, 4.0)], [1, 0, 1, 0, 1]);
    }

    #[test]
    fn stays_go_on_in_a_zone_that_an_edit_leaves_as_it_was() {
        let zone = |name: &str, from: f64| {
            format!("[[zone]]\nname = \"{name}\"\npolygon = [[{from}, 0], [4, 0], [4, 4], [{from}, 4]]\n")
        };
        let site = |zones: &[String]| toml::from_str::<Site>(&zones.concat()).unwrap();
        let mut stays = Stays::new(&site(&[zone("hall", 0.0), zone("room", 1.0)]));
        assert_eq!(stays.observe(&[person(7, 2.0)], 1.0).len(), 2);
        // The room is drawn anew, and another zone comes before the hall.
        stays.change_site(&site(&[zone("new", 3.0), zone("room", 1.5), zone("hall", 0.0)]));
        let entered = stays.observe(&[person(7, 2.0)], 2.0);
        assert_eq!((entered.len(), entered[0].zone.as_str()), (1, "room"));
        let left: Vec<_> = stays.observe(&[person(7, -1.0)], 5.0);
        let left: Vec<_> = left.iter().map(|change| (change.zone.as_str(), change.since_s)).collect();
        assert_eq!(left, [("room", Some(2.0)), ("hall", Some(1.0))]);
    }

    #[test]
    fn in_another_site_everybody_enters_anew() {
        let mut stays = stays();
        stays.observe(&[person(7, 2.0)], 1.0);
        stays.change_site(
            &toml::from_str("[[zone]]\nname = \"room\"\npolygon = [[0, 0], [4, 0], [4, 4]]").unwrap(),
        );
        let changes = stays.observe(&[person(7, 2.0)], 2.0);
        assert_eq!((changes.len(), changes[0].zone.as_str()), (1, "room"));
    }
}
