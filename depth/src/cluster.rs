//! Points that belong together: DBSCAN in the ground plane.
//!
//! ```text
//!   ∙∙●●●∙   ● core: enough points within `eps_m`      cells of 2 cm, each weighs as many points as lie in it
//!     ●●●    ∙ edge: within `eps_m` of a core
//!         ∘  ∘ noise: neither                          a person: some hundred cells, not some thousand points
//! ```
//!
//! Ester, Kriegel, Sander and Xu, "A density-based algorithm for discovering clusters", 1996. Written here because the
//! kept crates take no weights: on single points of 320 × 240 pixels each search finds thousands of neighbours.

use std::collections::BTreeMap;

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use crate::foreground::Point;

/// Side of a cell, m: a pixel at 3 m and 320 columns.
const CELL_M: f32 = 0.02;

/// What makes a cluster.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Density {
    /// Reach of a point, m.
    pub eps_m: f32,
    /// Points within reach, itself included, that make a core.
    pub least: usize,
}

impl Density {
    /// For whole images: half of the gap two people leave between their chests in a crowd (0.3 m), and what a head
    /// alone shows at 5 m.
    pub const USUAL: Self = Self { eps_m: 0.15, least: 20 };
}

type Cell = (i32, i32);

/// Indices into `points` of each cluster, the largest first; noise is in none. The same points give the same
/// clusters in the same order.
#[must_use]
pub fn clusters(points: &[Point], density: &Density) -> Vec<Vec<usize>> {
    let mut cells: BTreeMap<Cell, Vec<usize>> = BTreeMap::new();
    for (index, point) in points.iter().enumerate() {
        let [x, y, _] = point.place;
        if x.is_finite() && y.is_finite() {
            cells.entry(((x / CELL_M).floor() as i32, (y / CELL_M).floor() as i32)).or_default().push(index);
        }
    }
    let reach = (density.eps_m / CELL_M).floor() as i32;
    let cells = &cells;
    // Column by column, as a look-up of each cell in reach costs ten times as much: most are empty.
    let within = |&(x, y): &Cell| {
        let columns = x.saturating_sub(reach)..=x.saturating_add(reach);
        columns.flat_map(move |column| {
            let across = (reach * reach - (column - x) * (column - x)).max(0);
            let span = (across as f32).sqrt() as i32;
            cells.range((column, y.saturating_sub(span))..=(column, y.saturating_add(span)))
        })
    };
    let is_core = |cell: &Cell| within(cell).map(|(_, near)| near.len()).sum::<usize>() >= density.least;
    let mut of_cell: BTreeMap<Cell, usize> = BTreeMap::new();
    let mut found: Vec<Vec<usize>> = Vec::new();
    for start in cells.keys() {
        if of_cell.contains_key(start) || !is_core(start) {
            continue;
        }
        let number = found.len();
        found.push(Vec::new());
        of_cell.insert(*start, number);
        let mut open = vec![*start];
        while let Some(cell) = open.pop() {
            if let (Some(cluster), Some(indices)) = (found.last_mut(), cells.get(&cell)) {
                cluster.extend(indices);
            }
            if !is_core(&cell) {
                continue;
            }
            for (near, _) in within(&cell) {
                of_cell.entry(*near).or_insert_with(|| {
                    open.push(*near);
                    number
                });
            }
        }
    }
    for cluster in &mut found {
        cluster.sort_unstable();
    }
    found.sort_by_key(|cluster| std::cmp::Reverse(cluster.len()));
    found
}

/// A random choice of `count` points, as the paper's 1024; None if there are fewer, which the paper takes for an empty
/// frame. The same seed chooses the same.
#[must_use]
pub fn subsample(points: &[Point], count: usize, seed: u64) -> Option<Vec<Point>> {
    if points.len() < count {
        return None;
    }
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut chosen = points.to_vec();
    for at in 0..count {
        chosen.swap(at, random.random_range(at..points.len()));
    }
    chosen.truncate(count);
    Some(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of points, 1 cm apart.
    fn square(x_m: f32, y_m: f32, side: usize) -> Vec<Point> {
        let at = |n: usize| [x_m + (n % side) as f32 / 100.0, y_m + (n / side) as f32 / 100.0, 1.2];
        (0..side * side).map(|n| Point { column: n, place: at(n) }).collect()
    }

    fn sizes(points: &[Point]) -> Vec<usize> {
        clusters(points, &Density::USUAL).iter().map(Vec::len).collect()
    }

    #[test]
    fn two_people_apart_are_two_and_touching_are_one() {
        let pair = |gap_m: f32| [square(2.0, 0.0, 20), square(2.0, 0.19 + gap_m, 30)].concat();
        assert_eq!(sizes(&pair(0.30)), [900, 400]);
        assert_eq!(sizes(&pair(0.08)), [1300]);
    }

    #[test]
    fn a_few_stray_points_are_noise() {
        assert_eq!(sizes(&square(2.0, 0.0, 4)), [0; 0]);
        assert_eq!(sizes(&square(2.0, 0.0, 5)), [25]);
        assert_eq!(sizes(&[]), [0; 0]);
        assert_eq!(sizes(&[Point { column: 0, place: [f32::NAN, f32::INFINITY, 0.0] }]), [0; 0]);
    }

    #[test]
    fn a_subsample_is_of_distinct_points_and_repeats_with_its_seed() {
        let points = square(2.0, 0.0, 40);
        let columns = |seed| {
            let chosen = subsample(&points, 1024, seed).unwrap();
            chosen.iter().map(|point| point.column).collect::<std::collections::BTreeSet<_>>()
        };
        assert_eq!(columns(1).len(), 1024);
        assert_eq!(columns(1), columns(1));
        assert_ne!(columns(1), columns(2));
        assert_eq!(subsample(&points, 1601, 1), None);
    }
}
