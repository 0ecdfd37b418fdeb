//! Persons, whose numbers never change, and the tracks of the areas that are assigned to them.
//!
//! ```text
//!            east's modules see ──────────────┤
//!   east 7   ●──────────────────●┄┄┄┄┄┄○                 leads, is hidden, ends
//!   west 3               ○──────────────────●─────▶      assigned, leads from the border on
//!                         ├────────────── west's modules see
//!   person 12  ──────────────────────────────────▶      one number all the way
//! ```
//!
//! A person has a number and at most one track of each area. One of these tracks leads: the person is where it is. The number belongs
//! to the person. A track that its tracker confuses with another takes no number along.
//!
//! For each picture the leaders are chosen (here), each area's tracks are assigned (`assigned`), unassigned ones may become new
//! persons, and two persons in one place are merged (`births`).

use std::collections::{BTreeMap, BTreeSet};

use super::AreaName;
use super::tracks::{GATE, Heard, Key, Track};
use crate::geometry::Point;
use crate::jsonl::TrackLine;
use crate::tracker::TrackState;

/// A track that has ended is kept for so long, s: a walker at 1.3 m/s passes a gap of two metres between two areas' views.
const LEFT_BEHIND_S: f64 = 2.0;

/// The track of the area on whose ground a person is leads once it was seen for so long, s: by then its velocity is known.
const SETTLED_S: f64 = 0.5;

/// A person.
#[derive(Debug)]
pub(super) struct Person {
    /// The track that says where the person is.
    pub leader: Key,
    /// Where it is at the time of the picture.
    pub at: Point,
    /// Whether its area sees it.
    pub is_seen: bool,
    /// For how long one leader after the other was seen, without a break, s.
    pub seen_s: f64,
    /// All tracks, at most one of each area; the leader among them.
    pub tracks: BTreeMap<AreaName, Key>,
}

/// The persons of all areas.
#[derive(Debug, Default)]
pub struct Persons {
    pub(super) tracks: BTreeMap<Key, Track>,
    pub(super) persons: BTreeMap<u64, Person>,
    /// Two numbers, and for how long both have been in one place, s.
    pub(super) one_place_s: BTreeMap<(u64, u64), f64>,
    pub(super) newest: u64,
}

impl Persons {
    /// Takes the tracks that are heard, `elapsed_s` after those of the last call, and returns a line for each person that is shown:
    /// the leader's, with the person's number.
    pub fn follow(&mut self, heard: Vec<Heard>, elapsed_s: f64) -> Vec<TrackLine> {
        self.note(heard, elapsed_s);
        self.lead(0.0);
        let areas: BTreeSet<AreaName> = self.tracks.keys().map(|key| key.area.clone()).collect();
        for area in areas {
            self.assign(&area);
            self.begin(&area, elapsed_s);
        }
        self.lead(elapsed_s);
        self.merge(elapsed_s);
        self.shown()
    }

    /// The number of the person to whom a track is assigned.
    pub fn of(&self, key: &Key) -> Option<u64> {
        self.tracks.get(key)?.person
    }

    /// All persons, also those who are not shown at the moment.
    pub fn all(&self) -> Vec<TrackState> {
        let state = |(number, person): (&u64, &Person)| {
            let leader = self.tracks.get(&person.leader)?;
            Some(TrackState { id: *number, at: person.at, ..(&leader.last.line).into() })
        };
        self.persons.iter().filter_map(state).collect()
    }

    fn note(&mut self, heard: Vec<Heard>, elapsed_s: f64) {
        self.tracks.values_mut().for_each(|track| track.wait(elapsed_s));
        for heard in heard {
            match self.tracks.get_mut(&heard.key) {
                Some(track) => track.hear(heard, elapsed_s),
                None => _ = self.tracks.insert(heard.key.clone(), Track::new(heard)),
            }
        }
        self.tracks.retain(|_, track| track.gone_s <= LEFT_BEHIND_S);
        let Self { tracks, persons, .. } = self;
        persons.values_mut().for_each(|person| person.tracks.retain(|_, key| tracks.contains_key(key)));
    }

    /// Chooses each person's leader. The leader stays while it is seen, unless the area on whose ground the person is sees them,
    /// too. A person without any track left is removed.
    fn lead(&mut self, elapsed_s: f64) {
        let Self { tracks, persons, .. } = self;
        persons.retain(|_, person| {
            let before = tracks.get(&person.leader);
            let all = || person.tracks.values().filter_map(|key| tracks.get(key));
            let by = |track: &&Track| (track.last.is_abroad, (track.spread_m2() * 1e6) as u64);
            let next = if before.is_some_and(Track::is_seen) {
                let is_abroad = before.is_some_and(|before| before.last.is_abroad);
                let is_at_home =
                    |track: &&Track| track.is_seen() && !track.last.is_abroad && track.seen_s >= SETTLED_S;
                all().filter(|_| is_abroad).filter(is_at_home).min_by_key(by)
            } else {
                let seen = all().filter(|track| track.is_seen()).min_by_key(by);
                // A hidden track at the place where the leader ended.
                let is_near =
                    |track: &&Track| before.and_then(|before| before.apart(track)).is_some_and(|d| d <= GATE);
                let is_over = before.is_none_or(|before| !before.is_there());
                let supposed =
                    || all().filter(|track| is_over && track.is_there()).filter(is_near).min_by_key(by);
                seen.or_else(supposed)
            };
            if let Some(next) = next {
                person.leader = next.last.key.clone();
            }
            let Some(leader) = tracks.get(&person.leader) else { return false };
            (person.at, person.is_seen) = (leader.at(), leader.is_seen());
            person.seen_s = if person.is_seen { person.seen_s + elapsed_s } else { 0.0 };
            true
        });
        for track in tracks.values_mut() {
            track.person = track.person.filter(|person| persons.contains_key(person));
        }
    }

    /// Assigns a track to a person, in place of the one of the same area that was before.
    pub(super) fn join(&mut self, key: Key, number: u64) {
        let Some(person) = self.persons.get_mut(&number) else { return };
        if let Some(before) = person.tracks.insert(key.area.clone(), key.clone())
            && before != key
            && let Some(before) = self.tracks.get_mut(&before)
        {
            before.person = None;
        }
        if let Some(track) = self.tracks.get_mut(&key) {
            (track.person, track.was_assigned, track.unassigned_s) = (Some(number), true, 0.0);
        }
    }

    fn shown(&self) -> Vec<TrackLine> {
        let line = |(number, person): (&u64, &Person)| {
            let leader = self.tracks.get(&person.leader)?;
            // Whether a person is hidden there is for the area to say whose ground it is.
            let is_supposed = leader.last.is_abroad && !leader.is_seen();
            let at = leader.shown_at();
            let line = || TrackLine { id: *number, x: at.x, y: at.y, ..leader.last.line.clone() };
            (leader.is_there() && !is_supposed).then(line)
        };
        self.persons.iter().filter_map(line).collect()
    }
}
