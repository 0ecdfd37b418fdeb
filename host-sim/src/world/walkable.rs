//! Where people can walk in a scene, and the shortest way from one place to another.
//!
//! ```text
//!   ░░░░░░░░░   a grid of 0.15 m; what is nearer than 0.35 m to anything solid is not walked on
//!   ░●··   ░░   the shortest way (A*) from cell to cell
//!   ░░░ ·····▶
//! ```

use pathfinding::prelude::{astar, bfs_reach};

use super::geometry::Point;
use super::scene::Scene;
use kehai_tracking::geometry::{bounds, distance_to_segment, inside};

/// Side of a cell, m.
const CELL_M: f64 = 0.15;
/// From a walker's middle to anything solid, m.
const CLEAR_M: f64 = 0.35;

/// Where one can walk.
#[derive(Clone, Debug)]
pub struct Walkable {
    low: Point,
    columns: i32,
    rows: i32,
    free: Vec<bool>,
}

impl Walkable {
    /// The ground within the walls of a scene, and as far as the places in `also`.
    #[must_use]
    pub fn of(scene: &Scene, also: &[Point]) -> Self {
        let walls: Vec<(Point, Point)> = scene.site.walls.iter().flat_map(|wall| wall.sides()).collect();
        let ends = walls.iter().flat_map(|side| [side.0, side.1]);
        let (low, high) = bounds(ends.chain(also.iter().copied())).unwrap_or_default();
        let columns = ((high.x - low.x) / CELL_M).ceil() as i32;
        let rows = ((high.y - low.y) / CELL_M).ceil() as i32;
        let modules: Vec<Point> = scene.site.modules.iter().map(|module| module.pose().at).collect();
        let free = |index: i32| {
            let at =
                low + Point::new(f64::from(index % columns) + 0.5, f64::from(index / columns) + 0.5) * CELL_M;
            let walls = walls.iter().all(|side| distance_to_segment(at, side.0, side.1) > CLEAR_M);
            let things = scene.furniture.iter().all(|thing| match thing.disc {
                Some([x, y, radius_m]) => (at - Point::new(x, y)).length() > CLEAR_M + radius_m,
                None => {
                    let corners: Vec<Point> =
                        thing.polygon.iter().map(|corner| Point::from(*corner)).collect();
                    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
                    !inside(at, &corners)
                        && sides.into_iter().all(|(from, to)| distance_to_segment(at, *from, *to) > CLEAR_M)
                }
            });
            walls && things && modules.iter().all(|module| (at - *module).length() > 0.5)
        };
        Self { low, columns, rows, free: (0..columns * rows).map(free).collect() }
    }

    fn is_free(&self, cell: (i32, i32)) -> bool {
        let within = (0..self.columns).contains(&cell.0) && (0..self.rows).contains(&cell.1);
        within && self.free.get((cell.1 * self.columns + cell.0) as usize).copied().unwrap_or(false)
    }

    fn middle(&self, cell: (i32, i32)) -> Point {
        self.low + Point::new(f64::from(cell.0) + 0.5, f64::from(cell.1) + 0.5) * CELL_M
    }

    /// The place nearest to `at` on which one can walk.
    fn nearest(&self, at: Point) -> Option<(i32, i32)> {
        let cells = (0..self.columns).flat_map(|column| (0..self.rows).map(move |row| (column, row)));
        cells
            .filter(|cell| self.is_free(*cell))
            .min_by(|a, b| (self.middle(*a) - at).length().total_cmp(&(self.middle(*b) - at).length()))
    }

    /// Where one can stand that is nearest to `at`.
    #[must_use]
    pub fn near(&self, at: Point) -> Point {
        self.nearest(at).map_or(at, |cell| self.middle(cell))
    }

    /// The way from about `from` to about `to`, from cell to cell; nothing where there is none.
    #[must_use]
    pub fn steps(&self, from: Point, to: Point) -> Vec<Point> {
        match (self.nearest(from), self.nearest(to)) {
            (Some(start), Some(goal)) => self.cells(start, goal),
            _ => Vec::new(),
        }
    }

    /// All places on which one can walk.
    #[must_use]
    pub fn places(&self) -> Vec<Point> {
        let cells = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        cells.filter(|cell| self.is_free(*cell)).map(|cell| self.middle(cell)).collect()
    }

    /// Which part of it can be reached from about `from`.
    #[must_use]
    pub fn reached(&self, from: Point) -> Self {
        let mut free = vec![false; self.free.len()];
        if let Some(start) = self.nearest(from) {
            for cell in bfs_reach(start, |cell| self.around(*cell).map(|(cell, _)| cell)) {
                if let Some(free) = free.get_mut((cell.1 * self.columns + cell.0) as usize) {
                    *free = true;
                }
            }
        }
        Self { free, ..self.clone() }
    }

    /// Whether one can walk there.
    #[must_use]
    pub fn holds(&self, at: Point) -> bool {
        self.is_free(self.cell(at))
    }

    fn cell(&self, at: Point) -> (i32, i32) {
        let offset = at - self.low;
        ((offset.x / CELL_M).floor() as i32, (offset.y / CELL_M).floor() as i32)
    }

    /// The corners of the way from about `from` to about `to`, with both ends; nothing where there is none.
    #[must_use]
    pub fn corners(&self, from: Point, to: Point) -> Vec<Point> {
        let steps = self.steps(from, to);
        let mut corners: Vec<Point> = steps.first().copied().into_iter().collect();
        for (before, next) in steps.iter().zip(steps.iter().skip(1)) {
            if corners.last().is_some_and(|corner| !self.is_straight(*corner, *next)) {
                corners.push(*before);
            }
        }
        corners.extend(steps.last());
        corners
    }

    /// Whether one can walk straight from one place to the other.
    fn is_straight(&self, from: Point, to: Point) -> bool {
        let parts = ((to - from).length() / (0.5 * CELL_M)).ceil().max(1.0);
        (0..=parts as u32).all(|part| self.holds(from + (to - from) * (f64::from(part) / parts)))
    }

    /// The free cells around one, and how far each is.
    fn around(&self, (column, row): (i32, i32)) -> impl Iterator<Item = ((i32, i32), i32)> + use<'_> {
        let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))).filter(|step| *step != (0, 0));
        let cells = around.map(move |(x, y)| ((column + x, row + y), if x != 0 && y != 0 { 14 } else { 10 }));
        cells.filter(|(cell, _)| self.is_free(*cell))
    }

    fn cells(&self, start: (i32, i32), goal: (i32, i32)) -> Vec<Point> {
        let left = |cell: &(i32, i32)| {
            let (x, y) = ((cell.0 - goal.0).abs(), (cell.1 - goal.1).abs());
            10 * x.max(y) + 4 * x.min(y)
        };
        let way = astar(&start, |cell| self.around(*cell), left, |cell| *cell == goal);
        way.map_or_else(Vec::new, |(cells, _)| cells.into_iter().map(|cell| self.middle(cell)).collect())
    }
}
