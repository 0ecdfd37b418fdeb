//! Names that others have read, and that are kept among persons from then on: a site's, over all its areas.
//!
//! ```text
//!   an area reads a11c   ─▶  person 4: 0.93   person 7: 0.05
//!   time, persons touch  ─▶           0.80            0.16     as in the table of one tracker
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::known::Known;
use super::person::{Person, Swap, swaps};
use crate::names::Likelihood;
use crate::tracker::{TrackId, TrackState};

/// What is known of each name, by its label.
#[derive(Debug, Default)]
pub struct Carried {
    names: BTreeMap<String, Known>,
}

impl Carried {
    /// A name was read, by an area whose own table gave these shares: they replace what was known of the name.
    pub fn read(&mut self, label: &str, shares: impl IntoIterator<Item = (TrackId, f64)>) {
        self.names.insert(label.to_owned(), Known::of(shares));
    }

    /// Forgets all names but these.
    pub fn retain(&mut self, is_kept: impl Fn(&str) -> bool) {
        self.names.retain(|label, _| is_kept(label));
    }

    /// Time passes, so much of it, s, and these are all tracks: who touches another may have been swapped, and a track that is gone
    /// takes its share with it.
    pub fn follow(&mut self, tracks: &[TrackState], passed_s: f64) {
        if self.names.is_empty() {
            return;
        }
        let people: Vec<Person> = tracks.iter().filter_map(Person::of).collect();
        let numbers: BTreeMap<TrackId, usize> =
            people.iter().enumerate().map(|(number, person)| (person.track, number)).collect();
        let mut touching: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
        for (one, other, mixed) in swaps(&people, 0, passed_s) {
            touching.entry(one).or_default().push((other, mixed));
            touching.entry(other).or_default().push((one, mixed));
        }
        for known in self.names.values_mut() {
            // Those who have a share, and whom they touch: a site has thousands, and a name a few.
            let with: Vec<usize> =
                known.shares.keys().filter_map(|track| numbers.get(track).copied()).collect();
            let of = |number: &usize| touching.get(number).into_iter().flatten();
            let touched = with.iter().flat_map(of).map(|(other, _)| *other);
            let involved: BTreeSet<usize> = with.iter().copied().chain(touched).collect();
            let place: BTreeMap<usize, usize> =
                involved.iter().enumerate().map(|(place, number)| (*number, place)).collect();
            let swap = |one: usize, (other, mixed): &(usize, f64)| -> Option<Swap> {
                (one < *other).then_some((*place.get(&one)?, *place.get(other)?, *mixed))
            };
            let swaps: Vec<Swap> = involved
                .iter()
                .flat_map(|one| of(one).filter_map(|other| swap(*one, other)).collect::<Vec<_>>())
                .collect();
            let near: Vec<Person> =
                involved.iter().filter_map(|number| people.get(*number)).copied().collect();
            known.fade(&near, passed_s, swaps.iter());
        }
    }

    /// Which tracks have a name, the likeliest first.
    #[must_use]
    pub fn told(&self, label: &str) -> Vec<Likelihood> {
        self.names.get(label).map(|known| known.told(Some)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::tracker::{LifeCycle, Origin};

    fn at(id: TrackId, x: f64) -> TrackState {
        TrackState {
            id,
            at: Point::new(x, 0.0),
            velocity: Point::default(),
            covariance_m2: [0.01, 0.0, 0.01],
            state: LifeCycle::Confirmed,
            existence: 1.0,
            reason: "",
            origin: Origin::Entered,
        }
    }

    #[test]
    fn a_name_is_shared_by_those_who_touch_and_goes_with_who_is_gone() {
        let mut carried = Carried::default();
        carried.read("a11c", [(1, 0.9)]);
        carried.read("b0b0", [(3, 0.8)]);
        for _ in 0..50 {
            carried.follow(&[at(1, 0.0), at(2, 2.0), at(3, 50.0)], 0.1);
        }
        let alone = carried.told("a11c");
        assert!(alone.len() == 1 && alone[0].probability > 0.89, "{alone:?}");
        for _ in 0..50 {
            carried.follow(&[at(1, 0.0), at(2, 0.1), at(3, 50.0)], 0.1);
        }
        let [one, other] = carried.told("a11c")[..] else { panic!("{:?}", carried.told("a11c")) };
        assert!((one.probability - other.probability).abs() < 0.1, "{one:?} {other:?}");
        let far = carried.told("b0b0");
        assert!(far.len() == 1 && far[0].track == 3, "{far:?}");
        carried.follow(&[at(2, 0.1)], 0.1);
        assert!(carried.told("b0b0").is_empty() && carried.told("a11c").len() == 1);
        carried.retain(|label| label == "b0b0");
        assert!(carried.told("a11c").is_empty());
    }
}
