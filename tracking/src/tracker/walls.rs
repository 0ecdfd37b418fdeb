//! Walls for the particles of tracks: where a person cannot be, and what cannot be crossed unobserved.
//!
//! ```text
//!   ━━━━━━━ wall        ▒ cells nearer than half a body: no body's centre is there
//!   ▒▒▒▒▒▒▒
//!     ·  ·  free cells
//! ```
//!
//! Entries are walls for occluded tracks: a person who crosses one is detected there.

use crate::cells::Cells;
use crate::geometry::{Point, Pose, bounds, centroid, cross, distance_to_segment};
use crate::site::{Blocks, Entry, Site, Wall, Zone};

/// Half of a body's depth, m.
const HALF_DEPTH_M: f64 = 0.12;

/// A track lost nearer to an entry than this may come in without a detection, m: one or two in a queue.
const QUEUE_M: f64 = 1.0;

/// A track that moves away from a zone faster than this is leaving, m/s.
const LEAVING_MPS: f64 = 0.1;

/// A candidate less than so far behind a wall stands before it, and so does a module, m: an error of range, and of the wall's place.
const BEFORE_WALL_M: f64 = 0.15;

/// A module that hangs on a wall looks away from it: sine of the least angle between its front and that wall, 30°. One that looks
/// along a wall may be turned a little towards it, and stands before it all the same.
const SQUARELY: f64 = 0.5;

/// Side of a cell, m.
const CELL_M: f64 = 0.05;

/// Most cells on a side: 100 m. Beyond them walls and entries are asked one by one.
const CELLS: usize = 2000;

/// Walls and entries of a site, with a map of the cells beside them.
#[derive(Clone, Debug, Default)]
pub struct Walls {
    /// Walls first, then entries.
    pieces: Pieces,
    walls: usize,
    /// What no beam passes.
    opaque: Pieces,
    /// The middle of the zone each entry leads to.
    inner: Vec<Point>,
    corner: Point,
    columns: usize,
    blocked: Vec<bool>,
}

/// Line segments; a query looks only at those that may be in the way.
#[derive(Clone, Debug, Default)]
struct Pieces {
    all: Vec<(Point, Point)>,
    cells: Cells,
}

impl Pieces {
    fn of(all: Vec<(Point, Point)>) -> Self {
        let mut cells = Cells::over(all.iter().flat_map(|&(from, to)| [from, to]));
        for (number, &(from, to)) in (0..).zip(&all) {
            cells.put(number, around(from, to));
        }
        Self { all, cells }
    }

    /// Whether one of the first `count` crosses the way.
    fn cross(&self, from: Point, to: Point, count: usize) -> bool {
        self.near(from, to, count).any(|piece| cross((from, to), piece))
    }

    /// Those of the first `count` that may cross the way.
    fn near(&self, from: Point, to: Point, count: usize) -> impl Iterator<Item = (Point, Point)> {
        let (low, high) = around(from, to);
        let is_near = move |&(one, other): &(Point, Point)| {
            let beside = one.x.max(other.x) < low.x || one.x.min(other.x) > high.x;
            let off = one.y.max(other.y) < low.y || one.y.min(other.y) > high.y;
            !beside && !off
        };
        let pieces = self.all.get(..count).unwrap_or(&self.all);
        self.cells.near((low, high)).filter_map(|number| pieces.get(number)).copied().filter(is_near)
    }
}

/// Just before a module.
fn ahead(pose: &Pose) -> Point {
    pose.at + pose.forward() * BEFORE_WALL_M
}

/// As [`Walls::seen_from`], among walls that are given one by one.
pub fn seen_from(pose: &Pose, mut walls: impl Iterator<Item = (Point, Point)>) -> Point {
    let ahead = ahead(pose);
    let hangs_on = |(one, other): (Point, Point)| {
        let along = other - one;
        cross((pose.at, ahead), (one, other))
            && pose.forward().cross(along).abs() >= SQUARELY * along.length()
    };
    if walls.any(hangs_on) { ahead } else { pose.at }
}

