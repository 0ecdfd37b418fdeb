//! The route of a person from one place to another: around walls and furniture, at walking speed.
//!
//! ```text
//!   ░░░░░░░░░   a grid of 0.15 m; what is nearer than 0.35 m to anything solid is not walked on
//!   ░●··   ░░   the shortest way (A*), walked at 0.9 m/s, its corners rounded over half a second
//!   ░░░ ·····▶
//! ```

use pathfinding::prelude::astar;

use crate::world::geometry::Point;
use crate::world::motion::LED_STEP_S;
use crate::world::scene::Scene;
use kehai_tracking::geometry::{bounds, distance_to_segment, inside};

/// Side of a cell, m.
const CELL_M: f64 = 0.15;
/// From a walker's middle to anything solid, m.
const CLEAR_M: f64 = 0.35;
/// Walking speed, m/s.
const SPEED_M_S: f64 = 0.9;
/// Half the time over which corners are rounded, in steps.
const ROUNDED: usize = 6;

/// Where one can walk.
pub struct Floor {
    low: Point,
    columns: i32,
    rows: i32,
    free: Vec<bool>,
}

impl Floor {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let walls: Vec<(Point, Point)> = scene.site.walls.iter().flat_map(|wall| wall.sides()).collect();
        let (low, high) = bounds(walls.iter().flat_map(|side| [side.0, side.1])).unwrap_or_default();
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
    pub fn near(&self, at: Point) -> Point {
        self.nearest(at).map_or(at, |cell| self.middle(cell))
    }

    /// The way from `from` to about `to`: a place every [`LED_STEP_S`]. At least a few steps, on the spot if need be.
    pub fn way(&self, from: Point, to: Point) -> Vec<Point> {
        let corners = match (self.nearest(from), self.nearest(to)) {
            (Some(start), Some(goal)) => self.corners(start, goal),
            _ => Vec::new(),
        };
        let corners: Vec<Point> = [from].into_iter().chain(corners.into_iter().skip(1)).collect();
        let mut places = Vec::new();
        let step_m = SPEED_M_S * LED_STEP_S;
        let mut ahead_m = step_m;
        for side in corners.windows(2) {
            let length = (side[1] - side[0]).length();
            while ahead_m < length {
                places.push(side[0] + (side[1] - side[0]) * (ahead_m / length));
                ahead_m += step_m;
            }
            ahead_m -= length;
        }
        let last = places.last().copied().unwrap_or(from);
        places.extend([last; 2 * ROUNDED]);
        let rounded = |index: usize| {
            let part = (index as i64 - ROUNDED as i64)..=(index as i64 + ROUNDED as i64);
            let at = |index: i64| match usize::try_from(index) {
                Ok(index) => places.get(index).copied().unwrap_or(last),
                Err(_) => from,
            };
            let count = part.clone().count() as f64;
            part.fold(Point::default(), |sum, index| sum + at(index)) * (1.0 / count)
        };
        (0..places.len()).map(rounded).collect()
    }

    fn corners(&self, start: (i32, i32), goal: (i32, i32)) -> Vec<Point> {
        let next = |cell: &(i32, i32)| {
            let (column, row) = *cell;
            let around = (-1..=1).flat_map(move |x| (-1..=1).map(move |y| (x, y)));
            around
                .filter(|step| *step != (0, 0))
                .map(|(x, y)| ((column + x, row + y), if x != 0 && y != 0 { 14 } else { 10 }))
                .filter(|(cell, _)| self.is_free(*cell))
                .collect::<Vec<_>>()
        };
        let left = |cell: &(i32, i32)| {
            let (x, y) = ((cell.0 - goal.0).abs(), (cell.1 - goal.1).abs());
            10 * x.max(y) + 4 * x.min(y)
        };
        let way = astar(&start, next, left, |cell| *cell == goal);
        way.map_or_else(Vec::new, |(cells, _)| cells.into_iter().map(|cell| self.middle(cell)).collect())
    }
}
