//! A sample: one possible state of a body, and how it moves.
//!
//! ```text
//!      heading ↑  ╭──╮ depth
//!          ╭──────┴──┴─╮          torso: an ellipse, `size` times the ordinary one, `depth` times as deep
//!          ╰───────────╯▬▬▬▬ hand     level arm: a narrow ellipse from the middle to a hand that is stretched out
//!                           ● hand     one that reaches up or down: the plane cuts it where something is seen
//! ```

use super::ellipse::{ACROSS_M, ALONG_M, Outline};
use super::ground::Way;
use super::random::Random;
use crate::geometry::Point;

/// Time in which a velocity is forgotten, s: a stride and a half; and of a body that is not seen.
const KEEPS_S: f64 = 1.2;
const KEEPS_UNSEEN_S: f64 = 0.6;

/// Process noise of the velocity, m/s per √s: a person who now stands and now walks has a velocity that deviates by 0.55 m/s on each
/// axis (0.8 m/s over both), and 0.55 √(2 / 1.2 s) keeps it so; by 0.38 m/s if it is forgotten in half the time.
const PROCESS_NOISE: f64 = 0.7;

/// Deviation on each axis of the velocity of a person who stands, or waits among others, and of one who walks, m/s.
pub const WAITS_MPS: f64 = 0.3;
pub const WALKS_MPS: f64 = 0.9;

/// A person who runs in is not faster, m/s. A cloud that takes another's outline would be.
const FASTEST_MPS: f64 = 3.5;

/// Process noise of the place, m per √s: model error.
const DRIFT: f64 = 0.02;

/// Process noise of the heading, rad per √s: people turn on the spot.
const TURNS: f64 = 0.8;

/// Way after which the heading follows the velocity, m.
const TURN_WAY_M: f64 = 0.3;

/// Process noise of the size per √s, and the time in which size and depth go back to 1, s: in the long run a size deviates by
/// 0.03 · √(2 s / 2).
const GROWS: f64 = 0.03;
const ORDINARY_S: f64 = 2.0;

/// Process noise of the depth per √s: in the long run it deviates by 0.15, for folded arms. Depths, up to a box of 0.3 m before
/// the belly: a scan moves a cloud there, and without one it comes back.
const DEEPENS: f64 = 0.15;
const DEPTHS: std::ops::RangeInclusive<f64> = 0.8..=2.0;

/// Process noise of a stretched hand, m per √s, and the time in which an arm is drawn back, s: a gesture.
const HAND_DRIFT: f64 = 0.2;
const STRETCHED_S: f64 = 1.0;

/// Fingers are so far beyond what is seen of a hand, m: mean and deviation.
const FINGERS_M: (f64, f64) = (0.03, 0.02);

/// Distances of a stretched hand from the middle of a body, m: beyond the torso, up to the length of an arm.
pub const REACH: std::ops::Range<f64> = 0.25..0.75;

/// Half the width of an arm, m; and half the length of what the plane cuts of a forearm that slopes by 45°.
const ARM_M: f64 = 0.05;
const FOREARM_M: f64 = 0.07;

/// Share of stretched arms that are level.
const LEVEL: f64 = 0.5;

/// Sizes: a child to a coat.
const SIZES: std::ops::RangeInclusive<f64> = 0.75..=1.3;

/// A possible state of a body.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub at: Point,
    pub velocity: Point,
    /// Unit vector.
    pub heading: Point,
    pub size: f64,
    /// Factor of the half axis along the heading: what is carried before the belly, and folded arms, make a body deeper.
    pub depth: f64,
    pub arm: Option<Arm>,
}

/// An arm that is stretched out.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    /// Its hand, in the frame of the heading and its left, m.
    pub hand: Point,
    /// Whether the plane cuts it from the body to the hand: one that reaches down over a table it cuts at one place.
    pub is_level: bool,
}

/// How much a resampled cloud is roughened.
#[derive(Clone, Copy, Debug)]
pub struct Roughness {
    pub place_m: f64,
    pub velocity_mps: f64,
    pub heading_rad: f64,
}

/// After the first look. Its velocity is as rough as the process noise makes it from scan to scan: 0.7 √0.025 s.
pub const COARSE: Roughness = Roughness { place_m: 0.03, velocity_mps: 0.1, heading_rad: 0.2 };
/// After the second.
pub const FINE: Roughness = Roughness { place_m: 0.008, velocity_mps: 0.02, heading_rad: 0.03 };
/// Of a body that is not seen, which has nothing to walk to.
pub const HIDDEN: Roughness = Roughness { place_m: 0.03, velocity_mps: 0.05, heading_rad: 0.1 };
/// When a scan contradicts the whole cloud.
pub const SURPRISED: Roughness = Roughness { place_m: 0.12, velocity_mps: 0.3, heading_rad: 0.2 };

/// How a body moves.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// It mostly stands.
    pub stands: bool,
    /// Its depth changes.
    pub deepens: bool,
}

