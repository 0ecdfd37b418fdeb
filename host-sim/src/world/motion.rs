//! The trajectory of a person: a route that is a formula, or samples that were computed beforehand.
//!
//! ```text
//!   samples     ●────●────●────●        every step_s; positions joined by straight lines,
//!   time      first  │    │    │        headings by the shorter turn
//!                    stance(t)
//! ```
//!
//! Both are pure functions of the time, so truth can be asked for at any moment and in any order. A person
//! steered from outside has such a trajectory too, up to its last sample: samples are only appended, ahead of time.

use super::body::Stance;
use super::geometry::{Point, wrapped};
use super::walker::Route;
use std::sync::Arc;

use parking_lot::Mutex;

/// How a person moves.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Scripted way points.
    Route(Route),
    /// Positions computed beforehand: a crowd or a recording.
    Track(Track),
    /// Positions computed while the simulation runs, some time ahead: people waiting for a real door.
    Live(Arc<Mutex<Track>>),
}

impl Motion {
    /// The stance at `time_s`; nothing while the person is not in the world.
    #[must_use]
    pub fn stance(&self, time_s: f64) -> Option<Stance> {
        match self {
            Self::Route(route) => route.stance(time_s),
            Self::Track(track) => track.stance(time_s),
            Self::Live(track) => track.lock().stance(time_s),
        }
    }
}

/// A stance and how far the person has walked.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: Point,
    heading_rad: f64,
    distance_m: f64,
    speed_m_s: f64,
}

/// Positions at equal intervals, and what follows from them.
#[derive(Clone, Debug)]
pub struct Track {
    first_s: f64,
    step_s: f64,
    samples: Vec<Sample>,
}

/// Below this speed a person keeps the heading: standing people shift without turning round.
const TURNING_SPEED_M_S: f64 = 0.25;
/// Time in which a walker's chest follows a change of direction.
const TURNING_TIME_S: f64 = 0.25;
/// Time in which a person turns to the preferred heading after stopping.
const RESTING_TIME_S: f64 = 1.0;

impl Track {
    /// A person at `positions[k]` at `first_s` + k · `step_s`, and in the world only during that time.
    ///
    /// The chest follows the direction of walking and stays as it is while the person stands;
    /// `heading_rad` holds before the first step.
    #[must_use]
    pub fn new(first_s: f64, step_s: f64, positions: &[Point], heading_rad: f64) -> Self {
        Self::build(first_s, step_s, positions, heading_rad, None)
    }

    /// As [`new`](Self::new), but the person turns to `rest_rad` of the time, s, when standing.
    #[must_use]
    pub fn resting(
        first_s: f64,
        step_s: f64,
        positions: &[Point],
        heading_rad: f64,
        rest_rad: &dyn Fn(f64) -> f64,
    ) -> Self {
        Self::build(first_s, step_s, positions, heading_rad, Some(rest_rad))
    }

    fn build(
        first_s: f64,
        step_s: f64,
        positions: &[Point],
        heading_rad: f64,
        rest_rad: Option<&dyn Fn(f64) -> f64>,
    ) -> Self {
        let mut samples = Vec::with_capacity(positions.len());
        let mut heading_rad = heading_rad;
        let mut distance_m = 0.0;
        // Velocity over 0.2 s: faster motion is sway, not walking.
        let reach = ((0.1 / step_s).ceil() as usize).max(1);
        for (index, at) in positions.iter().enumerate() {
            let before = index.saturating_sub(reach);
            let after = (index + reach).min(positions.len() - 1);
            let moved = positions[after] - positions[before];
            let speed_m_s = moved.length() / (step_s * (after - before).max(1) as f64);
            if speed_m_s > TURNING_SPEED_M_S {
                let turn = wrapped(moved.angle_rad() - heading_rad);
                let first_walking = index == 0;
                heading_rad += if first_walking { turn } else { turn * (step_s / TURNING_TIME_S).min(1.0) };
            } else if let Some(rest_rad) = rest_rad {
                let rest_rad = rest_rad(first_s + step_s * index as f64);
                heading_rad += wrapped(rest_rad - heading_rad) * (step_s / RESTING_TIME_S).min(1.0);
            }
            if index > 0 {
                distance_m += speed_m_s * step_s;
            }
            samples.push(Sample { at: *at, heading_rad, distance_m, speed_m_s });
        }
        Self { first_s, step_s, samples }
    }

