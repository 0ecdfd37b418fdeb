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
//! that of places by both covariances, and that of velocities. A pair of before is preferred. The older number of the two is the
//! person's. Nothing is compared by the clocks of the areas: a track is predicted from when its frame was heard.

use std::collections::BTreeMap;

use super::AreaName;
use crate::assignment::{Alone, assign};
use crate::geometry::Point;
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
}

/// A track that was heard, and the number of its person.
#[derive(Clone, Debug)]
struct Known {
    person: u64,
    last: Heard,
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

impl Persons {
    /// The persons of the tracks that are heard at `now_us`, each by the track that knows it best, under the person's number. Tentative
    /// tracks are none yet.
    pub fn follow(&mut self, heard: Vec<Heard>, now_us: u64) -> Vec<TrackLine> {
        let elapsed_s = now_us.saturating_sub(self.last_us) as f64 * 1e-6;
        self.last_us = now_us;
        self.note(heard, elapsed_s);
        let mut areas: Vec<AreaName> = self.known.keys().map(|key| key.area.clone()).collect();
        areas.dedup();
        for (index, one) in areas.iter().enumerate() {
            for other in areas.iter().skip(index + 1) {
                self.pair(one, other);
            }
        }
        self.shown()
    }

    /// The person that a track of an area is, if it is one.
    pub fn of(&self, key: &Key) -> Option<u64> {
        self.known.get(key).map(|known| known.person)
    }

    fn note(&mut self, heard: Vec<Heard>, elapsed_s: f64) {
        self.known.values_mut().for_each(|known| known.gone_s += elapsed_s);
        for heard in heard.into_iter().filter(|heard| heard.line.state != LifeCycle::Tentative) {
            if let Some(known) = self.known.get_mut(&heard.key) {
                known.last = heard;
                known.gone_s = 0.0;
            } else {
                self.newest += 1;
                let known = Known { person: self.newest, last: heard, gone_s: 0.0, with: Vec::new() };
                self.known.insert(known.last.key.clone(), known);
            }
        }
        self.known.retain(|_, known| known.gone_s <= LEFT_BEHIND_S);
        let keys: Vec<Key> = self.known.keys().cloned().collect();
        self.known.values_mut().for_each(|known| known.with.retain(|key| keys.binary_search(key).is_ok()));
    }

    /// Pairs the tracks of two areas.
    fn pair(&mut self, one: &AreaName, other: &AreaName) {
        let of = |area: &AreaName| -> Vec<Key> {
            self.known.keys().filter(|key| key.area == *area).cloned().collect()
        };
        let (rows, columns) = (of(one), of(other));
        let cost = |row: usize, column: usize| {
            let (one, other) = (rows.get(row)?, columns.get(column)?);
            self.apart(self.known.get(one)?, self.known.get(other)?)
        };
        let paired = assign(rows.len(), columns.len(), &Alone::all(GATE + KEPT), cost);
        for (row, column) in rows.iter().zip(paired) {
            let now = column.and_then(|column| columns.get(column));
            let before = self.partner(row, other);
            if before.as_ref() == now {
                continue;
            }
            if let Some(before) = before {
                self.part(row, &before);
            }
            let Some(now) = now else { continue };
            if let Some(before) = self.partner(now, one) {
                self.part(&before, now);
            }
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
        let is_kept = one.with.contains(&other.last.key);
        let near = squared <= if is_kept { GATE + KEPT } else { GATE };
        (near && x.hypot(y) <= GATE_M).then_some(if is_kept { squared } else { squared + KEPT })
    }

    /// Two tracks are one person: the one with the older number.
    fn join(&mut self, one: &Key, other: &Key) {
        let person = |key: &Key| self.known.get(key).map(|known| known.person);
        let Some((here, there)) = person(one).zip(person(other)) else { return };
        let older = here.min(there);
        for (key, with) in [(one, other), (other, one)] {
            if let Some(known) = self.known.get_mut(key) {
                known.with.push(with.clone());
            }
        }
        // Those that are one with either of them already are one with both.
        self.known.values_mut().filter(|known| [here, there].contains(&known.person)).for_each(|known| {
            known.person = older;
        });
    }

    /// Two tracks are two persons after all. The one that is left behind, or was heard later, gets another number.
    fn part(&mut self, one: &Key, other: &Key) {
        for (key, with) in [(one, other), (other, one)] {
            if let Some(known) = self.known.get_mut(key) {
                known.with.retain(|key| key != with);
            }
        }
        let gone = |key: &Key| self.known.get(key).is_some_and(|known| known.gone_s > 0.0);
        // A track that is over is shown no more: who walks on keeps the number.
        let renamed = if gone(one) { one } else { other };
        self.newest += 1;
        if let Some(known) = self.known.get_mut(renamed) {
            known.person = self.newest;
        }
    }

    fn shown(&self) -> Vec<TrackLine> {
        let mut best: BTreeMap<u64, &Heard> = BTreeMap::new();
        for known in self.known.values().filter(|known| known.gone_s == 0.0) {
            let shown = best.entry(known.person).or_insert(&known.last);
            let (new, old) = (known.last.rank(), shown.rank());
            if new.0.cmp(&old.0).then(new.1.total_cmp(&old.1)).is_lt() {
                *shown = &known.last;
            }
        }
        best.into_iter().map(|(person, heard)| TrackLine { id: person, ..heard.line.clone() }).collect()
    }
}
