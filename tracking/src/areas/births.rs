//! Which unassigned tracks become new persons, and which two persons are merged.
//!
//! ```text
//!   an unassigned track
//!     on its area's ground, away from persons whom its area does not see   ─▶ a new person at once
//!     on another area's ground                                             ─▶ after 1 s: that area may have a track of the same person
//!     near a person whom another area sees and its own does not            ─▶ the same
//!     near any person, and it was assigned before                          ─▶ the same: its tracker has confused two people
//!   two persons, seen by different areas within 0.33 m for 0.5 s           ─▶ merged
//! ```

use std::collections::BTreeMap;

use super::AreaName;
use super::persons::{Person, Persons};
use super::tracks::{GATE_M, Key, Track, keys_of};
use crate::geometry::Point;

/// A track that another area may have, too, stays unassigned for so long before it is a new person, s: a tracker finds a person who
/// walks in within 0.8 s, and sends it within another tenth.
const ANSWERED_S: f64 = 1.0;

/// Two bodies cannot be so near, m.
const ONE_BODY_M: f64 = 0.33;

/// Two persons so near for so long are merged, s: two who walk past each other at 1.3 m/s each are for half of it.
const ONE_BODY_S: f64 = 0.5;

impl Persons {
    /// Makes new persons of an area's unassigned tracks: at once, or, where another area may have a track of the same person, after
    /// [`ANSWERED_S`].
    pub(super) fn begin(&mut self, area: &AreaName, elapsed_s: f64) {
        let may_be_new = |track: &Track| {
            let was_lost = track.was_assigned && !track.is_seen();
            track.person.is_none() && track.is_there() && !was_lost
        };
        let own = self.tracks.range_mut(keys_of(area)).map(|(_, track)| track);
        let waited = |track: &mut Track| {
            track.unassigned_s += elapsed_s;
            track.clone()
        };
        let unassigned: Vec<Track> = own.filter(|track| may_be_new(track)).map(waited).collect();
        if unassigned.is_empty() {
            return;
        }
        let is_near = |there: Point, track: &Track| (there - track.at()).length() <= GATE_M;
        // First whether they are near: of a large site hardly anybody is.
        let is_near_any = |person: &&Person| unassigned.iter().any(|track| is_near(person.at, track));
        let sees = |key: &Key| self.tracks.get(key).is_some_and(Track::is_seen);
        let is_missed = |person: &Person| !person.tracks.get(area).is_some_and(sees);
        let seen = self.persons.values().filter(|person| person.is_seen).filter(is_near_any);
        let seen: Vec<(Point, bool)> = seen.map(|person| (person.at, is_missed(person))).collect();
        for track in unassigned {
            let mut near = seen.iter().filter(|(there, _)| is_near(*there, &track));
            let may_be_known =
                track.last.is_abroad || near.any(|(_, is_missed)| *is_missed || track.was_assigned);
            let is_answered = track.is_seen() && track.unassigned_s >= ANSWERED_S;
            if may_be_known && !is_answered {
                continue;
            }
            self.newest += 1;
            let person = Person {
                leader: track.last.key.clone(),
                at: track.at(),
                is_seen: track.is_seen(),
                seen_s: 0.0,
                tracks: BTreeMap::new(),
            };
            self.persons.insert(self.newest, person);
            self.join(track.last.key, self.newest);
        }
    }

    /// Merges two persons whom different areas see in one place. The number of the one seen longest without a break stays.
    pub(super) fn merge(&mut self, elapsed_s: f64) {
        let mut seen: Vec<(u64, &Person)> = self
            .persons
            .iter()
            .filter(|(_, person)| person.is_seen)
            .map(|(number, person)| (*number, person))
            .collect();
        seen.sort_by(|(_, one), (_, other)| one.at.x.total_cmp(&other.at.x));
        let is_seen = |key: &Key| self.tracks.get(key).is_some_and(Track::is_seen);
        let mut one_place_s = BTreeMap::new();
        for (index, (number, one)) in seen.iter().enumerate() {
            let is_near = |(_, other): &&(u64, &Person)| other.at.x - one.at.x <= ONE_BODY_M;
            for (other_number, other) in seen.iter().skip(index + 1).take_while(is_near) {
                let are_two = |(area, key): (&AreaName, &Key)| {
                    is_seen(key) && other.tracks.get(area).is_some_and(is_seen)
                };
                if (one.at - other.at).length() > ONE_BODY_M || one.tracks.iter().any(are_two) {
                    continue;
                }
                let pair = ((*number).min(*other_number), (*number).max(*other_number));
                let before = self.one_place_s.get(&pair).copied().unwrap_or(0.0);
                one_place_s.insert(pair, before + elapsed_s);
            }
        }
        let due = one_place_s.iter().filter(|(_, for_s)| **for_s >= ONE_BODY_S);
        let due: Vec<(u64, u64)> = due.map(|(pair, _)| *pair).collect();
        self.one_place_s = one_place_s;
        for (one, other) in due {
            let seen_s = |number: u64| self.persons.get(&number).map(|person| person.seen_s);
            let Some((first_s, second_s)) = seen_s(one).zip(seen_s(other)) else { continue };
            let (kept, given) = if second_s > first_s { (other, one) } else { (one, other) };
            self.hand_over(given, kept);
        }
    }

    /// Removes a person and assigns its tracks to another, but for tracks of areas by which the other is seen already.
    fn hand_over(&mut self, given: u64, kept: u64) {
        let Some(given) = self.persons.remove(&given) else { return };
        for (area, key) in given.tracks {
            let has = self.persons.get(&kept).and_then(|person| person.tracks.get(&area));
            if has.and_then(|key| self.tracks.get(key)).is_some_and(Track::is_seen) {
                if let Some(track) = self.tracks.get_mut(&key) {
                    track.person = None;
                }
            } else {
                self.join(key, kept);
            }
        }
    }
}
