//! The actors at the door, and what each of them does: computed step by step, some time ahead of the sensors.
//!
//! ```text
//!   member    hall ─▶ passage ─▶ a place in the zone ─▶ waits ─▶ the door is open ─▶ through ─▶ gone
//!   shadow    the trail of the last member, so far behind; or beside it
//!   runner    waits far back ─▶ the door opens ─▶ runs through
//! ```
//!
//! Members and runners get out of each other's way by the social-force model of the gathering; a shadow does not.

use std::sync::Arc;

use super::gap::Reach;
use super::load::{Load, Loaded};
use super::{Plan, Rule};
use crate::world::body::{Body, Section};
use crate::world::crowd::{STEP_S, Walker};
use crate::world::geometry::{Outline, Point};
use crate::world::motion::{Motion, Track};
use crate::world::person::Person;
use crate::world::prop::Prop;
use crate::world::random::{Purpose, Stream};
use crate::world::visit::{
    DOOR_Y_M, HEADWAY_S, Habit, PASSAGE_Y_M, Phase, ROOM_SHARE, SAMPLE, START_Y_M, Visit, free_place,
};
use parking_lot::Mutex;

/// The edge at which the zone before the door begins, and half its width.
const ZONE_Y_M: f64 = -1.0;
const ZONE_HALF_M: f64 = 1.0;
/// The first starts when every background has been learned, s.
pub const FROM_S: f64 = 10.0;
/// Share of the opening at which people go, and at which a waiting tailgater begins to run.
const PASSABLE: f64 = 0.6;
pub(super) const OPENING: f64 = 0.3;
/// Reach of the light barrier before and behind the line of the door, m.
const BARRIER_M: f64 = 0.25;
/// Distance from the middle of the doorway at which a person walks beside a tailgater, m.
pub(super) const ASIDE_M: f64 = 0.22;
/// Largest distance from the middle of the doorway at which the tailgater passes it, m.
pub(super) const TAILGATER_ASIDE_M: f64 = 0.25;
/// What two bodies gain in a doorway by turning a shoulder, m.
const SHOULDER_M: f64 = 0.1;
/// Half the width of the doorway, m.
pub(super) const DOORWAY_HALF_M: f64 = 0.45;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Kind {
    Member,
    /// Waits in the hall, and goes to the zone when called.
    Next,
    /// Behind the last member, with such a gap between the bodies; from the start, or once the door opens.
    Behind {
        gap_m: f64,
        late: bool,
    },
    /// Beside the last member; `behind_m` back in the doorway if it is too narrow for both.
    Beside {
        apart_m: f64,
        behind_m: Option<f64>,
        late: bool,
    },
    /// From the hall straight in.
    Runner,
}

pub(super) struct Actor {
    pub(super) body: Body,
    pub(super) kind: Kind,
    pub(super) walker: Walker,
    pub(super) visit: Visit,
    pub(super) lane_m: f64,
    /// Where it has been, a point every 5 cm: what a shadow follows.
    pub(super) trail: Vec<Point>,
    /// How far along the trail of another a shadow is, in points.
    pub(super) along: f64,
    pub(super) track: Arc<Mutex<Track>>,
    pub(super) crossed_s: Option<f64>,
}

/// All actors of a passage.
pub struct Cast {
    pub(super) plan: Plan,
    /// Load of the last member.
    pub(super) loaded: Option<Loaded>,
    pub(super) actors: Vec<Actor>,
    stream: Stream,
    pub(super) tick: u64,
    next_leaves_s: f64,
    /// Whether the seed is even: it selects one of the two kinds of a rule that has two.
    even: bool,
    /// Whether the person in the hall shall come to the zone.
    pub call_next: bool,
}

