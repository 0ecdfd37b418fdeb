//! Whether a probability that is said is how often it comes true: reliability, the Brier score and its parts.
//!
//! ```text
//!   a moment: P(0) P(1) … P(K) said, n people there ─▶ K + 1 questions "are there k?", each with what was said of it
//!
//!   bins of what was said   f̄ said in the mean, ō true       Brier    mean over moments of  Σ (said − true)²
//!   0 ···· 0.5 ·· 0.9 · 1                                  = reliability   Σ w (f̄ − ō)²     0 is best
//!                                                          − resolution    Σ w (ō − base)²  much is best
//!                                                          + uncertainty   of who holds all K + 1 equally likely
//!                                                          + within bins   what bins are too wide for, about 0
//! ```
//!
//! Moments of one run are alike, so a bin's interval is Wilson's with its questions divided by their design effect: the variance of
//! the bin's share over runs, by that of as many independent questions.
//!
//! Source: Brier 1950; Murphy 1973 (parts); Kish 1965 (design effect, ratio of clusters).

use std::collections::BTreeMap;

use super::statistics::{Interval, wilson};

/// Ends of the bins of what is said; the last holds 1, too. Fine where a door decides, at 0.95.
pub const EDGES: [f64; 13] = [0.0, 0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98, 0.99, 1.0];

/// What was said of a count at one moment, and what is true.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment<'a> {
    /// Number of its run: moments of a run are alike.
    pub run: usize,
    /// Probability of no person, of one, of two, …
    pub p: &'a [f64],
    /// How many are there.
    pub people: usize,
}

/// All questions of which so much was said.
#[derive(Clone, Debug, PartialEq)]
pub struct Bin {
    /// From so much on.
    pub from: f64,
    /// Up to so much.
    pub to: f64,
    /// How many.
    pub questions: u64,
    /// What was said in the mean.
    pub said: f64,
    /// Of how many it was true.
    pub hits: u64,
    /// So many independent questions would tell as much.
    pub effective: f64,
}

impl Bin {
    /// How often it was true.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.hits as f64 / self.questions.max(1) as f64
    }

    /// Wilson's interval of it, of as many questions as are independent.
    #[must_use]
    pub fn interval(&self) -> Interval {
        let trials = self.effective.round().max(1.0);
        // Half a hit is lost at most.
        wilson((self.share() * trials).round() as u64, trials as u64)
    }
}

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    /// Those that hold anything.
    pub bins: Vec<Bin>,
    /// How many moments.
    pub moments: usize,
    /// Share of moments at which the likeliest number was the true one.
    pub right: f64,
    /// What was said of the likeliest number in the mean.
    pub sure: f64,
    /// Mean over moments of the squares over all numbers, 0 to 2.
    pub brier: f64,
    /// How far what is said is from how often it is true: 0 is best.
    pub reliability: f64,
    /// How far how often it is true is from equally often: much is best.
    pub resolution: f64,
    /// The score of who holds all numbers equally likely.
    pub uncertainty: f64,
}

/// The questions of a bin, run by run.
#[derive(Clone, Debug, Default)]
struct Questions {
    said: f64,
    by_run: BTreeMap<usize, (u64, u64)>,
}

impl Questions {
    fn totals(&self) -> (u64, u64) {
        self.by_run.values().fold((0, 0), |sum, run| (sum.0 + run.0, sum.1 + run.1))
    }

    /// So many independent questions would tell as much. Where none or all are true, as many as there are runs.
    fn effective(&self) -> f64 {
        let (questions, hits) = self.totals();
        let (number, runs) = (questions as f64, self.by_run.len() as f64);
        if hits == 0 || hits == questions || runs < 2.0 {
            return runs;
        }
        let share = hits as f64 / number;
        let off = |(questions, hits): &(u64, u64)| (*hits as f64 - share * *questions as f64).powi(2);
        let variance = self.by_run.values().map(off).sum::<f64>() * runs / (runs - 1.0) / (number * number);
        let alone = share * (1.0 - share) / number;
        number / (variance / alone).max(1.0)
    }
}

