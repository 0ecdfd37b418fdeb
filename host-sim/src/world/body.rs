//! The section of a person in the sensor's plane.
//!
//! ```text
//!    torso, seen from above          thighs
//!            heading                     heading
//!               ▲                           ▲
//!        ·  ____│____                     ___    ← one leg forward,
//!   arm ( )(         )( )  ← arm         (   )      the other back
//!        ' (_________)                        ___
//!          half_width                        (   )
//! ```
//!
//! Sizes: torso half axes 0.20–0.25 × 0.12–0.16 m, arms of radius 0.045 m, thighs of radius
//! 0.075–0.095 m (a study of what two sensors can see). Arms hang beside the torso and
//! swing against the legs; legs and arms swing with the distance walked, not with time.

use super::geometry::{Outline, Point};
use super::random::Stream;
use super::shape::{self, Family, Gesture, Shape};
use heapless::Vec;
use std::f64::consts::PI;

/// Radius of an arm.
pub const ARM_RADIUS_M: f64 = 0.045;
/// An arm hangs this far inside the end of the torso's ellipse, so that the body grows by 35 mm a side.
const ARM_INSET_M: f64 = 0.01;
/// How far an arm swings forward and back at a brisk walk (1.2 m/s).
const ARM_SWING_M: f64 = 0.13;
/// How far a thigh swings forward and back at a brisk walk, 0.6 m above the floor.
const THIGH_SWING_M: f64 = 0.14;
/// Space between the thighs of a standing person.
const THIGH_GAP_M: f64 = 0.03;
/// Shoulders of an adult above the floor.
pub const SHOULDERS_M: f64 = 1.4;
/// Half the depth of a crouching person, knees to back, and the height of the shoulders above the floor.
const CROUCHING_DEPTH_M: f64 = 0.28;
const CROUCHING_TOP_M: f64 = 0.85;
/// Most outlines of one body: two thighs and two hands.
pub const MAX_OUTLINES: usize = 4;

/// Which part of a person is in the plane.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// A torso and two arms.
    #[default]
    Torso,
    /// A torso without arms: a coat, a uniform, folded arms.
    TorsoOnly,
    /// Two thighs.
    Thighs,
    /// What is at the height of the plane: feet, shanks, thighs and hands, or torso and arms.
    ByHeight,
}

impl std::str::FromStr for Section {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "torso" => Ok(Self::Torso),
            "torso-only" => Ok(Self::TorsoOnly),
            "thighs" => Ok(Self::Thighs),
            "by-height" => Ok(Self::ByHeight),
            _ => Err(String::from("torso, torso-only, thighs or by-height")),
        }
    }
}

/// Size, shape and clothes of a person.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    /// What the plane cuts.
    pub section: Section,
    /// Half the torso's width, shoulder to shoulder.
    pub half_width_m: f64,
    /// Half the torso's depth, chest to back.
    pub half_depth_m: f64,
    /// Radius of a thigh.
    pub thigh_radius_m: f64,
    /// Reflectance of the clothes: the share of the light that comes back, 0.03 (black) to 0.9 (white).
    pub reflectance: f64,
    /// What the clothes add to every range (soft cloth reads long, glossy cloth short).
    pub clothing_bias_mm: f64,
    /// Height of the shoulders: a plane above them does not cut the body.
    pub top_m: f64,
    /// What the plane cuts of a torso.
    pub shape: Shape,
}

impl Body {
    /// A person of random size, in clothes as bright in infrared as most are, black cotton included.
    #[must_use]
    pub fn random(section: Section, stream: &mut Stream) -> Self {
        Self {
            section,
            half_width_m: stream.between(0.20, 0.25),
            half_depth_m: stream.between(0.12, 0.16),
            thigh_radius_m: stream.between(0.075, 0.095),
            reflectance: stream.between(0.55, 0.85),
            clothing_bias_mm: stream.between(-10.0, 10.0),
            top_m: SHOULDERS_M,
            shape: Shape::Plain,
        }
    }

    /// The same person of another family of shapes; `stream` is one of its own.
    #[must_use]
    pub fn of(self, family: Family, stream: &mut Stream) -> Self {
        let Some((half_width_m, half_depth_m, shape)) = shape::draw(family, stream) else { return self };
        Self { half_width_m, half_depth_m, shape, ..self }
    }

    /// The same person in black: 3 to 10 % of the light comes back.
    #[must_use]
    pub fn in_black(self, stream: &mut Stream) -> Self {
        Self { reflectance: stream.between(0.03, 0.10), ..self }
    }

    /// The same person at a gesture, if the shape has arms.
    #[must_use]
    pub fn at(self, gesture: Gesture) -> Self {
        match self.shape {
            Shape::Arms { radius_m, .. } => Self { shape: Shape::Arms { radius_m, gesture }, ..self },
            Shape::Plain | Shape::Coat { .. } => self,
        }
    }

    /// The same person crouching: as deep as wide, and low.
    #[must_use]
    pub fn crouching(self) -> Self {
        Self { section: Section::TorsoOnly, half_depth_m: CROUCHING_DEPTH_M, top_m: CROUCHING_TOP_M, ..self }
    }

