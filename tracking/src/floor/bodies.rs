//! Patches to bodies, followed from footfall to footfall.
//!
//! ```text
//!   landing    ◖ ─ ─ ✕ ─ ─ ◗ new      the body is between the foot it stands on and the new one, nearer to the old
//!   stance           ◗ ✕──▶           nothing is measured: it goes on, and cannot leave its foot behind
//!   lift-off   ◖ ─ ─ ─ ✕ ─ ◗          the same the other way round
//! ```
//!
//! Where a foot stands says little about where the body is: it passes over. When a foot lands or lifts says it well, to
//! a few centimetres along the way and across it, as the feet stand on both sides of it. A body without a foot of its own
//! shares a patch with another, for as long as one is near; else it has left the floor.

use nalgebra::{Matrix2, Vector2, Vector4};

use super::patches::Patch;
use crate::geometry::Point;
use crate::tracker::kalman::Kinematics;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// When a foot lands the body has come so far from the old foot to the new one: 40 % of the step, as both feet are on
/// the floor for a fifth of it. Source: the phases of gait, 60 % stance and 40 % swing.
const LANDING: f64 = 0.4;

/// How well that is known, m, one sigma: panels of 8 cm, and steps that are not alike.
const EVENT_M: f64 = 0.06;

/// A body that stands is about the middle of its feet, m: 0.15 m, as the nine readings of a second say it once.
const STANDING_M: f64 = 0.45;

/// Without a footfall for so long it stands or turns, s: a slow stance.
const STANCE_S: f64 = 1.1;

/// From the only foot on the floor to the body, at most, m: 60 % of a step of 0.6 m. From the middle of two feet, half.
const REACH_M: f64 = 0.36;

/// A patch nearer than this to where a foot stands is that foot, m: the sole rolls from heel to toes.
const SOLE_M: f64 = 0.2;

/// Longest step, m.
const STEP_M: f64 = 1.0;

/// Two new patches nearer than this are the feet of one body, m: nearer than two people walk.
const FEET_M: f64 = 0.65;

/// A body that a foot puts farther than this from where it is believed to be has not set it, m: a step turned round.
const GATE_M: f64 = 0.6;

/// Faster than this a body walks, and its feet land ahead of it, m/s.
const WALKS_MPS: f64 = 0.3;

/// A foot lands so far ahead of a walker, m: 60 % of a step. From there, one sigma, ahead, as steps are long and short, and
/// aside.
const LEAD_M: f64 = 0.33;
const AHEAD_M: f64 = 0.25;
const ASIDE_M: f64 = 0.2;

/// A body without its own patch shares one that is nearer to it than this, m: two people foot by foot.
const SHARED_M: f64 = 0.5;

/// A running step flies for less, and a walking foot is never alone in the air, s.
const GONE_S: f64 = 0.6;

/// Readings after which a body is believed in: a dropped bag presses once.
const CONFIRMED: u32 = 3;

/// Speed of a body that has just come, m/s, one sigma.
const SPEED_MPS: f64 = 0.8;

/// Spectral density of a walker's acceleration, m²/s³: turning round takes a step.
const AGILITY: f64 = 0.5;

/// Most bodies of a floor: its 1024 panels are 6.5 m².
const BODIES_MAX: usize = 32;

#[derive(Clone, Copy, Debug)]
struct Foot {
    at: Point,
    is_down: bool,
}

#[derive(Clone, Debug)]
struct Body {
    id: TrackId,
    motion: Kinematics,
    /// Its newest foot and the one before; the older may have lifted.
    feet: [Foot; 2],
    /// When a foot last landed or lifted, and when it last had one on the floor, s.
    event_s: f64,
    seen_s: f64,
    readings: u32,
}

impl Body {
    /// Whether a patch is one of its feet on the floor, or one that has just lifted.
    fn stands_at(&self, at: Point) -> Option<f64> {
        let away = self.feet.iter().map(|foot| (foot.at - at).length());
        away.filter(|away_m| *away_m < SOLE_M).min_by(f64::total_cmp)
    }

    /// Where the body is if it sets a foot there now.
    fn landing(&self, foot: Point) -> Point {
        let old = self.stands_on();
        old + (foot - old) * LANDING
    }

