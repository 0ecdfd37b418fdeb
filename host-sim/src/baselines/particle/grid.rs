//! The grid map: cells of things that do not walk. A detection there is no person, and no particle lies there.
//!
//! ```text
//!   ┌─┬─┬─┬─┬─┬─┐   █ walls that stop people    ▒ where movers sweep
//!   │█│█│█│▒│▒│ │   ▓ what has stood still in the foreground for ten minutes
//!   │█│ │ │▒│▒│ │
//!   │█│ │▓│ │ │ │   cells of 5 cm
//!   └─┴─┴─┴─┴─┴─┘
//! ```
//!
//! Noguchi et al. 2009 draw the map by hand after a floor plan. Here the site says where walls and movers are, and what
//! has been put down since is found by how long it has stood. Furniture that was there when a module learned its
//! background never comes as foreground.

use std::collections::HashMap;

use kehai_tracking::geometry::{Point, bounds, inside};
use kehai_tracking::site::{Blocks, Site};

/// Side of a cell, m: the largest part of a person leaning on a wall that the wall's cells can cover.
const CELL_M: f64 = 0.05;

/// Steps along a wall, m: finer than a cell.
const WALL_STEP_M: f64 = 0.01;

/// A range unchanged for so long belongs to an object, 0.1 s: a standing person shifts their weight within five
/// minutes.
const THING_DS: u16 = 6000;

/// An object stays on the map for so long after its last detection, s.
const REMEMBERED_S: f64 = 600.0;

/// Cells with things, and until when they count.
#[derive(Clone, Debug, Default)]
pub struct GridMap(HashMap<(i32, i32), f64>);

impl GridMap {
    /// Of a site's walls and movers.
    #[must_use]
    pub fn of(site: &Site) -> Self {
        let mut map = Self::default();
        for wall in site.walls.iter().filter(|wall| wall.stops(Blocks::People)) {
            for (from, to) in wall.sides() {
                map.draw_wall(from, to);
            }
        }
        for mover in &site.movers {
            map.draw_area(&mover.corners());
        }
        map
    }

    fn draw_wall(&mut self, from: Point, to: Point) {
        let side = to - from;
        let steps = (side.length() / WALL_STEP_M).ceil().max(1.0) as u32;
        for step in 0..=steps {
            let place = from + side * (f64::from(step) / f64::from(steps));
            self.0.insert(cell(place), f64::INFINITY);
        }
    }

    fn draw_area(&mut self, polygon: &[Point]) {
        let Some((low, high)) = bounds(polygon.iter().copied()) else { return };
        let ((left, low), (right, high)) = (cell(low), cell(high));
        for (x, y) in (left..=right).flat_map(|x| (low..=high).map(move |y| (x, y))) {
            let middle = Point::new((f64::from(x) + 0.5) * CELL_M, (f64::from(y) + 0.5) * CELL_M);
            if inside(middle, polygon) {
                self.0.insert((x, y), f64::INFINITY);
            }
        }
    }

    /// Adds a point to the map if its range has been unchanged for long enough; `static_ds` is that time.
    pub fn learn(&mut self, place: Point, at_s: f64, static_ds: u16) {
        if static_ds >= THING_DS {
            let until_s = self.0.entry(cell(place)).or_insert(at_s);
            *until_s = until_s.max(at_s + REMEMBERED_S);
        }
    }

    /// Whether a thing is at a place.
    #[must_use]
    pub fn holds(&self, place: Point, at_s: f64) -> bool {
        self.0.get(&cell(place)).is_some_and(|&until_s| at_s < until_s)
    }
}

fn cell(place: Point) -> (i32, i32) {
    ((place.x / CELL_M).floor() as i32, (place.y / CELL_M).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::site::{Mover, Wall};

    fn site() -> Site {
        let wall = |points: &[[f64; 2]], blocks: &[Blocks]| Wall {
            points: points.to_vec(),
            blocks: blocks.to_vec(),
            mirror: false,
        };
        Site {
            walls: vec![
                wall(&[[0.02, 0.02], [1.02, 0.02], [2.02, 1.02]], &[Blocks::People]),
                wall(&[[0.02, 3.0], [1.02, 3.0]], &[Blocks::Beams]),
            ],
            movers: vec![Mover {
                name: String::new(),
                polygon: vec![[-2.0, -2.0], [-1.0, -2.0], [-1.0, -1.0]],
            }],
            ..Site::default()
        }
    }

    #[test]
    fn walls_that_stop_people_are_on_the_map() {
        let map = GridMap::of(&site());
        for place in [[0.02, 0.02], [0.5, 0.03], [1.5, 0.51]] {
            assert!(map.holds(place.into(), 0.0), "{place:?}");
        }
        for place in [[0.5, 0.08], [0.5, 3.0], [1.5, 0.7]] {
            assert!(!map.holds(place.into(), 0.0), "{place:?}");
        }
    }

    #[test]
    fn what_movers_sweep_is_on_the_map() {
        let map = GridMap::of(&site());
        assert!(map.holds(Point::new(-1.2, -1.8), 0.0));
        assert!(!map.holds(Point::new(-1.8, -1.2), 0.0));
    }

    #[test]
    fn a_thing_put_down_is_on_the_map_while_it_stands_and_a_person_who_waits_is_not() {
        let mut map = GridMap::of(&site());
        let place = Point::new(3.0, 3.0);
        map.learn(place, 100.0, THING_DS - 1);
        assert!(!map.holds(place, 100.0));
        map.learn(place, 700.0, THING_DS);
        assert!(map.holds(place, 1299.0) && !map.holds(place, 1301.0));
        map.learn(Point::new(0.5, 0.03), 0.0, THING_DS);
        assert!(map.holds(Point::new(0.5, 0.03), 1e9), "a wall stays");
    }
}
