//! Who is somebody new, and which two persons are one after all.
//!
//! ```text
//!   nobody's track   at home, nobody near whom the area misses     ─▶ new at once
//!                    on the ground of another, or near such a one  ─▶ new after a second: it is theirs to say who that is
//!                    near anybody, and was somebody before         ─▶ the same: it was mistaken once
//!   two persons      by two areas, in one place for half a second  ─▶ one
//! ```

use std::collections::BTreeMap;

use super::AreaName;
use super::persons::{Person, Persons};
use super::tracks::{GATE_M, Key, Track, keys_of};

use crate::geometry::Point;

/// So long a track is nobody who may be somebody of another area, s: a tracker finds who walks in within 0.8 s, and says it within
/// another tenth.
const ANSWERED_S: f64 = 1.0;

/// Two bodies cannot be so near, m.
const ONE_BODY_M: f64 = 0.33;

/// Two who are so near for so long are one, s: who walks past another at 1.3 m/s each is for half of it.
const ONE_BODY_S: f64 = 0.5;

impl Persons {
    /// Those of an area who are nobody yet are somebody new: at once at home, and on the ground of another once that one should have
    /// answered.
    pub(super) fn bear(&mut self, area: &AreaName, elapsed_s: f64) {
        let may_be_new = |track: &Track| {
            let was_lost = track.was_person && !track.is_seen();
            track.person.is_none() && track.is_there() && !was_lost
        };
        let mut nobody: Vec<&mut Track> = self
            .tracks
            .range_mut(keys_of(area))
            .map(|(_, track)| track)
            .filter(|track| may_be_new(track))
            .collect();
        if nobody.is_empty() {
            return;
        }
        nobody.iter_mut().for_each(|track| track.nobody_s += elapsed_s);
        let nobody: Vec<Track> = nobody.into_iter().map(|track| track.clone()).collect();
        let sees = |key: &Key| self.tracks.get(key).is_some_and(Track::is_seen);
        let is_missed = |person: &Person| !person.tracks.get(area).is_some_and(sees);
        let seen = self.persons.values().filter(|person| person.is_seen);
        let seen: Vec<(Point, bool)> = seen.map(|person| (person.at, is_missed(person))).collect();
        for track in nobody {
            let is_near = |there: &Point| (*there - track.at()).length() <= GATE_M;
            let mut near = seen.iter().filter(|(there, _)| is_near(there));
            let may_be_another =
                track.last.is_abroad || near.any(|(_, is_missed)| *is_missed || track.was_person);
            let is_answered = track.is_seen() && track.nobody_s >= ANSWERED_S;
            if may_be_another && !is_answered {
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

    /// Two persons whom different areas see in one place are one, with the number of who was seen the longest without a break.
    pub(super) fn unite(&mut self, elapsed_s: f64) {
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
            self.give(given, kept);
        }
    }

    /// The tracks of one person are another's, but for those of areas that see that one otherwise.
    fn give(&mut self, given: u64, kept: u64) {
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
