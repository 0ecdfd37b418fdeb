//! Which person each track of an area is: all of the area at once, so that the distances from the leaders together are least.
//!
//! ```text
//!                       person 12, led by east 7     13, led by east 9      alone
//!   west 3, 12 before            2.1                       17.0 + kept       27.5     ─▶ 12
//!   west 4, new                 11.5 + kept                 0.4 + kept       27.5     ─▶ 13
//! ```
//!
//! A distance is that of places by both covariances, and that of velocities. A track of before stays unless another is much nearer;
//! who is hidden from the area stays, wherever it is supposed, but for one whom the area sees.

use std::collections::BTreeSet;

use super::AreaName;
use super::persons::{Person, Persons};
use super::tracks::{GATE, GATE_M, Key, Track, keys_of};
use crate::assignment::{Alone, assign};
use crate::geometry::{Point, bounds};

/// So much nearer must another track be than the one of before: three sigmas, which the noise of two who walk side by side does not
/// make.
const KEPT: f64 = 9.0;

/// What a hidden track of a person costs: as much as the dearest that is seen.
const HIDDEN: f64 = GATE + KEPT;

/// What a track costs that stays alone: a hundredth above the dearest.
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
}
