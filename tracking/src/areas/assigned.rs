//! The tracks of an area are assigned to persons, all at once: the sum of their distances from the leaders is least.
//!
//! ```text
//!                       person 12, led by east 7     13, led by east 9      unassigned
//!   west 3, 12 before            2.1                       17.0 + kept       27.5     ─▶ 12
//!   west 4, new                 11.5 + kept                 0.4 + kept       27.5     ─▶ 13
//! ```
//!
//! A distance is that of places, by both covariances, and that of velocities. A track keeps its person unless another track is much
//! nearer. A hidden track keeps it, too, wherever its tracker supposes it, unless a track that is seen takes the person.

use std::collections::BTreeSet;

use super::AreaName;
use super::persons::{Person, Persons};
use super::tracks::{GATE, GATE_M, Key, Track, keys_of};
use crate::assignment::{Alone, assign};
use crate::geometry::{Point, bounds};

/// So much nearer must another track be than the one that is assigned: the square of three sigmas, more than the noise of two people
/// who walk side by side makes.
const KEPT: f64 = 9.0;

/// What it costs that a hidden track keeps its person: as much as the dearest of those that are seen.
const HIDDEN: f64 = GATE + KEPT;

/// What it costs that a track stays unassigned: a hundredth above the dearest.
const ALONE: f64 = HIDDEN + 0.01;

impl Persons {
    /// Assigns the tracks of an area to persons.
    pub(super) fn assign(&mut self, area: &AreaName) {
        let own: Vec<&Track> = self
            .tracks
            .range(keys_of(area))
            .map(|(_, track)| track)
            .filter(|track| track.is_there())
            .collect();
        let (low, high) = bounds(own.iter().map(|track| track.at())).unwrap_or_default();
        let beyond = Point::new(GATE_M, GATE_M);
        let (low, high) = (low - beyond, high + beyond);
        let is_near = |person: &Person| {
            let Point { x, y } = person.at;
            low.x <= x && x <= high.x && low.y <= y && y <= high.y
        };
        let near = self.persons.iter().filter(|(_, person)| is_near(person)).map(|(number, _)| *number);
        let numbers: BTreeSet<u64> = own.iter().filter_map(|track| track.person).chain(near).collect();
        let persons: Vec<(u64, &Person)> =
            numbers.into_iter().filter_map(|number| Some((number, self.persons.get(&number)?))).collect();
        let cost = |row: usize, column: usize| {
            let (track, (number, person)) = (own.get(row)?, persons.get(column)?);
            self.cost(track, *number, person)
        };
        let assigned = assign(own.len(), persons.len(), &Alone::all(ALONE), cost);
        let number = |column: Option<usize>| Some(persons.get(column?)?.0);
        let numbers = own.iter().zip(assigned).map(|(track, column)| (track, number(column)));
        let numbers: Vec<(Key, Option<u64>)> = numbers
            .filter(|(track, number)| track.person != *number)
            .map(|(track, number)| (track.last.key.clone(), number))
            .collect();
        for (key, _) in &numbers {
            self.unassign(key);
        }
        for (key, number) in numbers {
            if let Some(number) = number {
                self.join(key, number);
            }
        }
    }

    /// What it costs to assign a track to a person; none: it cannot be.
    fn cost(&self, track: &Track, number: u64, person: &Person) -> Option<f64> {
        let leader = self.tracks.get(&person.leader)?;
        let key = &track.last.key;
        if person.leader == *key {
            return Some(0.0);
        }
        // The leader is of the same area, which says that they are two people.
        if leader.last.key.area == key.area && leader.is_there() {
            return None;
        }
        let was = track.person == Some(number);
        if !track.is_seen() {
            // A person hidden from one area is where another area sees them.
            return was.then_some(HIDDEN);
        }
        let apart = track.apart(leader)?;
        let gate = GATE + if was { KEPT } else { 0.0 };
        (apart <= gate).then_some(if was { apart } else { apart + KEPT })
    }

    /// Takes a track from its person.
    fn unassign(&mut self, key: &Key) {
        let Some(track) = self.tracks.get_mut(key) else { return };
        if let Some(person) = track.person.take().and_then(|number| self.persons.get_mut(&number)) {
            person.tracks.retain(|_, other| other != key);
        }
    }
}
