//! Results of trials: figures pooled over the seeds.
//!
//! ```text
//! Pooled: trial, tracker ─ seed 10000: figures ─┬─▶ every figure of all of them: lines of the full table
//!                        ─ seed 10001: figures ─┤
//!                        …                      └─▶ the digest of each run
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;

use super::figure::{Figure, Finding};
use super::line::{Heading, Line, Run, six_digits, text};

/// The figures of one run with their names.
pub type Figures = Vec<(String, Figure)>;

/// Owned, as they are kept.
pub(super) fn owned(finding: Finding) -> Figures {
    finding.into_iter().map(|(name, figure)| (name.to_owned(), figure)).collect()
}

/// All runs of a trial with one tracker.
#[derive(Clone, Debug)]
pub struct Pooled {
    /// Name of the trial.
    pub trial: String,
    /// Name of the tracker.
    pub tracker: String,
    /// Run by run, by seed.
    pub runs: BTreeMap<u64, Figures>,
}

impl Pooled {
    /// The figures of all runs together.
    #[must_use]
    pub fn figures(&self) -> Figures {
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

/// The figures as lines of the full table.
#[must_use]
pub fn lines(all: &[Pooled]) -> Vec<Line> {
    let mut lines = Vec::new();
    for pooled in all {
        let seeds = pooled.runs.keys().next().copied().zip(pooled.runs.keys().next_back().copied());
        let heading = Heading {
            row: pooled.trial.clone(),
            tracker: pooled.tracker.clone(),
            seeds: seeds.unwrap_or_default(),
            runs: pooled.runs.len() as u64,
        };
        for (name, figure) in pooled.figures() {
            let (value, interval, of) = figure.numbers();
            let end = |end: Option<f64>| end.and_then(six_digits);
            let (low, high) = (end(interval.map(|ends| ends.0)), end(interval.map(|ends| ends.1)));
            lines.push(Line { low, high, of, ..heading.line(&name, Some(value), figure.words()) });
        }
    }
    lines
}

/// The figures of every run.
#[must_use]
pub fn runs(all: &[Pooled]) -> Vec<Run> {
    let of = |pooled: &Pooled| {
        let run = |(seed, figures): (&u64, &Figures)| Run {
            row: pooled.trial.clone(),
            tracker: pooled.tracker.clone(),
            seed: *seed,
            figures: text(figures.iter().map(|(name, figure)| {
                let (value, _, of) = figure.numbers();
                (name.as_str(), (of != Some(0)).then_some(value))
            })),
        };
        pooled.runs.iter().map(run).collect::<Vec<_>>()
    };
    all.iter().flat_map(of).collect()
}

/// Writes every figure of every run: which seeds fail.
///
/// # Errors
/// The error of the writer.
pub fn write_runs(all: &[Pooled], out: impl Write) -> Result<(), Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["trial", "tracker", "seed", "figure", "value"])?;
    for pooled in all {
        for (seed, finding) in &pooled.runs {
            for (name, figure) in finding {
                let value = figure.numbers().0.to_string();
                writer.write_record([&pooled.trial, &pooled.tracker, &seed.to_string(), name, &value])?;
            }
        }
    }
    Ok(writer.flush()?)
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
            (seed, owned(finding))
        };
        Pooled { trial: "hall".into(), tracker: "ours".into(), runs: (1..=4).map(run).collect() }
    }

    #[test]
    fn runs_are_pooled_by_their_kind() {
        let lines = lines(&[pooled()]);
        let printed: Vec<&str> = lines.iter().map(|line| line.printed.as_str()).collect();
        assert_eq!(printed, ["75 [30–95]", "2.5 [0.4–4.6]", "8", "1.00", "–"]);
        assert_eq!((lines[0].low, lines[0].of, lines[2].low), (Some(30.0642), Some(4), None));
        assert!(lines.iter().all(|line| (line.first_seed, line.last_seed, line.runs) == (1, 4, 4)));
    }

    #[test]
    fn every_run_has_all_its_figures() {
        let mut file = Vec::new();
        write_runs(&[pooled()], &mut file).unwrap();
        let file = String::from_utf8(file).unwrap();
        assert_eq!(file.lines().count(), 1 + 4 * 5);
        assert!(file.contains("\nhall,ours,3,\"right, % of runs\",0\n"), "{file}");
        let runs = runs(&[pooled()]);
        assert_eq!(runs.len(), 4);
        assert_eq!(runs[2].seed, 3);
        assert_eq!(
            runs[2].figures,
            "right, % of runs 0\nerror, cm 3\nlost 2\nworst 3\nvisitors found, % none\n"
        );
    }
}
