//! What is known of an ID: a share of each track that may be its bearer, and of none of them.
//!
//! ```text
//!   shares of an ID   4: 0.93   7: 0.02   none: 0.01   the rest, 0.04, is not known: it may be any of them, or none
//!                        │ a sign            × ε + N(z; x, P + R) / N(z; z, R): 1 at the place, ε far from it
//!                        ▼
//!                     4: 0.99   7: 0.00 …
//! ```

use std::collections::BTreeMap;

use nalgebra::Matrix2;

use super::line::Likelihood;
use super::person::{Person, Swap, agreement};
use crate::figures::rounded;
use crate::geometry::Point;
use crate::tracker::TrackId;

/// Most tracks that an ID has a share of.
const SHARES_MAX: usize = 16;

/// ε: one sign in a hundred is wrong, read far from its bearer. Two that agree overturn a certainty.
const WRONG: f64 = 0.01;

/// How likely a sign is if its bearer is no track at all, beside 1 at the place of its track. That is more than an error makes
/// likely: a tag that lies on a table takes its name off the track that had it.
const NONE: f64 = 0.05;

/// Share of what is known that each sign puts in doubt: tracks may have been swapped since the one before.
const DOUBT: f64 = 0.01;

/// In so long a likelihood falls by half where signs come again and again, s: of five people crowded on 4 m² each is taken for
/// another about once in that time (docs/accuracy.md, condition H).
pub(super) const HALF_LIFE_S: f64 = 600.0;

/// That its bearer is none of the tracks is half forgotten in so long, s: a person walks into view.
const UNSEEN_HALF_S: f64 = 10.0;

/// Less likely is not worth telling.
const TOLD: f64 = 0.05;

/// Less likely is not worth keeping.
const KEPT: f64 = 0.002;

/// What is known of an ID.
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    /// The likelihood of each track, and that of none of them; together at most 1. The rest is not known.
    pub(super) shares: BTreeMap<TrackId, f64>,
    none: f64,
}

impl Known {
    /// Shares that another table has worked out.
    pub(super) fn of(shares: impl IntoIterator<Item = (TrackId, f64)>) -> Self {
        let mut known = Self { shares: shares.into_iter().collect(), none: 0.0 };
        known.trim();
        known
    }

    /// What a reading at `at` with the covariance `spread`, m², says of an ID of which nothing was known before.
    pub(super) fn read(people: &[Person], at: Point, spread: Matrix2<f64>) -> Self {
        let mut known = Self::default();
        known.weigh(people.iter(), 0.0, at, spread);
        known
    }

    /// A reading at `at` with the covariance `spread`, m², so long after the moment of `people`, s. How likely it was, as a
    /// share of what it could be at most.
    pub(super) fn weigh<'a>(
        &mut self,
        people: impl Iterator<Item = &'a Person> + Clone,
        after_s: f64,
        at: Point,
        spread: Matrix2<f64>,
    ) -> f64 {
        let known = self.shares.values().sum::<f64>() + self.none;
        let unknown = (1.0 - known).max(0.0) * (1.0 - DOUBT) + DOUBT;
        let existing: f64 = people.clone().map(|person| person.existence).sum();
        // What is not known is spread evenly: one part for each track that exists, and one for none of them.
        let part = unknown / (existing + 1.0);
        // A track that was not there at that time has nothing that speaks for it.
        let mut shares: BTreeMap<TrackId, f64> =
            self.shares.iter().map(|(track, share)| (*track, share * (1.0 - DOUBT) * WRONG)).collect();
        for person in people {
            let before = self.shares.get(&person.track).copied().unwrap_or(0.0);
            let there = person.at + person.velocity * after_s;
            let prior = before * (1.0 - DOUBT) + part * person.existence;
            let agreement = agreement(at - there, person.covariance, spread);
            shares.insert(person.track, prior * (WRONG + (1.0 - WRONG) * agreement));
        }
        let none = (self.none * (1.0 - DOUBT) + part) * NONE;
        let sum = shares.values().sum::<f64>() + none;
        shares.values_mut().for_each(|share| *share /= sum);
        (self.shares, self.none) = (shares, none / sum);
        self.trim();
        sum
    }

    /// Time passes: what is known falls by half in `half_life_s`, swaps what may have been swapped, and loses tracks that are gone.
    pub(super) fn fade<'a>(
        &mut self,
        people: &[Person],
        passed_s: f64,
        half_life_s: f64,
        swaps: impl Iterator<Item = &'a Swap>,
    ) {
        self.none *= libm::exp2(-passed_s / UNSEEN_HALF_S);
        let left = libm::exp2(-passed_s / half_life_s);
        if self.shares.is_empty() {
            return;
        }
        let mut of: Vec<f64> = people
            .iter()
            .map(|person| self.shares.get(&person.track).copied().unwrap_or(0.0) * left)
            .collect();
        for &(one, other, mixed) in swaps {
            let [Some(&a), Some(&b)] = [of.get(one), of.get(other)] else { continue };
            let over = 0.5 * mixed * (a - b);
            if let Some(share) = of.get_mut(one) {
                *share -= over;
            }
            if let Some(share) = of.get_mut(other) {
                *share += over;
            }
        }
        self.shares = people.iter().zip(of).map(|(person, share)| (person.track, share)).collect();
        self.trim();
    }

    /// The tracks that may be its bearer, the likeliest first, each by the number that `track` has for it; one without is left out.
    pub(super) fn told(&self, track: impl Fn(TrackId) -> Option<TrackId>) -> Vec<Likelihood> {
        let told = |(of, share): (&TrackId, &f64)| {
            Some(Likelihood { track: track(*of)?, probability: rounded(*share, 1e3) })
        };
        let mut told: Vec<Likelihood> =
            self.shares.iter().filter(|(_, share)| **share >= TOLD).filter_map(told).collect();
        told.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        told
    }

    /// Keeps what is worth keeping.
    fn trim(&mut self) {
        self.shares.retain(|_, share| *share >= KEPT);
        while self.shares.len() > SHARES_MAX {
            let least = self.shares.iter().min_by(|one, other| one.1.total_cmp(other.1));
            let Some(track) = least.map(|(track, _)| *track) else { return };
            self.shares.remove(&track);
        }
    }
}
