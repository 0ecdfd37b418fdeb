//! Results of all poses: lines of the full table, and every run as CSV.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::super::line::{Heading, Line, Run, text};
use crate::score::statistics::{median, p95};

/// What poses were found from.
const FROM_WALK: &str = "the walk";
const FROM_BOTH: &str = "walk and backgrounds";

/// Where no module was touched.
const NOTHING: &str = "nothing happens";

/// How far one module's pose is from the truth, and within which bounds it was said to be with 95 %.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Error {
    /// m
    pub metres: f64,
    /// rad
    pub radians: f64,
    /// m
    pub bound_m: f64,
    /// rad
    pub bound_rad: f64,
}

/// What was placed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
pub enum Of {
    /// Modules.
    #[default]
    Modules,
    /// A floor.
    Floor,
}

/// Poses found in one run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Placing {
    /// The scene.
    pub scene: String,
    /// What was placed in it.
    pub of: Of,
    /// How many modules and floors.
    pub modules: usize,
    /// How long was walked, s.
    pub walked_s: f64,
    /// From the walk alone, all modules but the first, or the floor; None: refused.
    pub by_walk: Option<Vec<Error>>,
    /// From the walk and the backgrounds.
    pub by_both: Option<Vec<Error>>,
    /// Why not.
    pub refusal: Option<String>,
    /// Whether a walk that ends too early is refused, and the module or the floor named.
    pub short: bool,
}

/// One run with a possible fault of a module.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Watching {
    /// The scene.
    pub scene: String,
    /// The fault of a module.
    pub what: Option<String>,
    /// Time from the fault until the module was named, s.
    pub named_s: Option<f64>,
    /// A false report, if any.
    pub wrong: Option<String>,
}

/// Everything, with the seeds.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Poses.
    pub placings: Vec<(u64, Placing)>,
    /// Watches.
    pub watchings: Vec<(u64, Watching)>,
}

/// A row of watched devices: whether nothing was done to them, the scene, and what was done.
type WatchedRow<'a> = (bool, &'a str, &'a str);

impl Found {
    /// The lines of the full table.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        let mut rooms: BTreeMap<(Of, &str), Vec<(u64, &Placing)>> = BTreeMap::new();
        for (seed, placing) in &self.placings {
            rooms.entry((placing.of, &placing.scene)).or_default().push((*seed, placing));
        }
        for runs in rooms.values() {
            lines.extend(placed(runs, FROM_WALK, |placing| placing.by_walk.as_deref()));
            lines.extend(placed(runs, FROM_BOTH, |placing| placing.by_both.as_deref()));
        }
        let mut groups: BTreeMap<WatchedRow<'_>, Vec<(u64, &Watching)>> = BTreeMap::new();
        for (seed, watching) in &self.watchings {
            let what = watching.what.as_deref().unwrap_or(NOTHING);
            groups
                .entry((watching.what.is_none(), &watching.scene, what))
                .or_default()
                .push((*seed, watching));
        }
        for ((quiet, scene, what), runs) in groups {
            lines.extend(watched(scene, what, quiet, &runs));
        }
        lines
    }

    /// What every run gave.
    #[must_use]
    pub fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for (seed, placing) in &self.placings {
            for (from, errors) in [(FROM_WALK, &placing.by_walk), (FROM_BOTH, &placing.by_both)] {
                let errors = errors.iter().flatten();
                let errors =
                    errors.flat_map(|error| [error.metres, error.radians, error.bound_m, error.bound_rad]);
                let own = [placing.walked_s, f64::from(u8::from(placing.short))].into_iter().chain(errors);
                let figures = text(own.map(|value| ("", Some(value))));
                runs.push(Run { row: room(placing), tracker: from.to_owned(), seed: *seed, figures });
            }
        }
        for (seed, watching) in &self.watchings {
            let tracker = watching.what.clone().unwrap_or_else(|| NOTHING.to_owned());
            let wrong = watching.wrong.is_some();
            let figures = [("named", watching.named_s), ("wrong", Some(f64::from(u8::from(wrong))))];
            let figures = text(figures.into_iter());
            runs.push(Run { row: watching.scene.clone(), tracker, seed: *seed, figures });
        }
        runs
    }

    /// Every run, a line each.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text =
            String::from("scene,seed,what,walked_s,refusal,metres,degrees,bound_m,bound_degrees,source\n");
        for (seed, placing) in &self.placings {
            let sources = [("walk", &placing.by_walk), ("both", &placing.by_both)];
            for (source, errors) in sources {
                for error in errors.iter().flatten() {
                    let _ = writeln!(
                        text,
                        "{},{seed},placing,{:.0},,{:.4},{:.3},{:.4},{:.3},{source}",
                        placing.scene,
                        placing.walked_s,
                        error.metres,
                        error.radians.to_degrees(),
                        error.bound_m,
                        error.bound_rad.to_degrees(),
                    );
                }
            }
            if let Some(refusal) = &placing.refusal {
                let _ = writeln!(
                    text,
                    "{},{seed},refused,{:.0},\"{refusal}\",,,,,",
                    placing.scene, placing.walked_s
                );
            }
        }
        for (seed, watching) in &self.watchings {
            let what = watching.what.as_deref().unwrap_or("nothing");
            let named = watching.named_s.map_or(String::new(), |named_s| format!("{named_s:.1}"));
            let wrong = watching.wrong.as_deref().unwrap_or("");
            let _ = writeln!(text, "{},{seed},{what},{named},\"{wrong}\",,,,,", watching.scene);
        }
        text
    }
}

