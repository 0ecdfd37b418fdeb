//! Poses found by walking: how right they are, and whether a module that was moved is noticed.
//!
//! ```text
//!   scene, modules put elsewhere by the seed ─▶ world ─▶ modules ─▶ datagrams ─▶ walk ─▶ calibrate ─▶ against the truth
//!                     ▲                                                          │
//!                     └───────── somebody goes where the guide says ◀────────────┘
//! ```

mod errand;
mod guided;
mod table;
mod watched;

pub use table::{Found, Placing, Watching};

use std::error::Error;
use std::ops::RangeInclusive;

use crate::run::{Options, Run};
use crate::simulated_time::Stuck;
use crate::world::body::{Body, Section};
use crate::world::mishap::{Kind, Mishap};
use crate::world::motion::Led;
use crate::world::random::{Purpose, Stream};
use crate::world::raycast::Person;
use crate::world::scene::Scene;
use crate::world::{More, World};

/// Scenes in which poses are looked for.
const ROOMS: [&str; 2] = ["home", "flat"];

/// Scenes in which nothing must be said about poses, and how many people are in the door area's.
const QUIET: [(&str, &str, Option<usize>); 5] = [
    ("door area, D", "door-area", Some(5)),
    ("door area, H", "door-area", Some(6)),
    ("home", "home", None),
    ("a door opens and shuts", "movers", None),
    ("a chair is put down", "chair-back", None),
];

/// What is done to a module.
const MISHAPS: [&str; 2] = ["turned by 10°", "covered"];

/// Jobs of one seed.
const JOBS: usize = ROOMS.len() * (1 + MISHAPS.len()) + QUIET.len();

/// How many runs so many seeds are.
#[must_use]
pub fn runs(seeds: &RangeInclusive<u64>) -> u64 {
    JOBS as u64 * seeds.clone().count() as u64
}

/// What one job gives.
enum Result {
    Placing(Box<Placing>),
    Watching(Watching),
}

/// Everything with these seeds; `done` is told of every finished run.
///
/// # Errors
/// The first fault of a scene or of the simulation.
pub fn run(
    seeds: &RangeInclusive<u64>,
    done: impl Fn() + Sync,
) -> std::result::Result<Found, Box<dyn Error>> {
    let jobs: Vec<(usize, u64)> =
        (0..JOBS).flat_map(|job| seeds.clone().map(move |seed| (job, seed))).collect();
    let results = super::cores::on_all_cores(&jobs, |(job, seed)| {
        let result = one(job, seed).map_err(|error| format!("poses, job {job}, seed {seed}: {error}"));
        done();
        result
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

fn one(job: usize, seed: u64) -> std::result::Result<Result, Box<dyn Error>> {
    if let Some(room) = ROOMS.get(job) {
        return Ok(Result::Placing(Box::new(guided::place(room, seed)?)));
    }
    let rest = job - ROOMS.len();
    if let Some((name, scene, people)) = QUIET.get(rest) {
        return Ok(Result::Watching(watched::quiet(name, scene, *people, seed)?));
    }
    let rest = rest - QUIET.len();
    let (room, what) = (ROOMS[rest / MISHAPS.len()], rest % MISHAPS.len());
    let mut stream = Stream::new(seed, Purpose::Network, [7, job as u64]);
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

/// A run in which somebody is led.
fn led(scene: &Scene, seed: u64, led: &Led, mishaps: Vec<Mishap>) -> Run {
    let body = Body::random(Section::Torso, &mut Stream::new(seed, Purpose::Person, [0, 2]));
    let walker = Person { name: "who is led".into(), body, motion: led.motion(), crouches_s: None };
    let more = More { people: vec![walker], mishaps, ..More::default() };
    Run::of(World::with(scene, seed, more), seed, &Options::default())
}

/// A fault of the simulation, as it is.
type Fault = Stuck;
