//! Which tracks of different areas are one person: numbers that are given once and kept across borders.
//!
//! ```text
//!            east's modules see ──────────────┤
//!   track 7  ●──────────────────●┄┄┄┄┄┄○       ○ left behind for two seconds: where it would be by now
//!   track 3               ○──────────────────●─────▶
//!                         ├────────────── west's modules see
//!            person 12 ───┼─────┼─────────────────▶   both are one person while both are there, and after it
//! ```
//!
//! Tracks of two areas that are at one place are paired, each with one at most, so that all distances together are least: a distance is
//! that of places by both covariances, and that of velocities. A pair of before is preferred. Nothing is compared by the clocks of the
//! areas: a track is predicted from when its frame was heard.
//!
//! ```text
//!   east 7 ── west 3 ── south 5      where several areas meet: all that hang together are one person, never two tracks of one area
//!     12        15        18         the person has the oldest number of those that are seen: 12
//!   east 7    west 3 ── south 5      parted: who had the number from the start keeps it, 12; the others have their own again, 15
//! ```

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::AreaName;
use crate::assignment::{Alone, assign};
use crate::geometry::{Point, bounds};
use crate::jsonl::TrackLine;
use crate::tracker::LifeCycle;

/// A track is left behind for so long after it is over, s: a walker at 1.3 m/s passes a gap of two metres.
const LEFT_BEHIND_S: f64 = 2.0;

/// What two trackers differ by beyond their covariances, m²: frames are a tenth of a second apart, and a pose is calibrated to some
/// centimetres; together 0.15 m in each direction.
const APART_M2: f64 = 0.15 * 0.15;

/// What the velocities of two tracks of a person differ by, m/s: a track that was just begun stands still, and a walker at 1.4 m/s is
/// within two of this.
const VELOCITY_APART_MPS: f64 = 0.7;

/// Two tracks farther apart than this are two persons: 99.9 % of a normal distribution in four dimensions, place and velocity.
const GATE: f64 = 18.5;

/// However little is known of them, m: an arm's length beyond both bodies.
const GATE_M: f64 = 1.2;

/// So much nearer, in the same measure, must another pair be than one of before: as improbable as two persons at one place.
const KEPT: f64 = GATE;

/// What a track costs that stays alone: a hundredth above the dearest pair.
const ALONE: f64 = GATE + KEPT + 0.01;

/// The velocity of a track left behind may change so much each second, m/s: the variance of its place grows by it.
const TURNS_MPS2: f64 = 0.5;

/// A track as its area has it.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Key {
    pub area: AreaName,
    pub epoch: u64,
    pub track: u64,
}

/// A track of an area at the time of the picture.
#[derive(Clone, Debug)]
pub struct Heard {
    pub key: Key,
    /// As its area says it.
    pub line: TrackLine,
    /// Since then, s.
    pub age_s: f64,
    /// Its area does not see it, and its place is not the area's but another one's, who sees that place.
    pub is_elsewhere: bool,
}

/// A track that was heard, and the number of its person.
#[derive(Clone, Debug)]
struct Known {
    /// The person it is.
    person: u64,
    /// The number that it was given when it was new, and has again when it is nobody else.
    own: u64,
    last: Heard,
    /// Since it was heard first, s.
    known_s: f64,
    /// For how long its area has seen it without a break, s; 0 while it is hidden.
    seen_s: f64,
    /// Since it was in a frame of its area last, s; 0 while it is.
    gone_s: f64,
    /// The tracks of other areas that are the same person.
    with: Vec<Key>,
}

/// The persons of all areas.
#[derive(Debug, Default)]
pub struct Persons {
    known: BTreeMap<Key, Known>,
    newest: u64,
    last_us: u64,
}

/// Where a track is at the time of the picture.
struct Place<'a> {
    key: &'a Key,
    at: Point,
    with: &'a [Key],
}

/// The rectangle around the tracks of an area, and as far beyond as any is paired: most areas are nowhere near each other.
struct Bounds<'a> {
    area: &'a AreaName,
    low: Point,
    high: Point,
}

impl<'a> Bounds<'a> {
    fn around(area: &'a AreaName, tracks: &[Place<'_>]) -> Self {
        let (low, high) = bounds(tracks.iter().map(|track| track.at)).unwrap_or_default();
        let beyond = Point::new(GATE_M, GATE_M);
        Self { area, low: low - beyond, high: high + beyond }
    }

    /// The tracks of another area that may be one of these, or are one of these by now.
    fn near(&self, tracks: &[Place<'_>]) -> Vec<Key> {
        let is_near = |track: &&Place<'_>| {
            let Point { x, y } = track.at;
            (self.low.x <= x && x <= self.high.x && self.low.y <= y && y <= self.high.y)
                || track.with.iter().any(|key| key.area == *self.area)
        };
        tracks.iter().filter(is_near).map(|track| track.key.clone()).collect()
    }
}

