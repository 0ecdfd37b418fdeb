//! A grid over a place: sets of cells, and walls between them.
//!
//! ```text
//!   row 1   ┌───┬───┐     cell = row · columns + column
//!           │ 2 ┃ 3 │     ┃ a wall: people get from 2 to 3 only around its end
//!   row 0   ├───┼───┤
//!           │ 0 │ 1 │
//!           └───┴───┘
//! ```

use crate::geometry::{Point, bounds, cross};

/// Side of a cell, m.
const CELL_M: f64 = 0.1;

/// Most cells: 100 m by 100 m; a larger place has larger ones.
const MOST: f64 = 1e6;

/// Cells around the outermost place: room for what is beside a door.
const RIM: f64 = 5.0;

/// The cells of a place.
#[derive(Debug)]
pub(super) struct Grid {
    low: Point,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Cells in a row.
    pub columns: usize,
    rows: usize,
    /// Walls between a cell and the next one to the right, and the next one above.
    shut: Vec<[bool; 2]>,
}

/// The ways from a cell: right, up, left, down.
pub(super) const WAYS: usize = 4;

impl Grid {
    /// Over all of these places, with walls; none over nothing.
    pub fn over(places: impl IntoIterator<Item = Point>, walls: &[(Point, Point)]) -> Option<Self> {
        let (low, high) = bounds(places)?;
        let size = high - low;
        let cell_m = CELL_M.max((size.x * size.y / MOST).sqrt());
        let low = low - Point::new(cell_m, cell_m) * RIM;
        let cells = |length_m: f64| (length_m / cell_m + 2.0 * RIM).ceil() as usize;
        let (columns, rows) = (cells(size.x), cells(size.y));
        let mut grid = Self { low, cell_m, columns, rows, shut: vec![[false; 2]; columns * rows] };
        walls.iter().for_each(|wall| grid.put(*wall));
        Some(grid)
    }

    /// How many cells there are.
    pub const fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// The middle of a cell.
    pub fn middle(&self, cell: usize) -> Point {
        let (column, row) = (cell % self.columns, cell / self.columns);
        self.low + Point::new(column as f64 + 0.5, row as f64 + 0.5) * self.cell_m
    }

    /// The cell of a place; none beyond the edge.
    pub fn cell(&self, at: Point) -> Option<usize> {
        let off = (at - self.low) * (1.0 / self.cell_m);
        let is_in = off.x >= 0.0 && off.y >= 0.0 && off.x < self.columns as f64 && off.y < self.rows as f64;
        is_in.then_some(off.y as usize * self.columns + off.x as usize)
    }

    /// A corner of cells: the lower left one of the cell in this column and row.
    pub fn corner(&self, (column, row): (usize, usize)) -> Point {
        self.low + Point::new(column as f64, row as f64) * self.cell_m
    }

    /// The next cell on a way, and whether a wall is between; none beyond the edge.
    pub fn next(&self, cell: usize, way: usize) -> Option<(usize, bool)> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let (to, wall) = match way {
            0 if column + 1 < self.columns => (cell + 1, (cell, 0)),
            1 if row + 1 < self.rows => (cell + self.columns, (cell, 1)),
            2 if column > 0 => (cell - 1, (cell - 1, 0)),
            3 if row > 0 => (cell - self.columns, (cell - self.columns, 1)),
            _ => return None,
        };
        Some((to, self.shut.get(wall.0).is_some_and(|shut| shut[wall.1])))
    }

    /// Whether a cell is at the edge of the grid.
    pub fn is_edge(&self, cell: usize) -> bool {
        (0..WAYS).any(|way| self.next(cell, way).is_none())
    }

    /// The cells beside one with no wall between.
    pub fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        (0..WAYS).filter_map(move |way| self.next(cell, way)).filter(|(_, shut)| !shut).map(|(next, _)| next)
    }

    fn put(&mut self, wall: (Point, Point)) {
        let Some((low, high)) = bounds([wall.0, wall.1]) else { return };
        let index = |at_m: f64, count: usize| ((at_m / self.cell_m).max(0.0) as usize).min(count - 1);
        let (from, to) = (low - self.low, high - self.low);
        let columns = index(from.x - self.cell_m, self.columns)..=index(to.x + self.cell_m, self.columns);
        let rows = index(from.y - self.cell_m, self.rows)..=index(to.y + self.cell_m, self.rows);
        for row in rows {
            for column in columns.clone() {
                let cell = row * self.columns + column;
                let middle = self.middle(cell);
                for (way, step) in
                    [Point::new(self.cell_m, 0.0), Point::new(0.0, self.cell_m)].into_iter().enumerate()
                {
                    if cross((middle, middle + step), wall) {
                        self.shut[cell][way] = true;
                    }
                }
            }
        }
    }

    /// The cells within so many steps of a set.
    pub fn grown(&self, set: &[bool], steps: usize) -> Vec<bool> {
        let mut grown = set.to_vec();
        let mut edge: Vec<usize> = (0..self.len()).filter(|cell| set[*cell]).collect();
        for _ in 0..steps {
            let reached: Vec<usize> = edge.iter().flat_map(|cell| self.beside(*cell)).collect();
            edge = reached.into_iter().filter(|cell| !std::mem::replace(&mut grown[*cell], true)).collect();
        }
        grown
    }

    /// A set without what lies within so many steps of the cells that are not in it.
    pub fn shrunk(&self, set: &[bool], steps: usize) -> Vec<bool> {
        inverted(&self.grown(&inverted(set), steps))
    }

    /// The parts of a set that hang together.
    pub fn parts(&self, set: &[bool]) -> Vec<Vec<usize>> {
        let mut left = set.to_vec();
        let mut parts = Vec::new();
        for first in 0..self.len() {
            if !std::mem::replace(&mut left[first], false) {
                continue;
            }
            let (mut part, mut at) = (vec![first], 0);
            while let Some(&cell) = part.get(at) {
                at += 1;
                for next in self.beside(cell) {
                    if std::mem::replace(&mut left[next], false) {
                        part.push(next);
                    }
                }
            }
            parts.push(part);
        }
        parts
    }

    /// How far each cell of a set is from the nearest wall, or cell that is not in it, m. Chamfer distance (Borgefors 1986):
    /// within 8 %.
    pub fn clearance_m(&self, set: &[bool]) -> Vec<f64> {
        let is_edge = |cell: usize| {
            (0..WAYS).any(|way| self.next(cell, way).is_none_or(|(next, shut)| shut || !set[next]))
        };
        let mut far = vec![0.0_f64; self.len()];
        for cell in 0..self.len() {
            far[cell] = if !set[cell] {
                0.0
            } else if is_edge(cell) {
                0.5
            } else {
                f64::INFINITY
            };
        }
        let columns = self.columns as isize;
        let steps = [
            (1, 1.0),
            (columns, 1.0),
            (columns - 1, std::f64::consts::SQRT_2),
            (columns + 1, std::f64::consts::SQRT_2),
        ];
        let lower = |far: &[f64], cell: usize, sign: isize| {
            let of = |(step, length): &(isize, f64)| {
                let from = cell.checked_add_signed(sign * step)?;
                far.get(from).map(|from| from + length)
            };
            steps.iter().filter_map(of).fold(far[cell], f64::min)
        };
        for cell in 0..self.len() {
            far[cell] = lower(&far, cell, -1);
        }
        for cell in (0..self.len()).rev() {
            far[cell] = lower(&far, cell, 1);
        }
        far.iter().map(|cells| cells * self.cell_m).collect()
    }
}

fn inverted(set: &[bool]) -> Vec<bool> {
    set.iter().map(|is_in| !is_in).collect()
}
