//! People enter, wait before a door, and leave through it when it opens.
//!
//! ```text
//!      room behind      y  4 ┌───────┐
//!                            │   ▲   │
//!      door            y   1 ├──═══──┤     opens 10 s after all are in; then one by one
//!      counted area          │ ○ ○ ○ │     places are taken, the deepest first
//!      passage       y −1.6 ┌┘       └┐
//!      hall                 │   ▲     │
//!                    y −4.6 └───┴─────┘    people start here, one after another
//! ```
//!
//! Four conditions, after the design notes on what two sensors can see (part A): people spread over the
//! area, crowd densely before the door and mill about, come in pairs, or are seen at the thighs. The
//! whole gathering is computed beforehand in steps of 10 ms and looked up afterwards.

use super::avoidance;
use super::body::{Body, Section};
use super::crowd::{self, STEP_S, Walker};
use super::geometry::{Outline, Point};
use super::motion::Track;
use super::random::{Purpose, Stream};
use super::shape::Family;
use super::visit::{DOOR_Y_M, HEADWAY_S, Habit, Phase, ROOM_SHARE, SAMPLE, START_Y_M, Visit};
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_2, PI};

/// How people come and wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// D: in single file, waiting at least 0.62 m apart.
    Spread,
    /// H: close to the door, milling about.
    Dense,
    /// P: in pairs, waiting as in D.
    Pairs,
}

/// How people avoid each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Avoidance {
    /// Forces between people: `crowd`.
    #[default]
    SocialForce,
    /// Velocities chosen so that none collide: `avoidance`.
    VelocityObstacles,
}

/// What people do while they wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Waiting {
    /// As their condition says.
    #[default]
    AsTheyStand,
    /// They turn on the spot and mill about at 0.1–0.3 m/s.
    Milling,
}

/// A gathering as a scene asks for it.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GatheringSpec {
    /// How people come and wait.
    pub condition: Condition,
    /// How many.
    pub people: usize,
    /// What the plane cuts (thighs: condition T).
    #[serde(default)]
    pub section: Section,
    /// Slowest and fastest walk.
    #[serde(default = "ordinary_walks")]
    pub speed_m_s: [f64; 2],
    /// When the first one starts; before that, the area is empty and can be learned.
    #[serde(default = "ten_seconds")]
    pub from_s: f64,
    /// The family of their shapes.
    #[serde(default)]
    pub bodies: Family,
    /// Share of them who wear black.
    #[serde(default)]
    pub black_share: f64,
    /// How they avoid each other.
    #[serde(default)]
    pub avoidance: Avoidance,
    /// What they do while they wait.
    #[serde(default)]
    pub waiting: Waiting,
    /// Two to four come at one time.
    #[serde(default)]
    pub in_clumps: bool,
}

const fn ordinary_walks() -> [f64; 2] {
    [0.7, 1.2]
}

const fn ten_seconds() -> f64 {
    10.0
}

/// Most people of a gathering.
pub const MOST_PEOPLE: usize = 16;

/// The track of each person, and the times of the events.
#[derive(Clone, Debug)]
pub struct Gathering {
    /// Body and track of each person.
    pub people: Vec<(Body, Track)>,
    /// When the last one had taken a place.
    pub all_in_s: f64,
    /// When the door opened.
    pub door_opens_s: f64,
    /// When the last one had left the counted area.
    pub empty_s: f64,
    /// When the last one was gone.
    pub end_s: f64,
}

impl Condition {
    pub(crate) const fn habit(self) -> Habit {
        match self {
            Self::Spread | Self::Pairs => {
                Habit { x: (-0.70, 0.70), y: (-0.72, 0.68), apart_m: 0.62, fidget_m: 0.06, stay_s: None }
            }
            Self::Dense => Habit {
                x: (-0.6, 0.6),
                y: (0.0, 0.70),
                apart_m: 0.50,
                fidget_m: 0.02,
                stay_s: Some((2.0, 5.0)),
            },
        }
    }
}

/// Half the width of the doorway.
const DOOR_HALF_M: f64 = 0.45;
/// Distance of the people of a clump, m.
const CLUMP_M: f64 = 0.6;
/// All must have been in for so long before the door opens.
const PATIENCE_S: f64 = 10.0;
/// No gathering lasts longer.
const LONGEST_S: f64 = 180.0;

