//! A step of every actor: members and runners avoid each other, a shadow follows the last member.
//!
//! ```text
//!   trail of the last member   ∙∙∙∙∙∙∙●        a shadow is so many points of it behind: ◌
//!                                 ◌            or beside it, and behind it in a narrow doorway
//! ```

use std::f64::consts::FRAC_PI_2;

use super::Rule;
use super::cast::{ASIDE_M, Cast, DOORWAY_HALF_M, Kind, OPENING, TAILGATER_ASIDE_M};
use super::gap::{Reach, farthest};
use crate::world::crowd::{self, STEP_S, Walker};
use crate::world::geometry::{Outline, Point};
use crate::world::motion::Track;
use crate::world::visit::{DOOR_Y_M, GONE_Y_M, Phase, SAMPLE, START_Y_M};

/// Distance beyond the line at which the person holding the door open stands, m: still in the light barrier.
const STANDS_M: f64 = 0.15;

/// Two people share the doorway's width when they are nearer to its line than this, m.
const NARROW_M: f64 = 0.8;

/// Between two points of a trail, m.
const TRAIL_M: f64 = 0.05;

/// Where a tailgater waits for the door to open.
const HALL_Y_M: f64 = -1.3;

/// Speed at which such a tailgater catches up.
const HURRY_M_S: f64 = 2.5;

impl Cast {
    /// All actors do a step.
    pub(super) fn walk(&mut self, share: f64, obstacles: &[Outline], now_s: f64) {
        let fidget_m = self.plan.condition.habit().fidget_m;
        let side_m = self.loaded.as_ref().map_or(0.0, |loaded| loaded.side_m);
        let mut walkers = Vec::new();
        let mut numbers = Vec::new();
        for (index, actor) in self.actors.iter_mut().enumerate().filter(|(_, actor)| actor.visit.is_present())
        {
            let beside_m = if matches!(self.plan.rule, Rule::SideBySide) && index + 1 == self.plan.people {
                -ASIDE_M.min(DOORWAY_HALF_M - side_m)
            } else {
                0.0
            };
            let at = actor.walker.at;
            actor.walker.goal = match actor.visit.phase {
                Phase::ToPassage if actor.kind == Kind::Next => actor.walker.goal,
                Phase::ToPassage if actor.kind == Kind::Runner => Point::new(actor.lane_m, START_Y_M + 0.4),
                Phase::Back if at.y > DOOR_Y_M - 0.1 => Point::new(0.0, DOOR_Y_M - 0.6),
                Phase::Back => Point::new(0.0, START_Y_M - 1.0),
                Phase::Stands => Point::new(0.0, DOOR_Y_M + STANDS_M),
                _ => actor.visit.goal(at, now_s, fidget_m, beside_m),
            };
            let mut walker = actor.walker;
            if is_shadow(actor.kind) {
                // The actor before it is not pushed; others keep away from it.
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
                if actor.visit.phase == Phase::Stands { stood(&walker, actor.walker.at) } else { walker };
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
                let mut track = actor.track.lock();
                if track.is_empty() {
                    *track = Track::growing(now_s, STEP_S * SAMPLE as f64);
                }
                track.push(at, FRAC_PI_2);
            }
        }
    }

    /// A step of an actor that follows the leader.
    fn shadow(&mut self, index: usize, leader: usize, share: f64) {
        let Some(first) = self.actors.get(leader) else { return };
        let (trail, ahead, gone) = (first.trail.clone(), first.walker.at, first.visit.phase == Phase::Gone);
        let reach = Reach::of(&first.body, self.loaded.as_ref());
        let Some(actor) = self.actors.get_mut(index) else { return };
        let (at, own) = (actor.walker.at, Reach::of(&actor.body, None));
        let wanted = match actor.kind {
            Kind::Behind { gap_m, late } => {
                let hall = trail.iter().position(|point| point.y > HALL_Y_M).unwrap_or(trail.len());
                let mut far = if gone {
                    trail.len() as f64 - 1.0
                } else {
                    farthest(&trail, (ahead, reach), own, gap_m)
                };
                if late && share < OPENING && actor.along <= hall as f64 {
                    far = far.min(hall as f64);
                }
                // Back, too, if the actor before it steps back.
                let most = HURRY_M_S * STEP_S / TRAIL_M;
                actor.along += (far - actor.along).clamp(-most, most);
                let place = actor.along.max(0.0) as usize;
                let (from, to) = (trail.get(place), trail.get(place + 1));
                let from = from.copied().unwrap_or(at);
                from + (to.copied().unwrap_or(from) - from) * actor.along.fract()
            }
            Kind::Beside { apart_m, behind_m, late } => {
                let narrow = behind_m.filter(|_| (ahead.y - DOOR_Y_M).abs() < NARROW_M);
                let side = match narrow {
                    _ if gone => Point::new(at.x, GONE_Y_M + 0.5),
                    Some(behind_m) => ahead - Point::new(0.0, behind_m),
                    None => ahead + Point::new(apart_m, 0.0),
                };
                if late && share < OPENING && at.y < HALL_Y_M + 0.2 {
                    Point::new(actor.lane_m, HALL_Y_M)
                } else {
                    side
                }
            }
            _ => return,
        };
        // No actor walks through a leaf, or through the wall beside it.
        let shut = share < 0.5 && at.y < DOOR_Y_M - 0.2 && wanted.y > DOOR_Y_M - 0.25;
        let in_doorway = (wanted.y - DOOR_Y_M).abs() < 0.3;
        let x_m = if in_doorway {
            wanted.x.clamp(-TAILGATER_ASIDE_M, TAILGATER_ASIDE_M)
        } else {
            wanted.x.clamp(-0.75, 0.75)
        };
        let way = Point::new(x_m, wanted.y) - at;
        let step_m = (HURRY_M_S * STEP_S).min(way.length());
        let to = if shut { at } else { at + way * (step_m / way.length().max(1e-9)) };
        actor.walker.velocity = (to - at) * (1.0 / STEP_S);
        actor.walker.at = to;
        if to.y > GONE_Y_M - 0.1 {
            actor.visit.phase = Phase::Gone;
        }
    }
}

/// A step of the person holding the door open, to the middle of the doorway. The leaf in their hand exerts no force.
fn stood(walker: &Walker, from: Point) -> Walker {
    let way = walker.goal - from;
    let step_m = (walker.speed_m_s * STEP_S).min(way.length());
    let step = way * (step_m / way.length().max(1e-9));
    Walker { at: from + step, velocity: step * (1.0 / STEP_S), ..*walker }
}

const fn is_shadow(kind: Kind) -> bool {
    matches!(kind, Kind::Behind { .. } | Kind::Beside { .. })
}
