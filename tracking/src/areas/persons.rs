//! Who is who: persons with numbers that are given once, and the tracks of the areas that follow them.
//!
//! ```text
//!            east's modules see ──────────────┤
//!   east 7   ●──────────────────●┄┄┄┄┄┄○                 leads at home, then hidden, then over
//!   west 3               ○──────────────────●─────▶      follows; leads from the border on
//!                         ├────────────── west's modules see
//!   person 12  ──────────────────────────────────▶      one number all the way
//! ```
//!
//! A person has a number, at most one track of each area, and one of them leads: the person is where that one is. The tracks of an
//! area are assigned to persons all at once, so that all distances from the leaders together are least, and a track of before stays
//! unless another is much nearer. The number is the person's: a track brings none along, whomever its tracker took it for before.

use std::collections::{BTreeMap, BTreeSet};

use super::AreaName;
use super::tracks::{GATE, GATE_M, Heard, Key, Track};
use crate::assignment::{Alone, assign};
use crate::geometry::{Point, bounds};
use crate::jsonl::TrackLine;
use crate::tracker::LifeCycle;

/// A track is left behind for so long after it is over, s: a walker at 1.3 m/s passes a gap of two metres.
const LEFT_BEHIND_S: f64 = 2.0;

/// So much nearer must another track be than the one of before.
const KEPT: f64 = 9.0;

/// A person whom nobody sees is so much farther than one who is seen.
const UNSEEN: f64 = 6.0;

/// What a hidden track of a person costs: dearer than any that is seen.
const HIDDEN: f64 = GATE + KEPT + UNSEEN;

/// What a track costs that stays alone: a hundredth above the dearest.
const ALONE: f64 = HIDDEN + 0.01;

/// The area at home leads once it has seen the person for so long, s.
const SETTLED_S: f64 = 0.5;

/// Who is seen by one area on the ground of another is nobody new for so long, s.
const ANSWERED_S: f64 = 1.0;

/// Two bodies cannot be so near, m.
const ONE_BODY_M: f64 = 0.33;

/// Two who are as near as that for so long are one, s.
const ONE_BODY_S: f64 = 0.5;

/// Who was just hidden behind the border is shown for so long, s.
const HANDED_S: f64 = 0.5;

/// A person.
#[derive(Debug)]
struct Person {
    /// By this track the person is shown.
    leader: Key,
    /// All tracks, at most one of each area; the leader among them.
    tracks: BTreeMap<AreaName, Key>,
    /// For how long somebody has seen them without a break, s.
    seen_s: f64,
}

/// The persons of all areas.
#[derive(Debug, Default)]
pub struct Persons {
    tracks: BTreeMap<Key, Track>,
    persons: BTreeMap<u64, Person>,
    /// Two numbers, and for how long both were at one place, s.
    one_body_s: BTreeMap<(u64, u64), f64>,
    newest: u64,
    last_us: u64,
}

impl Persons {
    /// The persons of the tracks that are heard at `now_us`, each by the track that leads, under the person's number. Tentative
    /// tracks are none yet.
    pub fn follow(&mut self, heard: Vec<Heard>, now_us: u64) -> Vec<TrackLine> {
        let elapsed_s = now_us.saturating_sub(self.last_us) as f64 * 1e-6;
        self.last_us = now_us;
        self.note(heard, elapsed_s);
        self.lead(0.0);
        let areas: BTreeSet<AreaName> = self.tracks.keys().map(|key| key.area.clone()).collect();
        for area in areas {
            self.assign(&area);
            self.bear(&area, elapsed_s);
        }
        self.lead(elapsed_s);
        self.unite(elapsed_s);
        self.shown()
    }

    /// The person that a track of an area is, if it is one.
    pub fn of(&self, key: &Key) -> Option<u64> {
        self.tracks.get(key)?.person
    }

    /// Whether a person is seen, but not by this area.
    pub fn is_seen_by_others(&self, person: u64, area: &AreaName) -> bool {
        let Some(person) = self.persons.get(&person) else { return false };
        let sees = |key: &&Key| self.tracks.get(*key).is_some_and(Track::is_seen);
        let mut seeing = person.tracks.values().filter(sees).peekable();
        seeing.peek().is_some() && seeing.all(|key| key.area != *area)
    }

