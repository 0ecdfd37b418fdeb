//! A simulated world: people who walk among walls and furniture, and range finders that watch them.
//!
//! ```text
//!   scene file ─▶ people (body + motion), things, sensors
//!                    │ time                │
//!                    ▼                     ▼
//!                  truth ◀── same ──▶ ray caster ─▶ noise ─▶ ranges of an emulated sensor
//! ```
//!
//! Everything is a pure function of the scene, the seed and the time: the same seed gives the same
//! bytes on every machine, and any scan or truth can be asked for in any order.

pub mod body;
pub mod geometry;
pub mod motion;
pub mod noise;
pub mod optics;
pub mod random;
pub mod raycast;
pub mod scene;
pub mod sensor;
pub mod site;
pub mod walker;

use std::sync::Arc;

use body::Body;
use geometry::{Outline, Point};
use motion::Motion;
use random::{Purpose, Stream};
use raycast::{Caster, Person, Thing};
use scene::{Furniture, PersonSpec, Scene};
use sensor::WorldSensor;
use serde::Serialize;
use site::{Blocks, Wall};
use walker::{Habit, Route, WayPoint};

/// Walls reach from the floor to the ceiling, above every plane.
const CEILING_M: f64 = 3.0;

/// A scene brought to life under a seed.
#[derive(Clone, Debug)]
pub struct World {
    people: Arc<[Person]>,
    sensors: Vec<(String, WorldSensor)>,
}

/// Where everybody is at one moment: a line of `truth.jsonl`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Truth {
    /// Time in seconds.
    pub t: f64,
    /// Everybody who is in the world.
    pub people: Vec<TruePerson>,
}

/// One person of a [`Truth`], in the site's frame.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TruePerson {
    /// Number in the scene, from 1.
    pub id: usize,
    /// Middle of the torso, in metres.
    pub x: f64,
    /// Middle of the torso, in metres.
    pub y: f64,
}

impl World {
    /// The scene under `seed`.
    #[must_use]
    pub fn new(scene: &Scene, seed: u64) -> Self {
        let people: Arc<[Person]> =
            scene.people.iter().enumerate().map(|(index, spec)| person(index, spec, seed)).collect();
        let mut things: Vec<Thing> = scene.site.walls.iter().flat_map(wall).collect();
        things.extend(scene.furniture.iter().flat_map(furniture));
        let sensor = |(index, module): (usize, &site::Module)| {
            let spec = scene.sensors.iter().find(|spec| spec.module == module.name);
            let (model, level) = spec.map_or_else(Default::default, |spec| (spec.model, spec.noise));
            let caster = Caster::new(module.pose(), module.height_m, model.optics().geometry, &things);
            let sensor = WorldSensor::new(model, level, caster, Arc::clone(&people), seed, index as u64);
            (module.name.clone(), sensor)
        };
        let sensors = scene.site.modules.iter().enumerate().map(sensor).collect();
        Self { people, sensors }
    }

    /// The sensors by the names of their modules, in the order of the site.
    #[must_use]
    pub fn sensors(&self) -> &[(String, WorldSensor)] {
        &self.sensors
    }

    /// The sensor of a module.
    #[must_use]
    pub fn sensor(&self, module: &str) -> Option<&WorldSensor> {
        self.sensors.iter().find(|(name, _)| name == module).map(|(_, sensor)| sensor)
    }

    /// Everybody who is ever in the world, in the order of their numbers.
    #[must_use]
    pub fn people(&self) -> &[Person] {
        &self.people
    }

    /// Where everybody is at `time_s`, to a tenth of a millimetre.
    #[must_use]
    pub fn truth(&self, time_s: f64) -> Truth {
        let round = |metres: f64| (metres * 1e4).round() / 1e4;
        let place = |(index, person): (usize, &Person)| {
            let at = person.motion.stance(time_s)?.at;
            Some(TruePerson { id: index + 1, x: round(at.x), y: round(at.y) })
        };
        Truth { t: time_s, people: self.people.iter().enumerate().filter_map(place).collect() }
    }
}

fn person(index: usize, spec: &PersonSpec, seed: u64) -> Person {
    let mut body = Body::random(spec.section, &mut Stream::new(seed, Purpose::Person, [index as u64, 0]));
    let overrides = [
        (spec.half_width_m, &mut body.half_width_m),
        (spec.half_depth_m, &mut body.half_depth_m),
        (spec.thigh_radius_m, &mut body.thigh_radius_m),
        (spec.reflectance, &mut body.reflectance),
        (spec.clothing_bias_mm, &mut body.clothing_bias_mm),
    ];
    for (given, value) in overrides {
        *value = given.unwrap_or(*value);
    }
    let habit = Habit {
        speed_m_s: spec.speed_m_s,
        from_s: spec.from_s,
        until_s: spec.until_s.unwrap_or(f64::INFINITY),
        repeat: spec.repeat,
        heading_rad: spec.heading_deg.to_radians(),
        turn_rad_s: spec.turn_deg_s.to_radians(),
        sway_m: spec.sway_mm * 1e-3,
    };
    let points: Vec<WayPoint> = spec.route.iter().filter_map(|point| way_point(point)).collect();
    let mut stream = Stream::new(seed, Purpose::Walk, [index as u64, 0]);
    let name = if spec.name.is_empty() { format!("{}", index + 1) } else { spec.name.clone() };
    Person { name, body, motion: Motion::Route(Route::new(&points, habit, &mut stream)) }
}

fn way_point(point: &[f64]) -> Option<WayPoint> {
    let (x, y) = (point.first()?, point.get(1)?);
    Some(WayPoint { at: Point::new(*x, *y), wait_s: point.get(2).copied().unwrap_or(0.0) })
}

fn wall(wall: &Wall) -> Vec<Thing> {
    let opaque = wall.blocks.contains(&Blocks::Beams);
    let pieces = wall.points.windows(2).filter(|_| opaque);
    let outline =
        |piece: &[[f64; 2]]| Some(Outline::Segment((*piece.first()?).into(), (*piece.get(1)?).into()));
    let thing = |outline| Thing { outline, reflectance: wall.reflectance, low_m: 0.0, high_m: CEILING_M };
    pieces.filter_map(outline).map(thing).collect()
}

fn furniture(furniture: &Furniture) -> Vec<Thing> {
    let Furniture { reflectance, low_m, high_m, .. } = *furniture;
    let disc = furniture.disc.map(|[x, y, radius_m]| Outline::disc(Point::new(x, y), radius_m));
    let corners = furniture.polygon.iter().map(|corner| Point::from(*corner));
    let sides = corners.clone().zip(corners.cycle().skip(1)).map(|(from, to)| Outline::Segment(from, to));
    sides.chain(disc).map(|outline| Thing { outline, reflectance, low_m, high_m }).collect()
}
