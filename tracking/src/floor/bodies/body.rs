//! One body and its two feet.
//!
//! ```text
//!   landing    ◖ ─ ─ ✕ ─ ─ ◗ new      the body is between the foot it stands on and the new one, nearer to the old
//!   stance           ◗ ✕──▶           nothing is measured: it goes on, and cannot leave its foot behind
//!   lift-off   ◖ ─ ─ ─ ✕ ─ ◗          the same the other way round
//! ```
//!
//! Where a foot stands says little about where the body is: it passes over. When a foot lands or lifts says it well, to
//! a few centimetres along the way and across it, as the feet stand on both sides of it.

use nalgebra::{Matrix2, Vector2, Vector4};

use super::print::Print;
use super::step::{LONGEST_M, Stance, WALKS_MPS};
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

/// From the only foot on the floor to the body, at most, m: 60 % of a step of half a metre. From the middle of two feet, half.
const REACH_M: f64 = 0.3;

/// A panel nearer than this to where a foot stands is that foot's, m: half a sole of 0.26 m, and half a panel of 0.08 m; of
/// coarser panels so much more as they are coarser.
const SOLE_M: f64 = 0.17;

/// A foot that has fewer than this part of the most panels it had is lifted: what is left is another foot's edge.
const LIFTED: f64 = 0.35;

/// A foot that was down so long before the last reading, and is down again, has not lifted, s: it misses one at 9 Hz.
const FLICKER_S: f64 = 0.14;

/// Readings after which a body is believed in: a dropped bag presses once.
const CONFIRMED: u32 = 3;

/// Speed of a body that has just come, m/s, one sigma.
const SPEED_MPS: f64 = 0.8;

/// Spectral density of a walker's acceleration, m²/s³: 0.6 m/s within a step of half a second, as to turn round at 0.6 m/s
/// takes two.
const PROCESS_NOISE: f64 = 0.8;

#[derive(Clone, Copy, PartialEq, Debug)]
struct Foot {
    at: Point,
    is_down: bool,
    /// When it was last on the floor, s.
    down_s: f64,
    /// The most panels it had, and how coarse they are.
    panels: usize,
    coarse_m: f64,
}

/// A foot that is set now.
const fn set(print: Print, at_s: f64) -> Foot {
    Foot { at: print.at, is_down: true, down_s: at_s, panels: print.panels, coarse_m: print.coarse_m }
}

/// A body.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub id: TrackId,
    motion: Kinematics,
    /// Its newest foot and the one before, which may have lifted; and the one before that, which is not to be taken for
    /// another body's while its last panels are down.
    feet: [Foot; 3],
    /// When a foot last landed or lifted, and when it last had one on the floor, s.
    event_s: f64,
    pub seen_s: f64,
    readings: u32,
    /// Along which line it has walked last, of length 1; it may turn round on it.
    way: Option<Point>,
}

impl Body {
    /// A body that has come with this foot, or with both.
    pub(super) fn new(id: TrackId, first: Print, second: Option<Print>, at_s: f64) -> Self {
        let place = second.map_or(first.at, |second| (first.at + second.at) * 0.5);
        let place = Vector2::new(place.x, place.y);
        let motion = Kinematics::new(at_s, place, &round(REACH_M), SPEED_MPS, PROCESS_NOISE);
        let other = set(second.unwrap_or(first), at_s);
        let other = Foot { is_down: second.is_some(), ..other };
        let feet = [set(first, at_s), other, Foot { is_down: false, ..other }];
        Self { id, motion, feet, event_s: at_s, seen_s: at_s, readings: 1, way: None }
    }

    /// Where it is, m.
    pub(super) fn place(&self, at_s: f64) -> Point {
        self.motion.place(at_s)
    }

    /// The foot on the floor, or there just before the last reading of `read_s`, that a panel is nearest to: how far, m, and
    /// which it is. However long ago that was: a reading may be lost, and a foot that stood in between stands.
    pub(super) fn stands_at(&self, panel: Point, read_s: f64) -> Option<(f64, usize)> {
        let feet = self.feet.iter().enumerate().filter(|(_, foot)| read_s - foot.down_s < FLICKER_S);
        let away = feet.map(|(number, foot)| ((foot.at - panel).length(), foot.coarse_m, number));
        let own = away.filter(|(away_m, coarse_m, _)| *away_m < SOLE_M + coarse_m);
        own.map(|(away_m, _, number)| (away_m, number)).min_by(|one, other| one.0.total_cmp(&other.0))
    }

