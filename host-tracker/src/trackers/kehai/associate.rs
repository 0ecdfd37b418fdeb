//! Which candidate is whom: the assignment with the least cost of all.
//!
//! ```text
//!              candidates
//!   tracks     c11  c12  c13 │ u  ∞      cost = −ln likelihood of the candidate, given the track
//!              c21  c22  c23 │ ∞  u      u: left without one
//! ```

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are compared to a thousandth.
const SCALE: f64 = 1000.0;

/// More than any cost.
const NEVER: i64 = 1_000_000;

/// For each row the column assigned to it, so that the sum of `cost`s is least. A row that is left without one
/// costs its `unassigned`, and a pair is never made that costs more than `most`.
pub fn assign(
    unassigned: &[f64],
    columns: usize,
    most: f64,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    let rows = unassigned.len();
    if rows == 0 || columns == 0 {
        return vec![None; rows];
    }
    let costs = Matrix::from_fn(rows, columns + rows, |(row, column)| {
        if column < columns {
            let cost = cost(row, column);
            if cost < most { (cost * SCALE) as i64 } else { NEVER }
        } else if column - columns == row {
            (unassigned[row] * SCALE) as i64
        } else {
            NEVER
        }
    });
    let (_, assigned) = kuhn_munkres_min(&costs);
    assigned
        .into_iter()
        .enumerate()
        .map(|(row, column)| (column < columns && costs[(row, column)] < NEVER).then_some(column))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_counts_not_the_nearest() {
        // The nearest of the first is the only one of the second.
        let costs = [[1.0, 2.0], [1.5, 9.0]];
        assert_eq!(assign(&[5.0; 2], 2, 5.0, |row, column| costs[row][column]), [Some(1), Some(0)]);
    }

    #[test]
    fn too_far_is_nobody() {
        assert_eq!(assign(&[5.0; 2], 1, 5.0, |row, _| if row == 0 { 6.0 } else { 4.0 }), [None, Some(0)]);
        assert_eq!(assign(&[5.0], 0, 5.0, |_, _| 0.0), [None]);
    }
}
