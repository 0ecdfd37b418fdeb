//! Which track a card belongs to, so probably: identity beside position, never moving it.
//!
//! ```text
//!   card shown ─▶ each track near the reader: a share by its distance; the rest is "none of them"
//!       ●7a ──── ●                then the share goes with the track, and halves every minute
//!            ●●                   tracks that touch may have been swapped: their shares become alike
//!            ½ ½                  a track that is gone takes its share with it
//! ```
//!
//! Nothing of it is stored; it is shown with the first digits of the card's keyed hash.
//!
//! Source: Ota et al. 2006 (docs/bibliography.md, paper B): an ID observation leaves positions alone, and every ID
//! likelihood decays by a factor between observations (eq. 4).

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::terms::Card;
use crate::geometry::Point;

/// In so long a likelihood falls by half, s: half a minute later a person has been hidden among others.
const HALF_S: f64 = 60.0;

/// Two middles nearer than this may be swapped, m: two bodies, shoulder to shoulder.
const TOUCH_M: f64 = 0.5;

/// Tracks that touch for so long are alike by two thirds, s: the tracker tells passing walkers apart.
const MIX_S: f64 = 1.0;

/// Less likely is not worth telling, and then not worth keeping.
const TOLD: f64 = 0.05;
const KEPT: f64 = 0.01;

/// A track and a card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "DoorName")]
pub struct Name {
    /// The track.
    pub track: u64,
    /// The first digits of the card's hash.
    pub label: String,
    /// How likely they belong together, 0 to 1.
    pub likelihood: f64,
}

/// Likelihoods that are none.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("likelihoods of a card must be from 0 to 1, and together at most 1")]
pub struct NoLikelihoods;

/// All that are known: by card, by track.
#[derive(Clone, Debug, Default)]
pub struct Names {
    shares: BTreeMap<Card, BTreeMap<u64, f64>>,
    at_s: f64,
}

impl Names {
    /// Notes that a card was shown by one of these tracks, with these likelihoods; what is missing to 1: by none of
    /// them. It replaces what was known of the card before.
    ///
    /// # Errors
    /// They are no likelihoods; nothing has changed then.
    pub fn shown(&mut self, card: Card, likelihoods: &[(u64, f64)]) -> Result<(), NoLikelihoods> {
        let sum: f64 = likelihoods.iter().map(|(_, likelihood)| likelihood).sum();
        let each = likelihoods.iter().all(|(_, likelihood)| (0.0..=1.0).contains(likelihood));
        if !each || sum > 1.0 + 1e-9 {
            return Err(NoLikelihoods);
        }
        let mut shares = BTreeMap::new();
        for (track, likelihood) in likelihoods {
            *shares.entry(*track).or_default() += likelihood;
        }
        self.shares.insert(card, shares);
        Ok(())
    }

    /// Notes where all people are at `now_s`; a time before the last one counts as that.
    pub fn follow(&mut self, people: &[(u64, Point)], now_s: f64) {
        let passed_s = (now_s - self.at_s).max(0.0);
        self.at_s += passed_s;
        let left = libm::exp2(-passed_s / HALF_S);
        let mixed = 1.0 - libm::exp(-passed_s / MIX_S);
        for shares in self.shares.values_mut() {
            shares.values_mut().for_each(|share| *share *= left);
            for (index, (one, at)) in people.iter().enumerate() {
                for (other, _) in
                    people.iter().skip(index + 1).filter(|(_, there)| (*there - *at).length() < TOUCH_M)
                {
                    let of = |track| shares.get(track).copied().unwrap_or(0.0);
                    let over = 0.5 * mixed * (of(one) - of(other));
                    if over != 0.0 {
                        *shares.entry(*one).or_default() -= over;
                        *shares.entry(*other).or_default() += over;
                    }
                }
            }
            shares.retain(|track, share| *share >= KEPT && people.iter().any(|(id, _)| id == track));
        }
        self.shares.retain(|_, shares| !shares.is_empty());
    }

