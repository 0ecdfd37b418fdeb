//! Runs a table, whatever it is made of.
//!
//! ```text
//!   Table ─▶ Work ─┬─ door areas ──▶ rows ─┐
//!                  ├─ trials ──────▶ pooled ├─▶ Results: lines of the full table, what every run gave, a picture
//!                  ├─ passages ────▶ pooled │
//!                  ├─ entrance ────▶ pooled │
//!                  ├─ lines ───────▶ pooled ┤
//!                  ├─ poses ───────▶ found ─┤
//!                  ├─ both ────────▶ rows ──┤
//!                  └─ floor ───────▶ found ─┘
//! ```

use std::error::Error;
use std::ops::RangeInclusive;

use crate::baselines::Choice;

use super::findings::{self, Pooled};
use super::jobs::Runs;
use super::line::{Line, Run};
use super::plan::{Table, Work};
use super::table::{self, Row};
use super::{both, entrance, floor, lines, passages, picture, poses, runner, silences, sources};
use crate::run::{Conditions, Options};

/// Results of a table.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// Every figure.
    pub lines: Vec<Line>,
    /// What every run gave, for its digest.
    pub runs: Vec<Run>,
    /// Every figure of every run as CSV; none for door areas.
    pub runs_csv: Option<Vec<u8>>,
    /// The rows of door areas, for their picture.
    pub rows: Vec<Row>,
}

impl Results {
    /// The picture of door areas, as SVG.
    #[must_use]
    pub fn picture(&self) -> String {
        picture::draw(&self.rows, "People counted right, by number of people").to_string()
    }

    fn of_poses(found: &poses::Found) -> Self {
        let runs_csv = Some(found.csv().into_bytes());
        Self { lines: found.lines(), runs: found.runs(), runs_csv, rows: Vec::new() }
    }

    fn of(pooled: &[Pooled]) -> Result<Self, Box<dyn Error>> {
        let mut runs_csv = Vec::new();
        findings::write_runs(pooled, &mut runs_csv)?;
        let (lines, runs) = (findings::lines(pooled), findings::runs(pooled));
        Ok(Self { lines, runs, runs_csv: Some(runs_csv), rows: Vec::new() })
    }
}

/// Runs a table; `trackers` and `seeds` replace its own unless they are empty.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run(
    table: Table,
    trackers: &[Choice],
    seeds: Option<&RangeInclusive<u64>>,
    conditions: Conditions,
    runs: &Runs,
) -> Result<Results, Box<dyn Error>> {
    let name = table.to_string();
    match table.work(trackers, seeds) {
        Work::Door(cases, seeds) => {
            let options = Options { conditions, ..Options::default() };
            let (rows, all) = runner::run(&name, &cases, &seeds, &options, runs)?;
            Ok(Results { lines: table::lines(&rows), runs: all, runs_csv: None, rows })
        }
        Work::Trials(trials) => Results::of(&runner::run_trials(&name, &trials, runs)?),
        Work::Passages(rows, seeds) => {
            let choice = trackers.first().copied().unwrap_or_default();
            Results::of(&passages::table(&name, &rows, &seeds, choice, runs)?)
        }
        Work::Entrance(seeds) => {
            let mut pooled = entrance::run(&seeds, runs)?;
            pooled.extend(sources::run(&seeds, runs)?);
            let mut results = Results::of(&pooled)?;
            results.lines.extend(entrance::paper(&results.lines));
            Ok(results)
        }
        Work::Lines(seeds) => {
            Results::of(&lines::run(&seeds, trackers.first().copied().unwrap_or_default(), runs)?)
        }
        Work::Poses(seeds) => Ok(Results::of_poses(&poses::run(&seeds, runs)?)),
        Work::FloorPoses(seeds) => Ok(Results::of_poses(&poses::floors(&seeds, runs)?)),
        Work::FloorAndModules(seeds) => {
            let (rows, all) = both::table(&seeds, runs)?;
            Ok(Results { lines: table::lines(&rows), runs: all, runs_csv: None, rows })
        }
        Work::Floor(seeds) => {
            let (found, silences) = (floor::run(&seeds, runs)?, silences::run(&seeds, runs)?);
            let lines = [found.lines(), findings::lines(&silences)].concat();
            let all = [found.runs(), findings::runs(&silences)].concat();
            Ok(Results { lines, runs: all, runs_csv: Some(found.csv().into_bytes()), rows: Vec::new() })
        }
    }
}
