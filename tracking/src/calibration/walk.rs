//! Which device saw the walker when: one range-bearing measurement a scan, taken only while one person is in view.
//!
//! ```text
//!   hall     ▁▁●●●●●●●●●●▁▁▁▁▁▁●●●●●●▁▁▁▁▁▁
//!   kitchen  ▁▁▁▁▁▁●●●●●●●●●●●●●●●●●●✕✕✕✕▁▁   ✕ two people in view: no measurement counts for half a second
//!                  └common┘
//! ```
//!
//! `look` decides what a scan shows. A floor is one more module here, behind those that measure beams: it sees a place in its
//! own frame, in which its outer corner is the origin.

use std::collections::{BTreeMap, BTreeSet};

use crate::floor::Reading;
use crate::geometry::Point;

pub use super::limits::SLOT_S;
use super::steps::{Middle, Shows, Steps};

/// Glimpses kept a module: an hour.
const MOST: usize = 36_000;

/// Around a moment with several people, slots that are not used: half a second.
const CROWD_SLOTS: i64 = 5;

/// What a module measures a walker by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Range and bearing.
    Beams,
    /// Feet on panels: a place.
    Panels,
}

/// One sight of the walker, in the module's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glimpse {
    /// Which module.
    pub module: usize,
    /// What it measures by.
    pub by: By,
    /// When the beam passed the walker, s on the host's clock.
    pub at_s: f64,
    /// Distance of the centre, m.
    pub range_m: f64,
    /// Its bearing, rad, counter-clockwise from ahead.
    pub bearing_rad: f64,
    /// One σ along the ray, m; of a place on panels along its columns.
    pub radial_m: f64,
    /// One σ across it, m; of a place on panels along its rows.
    pub tangential_m: f64,
}

impl Glimpse {
    /// The centre in the module's frame.
    #[must_use]
    pub fn place(&self) -> Point {
        Point::towards(self.bearing_rad) * self.range_m
    }

    /// The same of a module that hangs the other way up.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self { bearing_rad: -self.bearing_rad, ..self }
    }
}

/// What a module saw in one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scan {
    Nobody,
    /// One person, whose place the floor tells later.
    Later,
    One(Glimpse),
    Several,
}

/// Everything seen of a walk.
#[derive(Clone, Debug)]
pub struct Walk {
    /// A module's scans by their slot.
    scans: Vec<BTreeMap<i64, Scan>>,
    /// Slots in which some module saw several people: one set of all modules, or one for each where only those nearby matter.
    crowds: Vec<BTreeSet<i64>>,
    /// Of each module those that may see the same person; `None`: all others.
    nearby: Option<Vec<Vec<usize>>>,
    /// Of the modules that are floors.
    steps: Vec<Steps>,
}

impl Walk {
    /// A walk of this many modules, without scans.
    #[must_use]
    pub fn new(modules: usize) -> Self {
        let (scans, steps) = (vec![BTreeMap::new(); modules], vec![Steps::default(); modules]);
        Self { scans, crowds: vec![BTreeSet::new()], nearby: None, steps }
    }

    /// A walk of which a module knows only what those say that may see the same person: none until [`Self::set_nearby`].
    #[must_use]
    pub(super) fn apart(modules: usize) -> Self {
        let crowds = vec![BTreeSet::new(); modules];
        Self { crowds, nearby: Some(vec![Vec::new(); modules]), ..Self::new(modules) }
    }

    /// From now on these may see the same person as a module: a list for each.
    pub(super) fn set_nearby(&mut self, nearby: Vec<Vec<usize>>) {
        self.nearby = Some(nearby);
    }

