//! Whether the count is as sure as is said: what trackers say of it as a distribution, second by second, against the truth.
//!
//! ```text
//!   worlds × condition × people × seed ─┐                      each second of a run:
//!   cases of another simulator ─────────┴▶ record ─▶ tracker ─▶ Heard: P(0), P(1), … of zone, door, site; people there
//!                                                                  │ pooled by world, all own worlds, all cases
//!                                                                  ▼
//!                                                              Reliability ─▶ tables, picture
//! ```
//!
//! A second in which a zone is not known is left out: there nothing is said.

use std::error::Error;
use std::path::PathBuf;

use kehai_tracking::geometry::{Point, inside};
use kehai_tracking::site::Site;
use kehai_tracking::total;
use serde::{Deserialize, Serialize};

use super::cases;
use super::jobs::Runs;
use super::worlds;
use crate::baselines::Choice;
use crate::run::{Moment, Record};
use crate::score::reliability::{self, Reliability};

/// The numbers that are asked for are 0 to this: two more than in the fullest case.
const MOST: usize = 12;

/// A line of truth is there every 0.1 s; every so many of them are asked: a second.
const EVERY: usize = 10;

/// Name of all own worlds together, and of all cases.
const OWN: &str = "own worlds";
const CASES: &str = "cases";

/// What is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Own worlds.
    pub worlds: worlds::Plan,
    /// Other ones: a folder of cases.
    pub cases: Option<PathBuf>,
}

/// Which distribution.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Asked {
    /// Of a zone, as it is written: tentative tracks and those at its edge included.
    Zone,
    /// Of those who may be counted in it: by this a door decides.
    Door,
    /// Of the whole site.
    Site,
}

impl Asked {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Zone, Self::Door, Self::Site];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Zone => "zone",
            Self::Door => "door",
            Self::Site => "site",
        }
    }
}

/// What was said in one second, and what is true.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heard {
    /// When, s.
    pub t_s: f64,
    /// How many people are in the zone: in the site, too, as it has one.
    pub people: usize,
    /// What was said, in the order of [`Asked::ALL`].
    pub said: [Vec<f64>; 3],
}

/// All of one run with one tracker.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The world, or `cases`.
    pub group: String,
    /// What was run.
    pub row: String,
    /// Its seed.
    pub seed: u64,
    /// The tracker.
    pub tracker: String,
    /// Second by second.
    pub heard: Vec<Heard>,
}

/// What came out of a group of runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The worlds.
    pub group: String,
    /// The tracker.
    pub tracker: String,
    /// Which distribution.
    pub asked: Asked,
    /// How many runs.
    pub runs: usize,
    /// What came out.
    pub found: Reliability,
}

impl Judged {
    /// Whether it is of several worlds together.
    #[must_use]
    pub fn is_pooled(&self) -> bool {
        self.group == OWN || self.group == CASES
    }
}

/// Runs a plan.
///
/// # Errors
/// An unknown world, an impossible number of people, a case that cannot be played, or a fault of the simulation.
pub fn run(plan: &Plan, runs: &Runs) -> Result<Vec<Run>, Box<dyn Error>> {
    let trackers = &plan.worlds.trackers;
    let rows = plan.worlds.rows()?;
    let jobs: Vec<(usize, u64)> =
        (0..rows.len()).flat_map(|row| plan.worlds.seeds.clone().map(move |seed| (row, seed))).collect();
    let mut found = runs.results("counts", &jobs, |(row, seed)| {
        let Some((world, name, scene)) = rows.get(row) else { return Ok(Vec::new()) };
        let record = world.record(scene, seed).map_err(|fault| format!("{name}, seed {seed}: {fault}"))?;
        Ok(all_heard(&record, trackers))
    })?;
    let of_world = |((row, seed), heard): ((usize, u64), Vec<Vec<Heard>>)| {
        let (world, name, _) = rows.get(row)?;
        Some((world.name.to_owned(), name.clone(), seed, heard))
    };
    let mut all: Vec<_> = std::mem::take(&mut found).into_iter().filter_map(of_world).collect();
    if let Some(folder) = &plan.cases {
        let cases = cases::find(folder, &[])?;
        let jobs: Vec<(usize, u64)> = (0..cases.len()).map(|case| (case, 0)).collect();
        let found = runs.results("counts-cases", &jobs, |(case, _)| {
            let record = cases.get(case).map(cases::Case::record).transpose();
            let record = record.map_err(|error| error.to_string())?;
            Ok(record.map(|record| all_heard(&record, trackers)).unwrap_or_default())
        })?;
        all.extend(found.into_iter().filter_map(|((case, _), heard)| {
            let cell = cases.get(case)?.cell();
            Some((CASES.to_owned(), format!("{}, {}", cell.scene, cell.people), case as u64, heard))
        }));
    }
    let each = |(group, row, seed, heard): (String, String, u64, Vec<Vec<Heard>>)| {
        let of = move |(choice, heard): (&Choice, Vec<Heard>)| Run {
            group: group.clone(),
            row: row.clone(),
            seed,
            tracker: choice.to_string(),
            heard,
        };
        trackers.iter().zip(heard).map(of).collect::<Vec<_>>()
    };
    Ok(all.into_iter().flat_map(each).collect())
}

