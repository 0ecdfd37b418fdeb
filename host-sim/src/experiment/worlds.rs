//! Worlds that disagree: the door area with other bodies, other crowds, dark clothes, and a site as it was installed.
//!
//! ```text
//!   world × condition × people × seed ─▶ scene, changed ─▶ record ─▶ trackers ─▶ figures, pooled ─▶ table
//!                                                           │                                     └▶ what differs from
//!                                                           └ site file, a little wrong              `own` by more
//!                                                                                                    than the intervals
//! ```
//!
//! A figure that holds in one world alone is worth nothing. `own` is the world in which the tracker was developed.

use std::error::Error;
use std::ops::RangeInclusive;

use super::figure::Figure;
use super::findings::{Figures, Pooled, owned};
use super::jobs::Runs;
use super::line::{COUNTED_RIGHT, Line};
use super::plan::Case;
use super::runner::judge;
use super::table::Outcome;
use crate::baselines::Choice;
use crate::run::{Conditions, Options, Record};
use crate::score::Tally;
use crate::world::gathering::{Avoidance, GatheringSpec, Waiting};
use crate::world::installed::installed;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::Scene;
use crate::world::shape::Family;
use crate::world::site::Site;
use crate::world::variation::Letter;

/// Share of the people who wear black, from and to: drawn for each run.
const BLACK: (f64, f64) = (0.03, 0.15);

/// A world.
#[derive(Clone, Copy, Debug)]
pub struct World {
    /// Its name.
    pub name: &'static str,
    /// What differs from the world in which the tracker was developed.
    pub about: &'static str,
    change: fn(&mut GatheringSpec, &mut Stream),
    is_installed: bool,
}

/// All worlds; the first is the one in which the tracker was developed.
pub const WORLDS: [World; 9] = [
    World { name: "own", about: "ellipses, social force", change: |_, _| {}, is_installed: false },
    World {
        name: "arms",
        about: "smaller ellipses; arms swing wide, are folded, carry, reach",
        change: |gathering, _| gathering.bodies = Family::Arms,
        is_installed: false,
    },
    World {
        name: "coats",
        about: "larger superellipses, without arms",
        change: |gathering, _| gathering.bodies = Family::Coats,
        is_installed: false,
    },
    World {
        name: "black",
        about: "black clothes on 3–15 %",
        change: |gathering, stream| gathering.black_share = stream.between(BLACK.0, BLACK.1),
        is_installed: false,
    },
    World {
        name: "obstacles",
        about: "people choose velocities (velocity obstacles)",
        change: |gathering, _| gathering.avoidance = Avoidance::VelocityObstacles,
        is_installed: false,
    },
    World {
        name: "milling",
        about: "people turn on the spot and mill about at 0.1–0.3 m/s",
        change: |gathering, _| gathering.waiting = Waiting::Milling,
        is_installed: false,
    },
    World {
        name: "clumps",
        about: "two to four come at one time",
        change: |gathering, _| gathering.in_clumps = true,
        is_installed: false,
    },
    World {
        name: "installed",
        about: "poses, walls and entries a little wrong; one wall or entry forgotten",
        change: |_, _| {},
        is_installed: true,
    },
    World {
        name: "all",
        about: "all of it at one time, arms or coats",
        change: |gathering, stream| {
            gathering.bodies = if stream.chance(0.5) { Family::Arms } else { Family::Coats };
            gathering.black_share = stream.between(BLACK.0, BLACK.1);
            if stream.chance(0.5) {
                gathering.avoidance = Avoidance::VelocityObstacles;
            }
            gathering.waiting = Waiting::Milling;
            gathering.in_clumps = true;
        },
        is_installed: true,
    },
];

/// What is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Worlds, by name; all if empty. `own` is always run, to compare with.
    pub only: Vec<String>,
    /// How people come and wait.
    pub conditions: Vec<Letter>,
    /// How many people.
    pub people: Vec<usize>,
    /// The seeds.
    pub seeds: RangeInclusive<u64>,
    /// The trackers.
    pub trackers: Vec<Choice>,
}

/// A world, the name of a row, and the scene of it.
pub(super) type Named = (World, String, Scene);

impl Plan {
    /// The worlds of this plan.
    ///
    /// # Errors
    /// One of the names is no world's.
    fn worlds(&self) -> Result<Vec<World>, String> {
        let is_known = |name: &&String| !WORLDS.iter().any(|world| world.name == **name);
        if let Some(name) = self.only.iter().find(is_known) {
            let names: Vec<&str> = WORLDS.iter().map(|world| world.name).collect();
            return Err(format!("there is no world \"{name}\": choose {}", names.join(", ")));
        }
        let is_wanted = |world: &&World| {
            self.only.is_empty()
                || world.name == WORLDS[0].name
                || self.only.iter().any(|name| name == world.name)
        };
        Ok(WORLDS.iter().filter(is_wanted).copied().collect())
    }

    /// Its worlds, each in every condition with every number of people: with their names and scenes.
    ///
    /// # Errors
    /// An unknown world, or an impossible number of people.
    pub(super) fn rows(&self) -> Result<Vec<Named>, Box<dyn Error>> {
        let mut rows = Vec::new();
        for world in self.worlds()? {
            for &condition in &self.conditions {
                for &people in &self.people {
                    let scene = Case::door(condition, people, &[]).build()?;
                    rows.push((world, format!("{}, {condition}, {people}", world.name), scene));
                }
            }
        }
        Ok(rows)
    }
}

