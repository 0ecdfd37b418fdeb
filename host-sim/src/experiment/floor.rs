//! Paper B's experiments with each tracker: lines of the full table beside the paper's own figures.
//!
//! ```text
//!   experiment × tracker × seed ─▶ floor::trial ─▶ variance across the way, right, swapped, back within a second
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

use super::jobs::Runs;
use super::line::{Heading, Line, Run, text};
use super::paper::{PAPER_B_MM2, PAPER_B_NAME};
use crate::floor::scene::Experiment;
use crate::floor::trial::{self, Figures, Method};
use crate::score::statistics::median;

/// What the paper gives no figures of.
const SHARES: [&str; 3] = [
    "right name within 0.5 m, % of the time",
    "swapped, % of the time",
    "right within 1 s after a silence, %",
];

/// Every run of each experiment and tracker.
#[derive(Clone, Debug, Default)]
pub struct Found(BTreeMap<(Experiment, Method), Vec<(u64, Figures)>>);

/// Every experiment with every tracker and these seeds.
///
/// # Errors
/// The kept file cannot be written.
pub fn run(seeds: &RangeInclusive<u64>, runs: &Runs) -> Result<Found, Box<dyn Error>> {
    let jobs: Vec<((Experiment, Method), u64)> = Experiment::ALL
        .into_iter()
        .flat_map(|experiment| Method::NAMED.map(|(method, _)| (experiment, method)))
        .flat_map(|job| seeds.clone().map(move |seed| (job, seed)))
        .collect();
    let results = runs
        .results("floor", &jobs, |((experiment, method), seed)| Ok(trial::run(experiment, method, seed)))?;
    let mut found = Found::default();
    for ((job, seed), figures) in results {
        found.0.entry(job).or_default().push((seed, figures));
    }
    Ok(found)
}

impl Found {
    /// The lines of the full table.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        for experiment in Experiment::ALL {
            let row = experiment.to_string();
            for (method, name) in Method::NAMED {
                if let Some(runs) = self.0.get(&(experiment, method)) {
                    lines.extend(figures(&row, name, runs));
                }
            }
            let paper = PAPER_B_MM2.iter().find(|(name, _)| *name == row);
            if let Some((_, variances)) = paper {
                let heading =
                    Heading { row, tracker: PAPER_B_NAME.to_owned(), runs: 1, ..Heading::default() };
                let seeds = self.0.values().flatten().map(|(seed, _)| *seed);
                let first = seeds.clone().min().unwrap_or(0);
                let heading = Heading { seeds: (first, seeds.max().unwrap_or(0)), ..heading };
                lines.extend(variance_lines(&heading, [Some(variances[0]), Some(variances[1])]));
                lines.extend(SHARES.map(|figure| heading.line(figure, None, "–".into())));
            }
        }
        lines
    }

    /// What every run gave.
    #[must_use]
    pub fn runs(&self) -> Vec<Run> {
        let mut all = Vec::new();
        for ((experiment, method), runs) in &self.0 {
            for (seed, figures) in runs {
                let Figures { across_mm2: [one, other], judged, right, swapped, times, back } = *figures;
                let counts = [judged, right, swapped, times, back].map(|count| Some(count as f64));
                let values = [one, other].into_iter().chain(counts);
                let figures = text(values.map(|value| ("", value)));
                let row = experiment.to_string();
                all.push(Run { row, tracker: named(*method).to_owned(), seed: *seed, figures });
            }
        }
        all
    }

    /// Every run, a line each.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from(
            "experiment,tracker,seed,variance_1_mm2,variance_2_mm2,judged,right,swapped,times,back\n",
        );
        for ((experiment, method), runs) in &self.0 {
            for (seed, figures) in runs {
                let Figures { across_mm2, judged, right, swapped, times, back } = figures;
                let [one, other] =
                    across_mm2.map(|value| value.map_or(String::new(), |value| format!("{value:.0}")));
                let name = named(*method);
                let _ = writeln!(
                    text,
                    "{experiment},{name},{seed},{one},{other},{judged},{right},{swapped},{times},{back}"
                );
            }
        }
        text
    }
}

fn named(method: Method) -> &'static str {
    Method::NAMED.iter().find(|(known, _)| *known == method).map_or("", |(_, name)| name)
}

/// The figures of one tracker in one experiment.
fn figures(row: &str, tracker: &str, runs: &[(u64, Figures)]) -> Vec<Line> {
    let seeds = || runs.iter().map(|(seed, _)| *seed);
    let heading = Heading {
        row: row.to_owned(),
        tracker: tracker.to_owned(),
        seeds: (seeds().min().unwrap_or(0), seeds().max().unwrap_or(0)),
        runs: runs.len() as u64,
    };
    let of = |index: usize| {
        let all: Vec<f64> = runs.iter().filter_map(|(_, run)| run.across_mm2[index]).collect();
        median(&all)
    };
    let sum = |count: fn(&Figures) -> u64| runs.iter().map(|(_, run)| count(run)).sum::<u64>();
    let judged = sum(|run| run.judged);
    let percent = |figure: &str, count: u64, of: u64| {
        let share = (of > 0).then(|| 100.0 * count as f64 / of as f64);
        heading.line(figure, share, share.map_or("–".into(), |share| format!("{share:.1}")))
    };
    let mut lines = variance_lines(&heading, [of(0), of(1)]);
    let shares = [
        (sum(|run| run.right), judged),
        (sum(|run| run.swapped), judged),
        (sum(|run| run.back), sum(|run| run.times)),
    ];
    lines.extend(SHARES.into_iter().zip(shares).map(|(figure, (count, of))| percent(figure, count, of)));
    lines
}

fn variance_lines(heading: &Heading, variances: [Option<f64>; 2]) -> Vec<Line> {
    let words = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.0}"));
    let line = |figure: &str, value| heading.line(figure, value, words(value));
    vec![
        line("variance across the way, first: median, mm²", variances[0]),
        line("second: median, mm²", variances[1]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_experiment_has_a_row_of_each_tracker_and_the_papers_own() {
        let found = run(&(3..=3), &Runs::default()).unwrap();
        let lines = found.lines();
        let rows = |tracker: &str| {
            let own =
                lines.iter().filter(|line| line.tracker == tracker && line.figure.starts_with("variance"));
            own.map(|line| line.row.as_str()).collect::<Vec<_>>()
        };
        let all = ["B1 parallel", "B2 crossing", "B3 square"];
        for (_, name) in Method::NAMED {
            assert_eq!(rows(name), all, "{name}");
        }
        assert_eq!(rows(PAPER_B_NAME), all[..2]);
        assert_eq!(found.runs().len(), 9);
        assert_eq!(found.csv().lines().count(), 10);
    }
}