impl Heard {
    /// Where it is by now, if it walks on.
    fn at(&self, more_s: f64) -> Point {
        let TrackLine { x, y, vx, vy, .. } = self.line;
        let walked_s = self.age_s + more_s;
        Point::new(x + vx * walked_s, y + vy * walked_s)
    }

    /// The covariance of that: xx, xy, yy in m².
    fn covariance_m2(&self, more_s: f64) -> [f64; 3] {
        let [xx, xy, yy] = self.line.cov.unwrap_or([APART_M2, 0.0, APART_M2]);
        let turned_m = 0.5 * TURNS_MPS2 * more_s * more_s;
        [xx + turned_m * turned_m, xy, yy + turned_m * turned_m]
    }

    /// Of two tracks of a person, the one by which the person is shown: seen before hidden, then the better known.
    fn rank(&self) -> (bool, f64) {
        let [xx, _, yy] = self.covariance_m2(0.0);
        (self.line.state == LifeCycle::Occluded, xx + yy)
    }
}

impl Known {
    /// Whether it is seen and was known before: nothing that is hidden tells who it is.
    fn is_sure(&self) -> bool {
        !self.is_hidden() && self.known_s > LEFT_BEHIND_S
    }

    /// Whether its area does not see it.
    fn is_hidden(&self) -> bool {
        self.gone_s > 0.0 || self.last.line.state == LifeCycle::Occluded
    }
}

impl Persons {
    /// The persons of the tracks that are heard at `now_us`, each by the track that knows it best, under the person's number. Tentative
    /// tracks are none yet.
    pub fn follow(&mut self, heard: Vec<Heard>, now_us: u64) -> Vec<TrackLine> {
        let elapsed_s = now_us.saturating_sub(self.last_us) as f64 * 1e-6;
        self.last_us = now_us;
        self.note(heard, elapsed_s);
        let mut places: BTreeMap<&AreaName, Vec<Place<'_>>> = BTreeMap::new();
        for (key, known) in &self.known {
            let at = known.last.at(known.gone_s);
            places.entry(&key.area).or_default().push(Place { key, at, with: &known.with });
        }
        let mut near: Vec<[Vec<Key>; 2]> = Vec::new();
        let areas: Vec<(&Vec<Place<'_>>, Bounds<'_>)> =
            places.iter().map(|(area, tracks)| (tracks, Bounds::around(area, tracks))).collect();
        for (index, (one, bounds)) in areas.iter().enumerate() {
            for (other, others) in areas.iter().skip(index + 1) {
                let pair = [others.near(one), bounds.near(other)];
                if pair.iter().all(|keys| !keys.is_empty()) {
                    near.push(pair);
                }
            }
        }
        for [rows, columns] in near {
            self.pair(&rows, &columns);
        }
        self.number();
        self.shown()
    }

    /// The person that a track of an area is, if it is one.
    pub fn of(&self, key: &Key) -> Option<u64> {
        self.known.get(key).map(|known| known.person)
    }

    /// Whether a person is seen, but not by this area.
    pub fn is_seen_by_others(&self, person: u64, area: &AreaName) -> bool {
        let sees = |known: &&Known| known.person == person && !known.is_hidden();
        let mut seeing = self.known.values().filter(sees).map(|known| &known.last.key.area).peekable();
        seeing.peek().is_some() && seeing.all(|seeing| seeing != area)
    }

    fn note(&mut self, heard: Vec<Heard>, elapsed_s: f64) {
        for known in self.known.values_mut() {
            known.known_s += elapsed_s;
            known.gone_s += elapsed_s;
        }
        for heard in heard.into_iter().filter(|heard| heard.line.state != LifeCycle::Tentative) {
            if let Some(known) = self.known.get_mut(&heard.key) {
                let is_seen = heard.line.state != LifeCycle::Occluded;
                known.seen_s = if is_seen { known.seen_s + elapsed_s } else { 0.0 };
                known.last = heard;
                known.gone_s = 0.0;
            } else {
                self.newest += 1;
                let (person, own) = (self.newest, self.newest);
                let known = Known {
                    person,
                    own,
                    last: heard,
                    known_s: 0.0,
                    seen_s: 0.0,
                    gone_s: 0.0,
                    with: Vec::new(),
                };
                self.known.insert(known.last.key.clone(), known);
            }
        }
        self.known.retain(|_, known| known.gone_s <= LEFT_BEHIND_S);
        let keys: Vec<Key> = self.known.keys().cloned().collect();
        self.known.values_mut().for_each(|known| known.with.retain(|key| keys.binary_search(key).is_ok()));
    }