    fn note(&mut self, heard: Vec<Heard>, elapsed_s: f64) {
        self.tracks.values_mut().for_each(|track| track.wait(elapsed_s));
        for heard in heard.into_iter().filter(|heard| heard.line.state != LifeCycle::Tentative) {
            match self.tracks.get_mut(&heard.key) {
                Some(track) => track.hear(heard, elapsed_s),
                None => _ = self.tracks.insert(heard.key.clone(), Track::new(heard)),
            }
        }
        self.tracks.retain(|_, track| track.gone_s <= LEFT_BEHIND_S);
        let Self { tracks, persons, .. } = self;
        persons.values_mut().for_each(|person| person.tracks.retain(|_, key| tracks.contains_key(key)));
    }

    /// Who leads each person: who did, unless they see the person no more, or the area sees them on whose ground they are.
    fn lead(&mut self, elapsed_s: f64) {
        let Self { tracks, persons, .. } = self;
        persons.retain(|_, person| {
            let before = tracks.get(&person.leader);
            let all = || person.tracks.values().filter_map(|key| tracks.get(key));
            let is_seen = before.is_some_and(Track::is_seen);
            let by = |track: &&Track| (track.last.is_abroad, (track.spread_m2() * 1e6) as u64);
            let next = if is_seen {
                let is_abroad = before.is_some_and(|before| before.last.is_abroad);
                let is_at_home =
                    |track: &&Track| track.is_seen() && !track.last.is_abroad && track.seen_s >= SETTLED_S;
                all().filter(|_| is_abroad).filter(is_at_home).min_by_key(by)
            } else {
                let seen = all().filter(|track| track.is_seen()).min_by_key(by);
                // Who supposes them where they were seen last.
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
            let leader = tracks.get(&person.leader);
            let is_seen = leader.is_some_and(Track::is_seen);
            person.seen_s = if is_seen { person.seen_s + elapsed_s } else { 0.0 };
            leader.is_some()
        });
        for track in tracks.values_mut() {
            track.person = track.person.filter(|person| persons.contains_key(person));
        }
    }

    /// Assigns the tracks of an area to persons.
    fn assign(&mut self, area: &AreaName) {
        let own: Vec<&Track> =
            self.tracks.values().filter(|track| track.last.key.area == *area && track.is_there()).collect();
        let (low, high) = bounds(own.iter().map(|track| track.at())).unwrap_or_default();
        let beyond = Point::new(GATE_M, GATE_M);
        let (low, high) = (low - beyond, high + beyond);
        let is_near = |(_, person): &(&u64, &Person)| {
            let at = self.tracks.get(&person.leader).map(Track::at);
            let is_near = |at: Point| low.x <= at.x && at.x <= high.x && low.y <= at.y && at.y <= high.y;
            person.tracks.contains_key(area) || at.is_some_and(is_near)
        };
        let persons: Vec<(u64, &Person)> =
            self.persons.iter().filter(is_near).map(|(number, person)| (*number, person)).collect();
        let cost = |row: usize, column: usize| {
            let (track, (number, person)) = (own.get(row)?, persons.get(column)?);
            self.cost(track, *number, person)
        };
        let assigned = assign(own.len(), persons.len(), &Alone::all(ALONE), cost);
        let numbers: Vec<(Key, Option<u64>)> = own
            .iter()
            .zip(assigned)
            .map(|(track, column)| {
                (track.last.key.clone(), column.and_then(|column| persons.get(column)).map(|person| person.0))
            })
            .collect();
        for (key, _) in &numbers {
            self.leave(key);
        }
        for (key, number) in numbers {
            if let Some(number) = number {
                self.join(key, number);
            }
        }
    }

    /// What it costs that a track is that person.
    fn cost(&self, track: &Track, number: u64, person: &Person) -> Option<f64> {
        let leader = self.tracks.get(&person.leader)?;
        let key = &track.last.key;
        if person.leader == *key {
            return Some(0.0);
        }
        // Its own area says that they are two.
        if leader.last.key.area == key.area && leader.is_there() {
            return None;
        }
        let was = track.person == Some(number);
        if !track.is_seen() {
            // Who is hidden from one area is where another sees them.
            return was.then_some(HIDDEN);
        }
        let apart = track.apart(leader)?;
        let apart = apart + if leader.is_seen() { 0.0 } else { UNSEEN };
        let gate = GATE + if was { KEPT } else { 0.0 };
        (apart <= gate).then_some(if was { apart } else { apart + KEPT })
    }

    /// A track is nobody's.
    fn leave(&mut self, key: &Key) {
        let Some(track) = self.tracks.get_mut(key) else { return };
        if let Some(person) = track.person.take().and_then(|number| self.persons.get_mut(&number)) {
            person.tracks.retain(|_, other| other != key);
        }
    }

    /// A track is that person's; one of its area that is over was the same.
    fn join(&mut self, key: Key, number: u64) {
        let Some(person) = self.persons.get_mut(&number) else { return };
        if let Some(before) = person.tracks.insert(key.area.clone(), key.clone())
            && before != key
            && let Some(before) = self.tracks.get_mut(&before)
        {
            before.person = None;
        }
        if let Some(track) = self.tracks.get_mut(&key) {
            (track.person, track.was_person, track.nobody_s) = (Some(number), true, 0.0);
        }
    }

    /// Those of an area who are nobody yet are somebody new: at once at home, and on the ground of another once that one should have
    /// answered.
    fn bear(&mut self, area: &AreaName, elapsed_s: f64) {
        let Self { tracks, persons, .. } = self;
        let sees = |key: &Key| tracks.get(key).is_some_and(Track::is_seen);
        let missed = persons.values().filter(|person| sees(&person.leader));
        let missed = missed.filter(|person| !person.tracks.get(area).is_some_and(sees));
        let missed: Vec<Point> =
            missed.filter_map(|person| tracks.get(&person.leader)).map(Track::at).collect();
        let mut new = Vec::new();
        for track in tracks.values_mut().filter(|track| track.last.key.area == *area) {
            if track.person.is_some() || !track.is_there() || (!track.is_seen() && track.was_person) {
                continue;
            }
            track.nobody_s += elapsed_s;
            let at = track.at();
            let may_be_another =
                track.last.is_abroad || missed.iter().any(|there| (*there - at).length() <= GATE_M);
            if !may_be_another || (track.is_seen() && track.nobody_s >= ANSWERED_S) {
                new.push(track.last.key.clone());
            }
        }
        for key in new {
            self.newest += 1;
            let person = Person { leader: key.clone(), tracks: BTreeMap::new(), seen_s: 0.0 };
            self.persons.insert(self.newest, person);
            self.join(key, self.newest);
        }
    }

    /// Two persons whom different areas see at one place are one, with the number of who was seen the longest without a break.
    fn unite(&mut self, elapsed_s: f64) {
        let seen: Vec<(u64, &Person, Point)> = self
            .persons
            .iter()
            .filter_map(|(number, person)| {
                let leader = self.tracks.get(&person.leader).filter(|leader| leader.is_seen())?;
                Some((*number, person, leader.at()))
            })
            .collect();
        let mut one_body_s = BTreeMap::new();
        let is_seen = |key: &Key| self.tracks.get(key).is_some_and(Track::is_seen);
        for (index, (number, one, here)) in seen.iter().enumerate() {
            for (other_number, other, there) in seen.iter().skip(index + 1) {
                if (*here - *there).length() > ONE_BODY_M {
                    continue;
                }
                let mut common =
                    one.tracks.iter().filter_map(|(area, key)| Some([key, other.tracks.get(area)?]));
                if common.any(|keys| keys.iter().all(|key| is_seen(key))) {
                    continue;
                }
                let pair = (*number, *other_number);
                let before = self.one_body_s.get(&pair).copied().unwrap_or(0.0);
                one_body_s.insert(pair, before + elapsed_s);
            }
        }
        self.one_body_s = one_body_s;
        let due: Vec<(u64, u64)> = self
            .one_body_s
            .iter()
            .filter(|(_, for_s)| **for_s >= ONE_BODY_S)
            .map(|(pair, _)| *pair)
            .collect();
        for (one, other) in due {
            let [Some(first), Some(second)] = [one, other].map(|number| self.persons.get(&number)) else {
                continue;
            };
            let (kept, given) = if second.seen_s > first.seen_s { (other, one) } else { (one, other) };
            let Some(given) = self.persons.remove(&given) else { continue };
            for (area, key) in given.tracks {
                let has = self.persons.get(&kept).and_then(|person| person.tracks.get(&area));
                if has.is_some_and(is_there_seen(&self.tracks)) {
                    if let Some(track) = self.tracks.get_mut(&key) {
                        track.person = None;
                    }
                } else {
                    self.join(key, kept);
                }
            }
        }
    }

    fn shown(&self) -> Vec<TrackLine> {
        let line = |(number, person): (&u64, &Person)| {
            let leader = self.tracks.get(&person.leader)?;
            let is_handed = leader.last.is_abroad && !leader.is_seen() && leader.hidden_s > HANDED_S;
            let at = leader.shown_at();
            let line = || TrackLine { id: *number, x: at.x, y: at.y, ..leader.last.line.clone() };
            (leader.is_there() && !is_handed).then(line)
        };
        self.persons.iter().filter_map(line).collect()
    }
}

fn is_there_seen(tracks: &BTreeMap<Key, Track>) -> impl Fn(&Key) -> bool {
    |key| tracks.get(key).is_some_and(Track::is_seen)
}