fn room(placing: &Placing) -> String {
    match placing.of {
        Of::Modules => format!("{}, {} modules", placing.scene, placing.modules),
        Of::Floor => format!("{}, a floor", placing.scene),
    }
}

/// First and last seed.
fn seeds<T>(runs: &[(u64, T)]) -> (u64, u64) {
    let all = || runs.iter().map(|run| run.0);
    (all().min().unwrap_or(0), all().max().unwrap_or(0))
}

/// A value and its unit, as they are printed.
fn words(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".into(), |value| format!("{value:.digits$}"))
}

/// How right the poses of one room are, found from the walk or from walk and backgrounds.
fn placed(runs: &[(u64, &Placing)], from: &str, errors: impl Fn(&Placing) -> Option<&[Error]>) -> Vec<Line> {
    let number = runs.len() as u64;
    let row = runs.first().map(|(_, placing)| room(placing)).unwrap_or_default();
    let heading = Heading { row, tracker: from.to_owned(), seeds: seeds(runs), runs: number };
    let all: Vec<Error> = runs.iter().filter_map(|(_, run)| errors(run)).flatten().copied().collect();
    let centimetres: Vec<f64> = all.iter().map(|error| error.metres * 100.0).collect();
    let degrees: Vec<f64> = all.iter().map(|error| error.radians.to_degrees()).collect();
    let within = |holds: fn(&Error) -> bool| {
        let holding = all.iter().filter(|error| holds(error)).count() as f64;
        (!all.is_empty()).then(|| 100.0 * holding / all.len() as f64)
    };
    let walked: Vec<f64> = runs.iter().map(|(_, run)| run.walked_s).collect();
    let short = match runs.first().map(|(_, placing)| placing.of) {
        Some(Of::Floor) => "walks that miss it or end early refused, floor named, %",
        _ => "walks cut short refused, module named, %",
    };
    let count = |wanted: &dyn Fn(&Placing) -> bool| runs.iter().filter(|(_, run)| wanted(run)).count() as u64;
    let figure = |name: &str, value: Option<f64>, digits| heading.line(name, value, words(value, digits));
    vec![
        figure("position: median, cm", median(&centimetres), 1),
        figure("95 % within, cm", p95(&centimetres), 1),
        figure("direction: median, °", median(&degrees), 2),
        figure("95 % within, °", p95(&degrees), 2),
        figure("positions within their bounds, %", within(|error| error.metres <= error.bound_m), 1),
        figure("directions within their bounds, %", within(|error| error.radians <= error.bound_rad), 1),
        figure("walked: median, s", median(&walked), 0),
        heading.share("whole walks refused, %", count(&|run| errors(run).is_none()), number),
        heading.share(short, count(&|run| run.short), number),
    ]
}

/// Time until a module was named in one scene, and false reports.
fn watched(scene: &str, what: &str, quiet: bool, runs: &[(u64, &Watching)]) -> Vec<Line> {
    let number = runs.len() as u64;
    let heading =
        Heading { row: scene.to_owned(), tracker: what.to_owned(), seeds: seeds(runs), runs: number };
    let wrong = runs.iter().filter(|(_, run)| run.wrong.is_some()).count() as u64;
    let wrong = heading.share("said wrongly, % of runs", wrong, number);
    if quiet {
        return vec![wrong];
    }
    let times: Vec<f64> = runs.iter().filter_map(|(_, run)| run.named_s).collect();
    let named = times.iter().filter(|named_s| **named_s <= 30.0).count() as u64;
    let figure = |name: &str, value: Option<f64>| heading.line(name, value, words(value, 1));
    vec![
        heading.share("named within 30 s, % of runs", named, number),
        figure("named after: median, s", median(&times)),
        figure("longest, s", times.iter().copied().max_by(f64::total_cmp)),
        wrong,
    ]
}
