//! Where everybody is, frame by frame: the social-force model, as in the laboratory's crowds.
//!
//! ```text
//!   role ─▶ outside ─(its time, and room for it)─▶ walks ⇄ stands ─▶ 3.8 m to the side: gone
//! ```

use crate::world::crowd::{self, STEP_S, Walker};
use crate::world::geometry::Point;
use crate::world::shape::{Gesture, Gestures};

use super::CAMERA;
use super::cast::{Role, cast};

/// People come from so far aside, m: at 4.8 m from the camera the image ends at 2.7 m.
const FROM_M: f64 = 3.8;

/// Most people at a time, as in the paper.
const MOST: usize = 5;

/// A person waits outside until no other person is nearer than this, m.
const APART_M: f64 = 0.5;

/// People who stay pace on lanes between these distances from the camera, m, so far to either side of its axis, m; at 1.6 m
/// the image is 0.9 m wide to each side. They come one after the other, so far apart, m, at this speed, m/s.
const PACED_M: (f64, f64) = (1.6, 4.2);
const PACED_ASIDE_M: f64 = 0.85;
const PACED_APART_M: f64 = 0.7;
const PACED_MPS: f64 = 1.0;

/// Radius taken for a person of 1.7 m in the crowd, m.
const RADIUS_M: f64 = 0.22;

/// A person at the moment of a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Number in the run.
    pub person: u16,
    /// Middle of the body, m.
    pub at: Point,
    /// Unit vector in which the person looks.
    pub ahead: Point,
    /// m/s
    pub speed_mps: f64,
    /// Way walked, m: the phase of legs and arms.
    pub walked_m: f64,
    /// m
    pub stature_m: f64,
    /// Half the torso's width and depth at a stature of 1.7 m, m.
    pub half_axes_m: (f64, f64),
    /// What the arms do.
    pub gesture: Gesture,
    /// Where the bag is.
    pub bag: Bag,
}

/// Where the bag of a person is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bag {
    /// There is none.
    None,
    /// In the hand.
    Carried,
    /// On the floor, there.
    Down(Point),
}

#[derive(Clone, Copy, Debug)]
struct Actor {
    role: Role,
    ahead: Point,
    walked_m: f64,
    stood_s: f64,
}

/// The people of every frame.
#[derive(Clone, Debug)]
pub struct Walk {
    frames: Vec<Vec<Moment>>,
}

impl Walk {
    /// The walk of a seed, of so many frames.
    #[must_use]
    pub fn lasting(seed: u64, count: usize) -> Self {
        let period_s = CAMERA.period_us() as f64 * 1e-6;
        let mut waiting = cast(seed, count as f64 * period_s).into_iter().peekable();
        let steps = (period_s / STEP_S).round() as usize;
        let (mut walkers, mut actors): (Vec<Walker>, Vec<Actor>) = (Vec::new(), Vec::new());
        let mut frames = Vec::with_capacity(count);
        for number in 0..count * steps {
            let now_s = number as f64 * STEP_S;
            if number % steps == 0 {
                let moment = |(walker, actor): (&Walker, &Actor)| actor.moment(walker, seed, now_s);
                frames.push(walkers.iter().zip(&actors).map(moment).collect());
            }
            let has_room = |role: &Role, walkers: &[Walker]| {
                let at = role.walker().at;
                walkers.len() < MOST && walkers.iter().all(|other| (other.at - at).length() > APART_M)
            };
            while let Some(role) = waiting.next_if(|role| role.from_s <= now_s && has_room(role, &walkers)) {
                walkers.push(role.walker());
                let ahead = Point::new(0.0, role.way.sign());
                actors.push(Actor { role, ahead, walked_m: 0.0, stood_s: 0.0 });
            }
            for (walker, actor) in walkers.iter_mut().zip(&mut actors) {
                actor.steer(walker);
            }
            crowd::step(&mut walkers, &[]);
            for (walker, actor) in walkers.iter().zip(&mut actors) {
                let speed_mps = walker.velocity.length();
                actor.walked_m += speed_mps * STEP_S;
                if speed_mps > 0.3 {
                    actor.ahead = walker.velocity * (1.0 / speed_mps);
                }
            }
            let stays: Vec<bool> = walkers
                .iter()
                .zip(&actors)
                .map(|(walker, actor)| walker.at.y * actor.role.way.sign() < FROM_M)
                .collect();
            let mut stay = stays.iter().copied();
            walkers.retain(|_| stay.next().unwrap_or(true));
            let mut stay = stays.iter().copied();
            actors.retain(|_| stay.next().unwrap_or(true));
        }
        Self { frames }
    }

    /// So many people of one size who come in and walk up and down in view, each on a lane, and stay; of so many frames.
    #[must_use]
    pub fn pacing(people: u16, count: usize) -> Self {
        let period_s = CAMERA.period_us() as f64 * 1e-6;
        let moments = |number: usize| {
            let now_s = number as f64 * period_s;
            (0..people).map(|person| paced(person, people, now_s)).collect()
        };
        Self { frames: (0..count).map(moments).collect() }
    }

    /// The people at any time, between two frames on a straight line; those of the last frame after it, none before the first.
    #[must_use]
    pub fn at(&self, at_s: f64) -> Vec<Moment> {
        let period_s = CAMERA.period_us() as f64 * 1e-6;
        let number = at_s / period_s;
        if number < 0.0 {
            return Vec::new();
        }
        let (before, share) = (number.floor() as usize, number.fract());
        let Some(people) = self.frames.get(before) else {
            return self.frames.last().cloned().unwrap_or_default();
        };
        let after = self.frames.get(before + 1).map_or(&[][..], Vec::as_slice);
        let between = |one: &Moment| match after.iter().find(|other| other.person == one.person) {
            Some(other) => Moment {
                at: one.at + (other.at - one.at) * share,
                walked_m: one.walked_m + (other.walked_m - one.walked_m) * share,
                ..*one
            },
            None => *one,
        };
        people.iter().map(between).collect()
    }