impl Reliability {
    /// Of these moments, each with the numbers from 0 to `most` asked for. None without moments.
    #[must_use]
    pub fn of<'a>(moments: impl IntoIterator<Item = Moment<'a>>, most: usize) -> Option<Self> {
        let mut all = vec![Questions::default(); EDGES.len() - 1];
        let (mut number, mut right, mut sure, mut squares) = (0_usize, 0_usize, 0.0, 0.0);
        for Moment { run, p, people } in moments {
            number += 1;
            let said = |count: usize| p.get(count).copied().unwrap_or(0.0);
            // Of equal ones the lowest.
            let best = (0..p.len().max(1)).rev().max_by(|one, other| said(*one).total_cmp(&said(*other)));
            let best = best.unwrap_or(0);
            right += usize::from(best == people);
            sure += said(best);
            for count in 0..=most {
                let (said, is_true) = (said(count), count == people);
                squares += (said - f64::from(u8::from(is_true))).powi(2);
                let bin = &mut all[bin(said)];
                bin.said += said;
                let counts = bin.by_run.entry(run).or_default();
                *counts = (counts.0 + 1, counts.1 + u64::from(is_true));
            }
        }
        if number == 0 {
            return None;
        }
        let bins = all.iter().zip(EDGES.windows(2)).filter_map(|(bin, ends)| {
            let (questions, hits) = bin.totals();
            let said = bin.said / questions.max(1) as f64;
            let &[from, to] = ends else { return None };
            (questions > 0).then(|| Bin { from, to, questions, said, hits, effective: bin.effective() })
        });
        let bins: Vec<Bin> = bins.collect();
        let base = 1.0 / (most + 1) as f64;
        let over = |of: &dyn Fn(&Bin) -> f64| {
            bins.iter().map(|bin| bin.questions as f64 * of(bin).powi(2)).sum::<f64>() / number as f64
        };
        Some(Self {
            moments: number,
            right: right as f64 / number as f64,
            sure: sure / number as f64,
            brier: squares / number as f64,
            reliability: over(&|bin| bin.said - bin.share()),
            resolution: over(&|bin| bin.share() - base),
            uncertainty: 1.0 - base,
            bins,
        })
    }

    /// What the parts leave of the score: bins are not infinitely narrow.
    #[must_use]
    pub fn within_bins(&self) -> f64 {
        self.brier - (self.reliability - self.resolution + self.uncertainty)
    }
}

/// The bin of what is said.
fn bin(said: f64) -> usize {
    EDGES[1..EDGES.len() - 1].iter().filter(|edge| said >= **edge).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(moments: &[(usize, &[f64], usize)], most: usize) -> Reliability {
        Reliability::of(moments.iter().map(|&(run, p, people)| Moment { run, p, people }), most).unwrap()
    }

    #[test]
    fn who_is_always_sure_and_right_scores_nothing() {
        let found = of(&[(0, &[0.0, 1.0], 1), (1, &[1.0], 0)], 3);
        assert_eq!((found.brier, found.reliability, found.right, found.sure), (0.0, 0.0, 1.0, 1.0));
        assert!((found.resolution - found.uncertainty).abs() < 1e-12 && found.within_bins().abs() < 1e-12);
    }

    #[test]
    fn who_says_all_numbers_are_equally_likely_scores_the_uncertainty() {
        let even: &[f64] = &[0.25; 4];
        let found = of(&[(0, even, 0), (1, even, 1), (2, even, 2), (3, even, 3)], 3);
        assert!((found.brier - 0.75).abs() < 1e-12 && (found.uncertainty - 0.75).abs() < 1e-12);
        assert!(found.reliability.abs() < 1e-12 && found.resolution.abs() < 1e-12);
    }

    #[test]
    fn too_sure_is_seen_in_the_bin_and_in_the_score() {
        // 0.96 is said ten times, five times true.
        let p: &[f64] = &[0.04, 0.96];
        let moments: Vec<(usize, &[f64], usize)> = (0..10).map(|run| (run, p, run % 2)).collect();
        let found = of(&moments, 1);
        let bin = found.bins.last().unwrap();
        assert_eq!((bin.from, bin.questions, bin.hits, bin.share()), (0.95, 10, 5, 0.5));
        assert!(bin.interval().low < 0.5 && bin.interval().high < 0.95, "{bin:?}");
        assert!((found.reliability - 2.0 * 0.46 * 0.46).abs() < 1e-12 && found.within_bins().abs() < 1e-12);
    }

    #[test]
    fn moments_of_one_run_say_hardly_more_than_one() {
        let p: &[f64] = &[0.3, 0.7];
        let alike: Vec<(usize, &[f64], usize)> =
            (0..40).map(|moment| (moment / 10, p, moment / 10 % 2)).collect();
        let apart: Vec<(usize, &[f64], usize)> = (0..40).map(|moment| (moment, p, moment % 2)).collect();
        let effective = |moments| of(moments, 1).bins.last().unwrap().effective;
        assert!(effective(&alike) < 4.1 && effective(&apart) > 38.0, "{}", effective(&apart));
    }

    #[test]
    fn one_is_in_the_last_bin_and_no_moment_is_no_score() {
        assert_eq!((bin(1.0), bin(0.95), bin(0.0)), (EDGES.len() - 2, 9, 0));
        assert_eq!(Reliability::of([], 3), None);
    }
}
