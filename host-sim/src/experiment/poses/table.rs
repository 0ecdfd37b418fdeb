//! The tables of `docs/calibration.md`, and every run as CSV.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::score::statistics::{median, p95};

/// How far one module's pose is from the truth, and within which bounds it was said to be with 95 %.
#[derive(Clone, Copy, Debug)]
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

/// Poses found in one run.
#[derive(Clone, Debug)]
pub struct Placing {
    /// The scene.
    pub scene: String,
    /// How many modules.
    pub modules: usize,
    /// How long was walked, s.
    pub walked_s: f64,
    /// From the walk alone, all modules but the first; None: refused.
    pub by_walk: Option<Vec<Error>>,
    /// From the walk and the backgrounds.
    pub by_both: Option<Vec<Error>>,
    /// Why not.
    pub refusal: Option<String>,
    /// Whether a walk that ends too early is refused, and the module named.
    pub short: bool,
}

/// One run that was watched over.
#[derive(Clone, Debug)]
pub struct Watching {
    /// The scene.
    pub scene: String,
    /// What befell a module.
    pub what: Option<String>,
    /// How long after that it was named, s.
    pub named_s: Option<f64>,
    /// What was said wrongly.
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

impl Found {
    /// Both tables.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = String::from(
            "| scene | from | runs | position: median | 95 % | direction: median | 95 % | within its bounds | walked |\n\
             |---|---|---|---|---|---|---|---|---|\n",
        );
        let mut scenes: Vec<&str> = self.placings.iter().map(|(_, placing)| placing.scene.as_str()).collect();
        scenes.dedup();
        for scene in &scenes {
            let own: Vec<&Placing> = self
                .placings
                .iter()
                .map(|(_, placing)| placing)
                .filter(|placing| placing.scene == *scene)
                .collect();
            row(&mut text, &own, "the walk", |placing| placing.by_walk.as_deref());
            row(&mut text, &own, "walk and backgrounds", |placing| placing.by_both.as_deref());
        }
        let short = self.placings.iter().filter(|(_, placing)| placing.short).count();
        let refused = self.placings.iter().filter(|(_, placing)| placing.by_walk.is_none()).count();
        let all = self.placings.len();
        let _ = writeln!(
            text,
            "\nOf {all} whole walks {refused} were refused. A walk that ended after 5 s before the last module was refused, with \
             the module named, in {short} of {all}.\n"
        );
        text.push_str("| scene | what happened | runs | named within 30 s | median | longest | said wrongly |\n|---|---|---|---|---|---|---|\n");
        let mut groups: BTreeMap<(bool, &str, &str), Vec<&Watching>> = BTreeMap::new();
        for (_, watching) in &self.watchings {
            let what = watching.what.as_deref().unwrap_or("nothing");
            groups.entry((watching.what.is_none(), &watching.scene, what)).or_default().push(watching);
        }
        for ((quiet, scene, what), runs) in groups {
            let times: Vec<f64> = runs.iter().filter_map(|run| run.named_s).collect();
            let named = times.iter().filter(|named_s| **named_s <= 30.0).count();
            let seconds = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.0} s"));
            let longest = times.iter().copied().max_by(f64::total_cmp);
            let wrong = runs.iter().filter(|run| run.wrong.is_some()).count();
            let named = if quiet { String::new() } else { format!("{named}") };
            let _ = writeln!(
                text,
                "| {scene} | {what} | {} | {named} | {} | {} | {wrong} |",
                runs.len(),
                seconds(median(&times)),
                seconds(longest),
            );
        }
        text
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

fn row(text: &mut String, runs: &[&Placing], from: &str, errors: impl Fn(&Placing) -> Option<&[Error]>) {
    let all: Vec<Error> = runs.iter().filter_map(|run| errors(run)).flatten().copied().collect();
    let metres: Vec<f64> = all.iter().map(|error| error.metres * 100.0).collect();
    let degrees: Vec<f64> = all.iter().map(|error| error.radians.to_degrees()).collect();
    let within = |holds: fn(&Error) -> bool| {
        100.0 * all.iter().filter(|error| holds(error)).count() as f64 / all.len().max(1) as f64
    };
    let walked: Vec<f64> = runs.iter().map(|run| run.walked_s).collect();
    let number = |value: Option<f64>, digits: usize, unit: &str| {
        value.map_or(String::new(), |value| format!("{value:.digits$} {unit}"))
    };
    let (scene, modules) = runs.first().map_or(("", 0), |run| (run.scene.as_str(), run.modules));
    let _ = writeln!(
        text,
        "| {scene}, {modules} modules | {from} | {} | {} | {} | {} | {} | {:.0} % · {:.0} % | {} |",
        runs.iter().filter(|run| errors(run).is_some()).count(),
        number(median(&metres), 1, "cm"),
        number(p95(&metres), 1, "cm"),
        number(median(&degrees), 2, "°"),
        number(p95(&degrees), 2, "°"),
        within(|error| error.metres <= error.bound_m),
        within(|error| error.radians <= error.bound_rad),
        number(median(&walked), 0, "s"),
    );
}
