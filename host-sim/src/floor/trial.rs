//! One run of an experiment with one tracker, and its figures, as paper B has them and some more.
//!
//! ```text
//!   variance across the way of each ID, mm²        the paper's figure: what is a line must be one
//!   right   the ID's place is within 0.5 m of its person and nearer to them than to the other
//!   swapped the ID's place is nearer to the other
//!   back    right within 1 s of the first reading after half a second or more without one
//! ```

use kehai::floor::Floor;
use kehai_tracking::floor::{Reading, patches};
use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;
use serde::{Deserialize, Serialize};

use super::gait::{Sole, Walker};
use super::host::{Host, site};
use super::panels::{Broken, reading};
use super::scene::{DURATION_S, Experiment, Scene};
use super::tags::{Camera, Tag};
use crate::baselines::condensation::{Area, Condensation, Joint, Settings};

/// Between two readings of the floor, s: 9 Hz.
const READING_S: f64 = 1.0 / 9.0;

/// Before this nothing is judged, s: the tags are found, and the filters settle.
pub(super) const SETTLED_S: f64 = 5.0;

/// Farthest that a place is right, m.
pub(super) const RIGHT_M: f64 = 0.5;

/// An ID that was silent for so long was lost, s, and is to be back within [`BACK_S`].
const SILENT_S: f64 = 0.5;
pub(super) const BACK_S: f64 = 1.0;

/// A way to find out who is where.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
pub enum Method {
    /// Ours: bodies from patches, and names.
    Kehai,
    /// The paper's.
    Condensation,
    /// The paper's without the separation of places and IDs.
    Joint,
}

impl Method {
    /// All, with their names in tables.
    pub const NAMED: [(Self, &'static str); 3] =
        [(Self::Kehai, "kehai"), (Self::Condensation, "condensation"), (Self::Joint, "condensation-joint")];
}

/// What a run shows.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Figures {
    /// Variance across the way of each ID, mm²; none where the way is no line.
    pub across_mm2: [Option<f64>; 2],
    /// Readings that were judged, of both IDs.
    pub judged: u64,
    /// Of them: right.
    pub right: u64,
    /// Of them: nearer to the other.
    pub swapped: u64,
    /// Times that an ID came back.
    pub times: u64,
    /// Of them: right within a second.
    pub back: u64,
}

enum Tracker {
    Kehai(Box<Host>),
    Condensation(Condensation),
    Joint(Joint),
}

impl Tracker {
    fn new(method: Method, site: Site, seed: u64) -> Self {
        let area = Area { middle: Point::default(), sides: Point::new(1.92, 1.92) };
        match method {
            Method::Kehai => Self::Kehai(Box::new(Host::new(site))),
            Method::Condensation => Self::Condensation(Condensation::new(0.0, area, Settings::PAPER, seed)),
            Method::Joint => Self::Joint(Joint::new(area, Settings::PAPER, seed)),
        }
    }

    fn read(&mut self, reading: &Reading) {
        let places =
            || patches(&reading.plan, &reading.down).iter().map(|patch| patch.middle).collect::<Vec<_>>();
        match self {
            Self::Kehai(host) => host.read(reading),
            Self::Condensation(filter) => filter.places(reading.at_s, &places()),
            Self::Joint(filter) => filter.places(reading.at_s, &places()),
        }
    }

    fn tag(&mut self, at_s: f64, tag: &Tag) {
        match self {
            Self::Kehai(host) => host.tag(at_s, tag),
            Self::Condensation(filter) => filter.id(tag.id, tag.at),
            Self::Joint(filter) => filter.id(tag.id, at_s, tag.at),
        }
    }

