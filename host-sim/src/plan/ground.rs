//! The ground that is to be seen: the cells of the zones, each time with other people standing about.
//!
//! ```text
//!   crowd 0     crowd 1          · a cell of 0.25 m: somewhere one more person may stand
//!   · · · ·     · · · ·          ● a person of the sample; the cells a body covers are left out, as no other person stands there
//!   · ● · ·     ● · · ·          share seen = how likely a person among the others is seen
//!   · · · ●     · · ● ·
//! ```

use kehai_tracking::geometry::{bounds, inside};

use super::Task;
use super::bits::{Bits, WORD};
use crate::world::body::{Body, Section};
use crate::world::geometry::Point;
use crate::world::motion::{Motion, Track};
use crate::world::person::Person;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::{Scene, SceneError};
use crate::world::site::{Module, Site, Zone};
use crate::world::walkable::Walkable;

/// Side of a cell, m: that of the coverage which calibration prints.
const CELL_M: f64 = 0.25;

/// Most cells: 1250 m²; a larger site has larger cells.
const MOST_CELLS: f64 = 20_000.0;

/// Crowds of a sample: a cell that is seen behind half of them is known to 0.09, and the mean over a room of a hundred cells
/// and more to less than 0.01.
const CROWDS: usize = 32;

/// People stand no nearer to each other, m: as in the densest gathering of the laboratory.
const APART_M: f64 = 0.5;

/// Cells so near to a person are covered by the body, m: half its width.
const BODY_M: f64 = 0.25;

/// As many tries to find a place that is far enough from all others; then the crowd has one person less.
const TRIES: usize = 50;

/// A cell of a zone.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell {
    /// Its middle.
    pub at: Point,
    /// Number of its zone among the planned ones.
    pub zone: usize,
}

/// The cells, and the crowds among which they are looked at.
#[derive(Clone, Debug)]
pub struct Ground {
    /// The zones.
    pub zones: Vec<Zone>,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// All cells.
    pub cells: Vec<Cell>,
    /// People who stand about, time after time.
    pub crowds: Vec<Vec<Person>>,
    /// Cells that no body covers, crowd after crowd.
    pub open: Bits,
}

/// The zones that modules are placed for: those that count, or all of them if none does.
#[must_use]
pub fn zones(site: &Site) -> Vec<Zone> {
    let counting: Vec<Zone> = site.zones.iter().filter(|zone| zone.count).cloned().collect();
    if counting.is_empty() { site.zones.clone() } else { counting }
}

impl Ground {
    /// Of a task.
    ///
    /// # Errors
    /// As [`Task::scene`].
    pub fn of(task: &Task) -> Result<Self, SceneError> {
        let zones = zones(&task.site);
        let (cell_m, cells) = cells(&zones);
        let scene = task.scene()?;
        let standing = standing(&scene, &zones);
        let crowds: Vec<Vec<Person>> =
            (0..CROWDS as u64).map(|crowd| gather(task, &standing, crowd)).collect();
        let mut ground = Self { zones, cell_m, cells, crowds, open: Bits::new(0) };
        let mut open = Bits::new(ground.bits());
        for (number, crowd) in ground.crowds.iter().enumerate() {
            for (cell, Cell { at, .. }) in ground.cells.iter().enumerate() {
                let covers = |person: &Person| {
                    person.motion.stance(0.0).is_some_and(|stance| (stance.at - *at).length() < BODY_M)
                };
                if !crowd.iter().any(covers) {
                    open.set(ground.bit(number, cell));
                }
            }
        }
        ground.open = open;
        Ok(ground)
    }

    /// The number of a cell behind a crowd; every crowd begins with a word of its own.
    #[must_use]
    pub fn bit(&self, crowd: usize, cell: usize) -> usize {
        crowd * self.cells.len().next_multiple_of(WORD) + cell
    }

    /// As many numbers as a set needs.
    #[must_use]
    pub fn bits(&self) -> usize {
        self.bit(self.crowds.len(), 0)
    }

    /// The area of all cells, m².
    #[must_use]
    pub fn m2(&self) -> f64 {
        self.cells.len() as f64 * self.cell_m * self.cell_m
    }
}

/// The cells in the zones; one in two of them belongs to the first.
fn cells(zones: &[Zone]) -> (f64, Vec<Cell>) {
    let corners: Vec<Vec<Point>> = zones.iter().map(Zone::corners).collect();
    let Some((low, high)) = bounds(corners.iter().flatten().copied()) else { return (CELL_M, Vec::new()) };
    let size = high - low;
    let cell_m = CELL_M.max((size.x * size.y / MOST_CELLS).sqrt());
    let (columns, rows) = ((size.x / cell_m).ceil() as u32, (size.y / cell_m).ceil() as u32);
    let zone_of = |at: Point| corners.iter().position(|polygon| inside(at, polygon));
    let middles = (0..rows).flat_map(|row| {
        (0..columns)
            .map(move |column| low + Point::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * cell_m)
    });
    (cell_m, middles.filter_map(|at| Some(Cell { at, zone: zone_of(at)? })).collect())
}

/// Where people can stand in the zones.
#[must_use]
pub fn standing(scene: &Scene, zones: &[Zone]) -> Vec<Point> {
    let corners: Vec<Vec<Point>> = zones.iter().map(Zone::corners).collect();
    let places = Walkable::of(scene, &corners.concat()).places();
    places.into_iter().filter(|at| corners.iter().any(|polygon| inside(*at, polygon))).collect()
}

/// All but one of the people, each somewhere.
fn gather(task: &Task, standing: &[Point], crowd: u64) -> Vec<Person> {
    let mut places: Vec<Point> = Vec::new();
    let mut people = Vec::new();
    for number in 1..task.people as u64 {
        let mut stream = Stream::new(task.seed, Purpose::Plan, [crowd, number]);
        let mut somewhere = || standing.get((stream.uniform() * standing.len() as f64) as usize).copied();
        let mut tries = std::iter::repeat_with(&mut somewhere).take(TRIES).flatten();
        let is_apart = |at: &Point| places.iter().all(|other| (*other - *at).length() >= APART_M);
        let Some(at) = tries.find(is_apart) else { continue };
        places.push(at);
        let body = Body::random(Section::Torso, &mut stream);
        let heading_rad = stream.between(-std::f64::consts::PI, std::f64::consts::PI);
        people.push(Person {
            name: number.to_string(),
            body,
            // Two moments of one place, around the one of the revolution.
            motion: Motion::Track(Track::new(-1.0, 2.0, &[at, at], heading_rad)),
            crouches_s: None,
            gestures: None,
            reaches_s: Vec::new(),
        });
    }
    people
}

impl Task {
    /// The modules that stay: those that have a place. What another one sees is not used.
    pub fn kept(&self) -> impl Iterator<Item = &Module> {
        self.site.modules.iter().filter(|module| module.placed)
    }

    /// The modules that are left out, as they have no place.
    pub fn left_out(&self) -> impl Iterator<Item = &Module> {
        self.site.modules.iter().filter(|module| !module.placed)
    }
}
