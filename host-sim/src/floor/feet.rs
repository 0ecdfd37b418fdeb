//! The two feet under any moving body: a walker's, or of a person who waits in a crowd.
//!
//! ```text
//!   stands   ▭ ✕ ▭                both feet beside the body
//!   walks    ▭     ✕▸  ▭          the body leaves its feet behind by LEAVES_M: the farther foot swings to where it will be
//! ```
//!
//! This is another gait than `gait`'s, whose steps follow from the way: here they follow from the balance.

use kehai_tracking::geometry::Point;

use super::gait::Sole;

/// The body may be so far from the middle of its feet, m, before one of them goes.
const LEAVES_M: f64 = 0.12;

/// How long a foot is in the air, s.
const SWING_S: f64 = 0.36;

/// A foot lands so much before the body, as time of walking, s: half of a step's.
const AHEAD_S: f64 = 0.2;

/// From the middle to a foot, m: hips.
const BESIDE_M: f64 = 0.09;

/// A body that turns farther than this on the spot sets its feet anew, rad.
const TURNS_RAD: f64 = 0.6;

#[derive(Clone, Copy, Debug)]
struct Foot {
    at: Point,
    heading_rad: f64,
    /// When it lands, s; before, it is in the air.
    lands_s: f64,
}

/// Two feet.
#[derive(Clone, Copy, Debug)]
pub struct Feet {
    /// The left and the right one.
    feet: [Foot; 2],
    last: (f64, Point),
    velocity: Point,
}

impl Feet {
    /// Under a body that stands at a place.
    #[must_use]
    pub fn new(at_s: f64, body: Point, heading_rad: f64) -> Self {
        let foot = |side: f64| Foot { at: beside(body, heading_rad, side), heading_rad, lands_s: at_s };
        Self { feet: [foot(1.0), foot(-1.0)], last: (at_s, body), velocity: Point::default() }
    }

    /// The body is here now; to be said at least a hundred times a second.
    pub fn follow(&mut self, at_s: f64, body: Point, heading_rad: f64) {
        let past_s = at_s - self.last.0;
        if past_s > 0.0 {
            let velocity = (body - self.last.1) * (1.0 / past_s);
            // Sway is not walking: over a tenth of a second.
            let new = (past_s / 0.1).min(1.0);
            self.velocity = self.velocity * (1.0 - new) + velocity * new;
        }
        self.last = (at_s, body);
        let [left, right] = self.feet;
        if left.lands_s > at_s || right.lands_s > at_s {
            return;
        }
        let off = body - (left.at + right.at) * 0.5;
        let turned_rad =
            (heading_rad - left.heading_rad).sin().abs().max((heading_rad - right.heading_rad).sin().abs());
        if off.length() < LEAVES_M && turned_rad < TURNS_RAD.sin() {
            return;
        }
        // The one that is farther behind.
        let behind = |foot: &Foot| (body - foot.at).dot(off);
        let goes = if off.length() < LEAVES_M {
            usize::from(right.lands_s < left.lands_s)
        } else {
            usize::from(behind(&right) > behind(&left))
        };
        let side = if goes == 0 { 1.0 } else { -1.0 };
        let lands = body + self.velocity * (SWING_S + AHEAD_S);
        self.feet[goes] = Foot { at: beside(lands, heading_rad, side), heading_rad, lands_s: at_s + SWING_S };
    }

    /// The soles on the floor.
    pub fn soles(&self) -> impl Iterator<Item = Sole> {
        let now_s = self.last.0;
        let down = self.feet.into_iter().filter(move |foot| foot.lands_s <= now_s);
        down.map(|foot| Sole { at: foot.at, ahead: Point::towards(foot.heading_rad) })
    }
}

fn beside(body: Point, heading_rad: f64, side: f64) -> Point {
    body + Point::towards(heading_rad).left() * (side * BESIDE_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(speed_mps: f64) -> (usize, usize, f64) {
        let mut feet = Feet::new(0.0, Point::default(), 0.0);
        let (mut both, mut one, mut farthest_m) = (0, 0, 0.0_f64);
        for hundredth in 1..=1000 {
            let at_s = f64::from(hundredth) * 0.01;
            let body = Point::new(speed_mps * at_s, 0.0);
            feet.follow(at_s, body, 0.0);
            let soles: Vec<Sole> = feet.soles().collect();
            match soles.len() {
                2 => both += 1,
                1 => one += 1,
                other => panic!("{other} soles"),
            }
            farthest_m = soles.iter().map(|sole| (sole.at - body).length()).fold(farthest_m, f64::max);
        }
        (both, one, farthest_m)
    }

    #[test]
    fn a_walker_is_on_one_foot_most_of_the_time_and_a_person_who_stands_on_both() {
        let (both, one, farthest_m) = walk(1.2);
        assert!((50..400).contains(&both), "{both} of {}", both + one);
        assert!(farthest_m < 0.6, "{farthest_m}");
        assert_eq!(walk(0.0), (1000, 0, BESIDE_M));
    }
}
