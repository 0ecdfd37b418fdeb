//! Routes with collision avoidance: people follow their way points and avoid each other.
//!
//! ```text
//!   route of anna   ●─────────▶●        each way point is a goal; the social forces of the crowd
//!                      ╲  ╱             lead around people in the way
//!   route of ben    ●◀───╳─────●
//! ```
//!
//! A scene asks for it with `avoid = true`. Computed beforehand for the scene's duration.

use super::body::Body;
use super::crowd::{self, STEP_S, Walker};
use super::geometry::{Outline, Point};
use super::motion::Track;
use super::walker::{self, Habit, Repeat, WayPoint};

/// A person and the route they walk.
#[derive(Clone, Debug)]
pub struct Wanderer {
    /// Their body.
    pub body: Body,
    /// The way points, at least one.
    pub points: Vec<WayPoint>,
    /// How they walk them.
    pub habit: Habit,
}

impl Wanderer {
    /// From when to when, s of the world, they wait at a way point for the first time; None without such a way point.
    #[must_use]
    pub fn stay_s(&self, index: usize) -> Option<[f64; 2]> {
        let from_s = walker::arrival_s(&self.points, &self.habit, index);
        Some([from_s, from_s + self.points.get(index)?.wait_s])
    }
}

/// A way point is reached within this distance; one to wait at is approached closer.
const PASSED_M: f64 = 0.35;
const REACHED_M: f64 = 0.12;
/// A person kept from a place for so long waits at the present position.
const PATIENCE_S: f64 = 6.0;
/// Bodies are wider than deep: the radius in the crowd is this share of half the width.
const ROOM_SHARE: f64 = 0.9;
/// Steps of the simulation between two samples of a trajectory.
const SAMPLE: u64 = 4;

struct Progress {
    walker: Walker,
    /// Index into the round of way points.
    next: usize,
    /// When the wait at the current place ends, while waiting.
    waits_until_s: Option<f64>,
    /// When the current leg began.
    since_s: f64,
    first_tick: u64,
    positions: Vec<Point>,
    gone: bool,
}

/// The trajectory of every person from 0 to `duration_s`.
#[must_use]
pub fn simulate(wanderers: &[Wanderer], obstacles: &[Outline], duration_s: f64) -> Vec<Track> {
    let mut progress: Vec<Progress> = wanderers.iter().map(begin).collect();
    let rounds: Vec<Vec<WayPoint>> = wanderers.iter().map(round).collect();
    for tick in 0..(duration_s / STEP_S) as u64 {
        let time_s = tick as f64 * STEP_S;
        for ((wanderer, round), progress) in wanderers.iter().zip(&rounds).zip(&mut progress) {
            if present(wanderer, progress, time_s) {
                head_on(wanderer, round, progress, time_s);
                record(progress, tick);
            }
        }
        let there = |(wanderer, progress): &(&Wanderer, &mut Progress)| present(wanderer, progress, time_s);
        let mut present: Vec<&mut Progress> =
            wanderers.iter().zip(&mut progress).filter(there).map(|(_, progress)| progress).collect();
        let mut walkers: Vec<Walker> = present.iter().map(|progress| progress.walker).collect();
        crowd::step(&mut walkers, obstacles);
        for (progress, walker) in present.iter_mut().zip(walkers) {
            progress.walker = walker;
        }
    }
    let track = |(wanderer, progress): (&Wanderer, Progress)| {
        let first_s = progress.first_tick as f64 * STEP_S;
        Track::new(first_s, STEP_S * SAMPLE as f64, &progress.positions, wanderer.habit.heading_rad)
    };
    wanderers.iter().zip(progress).map(track).collect()
}

fn begin(wanderer: &Wanderer) -> Progress {
    let at = wanderer.points.first().map_or(Point::default(), |point| point.at);
    let radius_m = wanderer.body.half_width_m * ROOM_SHARE;
    let speed_m_s = wanderer.habit.speed_m_s;
    Progress {
        walker: Walker { at, velocity: Point::default(), radius_m, speed_m_s, goal: at },
        next: 0,
        waits_until_s: None,
        since_s: wanderer.habit.from_s,
        first_tick: 0,
        positions: Vec::new(),
        gone: false,
    }
}

/// The way points of one round.
fn round(wanderer: &Wanderer) -> Vec<WayPoint> {
    let mut round = wanderer.points.clone();
    if wanderer.habit.repeat == Repeat::BackAndForth {
        round.extend(wanderer.points.iter().rev().skip(1).take(wanderer.points.len().saturating_sub(2)));
    }
    round
}

