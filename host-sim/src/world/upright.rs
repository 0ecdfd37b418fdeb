//! A body by height: what a plane cuts of it follows from its height.
//!
//! ```text
//!    1.4 ┌──┐              shoulders; everything grows with them
//!       ┌┤  ├┐ torso, arms as the gesture has them (`shape`); a reaching arm goes down
//!   0.85 └┬┬┬┘╲            from the shoulder to a table, and a plane cuts it
//!         ││││ ╲ hand      ever farther ahead the lower it is
//!   0.45  ││││
//!   0.08  └┘└┘ shanks, feet
//! ```

use heapless::Vec;

use super::body::{ARM_RADIUS_M, Body, MAX_OUTLINES, SHOULDERS_M, Section, Stance};
use super::geometry::{Outline, Point};
use super::shape::{Gesture, Shape, arms};

/// A part of a leg.
pub(crate) struct Leg {
    /// How far it swings forward and back at a brisk walk, m.
    pub(crate) swing_m: f64,
    /// Half axes along and across, m.
    pub(crate) half_axes_m: (f64, f64),
    /// Heights of its lower and upper end, m.
    pub(crate) heights_m: (f64, f64),
}

/// Foot, shank and thigh.
pub(crate) const LEGS: [Leg; 3] = [
    Leg { swing_m: 0.28, half_axes_m: (0.13, 0.05), heights_m: (0.0, 0.08) },
    Leg { swing_m: 0.22, half_axes_m: (0.055, 0.055), heights_m: (0.08, 0.45) },
    Leg { swing_m: 0.13, half_axes_m: (0.085, 0.085), heights_m: (0.45, 0.85) },
];

/// Half the distance of the legs, m.
pub(crate) const LEG_M: f64 = 0.09;

/// Heights of the torso, m.
pub(crate) const TORSO_M: (f64, f64) = (0.85, SHOULDERS_M);

/// Shoulder joint and hand of an arm that reaches over a table, m above the floor, and how far the hand is before the
/// chest, m: the length of arm and hand, 0.75 m, goes down by 0.6 m.
const REACH_M: (f64, f64) = (1.35, 0.75);
const HAND_AHEAD_M: f64 = 0.45;

/// Lower and upper end of the parts of an arm, m, and the share of the hand's swing that each has: a hanging arm turns about
/// the shoulder.
pub(crate) const fn arm_levels(gesture: Gesture) -> &'static [(f64, f64, f64)] {
    match gesture {
        Gesture::Hang => &[(1.1, 1.38, 0.3), (0.75, 1.1, 0.8)],
        Gesture::Fold => &[(1.05, 1.3, 0.0)],
        Gesture::Carry => &[(0.85, 1.15, 0.0)],
        Gesture::Reach => &[(1.05, 1.15, 0.0)],
    }
}

/// What a plane at this height cuts of a body. One of another section than `by-height` is the same at every height.
#[must_use]
pub fn cut(body: &Body, stance: &Stance, height_m: f64) -> Vec<Outline, MAX_OUTLINES> {
    if body.section != Section::ByHeight {
        return body.outlines(stance);
    }
    let scale = body.top_m / SHOULDERS_M;
    // As high as on a body of ordinary height.
    let level_m = height_m / scale;
    let within = |(low_m, high_m): (f64, f64)| (low_m..high_m).contains(&level_m);
    let ahead = Point::towards(stance.heading_rad);
    let swing = libm::sin(stance.stride_rad) * stance.stride;
    let mut outlines = Vec::new();
    for leg in LEGS.iter().filter(|leg| within(leg.heights_m)) {
        let half_axes_m = (leg.half_axes_m.0 * scale, leg.half_axes_m.1 * scale);
        outlines.extend([1.0, -1.0].map(|side| Outline::Ellipse {
            centre: stance.at
                + (ahead.left() * (side * LEG_M) + ahead * (side * swing * leg.swing_m)) * scale,
            axis: ahead,
            half_axes_m,
        }));
    }
    let sizes = (body.half_width_m, body.half_depth_m);
    if within(TORSO_M) {
        let half_axes_m = (sizes.1, sizes.0);
        outlines.extend([Outline::Ellipse { centre: stance.at, axis: ahead, half_axes_m }]);
    }
    let (radius_m, gesture) = match body.shape {
        Shape::Arms { radius_m, gesture } => (radius_m, gesture),
        Shape::Plain | Shape::Coat { .. } => (ARM_RADIUS_M, Gesture::Hang),
    };
    if gesture == Gesture::Reach {
        outlines.extend(reaching(sizes, radius_m, level_m).map(|(along_m, aside_m, half_axes_m)| {
            let centre = stance.at + ahead * along_m + ahead.left() * aside_m;
            Outline::Ellipse { centre, axis: ahead, half_axes_m }
        }));
        return outlines;
    }
    for (_, _, share) in arm_levels(gesture).iter().filter(|level| within((level.0, level.1))) {
        outlines.extend(arms(gesture, radius_m, sizes, (stance.at, ahead, swing * share)));
    }
    outlines
}