impl Cast {
    /// The actors of a passage, with their bodies and loads for the world.
    ///
    /// # Errors
    /// The scene of the load is broken, in one line.
    pub fn new(plan: Plan, seed: u64) -> Result<(Self, Vec<Person>, Vec<Prop>), String> {
        let loaded = plan.load.map(Load::read).transpose()?;
        let mut stream = Stream::new(seed, Purpose::Crowd, [plan.people as u64, 17]);
        let mut kinds = vec![Kind::Member; plan.people];
        let late = (seed / 3).is_multiple_of(2);
        match plan.rule {
            Rule::GapWide => kinds.push(Kind::Behind { gap_m: stream.between(0.6, 1.2), late }),
            Rule::GapNarrow => kinds.push(Kind::Behind { gap_m: stream.between(0.3, 0.6), late }),
            Rule::InFile => kinds.push(Kind::Behind { gap_m: stream.between(0.0, 0.1), late }),
            Rule::SideBySide => {
                kinds.push(Kind::Beside { apart_m: stream.between(0.0, 0.05), behind_m: None, late });
            }
            Rule::RunsIn => kinds.push(Kind::Runner),
            Rule::Honest if !late => kinds.push(Kind::Next),
            Rule::CardBack => kinds.push(Kind::Next),
            _ => {}
        }
        let mut start_s = FROM_S;
        let actor = |(index, kind): (usize, &Kind)| {
            let mut person = Stream::new(seed, Purpose::Person, [index as u64, 17]);
            let own = Body::random(Section::Torso, &mut person);
            let has_load = index + 1 == plan.people;
            let body = loaded.as_ref().filter(|_| has_load).map_or(own, |loaded| loaded.body(own));
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
            let visit = Visit::new(at, start_s, &mut person);
            start_s += HEADWAY_S * stream.between(0.8, 1.5);
            Actor {
                body,
                kind: *kind,
                walker,
                visit,
                lane_m,
                trail: Vec::new(),
                along: 0.0,
                track: Arc::new(Mutex::new(Track::growing(0.0, STEP_S * SAMPLE as f64))),
                crossed_s: None,
            }
        };
        let mut actors: Vec<Actor> = kinds.iter().enumerate().map(actor).collect();
        // Beside another, too, the gap is between bodies and what they have with them: centres are farther apart.
        let leader = actors.get(plan.people.saturating_sub(1)).map(|leader| leader.body);
        for actor in &mut actors {
            if let (Some(leader), Kind::Beside { apart_m, behind_m, .. }) = (leader, &mut actor.kind) {
                let back_m = Reach::of(&leader, loaded.as_ref()).back_m;
                // A towed suitcase trails behind both people, and does not push the tailgater aside.
                let beside = loaded.as_ref().filter(|_| plan.load != Some(Load::Suitcase));
                let side_m = Reach::of(&leader, beside).side_m;
                let width_m = side_m + actor.body.half_width_m;
                let room_m = TAILGATER_ASIDE_M + ASIDE_M.min(DOORWAY_HALF_M - side_m) + SHOULDER_M;
                *behind_m = (width_m > room_m).then_some(*apart_m + back_m + actor.body.half_depth_m);
                *apart_m += width_m;
            }
        }
        let person = |(index, actor): (usize, &Actor)| Person {
            name: format!("actor {}", index + 1),
            body: actor.body,
            motion: Motion::Live(Arc::clone(&actor.track)),
            crouches_s: None,
            gestures: None,
            reaches_s: Vec::new(),
        };
        let people = actors.iter().enumerate().map(person).collect();
        let parts = loaded.iter().flat_map(|loaded| &loaded.parts);
        let carrier = actors.get(plan.people.saturating_sub(1)).map(|actor| Arc::clone(&actor.track));
        let props = parts.zip(carrier.iter().cycle());
        let props = props
            .map(|(part, track)| Prop::new(part.clone(), Motion::Live(Arc::clone(track)), f64::INFINITY));
        let props = props.collect();
        let even = seed.is_multiple_of(2);
        let cast = Self { plan, loaded, actors, stream, tick: 0, next_leaves_s: 0.0, even, call_next: false };
        Ok((cast, people, props))
    }

    /// Time up to which the positions of all actors are computed, s.
    #[must_use]
    pub fn now_s(&self) -> f64 {
        self.tick as f64 * STEP_S
    }

