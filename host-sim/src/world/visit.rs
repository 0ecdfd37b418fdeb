//! One person's visit to a door: come in, find a place, wait, go through. Gatherings and guarded doors share it.
//!
//! ```text
//!   not yet ─▶ to the passage ─▶ to a place ─▶ waiting ─▶ to the door ─▶ through ─▶ gone
//!   y  −4.2        −1.5            habit                      1.0          3.5 m
//! ```
//!
//! Distances and times are those of the design notes on what two sensors can see, part A.

use std::f64::consts::TAU;

use super::geometry::Point;
use super::random::Stream;

/// Where people start.
pub(crate) const START_Y_M: f64 = -4.2;
/// Where people are gone.
pub(crate) const GONE_Y_M: f64 = 3.5;
/// The passage into the area begins here; people aim at it before they aim at their place.
pub(crate) const PASSAGE_Y_M: f64 = -1.5;
/// The line of the door.
pub(crate) const DOOR_Y_M: f64 = 1.0;
/// Time between the starts of two people, and between their departures.
pub(crate) const HEADWAY_S: f64 = 1.2;
/// A person this near to the chosen place has taken it.
const AT_PLACE_M: f64 = 0.15;
/// A crowd may keep a person from the chosen place for so long; then the person stays where the crowd is.
const SQUEEZE_S: f64 = 4.0;
/// Bodies are wider than deep: a person takes up this share of half the width.
pub(crate) const ROOM_SHARE: f64 = 0.85;
/// Steps of the simulation between two samples of a track.
pub(crate) const SAMPLE: u64 = 4;
/// Places farther back than this are never chosen.
const BACK_Y_M: f64 = -0.72;
/// How much closer and further back a place may be after each sixty draws that were too near to another person. Set so
/// that people hide each other as often as in the reference world (`tests/world_check.rs`).
const TRIES: u32 = 60;
const CLOSER: f64 = 0.97;
const FURTHER_BACK_M: f64 = 0.015;

/// Where people may wait, how far apart, and how quietly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Habit {
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    pub(crate) apart_m: f64,
    pub(crate) fidget_m: f64,
    /// Shortest and longest time at one place.
    pub(crate) stay_s: Option<(f64, f64)>,
}

impl Habit {
    /// Time at which a person at a place since `now_s` looks for another place, s.
    fn move_s(&self, now_s: f64, stream: &mut Stream) -> f64 {
        self.stay_s
            .map_or(f64::INFINITY, |(shortest_s, longest_s)| now_s + stream.between(shortest_s, longest_s))
    }
}

/// How far a visit has got.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    NotYet,
    ToPassage,
    ToPlace,
    Waiting,
    ToDoor,
    Through,
    /// Back to the hall: only at a guarded door.
    Back,
    /// In the doorway for good, holding the leaf: only at a guarded door.
    Stands,
    Gone,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    pub(crate) phase: Phase,
    pub(crate) start_s: f64,
    /// When the walk to the place began.
    pub(crate) entered_s: f64,
    pub(crate) place: Point,
    /// When to look for a new place.
    move_s: f64,
    /// Fidgeting: per axis an angular frequency and a phase.
    fidget: [(f64, f64); 2],
}

impl Visit {
    /// A visit that begins at `at` at `start_s`; `person` is the visitor's own stream.
    pub(crate) fn new(at: Point, start_s: f64, person: &mut Stream) -> Self {
        let fidget = [(); 2].map(|()| (TAU * person.between(0.1, 0.3), person.between(0.0, TAU)));
        Self { phase: Phase::NotYet, start_s, entered_s: 0.0, place: at, move_s: f64::INFINITY, fidget }
    }

    pub(crate) fn is_present(&self) -> bool {
        !matches!(self.phase, Phase::NotYet | Phase::Gone)
    }

    /// Whether the place is taken, or will be.
    pub(crate) fn has_place(&self) -> bool {
        matches!(self.phase, Phase::ToPlace | Phase::Waiting)
    }

    /// Goes on to the next phase if the visitor has reached the goal of this one; `at` is the visitor's position.
    /// It never sends a waiting visitor to the door.
    pub(crate) fn advance(
        &mut self,
        at: Point,
        now_s: f64,
        habit: &Habit,
        taken: &[Point],
        stream: &mut Stream,
    ) {
        match self.phase {
            Phase::NotYet if now_s >= self.start_s => self.phase = Phase::ToPassage,
            Phase::ToPassage if at.y > PASSAGE_Y_M - 0.2 => {
                self.phase = Phase::ToPlace;
                self.entered_s = now_s;
                self.place = free_place(habit, taken, stream);
            }
            Phase::ToPlace
                if (at - self.place).length() < AT_PLACE_M || now_s > self.entered_s + SQUEEZE_S =>
            {
                self.phase = Phase::Waiting;
                self.move_s = habit.move_s(now_s, stream);
            }
            Phase::Waiting if now_s >= self.move_s => {
                self.place = free_place(habit, taken, stream);
                self.move_s = habit.move_s(now_s, stream);
            }
            Phase::ToDoor if at.y > DOOR_Y_M - 0.1 => self.phase = Phase::Through,
            Phase::Through if at.y > GONE_Y_M => self.phase = Phase::Gone,
            _ => {}
        }
    }

    /// Where the visitor wants to be, `aisle_x_m` aside of the middle of the door.
    pub(crate) fn goal(&self, at: Point, now_s: f64, fidget_m: f64, aisle_x_m: f64) -> Point {
        match self.phase {
            Phase::ToPassage => Point::new(at.x, PASSAGE_Y_M + 0.6),
            Phase::ToDoor => Point::new(aisle_x_m, DOOR_Y_M + 0.4),
            Phase::Through => Point::new(aisle_x_m, GONE_Y_M + 1.0),
            _ => {
                let [x, y] = self.fidget.map(|(omega, phase)| libm::sin(omega * now_s + phase));
                self.place + Point::new(x, y) * fidget_m
            }
        }
    }
}

/// A place far enough from the places in `taken`. If the crowd leaves none, the required distance is reduced and
/// places further back are allowed.
pub(crate) fn free_place(habit: &Habit, taken: &[Point], stream: &mut Stream) -> Point {
    let (mut apart_m, mut back_y_m) = (habit.apart_m, habit.y.0);
    loop {
        for _ in 0..TRIES {
            let x = stream.between(habit.x.0, habit.x.1);
            let place = Point::new(x, stream.between(back_y_m, habit.y.1));
            if taken.iter().all(|other| (*other - place).length() >= apart_m) {
                return place;
            }
        }
        apart_m *= CLOSER;
        back_y_m = (back_y_m - FURTHER_BACK_M).max(BACK_Y_M);
    }
}