    /// An empty trajectory; [`push`](Self::push) appends positions.
    #[must_use]
    pub const fn growing(first_s: f64, step_s: f64) -> Self {
        Self { first_s, step_s, samples: Vec::new() }
    }

    /// Whether it has no position yet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Where the person is one step later. The chest follows the direction of the last 0.2 s.
    pub fn push(&mut self, at: Point, heading_rad: f64) {
        let reach = ((0.2 / self.step_s).ceil() as usize).max(1);
        let before = self.samples.len().checked_sub(reach).and_then(|index| self.samples.get(index));
        let moved = at - before.or(self.samples.first()).map_or(at, |before| before.at);
        let steps = reach.min(self.samples.len()).max(1);
        let speed_m_s = moved.length() / (self.step_s * steps as f64);
        let last = self.samples.last();
        let mut heading_rad = last.map_or(heading_rad, |last| last.heading_rad);
        if speed_m_s > TURNING_SPEED_M_S {
            heading_rad += wrapped(moved.angle_rad() - heading_rad) * (self.step_s / TURNING_TIME_S).min(1.0);
        }
        let distance_m = last.map_or(0.0, |last| last.distance_m + speed_m_s * self.step_s);
        self.samples.push(Sample { at, heading_rad, distance_m, speed_m_s });
    }

    /// Time of the last sample.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.first_s + self.step_s * self.samples.len().saturating_sub(1) as f64
    }

    /// The stance at `time_s`, if the track covers it.
    #[must_use]
    pub fn stance(&self, time_s: f64) -> Option<Stance> {
        let place = (time_s - self.first_s) / self.step_s;
        if place < 0.0 {
            return None;
        }
        let index = place as usize;
        let from = self.samples.get(index)?;
        let to = self.samples.get(index + 1).or((place == index as f64).then_some(from))?;
        let share = place - index as f64;
        let blend = |from: f64, to: f64| from + (to - from) * share;
        Some(Stance::walking(
            from.at + (to.at - from.at) * share,
            from.heading_rad + wrapped(to.heading_rad - from.heading_rad) * share,
            blend(from.distance_m, to.distance_m),
            blend(from.speed_m_s, to.speed_m_s),
        ))
    }
}

/// Time between two positions of a steered person.
pub const LED_STEP_S: f64 = 0.05;

/// A person steered from outside, step by step. Clones are the same person.
#[derive(Clone, Debug)]
pub struct Led(Arc<Mutex<Track>>);

impl Led {
    /// A person that appears at `at` at the time `from_s`.
    #[must_use]
    pub fn new(from_s: f64, at: Point) -> Self {
        let led = Self(Arc::new(Mutex::new(Track::growing(from_s, LED_STEP_S))));
        led.go(&[at; 2]);
        led
    }

    /// Goes on along these places, one every [`LED_STEP_S`].
    pub fn go(&self, places: &[Point]) {
        let mut track = self.0.lock();
        places.iter().for_each(|at| track.push(*at, 0.0));
    }

    /// The last position, and its time.
    #[must_use]
    pub fn end(&self) -> (Point, f64) {
        let track = self.0.lock();
        (track.samples.last().map(|last| last.at).unwrap_or_default(), track.end_s())
    }

    /// How they move.
    #[must_use]
    pub fn motion(&self) -> Motion {
        Motion::Live(Arc::clone(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_is_joined_by_straight_lines_and_ends_where_it_ends() {
        let positions: Vec<Point> = (0..50).map(|index| Point::new(0.1 * f64::from(index), 0.0)).collect();
        let track = Track::new(2.0, 0.1, &positions, 1.0);
        assert_eq!(track.stance(1.99), None);
        assert_eq!(track.stance(7.0), None);
        assert!(track.stance(track.end_s()).is_some());
        let stance = track.stance(3.25).unwrap();
        assert!((stance.at - Point::new(1.25, 0.0)).length() < 1e-9);
        assert!(stance.heading_rad.abs() < 1e-9, "the chest points along the way");
        assert!((stance.stride - 1.0 / 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_person_who_sways_on_the_spot_does_not_turn() {
        let positions: Vec<Point> = (0..80)
            .map(|index| Point::new(0.005 * f64::from(index % 2), 0.003 * f64::from(index % 3)))
            .collect();
        let track = Track::new(0.0, 0.05, &positions, 1.0);
        assert_eq!(track.stance(3.0).unwrap().heading_rad, 1.0);
    }
}
