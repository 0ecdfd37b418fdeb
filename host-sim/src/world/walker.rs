//! A scripted route: a person walks from way point to way point, waits there, and perhaps begins again.
//!
//! ```text
//!      ●──────────▶●            straight legs at constant speed; averaging over 0.5 s rounds the
//!      ▲  0.9 m/s  │            corners, starts and stops, and turns the chest in time
//!      │           ▼ wait 2 s
//!      ●◀──────────●
//! ```

use super::body::Stance;
use super::geometry::{Point, wrapped};
use super::random::Stream;
use super::standing::Shifts;
use std::f64::consts::TAU;

/// A place on the way and how long to stay there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WayPoint {
    /// Where.
    pub at: Point,
    /// For how many seconds.
    pub wait_s: f64,
}

/// What happens at the end of a route.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Repeat {
    /// Stay there.
    #[default]
    Stay,
    /// Leave the world.
    Leave,
    /// Walk on to the first way point and begin again.
    Loop,
    /// Walk the same way back and begin again.
    BackAndForth,
}

/// How a route is walked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Habit {
    /// Walking speed.
    pub speed_m_s: f64,
    /// When the person appears at the first way point.
    pub from_s: f64,
    /// When the person leaves the world, at any place.
    pub until_s: f64,
    /// What happens at the end of the route.
    pub repeat: Repeat,
    /// Where the chest points before the first step.
    pub heading_rad: f64,
    /// Turning speed of a standing person.
    pub turn_rad_s: f64,
    /// Standard deviation of the swaying, per axis.
    pub sway_m: f64,
    /// How far weight is shifted at most, and how often: shortest and longest time between.
    pub shift_m: f64,
    /// See `shift_m`.
    pub shift_every_s: [f64; 2],
}

/// The state at the beginning of a leg or a wait, within one round.
#[derive(Clone, Copy, Debug)]
struct Knot {
    time_s: f64,
    at: Point,
    distance_m: f64,
    /// Not wrapped: turns add up.
    heading_rad: f64,
}

/// A scripted person.
#[derive(Clone, Debug)]
pub struct Route {
    habit: Habit,
    /// At least one; the last is the end of the round.
    knots: Vec<Knot>,
    /// Swaying: per axis three (angular frequency, phase).
    sway: [[(f64, f64); 3]; 2],
    shifts: Shifts,
}

/// Half the time over which places and headings are averaged.
const SMOOTHING_S: f64 = 0.25;

impl Route {
    /// A walk along `points` (at least one), swaying as `stream` says.
    #[must_use]
    pub fn new(points: &[WayPoint], habit: Habit, stream: &mut Stream) -> Self {
        let mut round: Vec<WayPoint> = points.to_vec();
        match habit.repeat {
            Repeat::Loop => round.extend(points.first().map(|first| WayPoint { wait_s: 0.0, ..*first })),
            Repeat::BackAndForth => {
                round.extend(points.iter().rev().skip(1));
                if let Some(last) = round.last_mut() {
                    last.wait_s = 0.0;
                }
            }
            Repeat::Stay | Repeat::Leave => {}
        }
        let knots = timeline(&round, &habit);
        let sway = [(); 2].map(|()| [0.13, 0.31, 0.57].map(|hertz| sway_tone(hertz, stream)));
        let shifts = Shifts::new(habit.shift_m, habit.shift_every_s, habit.until_s, stream);
        Self { habit, knots, sway, shifts }
    }