    /// Pairs the tracks of one area with those of another.
    fn pair(&mut self, rows: &[Key], columns: &[Key]) {
        let cost = |row: usize, column: usize| {
            let (one, other) = (rows.get(row)?, columns.get(column)?);
            self.apart(self.known.get(one)?, self.known.get(other)?)
        };
        let paired = assign(rows.len(), columns.len(), &Alone::all(ALONE), cost);
        let Some(there) = columns.first().map(|key| key.area.clone()) else { return };
        let now: Vec<Option<&Key>> =
            paired.into_iter().map(|column| column.and_then(|column| columns.get(column))).collect();
        // All that are no longer one are parted before any are joined.
        for (row, now) in rows.iter().zip(&now) {
            if let Some(before) = self.partner(row, &there).filter(|before| Some(before) != *now) {
                self.part(row, &before);
            }
        }
        for (row, now) in rows.iter().zip(now) {
            let Some(now) = now.filter(|now| self.partner(row, &there).as_ref() != Some(*now)) else {
                continue;
            };
            self.join(row, now);
        }
    }

    /// The track of another area that is the same person.
    fn partner(&self, key: &Key, area: &AreaName) -> Option<Key> {
        self.known.get(key)?.with.iter().find(|with| with.area == *area).cloned()
    }

    /// How far apart two tracks are, as [`GATE`] measures it, more than nothing; none if they cannot be one person.
    fn apart(&self, one: &Known, other: &Known) -> Option<f64> {
        // Two that are over stay what they were.
        if one.gone_s > 0.0 && other.gone_s > 0.0 {
            return one.with.contains(&other.last.key).then_some(0.0);
        }
        let (here, there) = (one.last.at(one.gone_s), other.last.at(other.gone_s));
        let (x, y) = (here.x - there.x, here.y - there.y);
        let [a, b] = [one, other].map(|known| known.last.covariance_m2(known.gone_s));
        let [xx, xy, yy] = [a[0] + b[0] + APART_M2, a[1] + b[1], a[2] + b[2] + APART_M2];
        let determinant = xx * yy - xy * xy;
        let places = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant.max(1e-9);
        let (here, there) = (&one.last.line, &other.last.line);
        let velocities = (here.vx - there.vx).hypot(here.vy - there.vy) / VELOCITY_APART_MPS;
        let squared = places + velocities * velocities;
        let is_near = x.hypot(y) <= GATE_M;
        if one.with.contains(&other.last.key) {
            // Who is hidden from one area is where the other sees them, and not where the one supposes them; but for whom both see
            // it gives way.
            if one.is_hidden() || other.is_hidden() {
                return Some(GATE + KEPT);
            }
            return (is_near && squared <= GATE + KEPT).then_some(squared);
        }
        (is_near && squared <= GATE).then_some(squared + KEPT)
    }

    /// Two tracks are one person, unless that person would have two tracks of one area.
    fn join(&mut self, one: &Key, other: &Key) {
        let (here, there) = (self.all_with(one), self.all_with(other));
        if !here.contains(other) {
            let rivals = here.iter().flat_map(|key| there.iter().map(move |other| [key, other]));
            let is_hidden = |key: &Key| self.known.get(key).is_none_or(Known::is_hidden);
            let mut hidden = Vec::new();
            for [key, other] in rivals.filter(|[key, other]| key.area == other.area) {
                // Of two tracks of an area the person is the one that it sees.
                match [is_hidden(key), is_hidden(other)] {
                    [true, false] => hidden.push(key.clone()),
                    [false, true] => hidden.push(other.clone()),
                    [true, true] | [false, false] => return,
                }
            }
            hidden.iter().for_each(|key| self.leave(key));
        }
        for (key, with) in [(one, other), (other, one)] {
            if let Some(known) = self.known.get_mut(key) {
                known.with.push(with.clone());
            }
        }
    }

    /// Two tracks are two persons after all.
    fn part(&mut self, one: &Key, other: &Key) {
        for (key, with) in [(one, other), (other, one)] {
            if let Some(known) = self.known.get_mut(key) {
                known.with.retain(|key| key != with);
            }
        }
    }

