//! One-to-one assignment with the least total cost, in which rows may stay without a column.
//!
//! ```text
//!        c1  c2  c3  c4
//!   r1    5   ·   ·   ·     r1–c1: neither is in another pair; compared with what r1 alone costs
//!   r2    ·   1   2   ·  ┐
//!   r3    ·   1   ·   ·  ┘  the rest by the Hungarian method, crate `pathfinding`
//! ```
//!
//! Pairs that share no row and no column with others have no part in the sum of the others: the result is the same as that of
//! the whole matrix.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are compared to a thousandth.
const SCALE: f64 = 1000.0;

/// More than any cost.
const NEVER: i64 = 1_000_000;

/// What a row costs that stays without a column.
pub struct Alone<F> {
    /// No row costs less.
    pub least: f64,
    /// What each costs: worked out only where it decides.
    pub of: F,
}

impl Alone<()> {
    /// The same for all rows.
    pub fn all(cost: f64) -> Alone<impl Fn(usize) -> f64> {
        Alone { least: cost, of: move |_| cost }
    }
}

/// For each row its column. None as a cost: never.
pub fn assign(
    rows: usize,
    columns: usize,
    alone: &Alone<impl Fn(usize) -> f64>,
    cost: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<Option<usize>> {
    let mut assigned = vec![None; rows];
    let mut costs = Vec::with_capacity(rows * columns);
    let (mut of_row, mut of_column) = (vec![Pairs::None; rows], vec![Pairs::None; columns]);
    for (row, of_row) in of_row.iter_mut().enumerate() {
        for (column, of_column) in of_column.iter_mut().enumerate() {
            let cost = cost(row, column).map_or(NEVER, scaled);
            if cost < NEVER {
                of_row.add(column);
                of_column.add(row);
            }
            costs.push(cost);
        }
    }
    let cost = |row: usize, column: usize| costs.get(row * columns + column).copied().unwrap_or(NEVER);
    let column_of = |row: usize| match of_row.get(row) {
        Some(Pairs::One(column)) if matches!(of_column.get(*column), Some(Pairs::One(_))) => Some(*column),
        _ => None,
    };
    for (row, assigned) in assigned.iter_mut().enumerate() {
        let is_cheaper = |column: &usize| {
            let cost = cost(row, *column);
            cost <= scaled(alone.least) || cost <= scaled((alone.of)(row))
        };
        *assigned = column_of(row).filter(is_cheaper);
    }
    let is_open = |row: &usize| !matches!(of_row.get(*row), Some(Pairs::None)) && column_of(*row).is_none();
    let open: Vec<usize> = (0..rows).filter(is_open).collect();
    if open.is_empty() {
        return assigned;
    }
    let is_wanted = |column: &usize| open.iter().any(|row| cost(*row, *column) < NEVER);
    let wanted: Vec<usize> = (0..columns).filter(is_wanted).collect();
    let matrix = Matrix::from_fn(open.len(), wanted.len() + open.len(), |(row, column)| {
        match (open.get(row), wanted.get(column)) {
            (Some(&row), Some(&column)) => cost(row, column),
            (Some(&open), None) if column - wanted.len() == row => scaled((alone.of)(open)),
            _ => NEVER,
        }
    });
    let (_, chosen) = kuhn_munkres_min(&matrix);
    for (&row, chosen) in open.iter().zip(chosen) {
        let column = wanted.get(chosen).copied().filter(|column| cost(row, *column) < NEVER);
        if let Some(assigned) = assigned.get_mut(row) {
            *assigned = column;
        }
    }
    assigned
}

/// Of how many pairs a row or a column is.
#[derive(Clone, Copy)]
enum Pairs {
    None,
    /// With this one.
    One(usize),
    Several,
}

impl Pairs {
    const fn add(&mut self, other: usize) {
        *self = if matches!(self, Self::None) { Self::One(other) } else { Self::Several };
    }
}

fn scaled(cost: f64) -> i64 {
    ((cost * SCALE) as i64).min(NEVER)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assigned(costs: &[&[Option<f64>]]) -> Vec<Option<usize>> {
        let columns = costs.first().map_or(0, |row| row.len());
        assign(costs.len(), columns, &Alone::all(5.0), |row, column| costs[row][column])
    }

    #[test]
    fn the_sum_decides_and_a_row_may_stay_alone() {
        let rows: [&[Option<f64>]; 3] =
            [&[Some(1.0), Some(2.0)], &[Some(1.1), None], &[Some(9.0), Some(9.0)]];
        assert_eq!(assigned(&rows), [Some(1), Some(0), None]);
        assert_eq!(assigned(&[&[], &[]]), [None, None]);
        assert_eq!(assigned(&[&[Some(1.0), Some(2.0)], &[Some(1.5), Some(9.0)]]), [Some(1), Some(0)]);
    }

    #[test]
    fn a_pair_of_its_own_is_made_if_it_costs_less_than_its_row_alone() {
        let costs = [[Some(2.0), None, None], [None, None, Some(4.0)]];
        let at =
            |of: fn(usize) -> f64| assign(2, 3, &Alone { least: 1.0, of }, |row, column| costs[row][column]);
        assert_eq!(at(|_| 3.0), [Some(0), None]);
        assert_eq!(at(|row| if row == 0 { 1.5 } else { 5.0 }), [None, Some(2)]);
    }

    #[test]
    fn the_sum_is_the_least_of_all_assignments() {
        let mut random = 1_u64;
        let mut next = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 40) as f64 / f64::from(1 << 24)
        };
        for _ in 0..500 {
            let (rows, columns) = ((next() * 5.0) as usize, (next() * 5.0) as usize);
            let costs: Vec<Vec<Option<f64>>> = (0..rows)
                .map(|_| (0..columns).map(|_| (next() < 0.4).then_some(next() * 8.0)).collect())
                .collect();
            let alone: Vec<f64> = (0..rows).map(|_| 3.0 + next() * 4.0).collect();
            let cost = |row: usize, column: usize| costs[row][column];
            let chosen = assign(rows, columns, &Alone { least: 3.0, of: |row| alone[row] }, cost);
            let sum: f64 = chosen
                .iter()
                .enumerate()
                .map(|(row, column)| column.map_or(alone[row], |column| costs[row][column].unwrap()))
                .sum();
            let least = least(&costs, &alone, 0, &mut vec![false; columns]);
            assert!((sum - least).abs() < 0.01, "{costs:?} {alone:?}: {chosen:?} costs {sum}, not {least}");
        }
    }

    /// The least sum by trying all.
    fn least(costs: &[Vec<Option<f64>>], alone: &[f64], row: usize, taken: &mut [bool]) -> f64 {
        let Some(own) = costs.get(row) else { return 0.0 };
        let mut best = alone[row] + least(costs, alone, row + 1, taken);
        for (column, cost) in own.iter().enumerate() {
            if let Some(cost) = cost.filter(|_| !taken[column]) {
                taken[column] = true;
                best = best.min(cost + least(costs, alone, row + 1, taken));
                taken[column] = false;
            }
        }
        best
    }
}
