//! The likelihoods: for each ID a share of each track, the rest is *none of them* or *not known*.
//!
//! ```text
//!   shares of an ID   4: 0.93   7: 0.02   none: 0.01   the rest, 0.04, is not known: it may be any of them, or none
//!                        │ a sign            × ε + N(z; x, P + R) / N(z; z, R): 1 at the place, ε far from it
//!                        ▼
//!                     4: 0.99   7: 0.00 …
//! ```
//!
//! A sign is compared with where the tracks were at its own time: two seconds of them are kept. IDs know nothing of each
//! other, as in the paper: a person may carry two.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Matrix2;

use super::line::{Likelihood, NameLine, Whereabouts, zones_at};
use super::message::LATE_MS;
use super::person::{Person, agreement, swaps};
use super::sign::{NotTaken, Sign};
use crate::card::Card;
use crate::geometry::Point;
use crate::site::Site;
use crate::tracker::{TrackId, TrackState};

/// Tracks are remembered for so long, s: a sign may be that late.
const HISTORY_S: f64 = LATE_MS as f64 * 1e-3;

/// Most moments that are remembered: twenty of them, and some more after a stall.
const MOMENTS_MAX: usize = 32;

/// Between a sign and the nearest moment, at most, s: five frames; further, a walker is a stride away.
const GAP_S: f64 = 0.5;

/// Most tracks that can have a name: more than any site of ours follows at once. Those beyond have none.
const TRACKS_MAX: usize = 256;

/// Most IDs, and after so long without a sign one gives way to another, s.
const IDS_MAX: usize = 256;
const FORGOTTEN_S: f64 = 3600.0;

/// Most tracks that an ID has a share of.
const SHARES_MAX: usize = 16;

/// ε: one sign in a hundred is wrong, read far from its bearer. Two that agree overturn a certainty.
const WRONG: f64 = 0.01;

/// How likely a sign is where its bearer is no track at all, beside 1 at the place of its track: more than by error, so
/// that a tag that lies on a table takes its name off whom it was with.
const NONE: f64 = 0.05;

/// Share of what is known that each sign puts in doubt: tracks may have been swapped since the one before.
const DOUBT: f64 = 0.01;

/// In so long a likelihood falls by half, s: of five people crowded on 4 m² each is taken for another about once in
/// that time (docs/accuracy.md, condition H).
const HALF_S: f64 = 600.0;

/// That its bearer is none of the tracks is half forgotten in so long, s: a person walks into view.
const UNSEEN_HALF_S: f64 = 10.0;

/// Less likely is not worth telling, and then not worth keeping.
const TOLD: f64 = 0.05;
const KEPT: f64 = 0.002;

/// All tracks at one moment.
#[derive(Clone, Debug)]
struct Moment {
    at_s: f64,
    people: Vec<Person>,
}

/// What is known of an ID.
#[derive(Clone, Debug, Default)]
struct Known {
    heard_s: f64,
    /// The last place it was read at, and when.
    read: Option<(Point, f64)>,
    /// The likelihood of each track, and that of none of them; together at most 1. The rest is not known.
    shares: BTreeMap<TrackId, f64>,
    none: f64,
}

/// Which track is whom: signs and tracks in, names out.
#[derive(Clone, Debug, Default)]
pub struct Names {
    ids: BTreeMap<Card, Known>,
    /// Oldest first.
    moments: VecDeque<Moment>,
}

impl Names {
    /// Notes where all tracks are at `now_s`. A time that is not after the last one changes nothing.
    pub fn follow(&mut self, tracks: &[TrackState], now_s: f64) {
        let last_s = self.moments.back().map_or(f64::NEG_INFINITY, |moment| moment.at_s);
        // Neither is a time that is no number.
        if !(now_s > last_s && now_s.is_finite()) {
            return;
        }
        let passed_s = if last_s.is_finite() { now_s - last_s } else { 0.0 };
        let people: Vec<Person> = tracks.iter().filter_map(Person::of).take(TRACKS_MAX).collect();
        if !self.ids.is_empty() {
            let swaps = swaps(&people, passed_s);
            for known in self.ids.values_mut() {
                known.fade(&people, passed_s, &swaps);
            }
            self.ids.retain(|_, known| !known.shares.is_empty() || now_s - known.heard_s < FORGOTTEN_S);
        }
        let too_old = |moment: &Moment| now_s - moment.at_s > HISTORY_S;
        while self.moments.len() >= MOMENTS_MAX || self.moments.front().is_some_and(too_old) {
            self.moments.pop_front();
        }
        self.moments.push_back(Moment { at_s: now_s, people });
    }

