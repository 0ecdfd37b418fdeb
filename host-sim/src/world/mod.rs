//! A simulated world: people walk among walls and furniture, and range finders measure them. The ground truth.
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

pub mod arrangement;
mod avoidance;
pub mod body;
mod built_in;
pub mod crowd;
pub mod door;
pub mod gathering;
pub mod geometry;
pub mod installed;
pub mod mishap;
pub mod motion;
pub mod moving;
pub mod noise;
pub mod optics;
pub mod person;
pub mod person_spec;
pub mod placed;
pub mod prop;
pub mod random;
pub mod raycast;
pub mod scene;
pub mod sensor;
pub mod shape;
pub mod standing;
mod superellipse;
pub mod told;
pub mod trajectory;
pub mod upright;
pub mod variation;
pub(crate) mod visit;
pub mod walkable;
pub mod walker;
pub mod wandering;

pub use kehai_tracking::site;

use std::sync::Arc;

use body::{Body, Section};
use gathering::Gathering;
use geometry::{Outline, Point};
use mishap::Mishap;
use motion::{Motion, Track};
use moving::Moving;
use person::Person;
use placed::Placed;
use prop::Prop;
use random::{Purpose, Stream};
use raycast::{Caster, Thing};
use scene::{Furniture, PersonSpec, Scene};
use sensor::WorldSensor;
use serde::{Deserialize, Serialize};
use shape::{Family, Gestures};
use site::{Blocks, Wall};
use trajectory::Recorded;
use walker::{Habit, Route, WayPoint};
use wandering::Wanderer;

/// Walls reach from the floor to the ceiling, above every plane.
const CEILING_M: f64 = 3.0;
/// Time from reaching a place to having put something down there.
const PUTTING_DOWN_S: f64 = 0.8;
/// A door scenario goes on for so long after the last person is gone.
const AFTERWARDS_S: f64 = 6.0;

/// A scene with a seed: all that is random in it is decided.
#[derive(Clone, Debug)]
pub struct World {
    duration_s: f64,
    events: Option<Events>,
    people: Arc<[Person]>,
    sensors: Vec<(String, WorldSensor)>,
}

/// The times of a door scenario.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Events {
    /// Number of people.
    pub people: usize,
    /// When the last person had taken a place.
    pub all_in_s: f64,
    /// When the door opened.
    pub door_opens_s: f64,
    /// When the last person had left the counted area.
    pub empty_s: f64,
}

/// The positions of all people at one moment: a line of `truth.jsonl`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Truth {
    /// Time in seconds.
    pub t: f64,
    /// All people in the world.
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

/// What a run adds to its scene: people and things that are moved from outside while the simulation runs, and faults.
#[derive(Default)]
pub struct More {
    /// People beside the scene's own.
    pub people: Vec<Person>,
    /// Things that move beside the scene's own.
    pub moving: Vec<Moving>,
    /// Faults of devices.
    pub mishaps: Vec<Mishap>,
}

impl World {
    /// The scene under `seed`.
    #[must_use]
    pub fn new(scene: &Scene, seed: u64) -> Self {
        Self::with(scene, seed, More::default())
    }