/// A step of time, and what is the same for all samples of a cloud.
pub struct Step {
    step_s: f64,
    root: f64,
    slower: f64,
    /// Share of the way back to the ordinary size.
    returns: f64,
    stays_out: f64,
    deepens: bool,
}

impl Step {
    pub fn new(step_s: f64, Manner { stands, deepens }: Manner) -> Self {
        let keeps_s = if stands { KEEPS_UNSEEN_S } else { KEEPS_S };
        Self {
            step_s,
            root: step_s.sqrt(),
            slower: libm::exp(-step_s / keeps_s),
            returns: step_s / ORDINARY_S,
            stays_out: libm::exp(-step_s / STRETCHED_S),
            deepens,
        }
    }
}

/// Independent normal deviates by which a sample changes. Neighbours come of one sample more often than not: of two, one takes them
/// mirrored, and the mean of both moves nowhere.
#[derive(Clone, Copy, Debug)]
pub struct Shocks([f64; 8]);

impl Shocks {
    pub fn draw(random: &mut Random) -> Self {
        let [(a, b), (c, d), (e, f), (g, h)] = [random.pair(), random.pair(), random.pair(), random.pair()];
        Self([a, b, c, d, e, f, g, h])
    }

    /// Of the opposite sign.
    pub fn mirrored(self) -> Self {
        Self(self.0.map(|shock| -shock))
    }
}

impl Sample {
    /// Of an ordinary body whose arms hang down; `heading` is a unit vector.
    pub const fn new(at: Point, velocity: Point, heading: Point) -> Self {
        Self { at, velocity, heading, size: 1.0, depth: 1.0, arm: None }
    }

    /// Moves it by a step, as far as the ground allows. `anew_mps`: with another velocity, whatever it was, of
    /// this deviation on each axis.
    pub fn predict(&mut self, step: &Step, anew_mps: Option<f64>, way: &Way<'_>, shocks: Shocks) {
        let Shocks([a, b, c, d, turn, growth, deeper, _]) = shocks;
        let &Step { step_s, root, slower, .. } = step;
        let (kept, noise) = anew_mps.map_or((slower, PROCESS_NOISE * root), |deviation| (0.0, deviation));
        self.velocity = (self.velocity * kept + Point::new(a, b) * noise).at_most(FASTEST_MPS);
        let next = self.at + self.velocity * step_s + Point::new(c, d) * (DRIFT * root);
        if way.stops(self.at, next) {
            self.velocity = Point::default();
        } else {
            self.at = next;
        }
        let square = self.velocity.dot(self.velocity);
        let forwards = self.heading.cross(self.velocity) * self.heading.dot(self.velocity);
        let follows = (step_s / (TURN_WAY_M * square.sqrt())).min(1.0 / square);
        let towards = if square > 0.0 { forwards * follows } else { 0.0 };
        self.heading = turned(self.heading, towards + TURNS * root * turn);
        let size = self.size + (1.0 - self.size) * step.returns + GROWS * root * growth;
        self.size = size.clamp(*SIZES.start(), *SIZES.end());
        if step.deepens {
            let depth = self.depth + (1.0 - self.depth) * step.returns + DEEPENS * root * deeper;
            self.depth = depth.clamp(*DEPTHS.start(), *DEPTHS.end());
        }
    }

    /// Moves the hand of an arm that it stretches out, or draws it back.
    pub fn gesture(&mut self, step: &Step, random: &mut Random) {
        if let Some(arm) = self.arm {
            let (x, y) = random.pair();
            let hand = arm.hand + Point::new(x, y) * (HAND_DRIFT * step.root);
            self.arm = (random.uniform() < step.stays_out).then_some(Arm { hand, ..arm });
        }
    }

    /// Stretches out an arm to what is seen of a hand. Returns whether it reaches so far.
    pub fn reach(&mut self, place: Point, random: &mut Random) -> bool {
        let off = place - self.at;
        let distance_m = off.length();
        if !REACH.contains(&distance_m) {
            return false;
        }
        let (beyond, _) = random.pair();
        let hand = off * (1.0 + (FINGERS_M.0 + FINGERS_M.1 * beyond) / distance_m);
        let hand = Point::new(hand.dot(self.heading), hand.dot(self.heading.left()));
        self.arm = Some(Arm { hand, is_level: random.uniform() < LEVEL });
        true
    }

    /// It, roughened on its side of walls.
    pub fn roughened(&self, roughness: Roughness, way: &Way<'_>, shocks: Shocks) -> Self {
        let Shocks([a, b, c, d, turn, ..]) = shocks;
        let mut sample = *self;
        let next = sample.at + Point::new(a, b) * roughness.place_m;
        if !way.stops(sample.at, next) {
            sample.at = next;
        }
        sample.velocity = sample.velocity + Point::new(c, d) * roughness.velocity_mps;
        sample.heading = turned(sample.heading, turn * roughness.heading_rad);
        sample
    }

    /// Torso and hanging arms.
    pub fn torso(&self) -> Outline {
        let (across_m, along_m) = (ACROSS_M * self.size, ALONG_M * self.size * self.depth);
        Outline { middle: self.at, along: self.heading, across_m, along_m }
    }