    /// A track is nobody's but its own.
    fn leave(&mut self, one: &Key) {
        let with = self.known.get(one).map(|known| known.with.clone()).unwrap_or_default();
        with.iter().for_each(|other| self.part(one, other));
    }

    /// All tracks that hang together with this one, itself among them.
    fn all_with(&self, key: &Key) -> BTreeSet<Key> {
        let (mut all, mut next) = (BTreeSet::from([key.clone()]), vec![key.clone()]);
        while let Some(key) = next.pop() {
            let with = self.known.get(&key).map(|known| known.with.clone()).unwrap_or_default();
            next.extend(with.into_iter().filter(|with| all.insert(with.clone())));
        }
        all
    }

    /// Gives each person one number: the oldest of its tracks that are seen and were known before, or of all where there are none
    /// such. Where two persons have the same, as they were one before, it is that one's who walks on with it and was seen the longest, without a break; a track that is over is shown no more.
    fn number(&mut self) {
        let mut persons: Vec<Vec<Key>> = Vec::new();
        let mut seen = BTreeSet::new();
        for (key, known) in &self.known {
            if known.with.is_empty() {
                persons.push(vec![key.clone()]);
            } else if !seen.contains(key) {
                let all = self.all_with(key);
                persons.push(all.iter().cloned().collect());
                seen.extend(all);
            }
        }
        let known = |key: &Key| self.known.get(key);
        let is_free = |number: &u64, taken: &BTreeSet<u64>| !taken.contains(number);
        let oldest = |keys: &[Key], taken: &BTreeSet<u64>| {
            let all = || keys.iter().filter_map(known);
            let sure = all().filter(|known| known.is_sure()).map(|known| known.person);
            let sure = sure.filter(|number| is_free(number, taken)).min();
            sure.or_else(|| all().map(|known| known.person).filter(|number| is_free(number, taken)).min())
        };
        let claim = |keys: &Vec<Key>| {
            let wanted = oldest(keys, &BTreeSet::new()).unwrap_or(0);
            let walks_on = |known: &&Known| known.gone_s == 0.0 && known.person == wanted;
            let walking = keys.iter().filter_map(known).filter(walks_on);
            let seen_ms = walking.map(|known| ((known.seen_s * 1e3) as u64, Reverse(known.own))).max();
            (wanted, Reverse(seen_ms))
        };
        persons.sort_by_cached_key(claim);
        let held: BTreeSet<u64> = self.known.values().map(|known| known.person).collect();
        let mut taken = BTreeSet::new();
        let mut numbered: Vec<(u64, Vec<Key>)> = Vec::new();
        for keys in persons {
            let all = || keys.iter().filter_map(known);
            let has = oldest(&keys, &taken);
            let own = || all().map(|known| known.own).filter(|number| !held.contains(number)).min();
            let number = has.or_else(own).unwrap_or_else(|| {
                self.newest += 1;
                self.newest
            });
            taken.insert(number);
            numbered.push((number, keys));
        }
        for (number, keys) in numbered {
            let is_sure = keys.iter().filter_map(|key| self.known.get(key)).any(Known::is_sure);
            for key in keys {
                // Who is hidden may be somebody else behind the one who is seen, and goes on with their own number when they part.
                if let Some(known) = self.known.get_mut(&key).filter(|known| !(is_sure && known.is_hidden()))
                {
                    known.person = number;
                }
            }
        }
    }

    fn shown(&self) -> Vec<TrackLine> {
        let mut best: BTreeMap<u64, &Heard> = BTreeMap::new();
        let is_seen = |key: &Key| self.known.get(key).is_some_and(|known| !known.is_hidden());
        let is_shown_by_another = |known: &Known| {
            known.is_hidden() && !known.with.is_empty() && self.all_with(&known.last.key).iter().any(is_seen)
        };
        let is_there =
            |known: &&Known| known.gone_s == 0.0 && !known.last.is_elsewhere && !is_shown_by_another(known);
        for known in self.known.values().filter(is_there) {
            let shown = best.entry(known.person).or_insert(&known.last);
            let (new, old) = (known.last.rank(), shown.rank());
            if new.0.cmp(&old.0).then(new.1.total_cmp(&old.1)).is_lt() {
                *shown = &known.last;
            }
        }
        best.into_iter().map(|(person, heard)| TrackLine { id: person, ..heard.line.clone() }).collect()
    }
}
