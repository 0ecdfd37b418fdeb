//! Who is there, and what they are up to: computed step by step, some way ahead of the sensors.
//!
//! ```text
//!   member    hall ─▶ passage ─▶ a place in the zone ─▶ waits ─▶ the door is open ─▶ through ─▶ gone
//!   shadow    the trail of the last member, so far behind; or beside it
//!   runner    waits far back ─▶ the door opens ─▶ runs through
//! ```
//!
//! Members and runners get out of each other's way by the social-force model of the gathering; a shadow does not.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::{Arc, Mutex, PoisonError};

use super::{Plan, Rule};
use crate::world::body::{Body, Section};
use crate::world::crowd::{self, STEP_S, Walker};
use crate::world::gathering::free_place;
use crate::world::geometry::{Outline, Point};
use crate::world::motion::{Motion, Track};
use crate::world::random::{Purpose, Stream};
use crate::world::raycast::Person;

/// The line of the door.
pub const DOOR_Y_M: f64 = 1.0;
/// Where people start, are gone, and aim at first.
const START_Y_M: f64 = -4.2;
const GONE_Y_M: f64 = 3.5;
const PASSAGE_Y_M: f64 = -1.5;
/// The first starts when every background has been learned, s.
pub const FROM_S: f64 = 10.0;
/// Between two who start, and two who go in, s.
const HEADWAY_S: f64 = 1.2;
/// Somebody this near to their place has taken it; a crowd may keep them from it for so long.
const AT_PLACE_M: f64 = 0.15;
const SQUEEZE_S: f64 = 4.0;
/// Bodies are wider than deep.
const ROOM_SHARE: f64 = 0.85;
/// Open so far, people go; so far, somebody who waits for it begins to run.
const PASSABLE: f64 = 0.6;
const OPENING: f64 = 0.3;
/// Steps between two samples of a track.
const SAMPLE: u64 = 4;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Phase {
    NotYet,
    ToPassage,
    ToPlace,
    Waiting,
    ToDoor,
    Through,
    /// Back to the hall.
    Back,
    /// In the doorway for good, holding the leaf.
    Stands,
    Gone,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Member,
    /// Waits in the hall, and goes to the zone when told.
    Next,
    /// Behind the last member, centres so far apart; from the start, or once the door opens.
    Behind {
        apart_m: f64,
        late: bool,
    },
    /// Beside the last member.
    Beside {
        apart_m: f64,
        late: bool,
    },
    /// From the hall straight in.
    Runner,
}

struct Actor {
    body: Body,
    kind: Kind,
    walker: Walker,
    phase: Phase,
    start_s: f64,
    entered_s: f64,
    place: Point,
    move_s: f64,
    lane_m: f64,
    fidget: [(f64, f64); 2],
    /// Where it has been, a point every 5 cm: what a shadow follows.
    trail: Vec<Point>,
    /// How far along the trail of another a shadow is, in points.
    along: f64,
    track: Arc<Mutex<Track>>,
    crossed_s: Option<f64>,
}

/// Everybody.
pub struct Cast {
    plan: Plan,
    actors: Vec<Actor>,
    stream: Stream,
    tick: u64,
    next_leaves_s: f64,
    /// Runs with an even seed differ from those with an odd one where a rule has two kinds.
    even: bool,
    /// The one in the hall is to come.
    pub call_next: bool,
}