    /// Density that it sets a foot there in this reading, 1/m²; none where it cannot.
    pub(super) fn steps_to(&self, print: &Print, at_s: f64) -> Option<f64> {
        let [new, old, _] = self.feet;
        let on_both = new.is_down && old.is_down;
        let lands = self.landing(print.at);
        Stance { motion: &self.motion, foot: self.stands_on(), on_both, lands, way: self.way }
            .density(print, at_s)
    }

    /// Feet and numbers are the same, and so is what follows.
    pub(super) fn is_as(&self, other: &Self) -> bool {
        self.id == other.id && self.feet == other.feet
    }

    /// Where the body is if it sets a foot there now.
    fn landing(&self, foot: Point) -> Point {
        let old = self.stands_on();
        old + (foot - old) * LANDING
    }

    /// The foot on the floor, or the one that was last.
    fn stands_on(&self) -> Point {
        let [new, old, _] = self.feet;
        if old.is_down && !new.is_down { old.at } else { new.at }
    }

    fn measure(&mut self, at_s: f64, place: Point, sigma_m: f64) {
        self.motion.update(at_s, Vector2::new(place.x, place.y), &round(sigma_m));
        let velocity = self.motion.velocity();
        if velocity.length() > WALKS_MPS {
            self.way = Some(velocity * (1.0 / velocity.length()));
        }
    }

    /// It was on the floor at `at_s`.
    fn seen(&mut self, at_s: f64) {
        (self.seen_s, self.readings) = (at_s, self.readings.saturating_add(1));
    }

    /// Sets a foot.
    pub(super) fn lands(&mut self, print: Print, at_s: f64) {
        let place = self.landing(print.at);
        let [new, old, _] = self.feet;
        let [stands, leaves] = if old.is_down && !new.is_down { [old, new] } else { [new, old] };
        self.feet = [set(print, at_s), stands, leaves];
        self.event(place, at_s);
        self.seen(at_s);
    }

    /// Takes the panels of each of its feet at `at_s`: feet that roll or lift.
    pub(super) fn stand(&mut self, own: &[Vec<Point>; 3], at_s: f64) {
        let before = self.feet;
        for (foot, panels) in self.feet.iter_mut().zip(own) {
            foot.is_down = !panels.is_empty() && panels.len() as f64 >= LIFTED * foot.panels as f64;
            if foot.is_down {
                (foot.down_s, foot.panels) = (at_s, foot.panels.max(panels.len()));
                let sum = panels.iter().fold(Point::default(), |sum, at| sum + *at);
                foot.at = sum * (1.0 / panels.len() as f64);
            }
        }
        let [new, old, _] = self.feet;
        let is_step = (new.at - old.at).length() < LONGEST_M + 2.0 * new.coarse_m;
        let [was_new, was_old, _] = before.map(|foot| foot.is_down);
        match ([was_new, was_old], [new.is_down, old.is_down]) {
            ([true, true], [true, false]) if is_step => {
                self.event(new.at + (old.at - new.at) * LANDING, at_s);
            }
            ([true, true], [false, true]) if is_step => {
                self.event(old.at + (new.at - old.at) * LANDING, at_s);
            }
            _ => {}
        }
        // What stays down of all its feet it stands on, though the foot before last was taken for lifted.
        if let [new, old, third] = self.feet
            && !new.is_down
            && !old.is_down
            && third.is_down
        {
            self.feet = [third, new, old];
        }
        self.hold(at_s);
        if own.iter().any(|panels| !panels.is_empty()) {
            self.seen(at_s);
        }
    }

    fn event(&mut self, place: Point, at_s: f64) {
        self.event_s = at_s;
        self.measure(at_s, place, EVENT_M);
    }

    /// The body cannot leave its feet behind, and comes to rest over them.
    fn hold(&mut self, at_s: f64) {
        let [new, old, _] = self.feet;
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

    /// As a track.
    pub(super) fn track(&self, at_s: f64) -> TrackState {
        let spread = self.motion.spread(at_s);
        let confirmed = self.readings >= CONFIRMED;
        TrackState {
            id: self.id,
            at: self.motion.place(at_s),
            velocity: self.motion.velocity(),
            covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
            state: if confirmed { LifeCycle::Confirmed } else { LifeCycle::Tentative },
            existence: if confirmed { 1.0 } else { 0.5 },
            reason: "on the floor",
            origin: Origin::Entered,
        }
    }
}

fn round(sigma_m: f64) -> Matrix2<f64> {
    Matrix2::identity() * (sigma_m * sigma_m)
}
