//! Families of shapes that a plane cuts of a body: what the tracker's estimator does not assume.
//!
//! ```text
//!   plain           arms: hanging · folded · carrying · reaching        coat
//!    ____           ____      ____       _____        ____             ______
//!  o(____)o       O(____)O   (____)     (_____)      (____)           (      )   squarer and deeper:
//!                             ════        (__)          ││             ╲____╱    |x|ⁿ + |y|ⁿ = 1
//! ```
//!
//! The estimator takes every torso for an ellipse of 0.225 × 0.14 m (`kehai::centre`). `plain` is drawn around that;
//! the other two share no number with it. Sizes: shoulder breadth 0.37–0.50 m and chest depth 0.20–0.30 m of adults
//! (DIN 33402-2, 5th to 95th percentile), forearm and hand 0.40–0.48 m, upper arm 0.08–0.11 m thick with a sleeve.

use heapless::Vec;

use super::geometry::{Outline, Point};
use super::random::{Purpose, Stream};

/// Most outlines of arms.
pub const MOST_ARMS: usize = 2;

/// A gesture is held for so long, s.
const HELD_S: (f64, f64) = (1.5, 6.0);

/// How far an arm is from the torso's end when it hangs, m: beside it, not within.
const HANGING_M: f64 = 0.02;

/// How far from the torso's front an outline of an arm ends at most, m.
pub const ARMS_REACH_M: f64 = 0.46;

/// How far an arm swings at a brisk walk, m.
const SWING_M: f64 = 0.20;

/// The family of a body's shape.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// An ellipse like the estimator's, and two thin arms.
    #[default]
    Plain,
    /// An ellipse, and arms that swing wide, are folded, carry or reach.
    Arms,
    /// A superellipse: a coat, open or closed, without arms of its own.
    Coats,
}

/// What the arms of a body do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Gesture {
    /// They hang beside the torso, and swing while walking.
    Hang,
    /// Folded before the chest.
    Fold,
    /// A box or a child before the belly.
    Carry,
    /// One is stretched out: a handrail, a telephone, a door.
    Reach,
}

/// The shape of one body.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Shape {
    /// As [`Family::Plain`].
    #[default]
    Plain,
    /// As [`Family::Arms`].
    Arms {
        /// Radius of an arm in its sleeve, m.
        radius_m: f64,
        /// What they do now.
        gesture: Gesture,
    },
    /// As [`Family::Coats`].
    Coat {
        /// Exponent: 2 is an ellipse, 4 nearly a box.
        exponent: f64,
    },
}

/// Sizes and shape of a body of a family: half its width and half its depth, m, and the shape.
#[must_use]
pub fn draw(family: Family, stream: &mut Stream) -> Option<(f64, f64, Shape)> {
    match family {
        Family::Plain => None,
        Family::Arms => {
            let sizes = (stream.between(0.165, 0.215), stream.between(0.10, 0.15));
            let shape = Shape::Arms { radius_m: stream.between(0.04, 0.055), gesture: Gesture::Hang };
            Some((sizes.0, sizes.1, shape))
        }
        Family::Coats => {
            let shape = Shape::Coat { exponent: stream.between(2.3, 4.0) };
            Some((stream.between(0.22, 0.30), stream.between(0.14, 0.20), shape))
        }
    }
}

/// What the arms of a person do over time: a new gesture every few seconds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Gestures {
    /// Seed of the run.
    pub seed: u64,
    /// Number of the person.
    pub person: u64,
}

impl Gestures {
    /// The gesture at `time_s`, and on which side a single arm is: 1 left, −1 right.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Gesture {
        // A slot is as long as the longest gesture; it holds the end of one and the beginning of the next.
        let slot = (time_s.max(0.0) / HELD_S.1) as u64;
        let mut stream = Stream::new(self.seed, Purpose::Gesture, [self.person, slot]);
        let (first, second) = (choose(stream.uniform()), choose(stream.uniform()));
        let changes_s = slot as f64 * HELD_S.1 + stream.between(HELD_S.0, HELD_S.1);
        if time_s < changes_s { first } else { second }
    }
}