/// Runs a plan.
///
/// # Errors
/// An unknown world, an impossible number of people, or a fault of the simulation.
pub fn run(plan: &Plan, runs: &Runs) -> Result<Vec<Pooled>, Box<dyn Error>> {
    let rows = plan.rows()?;
    let jobs: Vec<(usize, u64)> =
        (0..rows.len()).flat_map(|row| plan.seeds.clone().map(move |seed| (row, seed))).collect();
    let found = runs.results("worlds", &jobs, |(row, seed)| {
        let Some((world, name, scene)) = rows.get(row) else { return Ok(Vec::new()) };
        let record = world.record(scene, seed).map_err(|fault| format!("{name}, seed {seed}: {fault}"))?;
        Ok(plan.trackers.iter().map(|choice| owned(figures(&judge(&record, *choice)))).collect())
    })?;
    let mut all = Vec::new();
    for (row, (_, name, _)) in rows.iter().enumerate() {
        for (tracker, choice) in plan.trackers.iter().enumerate() {
            let own = found.range((row, 0)..=(row, u64::MAX));
            let of = |((_, seed), found): (&(usize, u64), &Vec<Figures>)| {
                Some((*seed, found.get(tracker)?.clone()))
            };
            let runs = own.filter_map(of).collect();
            all.push(Pooled { trial: name.clone(), tracker: choice.to_string(), runs });
        }
    }
    Ok(all)
}

impl World {
    /// A scene in this world, and the site as the tracker's file has it.
    fn build(&self, scene: &Scene, seed: u64) -> (Scene, Site) {
        let mut scene = scene.clone();
        if let Some(gathering) = &mut scene.gathering {
            (self.change)(gathering, &mut Stream::new(seed, Purpose::Shape, [u64::MAX, 0]));
        }
        let file = if self.is_installed { installed(&scene.site, seed) } else { scene.site.clone() };
        (scene, file)
    }

    /// A run of a scene in this world.
    pub(super) fn record(&self, scene: &Scene, seed: u64) -> Result<Record, String> {
        let (scene, site) = self.build(scene, seed);
        let options = Options { conditions: Conditions::LAN, ..Options::default() };
        let record = Record::of(&scene, seed, &options).map_err(|error| error.to_string())?;
        Ok(Record { site, ..record })
    }
}

/// The figures of one run.
fn figures(outcome: &Outcome) -> Vec<(&'static str, Figure)> {
    let mut tally = Tally::default();
    tally += &outcome.tally;
    let figures = tally.figures();
    let mean = |value: Option<f64>, times: f64, digits: usize| Figure::Mean {
        values: value.map(|value| value * times).into_iter().collect(),
        digits,
        shares: false,
    };
    vec![
        (COUNTED_RIGHT, Figure::of(outcome.success)),
        ("right, % of the time", mean(figures.exact_count_rate, 100.0, 1)),
        ("IDF1", mean(figures.idf1, 1.0, 3)),
        ("MOTA", mean(figures.mota, 1.0, 3)),
        ("switches a run", Figure::mean(figures.id_switches as f64, 2)),
        ("RMS error of the visible, cm", mean(figures.rms_visible_m, 100.0, 1)),
    ]
}

/// The figures that differ from the first world's by more than both intervals, in words.
#[must_use]
pub fn differences(lines: &[Line]) -> Vec<String> {
    let own = format!("{}, ", WORLDS[0].name);
    let differs = |line: &&Line| {
        let (world, rest) = line.row.split_once(", ")?;
        let base = lines.iter().find(|base| {
            base.row.strip_prefix(&own) == Some(rest)
                && base.tracker == line.tracker
                && base.figure == line.figure
        })?;
        let apart = line.high? < base.low? || line.low? > base.high?;
        apart.then(|| {
            format!(
                "{world}: {rest} people, {}, {}: {} instead of {}",
                line.tracker, line.figure, line.printed, base.printed
            )
        })
    };
    lines.iter().filter_map(|line| differs(&line)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_world_changes_what_it_says() {
        let scene = Case::door(Letter::D, 6, &[]).build().unwrap();
        for world in &WORLDS {
            let (changed, file) = world.build(&scene, 3);
            let differs = (changed.gathering != scene.gathering, file != scene.site);
            let is_own = world.name == "own";
            assert_eq!(differs, (!is_own && world.name != "installed", world.is_installed), "{}", world.name);
            assert_eq!(changed.site, scene.site, "{}: the world itself is where it was", world.name);
        }
    }

    #[test]
    fn all_of_it_runs_and_the_same_way_again() {
        let scene = Case::door(Letter::H, 2, &[]).build().unwrap();
        let [.., all] = &WORLDS;
        assert_eq!(all.record(&scene, 3).unwrap(), all.record(&scene, 3).unwrap());
    }

    #[test]
    fn an_unknown_world_is_refused_by_name() {
        let plan = Plan {
            only: vec!["moon".into()],
            conditions: vec![Letter::D],
            people: vec![1],
            seeds: 0..=0,
            trackers: vec![Choice::default()],
        };
        let said = run(&plan, &Runs::default()).unwrap_err().to_string();
        assert!(said.contains("no world \"moon\"") && said.contains("arms, coats"), "{said}");
    }

    #[test]
    fn a_figure_differs_when_the_intervals_lie_apart() {
        let line = |row: &str, low: f64, high: f64| Line {
            commit: String::new(),
            row: row.into(),
            tracker: "kehai".into(),
            first_seed: 0,
            last_seed: 9,
            runs: 10,
            figure: "IDF1".into(),
            value: Some(0.5 * (low + high)),
            low: Some(low),
            high: Some(high),
            of: Some(10),
            printed: format!("{low}–{high}"),
        };
        let lines =
            [line("own, H, 7", 0.9, 0.95), line("arms, H, 7", 0.8, 0.89), line("coats, H, 7", 0.88, 0.93)];
        assert_eq!(differences(&lines), ["arms: H, 7 people, kehai, IDF1: 0.8–0.89 instead of 0.9–0.95"]);
    }
}