    /// Takes a sign.
    ///
    /// # Errors
    /// Why it changes nothing.
    pub fn sign(&mut self, sign: &Sign) -> Result<(), NotTaken> {
        let place = sign.read.gaussian()?;
        let away_s = |moment: &Moment| (moment.at_s - sign.at_s).abs();
        let nearest = self.moments.iter().min_by(|one, other| away_s(one).total_cmp(&away_s(other)));
        let moment = nearest.filter(|moment| away_s(moment) <= GAP_S).ok_or(NotTaken::Untracked)?;
        if !self.ids.contains_key(&sign.card) && self.ids.len() >= IDS_MAX {
            let oldest = self.ids.iter().min_by(|one, other| one.1.heard_s.total_cmp(&other.1.heard_s));
            let gives_way = oldest.filter(|(_, known)| sign.at_s - known.heard_s > FORGOTTEN_S);
            let card = gives_way.map(|(card, _)| *card).ok_or(NotTaken::Full)?;
            self.ids.remove(&card);
        }
        let known = self.ids.entry(sign.card).or_default();
        known.heard_s = known.heard_s.max(sign.at_s);
        if let Some((at, spread)) = place {
            known.read = Some((at, sign.at_s));
            known.weigh(moment, sign.at_s, at, spread);
        }
        Ok(())
    }

    /// What is known of each ID at the newest moment.
    #[must_use]
    pub fn lines(&self, site: &Site) -> Vec<NameLine> {
        self.ids.iter().map(|(card, known)| self.line(*card, known, site).0).collect()
    }

    /// Where an ID is; none if it was not read within the last hour, and no track is known to be it.
    #[must_use]
    pub fn where_is(&self, card: Card, site: &Site) -> Option<Whereabouts> {
        let known = self.ids.get(&card)?;
        let (name, at) = self.line(card, known, site);
        Some(Whereabouts {
            at: at.map(centimetres),
            read: known.read.map(|(at, _)| centimetres(at)),
            read_s: known.read.map(|(_, at_s)| self.since_s(at_s)),
            name,
        })
    }

    /// What is known of an ID, and where its likeliest track is.
    fn line(&self, card: Card, known: &Known, site: &Site) -> (NameLine, Option<Point>) {
        let told = known.shares.iter().filter(|(_, share)| **share >= TOLD);
        let rounded = |(track, share): (&TrackId, &f64)| Likelihood {
            track: *track,
            probability: (share * 1e3).round() * 1e-3,
        };
        let mut tracks: Vec<Likelihood> = told.map(rounded).collect();
        tracks.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        let likeliest = tracks.first().map(|likelihood| likelihood.track);
        let mut people = self.moments.back().into_iter().flat_map(|moment| &moment.people);
        let at = people.find(|person| Some(person.track) == likeliest).map(|person| person.at);
        let zones = at.map(|at| zones_at(site, at)).unwrap_or_default();
        let heard_s = self.since_s(known.heard_s);
        (NameLine { card: Some(card), label: card.label(), heard_s, tracks, zones }, at)
    }

    /// Since a time, s, to the tenth.
    fn since_s(&self, at_s: f64) -> f64 {
        let now_s = self.moments.back().map_or(at_s, |moment| moment.at_s);
        ((now_s - at_s).max(0.0) * 10.0).round() * 0.1
    }
}

impl Known {
    /// A reading at `at` with the covariance `spread`, m².
    fn weigh(&mut self, moment: &Moment, at_s: f64, at: Point, spread: Matrix2<f64>) {
        let known = self.shares.values().sum::<f64>() + self.none;
        let unknown = (1.0 - known).max(0.0) * (1.0 - DOUBT) + DOUBT;
        let existing: f64 = moment.people.iter().map(|person| person.existence).sum();
        // What is not known is spread evenly: one part for each track that exists, and one for none of them.
        let part = unknown / (existing + 1.0);
        // A track that was not there at that time has nothing that speaks for it.
        let mut shares: BTreeMap<TrackId, f64> =
            self.shares.iter().map(|(track, share)| (*track, share * (1.0 - DOUBT) * WRONG)).collect();
        for person in &moment.people {
            let before = self.shares.get(&person.track).copied().unwrap_or(0.0);
            let there = person.at + person.velocity * (at_s - moment.at_s);
            let prior = before * (1.0 - DOUBT) + part * person.existence;
            let agreement = agreement(at - there, person.covariance, spread);
            shares.insert(person.track, prior * (WRONG + (1.0 - WRONG) * agreement));
        }
        let none = (self.none * (1.0 - DOUBT) + part) * NONE;
        let sum = shares.values().sum::<f64>() + none;
        shares.values_mut().for_each(|share| *share /= sum);
        (self.shares, self.none) = (shares, none / sum);
        self.trim();
    }

    /// Time passes: what is known fades, swaps what may have been swapped, and loses tracks that are gone.
    fn fade(&mut self, people: &[Person], passed_s: f64, swaps: &[(usize, usize, f64)]) {
        self.none *= libm::exp2(-passed_s / UNSEEN_HALF_S);
        let left = libm::exp2(-passed_s / HALF_S);
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

fn centimetres(at: Point) -> [f64; 2] {
    [at.x, at.y].map(|metres| (metres * 100.0).round() * 0.01)
}