struct Guest {
    body: Body,
    /// Speed of an ordinary walk, and while waiting, m/s.
    speeds_m_s: (f64, f64),
    walker: Walker,
    visit: Visit,
    /// When they were first there, in steps of the simulation.
    first_tick: u64,
    rest_rad: f64,
    positions: Vec<Point>,
}

impl Gathering {
    /// Computes a gathering; `obstacles` is what people cannot walk through, the closed door apart.
    #[must_use]
    pub fn simulate(spec: &GatheringSpec, seed: u64, obstacles: &[Outline]) -> Self {
        let habit = spec.habit();
        let mut stream = Stream::new(seed, Purpose::Crowd, [spec.people as u64, 0]);
        let mut guests = arrivals(spec, seed, &mut stream);
        let door = Outline::Segment(Point::new(-DOOR_HALF_M, DOOR_Y_M), Point::new(DOOR_HALF_M, DOOR_Y_M));
        let closed: Vec<Outline> = obstacles.iter().copied().chain([door]).collect();

        let (mut all_in_s, mut door_opens_s, mut empty_s) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        let mut next_leaves_s = f64::INFINITY;
        let mut time_s = 0.0;
        let mut tick = 0u64;
        while time_s < LONGEST_S && guests.iter().any(|guest| guest.visit.phase != Phase::Gone) {
            send_on(&mut guests, &habit, time_s, &mut stream);
            if all_in_s.is_infinite() && guests.iter().all(|guest| guest.visit.phase == Phase::Waiting) {
                all_in_s = time_s;
                door_opens_s = time_s + PATIENCE_S;
                next_leaves_s = door_opens_s + 0.5;
            }
            if time_s >= next_leaves_s {
                send_next(&mut guests);
                next_leaves_s = time_s + HEADWAY_S * stream.between(0.7, 1.2);
            }
            walk(
                &mut guests,
                spec.avoidance,
                habit.fidget_m,
                tick,
                if time_s < door_opens_s { &closed } else { obstacles },
            );
            let inside = |guest: &Guest| guest.visit.phase != Phase::Gone && guest.walker.at.y < DOOR_Y_M;
            if empty_s.is_infinite() && time_s > door_opens_s && !guests.iter().any(inside) {
                empty_s = time_s;
            }
            tick += 1;
            time_s = tick as f64 * STEP_S;
        }
        let track = |(index, guest): (usize, Guest)| {
            let rest_rad = |time_s: f64| match spec.waiting {
                Waiting::AsTheyStand => guest.rest_rad,
                Waiting::Milling => turned_rad(seed, index as u64, time_s),
            };
            let first_s = guest.first_tick as f64 * STEP_S;
            let step_s = STEP_S * SAMPLE as f64;
            (guest.body, Track::resting(first_s, step_s, &guest.positions, FRAC_PI_2, &rest_rad))
        };
        let people = guests.into_iter().enumerate().map(track).collect();
        Self { people, all_in_s, door_opens_s, empty_s, end_s: time_s }
    }
}

/// Time for which a person who turns on the spot looks one way, s.
const LOOKS_S: f64 = 2.5;

/// Where a person who turns on the spot looks at `time_s`: any way, another every few seconds.
fn turned_rad(seed: u64, person: u64, time_s: f64) -> f64 {
    let mut stream =
        Stream::new(seed, Purpose::Gesture, [1_000 + person, (time_s.max(0.0) / LOOKS_S) as u64]);
    stream.between(-PI, PI)
}

impl GatheringSpec {
    fn habit(&self) -> Habit {
        let habit = self.condition.habit();
        match self.waiting {
            Waiting::AsTheyStand => habit,
            Waiting::Milling => Habit { stay_s: Some((1.0, 3.0)), ..habit },
        }
    }

    /// The body of person `index` under `seed`: a plain one, changed by what this gathering asks for.
    fn body(&self, plain: Body, seed: u64, index: u64) -> Body {
        let mut own = Stream::new(seed, Purpose::Shape, [index, 0]);
        let body = plain.of(self.bodies, &mut own);
        let mut clothes = Stream::new(seed, Purpose::Shape, [index, 1]);
        if clothes.chance(self.black_share) { body.in_black(&mut clothes) } else { body }
    }
}