/// What each tracker says of a record.
fn all_heard(record: &Record, trackers: &[Choice]) -> Vec<Vec<Heard>> {
    trackers.iter().map(|choice| heard(record, *choice)).collect()
}

fn heard(record: &Record, choice: Choice) -> Vec<Heard> {
    let Some(zone) = record.site.zones.iter().find(|zone| zone.count) else { return Vec::new() };
    let mut number = 0;
    let said = record.follow(choice, |site_tracker, moment| {
        // Asked for as often as in the product: a look lets tracks end.
        let line = site_tracker.line(moment.t);
        number += 1;
        let known = line.zones.get(&zone.name).filter(|_| number % EVERY == 1)?;
        if known.p().is_empty() {
            return None;
        }
        let said = [known.p().to_vec(), known.counted_p().to_vec(), total::distribution(&record.site, &line)];
        Some(Heard { t_s: moment.t, people: people(&record.site, moment), said })
    });
    said.into_iter().flatten().collect()
}

/// How many are in the zones of a site that count.
fn people(site: &Site, moment: &Moment) -> usize {
    let zones: Vec<Vec<Point>> =
        site.zones.iter().filter(|zone| zone.count).map(|zone| zone.corners()).collect();
    let is_in = |at: Point| zones.iter().any(|zone| inside(at, zone));
    moment.people.iter().filter(|person| is_in(Point::new(person.x, person.y))).count()
}

/// The runs of each world, of all own worlds, of all cases, and of each condition of those; tracker by tracker.
#[must_use]
pub fn judge(runs: &[Run]) -> Vec<Judged> {
    let mut groups: Vec<String> = Vec::new();
    let mut trackers: Vec<&str> = Vec::new();
    for run in runs {
        if !trackers.contains(&run.tracker.as_str()) {
            trackers.push(&run.tracker);
        }
        for group in groups_of(run) {
            if !groups.contains(&group) {
                groups.push(group);
            }
        }
    }
    let mut judged = Vec::new();
    for group in &groups {
        for tracker in &trackers {
            let own: Vec<&Run> =
                runs.iter().filter(|run| run.tracker == *tracker && groups_of(run).contains(group)).collect();
            for (which, asked) in Asked::ALL.into_iter().enumerate() {
                let moments = own.iter().enumerate().flat_map(|(number, run)| {
                    run.heard.iter().map(move |heard| reliability::Moment {
                        run: number,
                        p: &heard.said[which],
                        people: heard.people,
                    })
                });
                if let Some(found) = Reliability::of(moments, MOST) {
                    let (group, tracker) = (group.clone(), (*tracker).to_owned());
                    judged.push(Judged { group, tracker, asked, runs: own.len(), found });
                }
            }
        }
    }
    judged
}

/// The groups that a run is in.
fn groups_of(run: &Run) -> [String; 2] {
    if run.group == CASES {
        [CASES.to_owned(), format!("{CASES}: {}", run.row)]
    } else {
        [OWN.to_owned(), run.group.clone()]
    }
}