/// An arm that reaches over a table, cut at a level: how far ahead and to the left, and its half axes, m.
fn reaching(
    (half_width_m, half_depth_m): (f64, f64),
    radius_m: f64,
    level_m: f64,
) -> Option<(f64, f64, (f64, f64))> {
    let (shoulder_m, hand_m) = REACH_M;
    let down = (shoulder_m - level_m) / (shoulder_m - hand_m);
    if !(0.0..=1.0).contains(&down) {
        return None;
    }
    let length_m = (half_depth_m + HAND_AHEAD_M).hypot(shoulder_m - hand_m);
    // A slanting cylinder is cut as long as it is flat.
    let along_m = radius_m * length_m / (shoulder_m - hand_m);
    Some(((half_depth_m + HAND_AHEAD_M) * down, 0.7 * half_width_m, (along_m, radius_m)))
}

#[cfg(test)]
mod tests {
    use super::super::random::{Purpose, Stream};
    use super::super::shape::Family;
    use super::*;

    fn body(gesture: Gesture) -> Body {
        let body = Body::random(Section::ByHeight, &mut Stream::new(1, Purpose::Person, [0, 0]));
        body.of(Family::Arms, &mut Stream::new(1, Purpose::Shape, [0, 0])).at(gesture)
    }

    #[test]
    fn planes_at_different_heights_cut_different_things() {
        let stance = Stance::walking(Point::new(1.0, 2.0), 0.0, 0.3, 1.0);
        let count = |gesture, height_m| cut(&body(gesture), &stance, height_m).len();
        // Shanks; thighs; thighs and hands; torso and arms; folded arms; nothing above the shoulders.
        let of = |gesture| [0.3, 0.6, 0.8, 1.0, 1.2, 1.45].map(|height_m| count(gesture, height_m));
        assert_eq!(of(Gesture::Hang), [2, 2, 4, 3, 3, 0]);
        assert_eq!(of(Gesture::Fold), [2, 2, 2, 1, 2, 0]);
        assert_eq!(of(Gesture::Reach), [2, 2, 3, 2, 2, 0]);
        let child = Body { top_m: 0.8, ..body(Gesture::Hang) };
        assert_eq!(cut(&child, &stance, 0.6).len(), 3, "a child's torso");
    }

    #[test]
    fn a_reaching_hand_is_half_a_metre_ahead_and_within_reach() {
        let stance = Stance::walking(Point::default(), 0.0, 0.0, 0.0);
        let body = body(Gesture::Reach);
        let hand = cut(&body, &stance, 0.76).pop().unwrap().bounds();
        assert!((0.5..0.65).contains(&hand.0.x), "{hand:?}");
        assert!(hand.0.length() + hand.1 < body.reach_m(), "{hand:?}");
        assert_eq!(cut(&body, &stance, 0.74).len(), 2, "below the hand there are thighs");
    }
}