/// The place of each person in a clump of two to four who come at one time.
fn clumps(people: usize, seed: u64) -> Vec<usize> {
    let mut stream = Stream::new(seed, Purpose::Crowd, [people as u64, 1]);
    let mut left = people;
    let mut sizes = Vec::new();
    while left > 0 {
        let size = (2 + (stream.uniform() * 3.0) as usize).min(left);
        sizes.extend(0..size);
        left -= size;
    }
    sizes
}

fn arrivals(spec: &GatheringSpec, seed: u64, stream: &mut Stream) -> Vec<Guest> {
    let mut start_s = spec.from_s;
    let places = clumps(spec.people.min(MOST_PEOPLE), seed);
    (0..spec.people.min(MOST_PEOPLE))
        .map(|index| {
            let mut person = Stream::new(seed, Purpose::Person, [index as u64, 0]);
            let body = spec.body(Body::random(spec.section, &mut person), seed, index as u64);
            let paired = spec.condition == Condition::Pairs;
            let lane_m = match (paired, index % 2) {
                (false, _) => stream.between(-0.35, 0.35),
                (true, 0) => -0.33,
                (true, _) => 0.33,
            };
            let in_clump = places.get(index).copied().filter(|_| spec.in_clumps);
            let comes_along = (paired && index % 2 == 1) || in_clump.is_some_and(|place| place > 0);
            if index > 0 && !comes_along {
                start_s += HEADWAY_S * stream.between(0.8, 1.5);
            }
            let at = match in_clump {
                Some(place) => {
                    let aside_m = if place % 2 == 0 { -CLUMP_M } else { CLUMP_M };
                    Point::new(0.5 * aside_m, START_Y_M + CLUMP_M * (place / 2) as f64)
                }
                None => Point::new(lane_m, START_Y_M),
            };
            let speed_m_s = person.between(spec.speed_m_s[0], spec.speed_m_s[1]);
            let radius_m = body.half_width_m * ROOM_SHARE;
            let milling_m_s = match spec.waiting {
                Waiting::AsTheyStand => speed_m_s,
                Waiting::Milling => 0.1 + 0.2 * index as f64 / MOST_PEOPLE as f64,
            };
            Guest {
                body,
                speeds_m_s: (speed_m_s, milling_m_s),
                walker: Walker { at, velocity: Point::new(0.0, speed_m_s), radius_m, speed_m_s, goal: at },
                visit: Visit::new(at, start_s, &mut person),
                first_tick: 0,
                rest_rad: FRAC_PI_2 + person.between(-0.8, 0.8),
                positions: Vec::new(),
            }
        })
        .collect()
}

/// Moves each guest that has reached a goal to the next phase.
fn send_on(guests: &mut [Guest], habit: &Habit, time_s: f64, stream: &mut Stream) {
    for index in 0..guests.len() {
        let others = guests.iter().enumerate().filter(|(other, _)| *other != index);
        let taken: Vec<Point> =
            others.filter(|(_, guest)| guest.visit.has_place()).map(|(_, guest)| guest.visit.place).collect();
        let Some(guest) = guests.get_mut(index) else { continue };
        guest.visit.advance(guest.walker.at, time_s, habit, &taken, stream);
    }
}

/// Sends the waiting guest nearest to the door.
fn send_next(guests: &mut [Guest]) {
    let door = Point::new(0.0, DOOR_Y_M);
    let waiting = guests.iter_mut().filter(|guest| guest.visit.phase == Phase::Waiting);
    let distance_m = |guest: &Guest| (guest.walker.at - door).length();
    if let Some(next) = waiting.min_by(|a, b| distance_m(a).total_cmp(&distance_m(b))) {
        next.visit.phase = Phase::ToDoor;
    }
}