    /// What is worth telling, the likeliest first.
    #[must_use]
    pub fn told(&self) -> Vec<Name> {
        let of = |(card, shares): (&Card, &BTreeMap<u64, f64>)| {
            let label = card.label();
            let told = shares.iter().filter(|(_, share)| **share >= TOLD);
            told.map(|(track, share)| Name { track: *track, label: label.clone(), likelihood: *share })
                .collect::<Vec<_>>()
        };
        let mut all: Vec<Name> = self.shares.iter().flat_map(of).collect();
        all.sort_by(|one, other| other.likelihood.total_cmp(&one.likelihood));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALICE: Card = Card(0xa11c_e000_0000_0000_0000_0000_0000_0000);
    const BOB: Card = Card(0xb0b0_0000_0000_0000_0000_0000_0000_0000);

    fn known(names: &Names, label: &str, track: u64) -> f64 {
        let found = names.told().into_iter().find(|name| name.label == label && name.track == track);
        found.map_or(0.0, |name| name.likelihood)
    }

    /// Two people so far apart for so long, frame by frame, from `from_s` on.
    fn apart(names: &mut Names, apart_m: f64, from_s: f64, seconds: f64) {
        for frame in 1..=(seconds * 10.0) as u32 {
            let people = [(1, Point::default()), (2, Point::new(apart_m, 0.0))];
            names.follow(&people, from_s + f64::from(frame) * 0.1);
        }
    }

    #[test]
    fn a_name_stays_with_its_track_and_halves_in_a_minute() {
        let mut names = Names::default();
        names.shown(ALICE, &[(1, 0.8), (2, 0.1)]).unwrap();
        apart(&mut names, 0.6, 0.0, 60.0);
        let (right, wrong) = (known(&names, "a11c", 1), known(&names, "a11c", 2));
        assert!((right - 0.4).abs() < 1e-9 && (wrong - 0.05).abs() < 1e-6, "{right} {wrong}");
        // For ever halving, it is forgotten.
        apart(&mut names, 0.6, 60.0, 400.0);
        assert_eq!((names.told(), names.shares.len()), (vec![], 0));
    }

    #[test]
    fn who_touch_become_alike_and_nothing_is_lost() {
        let mut names = Names::default();
        names.shown(ALICE, &[(1, 0.9)]).unwrap();
        names.shown(BOB, &[(2, 0.9)]).unwrap();
        apart(&mut names, 0.4, 0.0, 0.3);
        assert!(known(&names, "a11c", 1) > 0.7, "in passing hardly anything: {:?}", names.told());
        apart(&mut names, 0.4, 0.3, 5.0);
        for label in ["a11c", "b0b0"] {
            let (one, other) = (known(&names, label, 1), known(&names, label, 2));
            assert!((one - other).abs() < 0.02, "{one} {other}");
            let left = 0.9 * libm::exp2(-5.3 / HALF_S);
            assert!((one + other - left).abs() < 1e-9, "{one} + {other} is not {left}");
        }
        // Apart again, the tracks stay alike until the card is shown again.
        apart(&mut names, 2.0, 5.3, 3.0);
        assert!(known(&names, "a11c", 1) < 0.5);
        names.shown(ALICE, &[(1, 0.9)]).unwrap();
        assert_eq!((known(&names, "a11c", 1), known(&names, "a11c", 2)), (0.9, 0.0));
        assert!(known(&names, "b0b0", 1) > 0.3, "another card's is as it was");
    }

    #[test]
    fn a_track_that_is_gone_takes_its_name_with_it() {
        let mut names = Names::default();
        names.shown(ALICE, &[(1, 0.9)]).unwrap();
        names.follow(&[(2, Point::default())], 0.1);
        names.follow(&[(1, Point::default()), (2, Point::new(3.0, 0.0))], 0.2);
        assert_eq!(names.told(), []);
    }

    #[test]
    fn what_is_no_likelihood_changes_nothing() {
        let mut names = Names::default();
        names.shown(ALICE, &[(1, 0.5)]).unwrap();
        for bad in [f64::NAN, f64::INFINITY, -0.1, 1.1, 0.6] {
            assert_eq!(names.shown(ALICE, &[(2, bad), (3, 0.5)]), Err(NoLikelihoods), "{bad}");
        }
        assert_eq!(names.told(), [Name { track: 1, label: "a11c".into(), likelihood: 0.5 }]);
        // Time that goes back brings nothing back.
        names.follow(&[(1, Point::default())], 60.0);
        names.follow(&[(1, Point::default())], 0.0);
        assert!((known(&names, "a11c", 1) - 0.25).abs() < 1e-9);
    }
}