fn present(wanderer: &Wanderer, progress: &Progress, time_s: f64) -> bool {
    !progress.gone && (wanderer.habit.from_s..=wanderer.habit.until_s).contains(&time_s)
}

fn record(progress: &mut Progress, tick: u64) {
    if progress.positions.is_empty() {
        progress.first_tick = tick;
    }
    if (tick - progress.first_tick).is_multiple_of(SAMPLE) {
        progress.positions.push(progress.walker.at);
    }
}

/// Chooses the goal: the next way point, or the one after it once this is reached and its waiting time is over.
fn head_on(wanderer: &Wanderer, round: &[WayPoint], progress: &mut Progress, time_s: f64) {
    let Some(point) = round.get(progress.next) else { return };
    let distance_m = (progress.walker.at - point.at).length();
    let reached = distance_m < if point.wait_s > 0.0 { REACHED_M } else { PASSED_M };
    let late = time_s > progress.since_s + PATIENCE_S && distance_m < 1.0;
    if progress.waits_until_s.is_none() && (reached || late) {
        progress.waits_until_s = Some(time_s + point.wait_s);
    }
    if progress.waits_until_s.is_some_and(|until_s| time_s >= until_s) {
        let last = progress.next + 1 >= round.len();
        match wanderer.habit.repeat {
            Repeat::Leave if last => progress.gone = true,
            Repeat::Stay if last => {}
            _ => {
                progress.next = if last { 0 } else { progress.next + 1 };
                progress.waits_until_s = None;
                progress.since_s = time_s;
            }
        }
    }
    // Way points without a wait are passed at full speed: the goal lies behind them.
    let Some(point) = round.get(progress.next) else { return };
    let way = point.at - progress.walker.at;
    let stop = point.wait_s > 0.0 || progress.next + 1 >= round.len();
    let ahead = if stop { Point::default() } else { way * (1.0 / way.length().max(0.1)) };
    progress.walker.goal = point.at + ahead;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::body::Section;
    use crate::world::random::{Purpose, Stream};

    fn wanderer(points: &[[f64; 3]], repeat: Repeat) -> Wanderer {
        let habit = Habit {
            speed_m_s: 1.0,
            from_s: 1.0,
            until_s: f64::INFINITY,
            repeat,
            heading_rad: 0.0,
            turn_rad_s: 0.0,
            sway_m: 0.0,
            shift_m: 0.0,
            shift_every_s: [120.0, 300.0],
        };
        let points = points.iter().map(|[x, y, wait_s]| WayPoint { at: Point::new(*x, *y), wait_s: *wait_s });
        let body = Body::random(Section::Torso, &mut Stream::new(1, Purpose::Person, [0, 0]));
        Wanderer { body, points: points.collect(), habit }
    }

    #[test]
    fn a_route_is_walked_waited_at_and_left() {
        let points = [[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [3.0, 3.0, 0.0]];
        let tracks = simulate(&[wanderer(&points, Repeat::Leave)], &[], 30.0);
        assert_eq!(tracks[0].stance(0.5), None);
        assert!((tracks[0].stance(6.0).unwrap().at - Point::new(3.0, 0.0)).length() < 0.1);
        assert!((8.0..14.0).contains(&tracks[0].end_s()), "left at {} s", tracks[0].end_s());
    }

    #[test]
    fn people_whose_ways_cross_for_ever_never_walk_through_each_other() {
        let to_and_fro = |points: &[[f64; 3]]| wanderer(points, Repeat::BackAndForth);
        let tracks = simulate(
            &[
                to_and_fro(&[[-2.0, 0.1, 0.0], [2.0, 0.0, 1.0]]),
                to_and_fro(&[[0.0, -2.0, 0.0], [0.1, 2.0, 1.0]]),
                to_and_fro(&[[2.0, 0.0, 0.0], [-2.0, 0.0, 1.0]]),
            ],
            &[],
            120.0,
        );
        let mut closest_m = f64::INFINITY;
        for tick in 20..1190 {
            let at: Vec<Point> =
                tracks.iter().map(|track| track.stance(0.1 * f64::from(tick)).unwrap().at).collect();
            for (one, other) in [(0, 1), (0, 2), (1, 2)] {
                closest_m = closest_m.min((at[one] - at[other]).length());
            }
        }
        assert!(closest_m > 0.3, "two came within {closest_m:.2} m");
    }
}
