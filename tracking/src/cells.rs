//! What lies where: cells of a few metres, each with the numbers of what touches it.
//!
//! ```text
//!   ┌────┬────┬────┐
//!   │ 0  │0 1 │ 1  │     asked for the rectangle ▒, the cells say 1 and 2, some of them twice;
//!   ├────┼────┼▒▒▒▒┤     the rest of the site is not looked at
//!   │    │ 1  │1▒2▒│     what is outside of all cells is in the cells at the edge
//!   └────┴────┴────┘
//! ```
//!
//! So a question costs what is near it, however large the site is.

use std::ops::RangeInclusive;

use crate::geometry::{Point, bounds, inside};

/// Side of a cell, m: half a module's reach.
const CELL_M: f64 = 4.0;

/// Most cells on a side; larger sites have larger cells.
const MOST: f64 = 128.0;

/// Numbers of things by the cells they touch.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    corner: Point,
    side_m: f64,
    columns: usize,
    rows: usize,
    numbers: Vec<Vec<u32>>,
}

impl Cells {
    /// Empty cells over the rectangle around `places`.
    #[must_use]
    pub fn over(places: impl IntoIterator<Item = Point>) -> Self {
        let (low, high) = bounds(places).unwrap_or_default();
        let size = high - low;
        let side_m = CELL_M.max(size.x.max(size.y) / MOST);
        let cells = |length_m: f64| (length_m / side_m) as usize + 1;
        let (columns, rows) = (cells(size.x), cells(size.y));
        Self { corner: low, side_m, columns, rows, numbers: vec![Vec::new(); columns * rows] }
    }

    /// Adds what lies within a rectangle.
    pub fn put(&mut self, number: u32, rectangle: (Point, Point)) {
        for cell in self.cells(rectangle) {
            if let Some(numbers) = self.numbers.get_mut(cell) {
                numbers.push(number);
            }
        }
    }

    /// Takes out what was put within a rectangle.
    pub fn take_out(&mut self, number: u32, rectangle: (Point, Point)) {
        for cell in self.cells(rectangle) {
            if let Some(numbers) = self.numbers.get_mut(cell) {
                numbers.retain(|known| *known != number);
            }
        }
    }

    /// Takes out everything.
    pub fn clear(&mut self) {
        self.numbers.iter_mut().for_each(Vec::clear);
    }

    /// From now on, what has a number above this has one less.
    pub fn close_up(&mut self, number: u32) {
        let later = self.numbers.iter_mut().flatten().filter(|known| **known > number);
        later.for_each(|known| *known -= 1);
    }

    /// What touches the cells of a rectangle: all that is there, some of it more than once, and some that is not.
    pub fn near(&self, rectangle: (Point, Point)) -> impl Iterator<Item = usize> + '_ {
        let numbers = self.cells(rectangle).filter_map(|cell| self.numbers.get(cell));
        numbers.flatten().map(|number| *number as usize)
    }

    /// What touches the cell of a place.
    #[must_use]
    pub fn at(&self, place: Point) -> &[u32] {
        let cell = place - self.corner;
        let number = self.span(cell.y, self.rows) * self.columns + self.span(cell.x, self.columns);
        self.numbers.get(number).map_or(&[], Vec::as_slice)
    }

    /// Whether two rectangles touch the same cells.
    #[must_use]
    pub fn are_same(&self, one: (Point, Point), other: (Point, Point)) -> bool {
        self.spans(one) == self.spans(other)
    }

    fn cells(&self, rectangle: (Point, Point)) -> impl Iterator<Item = usize> + use<> {
        let columns = self.columns;
        let (across, up) = self.spans(rectangle);
        up.flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }

    /// Columns and rows of a rectangle; the outermost where it is outside.
    fn spans(&self, (low, high): (Point, Point)) -> (RangeInclusive<usize>, RangeInclusive<usize>) {
        let (low, high) = (low - self.corner, high - self.corner);
        let across = self.span(low.x, self.columns)..=self.span(high.x, self.columns);
        (across, self.span(low.y, self.rows)..=self.span(high.y, self.rows))
    }

    /// The column or row of a place so far from the corner; the outermost where it is outside.
    fn span(&self, at_m: f64, count: usize) -> usize {
        ((at_m / self.side_m).max(0.0) as usize).min(count.max(1) - 1)
    }
}

/// Polygons; a query looks only at those that a place can be in.
#[derive(Clone, Debug, Default)]
pub struct Areas {
    polygons: Vec<Vec<Point>>,
    cells: Cells,
}

