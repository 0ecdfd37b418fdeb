//! Panels that are down and touch, corners included, as one patch: a foot, two feet side by side, or feet of two people.
//!
//! ```text
//!   ▪▪··         ▪▪ and ▪: two patches
//!   ▪··▪
//! ```

use kehai::floor::Bits;

use super::plan::Plan;
use crate::geometry::Point;

/// Panels that touch.
#[derive(Clone, PartialEq, Debug)]
pub struct Patch {
    /// Mean of their middles.
    pub middle: Point,
    /// Their middles.
    pub panels: Vec<Point>,
    /// See [`Plan::coarse_m`].
    pub coarse_m: f64,
}

impl Patch {
    /// The patch of these panels, of paper B's size; none of no panel.
    #[must_use]
    pub fn of(panels: Vec<Point>) -> Option<Self> {
        let sum = panels.iter().fold(Point::default(), |sum, at| sum + *at);
        (!panels.is_empty()).then(|| Self {
            middle: sum * (1.0 / panels.len() as f64),
            panels,
            coarse_m: 0.0,
        })
    }
}

/// The patches of the panels that are down, in the order of their first panels.
#[must_use]
pub fn patches(plan: &Plan, down: &Bits) -> Vec<Patch> {
    let (columns, panels) = (usize::from(plan.columns), plan.panels());
    let mut left = *down;
    let mut patches = Vec::new();
    for first in 0..panels {
        if !left.get(first) {
            continue;
        }
        left.set(first, false);
        let (mut open, mut middles) = (vec![first], Vec::new());
        while let Some(panel) = open.pop() {
            middles.push(plan.middle(panel));
            let (column, row) = (panel % columns, panel / columns);
            for (near_row, near_column) in around(row, column) {
                let near = near_row * columns + near_column;
                if near_column < columns && near < panels && left.get(near) {
                    left.set(near, false);
                    open.push(near);
                }
            }
        }
        patches.extend(Patch::of(middles).map(|patch| Patch { coarse_m: plan.coarse_m(), ..patch }));
    }
    patches
}

/// The rows and columns around a panel; some may lie beyond the floor.
fn around(row: usize, column: usize) -> impl Iterator<Item = (usize, usize)> {
    let near = |at: usize| at.saturating_sub(1)..=at + 1;
    near(row).flat_map(move |row| near(column).map(move |column| (row, column)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn panels_that_touch_are_one_and_no_patch_goes_round_the_edge() {
        let corner = Pose { at: Point::new(1.0, 2.0), yaw_rad: 0.0 };
        let plan = Plan { corner, columns: 4, rows: 3, pitch_m: 0.1 };
        let mut down = Bits::default();
        // (0, 0), (1, 1) by a corner; (3, 0) and (0, 2) are neighbours in number only.
        [0, 5, 3, 8].into_iter().for_each(|panel| down.set(panel, true));
        let found = patches(&plan, &down);
        let sizes: Vec<usize> = found.iter().map(|patch| patch.panels.len()).collect();
        assert_eq!(sizes, [3, 1], "(0, 2) touches (1, 1): {found:?}");
        assert!((found[1].middle - Point::new(1.35, 2.05)).length() < 1e-12);
        let turned = Plan { corner: Pose { yaw_rad: std::f64::consts::FRAC_PI_2, ..corner }, ..plan };
        assert!((patches(&turned, &down)[1].middle - Point::new(0.95, 2.35)).length() < 1e-12);
        assert_eq!(patches(&plan, &Bits::default()), []);
    }
}