/// The upright rectangle around two places.
fn around(from: Point, to: Point) -> (Point, Point) {
    (Point::new(from.x.min(to.x), from.y.min(to.y)), Point::new(from.x.max(to.x), from.y.max(to.y)))
}

impl Walls {
    /// Of a site.
    #[must_use]
    pub fn of(site: &Site) -> Self {
        let stops_people = |wall: &&Wall| wall.stops(Blocks::People);
        let mut pieces: Vec<_> = site.walls.iter().filter(stops_people).flat_map(Wall::sides).collect();
        let walls = pieces.len();
        pieces.extend(site.entries.iter().map(Entry::ends));
        let leads_to = |entry: &Entry| {
            let named = |zone: &&Zone| entry.zone.as_ref().map_or(zone.count, |name| *name == zone.name);
            site.zones.iter().find(named).map_or(Point::default(), |zone| centroid(&zone.corners()))
        };
        let inner = site.entries.iter().map(leads_to).collect();
        let stops_beams = |wall: &&Wall| wall.stops(Blocks::Beams);
        let opaque = site.walls.iter().filter(stops_beams).flat_map(Wall::sides).collect();
        let (pieces, opaque) = (Pieces::of(pieces), Pieces::of(opaque));
        let mut map = Self { pieces, walls, opaque, inner, ..Self::default() };
        map.draw();
        map
    }

    fn draw(&mut self) {
        let Some((low, high)) = bounds(self.pieces.all.iter().flat_map(|&(from, to)| [from, to])) else {
            return;
        };
        let margin = Point::new(1.0, 1.0) * (2.0 * CELL_M + HALF_DEPTH_M);
        self.corner = low - margin;
        let size = high + margin - self.corner;
        let cells = |length_m: f64| ((length_m / CELL_M).ceil() as usize).clamp(1, CELLS);
        let (columns, rows) = (cells(size.x), cells(size.y));
        self.columns = columns;
        self.blocked = vec![false; columns * rows];
        for &(from, to) in &self.pieces.all {
            let reach = |one: f64, other: f64, base: f64, count: usize| {
                let low = ((one.min(other) - HALF_DEPTH_M - base) / CELL_M).floor().max(0.0) as usize;
                let high = ((one.max(other) + HALF_DEPTH_M - base) / CELL_M).ceil().max(0.0) as usize;
                low..high.min(count - 1) + 1
            };
            for row in reach(from.y, to.y, self.corner.y, rows) {
                for column in reach(from.x, to.x, self.corner.x, columns) {
                    let middle = self.corner + Point::new(column as f64 + 0.5, row as f64 + 0.5) * CELL_M;
                    if distance_to_segment(middle, from, to) < HALF_DEPTH_M {
                        self.blocked[row * columns + column] = true;
                    }
                }
            }
        }
    }

    /// Whether the middle of an occluded body cannot be at `place`.
    #[must_use]
    pub fn beside(&self, place: Point) -> bool {
        let cell = (place - self.corner) * (1.0 / CELL_M);
        if !(cell.x >= 0.0 && cell.y >= 0.0 && cell.x < self.columns as f64) {
            return self.are_nearer(place, HALF_DEPTH_M);
        }
        let cell = cell.y as u32 as usize * self.columns + cell.x as u32 as usize;
        self.blocked.get(cell).copied().unwrap_or_else(|| self.are_nearer(place, HALF_DEPTH_M))
    }

    /// Whether all walls and entries are farther from a place than this, and no place so near to it is [`Self::beside`] one.
    #[must_use]
    pub fn are_farther(&self, place: Point, than_m: f64) -> bool {
        !self.are_nearer(place, than_m + HALF_DEPTH_M + CELL_M)
    }

    /// Whether a wall or an entry is nearer to a place than this.
    fn are_nearer(&self, place: Point, than_m: f64) -> bool {
        let corner = Point::new(than_m, than_m);
        let near = self.pieces.cells.near((place - corner, place + corner));
        let mut near = near.filter_map(|number| self.pieces.all.get(number));
        near.any(|&(from, to)| distance_to_segment(place, from, to) < than_m)
    }