/// One step of every guest in the world.
fn walk(guests: &mut [Guest], avoidance: Avoidance, fidget_m: f64, tick: u64, obstacles: &[Outline]) {
    let time_s = tick as f64 * STEP_S;
    let present = |guest: &&mut Guest| guest.visit.is_present();
    let mut walkers = Vec::with_capacity(guests.len());
    for guest in guests.iter_mut().filter(present) {
        if guest.positions.is_empty() {
            guest.first_tick = tick;
        }
        if (tick - guest.first_tick).is_multiple_of(SAMPLE) {
            guest.positions.push(guest.walker.at);
        }
        let (walking_m_s, waiting_m_s) = guest.speeds_m_s;
        guest.walker.speed_m_s = if guest.visit.phase == Phase::Waiting { waiting_m_s } else { walking_m_s };
        guest.walker.goal = guest.visit.goal(guest.walker.at, time_s, fidget_m, 0.0);
        walkers.push(guest.walker);
    }
    match avoidance {
        Avoidance::SocialForce => crowd::step(&mut walkers, obstacles),
        Avoidance::VelocityObstacles => avoidance::step(&mut walkers, obstacles),
    }
    for (guest, walker) in guests.iter_mut().filter(present).zip(walkers) {
        guest.walker = walker;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gathering(condition: Condition, people: usize, seed: u64) -> Gathering {
        let spec = GatheringSpec {
            condition,
            people,
            section: Section::Torso,
            speed_m_s: ordinary_walks(),
            from_s: 10.0,
            bodies: Family::Plain,
            black_share: 0.0,
            avoidance: Avoidance::SocialForce,
            waiting: Waiting::AsTheyStand,
            in_clumps: false,
        };
        let wall = |x: f64| Outline::Segment(Point::new(x, -1.6), Point::new(x, 1.0));
        let front = |x: f64| Outline::Segment(Point::new(x, 1.0), Point::new(x * 0.45, 1.0));
        Gathering::simulate(&spec, seed, &[wall(-1.0), wall(1.0), front(-1.0), front(1.0)])
    }

    #[test]
    fn everybody_comes_in_waits_and_leaves() {
        for condition in [Condition::Spread, Condition::Dense, Condition::Pairs] {
            for people in [1, 4, 7, 10] {
                let gathering = gathering(condition, people, 3);
                assert_eq!(gathering.people.len(), people);
                let order =
                    [10.0, gathering.all_in_s, gathering.door_opens_s, gathering.empty_s, gathering.end_s];
                assert!(order.is_sorted(), "{condition:?} {people}: {order:?}");
                assert!(
                    gathering.end_s < 120.0,
                    "{condition:?} {people}: still there at {} s",
                    gathering.end_s
                );
                for (_, track) in &gathering.people {
                    let stance = track.stance(gathering.door_opens_s - 1.0).unwrap();
                    assert!(
                        stance.at.x.abs() < 1.0 && stance.at.y.abs() < 1.0,
                        "{condition:?} {people} {stance:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn clumps_and_other_manners_come_in_and_leave_too() {
        let wall = |x: f64| Outline::Segment(Point::new(x, -1.6), Point::new(x, 1.0));
        let front = |x: f64| Outline::Segment(Point::new(x, 1.0), Point::new(x * 0.45, 1.0));
        for avoidance in [Avoidance::SocialForce, Avoidance::VelocityObstacles] {
            for (condition, seed) in [(Condition::Spread, 1), (Condition::Dense, 2)] {
                let spec = GatheringSpec {
                    condition,
                    people: 7,
                    section: Section::Torso,
                    speed_m_s: ordinary_walks(),
                    from_s: 10.0,
                    bodies: Family::Arms,
                    black_share: 0.1,
                    avoidance,
                    waiting: Waiting::Milling,
                    in_clumps: true,
                };
                let gathering =
                    Gathering::simulate(&spec, seed, &[wall(-1.0), wall(1.0), front(-1.0), front(1.0)]);
                assert!(gathering.end_s < 140.0, "{spec:?}: still there at {} s", gathering.end_s);
                assert!(gathering.all_in_s.is_finite(), "{spec:?}");
            }
        }
    }

    #[test]
    fn people_keep_the_distance_of_their_condition() {
        for (condition, people, least_m) in [(Condition::Spread, 5, 0.5), (Condition::Dense, 5, 0.36)] {
            let gathering = gathering(condition, people, 1);
            let mut closest_m = f64::INFINITY;
            let mut time_s = gathering.all_in_s;
            while time_s < gathering.door_opens_s {
                let at = |(_, track): &(Body, Track)| track.stance(time_s).unwrap().at;
                let places: Vec<Point> = gathering.people.iter().map(at).collect();
                for (index, one) in places.iter().enumerate() {
                    let nearest = places[..index].iter().map(|other| (*one - *other).length());
                    closest_m = nearest.fold(closest_m, f64::min);
                }
                time_s += 0.1;
            }
            println!("{condition:?}: the closest two came to {closest_m:.2} m");
            assert!(closest_m > least_m, "{condition:?}: {closest_m}");
        }
    }
}