    /// What the plane cuts of the arm that is stretched out: from the middle of the body to the hand, or a forearm's section there.
    pub fn outline_of_arm(&self) -> Option<Outline> {
        let Arm { hand, is_level } = self.arm?;
        let hand = self.heading * hand.x + self.heading.left() * hand.y;
        let length_m = hand.length();
        let along = hand * (1.0 / length_m.max(1e-6));
        let half_m = if is_level { (0.5 * length_m).max(ARM_M) } else { FOREARM_M };
        Some(Outline { middle: self.at + hand - along * half_m, along, across_m: ARM_M, along_m: half_m })
    }
}

/// Variance on each axis of how far a body whose velocity is not taken anew strays within a time from where its velocity takes it, m²: of
/// white noise of the velocity.
pub const fn strayed_m2(time_s: f64) -> f64 {
    PROCESS_NOISE * PROCESS_NOISE * time_s * time_s * time_s / 3.0
}

/// A unit vector turned by a small angle.
fn turned(heading: Point, angle_rad: f64) -> Point {
    // By the tangent of half the angle: no root, and still a unit vector.
    let half = 0.5 * angle_rad.clamp(-1.0, 1.0);
    let per = 1.0 / (1.0 + half * half);
    heading * ((1.0 - half * half) * per) + heading.left() * (2.0 * half * per)
}

#[cfg(test)]
mod tests {
    use super::super::ground::{Passage, Terrain};
    use super::super::model::RenderingModel;
    use super::super::scan::Scan;
    use super::*;

    fn sample() -> Sample {
        Sample::new(Point::new(1.0, 0.0), Point::default(), Point::new(0.0, 1.0))
    }

    #[test]
    fn a_hand_is_stretched_out_to_where_something_is_and_turns_with_the_body() {
        let mut sample = sample();
        assert!(sample.outline_of_arm().is_none());
        assert!(sample.reach(Point::new(1.5, 0.0), &mut Random::new(1)));
        let arm = sample.outline_of_arm().unwrap();
        let hand = |arm: Outline| arm.middle + arm.along * arm.along_m;
        assert!((hand(arm) - Point::new(1.53, 0.0)).length() < 0.1, "{arm:?}");
        sample.heading = Point::new(-1.0, 0.0);
        assert!((hand(sample.outline_of_arm().unwrap()) - Point::new(1.0, 0.53)).length() < 0.1);
    }

    #[test]
    fn of_an_arm_that_reaches_down_only_a_section_is_seen_at_the_hand() {
        let hand = Point::new(0.0, -0.6);
        let length_m = |is_level| {
            let arm = Sample { arm: Some(Arm { hand, is_level }), ..sample() }.outline_of_arm().unwrap();
            assert!((arm.middle + arm.along * arm.along_m - Point::new(1.6, 0.0)).length() < 1e-9, "{arm:?}");
            2.0 * arm.along_m
        };
        assert!((length_m(true) - 0.6).abs() < 1e-9 && length_m(false) < 0.15);
    }

    #[test]
    fn no_body_reaches_farther_than_an_arm_nor_into_its_own_torso() {
        let mut sample = sample();
        for x in [1.1, 1.8, 9.0] {
            assert!(!sample.reach(Point::new(x, 0.0), &mut Random::new(1)), "{x}");
            assert!(sample.outline_of_arm().is_none());
        }
    }

    #[test]
    fn of_two_samples_with_mirrored_shocks_the_mean_moves_nowhere() {
        let terrain = Terrain::of(&toml::from_str("").unwrap());
        let scan = Scan::at_origin();
        let way = Way {
            ground: terrain.ground(RenderingModel::default(), &scan),
            passage: Passage::Through,
            is_open: false,
        };
        let (shocks, step) =
            (Shocks::draw(&mut Random::new(3)), Step::new(0.1, Manner { stands: false, deepens: true }));
        let [one, other] = [shocks, shocks.mirrored()].map(|shocks| {
            let mut moved = sample();
            moved.predict(&step, None, &way, shocks);
            moved.roughened(COARSE, &way, shocks)
        });
        let mean = |of: fn(&Sample) -> Point| (of(&one) + of(&other)) * 0.5;
        assert!((mean(|sample| sample.at) - sample().at).length() < 1e-12, "{one:?} {other:?}");
        assert!(mean(|sample| sample.velocity).length() < 1e-12);
        assert!((one.at - other.at).length() > 0.001 && (one.size - 1.0) * (other.size - 1.0) < 0.0);
    }

    #[test]
    fn a_torso_is_as_large_and_as_deep_as_its_sample() {
        let torso = sample().torso();
        assert_eq!(torso.along, Point::new(0.0, 1.0));
        assert_eq!((torso.across_m, torso.along_m), (ACROSS_M, ALONG_M));
        let deep = Sample { size: 1.1, depth: 1.5, ..sample() }.torso();
        assert!(
            (deep.across_m / ACROSS_M - 1.1).abs() < 1e-12 && (deep.along_m / ALONG_M - 1.65).abs() < 1e-12
        );
    }
}