impl Cast {
    /// The people of a passage, and themselves as the world sees them.
    #[must_use]
    pub fn new(plan: Plan, seed: u64) -> (Self, Vec<Person>) {
        let mut stream = Stream::new(seed, Purpose::Crowd, [plan.people as u64, 17]);
        let mut kinds = vec![Kind::Member; plan.people];
        let late = (seed / 3).is_multiple_of(2);
        match plan.rule {
            Rule::GapWide => kinds.push(Kind::Behind { apart_m: stream.between(0.6, 1.2), late }),
            Rule::GapNarrow => kinds.push(Kind::Behind { apart_m: stream.between(0.3, 0.6), late }),
            Rule::InFile => kinds.push(Kind::Behind { apart_m: stream.between(0.0, 0.1), late }),
            Rule::SideBySide => kinds.push(Kind::Beside { apart_m: stream.between(0.0, 0.05), late }),
            Rule::RunsIn => kinds.push(Kind::Runner),
            Rule::Honest if !late => kinds.push(Kind::Next),
            Rule::CardBack => kinds.push(Kind::Next),
            _ => {}
        }
        let mut start_s = FROM_S;
        let actor = |(index, kind): (usize, &Kind)| {
            let mut person = Stream::new(seed, Purpose::Person, [index as u64, 17]);
            let body = Body::random(Section::Torso, &mut person);
            let lane_m = stream.between(-0.35, 0.35);
            let at = Point::new(lane_m, START_Y_M);
            let speed_m_s = match kind {
                Kind::Runner => person.between(2.0, 3.0),
                _ => person.between(0.7, 1.2),
            };
            let walker = Walker {
                at,
                velocity: Point::new(0.0, 0.0),
                radius_m: body.half_width_m * ROOM_SHARE,
                speed_m_s,
                goal: at,
            };
            let fidget = [(); 2].map(|()| (TAU * person.between(0.1, 0.3), person.between(0.0, TAU)));
            let own_s = start_s;
            start_s += HEADWAY_S * stream.between(0.8, 1.5);
            Actor {
                body,
                kind: *kind,
                walker,
                phase: Phase::NotYet,
                start_s: own_s,
                entered_s: 0.0,
                place: at,
                move_s: f64::INFINITY,
                lane_m,
                fidget,
                trail: Vec::new(),
                along: 0.0,
                track: Arc::new(Mutex::new(Track::growing(0.0, STEP_S * SAMPLE as f64))),
                crossed_s: None,
            }
        };
        let mut actors: Vec<Actor> = kinds.iter().enumerate().map(actor).collect();
        // Gaps are between bodies: centres are half a body of each further apart.
        let leader = actors.get(plan.people.saturating_sub(1)).map(|leader| leader.body);
        for actor in &mut actors {
            let Some(leader) = leader else { continue };
            match &mut actor.kind {
                Kind::Behind { apart_m, .. } => *apart_m += leader.half_depth_m + actor.body.half_depth_m,
                Kind::Beside { apart_m, .. } => *apart_m += leader.half_width_m + actor.body.half_width_m,
                _ => {}
            }
        }
        let person = |(index, actor): (usize, &Actor)| Person {
            name: format!("actor {}", index + 1),
            body: actor.body,
            motion: Motion::Live(Arc::clone(&actor.track)),
            crouches_s: None,
        };
        let people = actors.iter().enumerate().map(person).collect();
        let even = seed.is_multiple_of(2);
        let cast = Self { plan, actors, stream, tick: 0, next_leaves_s: 0.0, even, call_next: false };
        (cast, people)
    }