    /// The scene under `seed`, with additions.
    #[must_use]
    pub fn with(scene: &Scene, seed: u64, more: More) -> Self {
        let wanderer = |(index, spec)| wanderer(scene, index, spec, seed);
        let wanderers: Vec<Wanderer> = scene.people.iter().enumerate().map(wanderer).collect();
        let mut people = scripted(scene, &wanderers, seed);
        let props: Vec<Moving> =
            props(scene, &wanderers, &people).map(|prop| Moving::Prop(Box::new(prop))).collect();
        let placed: Vec<Moving> =
            placed(scene, &wanderers).map(|placed| Moving::Placed(Box::new(placed))).collect();
        let mut doors = scene.doors.clone();
        let mut duration_s = scene.duration_s;
        let mut events = None;
        if let Some(spec) = &scene.gathering {
            let gathering = Gathering::simulate(spec, seed, &obstacles(scene));
            duration_s = duration_s.max(gathering.end_s + AFTERWARDS_S);
            let Gathering { all_in_s, door_opens_s, empty_s, .. } = gathering;
            events = Some(Events { people: gathering.people.len(), all_in_s, door_opens_s, empty_s });
            for door in doors.iter_mut().filter(|door| door.opens_s.is_none()) {
                door.opens_s = Some(door_opens_s);
                door.closes_s = Some(gathering.end_s);
            }
            let gestures = |index: usize| {
                (spec.bodies == Family::Arms).then_some(Gestures { seed, person: index as u64 })
            };
            people.extend(gathering.people.into_iter().enumerate().map(|(index, (body, track))| Person {
                name: format!("guest {}", index + 1),
                body,
                motion: Motion::Track(track),
                crouches_s: None,
                gestures: gestures(index),
                reaches_s: Vec::new(),
            }));
        }
        people.extend(scene.recorded.iter().flat_map(recorded).enumerate().map(
            |(index, (section, track))| {
                let mut stream = Stream::new(seed, Purpose::Person, [index as u64, 1]);
                let body = Body::random(section, &mut stream);
                let name = format!("recorded {}", index + 1);
                Person {
                    name,
                    body,
                    motion: Motion::Track(track),
                    crouches_s: None,
                    gestures: None,
                    reaches_s: Vec::new(),
                }
            },
        ));
        people.extend(more.people);
        let people: Arc<[Person]> = people.into();
        let doors = doors.into_iter().map(Moving::Door);
        let curtains = scene.curtains.iter().cloned().map(Moving::Curtain);
        let fans = scene.fans.iter().cloned().map(Moving::Fan);
        let moving: Arc<[Moving]> =
            doors.chain(curtains).chain(fans).chain(props).chain(placed).chain(more.moving).collect();
        let things = things(scene);
        let sensor = |(index, module): (usize, &site::Module)| {
            let spec = scene.sensors.iter().find(|spec| spec.module == module.name);
            let (model, level) = spec.map_or_else(Default::default, |spec| (spec.model, spec.noise));
            let (upside_down, geometry) = (module.upside_down, model.optics().geometry);
            let caster = Caster::hung(module.pose(), module.height_m, upside_down, geometry, &things);
            let seen = (Arc::clone(&people), Arc::clone(&moving));
            let mut sensor = WorldSensor::new(model, level, caster, seen, seed, index as u64);
            for mishap in more.mishaps.iter().filter(|mishap| mishap.module == index) {
                let (pose, height_m) = mishap.place(module.pose(), module.height_m);
                let mut around = things.clone();
                around.extend(mishap.cover(pose.at));
                let caster = Caster::hung(pose, height_m, upside_down, geometry, &around);
                sensor.replace_caster(mishap.from_s, caster);
            }
            (module.name.clone(), sensor)
        };
        let mut sensors: Vec<(String, WorldSensor)> =
            scene.site.modules.iter().enumerate().map(sensor).collect();
        if scene.cross_talk {
            let others: Vec<WorldSensor> = sensors.iter().map(|(_, sensor)| sensor.clone()).collect();
            sensors.iter_mut().for_each(|(_, sensor)| sensor.look_at(&others));
        }
        Self { duration_s, events, people, sensors }
    }