    /// The other modules that may see the same person, in their order.
    pub(super) fn others(&self, module: usize) -> impl Iterator<Item = usize> + '_ {
        let nearby = self.nearby.iter().filter_map(move |nearby| nearby.get(module)).flatten().copied();
        let all = self.nearby.is_none().then(|| 0..self.modules());
        nearby.chain(all.into_iter().flatten()).filter(move |other| *other != module)
    }

    /// How many modules there are.
    #[must_use]
    pub fn modules(&self) -> usize {
        self.scans.len()
    }

    /// Takes the next reading of a floor; see [`Steps::read`].
    pub(super) fn step(&mut self, module: usize, reading: &Reading, middles: &mut Vec<Middle>) -> Shows {
        self.steps.get_mut(module).map_or(Shows::Nobody, |steps| steps.read(reading, middles))
    }

    /// Takes what a module saw in one scan that began at `start_s`.
    pub(super) fn extend(&mut self, module: usize, start_s: f64, scan: Scan) {
        if module >= self.modules() {
            return;
        }
        let slot = (start_s / SLOT_S).floor() as i64;
        if matches!(scan, Scan::Several) {
            let matters_to: Vec<usize> = match &self.nearby {
                None => vec![0],
                Some(_) => self.others(module).chain([module]).collect(),
            };
            for whose in matters_to {
                let Some(crowds) = self.crowds.get_mut(whose) else { continue };
                crowds.insert(slot);
                if crowds.len() > MOST {
                    crowds.pop_first();
                }
            }
        }
        self.put(module, slot, scan);
    }

    /// A glimpse as if an observation had shown it: for tests and other sources.
    pub fn add(&mut self, glimpse: Glimpse) {
        self.put(glimpse.module, (glimpse.at_s / SLOT_S).floor() as i64, Scan::One(glimpse));
    }

    fn put(&mut self, module: usize, slot: i64, scan: Scan) {
        let Some(scans) = self.scans.get_mut(module) else { return };
        scans.insert(slot, scan);
        if scans.len() > MOST {
            scans.pop_first();
        }
    }

    /// The crowds that matter to a module.
    fn crowds(&self, module: usize) -> Option<&BTreeSet<i64>> {
        self.crowds.get(if self.nearby.is_some() { module } else { 0 })
    }

    fn is_crowded(&self, module: usize, slot: i64) -> bool {
        let around = slot - CROWD_SLOTS..=slot + CROWD_SLOTS;
        self.crowds(module).is_some_and(|crowds| crowds.range(around).next().is_some())
    }

    /// Whether several people were in view within the half second before `at_s`.
    pub(super) fn was_crowded(&self, module: usize, at_s: f64) -> bool {
        let slot = (at_s / SLOT_S).floor() as i64;
        let before = slot - CROWD_SLOTS..=slot;
        self.crowds(module).is_some_and(|crowds| crowds.range(before).next().is_some())
    }

    /// Everything that counts, by time.
    #[must_use]
    pub fn glimpses(&self) -> Vec<Glimpse> {
        let mut all: Vec<Glimpse> = Vec::new();
        for (module, scans) in self.scans.iter().enumerate() {
            all.extend(scans.iter().filter_map(|(slot, scan)| match scan {
                Scan::One(glimpse) if !self.is_crowded(module, *slot) => Some(*glimpse),
                _ => None,
            }));
        }
        all.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        all
    }

    /// What a module measures by; None of one that has not seen the walker.
    #[must_use]
    pub fn measures(&self, module: usize) -> Option<By> {
        self.scans.get(module)?.values().find_map(|scan| match scan {
            Scan::One(glimpse) => Some(glimpse.by),
            _ => None,
        })
    }

    /// The same walk with some modules the other way up: `turned` by module.
    #[must_use]
    pub fn with_turned(&self, turned: &[bool]) -> Self {
        let mut walk = self.clone();
        for (scans, _) in walk.scans.iter_mut().zip(turned).filter(|(_, turned)| **turned) {
            for scan in scans.values_mut() {
                if let Scan::One(glimpse) = scan {
                    *glimpse = glimpse.mirrored();
                }
            }
        }
        walk
    }

    /// The same walk with another module and the first under each other's numbers.
    pub(super) fn with_first(&self, module: usize) -> Self {
        let mut walk = self.clone();
        if module < walk.scans.len() {
            walk.scans.swap(0, module);
        }
        for (number, scans) in walk.scans.iter_mut().enumerate() {
            for scan in scans.values_mut() {
                if let Scan::One(glimpse) = scan {
                    glimpse.module = number;
                }
            }
        }
        walk
    }

    /// Moments at which two modules saw the walker and no other person was about: what each of them saw.
    pub fn common(&self, one: usize, other: usize) -> impl Iterator<Item = (Glimpse, Glimpse)> + '_ {
        let scans = |module: usize| self.scans.get(module).into_iter().flatten();
        let beside = self.scans.get(other);
        scans(one).filter_map(move |(slot, scan)| {
            let Scan::One(here) = scan else { return None };
            let found = [0, 1, -1].into_iter().find_map(|by| match beside?.get(&(slot + by)) {
                Some(Scan::One(there)) => Some(*there),
                _ => None,
            })?;
            let is_crowded = self.is_crowded(one, *slot) || self.is_crowded(other, *slot);
            (!is_crowded).then_some((*here, found))
        })
    }

    /// How long two modules saw the walker together, s.
    #[must_use]
    pub fn common_s(&self, one: usize, other: usize) -> f64 {
        self.common(one, other).count() as f64 * SLOT_S
    }

    /// Every pair that saw the walker together, and for how long, s.
    #[must_use]
    pub fn pairs(&self) -> Vec<((usize, usize), f64)> {
        let later =
            |one: usize| self.others(one).filter(move |other| *other > one).map(move |other| (one, other));
        (0..self.modules())
            .flat_map(later)
            .map(|pair| (pair, self.common_s(pair.0, pair.1)))
            .filter(|(_, common_s)| *common_s > 0.0)
            .collect()
    }

    /// How long a module saw the walker, s.
    #[must_use]
    pub fn seen_s(&self, module: usize) -> f64 {
        let one = |scan: &&Scan| matches!(scan, Scan::One(_));
        self.scans.get(module).map_or(0.0, |scans| scans.values().filter(one).count() as f64 * SLOT_S)
    }

    /// For how long several people were in view of some module, s; where only those nearby matter, of the first or of those near it.
    #[must_use]
    pub fn crowded_s(&self) -> f64 {
        self.crowds.first().map_or(0, BTreeSet::len) as f64 * SLOT_S
    }

    /// The newest glimpse of a module since `from_s`.
    #[must_use]
    pub fn newest(&self, module: usize, from_s: f64) -> Option<Glimpse> {
        let from = (from_s / SLOT_S).floor() as i64;
        match self.scans.get(module)?.range(from..).next_back()?.1 {
            Scan::One(glimpse) => Some(*glimpse),
            _ => None,
        }
    }

    /// Forgets what was before `before_s`.
    pub fn forget(&mut self, before_s: f64) {
        let first = (before_s / SLOT_S).floor() as i64;
        for scans in &mut self.scans {
            *scans = scans.split_off(&first);
        }
        for crowds in &mut self.crowds {
            *crowds = crowds.split_off(&first);
        }
    }

    /// The modules that see the walker at `at_s`, within the last half second, and the modules that see several people.
    #[must_use]
    pub fn now(&self, at_s: f64) -> (Vec<usize>, Vec<usize>) {
        let from = ((at_s - 0.5) / SLOT_S).floor() as i64;
        let newest = |(module, scans): (usize, &BTreeMap<i64, Scan>)| {
            Some((module, *scans.range(from..).next_back()?.1))
        };
        let scans: Vec<(usize, Scan)> = self.scans.iter().enumerate().filter_map(newest).collect();
        let of = |wanted: fn(&Scan) -> bool| -> Vec<usize> {
            scans.iter().filter(|(_, scan)| wanted(scan)).map(|(module, _)| *module).collect()
        };
        (of(|scan| matches!(scan, Scan::One(_) | Scan::Later)), of(|scan| matches!(scan, Scan::Several)))
    }

    /// The time covered, s: from the first to the last scan of any module.
    #[must_use]
    pub fn span_s(&self) -> f64 {
        let first = self.scans.iter().filter_map(|scans| scans.keys().next()).min();
        let last = self.scans.iter().filter_map(|scans| scans.keys().next_back()).max();
        first.zip(last).map_or(0.0, |(first, last)| (last - first) as f64 * SLOT_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_an_hour_is_kept_of_whatever_source() {
        let mut walk = Walk::new(1);
        for slot in 0..MOST + 10 {
            walk.add(Glimpse {
                module: 0,
                by: By::Panels,
                at_s: (slot as f64 + 0.5) * SLOT_S,
                range_m: 1.0,
                bearing_rad: 0.0,
                radial_m: 0.1,
                tangential_m: 0.1,
            });
        }
        assert_eq!(walk.glimpses().len(), MOST);
        assert_eq!(walk.newest(0, 0.0).map(|glimpse| glimpse.at_s), Some((MOST as f64 + 9.5) * SLOT_S));
    }
}