    /// The people of one frame after the other.
    pub fn moments(&self) -> impl Iterator<Item = &Vec<Moment>> {
        self.frames.iter()
    }

    /// The people in a frame; None after the last.
    #[must_use]
    pub fn moment(&self, number: usize) -> Option<Vec<Moment>> {
        self.frames.get(number).cloned()
    }
}

/// One of `people` who walk up and down.
fn paced(person: u16, people: u16, now_s: f64) -> Moment {
    let share = (f64::from(person) + 0.5) / f64::from(people);
    let (walked_m, from_m) = (now_s * PACED_MPS, FROM_M + PACED_APART_M * f64::from(person));
    let in_m = from_m + PACED_ASIDE_M;
    // Of a way back and forth, from its left end on.
    let back_m = (walked_m - in_m).rem_euclid(4.0 * PACED_ASIDE_M);
    let (y_m, sign) = if walked_m < in_m {
        (walked_m - from_m, 1.0)
    } else if back_m < 2.0 * PACED_ASIDE_M {
        (PACED_ASIDE_M - back_m, -1.0)
    } else {
        (back_m - 3.0 * PACED_ASIDE_M, 1.0)
    };
    Moment {
        person,
        at: Point::new(PACED_M.0 + share * (PACED_M.1 - PACED_M.0), y_m),
        ahead: Point::new(0.0, sign),
        speed_mps: PACED_MPS,
        walked_m,
        stature_m: 1.7,
        half_axes_m: (0.22, 0.14),
        gesture: Gesture::Hang,
        bag: Bag::None,
    }
}

impl Role {
    fn walker(&self) -> Walker {
        let sign = self.way.sign();
        Walker {
            at: Point::new(self.lane_m, -sign * (FROM_M + self.behind_m)),
            velocity: Point::new(0.0, sign * self.speed_mps),
            radius_m: RADIUS_M * self.stature_m / 1.7,
            speed_m_s: self.speed_mps,
            goal: Point::new(self.lane_m, sign * (FROM_M + 2.0)),
        }
    }
}

impl Actor {
    /// Sets the goal: a place to stand for a while, then the other side.
    fn steer(&mut self, walker: &mut Walker) {
        let sign = self.role.way.sign();
        walker.goal = Point::new(self.role.lane_m, sign * (FROM_M + 2.0));
        let Some(stop) = self.role.stop else { return };
        if self.stood_s >= stop.lasts_s {
            return;
        }
        walker.goal = Point::new(self.role.lane_m, stop.y_m);
        if self.stands(walker) {
            self.stood_s += STEP_S;
        }
    }

    /// Whether the place to stand is reached.
    fn stands(&self, walker: &Walker) -> bool {
        let left = self.role.stop.filter(|stop| self.stood_s < stop.lasts_s);
        left.is_some_and(|stop| (Point::new(self.role.lane_m, stop.y_m) - walker.at).length() < 0.2)
    }

    fn moment(&self, walker: &Walker, seed: u64, now_s: f64) -> Moment {
        let Role { person, stature_m, half_axes_m, has_bag, .. } = self.role;
        let gestures = Gestures { seed, person: u64::from(person) };
        let beside = self.ahead.left() * -0.4;
        Moment {
            person,
            at: walker.at,
            ahead: self.ahead,
            speed_mps: walker.velocity.length(),
            walked_m: self.walked_m,
            stature_m,
            half_axes_m,
            gesture: gestures.at(now_s),
            bag: match (has_bag, self.stands(walker)) {
                (false, _) => Bag::None,
                (true, false) => Bag::Carried,
                (true, true) => Bag::Down(walker.at + beside),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::FRAMES;
    use super::*;

    #[test]
    fn people_who_pace_come_in_stay_in_view_and_keep_their_speed() {
        let walk = Walk::pacing(4, 200);
        assert!(walk.moment(0).unwrap().iter().all(|one| one.at.y <= -FROM_M));
        for (before, after) in walk.moments().zip(walk.moments().skip(1)).skip(40) {
            assert_eq!(after.len(), 4);
            for (before, after) in before.iter().zip(after) {
                let step_m = (after.at - before.at).length();
                assert!(after.at.y.abs() <= PACED_ASIDE_M && step_m < 0.2 + 1e-9, "{after:?}");
                let turns = (after.ahead - before.ahead).length() > 0.0;
                assert!(turns || (after.at - before.at - after.ahead * 0.2).length() < 1e-9, "{after:?}");
            }
        }
    }

    #[test]
    fn people_pass_beside_each_other_and_some_put_their_bag_down() {
        let mut closest_m = f64::INFINITY;
        let mut down = 0;
        for seed in 0..4 {
            let walk = Walk::lasting(seed, FRAMES);
            for number in 0..FRAMES {
                let people = walk.moment(number).unwrap();
                assert!(people.len() <= MOST);
                down += people.iter().filter(|one| matches!(one.bag, Bag::Down(_))).count();
                for (index, one) in people.iter().enumerate() {
                    for other in &people[..index] {
                        closest_m = closest_m.min((one.at - other.at).length());
                    }
                }
            }
        }
        assert!(closest_m > 0.2, "{closest_m}");
        assert!(down > 20, "{down}");
    }
}