    /// Whether a wall or entry is between two places.
    #[must_use]
    pub fn between(&self, from: Point, to: Point) -> bool {
        self.pieces.cross(from, to, self.pieces.all.len())
    }

    /// Whether a wall is between two places.
    #[must_use]
    pub fn wall_between(&self, from: Point, to: Point) -> bool {
        self.pieces.cross(from, to, self.walls)
    }

    /// Distance to the nearest entry, m.
    #[must_use]
    pub fn entry_m(&self, place: Point) -> f64 {
        let entries = self.entries().iter();
        entries.map(|&(from, to)| distance_to_segment(place, from, to)).fold(f64::INFINITY, f64::min)
    }

    /// Whether there is an entry at all.
    #[must_use]
    pub fn has_entries(&self) -> bool {
        !self.entries().is_empty()
    }

    fn entries(&self) -> &[(Point, Point)] {
        self.pieces.all.get(self.walls..).unwrap_or_default()
    }

    /// Where a module sees from: its place, or before the wall that it hangs on, when by the site file it is behind that wall and looks at
    /// it. Its place and the wall's are some centimetres off.
    ///
    /// ```text
    ///   the room   ┃● ──▶       the file   ● ┃ ──▶      seen from      ┃ ○ ──▶
    /// ```
    #[must_use]
    pub fn seen_from(&self, pose: &Pose) -> Point {
        seen_from(pose, self.opaque.near(pose.at, ahead(pose), self.opaque.all.len()))
    }

    /// Whether something that a module saw from `from` at `to` is behind a wall that no beam passes.
    #[must_use]
    pub fn is_reflection(&self, from: Point, to: Point) -> bool {
        let way = to - from;
        let before = to - way * (BEFORE_WALL_M / way.length().max(BEFORE_WALL_M));
        self.opaque.cross(from, before, self.opaque.all.len())
    }

    /// Whether one wall that no beam passes hides all of a circle from a module that sees from `from`.
    ///
    /// ```text
    ///            ┃    ╭──╮
    ///   from ●╌╌╌┃╌╌╌╌│  │     the wall crosses both tangents, and the circle is behind it
    ///          ╌╌┃╌╌╌╌╰──╯
    /// ```
    #[must_use]
    pub fn hides(&self, from: Point, middle: Point, radius_m: f64) -> bool {
        let way = middle - from;
        let square_m2 = way.dot(way);
        let tangent_m2 = square_m2 - radius_m * radius_m;
        if tangent_m2 <= 0.0 {
            return false;
        }
        // Tangent points: along the way by t² / d, across it by t r / d, with t the length of a tangent.
        let along = from + way * (tangent_m2 / square_m2);
        let across = way.left() * (tangent_m2.sqrt() * radius_m / square_m2);
        let hides = |&(one, other): &(Point, Point)| {
            let wall = other - one;
            cross((from, along + across), (one, other))
                && cross((from, along - across), (one, other))
                && wall.cross(middle - one).abs() > radius_m * wall.length()
        };
        let pieces = self.opaque.cells.near(around(from, middle));
        pieces.filter_map(|number| self.opaque.all.get(number)).any(hides)
    }

    /// Whether the way leads across an entry into its zone.
    #[must_use]
    pub fn enters(&self, from: Point, to: Point) -> bool {
        self.entries().iter().zip(&self.inner).any(|(&entry, &inner)| {
            let side = |place: Point| (entry.1 - entry.0).cross(place - entry.0);
            cross((from, to), entry) && side(to) * side(inner) > 0.0
        })
    }

    /// Whether a person at `place` may be about to come in through an entry: near it, outside, and not leaving.
    #[must_use]
    pub fn waits_outside(&self, place: Point, velocity: Point) -> bool {
        self.entries().iter().zip(&self.inner).any(|(&(from, to), &inner)| {
            let side = |place: Point| (to - from).cross(place - from);
            let inwards = inner - place;
            side(place) * side(inner) < 0.0
                && distance_to_segment(place, from, to) < QUEUE_M
                && velocity.dot(inwards) > -LEAVING_MPS * inwards.length()
        })
    }

