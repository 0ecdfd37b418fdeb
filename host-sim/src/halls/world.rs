//! Four halls of 6 m: their walls, modules and people, and the site of each area.
//!
//! ```text
//!   12 ┌m────────┬────────m┐     m  a module of one hall      b  at a border, in the files of both neighbours
//!      │  north  b  north  │
//!      │  -west  ┆  -east  │     ┆  a doorway of 2 m, or the whole side is open: `Borders`
//!    6 ├──b┄┄───mmm───┄┄b──┤
//!      │  south  ┆  south  │     people walk to places in their hall and in the next ones
//!      │  -west  b  -east  │
//!    0 └m────────┴────────m┘
//!      0         6        12
//! ```

use kehai_tracking::geometry::Point;
use kehai_tracking::tracker::Selected;

use crate::world::person_spec::PersonSpec;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::{Scene, SceneError};
use crate::world::site::{Module, Site, Wall, Zone};

/// A side of a hall, m: a URG-04LX in one corner sees an ordinary person in the middle, and not in the other.
pub const HALL_M: f64 = 6.0;

/// Half the width of a doorway, m.
const HALF_DOORWAY_M: f64 = 1.0;

/// The middle of each doorway along its wall, m from the corner of a hall.
const DOORWAY_M: f64 = 3.0;

/// A sensor stands so far from its wall, m.
const OFF_WALL_M: f64 = 0.1;

/// No person appears before this, s: the modules learn the empty halls.
pub const LEARNED_S: f64 = 12.0;

/// From the last person's first step until all have been found, s. Judged from then on.
const FOUND_S: f64 = 3.0;

/// People appear one after the other, s apart.
const APART_S: f64 = 0.2;

/// Places are so far from walls and from borders, m.
const INSIDE_M: f64 = 1.0;

/// The names of the areas, which are those of their zones: row by row, from the south-west.
pub const AREAS: [&str; 4] = ["south-west", "south-east", "north-west", "north-east"];

/// What is between two halls.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub enum Borders {
    /// A wall with a doorway of 2 m
    Doorways,
    /// Nothing: people cross anywhere
    Open,
}

/// What is played.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Halls {
    /// Between the halls.
    pub borders: Borders,
    /// How many people.
    pub people: usize,
    /// How long, s.
    pub seconds: f64,
    /// Where they walk.
    pub seed: u64,
    /// The module of this number falls silent half-way.
    pub silent: Option<usize>,
    /// The tracker of all halls, and of each.
    pub tracker: Selected,
}

/// The hall of this number: its corner with the smaller coordinates.
fn corner(hall: usize) -> Point {
    Point::new((hall % 2) as f64, (hall / 2) as f64) * HALL_M
}

/// How far within a hall a place is, m; negative outside.
#[must_use]
pub fn depth_m(hall: usize, at: Point) -> f64 {
    let from = at - corner(hall);
    [from.x, from.y, HALL_M - from.x, HALL_M - from.y].into_iter().fold(f64::INFINITY, f64::min)
}

impl Halls {
    /// From when on all are judged, s.
    #[must_use]
    pub fn judged_from_s(&self) -> f64 {
        LEARNED_S + APART_S * self.people as f64 + FOUND_S
    }

    /// The number of a module, by its name.
    #[must_use]
    pub fn module(&self, name: &str) -> Option<usize> {
        self.modules().iter().position(|module| module.name == name)
    }

