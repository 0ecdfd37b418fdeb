//! What came of trials: figures pooled over the seeds, as CSV and as Markdown.
//!
//! ```text
//! trial,tracker,figure,value,low,high,of                  one figure a line, low and high at 95 %
//!
//! | trial          | tracker | runs | right, % of runs | …       one row a trial and tracker
//! | back of a chair| kehai   | 200  | 96 [92–98]       | …
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write;

use super::rules::Finding;
use super::table::{escaped, percent};
use crate::score::statistics::{mean, wilson};

/// A figure, of one run or of many.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// In so many of so many cases: printed in %, with Wilson's interval.
    Share {
        /// Cases that are.
        yes: u64,
        /// All cases.
        of: u64,
    },
    /// The mean of a value of each run, with Student's interval.
    Mean {
        /// The values.
        values: Vec<f64>,
        /// Digits that are printed behind the point.
        digits: usize,
        /// Whether the values are shares in %, and so between 0 and 100.
        shares: bool,
    },
    /// The smallest of all.
    Least(f64),
    /// A whole number, summed.
    Sum(f64),
    /// Simulated hours, summed.
    Hours(f64),
}

impl Figure {
    /// Whether one run is so.
    #[must_use]
    pub const fn of(yes: bool) -> Self {
        Self::Share { yes: yes as u64, of: 1 }
    }

    /// The value of one run.
    #[must_use]
    pub fn mean(value: f64, digits: usize) -> Self {
        Self::Mean { values: vec![value], digits, shares: false }
    }

    /// The share of one run's time, %.
    #[must_use]
    pub fn time(percent: f64, digits: usize) -> Self {
        Self::Mean { values: vec![percent], digits, shares: true }
    }

    /// Adds another run's; what is of another kind is left out.
    fn add(&mut self, other: &Self) {
        match (self, other) {
            (Self::Share { yes, of }, Self::Share { yes: more, of: all }) => {
                *yes += more;
                *of += all;
            }
            (Self::Mean { values, .. }, Self::Mean { values: more, .. }) => values.extend(more),
            (Self::Least(least), Self::Least(other)) => *least = least.min(*other),
            (Self::Sum(sum), Self::Sum(more)) | (Self::Hours(sum), Self::Hours(more)) => *sum += more,
            _ => {}
        }
    }

    /// Value, interval, and of how many.
    fn numbers(&self) -> (f64, Option<(f64, f64)>, Option<u64>) {
        match self {
            Self::Share { yes, of } => {
                let interval = wilson(*yes, *of);
                let share = 100.0 * *yes as f64 / (*of).max(1) as f64;
                (share, Some((100.0 * interval.low, 100.0 * interval.high)), Some(*of))
            }
            Self::Mean { values, shares, .. } => {
                let Some(mean) = mean(values) else { return (f64::NAN, None, Some(0)) };
                let (least, most) = if *shares { (0.0, 100.0) } else { (f64::NEG_INFINITY, f64::INFINITY) };
                let interval = (mean.interval.low.max(least), mean.interval.high.min(most));
                let finite = interval.0.is_finite() && interval.1.is_finite();
                (mean.mean, finite.then_some(interval), Some(mean.number as u64))
            }
            Self::Least(value) | Self::Sum(value) | Self::Hours(value) => (*value, None, None),
        }
    }

    fn words(&self) -> String {
        let (value, interval, of) = self.numbers();
        match (self, interval) {
            (Self::Share { yes, of }, _) if *of > 0 => percent(*yes, *of),
            _ if of == Some(0) => "–".into(),
            (Self::Mean { digits, .. }, Some((low, high))) => {
                format!("{value:.digits$} [{low:.digits$}–{high:.digits$}]")
            }
            (Self::Mean { digits, .. }, None) => format!("{value:.digits$}"),
            (Self::Least(_), _) => format!("{value:.2}"),
            (Self::Hours(_), _) => format!("{value:.1}"),
            _ => format!("{value:.0}"),
        }
    }
}

/// All runs of a trial with one tracker.
#[derive(Clone, Debug)]
pub struct Pooled {
    /// Name of the trial.
    pub trial: String,
    /// Name of the tracker.
    pub tracker: String,
    /// Run by run, by seed.
    pub runs: BTreeMap<u64, Finding>,
}

