//! Other worlds: recordings of a simulator that shares nothing with this one, with its truth, as cases in folders.
//!
//! ```text
//!   DIR/H7-1100/ ─┬─ site.toml, L.csv, R.csv ─▶ devices ─▶ datagrams ─┬─▶ tracker ─▶ scorer ─▶ Outcome
//!                 ├─ truth.jsonl ────────────────────────────────────┘
//!                 └─ case.json   condition, people, seed, sensors, when the door opens
//! ```
//!
//! Condition and number of people name a row; its cases are pooled. A case without a door is judged everywhere, as
//! long as it lasts.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use kehai_emulator::recording::Recording;
use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{PersonLine, TruthLine};
use kehai_tracking::site::Site;
use rayon::prelude::*;
use serde::Deserialize;

use super::in_view::Rays;
use super::runner::judge_in;
use super::table::{Cell, Outcome, Row};
use super::trial::{counted, judged};
use crate::baselines::Choice;
use crate::replay::Learn;
use crate::run::recorded::Recorded;
use crate::run::{Moment, Record, SeenPerson};
use crate::score::Settings;
use crate::world::Events;

/// Scans of the empty room with which every recording begins.
const EMPTY: u16 = 60;

/// A case as its folder describes it.
#[derive(Clone, Debug)]
pub struct Case {
    folder: PathBuf,
    about: About,
}

/// The content of `case.json`.
#[derive(Clone, Debug, Deserialize)]
struct About {
    #[serde(rename = "n")]
    people: u32,
    seed: u64,
    #[serde(rename = "cond")]
    condition: String,
    /// When people may come, s.
    t_start: f64,
    /// From when to when the door is open, s.
    door: Vec<(f64, f64)>,
    meta: Meta,
    modules: Vec<String>,
}

#[derive(Clone, Debug, Default, Deserialize)]
struct Meta {
    /// When all people are in, s after `t_start`.
    t_all: Option<f64>,
}

/// Why cases cannot be played.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
pub struct CaseError {
    path: PathBuf,
    reason: String,
}

impl CaseError {
    fn at(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string() }
    }
}

/// The cases in a folder whose names begin with one of `chosen`, in the order of their names; all of them if it is empty.
///
/// # Errors
/// The folder, or what describes a case, cannot be read; or no case is there.
pub fn find(folder: &Path, chosen: &[String]) -> Result<Vec<Case>, CaseError> {
    let entries = fs::read_dir(folder).map_err(|error| CaseError::at(folder, error))?;
    let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    folders.retain(|path| path.join("case.json").is_file());
    folders.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        chosen.is_empty() || chosen.iter().any(|prefix| name.starts_with(prefix.as_str()))
    });
    folders.sort();
    if folders.is_empty() {
        return Err(CaseError::at(folder, "no case there: a case is a folder with case.json in it"));
    }
    let case = |folder: PathBuf| {
        let path = folder.join("case.json");
        let text = fs::read(&path).map_err(|error| CaseError::at(&path, error))?;
        let about = serde_json::from_slice(&text).map_err(|error| CaseError::at(&path, error))?;
        Ok(Case { folder, about })
    };
    folders.into_iter().map(case).collect()
}

/// Plays all cases through all trackers on all cores. A row for each condition, number of people and tracker.
///
/// # Errors
/// The first case that cannot be played.
pub fn run(cases: &[Case], trackers: &[Choice], bar: &ProgressBar) -> Result<Vec<Row>, CaseError> {
    bar.inc_length(cases.len() as u64);
    let play = |case: &Case| {
        let (record, settings) = (case.record()?, case.settings());
        let outcomes: Vec<Outcome> =
            trackers.iter().map(|choice| judge_in(&record, *choice, settings)).collect();
        bar.inc(1);
        Ok((case.cell(), case.about.seed, outcomes))
    };
    let played = cases.par_iter().map(play).collect::<Result<Vec<_>, CaseError>>()?;
    let mut rows: BTreeMap<(Cell, usize), Vec<(u64, Outcome)>> = BTreeMap::new();
    for (cell, seed, outcomes) in played {
        for (index, (choice, outcome)) in trackers.iter().zip(outcomes).enumerate() {
            let cell = Cell { tracker: choice.to_string(), ..cell.clone() };
            rows.entry((cell, index)).or_default().push((seed, outcome));
        }
    }
    Ok(rows.into_iter().map(|((cell, _), runs)| Row::new(cell, &runs)).collect())
}