    /// How unlikely it is that this body has set a foot there: a squared distance in sigmas; none if it cannot step so far.
    fn misses(&self, foot: Point, at_s: f64) -> Option<f64> {
        let place = self.landing(foot);
        let off = place - self.motion.place(at_s);
        if (foot - self.stands_on()).length() > STEP_M || off.length() > GATE_M {
            return None;
        }
        let outer = |way: Point| Matrix2::new(way.x * way.x, way.x * way.y, way.x * way.y, way.y * way.y);
        let velocity = self.motion.velocity();
        let (lead, slack) = if velocity.length() > WALKS_MPS {
            let ahead = velocity * (1.0 / velocity.length());
            let slack = outer(ahead) * (AHEAD_M * AHEAD_M) + outer(ahead.left()) * (ASIDE_M * ASIDE_M);
            (ahead * LEAD_M, slack)
        } else {
            (Point::default(), round(LEAD_M))
        };
        let (away, _) = self.motion.distance(at_s, Vector2::new(foot.x - lead.x, foot.y - lead.y), &slack);
        Some(away)
    }

    /// The foot on the floor, or the one that was last.
    fn stands_on(&self) -> Point {
        let [new, old] = self.feet;
        if old.is_down && !new.is_down { old.at } else { new.at }
    }

    fn measure(&mut self, at_s: f64, place: Point, sigma_m: f64) {
        self.motion.update(at_s, Vector2::new(place.x, place.y), &round(sigma_m));
    }

    fn lands(&mut self, foot: Point, at_s: f64) {
        let place = self.landing(foot);
        let [new, old] = self.feet;
        let stands = if old.is_down && !new.is_down { old } else { new };
        self.feet = [Foot { at: foot, is_down: true }, stands];
        self.event(place, at_s);
    }

    /// Takes the patches of its own at `at_s`: feet that roll, lift, or are down again where they were.
    fn stand(&mut self, own: &[Point], at_s: f64) {
        let before = self.feet;
        for foot in &mut self.feet {
            let near: Vec<Point> =
                own.iter().copied().filter(|at| (*at - foot.at).length() < SOLE_M).collect();
            foot.is_down = !near.is_empty();
            if foot.is_down {
                foot.at = near.iter().fold(Point::default(), |sum, at| sum + *at) * (1.0 / near.len() as f64);
            }
        }
        let [new, old] = self.feet;
        let is_step = (new.at - old.at).length() < STEP_M;
        match (before.map(|foot| foot.is_down), [new.is_down, old.is_down]) {
            // The older foot is set again where it stood, as after turning round.
            ([_, false], [_, true]) if is_step => {
                self.feet.swap(0, 1);
                self.event(new.at + (old.at - new.at) * LANDING, at_s);
            }
            ([true, true], [true, false]) if is_step => {
                self.event(new.at + (old.at - new.at) * LANDING, at_s);
            }
            ([true, true], [false, true]) if is_step => {
                self.event(old.at + (new.at - old.at) * LANDING, at_s);
            }
            _ => {}
        }
        self.hold(at_s);
    }

    fn event(&mut self, place: Point, at_s: f64) {
        self.event_s = at_s;
        self.measure(at_s, place, EVENT_M);
    }

    /// The body cannot leave its feet behind, and comes to rest over them.
    fn hold(&mut self, at_s: f64) {
        let [new, old] = self.feet;
        let (middle, reach_m) = match (new.is_down, old.is_down) {
            (true, true) => ((new.at + old.at) * 0.5, 0.5 * REACH_M + 0.5 * (new.at - old.at).length()),
            (true, false) => (new.at, REACH_M),
            (false, true) => (old.at, REACH_M),
            (false, false) => return,
        };
        if at_s - self.event_s > STANCE_S {
            self.measure(at_s, middle, STANDING_M);
        }
        let off = self.motion.place(at_s) - middle;
        if off.length() > reach_m {
            self.motion.predict(at_s);
            let (at, out) = (middle + off * (reach_m / off.length()), off * (1.0 / off.length()));
            let speed = self.motion.velocity().dot(out).max(0.0);
            let velocity = self.motion.velocity() - out * speed;
            self.motion.mean = Vector4::new(at.x, at.y, velocity.x, velocity.y);
        }
    }
}

/// The bodies on a floor.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    bodies: Vec<Body>,
    newest: TrackId,
}

