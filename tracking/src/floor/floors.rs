//! All floors of a site, as one: patches of every floor, bodies across them, and what is known when one falls silent.
//!
//! ```text
//!   readings of mat 1  │ │ │ │ │ │ │ │ │                    │ │ │ │ │ │ │ │ │ │ │ │
//!   its cells          ── unknown ──╭─ seen ───────╮ unknown            ╭─ seen ──
//!                        FOUND_S    ╯       HELD_S ╯          FOUND_S   ╯
//!   readings of mat 2   │ │ │ │ │ │ │ │ │ │ │ │ │ │ │ │ │   with each, the newest patches of mat 1
//! ```
//!
//! A floor that is read says of every panel that works whether a foot is on it. One that is not read says nothing, and
//! what it said before holds for less than a step.

use std::collections::BTreeMap;

use kehai::floor::{Bits, Fault};

use super::bodies::Bodies;
use super::line::FloorLine;
use super::patches::{Patch, patches};
use super::plan::Plan;
use super::reading::Reading;
use crate::explanation::Explanation;
use crate::geometry::Point;

/// Without a reading for so long a floor is silent, s: four readings at 9 Hz, and less than a step takes.
const HELD_S: f64 = 0.5;

/// So far beyond the newest reading a body is predicted, s: to the next one at 9 Hz. A body that stops lifts no foot, so only
/// readings tell that it did not walk on.
const PREDICTED_S: f64 = 0.15;

/// After its first reading not everybody who is on a floor may have been found, s: a body is believed in after three
/// readings, 0.33 s, and a panel is down from the second one; twice that.
pub(crate) const FOUND_S: f64 = 1.0;

/// A floor that is read.
#[derive(Clone, Debug)]
struct State {
    reading: Reading,
    patches: Vec<Patch>,
    /// Since when there was no gap, s.
    begun_s: f64,
}

/// Without a foot on any floor for so long no body is left, s: longer than any stride flies.
const LEFT_S: f64 = 10.0;

/// The floors of a site.
#[derive(Clone, Debug, Default)]
pub struct Floors {
    read: BTreeMap<usize, State>,
    bodies: Bodies,
    /// Time of the newest reading, s.
    newest_s: Option<f64>,
}

impl Floors {
    /// Takes a reading. Whether all who are on that floor have been found by now, so that what it shows is known; none:
    /// it is not newer than the last one of that floor, and was not taken.
    pub fn observe(&mut self, reading: &Reading) -> Option<bool> {
        // Floors are read at different times, and their datagrams overtake each other: nothing goes back in time.
        let at_s = self.newest_s.map_or(reading.at_s, |newest_s| newest_s.max(reading.at_s));
        self.newest_s = Some(at_s);
        let before = self.read.get(&reading.floor);
        if before.is_some_and(|before| before.reading.at_s >= reading.at_s) {
            return None;
        }
        let goes_on = before.filter(|before| reading.at_s - before.reading.at_s <= HELD_S);
        let begun_s = goes_on.map_or(reading.at_s, |before| before.begun_s);
        let patches = patches(&reading.plan, &reading.down);
        self.read.insert(reading.floor, State { reading: reading.clone(), patches, begun_s });
        let all: Vec<Patch> = self.read.values().flat_map(|state| state.patches.iter().cloned()).collect();
        self.bodies.observe(&all, at_s);
        Some(reading.at_s - begun_s >= FOUND_S)
    }

    /// Forgets the floors that are silent at `at_s`, and the bodies that are on none any more; returns the floors' numbers.
    pub fn expire(&mut self, at_s: f64) -> Vec<usize> {
        let is_silent = |state: &State| at_s - state.reading.at_s > HELD_S;
        let silent = self.read.iter().filter(|(_, state)| is_silent(state)).map(|(number, _)| *number);
        let silent: Vec<usize> = silent.collect();
        silent.iter().for_each(|number| _ = self.read.remove(number));
        if self.read.is_empty() && self.newest_s.is_some() {
            self.bodies.observe(&[], at_s);
        }
        silent
    }

    /// Goes on with other floors: no body is on them yet, and numbers of bodies go on.
    pub fn clear(&mut self) {
        self.read.clear();
        if let Some(newest_s) = self.newest_s.take() {
            self.bodies.observe(&[], newest_s + LEFT_S);
        }
    }

    /// All explanations of the feet with their bodies at `at_s`, none of them predicted farther than to the next reading; the
    /// likeliest first.
    #[must_use]
    pub fn explanations(&self, at_s: f64) -> Vec<Explanation> {
        self.newest_s
            .map_or_else(Vec::new, |newest_s| self.bodies.explanations(at_s.min(newest_s + PREDICTED_S)))
    }

    /// Whether a place is on a floor whose people have been found, and where its panel works: a person there presses it.
    #[must_use]
    pub fn tells_of(&self, at: Point) -> bool {
        self.read.values().any(|State { reading, begun_s, .. }| {
            let works = |panel: usize| reading.works(panel);
            reading.at_s - begun_s >= FOUND_S && reading.plan.panel_at(at).is_some_and(works)
        })
    }

    /// What each floor that is read shows; `name` is its name in the site.
    #[must_use]
    pub fn lines(&self, name: impl Fn(usize) -> String) -> Vec<FloorLine> {
        let line = |(number, State { reading, .. }): (&usize, &State)| {
            let Reading { plan, down, faulty, .. } = reading;
            let broken = |wanted: Fault| {
                let those = faulty.iter().filter(move |panel| panel.fault == wanted);
                those.map(|panel| panel.panel).collect()
            };
            FloorLine {
                name: name(*number),
                columns: plan.columns,
                down: numbers(plan, down),
                stuck: broken(Fault::Stuck),
                dead: broken(Fault::Dead),
                unknown_from: reading.unknown_from(),
            }
        };
        self.read.iter().map(line).collect()
    }
}

/// The panels that are down, in order.
fn numbers(plan: &Plan, down: &Bits) -> Vec<u16> {
    (0..plan.panels())
        .filter(|panel| down.get(*panel))
        .filter_map(|panel| u16::try_from(panel).ok())
        .collect()
}