    /// Whether a small step is not possible unseen.
    #[must_use]
    pub fn stop(&self, from: Point, to: Point) -> bool {
        let (was, is) = (self.beside(from), self.beside(to));
        (is && !was) || (was && self.between(from, to))
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use super::*;

    fn corridor() -> Walls {
        let site: Site =
            toml::from_str("[[wall]]\npoints = [[0, 0], [4, 0]]\n[[wall]]\npoints = [[0, 1], [4, 1]]")
                .unwrap();
        Walls::of(&site)
    }

    #[test]
    fn no_person_is_beside_or_behind_a_wall() {
        let walls = corridor();
        assert!(walls.beside(Point::new(2.0, 0.05)) && !walls.beside(Point::new(2.0, 0.5)));
        assert!(walls.stop(Point::new(2.0, 0.16), Point::new(2.0, 0.09)));
        assert!(!walls.stop(Point::new(2.0, 0.3), Point::new(2.0, 0.25)));
        assert!(!walls.beside(Point::new(50.0, 0.0)) && !walls.beside(Point::new(-50.0, 0.0)));
    }

    #[test]
    fn walls_farther_apart_than_the_map_is_wide_stop_people_too() {
        let site: Site = toml::from_str(
            "[[wall]]\npoints = [[0, 0], [4, 0]]\n[[wall]]\npoints = [[150, 120], [154, 120]]\n[[entry]]\nname = 'far'\nline = [[500, 0], [501, 0]]",
        )
        .unwrap();
        let walls = Walls::of(&site);
        for (x, y) in [(2.0, 0.0), (152.0, 120.0), (500.5, 0.0)] {
            assert!(walls.beside(Point::new(x, y + 0.05)) && !walls.beside(Point::new(x, y + 0.5)), "{x}");
            assert!(walls.stop(Point::new(x, y + 0.16), Point::new(x, y + 0.09)), "{x}");
        }
    }

    #[test]
    fn a_person_beside_a_wall_gets_away_on_their_side_only() {
        let walls = corridor();
        assert!(walls.stop(Point::new(2.0, 0.05), Point::new(2.0, -0.02)));
        assert!(!walls.stop(Point::new(2.0, 0.05), Point::new(2.0, 0.08)));
    }

    #[test]
    fn a_module_that_the_file_has_behind_its_wall_sees_from_before_it() {
        let walls = corridor();
        let seen_from = |y_m, yaw_rad| walls.seen_from(&Pose { at: Point::new(2.0, y_m), yaw_rad });
        let (up, down) = (FRAC_PI_2, -FRAC_PI_2);
        assert_eq!(seen_from(0.04, up), Point::new(2.0, 0.04), "before its wall");
        let from = seen_from(-0.04, up);
        assert!((from - Point::new(2.0, 0.11)).length() < 1e-9, "{from:?}");
        assert!(
            !walls.is_reflection(from, Point::new(3.0, 0.6))
                && walls.is_reflection(from, Point::new(3.0, 1.4))
        );
        assert_eq!(seen_from(0.2, down), Point::new(2.0, 0.2), "the wall is farther away");
        // It looks along the wall, turned a little towards it.
        assert_eq!(seen_from(0.01, -0.2), Point::new(2.0, 0.01));
        assert_eq!(seen_from(-0.01, 0.2), Point::new(2.0, -0.01));
    }

    #[test]
    fn a_wall_hides_what_is_behind_it_as_a_whole() {
        let walls = corridor();
        let hides = |x_m, y_m, radius_m| walls.hides(Point::new(2.0, 0.5), Point::new(x_m, y_m), radius_m);
        assert!(hides(2.0, 2.5, 0.7) && hides(2.0, -2.0, 0.7));
        assert!(!hides(2.0, 1.6, 0.7), "a part of it is before the wall");
        assert!(!hides(7.5, 2.5, 0.7), "a part of it is seen past the end of the wall");
        assert!(!hides(3.0, 0.5, 0.3) && !hides(2.2, 0.5, 0.7), "no wall is between");
    }
}
