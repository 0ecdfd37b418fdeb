//! A figure of an experiment: of one run, or pooled over the runs of many seeds.
//!
//! ```text
//!   Share 1 of 1 + Share 0 of 1 + …  ─▶ 99.5 [97–100]     Wilson's interval at 95 %
//!   Mean [3.4]   + Mean [3.6]   + …  ─▶ 3.5 [3.4–3.6]     Student's
//!   Median [0.1] + Median [0.3] + … ─▶ 0.20               of all values together
//!   Sum, Hours, Least, Most          ─▶ without an interval
//! ```

use serde::{Deserialize, Serialize};

use super::line::percent;
use crate::score::statistics::{mean, wilson};

/// The figures of one run with their names, in the order of the table.
pub type Finding = Vec<(&'static str, Figure)>;

/// A figure, of one run or of many.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// The median of all values of all runs.
    Median(Vec<f64>),
    /// The smallest of all.
    Least(f64),
    /// The largest of all.
    Most(f64),
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

    /// Adds the figure of another run; a figure of another kind is ignored.
    pub(super) fn add(&mut self, other: &Self) {
        match (self, other) {
            (Self::Share { yes, of }, Self::Share { yes: more, of: all }) => {
                *yes += more;
                *of += all;
            }
            (Self::Mean { values, .. }, Self::Mean { values: more, .. })
            | (Self::Median(values), Self::Median(more)) => values.extend(more),
            (Self::Least(least), Self::Least(other)) => *least = least.min(*other),
            (Self::Most(most), Self::Most(other)) => *most = most.max(*other),
            (Self::Sum(sum), Self::Sum(more)) | (Self::Hours(sum), Self::Hours(more)) => *sum += more,
            _ => {}
        }
    }

    /// Value, interval, and of how many.
    pub(super) fn numbers(&self) -> (f64, Option<(f64, f64)>, Option<u64>) {
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
            Self::Median(values) => {
                let mut sorted = values.clone();
                sorted.sort_by(f64::total_cmp);
                let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN);
                (median, None, Some(values.len() as u64))
            }
            Self::Least(value) | Self::Most(value) | Self::Sum(value) | Self::Hours(value) => {
                (*value, None, None)
            }
        }
    }

    pub(super) fn words(&self) -> String {
        let (value, interval, of) = self.numbers();
        match (self, interval) {
            (Self::Share { yes, of }, _) if *of > 0 => percent(*yes, *of),
            _ if of == Some(0) => "–".into(),
            (Self::Mean { digits, .. }, Some((low, high))) => {
                format!("{value:.digits$} [{low:.digits$}–{high:.digits$}]")
            }
            (Self::Mean { digits, .. }, None) => format!("{value:.digits$}"),
            (Self::Least(_) | Self::Most(_) | Self::Median(_), _) => format!("{value:.2}"),
            (Self::Hours(_), _) => format!("{value:.1}"),
            _ => format!("{value:.0}"),
        }
    }
}