    /// The stance at `time_s`; nothing before the person appears and after they leave.
    #[must_use]
    pub fn stance(&self, time_s: f64) -> Option<Stance> {
        let walked_s = time_s - self.habit.from_s;
        let round_s = self.knots.last().map_or(0.0, |knot| knot.time_s);
        let gone = self.habit.repeat == Repeat::Leave && walked_s > round_s;
        if walked_s < 0.0 || time_s > self.habit.until_s || gone {
            return None;
        }
        let mut at = Point::default();
        let mut heading_rad = 0.0;
        const SAMPLES: i32 = 4;
        let weight = 1.0 / f64::from(2 * SAMPLES + 1);
        for sample in -SAMPLES..=SAMPLES {
            let knot = self.raw(walked_s + SMOOTHING_S * f64::from(sample) / f64::from(SAMPLES));
            at = at + knot.at * weight;
            heading_rad += knot.heading_rad * weight;
        }
        let (before, after) = (self.raw(walked_s - SMOOTHING_S), self.raw(walked_s + SMOOTHING_S));
        let distance_m = (before.distance_m + after.distance_m) * 0.5;
        let speed_m_s = (after.distance_m - before.distance_m) / (2.0 * SMOOTHING_S);
        let sway = Point::new(self.sway_m(0, time_s), self.sway_m(1, time_s));
        let (shift, turn_rad) = self.shifts.at(walked_s);
        heading_rad += self.habit.turn_rad_s * walked_s + turn_rad;
        Some(Stance::walking(at + sway + shift, heading_rad, distance_m, speed_m_s))
    }

    fn sway_m(&self, axis: usize, time_s: f64) -> f64 {
        // Three tones of equal size: variance 3/2 of one amplitude squared.
        let tones = self.sway.get(axis).into_iter().flatten();
        let sum: f64 = tones.map(|(omega, phase)| libm::sin(omega * time_s + phase)).sum();
        self.habit.sway_m * sum / 1.5f64.sqrt()
    }

    /// The way as drawn, corners and all.
    fn raw(&self, walked_s: f64) -> Knot {
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else {
            return Knot { time_s: 0.0, at: Point::default(), distance_m: 0.0, heading_rad: 0.0 };
        };
        let repeats = matches!(self.habit.repeat, Repeat::Loop | Repeat::BackAndForth) && last.time_s > 0.0;
        let rounds = if repeats { (walked_s / last.time_s).floor().max(0.0) } else { 0.0 };
        let time_s = walked_s - rounds * last.time_s;
        let next = self.knots.partition_point(|knot| knot.time_s <= time_s);
        let knot = match (next.checked_sub(1).and_then(|index| self.knots.get(index)), self.knots.get(next)) {
            (None, _) => *first,
            (Some(_), None) => *last,
            (Some(from), Some(to)) => {
                let share = (time_s - from.time_s) / (to.time_s - from.time_s);
                Knot {
                    time_s,
                    at: from.at + (to.at - from.at) * share,
                    distance_m: from.distance_m + (to.distance_m - from.distance_m) * share,
                    heading_rad: from.heading_rad,
                }
            }
        };
        Knot {
            distance_m: knot.distance_m + rounds * last.distance_m,
            heading_rad: knot.heading_rad + rounds * (last.heading_rad - first.heading_rad),
            ..knot
        }
    }
}

fn sway_tone(hertz: f64, stream: &mut Stream) -> (f64, f64) {
    (TAU * hertz * stream.between(0.8, 1.25), stream.between(0.0, TAU))
}

/// When a person on this route reaches a way point for the first time, in s of the world.
#[must_use]
pub fn arrival_s(points: &[WayPoint], habit: &Habit, index: usize) -> f64 {
    let legs = points.windows(2).take(index).map(|pair| (pair[1].at - pair[0].at).length() / habit.speed_m_s);
    let waits = points.iter().take(index).map(|point| point.wait_s);
    habit.from_s + legs.chain(waits).sum::<f64>()
}

