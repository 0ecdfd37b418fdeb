//! One-to-one assignment with the least total cost, in which rows may stay without a column.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are compared to a thousandth.
const SCALE: f64 = 1000.0;

/// More than any cost.
const NEVER: i64 = 1_000_000;

/// For each row its column. A row that stays without one costs `alone`; None as a cost: never.
pub fn assign(
    rows: usize,
    columns: usize,
    alone: f64,
    cost: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<Option<usize>> {
    if rows == 0 || columns == 0 {
        return vec![None; rows];
    }
    let costs = Matrix::from_fn(rows, columns + rows, |(row, column)| {
        if column < columns {
            cost(row, column).map_or(NEVER, |cost| ((cost * SCALE) as i64).min(NEVER))
        } else if column - columns == row {
            (alone * SCALE) as i64
        } else {
            NEVER
        }
    });
    let (_, assigned) = kuhn_munkres_min(&costs);
    let allowed =
        |(row, column): (usize, usize)| (column < columns && costs[(row, column)] < NEVER).then_some(column);
    assigned.into_iter().enumerate().map(allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_decides_and_a_row_may_stay_alone() {
        let costs = [[Some(1.0), Some(2.0)], [Some(1.1), None], [Some(9.0), Some(9.0)]];
        let assigned = assign(3, 2, 5.0, |row, column| costs[row][column]);
        assert_eq!(assigned, [Some(1), Some(0), None]);
        assert_eq!(assign(2, 0, 5.0, |_, _| None), [None, None]);
    }
}