    fn place_of(&self, id: u64) -> Option<Point> {
        match self {
            Self::Kehai(host) => host.place_of(id),
            Self::Condensation(filter) => filter.place_of(id),
            Self::Joint(filter) => filter.place_of(id),
        }
    }
}

/// Runs an experiment.
#[must_use]
pub fn run(experiment: Experiment, method: Method, seed: u64) -> Figures {
    let scene = Scene::new(experiment, seed);
    let mut tracker = Tracker::new(method, site(&scene.plan), seed);
    let mut camera = Camera::new(scene.camera, seed);
    let Some(mut floor) = Floor::new(scene.plan.columns, scene.plan.rows) else { return Figures::default() };
    let mut judge = Judge::new(experiment.across());
    let mut number = 0_u32;
    loop {
        let at_s = f64::from(number) * READING_S;
        if at_s > DURATION_S {
            return judge.figures();
        }
        while camera.next_s() <= at_s {
            let read_s = camera.next_s();
            let person = |(id, walker): (u64, &Walker)| {
                let (at, ahead) = walker.at(read_s);
                (id, at, ahead)
            };
            let people: Vec<_> = (1..).zip(&scene.walkers).map(person).collect();
            for tag in camera.read(&people) {
                tracker.tag(read_s, &tag);
                judge.read(tag.id, read_s);
            }
        }
        let soles: Vec<Sole> = scene.walkers.iter().flat_map(|walker| walker.soles(at_s)).collect();
        let bits = reading(&scene.plan, &soles, &Broken::default());
        // As many bits as the floor has panels.
        let _ = floor.read(bits.bytes(scene.plan.panels()));
        let down = floor.pressed();
        tracker.read(&Reading { floor: 0, plan: scene.plan, at_s, down, faulty: Vec::new() });
        if at_s >= SETTLED_S {
            let truth = scene.walkers.clone().map(|walker| walker.at(at_s).0);
            judge.look(at_s, truth, [1, 2].map(|id| tracker.place_of(id)));
        }
        number += 1;
    }
}

/// Compares places with the truth.
struct Judge {
    across: Option<Point>,
    places: [Vec<f64>; 2],
    /// Of each ID, when it was read last, and since when it has to be right again, s.
    read_s: [f64; 2],
    back_since_s: [Option<f64>; 2],
    figures: Figures,
}

impl Judge {
    fn new(across: Option<Point>) -> Self {
        Self {
            across,
            places: [Vec::new(), Vec::new()],
            read_s: [f64::NEG_INFINITY; 2],
            back_since_s: [None; 2],
            figures: Figures::default(),
        }
    }

    fn read(&mut self, id: u64, at_s: f64) {
        let index = usize::from(id == 2);
        let silent_s = at_s - self.read_s[index];
        if silent_s.is_finite() && silent_s > SILENT_S && at_s >= SETTLED_S {
            self.figures.times += 1;
            self.back_since_s[index] = Some(at_s);
        }
        self.read_s[index] = at_s;
    }

    fn look(&mut self, at_s: f64, truth: [Point; 2], found: [Option<Point>; 2]) {
        for (index, found) in found.into_iter().enumerate() {
            let (own, other) = (truth[index], truth[1 - index]);
            let off = |to: Point| found.map_or(f64::INFINITY, |found| (found - to).length());
            let right = off(own) < RIGHT_M && off(own) < off(other);
            self.figures.judged += 1;
            self.figures.right += u64::from(right);
            self.figures.swapped += u64::from(off(other) < off(own));
            if let Some(since_s) = self.back_since_s[index] {
                if right && at_s - since_s <= BACK_S {
                    self.figures.back += 1;
                }
                if right || at_s - since_s > BACK_S {
                    self.back_since_s[index] = None;
                }
            }
            if let (Some(across), Some(found)) = (self.across, found) {
                self.places[index].push(found.dot(across) * 1000.0);
            }
        }
    }

    fn figures(self) -> Figures {
        let variance = |places: &[f64]| {
            let count = places.len() as f64;
            let mean = places.iter().sum::<f64>() / count;
            (count > 0.0)
                .then(|| places.iter().map(|place| (place - mean) * (place - mean)).sum::<f64>() / count)
        };
        // A person who is awaited when the run ends has not come back in time only if the second is over.
        let waited = self.back_since_s.iter().flatten().count() as u64;
        let across_mm2 = [variance(&self.places[0]), variance(&self.places[1])];
        Figures { across_mm2, times: self.figures.times - waited, ..self.figures }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_figures() {
        let one = || run(Experiment::Crossing, Method::Condensation, 5);
        assert_eq!(one(), one());
    }

    #[test]
    fn a_place_counts_as_right_near_its_person_only() {
        let mut judge = Judge::new(Some(Point::new(1.0, 0.0)));
        let truth = [Point::new(0.0, 0.0), Point::new(1.0, 0.0)];
        judge.read(1, 5.0);
        judge.look(5.1, truth, [Some(Point::new(0.1, 0.0)), Some(Point::new(0.1, 0.0))]);
        judge.look(5.2, truth, [Some(Point::new(0.3, 0.0)), None]);
        // Silent for 3 s, then read, and right half a second later.
        judge.read(1, 8.0);
        judge.look(8.1, truth, [Some(Point::new(0.9, 0.0)), None]);
        judge.look(8.5, truth, [Some(Point::new(0.2, 0.0)), None]);
        let figures = judge.figures();
        assert_eq!((figures.judged, figures.right, figures.swapped), (8, 3, 2));
        assert_eq!((figures.times, figures.back), (1, 1));
        let mean = (100.0 + 300.0 + 900.0 + 200.0) / 4.0;
        let square = |place: f64| (place - mean) * (place - mean);
        let variance = (square(100.0) + square(300.0) + square(900.0) + square(200.0)) / 4.0;
        assert_eq!(figures.across_mm2[0], Some(variance));
    }
}