/// The states of one round, in order of time.
fn timeline(points: &[WayPoint], habit: &Habit) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::new();
    let first_heading = points
        .windows(2)
        .map(|pair| pair[1].at - pair[0].at)
        .find(|leg| leg.length() > 0.0)
        .map_or(habit.heading_rad, Point::angle_rad);
    let mut now = Knot { time_s: 0.0, at: Point::default(), distance_m: 0.0, heading_rad: first_heading };
    for (index, point) in points.iter().enumerate() {
        let leg = point.at - now.at;
        let leg = if index == 0 { Point::default() } else { leg };
        if leg.length() > 0.0 {
            now.heading_rad += wrapped(leg.angle_rad() - now.heading_rad);
            knots.push(now);
            now.distance_m += leg.length();
            now.time_s += leg.length() / habit.speed_m_s;
        }
        now.at = point.at;
        if point.wait_s > 0.0 {
            knots.push(now);
            now.time_s += point.wait_s;
        }
    }
    // A round ends with the heading it began with, so that turns add up from round to round.
    let repeats = matches!(habit.repeat, Repeat::Loop | Repeat::BackAndForth);
    if repeats {
        now.heading_rad += wrapped(first_heading - now.heading_rad);
    }
    knots.push(now);
    knots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::random::Purpose;

    const HABIT: Habit = Habit {
        speed_m_s: 1.0,
        from_s: 1.0,
        until_s: f64::INFINITY,
        repeat: Repeat::Stay,
        heading_rad: 0.5,
        turn_rad_s: 0.0,
        sway_m: 0.0,
        shift_m: 0.0,
        shift_every_s: [120.0, 300.0],
    };

    fn route(points: &[[f64; 3]], habit: Habit) -> Route {
        let points: Vec<WayPoint> = points
            .iter()
            .map(|[x, y, wait_s]| WayPoint { at: Point::new(*x, *y), wait_s: *wait_s })
            .collect();
        Route::new(&points, habit, &mut Stream::new(1, Purpose::Walk, [0, 0]))
    }

    #[test]
    fn a_walker_waits_walks_and_stays() {
        let route = route(&[[0.0, 0.0, 2.0], [3.0, 0.0, 0.0]], HABIT);
        assert_eq!(route.stance(0.9), None);
        assert_eq!(route.stance(2.0).unwrap().at, Point::default());
        let walking = route.stance(4.5).unwrap();
        assert!((walking.at - Point::new(1.5, 0.0)).length() < 1e-9);
        assert!((walking.stride - 1.0 / 1.2).abs() < 1e-9);
        let arrived = route.stance(100.0).unwrap();
        assert!((arrived.at - Point::new(3.0, 0.0)).length() < 1e-9);
        assert_eq!(arrived.stride, 0.0);
        let way = [[0.0, 2.0], [3.0, 0.0]].map(|[x, wait_s]| WayPoint { at: Point::new(x, 0.0), wait_s });
        assert_eq!(arrival_s(&way, &HABIT, 1), 6.0);
    }

    #[test]
    fn a_walker_who_leaves_is_gone() {
        let route = route(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]], Habit { repeat: Repeat::Leave, ..HABIT });
        assert!(route.stance(3.9).is_some());
        assert_eq!(route.stance(4.1), None);
    }

    #[test]
    fn loops_go_on_for_ever_without_a_jump_in_place_or_heading() {
        for repeat in [Repeat::Loop, Repeat::BackAndForth] {
            let square = [[0.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
            let route = route(&square, Habit { repeat, ..HABIT });
            let mut before = route.stance(1.0).unwrap();
            for step in 1..6000 {
                let now = route.stance(1.0 + 0.01 * f64::from(step)).unwrap();
                assert!((now.at - before.at).length() < 0.0101, "{repeat:?} at step {step}");
                assert!((now.heading_rad - before.heading_rad).abs() < 0.4, "{repeat:?} at step {step}");
                before = now;
            }
        }
    }

    #[test]
    fn standing_people_sway_as_much_as_asked_and_turn_as_fast_as_asked() {
        let habit = Habit { sway_m: 0.005, turn_rad_s: 0.1, ..HABIT };
        let route = route(&[[1.0, 1.0, 0.0]], habit);
        let offsets: Vec<f64> =
            (0..20_000).map(|step| route.stance(1.0 + 0.1 * f64::from(step)).unwrap().at.x - 1.0).collect();
        let spread = (offsets.iter().map(|x| x * x).sum::<f64>() / 20_000.0).sqrt();
        assert!((spread - 0.005).abs() < 0.0005, "spread {spread}");
        assert!((route.stance(11.0).unwrap().heading_rad - 1.5).abs() < 1e-9);
    }
}
