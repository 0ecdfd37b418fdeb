//! A sample of rooms and layouts, good ones and poor ones, and how well people are counted in each: what the handover page
//! expects of a site, it takes from those that see as much.
//!
//! ```text
//!   room ─▶ layouts: the best of 1, 2, 3, 4 modules, two pairs and a triple at random ─┬─ 1, 2, 4, 6 people ─▶ a line each
//!                                                                                      └─ seen by one, from two sides, empty room
//! ```
//!
//! The lines are in `docs/tables/expected.csv`, which `kehai_tracking::expectation` reads.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::choose::Number;
use super::expect::{ExpectError, run};
use super::layout::Survey;
use super::rooms::{ALL, room};
use super::visit::Visitors;
use super::{ORDINARY_CLOTHES, Task};
use crate::world::optics::SensorModel;
use crate::world::random::{Purpose, Stream};
use crate::world::site::Module;

/// People in each run.
const PEOPLE: [usize; 4] = [1, 2, 4, 6];

/// Modules of the layouts that are chosen, and of those that are drawn.
const CHOSEN: [usize; 4] = [1, 2, 3, 4];
const DRAWN: [usize; 3] = [2, 2, 3];

/// Places are chosen with so many people about.
const CHOSEN_FOR: usize = 4;

/// One layout of one room with one number of people.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Line {
    /// Number of the room.
    pub room: u64,
    /// Its area, m².
    pub m2: f64,
    /// How many modules.
    pub modules: usize,
    /// Share of the empty room that is seen by one module.
    pub one: f64,
    /// Share that is seen from two sides.
    pub two: f64,
    /// How many people came.
    pub people: usize,
    /// Share of the time in which the count was right.
    pub exact: f64,
    /// Runs of a minute.
    pub runs: u64,
}

/// All lines of a room; each of `runs` runs has a seed of its own.
///
/// # Errors
/// As [`run`].
pub fn sample(number: u64, runs: u64) -> Result<Vec<Line>, ExpectError> {
    let fault = |error: &dyn ToString| ExpectError::Run(number, error.to_string());
    let site = room(number, ALL).map_err(|error| fault(&error))?;
    let task = Task {
        site,
        model: SensorModel::Urg04lx,
        height_m: 0.9,
        clothes: ORDINARY_CLOTHES,
        people: CHOSEN_FOR,
        seed: number,
    };
    let layouts = layouts(&task, number).map_err(|error| fault(&error))?;
    let jobs: Vec<(&Vec<Module>, usize)> =
        layouts.iter().flat_map(|layout| PEOPLE.map(|people| (layout, people))).collect();
    jobs.par_iter().map(|(modules, people)| line(&task, number, modules, *people, runs)).collect()
}

/// The modules of each layout of a room.
fn layouts(task: &Task, number: u64) -> Result<Vec<Vec<Module>>, crate::world::scene::SceneError> {
    let survey = Survey::of(task)?;
    let mut stream = Stream::new(number, Purpose::Installed, [7, 9]);
    let mut place = || (stream.uniform() * survey.places.len() as f64) as usize;
    let chosen = CHOSEN.map(|modules| survey.choice().greedy(&[], Number::Exactly(modules)));
    let drawn = DRAWN.map(|modules| (0..modules).map(|_| place()).collect());
    let all = chosen.into_iter().chain(drawn);
    Ok(all.map(|places| survey.modules(&survey.layout(places))).collect())
}

fn line(task: &Task, number: u64, modules: &[Module], people: usize, runs: u64) -> Result<Line, ExpectError> {
    let visitors = Visitors::of(&Task { people, ..task.clone() })?;
    let seeds = number * runs..(number + 1) * runs;
    let found = seeds.map(|seed| run(&visitors, modules, seed)).collect::<Result<Vec<_>, _>>()?;
    let exact = found.iter().map(|run| run.exact).sum::<f64>() / found.len().max(1) as f64;
    let seen = found.into_iter().next().map(|run| run.seen).unwrap_or_default();
    Ok(Line {
        room: number,
        m2: seen.m2,
        modules: modules.len(),
        one: seen.one,
        two: seen.two,
        people,
        exact: (exact * 1000.0).round() / 1000.0,
        runs,
    })
}
