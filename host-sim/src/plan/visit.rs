//! People on a site as the simulator has them while it judges a layout: they come in, walk about, and stand here and there.
//!
//! ```text
//!   0 s          10 s                                            70 s
//!   │ learning    │ in through an entry, one after another …      │
//!   │ no people   │ to a place in a zone, stand 3–10 s, to the next one
//! ```
//!
//! The same seed has the same people on the same ways, whatever the layout: layouts are compared in pairs.

use super::Task;
use super::ground::{standing, zones};
use crate::world::body::Section;
use crate::world::geometry::Point;
use crate::world::person_spec::PersonSpec;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::{Scene, SensorSpec};
use crate::world::site::{Entry, Module, Site, Zone};
use crate::world::walkable::Walkable;
use kehai_tracking::geometry::centroid;

/// Until then the site is empty and backgrounds are learned, s: as in the scenes of the laboratory.
const EMPTY_S: f64 = 10.0;

/// People are there for so long, s: five to ten places each.
const VISIT_S: f64 = 60.0;

/// From one person through an entry to the next, s.
const HEADWAY_S: (f64, f64) = (1.5, 3.0);

/// How long they stand at a place, s.
const STANDS_S: (f64, f64) = (3.0, 10.0);

/// How fast they walk, m/s: slow and brisk, as people of a gathering.
const WALKS_M_S: (f64, f64) = (0.7, 1.2);

/// So far outside of an entry they begin, m.
const OUTSIDE_M: f64 = 1.0;

/// Places a person goes to at most within the time, if each were the next step away.
const MOST_PLACES: usize = 20;

/// Why no people can be put on a site.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NoVisit {
    /// Nowhere in the zones can one stand.
    #[error("no person can stand in the zones: they are narrower than a person, or walls fill them")]
    NoPlace,
    /// People cannot come in.
    #[error("no way leads from entry \"{0}\" into a zone: is there a wall across it?")]
    NoWay(String),
    /// The scene is refused.
    #[error("{0}")]
    Scene(String),
}

/// The people of a task, on their ways.
#[derive(Clone, Debug)]
pub struct Visitors {
    task: Task,
    ground: Walkable,
    standing: Vec<Point>,
    starts: Vec<Point>,
}

impl Visitors {
    /// Of a task.
    ///
    /// # Errors
    /// People cannot walk there.
    pub fn of(task: &Task) -> Result<Self, NoVisit> {
        let scene = task.scene().map_err(|error| NoVisit::Scene(error.to_string()))?;
        let zones = zones(&task.site);
        let starts: Vec<(&Entry, Point)> =
            task.site.entries.iter().map(|entry| (entry, outside(entry, &zones))).collect();
        let corners = zones.iter().flat_map(Zone::corners);
        let also: Vec<Point> = corners.chain(starts.iter().map(|(_, at)| *at)).collect();
        let ground = Walkable::of(&scene, &also);
        let mut standing = standing(&scene, &zones);
        let Some(&first) = standing.first() else { return Err(NoVisit::NoPlace) };
        for (entry, start) in &starts {
            if !standing.iter().any(|at| !ground.steps(*start, *at).is_empty()) {
                return Err(NoVisit::NoWay(entry.name.clone()));
            }
        }
        // What is walled off from where people come in is nowhere to walk to.
        let from = starts.first().map_or(first, |(_, at)| *at);
        let reached = ground.reached(from);
        standing.retain(|at| reached.holds(*at));
        let starts = starts.into_iter().map(|(_, at)| at).collect();
        Ok(Self { task: task.clone(), ground, standing, starts })
    }

    /// The scene of a seed with modules in these places.
    ///
    /// # Errors
    /// The scene is refused.
    pub fn scene(&self, modules: &[Module], seed: u64) -> Result<Scene, NoVisit> {
        let mut scene = self.task.scene().map_err(|error| NoVisit::Scene(error.to_string()))?;
        scene.site = Site { modules: modules.to_vec(), ..self.task.site.clone() };
        let sensor = |module: &Module| SensorSpec {
            module: module.name.clone(),
            model: self.task.model,
            noise: crate::world::noise::NoiseLevel::default(),
        };
        scene.sensors = modules.iter().map(sensor).collect();
        scene.duration_s = EMPTY_S + VISIT_S;
        scene.avoid = true;
        let mut from_s = EMPTY_S;
        for number in 0..self.task.people as u64 {
            let mut stream = Stream::new(seed, Purpose::Plan, [u64::MAX, number]);
            scene.people.push(self.person(number, from_s, &mut stream)?);
            from_s += stream.between(HEADWAY_S.0, HEADWAY_S.1);
        }
        Ok(scene)
    }

    /// A person who comes at `from_s`.
    fn person(&self, number: u64, from_s: f64, stream: &mut Stream) -> Result<PersonSpec, NoVisit> {
        let start = one_of(&self.starts, stream).or_else(|| one_of(&self.standing, stream));
        let mut at = start.ok_or(NoVisit::NoPlace)?;
        let mut route = vec![vec![at.x, at.y]];
        for _ in 0..MOST_PLACES {
            let Some(place) = one_of(&self.standing, stream) else { break };
            let corners = self.ground.corners(at, place);
            let between = corners.get(1..corners.len().saturating_sub(1)).unwrap_or_default();
            route.extend(between.iter().map(|corner| vec![corner.x, corner.y]));
            if !corners.is_empty() {
                route.push(vec![place.x, place.y, stream.between(STANDS_S.0, STANDS_S.1)]);
                at = place;
            }
        }
        let mut person = PersonSpec::along(route);
        person.section = Section::Torso;
        person.name = format!("visitor {}", number + 1);
        person.from_s = from_s;
        person.speed_m_s = stream.between(WALKS_M_S.0, WALKS_M_S.1);
        Ok(person)
    }
}

fn one_of(places: &[Point], stream: &mut Stream) -> Option<Point> {
    places.get((stream.uniform() * places.len() as f64) as usize).copied()
}

/// Where people are before they come through an entry: on the side that is farther from the zone it leads to.
fn outside(entry: &Entry, zones: &[Zone]) -> Point {
    let (from, to) = entry.ends();
    let middle = (from + to) * 0.5;
    let across = (to - from).left() * (OUTSIDE_M / (to - from).length().max(1e-9));
    let leads_to = |zone: &&Zone| entry.zone.as_ref().is_none_or(|name| *name == zone.name);
    let zone = zones.iter().find(leads_to).or(zones.first());
    let inner = zone.map_or(middle, |zone| centroid(&zone.corners()));
    let far_m = |at: Point| (at - inner).length();
    if far_m(middle + across) > far_m(middle - across) { middle + across } else { middle - across }
}
