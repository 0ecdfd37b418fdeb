//! One-to-one assignment of persons and tracks, by the Hungarian method of the `pathfinding` crate.
//!
//! ```text
//!            track 0  track 1  track 2
//! person 0     0.1      0.4       –         – : not allowed
//! person 1     0.2       –        –     ─▶ (0, 1), (1, 0): as many pairs as possible, then the nearest
//! ```
//!
//! Weights are whole numbers, so that the outcome is the same on every machine.

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// Reciprocal of the smallest difference of two weights or distances that counts.
const RESOLUTION: f64 = 1e12;

/// A weight between 0 and a few thousand as a whole number.
#[must_use]
pub fn quantised(weight: f64) -> i64 {
    (weight * RESOLUTION).round() as i64
}

/// The pairs (row, column) with the largest total weight, by row. Pairs without weight are left out.
#[must_use]
pub fn heaviest(rows: usize, columns: usize, weight: impl Fn(usize, usize) -> i64) -> Vec<(usize, usize)> {
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    // The solver wants at least as many columns as rows.
    let turned = rows > columns;
    let (short, long) = if turned { (columns, rows) } else { (rows, columns) };
    let place = |a: usize, b: usize| if turned { (b, a) } else { (a, b) };
    let cells = (0..short).flat_map(|a| (0..long).map(move |b| place(a, b)));
    let weights = Matrix::from_fn(short, long, {
        let all: Vec<i64> = cells.map(|(row, column)| weight(row, column)).collect();
        move |(a, b)| all[a * long + b]
    });
    let (_, chosen) = kuhn_munkres(&weights);
    let mut pairs: Vec<_> = chosen
        .into_iter()
        .enumerate()
        .map(|(a, b)| place(a, b))
        .filter(|&(row, column)| weight(row, column) > 0)
        .collect();
    pairs.sort_unstable();
    pairs
}

/// As many allowed pairs (row, column) as possible, and of those the ones with the least total distance.
#[must_use]
pub fn nearest(
    rows: usize,
    columns: usize,
    distance_m: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<(usize, usize)> {
    let cells = || (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let longest = cells().filter_map(|(row, column)| distance_m(row, column)).fold(0.0, f64::max);
    // Nanometres: room for a thousand rows of kilometres.
    let whole = |metres: f64| (metres * 1e9).round() as i64;
    // One pair more outweighs any distances.
    let pair = (whole(longest) + 1) * (rows.min(columns) as i64 + 1);
    heaviest(rows, columns, |row, column| {
        distance_m(row, column).map_or(0, |distance_m| pair - whole(distance_m))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_more_is_worth_any_distance() {
        let distances = [[Some(0.1), Some(0.4)], [Some(0.2), None]];
        assert_eq!(nearest(2, 2, |row, column| distances[row][column]), [(0, 1), (1, 0)]);
    }

    #[test]
    fn more_rows_than_columns_are_no_matter() {
        let distances = [Some(0.3), None, Some(0.2)];
        assert_eq!(nearest(3, 1, |row, _| distances[row]), [(2, 0)]);
        assert_eq!(nearest(1, 3, |_, column| distances[column]), [(0, 2)]);
        assert_eq!(nearest(0, 3, |_, _| Some(1.0)), []);
        assert_eq!(nearest(2, 1, |_, _| None), []);
    }

    #[test]
    fn the_heaviest_total_wins_over_the_heaviest_pair() {
        let weights = [[10, 9], [9, 1]];
        assert_eq!(heaviest(2, 2, |row, column| weights[row][column]), [(0, 1), (1, 0)]);
    }
}