    /// The scene: the site of all halls, and the people.
    ///
    /// # Errors
    /// None: what it is made from is sound.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::parse("halls", "avoid = true\n[site]\n")?;
        scene.about = "four halls as one site: people walk from hall to hall".into();
        (scene.duration_s, scene.seed, scene.site) = (self.seconds, self.seed, self.site());
        scene.people = (0..self.people).map(|person| self.person(person)).collect();
        Ok(scene)
    }

    fn site(&self) -> Site {
        let far = 2.0 * HALL_M;
        let mut walls = vec![Wall::of(vec![[0.0, 0.0], [far, 0.0], [far, far], [0.0, far], [0.0, 0.0]])];
        if self.borders == Borders::Doorways {
            let [low, high] = [DOORWAY_M - HALF_DOORWAY_M, DOORWAY_M + HALF_DOORWAY_M];
            for [from, to] in [[0.0, low], [high, HALL_M + low], [HALL_M + high, far]] {
                walls.push(Wall::of(vec![[HALL_M, from], [HALL_M, to]]));
                walls.push(Wall::of(vec![[from, HALL_M], [to, HALL_M]]));
            }
        }
        let zone = |(hall, name): (usize, &&str)| {
            let Point { x, y } = corner(hall);
            let polygon = vec![[x, y], [x + HALL_M, y], [x + HALL_M, y + HALL_M], [x, y + HALL_M]];
            Zone::counted((*name).into(), polygon)
        };
        let zones = AREAS.iter().enumerate().map(zone).collect();
        Site { modules: self.modules(), walls, zones, ..Site::default() }
    }

    fn modules(&self) -> Vec<Module> {
        let place = |name: String, at: Point, yaw_deg: f64| Module {
            x: at.x,
            y: at.y,
            yaw_deg,
            placed: true,
            ..Module::unplaced(name)
        };
        let own = AREAS.iter().enumerate().flat_map(|(hall, name)| {
            let (near, far) = (OFF_WALL_M, HALL_M - OFF_WALL_M);
            // At the corner of the site, and at the middle where all halls meet.
            let is_low = [hall % 2 == 0, hall / 2 == 0];
            let [outer, inner] = [true, false].map(|outer| {
                let [x, y] = is_low.map(|low| if low == outer { near } else { far });
                corner(hall) + Point::new(x, y)
            });
            let yaw_deg = (inner - outer).angle_rad().to_degrees();
            [
                place(format!("{name} outer"), outer, yaw_deg),
                place(format!("{name} inner"), inner, yaw_deg + 180.0),
            ]
        });
        // In a doorway at the jamb that is farther out; at an open border at the outer wall.
        let off_m = match self.borders {
            Borders::Doorways => DOORWAY_M - HALF_DOORWAY_M + OFF_WALL_M,
            Borders::Open => OFF_WALL_M,
        };
        let far_m = 2.0 * HALL_M - off_m;
        let shared = [
            ("south border", Point::new(HALL_M, off_m), 90.0),
            ("north border", Point::new(HALL_M, far_m), -90.0),
            ("west border", Point::new(off_m, HALL_M), 0.0),
            ("east border", Point::new(far_m, HALL_M), 180.0),
        ];
        own.chain(shared.map(|(name, at, yaw_deg)| place(name.into(), at, yaw_deg))).collect()
    }

    /// One who walks through the halls until the end.
    fn person(&self, person: usize) -> PersonSpec {
        let mut stream = Stream::new(self.seed, Purpose::Crowd, [person as u64, 3]);
        let mut hall = person % AREAS.len();
        let stands = |hall: usize, stream: &mut Stream| {
            let mut along = || stream.between(INSIDE_M, HALL_M - INSIDE_M);
            corner(hall) + Point::new(along(), along())
        };
        let speed_m_s = stream.between(0.8, 1.5);
        let first = stands(hall, &mut stream);
        let mut route = vec![vec![first.x, first.y]];
        // More than a person can visit in that time, at 2 m from each other at least in the mean.
        let visits = (self.seconds * speed_m_s / 2.0) as usize + 1;
        for _ in 0..visits {
            if stream.chance(0.75) {
                let next = hall ^ if stream.chance(0.5) { 1 } else { 2 };
                if self.borders == Borders::Doorways {
                    route.extend(through(hall, next, &mut stream));
                }
                hall = next;
            }
            let at = stands(hall, &mut stream);
            let wait_s = if stream.chance(0.3) { stream.between(1.0, 4.0) } else { 0.0 };
            route.push(vec![at.x, at.y, wait_s]);
        }
        let from_s = LEARNED_S + APART_S * person as f64;
        PersonSpec { speed_m_s, from_s, name: format!("person {}", person + 1), ..PersonSpec::along(route) }
    }
}

/// The way through the doorway between two halls, on the right.
fn through(from: usize, to: usize, stream: &mut Stream) -> [Vec<f64>; 2] {
    let middle = Point::new(DOORWAY_M, DOORWAY_M);
    let (here, there) = (corner(from) + middle, corner(to) + middle);
    let way = (there - here) * (1.0 / HALL_M);
    let doorway = (here + there) * 0.5 - way.left() * stream.between(0.15, 0.6);
    [-0.9, 0.9].map(|along_m| {
        let at = doorway + way * along_m;
        vec![at.x, at.y]
    })
}

/// The site of an area: its zone, the modules in it and at its borders, and all walls.
#[must_use]
pub fn area(all: &Site, hall: usize) -> Site {
    let is_its = |module: &&Module| depth_m(hall, module.pose().at) >= 0.0;
    Site {
        modules: all.modules.iter().filter(is_its).cloned().collect(),
        walls: all.walls.clone(),
        zones: all.zones.get(hall).cloned().into_iter().collect(),
        ..Site::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn a_module_at_a_border_is_of_both_areas_and_others_of_one() {
        for borders in [Borders::Doorways, Borders::Open] {
            let halls = Halls {
                borders,
                people: 4,
                seconds: 30.0,
                seed: 1,
                silent: None,
                tracker: Selected::default(),
            };
            let scene = halls.scene().unwrap();
            let areas = [0, 1, 2, 3].map(|hall| area(&scene.site, hall));
            for module in &scene.site.modules {
                let of = areas.iter().filter(|site| site.modules.contains(module)).count();
                assert_eq!(of, if module.name.contains("border") { 2 } else { 1 }, "{}", module.name);
            }
            for (site, name) in areas.iter().zip(AREAS) {
                site.check().unwrap();
                assert_eq!((site.modules.len(), site.zones[0].name.as_str()), (4, name));
            }
        }
    }

    #[test]
    fn people_walk_from_hall_to_hall_and_through_no_wall() {
        let halls = Halls {
            borders: Borders::Doorways,
            people: 8,
            seconds: 60.0,
            seed: 3,
            silent: None,
            tracker: Selected::default(),
        };
        let world = World::new(&halls.scene().unwrap(), 3);
        let mut was: Vec<Option<Point>> = vec![None; 8];
        let mut crossings = 0;
        for tick in 0..600 {
            for person in world.truth(0.1 * f64::from(tick)).people {
                let at = Point::new(person.x, person.y);
                let before = was[person.id - 1].replace(at).unwrap_or(at);
                for (axis, across) in [([before.x, at.x], at.y), ([before.y, at.y], at.x)] {
                    if (axis[0] < HALL_M) != (axis[1] < HALL_M) {
                        crossings += 1;
                        assert!((across % HALL_M - DOORWAY_M).abs() < HALF_DOORWAY_M, "{at:?}");
                    }
                }
            }
        }
        assert!(crossings > 30, "{crossings}");
    }
}