    /// Radius of a circle around [`Stance::at`] that holds every outline.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        let plain_m = self.half_width_m.max(self.half_depth_m).max(2.0 * self.thigh_radius_m + THIGH_GAP_M)
            + ARM_RADIUS_M
            + ARM_SWING_M;
        match self.shape {
            Shape::Plain => plain_m,
            Shape::Arms { .. } => plain_m.max(self.half_depth_m + shape::ARMS_REACH_M + self.half_width_m),
            Shape::Coat { .. } => plain_m.max(self.half_width_m.hypot(self.half_depth_m)),
        }
    }

    /// The outlines of the body in a stance, whatever the height of the plane; by height it is [`super::upright::cut`].
    #[must_use]
    pub fn outlines(&self, stance: &Stance) -> Vec<Outline, MAX_OUTLINES> {
        let ahead = Point::towards(stance.heading_rad);
        let swing = libm::sin(stance.stride_rad) * stance.stride;
        let mut outlines = Vec::new();
        if self.section == Section::Thighs {
            let beside = ahead.left() * (self.thigh_radius_m + THIGH_GAP_M / 2.0);
            let forward = ahead * (swing * THIGH_SWING_M);
            outlines.extend([
                Outline::disc(stance.at + beside + forward, self.thigh_radius_m),
                Outline::disc(stance.at - beside - forward, self.thigh_radius_m),
            ]);
            return outlines;
        }
        let half_axes_m = (self.half_depth_m, self.half_width_m);
        let torso = match self.shape {
            Shape::Coat { exponent } => {
                Outline::Superellipse { centre: stance.at, axis: ahead, half_axes_m, exponent }
            }
            Shape::Plain | Shape::Arms { .. } => {
                Outline::Ellipse { centre: stance.at, axis: ahead, half_axes_m }
            }
        };
        outlines.extend([torso]);
        if self.section != Section::Torso {
            return outlines;
        }
        if let Shape::Arms { radius_m, gesture } = self.shape {
            let sizes = (self.half_width_m, self.half_depth_m);
            outlines.extend(shape::arms(gesture, radius_m, sizes, (stance.at, ahead, swing)));
        }
        if self.shape == Shape::Plain {
            let beside = ahead.left() * (self.half_width_m - ARM_INSET_M);
            let forward = ahead * (swing * ARM_SWING_M);
            outlines.extend([
                Outline::disc(stance.at + beside - forward, ARM_RADIUS_M),
                Outline::disc(stance.at - beside + forward, ARM_RADIUS_M),
            ]);
        }
        outlines
    }
}

/// Position, heading and phase of the stride at one moment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stance {
    /// Middle of the torso: the position that truth reports.
    pub at: Point,
    /// Where the chest points, counter-clockwise from the site's x axis.
    pub heading_rad: f64,
    /// Phase of the stride, π per step.
    pub stride_rad: f64,
    /// Size of the stride: 0 standing, 1 a brisk walk (1.2 m/s) and more.
    pub stride: f64,
}

impl Stance {
    /// Length of a step at an ordinary walk.
    const STEP_M: f64 = 0.65;

    /// The stance of a person after `distance_m` of walking, at a present speed of `speed_m_s`.
    #[must_use]
    pub fn walking(at: Point, heading_rad: f64, distance_m: f64, speed_m_s: f64) -> Self {
        let stride = (speed_m_s / 1.2).clamp(0.0, 1.3);
        Self { at, heading_rad, stride_rad: distance_m / Self::STEP_M * PI, stride }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::geometry::Beam;
    use crate::world::random::Purpose;

    fn body(section: Section) -> Body {
        Body::random(section, &mut Stream::new(1, Purpose::Person, [0, 0]))
    }

    fn width_m(body: &Body, stance: &Stance, look_deg: f64) -> f64 {
        // Seen from far away, so that beams are parallel.
        let direction = Point::towards(look_deg.to_radians());
        let hits = (-1000..=1000).filter(|step| {
            let origin = stance.at - direction * 5.0 + direction.left() * (f64::from(*step) * 0.001);
            body.outlines(stance).iter().any(|outline| outline.meet(&Beam { origin, direction }).is_some())
        });
        hits.count() as f64 * 0.001
    }

    #[test]
    fn a_torso_is_wide_from_the_front_and_narrow_from_the_side() {
        let body = body(Section::Torso);
        let stance = Stance::walking(Point::new(1.0, 2.0), 0.0, 0.0, 0.0);
        let front = width_m(&body, &stance, 180.0);
        let side = width_m(&body, &stance, 90.0);
        assert!((front - 2.0 * (body.half_width_m + 0.035)).abs() < 0.003, "front {front}");
        assert!((side - 2.0 * body.half_depth_m).abs() < 0.003, "side {side}");
    }

    #[test]
    fn arms_and_legs_swing_in_turn_and_never_leave_the_body() {
        for section in [Section::Torso, Section::TorsoOnly, Section::Thighs] {
            let body = body(section);
            for distance in 0..30 {
                let stance = Stance::walking(Point::new(1.0, 2.0), 0.7, f64::from(distance) * 0.1, 2.0);
                for outline in body.outlines(&stance) {
                    let (centre, radius_m) = outline.bounds();
                    assert!((centre - stance.at).length() + radius_m <= body.reach_m());
                }
            }
        }
        let stride = |distance_m| {
            let stance = Stance::walking(Point::default(), 0.0, distance_m, 1.2);
            body(Section::Thighs).outlines(&stance).first().unwrap().bounds().0.x
        };
        assert!((stride(0.325) - THIGH_SWING_M).abs() < 1e-9);
        assert!((stride(0.975) + THIGH_SWING_M).abs() < 1e-9);
    }
}