    /// Duration of the scene.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The times of the door scenario, if the scene has one.
    #[must_use]
    pub const fn events(&self) -> Option<Events> {
        self.events
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

    /// All people of the world, present now or not, in the order of their numbers.
    #[must_use]
    pub fn people(&self) -> &[Person] {
        &self.people
    }

    /// The positions of all people at `time_s`, to a tenth of a millimetre.
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

fn recorded(recorded: &Recorded) -> impl Iterator<Item = (Section, Track)> {
    let section = recorded.section;
    recorded.tracks().into_iter().map(move |track| (section, track))
}

/// The people of the script.
fn scripted(scene: &Scene, wanderers: &[Wanderer], seed: u64) -> Vec<Person> {
    let motions: Vec<Motion> = if scene.avoid {
        let tracks = wandering::simulate(wanderers, &obstacles(scene), scene.duration_s);
        tracks.into_iter().map(Motion::Track).collect()
    } else {
        let route = |(index, wanderer): (usize, &Wanderer)| {
            let mut stream = Stream::new(seed, Purpose::Walk, [index as u64, 0]);
            Motion::Route(Route::new(&wanderer.points, wanderer.habit, &mut stream))
        };
        wanderers.iter().enumerate().map(route).collect()
    };
    let person = |(index, ((spec, wanderer), motion)): (usize, ((&PersonSpec, &Wanderer), Motion))| {
        let name = if spec.name.is_empty() { format!("{}", index + 1) } else { spec.name.clone() };
        let by_height = spec.section == Section::ByHeight;
        let gestures = by_height.then_some(Gestures { seed, person: index as u64 });
        let reaches_s = spec.reaches_at.iter().filter_map(|index| wanderer.stay_s(*index)).collect();
        Person { name, body: wanderer.body, motion, crouches_s: spec.crouches_s, gestures, reaches_s }
    };
    scene.people.iter().zip(wanderers).zip(motions).enumerate().map(person).collect()
}

/// What people of the script carry.
fn props(scene: &Scene, wanderers: &[Wanderer], people: &[Person]) -> impl Iterator<Item = Prop> {
    scene.carried.iter().filter_map(|carried| {
        let index = scene.people.iter().position(|person| person.name == carried.by)?;
        let (wanderer, person) = (wanderers.get(index)?, people.get(index)?);
        let put_down_s = carried.puts_down_at.map_or(f64::INFINITY, |point| {
            walker::arrival_s(&wanderer.points, &wanderer.habit, point) + PUTTING_DOWN_S
        });
        Some(Prop::new(carried.clone(), person.motion.clone(), put_down_s))
    })
}

/// Things that people of the script move to and fro.
fn placed(scene: &Scene, wanderers: &[Wanderer]) -> impl Iterator<Item = Placed> {
    scene.placed.iter().filter_map(|spec| {
        let wanderer = wanderers.get(scene.people.iter().position(|person| person.name == spec.by)?)?;
        let reached = |index: &usize| wanderer.stay_s(*index).map_or(f64::INFINITY, |[from_s, _]| from_s);
        Some(Placed::new(spec.clone(), spec.moved_at.iter().map(reached)))
    })
}

fn wanderer(scene: &Scene, index: usize, spec: &PersonSpec, seed: u64) -> Wanderer {
    let mut body = Body::random(spec.section, &mut Stream::new(seed, Purpose::Person, [index as u64, 0]));
    if spec.section == Section::ByHeight {
        body = body.of(Family::Arms, &mut Stream::new(seed, Purpose::Shape, [index as u64, 1]));
    }
    let overrides = [
        (spec.half_width_m, &mut body.half_width_m),
        (spec.half_depth_m, &mut body.half_depth_m),
        (spec.thigh_radius_m, &mut body.thigh_radius_m),
        (spec.reflectance, &mut body.reflectance),
        (spec.clothing_bias_mm, &mut body.clothing_bias_mm),
        (spec.top_m, &mut body.top_m),
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
        shift_m: spec.shift_mm * 1e-3,
        shift_every_s: spec.shift_every_s,
    };
    let mut points: Vec<WayPoint> = spec.route.iter().filter_map(|point| way_point(point)).collect();
    let key = spec.group.map_or([index as u64, 1], |group| [group, 2]);
    let mut stream = Stream::new(seed, Purpose::Crowd, key);
    let mut aside = || stream.between(-1.0, 1.0) * spec.scatter_m;
    points.iter_mut().for_each(|point| point.at = point.at + Point::new(aside(), aside()));
    let carried = scene.carried.iter().enumerate().filter(|(_, carried)| carried.by == spec.name);
    carried.for_each(|(number, carried)| carried.lead(&mut points, seed, number));
    Wanderer { body, points, habit }
}

/// What beams meet of all that stands still.
#[must_use]
pub fn things(scene: &Scene) -> Vec<Thing> {
    let walls = scene.site.walls.iter().flat_map(|wall| opaque(wall, scene.wall_reflectance));
    walls.chain(scene.furniture.iter().flat_map(furniture)).collect()
}

/// What people cannot walk through.
#[must_use]
pub fn obstacles(scene: &Scene) -> Vec<Outline> {
    let solid = |wall: &&Wall| wall.stops(Blocks::People);
    let walls = scene.site.walls.iter().filter(solid).flat_map(sides);
    walls.chain(scene.furniture.iter().flat_map(furniture).map(|thing| thing.outline)).collect()
}

fn way_point(point: &[f64]) -> Option<WayPoint> {
    let (x, y) = (point.first()?, point.get(1)?);
    Some(WayPoint { at: Point::new(*x, *y), wait_s: point.get(2).copied().unwrap_or(0.0) })
}

fn sides(wall: &Wall) -> Vec<Outline> {
    let piece =
        |piece: &[[f64; 2]]| Some(Outline::Segment((*piece.first()?).into(), (*piece.get(1)?).into()));
    wall.points.windows(2).filter_map(piece).collect()
}

/// What beams meet of a wall; of glass, nothing.
fn opaque(wall: &Wall, reflectance: f64) -> Vec<Thing> {
    let stops_beams = wall.stops(Blocks::Beams);
    let mirror = wall.mirror;
    let thing = |outline| Thing { outline, reflectance, low_m: 0.0, high_m: CEILING_M, mirror };
    sides(wall).into_iter().filter(|_| stops_beams).map(thing).collect()
}

fn furniture(furniture: &Furniture) -> Vec<Thing> {
    let Furniture { reflectance, low_m, high_m, .. } = *furniture;
    let disc = furniture.disc.map(|[x, y, radius_m]| Outline::disc(Point::new(x, y), radius_m));
    let corners = furniture.polygon.iter().map(|corner| Point::from(*corner));
    let sides = corners.clone().zip(corners.cycle().skip(1)).map(|(from, to)| Outline::Segment(from, to));
    sides.chain(disc).map(|outline| Thing { outline, reflectance, low_m, high_m, mirror: false }).collect()
}
