//! Where a body sets its next foot: a density over the floor, per reading.
//!
//! ```text
//!            · aside ·
//!    round  ◗ ✕ ▶ ◖ ahead       ✕ body, ◗ the foot it stands on; the next one lands ahead for most steps, on the other
//!            ·       ·           side for a turn, anywhere about the body else
//! ```

use nalgebra::{Matrix2, Vector2};

use super::print::Print;
use crate::geometry::Point;
use crate::tracker::kalman::Kinematics;

/// A step, one sigma of it, and the longest, m: of grown people who walk as in a room.
const LENGTH_M: f64 = 0.55;
const LENGTH_SIGMA_M: f64 = 0.15;
pub(super) const LONGEST_M: f64 = 0.78;

/// A body that a foot puts farther than this from where it is believed to be has not set it, m: a step turned round.
const GATE_M: f64 = 0.8;

/// Faster than this a body walks, and its feet land on the line on which it does, m/s.
pub(super) const WALKS_MPS: f64 = 0.3;

/// A foot lands so far ahead of a walker, m: 60 % of a step; from there, one sigma, along the way and aside of it; and
/// along it for one that turns round, from the body.
const LEAD_M: f64 = 0.33;
const AHEAD_M: f64 = 0.2;
const ASIDE_M: f64 = 0.15;
const ROUND_M: f64 = 0.45;

/// Of a walker's steps so many turn it round, and so many to a side: rooms are a few steps long.
const TURNS_ROUND: f64 = 0.1;
const TURNS_ASIDE: f64 = 0.1;

/// Parts of the readings in which a body on one foot sets the other, and in which one on both feet does: a step takes
/// seven readings of a ninth of a second, and one foot lifts first.
const STEPS: f64 = 0.15;
const STEPS_FROM_BOTH: f64 = 0.005;

/// A foot points the way it has stepped, but for steps shorter than this, m; how surely, as the concentration of von Mises'
/// distribution of twice the angle: 25° one sigma.
const SHORT_M: f64 = 0.25;
const POINTS: f64 = 1.5;

/// What a body stands on and how it has walked.
pub(super) struct Stance<'a> {
    /// Where it is, and how well that is known.
    pub motion: &'a Kinematics,
    /// The foot on the floor.
    pub foot: Point,
    /// Both feet are.
    pub on_both: bool,
    /// Where it comes to be if it sets a foot there now.
    pub lands: Point,
    /// Along which line it has walked last, of length 1.
    pub way: Option<Point>,
}

impl Stance<'_> {
    /// Density that the next foot is set at `foot` in the reading of `at_s`, 1/m²; none where it cannot step.
    pub(super) fn density(&self, print: &Print, at_s: f64) -> Option<f64> {
        let foot = print.at;
        let length_m = (foot - self.foot).length();
        let off_m = (self.lands - self.motion.place(at_s)).length();
        // Both feet may stand at the far sides of their panels.
        let slack_m = 2.0 * print.coarse_m;
        if length_m > LONGEST_M + slack_m || off_m > GATE_M + slack_m {
            return None;
        }
        let near = |from: Point, slack: &Matrix2<f64>| {
            let (square, log_determinant) =
                self.motion.distance(at_s, Vector2::new(foot.x - from.x, foot.y - from.y), slack);
            libm::exp(-0.5 * (square + log_determinant)) / std::f64::consts::TAU
        };
        let sigmas = (length_m - LENGTH_M) / LENGTH_SIGMA_M;
        let nowhere = Point::default();
        let velocity = self.motion.velocity();
        let ahead = (velocity.length() > WALKS_MPS).then(|| velocity * (1.0 / velocity.length()));
        let about = near(nowhere, &(Matrix2::identity() * (LEAD_M * LEAD_M)));
        let there = match (ahead, self.way) {
            (Some(ahead), way) => {
                let goes_on =
                    near(ahead * LEAD_M, &along(ahead, AHEAD_M)) * libm::exp(-0.5 * sigmas * sigmas);
                let round = near(nowhere, &along(way.unwrap_or(ahead), ROUND_M));
                goes_on * (1.0 - TURNS_ROUND - TURNS_ASIDE) + round * TURNS_ROUND + about * TURNS_ASIDE
            }
            (None, Some(way)) => 0.5 * (near(nowhere, &along(way, ROUND_M)) + about),
            (None, None) => about,
        };
        let steps = if self.on_both { STEPS_FROM_BOTH } else { STEPS };
        let step = foot - self.foot;
        let doubled = Point::new(step.x * step.x - step.y * step.y, 2.0 * step.x * step.y);
        let points = if length_m > SHORT_M { doubled.dot(print.axis) / (length_m * length_m) } else { 0.0 };
        Some(there * steps * libm::exp(POINTS * points))
    }
}

/// So far along a way, and [`ASIDE_M`] aside.
fn along(way: Point, along_m: f64) -> Matrix2<f64> {
    let outer = |way: Point| Matrix2::new(way.x * way.x, way.x * way.y, way.x * way.y, way.y * way.y);
    outer(way) * (along_m * along_m) + outer(way.left()) * (ASIDE_M * ASIDE_M)
}
