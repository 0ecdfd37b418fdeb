//! Names of which the last reading alone counts, kept among tracks from then on: those of the areas of a site, and the cards of a
//! door.
//!
//! ```text
//!   an area has read a11c      ─▶  person 4: 0.93   person 7: 0.05     the shares of its own table
//!   a door's reader reads it   ─▶  track  4: 0.93   track  7: 0.02     by their places, as the table weighs a first sign
//!   time, tracks touch         ─▶           0.80             0.16     as in the table
//! ```

use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix2;

use super::known::{HALF_LIFE_S, Known};
use super::person::{Person, Swap, swaps};
use crate::geometry::Point;
use crate::names::Likelihood;
use crate::tracker::{TrackId, TrackState};

/// What is known of each name.
#[derive(Clone, Debug)]
pub struct Carried<Name> {
    names: BTreeMap<Name, Known>,
    half_life_s: f64,
}

impl<Name: Ord> Default for Carried<Name> {
    /// Shares fall by half as fast as in the table of one tracker.
    fn default() -> Self {
        Self::with_half_life(HALF_LIFE_S)
    }
}

impl<Name: Ord> Carried<Name> {
    /// Shares fall by half in so long, s.
    #[must_use]
    pub const fn with_half_life(half_life_s: f64) -> Self {
        Self { names: BTreeMap::new(), half_life_s }
    }

    /// A name was read, by an area whose own table gave these shares: they replace what was known of the name.
    pub fn read(&mut self, name: Name, shares: impl IntoIterator<Item = (TrackId, f64)>) {
        self.names.insert(name, Known::of(shares));
    }

    /// A name was read at `at`, known by one sigma of `sigma_m` along each axis: one of these tracks bears it, or none of them. That
    /// replaces what was known of the name.
    pub fn read_at<'a>(
        &mut self,
        name: Name,
        tracks: impl IntoIterator<Item = &'a TrackState>,
        at: Point,
        sigma_m: f64,
    ) {
        let people: Vec<Person> = tracks.into_iter().filter_map(Person::of).collect();
        let spread = Matrix2::identity() * (sigma_m * sigma_m);
        self.names.insert(name, Known::read(&people, at, spread));
    }

    /// Forgets all names but these.
    pub fn retain(&mut self, is_kept: impl Fn(&Name) -> bool) {
        self.names.retain(|name, _| is_kept(name));
    }

    /// Time passes, so much of it, s, and these are all tracks: those that touch may have been swapped, and a track that is gone
    /// takes its share with it. A name that no track has a share of any more is forgotten.
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
            // Tracks that have a share, and those that they touch: a site has thousands, and a name a few.
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
            known.fade(&near, passed_s, self.half_life_s, swaps.iter());
        }
        self.names.retain(|_, known| !known.shares.is_empty());
    }

    /// Which tracks have a name, the likeliest first.
    #[must_use]
    pub fn told<Q: Ord + ?Sized>(&self, name: &Q) -> Vec<Likelihood>
    where
        Name: Borrow<Q>,
    {
        self.names.get(name).map(|known| known.told(Some)).unwrap_or_default()
    }

    /// The names of which anything is known.
    pub fn names(&self) -> impl Iterator<Item = &Name> {
        self.names.keys()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn a_name_is_shared_by_tracks_that_touch_and_goes_with_a_track_that_is_gone() {
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
        assert_eq!(carried.names().collect::<Vec<_>>(), [&"a11c"], "no track has a share of the other");
        carried.retain(|label| *label == "b0b0");
        assert!(carried.told("a11c").is_empty());
    }
}