    /// Whether all members have taken their places, and shadows are where they want to be.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        let members = || self.actors.iter().filter(|actor| actor.kind == Kind::Member);
        members().all(|actor| actor.visit.phase == Phase::Waiting)
            && members().all(|actor| self.now_s() > actor.visit.entered_s + 2.0)
    }

    /// Whether the person from the hall waits in the zone.
    #[must_use]
    pub fn next_is_here(&self) -> bool {
        self.actors.iter().any(|actor| actor.kind == Kind::Next && actor.visit.phase == Phase::Waiting)
    }

    /// Moves every waiting member to a new place: the door has asked them to move.
    pub fn rearrange(&mut self) {
        let mut taken = Vec::new();
        for index in 0..self.actors.len() {
            let habit = self.habit(index);
            let Some(actor) = self.actors.get_mut(index) else { continue };
            if actor.visit.phase == Phase::Waiting {
                actor.visit.place = free_place(&habit, &taken, &mut self.stream);
                taken.push(actor.visit.place);
            }
        }
    }

    /// Where an actor may wait.
    fn habit(&self, index: usize) -> Habit {
        let habit = self.plan.condition.habit();
        let loaded = self.loaded.as_ref().filter(|_| index == self.leader());
        loaded.map_or(habit, |loaded| loaded.room(&habit))
    }

    /// When members crossed the line inward, s.
    #[must_use]
    pub fn members_in(&self) -> Vec<f64> {
        let members = self.actors.iter().filter(|actor| actor.kind == Kind::Member);
        members.filter_map(|actor| actor.crossed_s).collect()
    }

    /// Time at which the first person outside the group crossed it, s.
    #[must_use]
    pub fn extra_in_s(&self) -> Option<f64> {
        let others = self.actors.iter().filter(|actor| actor.kind != Kind::Member);
        others.filter_map(|actor| actor.crossed_s).reduce(f64::min)
    }

    /// Whether a person outside the group is in the zone before the door, or past the line.
    #[must_use]
    pub fn extra_is_in_zone(&self) -> bool {
        let others = self.actors.iter().filter(|actor| actor.kind != Kind::Member);
        others.map(|actor| actor.walker.at).any(|at| at.y > ZONE_Y_M && at.x.abs() < ZONE_HALF_M)
    }

    /// Whether a light barrier in the doorway is broken.
    #[must_use]
    pub fn in_doorway(&self) -> bool {
        self.actors.iter().enumerate().filter(|(_, actor)| actor.visit.is_present()).any(|(index, actor)| {
            let loaded = self.loaded.as_ref().filter(|_| index == self.leader());
            let (front_m, back_m) = loaded.map_or((0.0, 0.0), |loaded| (loaded.front_m, loaded.back_m));
            let at = actor.walker.at;
            let beyond_m = at.y - DOOR_Y_M;
            beyond_m + front_m > -BARRIER_M && beyond_m - back_m < BARRIER_M && at.x.abs() < 0.6
        })
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

    pub(super) fn leader(&self) -> usize {
        self.plan.people.saturating_sub(1)
    }

    fn decide(&mut self, index: usize, share: f64, now_s: f64) {
        let habit = self.habit(index);
        let others = self.actors.iter().enumerate().filter(|(other, _)| *other != index);
        let taken: Vec<Point> =
            others.filter(|(_, actor)| actor.visit.has_place()).map(|(_, actor)| actor.visit.place).collect();
        let (leader, even, call_next, rule) = (self.leader(), self.even, self.call_next, self.plan.rule);
        let Some(actor) = self.actors.get_mut(index) else { return };
        let at = actor.walker.at;
        let at_line = at.y > DOOR_Y_M - 0.1;
        match (actor.visit.phase, actor.kind) {
            (Phase::ToPassage, Kind::Runner) if share > OPENING => actor.visit.phase = Phase::ToDoor,
            // Shadows follow the last member, and a runner waits for the door.
            (Phase::ToPassage, Kind::Runner | Kind::Behind { .. } | Kind::Beside { .. }) => {}
            (Phase::ToDoor, _) if rule == Rule::HeldOpen && index == leader && at_line => {
                actor.visit.phase = Phase::Stands;
            }
            (Phase::Through, _) if rule == Rule::TurnsBack && !even && index == leader && at.y > 1.12 => {
                actor.visit.phase = Phase::Back;
            }
            (Phase::Back, _) if at.y < START_Y_M + 0.3 => actor.visit.phase = Phase::Gone,
            _ => actor.visit.advance(at, now_s, &habit, &taken, &mut self.stream),
        }
        if actor.kind == Kind::Next && actor.visit.phase == Phase::ToPassage {
            // Waits in the hall until it is called.
            let goal_y_m = if call_next { PASSAGE_Y_M + 0.6 } else { -2.3 };
            actor.walker.goal = Point::new(actor.lane_m, goal_y_m);
        }
    }

    /// Sends the waiting member nearest to the door; the last member goes last.
    fn send_next(&mut self, share: f64, now_s: f64) {
        if share < PASSABLE || now_s < self.next_leaves_s {
            return;
        }
        let leader = self.leader();
        let door = Point::new(0.0, DOOR_Y_M);
        let waiting = |actor: &Actor| actor.kind == Kind::Member && actor.visit.phase == Phase::Waiting;
        // A member that is to stand in the doorway, or to turn back, lets the others go first.
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
            actor.visit.phase = if turns { Phase::Back } else { Phase::ToDoor };
            self.next_leaves_s = now_s + HEADWAY_S * self.stream.between(0.7, 1.2);
        }
    }
}