impl Bodies {
    /// Takes the patches of a reading at `at_s`. Readings come in the order of time.
    pub fn observe(&mut self, patches: &[Patch], at_s: f64) {
        let (own, new) = self.standing(patches);
        for (body, own) in self.bodies.iter_mut().zip(&own) {
            body.stand(own, at_s);
            if !own.is_empty() {
                (body.seen_s, body.readings) = (at_s, body.readings.saturating_add(1));
            }
        }
        let left = self.land(&new, at_s);
        for body in self.bodies.iter_mut().filter(|body| body.seen_s < at_s) {
            let place = body.motion.place(at_s);
            if patches.iter().any(|patch| (patch.middle - place).length() < SHARED_M) {
                body.seen_s = at_s;
            }
        }
        self.bodies.retain(|body| at_s - body.seen_s < GONE_S);
        self.begin(left, at_s);
    }

    /// Of each body the patches that are its feet where they stood, and the patches that are nobody's yet.
    fn standing(&self, patches: &[Patch]) -> (Vec<Vec<Point>>, Vec<Point>) {
        let (mut own, mut new) = (vec![Vec::new(); self.bodies.len()], Vec::new());
        for patch in patches {
            let away = |body: &Body| body.stands_at(patch.middle);
            let near = self.bodies.iter().enumerate().filter_map(|(index, body)| Some((away(body)?, index)));
            let nearest = near.min_by(|one, other| one.0.total_cmp(&other.0));
            match nearest.and_then(|(_, index)| own.get_mut(index)) {
                Some(own) => own.push(patch.middle),
                None => new.push(patch.middle),
            }
        }
        (own, new)
    }

    /// Gives each new patch to the body whose step it fits best, one a body; what is left.
    fn land(&mut self, new: &[Point], at_s: f64) -> Vec<Point> {
        let mut pairs = Vec::new();
        for (number, foot) in new.iter().enumerate() {
            let bodies = self.bodies.iter().enumerate();
            pairs.extend(bodies.filter_map(|(index, body)| Some((body.misses(*foot, at_s)?, number, index))));
        }
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let (mut left, mut steps) = (vec![true; new.len()], vec![false; self.bodies.len()]);
        for (_, number, index) in pairs {
            let (Some(left), Some(steps)) = (left.get_mut(number), steps.get_mut(index)) else { continue };
            let (Some(foot), Some(body)) = (new.get(number), self.bodies.get_mut(index)) else { continue };
            if *left && !*steps {
                (*left, *steps) = (false, true);
                body.lands(*foot, at_s);
                (body.seen_s, body.readings) = (at_s, body.readings.saturating_add(1));
            }
        }
        new.iter().zip(left).filter(|(_, left)| *left).map(|(foot, _)| *foot).collect()
    }

    /// New bodies: of each patch that is left, with a second one beside it.
    fn begin(&mut self, mut left: Vec<Point>, at_s: f64) {
        while let Some(first) = left.pop() {
            if self.bodies.len() >= BODIES_MAX {
                return;
            }
            let away = |at: &Point| (*at - first).length();
            let second =
                (0..left.len()).min_by(|one, other| away(&left[*one]).total_cmp(&away(&left[*other])));
            let second =
                second.filter(|index| away(&left[*index]) < FEET_M).map(|index| left.swap_remove(index));
            let place = second.map_or(first, |second| (first + second) * 0.5);
            self.newest += 1;
            let motion =
                Kinematics::new(at_s, Vector2::new(place.x, place.y), &round(REACH_M), SPEED_MPS, AGILITY);
            let feet = [
                Foot { at: first, is_down: true },
                Foot { at: second.unwrap_or(first), is_down: second.is_some() },
            ];
            let (id, event_s, seen_s, readings) = (self.newest, at_s, at_s, 1);
            self.bodies.push(Body { id, motion, feet, event_s, seen_s, readings });
        }
    }

    /// All bodies at `at_s`.
    #[must_use]
    pub fn tracks(&self, at_s: f64) -> Vec<TrackState> {
        let track = |body: &Body| {
            let spread = body.motion.spread(at_s);
            let confirmed = body.readings >= CONFIRMED;
            TrackState {
                id: body.id,
                at: body.motion.place(at_s),
                velocity: body.motion.velocity(),
                covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
                state: if confirmed { LifeCycle::Confirmed } else { LifeCycle::Tentative },
                existence: if confirmed { 1.0 } else { 0.5 },
                reason: "on the floor",
                origin: Origin::Entered,
            }
        };
        self.bodies.iter().map(track).collect()
    }
}

fn round(sigma_m: f64) -> Matrix2<f64> {
    Matrix2::identity() * (sigma_m * sigma_m)
}

#[cfg(test)]
mod tests;
