//! The three experiments of paper B: two people on a floor of 24 × 24 panels, for a minute, before one camera.
//!
//! ```text
//!   parallel   ↑ ↑        crossing   ─▶ ◀─       square   ┌─▶┐
//!              │ │                   ◀─ ─▶                └◀─┘
//!               ◁ camera              ◁ camera             ◁ camera
//! ```

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use kehai_tracking::floor::Plan;
use kehai_tracking::geometry::{Point, Pose};

use super::gait::{Habit, Walker, Way};
use crate::world::random::{Purpose, Stream};

/// How long each lasts, s.
pub const DURATION_S: f64 = 60.0;

/// Side of the floor, m: 24 panels of 8 cm.
const SIDE_M: f64 = 1.92;

/// An experiment.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, serde::Serialize, serde::Deserialize)]
pub enum Experiment {
    /// Two walk side by side, to the camera and back: no tag is ever hidden.
    Parallel,
    /// Two walk across the camera's view in opposite senses, one behind the other: the tag behind is hidden where they pass.
    Crossing,
    /// Two walk round a square, always opposite each other, 0.8 m apart.
    Square,
}

impl Experiment {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Parallel, Self::Crossing, Self::Square];

    /// The direction in which the truth is a straight line: across the way.
    #[must_use]
    pub const fn across(self) -> Option<Point> {
        match self {
            Self::Parallel => Some(Point::new(1.0, 0.0)),
            Self::Crossing => Some(Point::new(0.0, 1.0)),
            Self::Square => None,
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Parallel => "B1 parallel",
            Self::Crossing => "B2 crossing",
            Self::Square => "B3 square",
        })
    }
}

/// People, floor and camera of an experiment.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The two walkers.
    pub walkers: [Walker; 2],
    /// The floor.
    pub plan: Plan,
    /// The camera, in the plan.
    pub camera: Point,
}

impl Scene {
    /// An experiment with the speeds of this seed.
    #[must_use]
    pub fn new(experiment: Experiment, seed: u64) -> Self {
        let mut random = Stream::new(seed, Purpose::Walk, [0xb, experiment as u64]);
        let speed_mps = random.between(0.6, 0.9);
        let begun_m = random.between(0.0, 2.0);
        // No person walks along the edges of panels.
        let aside_m = random.between(-0.5, 0.5) * SIDE_M / 24.0;
        let mut walker = |way: Way, begun_m: f64| {
            let habit = Habit::random(&mut random);
            Walker { way, begun_m, speed_mps, habit }
        };
        let line = |from: (f64, f64), to: (f64, f64)| {
            Way::ToAndFro(Point::new(from.0, from.1), Point::new(to.0, to.1))
        };
        let walkers = match experiment {
            Experiment::Parallel => {
                [-0.4, 0.4].map(|x| x + aside_m).map(|x| walker(line((x, -0.75), (x, 0.75)), begun_m))
            }
            Experiment::Crossing => [
                walker(line((-0.75, aside_m - 0.35), (0.75, aside_m - 0.35)), begun_m),
                walker(line((0.75, aside_m + 0.35), (-0.75, aside_m + 0.35)), begun_m),
            ],
            Experiment::Square => {
                // Opposite each other on a square of this side they are 0.8 m apart in the mean: from 0.7 to 1.0 m.
                const HALF_M: f64 = 0.35;
                let corners = [(-HALF_M, -HALF_M), (HALF_M, -HALF_M), (HALF_M, HALF_M), (-HALF_M, HALF_M)];
                let square = || Way::Round(corners.map(|(x, y)| Point::new(x, y)).to_vec());
                [walker(square(), begun_m), walker(square(), begun_m + 4.0 * HALF_M)]
            }
        };
        let corner = Pose { at: Point::new(0.5 * SIDE_M, -0.5 * SIDE_M), yaw_rad: FRAC_PI_2 };
        let plan = Plan { corner, columns: 24, rows: 24, pitch_m: SIDE_M / 24.0 };
        Self { walkers, plan, camera: Point::new(0.0, -3.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_stay_on_the_floor_and_opposite_each_other_as_the_paper_says() {
        for experiment in Experiment::ALL {
            let scene = Scene::new(experiment, 3);
            let mut apart = Vec::new();
            for tenth in 0..600 {
                let [one, other] = scene.walkers.clone().map(|walker| walker.at(f64::from(tenth) * 0.1).0);
                for at in [one, other] {
                    assert!(at.x.abs() < 0.8 && at.y.abs() < 0.8, "{experiment}: {at:?}");
                }
                apart.push((one - other).length());
            }
            let least = apart.iter().copied().fold(f64::INFINITY, f64::min);
            let mean = apart.iter().sum::<f64>() / apart.len() as f64;
            match experiment {
                Experiment::Parallel => assert!((least - 0.8).abs() < 1e-9),
                Experiment::Crossing => assert!((0.69..0.73).contains(&least), "{least}"),
                Experiment::Square => assert!((0.75..0.85).contains(&mean) && least > 0.69, "{least} {mean}"),
            }
        }
    }
}