    /// Up to when everybody's way is computed, s.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.tick as f64 * STEP_S
    }

    /// Whether all members have taken their places, and shadows are where they want to be.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        let members = || self.actors.iter().filter(|actor| actor.kind == Kind::Member);
        members().all(|actor| actor.phase == Phase::Waiting)
            && members().all(|actor| self.now_s() > actor.entered_s + 2.0)
    }

    /// Whether the one from the hall waits in the zone.
    #[must_use]
    pub fn next_is_here(&self) -> bool {
        self.actors.iter().any(|actor| actor.kind == Kind::Next && actor.phase == Phase::Waiting)
    }

    /// The members have been asked to move: each takes a new place.
    pub fn rearrange(&mut self) {
        let habit = self.plan.condition.habit();
        let mut taken = Vec::new();
        for actor in self.actors.iter_mut().filter(|actor| actor.phase == Phase::Waiting) {
            actor.place = free_place(&habit, &taken, &mut self.stream);
            taken.push(actor.place);
        }
    }

    /// When members crossed the line inward, s.
    #[must_use]
    pub fn members_in(&self) -> Vec<f64> {
        let members = self.actors.iter().filter(|actor| actor.kind == Kind::Member);
        members.filter_map(|actor| actor.crossed_s).collect()
    }

    /// When somebody who is no member crossed it, s.
    #[must_use]
    pub fn extra_in_s(&self) -> Option<f64> {
        let others = self.actors.iter().filter(|actor| actor.kind != Kind::Member);
        others.filter_map(|actor| actor.crossed_s).reduce(f64::min)
    }

    /// Whether a light barrier in the doorway is broken.
    #[must_use]
    pub fn in_doorway(&self) -> bool {
        let present = self.actors.iter().filter(|actor| !matches!(actor.phase, Phase::NotYet | Phase::Gone));
        present.map(|actor| actor.walker.at).any(|at| (at.y - DOOR_Y_M).abs() < 0.25 && at.x.abs() < 0.6)
    }

    /// One step of 10 ms among `obstacles`, the leaf included, which is open by `share`.
    pub fn step(&mut self, share: f64, obstacles: &[Outline]) {
        let now_s = self.now_s();
        for index in 0..self.actors.len() {
            self.decide(index, share, now_s);
        }
        self.send_next(share, now_s);
        self.walk(share, obstacles, now_s);
        self.tick += 1;
    }

    fn leader(&self) -> usize {
        self.plan.people.saturating_sub(1)
    }

    fn decide(&mut self, index: usize, share: f64, now_s: f64) {
        let habit = self.plan.condition.habit();
        let taken: Vec<Point> = self
            .actors
            .iter()
            .enumerate()
            .filter(|(other, actor)| {
                *other != index && matches!(actor.phase, Phase::ToPlace | Phase::Waiting)
            })
            .map(|(_, actor)| actor.place)
            .collect();
        let (leader, even, call_next, rule) = (self.leader(), self.even, self.call_next, self.plan.rule);
        let Some(actor) = self.actors.get_mut(index) else { return };
        let member = actor.kind == Kind::Member;
        match actor.phase {
            Phase::NotYet if now_s >= actor.start_s => actor.phase = Phase::ToPassage,
            Phase::ToPassage if actor.kind == Kind::Runner && share > OPENING => actor.phase = Phase::ToDoor,
            Phase::ToPassage
                if actor.walker.at.y > PASSAGE_Y_M - 0.2 && (member || actor.kind == Kind::Next) =>
            {
                actor.phase = Phase::ToPlace;
                actor.entered_s = now_s;
                actor.place = free_place(&habit, &taken, &mut self.stream);
            }
            Phase::ToPlace
                if (actor.walker.at - actor.place).length() < AT_PLACE_M
                    || now_s > actor.entered_s + SQUEEZE_S =>
            {
                actor.phase = Phase::Waiting;
                if let Some((shortest_s, longest_s)) = habit.stay_s {
                    actor.move_s = now_s + self.stream.between(shortest_s, longest_s);
                }
            }
            Phase::Waiting if now_s >= actor.move_s => {
                actor.place = free_place(&habit, &taken, &mut self.stream);
                let (shortest_s, longest_s) = habit.stay_s.unwrap_or((f64::INFINITY, f64::INFINITY));
                actor.move_s = now_s + self.stream.between(shortest_s, longest_s);
            }
            Phase::ToDoor
                if rule == Rule::HeldOpen && index == leader && actor.walker.at.y > DOOR_Y_M - 0.1 =>
            {
                actor.phase = Phase::Stands;
            }
            Phase::ToDoor if actor.walker.at.y > DOOR_Y_M - 0.1 => actor.phase = Phase::Through,
            Phase::Through
                if rule == Rule::TurnsBack && !even && index == leader && actor.walker.at.y > 1.12 =>
            {
                actor.phase = Phase::Back;
            }
            Phase::Through if actor.walker.at.y > GONE_Y_M => actor.phase = Phase::Gone,
            Phase::Back if actor.walker.at.y < START_Y_M + 0.3 => actor.phase = Phase::Gone,
            _ => {}
        }
        if actor.kind == Kind::Next && actor.phase == Phase::ToPassage {
            // Waits in the hall until it is called.
            let goal_y_m = if call_next { PASSAGE_Y_M + 0.6 } else { -2.3 };
            actor.walker.goal = Point::new(actor.lane_m, goal_y_m);
        }
    }

    /// Whoever waits nearest to the door goes, the last member last.
    fn send_next(&mut self, share: f64, now_s: f64) {
        if share < PASSABLE || now_s < self.next_leaves_s {
            return;
        }
        let leader = self.leader();
        let door = Point::new(0.0, DOOR_Y_M);
        let waiting = |actor: &Actor| actor.kind == Kind::Member && actor.phase == Phase::Waiting;
        // Who is to stand in the doorway, or to turn back, lets the others go first.
        let alone = matches!(self.plan.rule, Rule::HeldOpen | Rule::TurnsBack);
        let others = self.actors.iter().enumerate().any(|(index, actor)| {
            let member = index != leader && actor.kind == Kind::Member;
            member && (waiting(actor) || (alone && actor.crossed_s.is_none_or(|at_s| now_s < at_s + 0.5)))
        });
        let distance_m = |actor: &Actor| (actor.walker.at - door).length();
        let next = self
            .actors
            .iter()
            .enumerate()
            .filter(|(index, actor)| waiting(actor) && (*index != leader || !others))
            .min_by(|(_, one), (_, other)| distance_m(one).total_cmp(&distance_m(other)))
            .map(|(index, _)| index);
        let Some(index) = next else { return };
        if let Some(actor) = self.actors.get_mut(index) {
            let turns = self.plan.rule == Rule::TurnsBack && self.even && index == leader;
            actor.phase = if turns { Phase::Back } else { Phase::ToDoor };
            self.next_leaves_s = now_s + HEADWAY_S * self.stream.between(0.7, 1.2);
        }
    }

    fn walk(&mut self, share: f64, obstacles: &[Outline], now_s: f64) {
        let fidget_m = self.plan.condition.habit().fidget_m;
        let present = |actor: &Actor| !matches!(actor.phase, Phase::NotYet | Phase::Gone);
        let mut walkers = Vec::new();
        let mut numbers = Vec::new();
        for (index, actor) in self.actors.iter_mut().enumerate().filter(|(_, actor)| present(actor)) {
            let [x, y] = actor.fidget.map(|(omega, phase)| libm::sin(omega * now_s + phase));
            let beside_m = if matches!(self.plan.rule, Rule::SideBySide) && index + 1 == self.plan.people {
                -0.22
            } else {
                0.0
            };
            actor.walker.goal = match actor.phase {
                Phase::ToPassage if actor.kind == Kind::Next => actor.walker.goal,
                Phase::ToPassage if actor.kind == Kind::Runner => Point::new(actor.lane_m, START_Y_M + 0.4),
                Phase::ToPassage => Point::new(actor.walker.at.x, PASSAGE_Y_M + 0.6),
                Phase::ToDoor => Point::new(beside_m, DOOR_Y_M + 0.4),
                Phase::Through => Point::new(beside_m, GONE_Y_M + 1.0),
                Phase::Back if actor.walker.at.y > DOOR_Y_M - 0.1 => Point::new(0.0, DOOR_Y_M - 0.6),
                Phase::Back => Point::new(0.0, START_Y_M - 1.0),
                Phase::Stands => Point::new(0.0, DOOR_Y_M + STANDS_M),
                _ => actor.place + Point::new(x, y) * fidget_m,
            };
            let mut walker = actor.walker;
            if is_shadow(actor.kind) {
                // The one before it is not pushed; others keep off it.
                walker.radius_m = 0.05;
            }
            walkers.push(walker);
            numbers.push(index);
        }
        crowd::step(&mut walkers, obstacles);
        for (index, walker) in numbers.iter().zip(walkers) {
            let Some(actor) = self.actors.get_mut(*index).filter(|actor| !is_shadow(actor.kind)) else {
                continue;
            };
            actor.walker =
                if actor.phase == Phase::Stands { stood(&walker, actor.walker.at) } else { walker };
        }
        let leader = self.leader();
        for index in numbers {
            self.shadow(index, leader, share);
            let Some(actor) = self.actors.get_mut(index) else { continue };
            let at = actor.walker.at;
            if actor.trail.last().is_none_or(|last| (*last - at).length() > TRAIL_M) {
                actor.trail.push(at);
            }
            if actor.crossed_s.is_none() && at.y > DOOR_Y_M {
                actor.crossed_s = Some(now_s);
            }
            if self.tick.is_multiple_of(SAMPLE) {
                let mut track = actor.track.lock().unwrap_or_else(PoisonError::into_inner);
                if track.is_empty() {
                    *track = Track::growing(now_s, STEP_S * SAMPLE as f64);
                }
                track.push(at, FRAC_PI_2);
            }
        }
    }

    /// A step of somebody who follows the leader.
    fn shadow(&mut self, index: usize, leader: usize, share: f64) {
        let Some(first) = self.actors.get(leader) else { return };
        let (trail, ahead, gone) = (first.trail.clone(), first.walker.at, first.phase == Phase::Gone);
        let Some(actor) = self.actors.get_mut(index) else { return };
        let at = actor.walker.at;
        let wanted = match actor.kind {
            Kind::Behind { apart_m, late } => {
                let hall = trail.iter().position(|point| point.y > HALL_Y_M).unwrap_or(trail.len());
                let mut far = trail.len() as f64 - 1.0 - apart_m / TRAIL_M;
                if gone {
                    far = trail.len() as f64 - 1.0;
                }
                if late && share < OPENING && actor.along <= hall as f64 {
                    far = far.min(hall as f64);
                }
                actor.along += (far - actor.along).clamp(0.0, HURRY_M_S * STEP_S / TRAIL_M);
                let place = actor.along.max(0.0) as usize;
                let (from, to) = (trail.get(place), trail.get(place + 1));
                let from = from.copied().unwrap_or(at);
                from + (to.copied().unwrap_or(from) - from) * actor.along.fract()
            }
            Kind::Beside { apart_m, late } => {
                let side =
                    if gone { Point::new(at.x, GONE_Y_M + 0.5) } else { ahead + Point::new(apart_m, 0.0) };
                if late && share < OPENING && at.y < HALL_Y_M + 0.2 {
                    Point::new(actor.lane_m, HALL_Y_M)
                } else {
                    side
                }
            }
            _ => return,
        };
        // Nobody walks through a leaf, or through the wall beside it.
        let shut = share < 0.5 && at.y < DOOR_Y_M - 0.2 && wanted.y > DOOR_Y_M - 0.25;
        let in_doorway = (wanted.y - DOOR_Y_M).abs() < 0.3;
        let x_m = if in_doorway { wanted.x.clamp(-0.25, 0.25) } else { wanted.x.clamp(-0.75, 0.75) };
        let way = Point::new(x_m, wanted.y) - at;
        let step_m = (HURRY_M_S * STEP_S).min(way.length());
        let to = if shut { at } else { at + way * (step_m / way.length().max(1e-9)) };
        actor.walker.velocity = (to - at) * (1.0 / STEP_S);
        actor.walker.at = to;
        if to.y > GONE_Y_M - 0.1 {
            actor.phase = Phase::Gone;
        }
    }
}

/// How far beyond the line whoever holds the door open stands, m: still in the light barrier.
const STANDS_M: f64 = 0.15;

/// Whoever holds the door open walks to the middle of the doorway and stays there: the leaf in their hand pushes nobody.
fn stood(walker: &Walker, from: Point) -> Walker {
    let way = walker.goal - from;
    let step_m = (walker.speed_m_s * STEP_S).min(way.length());
    let step = way * (step_m / way.length().max(1e-9));
    Walker { at: from + step, velocity: step * (1.0 / STEP_S), ..*walker }
}

/// Between two points of a trail, m.
const TRAIL_M: f64 = 0.05;
/// Where a tailgater waits who comes when the door opens.
const HALL_Y_M: f64 = -1.3;
/// How fast such a one catches up.
const HURRY_M_S: f64 = 2.5;

const fn is_shadow(kind: Kind) -> bool {
    matches!(kind, Kind::Behind { .. } | Kind::Beside { .. })
}
