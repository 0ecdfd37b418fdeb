//! A body as a stack of ellipses: what a plane cuts of it follows from its height.
//!
//! ```text
//!    1.7 ┌─┐  head             at a stature of 1.7 m; everything grows with the stature
//!    1.4 ├─┴┐
//!       ┌┤  ├┐ torso, arms     arms as the gesture has them (`world::shape`)
//!   0.85 └┬┬┬┘
//!         ││││ thighs          legs and arms swing with the way walked
//!   0.45  ││││ shanks
//!   0.08  └┘└┘ feet
//! ```

use std::f64::consts::PI;

use crate::world::geometry::{Outline, Point};
use crate::world::shape::arms;
use crate::world::upright::{LEG_M, LEGS, TORSO_M, arm_levels};

use super::walk::{Bag, Moment};

/// Stature for which the heights above hold, m.
pub(super) const STATURE_M: f64 = 1.7;

/// Way of two steps, m.
pub(super) const STRIDE_M: f64 = 1.4;

/// Speed of the widest swing, m/s.
const BRISK_MPS: f64 = 1.2;

/// A bag: half its length and width, and its height, m.
const BAG_M: (f64, f64, f64) = (0.18, 0.08, 0.35);

/// A bag in the hand hangs so far above the floor, m.
const HANDLE_M: f64 = 0.3;

/// An upright elliptic cylinder.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cut {
    /// Its middle, m.
    pub centre: Point,
    /// Unit vector along the first half axis.
    pub axis: Point,
    /// Half axes, m.
    pub half_axes_m: (f64, f64),
    /// Heights of its lower and upper end, m.
    pub heights_m: (f64, f64),
}

impl Cut {
    fn of(outline: &Outline, heights_m: (f64, f64)) -> Option<Self> {
        match *outline {
            Outline::Ellipse { centre, axis, half_axes_m } => {
                Some(Self { centre, axis, half_axes_m, heights_m })
            }
            Outline::Segment(..) | Outline::Superellipse { .. } => None,
        }
    }
}

/// A body.
#[derive(Clone, PartialEq, Debug)]
pub struct Stack {
    /// Its parts.
    pub cuts: Vec<Cut>,
}

impl Stack {
    /// A person.
    #[must_use]
    pub fn person(walker: &Moment) -> Self {
        let scale = walker.stature_m / STATURE_M;
        let (at, ahead) = (walker.at, walker.ahead);
        let swing = (walker.speed_mps / BRISK_MPS).min(1.3)
            * libm::sin(2.0 * PI * walker.walked_m / (STRIDE_M * scale));
        let heights = |low_m: f64, high_m: f64| (low_m * scale, high_m * scale);
        let mut cuts = Vec::with_capacity(12);
        for side in [1.0, -1.0] {
            for leg in &LEGS {
                let off = ahead.left() * (side * LEG_M) + ahead * (side * swing * leg.swing_m);
                let half_axes_m = (leg.half_axes_m.0 * scale, leg.half_axes_m.1 * scale);
                let heights_m = heights(leg.heights_m.0, leg.heights_m.1);
                cuts.push(Cut { centre: at + off * scale, axis: ahead, half_axes_m, heights_m });
            }
        }
        let (half_width_m, half_depth_m) = (walker.half_axes_m.0 * scale, walker.half_axes_m.1 * scale);
        let part =
            |half_axes_m: (f64, f64), heights_m| Cut { centre: at, axis: ahead, half_axes_m, heights_m };
        cuts.push(part((half_depth_m, half_width_m), heights(TORSO_M.0, TORSO_M.1)));
        cuts.push(part((0.10 * scale, 0.08 * scale), heights(1.4, 1.7)));
        for (low_m, high_m, turn) in arm_levels(walker.gesture) {
            let swing = (at, ahead, swing * turn);
            let held = arms(walker.gesture, 0.045 * scale, (half_width_m, half_depth_m), swing);
            cuts.extend(held.iter().filter_map(|arm| Cut::of(arm, heights(*low_m, *high_m))));
        }
        Self { cuts }
    }

    /// The bag of a person.
    #[must_use]
    pub fn bag(walker: &Moment) -> Option<Self> {
        let (along_m, across_m, high_m) = BAG_M;
        let (centre, low_m) = match walker.bag {
            Bag::None => return None,
            Bag::Carried => {
                let aside_m = walker.half_axes_m.0 * walker.stature_m / STATURE_M + across_m;
                (walker.at - walker.ahead.left() * aside_m, HANDLE_M)
            }
            Bag::Down(at) => (at, 0.0),
        };
        let heights_m = (low_m, low_m + high_m);
        Some(Self {
            cuts: vec![Cut { centre, axis: walker.ahead, half_axes_m: (along_m, across_m), heights_m }],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::shape::Gesture;

    fn walker(stature_m: f64) -> Moment {
        Moment {
            person: 0,
            at: Point::new(2.0, 0.5),
            ahead: Point::new(0.0, 1.0),
            speed_mps: 1.2,
            walked_m: 0.35,
            stature_m,
            half_axes_m: (0.22, 0.14),
            gesture: Gesture::Hang,
            bag: Bag::Carried,
        }
    }

    /// What a plane cuts.
    fn cut(stack: &Stack, height_m: f64) -> usize {
        stack.cuts.iter().filter(|cut| (cut.heights_m.0..cut.heights_m.1).contains(&height_m)).count()
    }

    #[test]
    fn sixty_centimetres_cut_the_thighs_of_an_adult_and_the_torso_of_a_child() {
        let (adult, child) = (Stack::person(&walker(1.7)), Stack::person(&walker(1.0)));
        assert_eq!((cut(&adult, 0.6), cut(&adult, 0.3), cut(&adult, 1.6), cut(&adult, 1.75)), (2, 2, 1, 0));
        // Torso and two arms.
        assert_eq!((cut(&child, 0.6), cut(&child, 1.05)), (3, 0));
        assert_eq!(cut(&adult, 1.2), 3);
    }

    #[test]
    fn a_bag_is_in_the_hand_or_on_the_floor() {
        let carried = Stack::bag(&walker(1.7)).unwrap();
        let down = Stack::bag(&Moment { bag: Bag::Down(Point::new(1.0, 1.0)), ..walker(1.7) }).unwrap();
        assert_eq!((cut(&carried, 0.1), cut(&down, 0.1)), (0, 1));
        assert_eq!(Stack::bag(&Moment { bag: Bag::None, ..walker(1.7) }), None);
    }
}