/// Half of the time arms hang; else each of the others alike.
fn choose(uniform: f64) -> Gesture {
    match uniform {
        ..0.5 => Gesture::Hang,
        ..0.67 => Gesture::Fold,
        ..0.84 => Gesture::Carry,
        _ => Gesture::Reach,
    }
}

/// The outlines of the arms of a torso at `at` that looks `ahead`; `swing` from −1.3 to 1.3.
#[must_use]
pub fn arms(
    gesture: Gesture,
    radius_m: f64,
    (half_width_m, half_depth_m): (f64, f64),
    (at, ahead, swing): (Point, Point, f64),
) -> Vec<Outline, MOST_ARMS> {
    let mut outlines = Vec::new();
    let left = ahead.left();
    let ellipse = |centre: Point, along_m: f64, across_m: f64| Outline::Ellipse {
        centre,
        axis: ahead,
        half_axes_m: (along_m, across_m),
    };
    match gesture {
        Gesture::Hang => {
            let beside = left * (half_width_m + HANGING_M + radius_m);
            let forward = ahead * (swing * SWING_M);
            outlines.extend([
                Outline::disc(at + beside - forward, radius_m),
                Outline::disc(at - beside + forward, radius_m),
            ]);
        }
        Gesture::Fold => {
            outlines.extend([ellipse(at + ahead * half_depth_m, radius_m + 0.02, half_width_m)]);
        }
        Gesture::Carry => {
            outlines.extend([ellipse(at + ahead * (half_depth_m + 0.12), 0.15, 0.19)]);
        }
        Gesture::Reach => {
            let centre = at + ahead * (half_depth_m + 0.22) + left * (half_width_m * 0.7);
            outlines.extend([ellipse(centre, 0.24, radius_m)]);
        }
    }
    outlines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gestures_are_held_and_all_of_them_are_seen() {
        let gestures = Gestures { seed: 7, person: 3 };
        let seen: std::vec::Vec<Gesture> =
            (0..6000).map(|tenth| gestures.at(f64::from(tenth) * 0.1)).collect();
        let changes = seen.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!((60..250).contains(&changes), "{changes} in ten minutes");
        for gesture in [Gesture::Hang, Gesture::Fold, Gesture::Carry, Gesture::Reach] {
            let share = seen.iter().filter(|seen| **seen == gesture).count() as f64 / 6000.0;
            assert!(share > 0.08 && share < 0.7, "{gesture:?} {share}");
        }
        assert_eq!(gestures.at(33.3), gestures.at(33.3), "a function of the time");
    }

    #[test]
    fn arms_lie_where_they_are_said_to_lie() {
        let torso = (0.2, 0.12);
        let of = |gesture| arms(gesture, 0.05, torso, (Point::default(), Point::new(1.0, 0.0), 0.0));
        let hang = of(Gesture::Hang);
        assert!(hang.iter().all(|arm| (arm.bounds().0.y.abs() - 0.27).abs() < 1e-9));
        let reach = of(Gesture::Reach);
        let (centre, radius_m) = reach[0].bounds();
        assert!(centre.x + radius_m > 0.5, "half a metre ahead: {}", centre.x + radius_m);
        assert_eq!(of(Gesture::Carry).len(), 1);
    }

    #[test]
    fn no_family_but_plain_has_the_estimator_s_mean() {
        let mean = |family: Family| {
            let sizes = (0..1000).filter_map(|person| {
                let (width_m, depth_m, _) = draw(family, &mut Stream::new(1, Purpose::Shape, [person, 0]))?;
                Some((width_m, depth_m))
            });
            let sum = sizes.fold((0.0, 0.0, 0.0), |sum, size| (sum.0 + size.0, sum.1 + size.1, sum.2 + 1.0));
            (sum.0 / sum.2, sum.1 / sum.2)
        };
        for family in [Family::Arms, Family::Coats] {
            let (width_m, depth_m) = mean(family);
            assert!((width_m - 0.225).abs() > 0.02, "{family:?}: half width {width_m}");
            assert!((depth_m - 0.14).abs() > 0.01, "{family:?}: half depth {depth_m}");
        }
        assert_eq!(draw(Family::Plain, &mut Stream::new(1, Purpose::Shape, [0, 0])), None);
    }
}
