//! Poses found by walking: how right they are, and whether a module that was moved is noticed.
//!
//! ```text
//!   scene, modules put elsewhere by the seed ─▶ world ─▶ modules ─▶ datagrams ─▶ walk ─▶ calibrate ─▶ against the truth
//!                     ▲                                                          │
//!                     └───────── a person follows the guide's advice ◀───────────┘
//! ```

mod errand;
mod guided;
mod mats;
mod table;
mod watched;

pub use guided::{Hung, floor, hung};
pub use table::{Error as Off, Found, Placing, Watching};

use std::error::Error;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::jobs::Runs;
use crate::run::{Options, Run};
use crate::world::body::{Body, Section};
use crate::world::mishap::{Kind, Mishap};
use crate::world::motion::Led;
use crate::world::person::Person;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::Scene;
use crate::world::{More, World};
use kehai_emulator::simulated_time::Stuck;

/// Scenes in which poses are looked for.
const ROOMS: [&str; 2] = ["home", "flat"];

/// Scenes in which nothing must be said about poses, and how many people come: with so many each.
const QUIET: [(&str, &str, &[usize]); 5] = [
    ("door area, D", "door-area", &[1, 2, 3, 4, 5, 6, 7]),
    ("door area, H", "door-area", &[1, 2, 3, 4, 5, 6, 7]),
    ("home", "home", &[]),
    ("a door opens and shuts", "movers", &[]),
    ("a chair is put down", "chair-back", &[]),
];

/// A false alarm is rare: these scenes run with so many times as many seeds, from the same first one on.
pub(super) const QUIET_SEEDS: u64 = 5;

/// What is done to a module.
const MISHAPS: [&str; 2] = ["turned by 10°", "covered"];

/// One run.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
enum Job {
    /// Poses by walking, in a room of [`ROOMS`].
    Place(usize),
    /// Nothing happens, in a scene of [`QUIET`] with so many people.
    Quiet(usize, Option<usize>),
    /// In a room, one of [`MISHAPS`].
    Mishap(usize, usize),
}

/// Everything that is run with these seeds.
fn jobs(seeds: &RangeInclusive<u64>) -> Vec<(Job, u64)> {
    let rooms = 0..ROOMS.len();
    let place = rooms.clone().map(Job::Place);
    let mishap = rooms.flat_map(|room| (0..MISHAPS.len()).map(move |what| Job::Mishap(room, what)));
    let quiet = QUIET.iter().enumerate().flat_map(|(scene, (_, _, people))| {
        let own = people.is_empty().then_some(Job::Quiet(scene, None));
        own.into_iter().chain(people.iter().map(move |people| Job::Quiet(scene, Some(*people))))
    });
    let count = seeds.clone().count() as u64;
    let many = *seeds.start()..*seeds.start() + QUIET_SEEDS * count;
    let each = |job: Job, seeds: Vec<u64>| seeds.into_iter().map(move |seed| (job, seed));
    let few = place.chain(mishap).flat_map(|job| each(job, seeds.clone().collect()));
    few.chain(quiet.flat_map(|job| each(job, many.clone().collect()))).collect()
}

/// What one job gives.
#[derive(Serialize, Deserialize)]
enum Result {
    Placing(Box<Placing>),
    Watching(Watching),
}

/// Everything with these seeds.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run(seeds: &RangeInclusive<u64>, runs: &Runs) -> std::result::Result<Found, Box<dyn Error>> {
    let results = runs.results("poses", &jobs(seeds), |(job, seed)| {
        one(job, seed).map_err(|error| format!("poses, {job:?}, seed {seed}: {error}"))
    })?;
    let mut found = Found::default();
    for ((_, seed), result) in results {
        match result {
            Result::Placing(placing) => found.placings.push((seed, *placing)),
            Result::Watching(watching) => found.watchings.push((seed, watching)),
        }
    }
    Ok(found)
}

/// The place of a floor in every room with these seeds.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn floors(seeds: &RangeInclusive<u64>, runs: &Runs) -> std::result::Result<Found, Box<dyn Error>> {
    let jobs: Vec<(usize, u64)> =
        (0..ROOMS.len()).flat_map(|room| seeds.clone().map(move |seed| (room, seed))).collect();
    let results = runs.results("floor-poses", &jobs, |(room, seed)| {
        floor(ROOMS[room], seed).map_err(|error| format!("a floor, {}, seed {seed}: {error}", ROOMS[room]))
    })?;
    let placings = results.into_iter().map(|((_, seed), placing)| (seed, placing)).collect();
    Ok(Found { placings, ..Found::default() })
}

fn one(job: Job, seed: u64) -> std::result::Result<Result, Box<dyn Error>> {
    let (room, what) = match job {
        Job::Place(room) => return Ok(Result::Placing(Box::new(guided::place(ROOMS[room], seed)?))),
        Job::Quiet(scene, people) => {
            let (name, file, _) = QUIET[scene];
            return Ok(Result::Watching(watched::quiet(name, file, people, seed)?));
        }
        Job::Mishap(room, what) => (room, what),
    };
    let chance = (ROOMS.len() + QUIET.len() + room * MISHAPS.len() + what) as u64;
    let mut stream = Stream::new(seed, Purpose::Network, [7, chance]);
    let room = ROOMS[room];
    let modules = Scene::load(room)?.site.modules.len();
    let module = (stream.uniform() * modules as f64) as usize % modules;
    let kind = match what {
        0 => Kind::Turned(if stream.chance(0.5) { 10.0 } else { -10.0 }),
        _ => Kind::Covered,
    };
    Ok(Result::Watching(watched::mishap(room, MISHAPS[what], Mishap { module, from_s: 0.0, kind }, seed)?))
}

/// The scene, without its people, its modules put a hand's breadth elsewhere by the seed and turned by up to 12°.
fn scene(name: &str, seed: u64) -> std::result::Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::load(name)?;
    scene.people.clear();
    let mut stream = Stream::new(seed, Purpose::Network, [6, 0]);
    for module in &mut scene.site.modules {
        module.x += stream.between(-0.1, 0.1);
        module.y += stream.between(-0.1, 0.1);
        module.yaw_deg += stream.between(-12.0, 12.0);
    }
    Ok(scene)
}

/// A run with a person steered from outside.
fn led(scene: &Scene, seed: u64, led: &Led, mishaps: Vec<Mishap>) -> Run {
    let body = Body::random(Section::Torso, &mut Stream::new(seed, Purpose::Person, [0, 2]));
    let walker = Person {
        name: "who is led".into(),
        body,
        motion: led.motion(),
        crouches_s: None,
        gestures: None,
        reaches_s: Vec::new(),
    };
    let more = More { people: vec![walker], mishaps, ..More::default() };
    Run::of(World::with(scene, seed, more), seed, &Options::default())
}

/// A fault of the simulation, as it is.
type Fault = Stuck;