impl Pooled {
    /// The figures of all runs together.
    #[must_use]
    pub fn figures(&self) -> Finding {
        let mut runs = self.runs.values();
        let mut all = runs.next().cloned().unwrap_or_default();
        for run in runs {
            for ((_, figure), (_, more)) in all.iter_mut().zip(run) {
                figure.add(more);
            }
        }
        all
    }
}

/// Writes the figures as CSV.
///
/// # Errors
/// What the writer says.
pub fn write_csv(all: &[Pooled], out: impl Write) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["trial", "tracker", "figure", "value", "low", "high", "of"])?;
    for pooled in all {
        for (name, figure) in pooled.figures() {
            let (value, interval, of) = figure.numbers();
            let end = |end: Option<f64>| end.map(|end| end.to_string()).unwrap_or_default();
            writer.write_record([
                &pooled.trial,
                &pooled.tracker,
                name,
                &value.to_string(),
                &end(interval.map(|interval| interval.0)),
                &end(interval.map(|interval| interval.1)),
                &of.map(|of| of.to_string()).unwrap_or_default(),
            ])?;
        }
    }
    Ok(writer.flush()?)
}

/// Writes every figure of every run: which seeds fail.
///
/// # Errors
/// What the writer says.
pub fn write_runs(all: &[Pooled], out: impl Write) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["trial", "tracker", "seed", "figure", "value"])?;
    for pooled in all {
        for (seed, finding) in &pooled.runs {
            for (name, figure) in finding {
                let value = figure.numbers().0.to_string();
                writer.write_record([&pooled.trial, &pooled.tracker, &seed.to_string(), *name, &value])?;
            }
        }
    }
    Ok(writer.flush()?)
}

/// A table: a row for each trial and tracker, a column for each figure.
#[must_use]
pub fn markdown(all: &[Pooled]) -> String {
    let mut text = String::new();
    let mut heading: Vec<&str> = Vec::new();
    for pooled in all {
        let figures = pooled.figures();
        let names: Vec<&str> = figures.iter().map(|(name, _)| *name).collect();
        if names != heading {
            let _ = writeln!(text, "| | tracker | runs | {} |", names.join(" | "));
            let _ = writeln!(text, "|---|---|{}", "--:|".repeat(names.len() + 1));
            heading = names;
        }
        let words: Vec<String> = figures.iter().map(|(_, figure)| figure.words()).collect();
        let (trial, tracker, runs) = (escaped(&pooled.trial), escaped(&pooled.tracker), pooled.runs.len());
        let _ = writeln!(text, "| {trial} | {tracker} | {runs} | {} |", words.join(" | "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pooled() -> Pooled {
        let run = |seed: u64| {
            let finding = vec![
                ("right, % of runs", Figure::of(seed != 3)),
                ("error, cm", Figure::mean(seed as f64, 1)),
                ("lost", Figure::Sum(2.0)),
                ("worst", Figure::Least(seed as f64)),
                ("visitors found, %", Figure::Share { yes: 0, of: 0 }),
            ];
            (seed, finding)
        };
        Pooled { trial: "hall".into(), tracker: "a|b".into(), runs: (1..=4).map(run).collect() }
    }

    #[test]
    fn runs_are_pooled_by_their_kind() {
        let text = markdown(&[pooled()]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "| | tracker | runs | right, % of runs | error, cm | lost | worst | visitors found, % |",
                "|---|---|--:|--:|--:|--:|--:|--:|",
                "| hall | a\\|b | 4 | 75 [30–95] | 2.5 [0.4–4.6] | 8 | 1.00 | – |",
            ]
        );
    }

    #[test]
    fn files_hold_every_figure_and_every_run() {
        let (mut figures, mut runs) = (Vec::new(), Vec::new());
        write_csv(&[pooled()], &mut figures).unwrap();
        write_runs(&[pooled()], &mut runs).unwrap();
        let (figures, runs) = (String::from_utf8(figures).unwrap(), String::from_utf8(runs).unwrap());
        assert!(figures.contains("\nhall,a|b,\"right, % of runs\",75,30.06"), "{figures}");
        assert!(figures.contains("\nhall,a|b,lost,8,,,\n"), "{figures}");
        assert_eq!(runs.lines().count(), 1 + 4 * 5);
        assert!(runs.contains("\nhall,a|b,3,\"right, % of runs\",0\n"), "{runs}");
    }
}