impl Case {
    /// Its row, without the tracker.
    pub(super) fn cell(&self) -> Cell {
        let About { people, condition, modules, .. } = &self.about;
        Cell {
            scene: condition.clone(),
            sensors: modules.len() as u32,
            people: *people,
            tracker: String::new(),
        }
    }

    fn settings(&self) -> Settings {
        let has_door = !self.about.door.is_empty();
        Settings { region: has_door.then(judged), area: has_door.then(counted), ..Settings::default() }
    }

    /// Its recordings through devices, with its truth.
    pub(super) fn record(&self) -> Result<Record, CaseError> {
        let path = self.folder.join("site.toml");
        let text = fs::read_to_string(&path).map_err(|error| CaseError::at(&path, error))?;
        let site =
            Site::parse(&path.display().to_string(), &text).map_err(|error| CaseError::at(&path, error))?;
        let recording = |name: &String| {
            let path = self.folder.join(format!("{name}.csv"));
            let recording = Recording::open(&path).map_err(|error| CaseError::at(&path, error))?;
            Ok((name.clone(), recording))
        };
        let recordings = self.about.modules.iter().map(recording).collect::<Result<Vec<_>, _>>()?;
        let played = Recorded::play(&site, &recordings, Learn::Scans(EMPTY), || {})
            .map_err(|error| CaseError::at(&self.folder, error))?;
        let mut rays = Rays::default();
        for (name, recording) in &recordings {
            if let Some(module) = site.modules.iter().find(|module| module.name == *name) {
                let added = rays.add(recording, module.pose(), EMPTY.into());
                added.map_err(|error| CaseError::at(&self.folder, error))?;
            }
        }
        let truth = self.truth(&rays, played.zero_s)?;
        let events = self.events(&truth, played.zero_s);
        Ok(Record { truth, events, ..played.record })
    }

    /// Its truth on the host's clock, which is `zero_s` later than the recordings', with how many of their rays met each person.
    fn truth(&self, rays: &Rays, zero_s: f64) -> Result<Vec<Moment>, CaseError> {
        let path = self.folder.join("truth.jsonl");
        let text = fs::read_to_string(&path).map_err(|error| CaseError::at(&path, error))?;
        let person = |(person, beams): (&PersonLine, u32)| SeenPerson {
            id: u32::try_from(person.id).unwrap_or(u32::MAX),
            x: person.x,
            y: person.y,
            beams,
        };
        let moment = |(number, line): (usize, &str)| {
            let line: TruthLine = serde_json::from_str(line)
                .map_err(|error| CaseError::at(&path, format!("line {}: {error}", number + 1)))?;
            let places: Vec<Point> =
                line.people.iter().map(|person| Point::new(person.x, person.y)).collect();
            let at_us = (line.t.max(0.0) * 1e6).round() as u64;
            let beams = rays.beams(at_us, &places);
            Ok(Moment { t: line.t + zero_s, people: line.people.iter().zip(beams).map(person).collect() })
        };
        text.lines().enumerate().map(moment).collect()
    }

    fn events(&self, truth: &[Moment], zero_s: f64) -> Option<Events> {
        let About { people, t_start, door, meta, .. } = &self.about;
        let (opens_s, _) = door.first()?;
        let area = counted();
        let is_inside = |person: &SeenPerson| area.contains(Point::new(person.x, person.y));
        let last = truth.iter().rfind(|moment| moment.people.iter().any(is_inside));
        Some(Events {
            people: *people as usize,
            all_in_s: t_start + meta.t_all? + zero_s,
            door_opens_s: opens_s + zero_s,
            empty_s: last.map_or(0.0, |moment| moment.t),
        })
    }
}