impl Areas {
    /// Of their corners.
    #[must_use]
    pub fn of(polygons: Vec<Vec<Point>>) -> Self {
        let mut cells = Cells::over(polygons.iter().flatten().copied());
        for (number, polygon) in (0..).zip(&polygons) {
            if let Some(around) = bounds(polygon.iter().copied()) {
                cells.put(number, around);
            }
        }
        Self { polygons, cells }
    }

    /// The numbers of the polygons a place is in, in their order.
    pub fn around(&self, place: Point) -> impl Iterator<Item = usize> + '_ {
        let numbers = self.cells.at(place).iter().map(|number| *number as usize);
        numbers.filter(move |number| self.is_in(*number, place))
    }

    /// The numbers of the polygons that a rectangle may touch, some of them more than once.
    pub fn near(&self, rectangle: (Point, Point)) -> impl Iterator<Item = usize> + '_ {
        self.cells.near(rectangle)
    }

    /// Whether a place is in the polygon of a number.
    #[must_use]
    pub fn is_in(&self, number: usize, place: Point) -> bool {
        self.polygons.get(number).is_some_and(|polygon| inside(place, polygon))
    }

    /// Whether a place is in one of them.
    #[must_use]
    pub fn hold(&self, place: Point) -> bool {
        !self.is_empty() && self.around(place).next().is_some()
    }

    /// Whether one of them holds all places.
    #[must_use]
    pub fn one_holds(&self, places: &[Point]) -> bool {
        let Some(first) = places.first() else { return !self.is_empty() };
        !self.is_empty()
            && self.around(*first).any(|number| places.iter().all(|place| self.is_in(number, *place)))
    }

    /// The corners of one of them; none if there are not so many.
    #[must_use]
    pub fn corners(&self, number: usize) -> &[Point] {
        self.polygons.get(number).map_or(&[], Vec::as_slice)
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.polygons.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(numbers: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut numbers: Vec<usize> = numbers.collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    #[test]
    fn everything_is_found_where_it_is_and_outside_of_all_cells_too() {
        let at = Point::new;
        let mut cells = Cells::over([at(0.0, 0.0), at(40.0, 20.0)]);
        let things = [
            (at(1.0, 1.0), at(9.0, 2.0)),
            (at(30.0, 15.0), at(31.0, 15.0)),
            (at(-50.0, 90.0), at(-49.0, 91.0)),
        ];
        for (number, thing) in (0..).zip(things) {
            cells.put(number, thing);
        }
        for (number, thing) in things.into_iter().enumerate() {
            assert_eq!(sorted(cells.near(thing)), [number]);
        }
        assert_eq!(sorted(cells.near((at(f64::NEG_INFINITY, -99.0), at(99.0, f64::INFINITY)))), [0, 1, 2]);
        assert_eq!(sorted(cells.near((at(20.0, 1.0), at(20.0, 2.0)))), [0_usize; 0]);
    }

    #[test]
    fn what_is_taken_out_is_gone_and_later_numbers_close_up() {
        let everywhere = (Point::new(0.0, 0.0), Point::new(40.0, 40.0));
        let mut cells = Cells::over([everywhere.0, everywhere.1]);
        let thing = |number: u32| {
            (Point::new(f64::from(number) * 9.0, 3.0), Point::new(f64::from(number) * 9.0, 8.0))
        };
        (0..4).for_each(|number| cells.put(number, thing(number)));
        cells.take_out(1, thing(1));
        cells.close_up(1);
        assert_eq!(sorted(cells.near(everywhere)), [0, 1, 2]);
        assert_eq!(sorted(cells.near(thing(3))), [2]);
    }

    #[test]
    fn areas_are_those_a_place_is_in() {
        let square = |x: f64| {
            [[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [0.0, 6.0]].map(|[dx, y]| Point::new(x + dx, y)).to_vec()
        };
        let areas = Areas::of(vec![square(0.0), square(20.0), square(3.0)]);
        assert_eq!(areas.around(Point::new(4.0, 5.0)).collect::<Vec<_>>(), [0, 2]);
        assert!(areas.hold(Point::new(25.0, 1.0)) && !areas.hold(Point::new(15.0, 1.0)));
        assert!(areas.one_holds(&[Point::new(1.0, 1.0), Point::new(5.0, 5.0)]));
        assert!(!areas.one_holds(&[Point::new(1.0, 1.0), Point::new(8.0, 5.0)]));
        assert!(!Areas::default().hold(Point::default()));
    }
}
