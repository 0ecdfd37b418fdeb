//! Where a walker and the soles are: both follow from how far it has walked.
//!
//! ```text
//!        ▭           ▭             soles 0.26 × 0.10 m, beside the way, about a step apart
//!   ─────────✕──────────────▶      the middle of the body; one or two soles are on the floor
//!   ▭           ▭
//! ```

use kehai_emulator::sensfloor;
use kehai_tracking::geometry::Point;

use crate::world::random::{Purpose, Stream};

/// Length and width of a sole, m.
pub const SOLE_M: (f64, f64) = (0.26, 0.10);

/// How a person sets the feet. What differs from person to person is drawn once, the rest at each footfall.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Habit {
    /// Between two steps, m.
    pub step_m: f64,
    /// From the way to the middle of a sole, m.
    pub beside_m: f64,
    /// A sole is down while the body is less than so many steps before or behind it; half of a step and more, so that both
    /// are down for a time.
    pub down_steps: f64,
    /// How far a footfall is off along the way and across it, m, one sigma.
    pub scatter_m: (f64, f64),
    /// What the footfalls are drawn by.
    pub seed: u64,
}

impl Habit {
    /// A person's, by the ranges in which grown people walk slowly: steps of 0.45 to 0.65 m, 6 to 14 cm wide, both feet down
    /// for 10 to 30 % of a step; footfalls scatter by 3 cm along the way and 2 cm across.
    #[must_use]
    pub fn random(random: &mut Stream) -> Self {
        Self {
            step_m: random.between(0.45, 0.65),
            beside_m: random.between(0.03, 0.07),
            down_steps: random.between(0.55, 0.65),
            scatter_m: (0.03, 0.02),
            seed: (random.uniform() * 1e15) as u64,
        }
    }

    /// Where a footfall is set: how far along the way from the body's place after so many steps, and how far to the left, m.
    #[must_use]
    pub fn footfall(&self, step: f64) -> (f64, f64) {
        let mut random = Stream::new(self.seed, Purpose::Walk, [0xf007, (step as i64).unsigned_abs()]);
        let (along_m, aside_m) = (random.normal() * self.scatter_m.0, random.normal() * self.scatter_m.1);
        let side_m = if step.rem_euclid(2.0) < 1.0 { self.beside_m } else { -self.beside_m };
        (along_m, side_m + aside_m)
    }
}

/// A way.
#[derive(Clone, Debug, PartialEq)]
pub enum Way {
    /// Between two places, to and fro.
    ToAndFro(Point, Point),
    /// Round a polygon.
    Round(Vec<Point>),
}

/// A sole on the floor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sole {
    /// Its middle.
    pub at: Point,
    /// Where its toes point, of length 1.
    pub ahead: Point,
}

impl Sole {
    /// As an emulated floor feels it whose corner is the origin.
    #[must_use]
    pub const fn felt(&self) -> sensfloor::Sole {
        sensfloor::Sole { at: (self.at.x, self.at.y), ahead: (self.ahead.x, self.ahead.y) }
    }
}

/// A walker: a way, and how far on it is at time 0, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Walker {
    /// The way.
    pub way: Way,
    /// At time 0, m.
    pub begun_m: f64,
    /// m/s.
    pub speed_mps: f64,
    /// How it sets its feet.
    pub habit: Habit,
}

impl Way {
    /// The place after so many metres, and where it goes on to.
    #[must_use]
    pub fn at(&self, walked_m: f64) -> (Point, Point) {
        match self {
            Self::ToAndFro(from, to) => {
                let length_m = (*to - *from).length();
                let ahead = (*to - *from) * (1.0 / length_m);
                let on_m = walked_m.rem_euclid(2.0 * length_m);
                if on_m < length_m {
                    (*from + ahead * on_m, ahead)
                } else {
                    (*to + ahead * (length_m - on_m), ahead * -1.0)
                }
            }
            Self::Round(corners) => {
                let sides = || corners.iter().zip(corners.iter().cycle().skip(1));
                let round_m: f64 = sides().map(|(from, to)| (*to - *from).length()).sum();
                let mut on_m = walked_m.rem_euclid(round_m);
                let mut last = (Point::default(), Point::new(1.0, 0.0));
                for (from, to) in sides() {
                    let side = *to - *from;
                    let ahead = side * (1.0 / side.length());
                    last = (*from + ahead * on_m.min(side.length()), ahead);
                    if on_m < side.length() {
                        break;
                    }
                    on_m -= side.length();
                }
                last
            }
        }
    }
}

impl Way {
    /// The side to which even steps go. At the ends of a way to and fro a walker turns on one more step, so that the soles go
    /// on to alternate across it.
    fn beside(&self, ahead: Point) -> Point {
        match self {
            Self::ToAndFro(from, to) => (*to - *from).left() * (1.0 / (*to - *from).length()),
            Self::Round(_) => ahead.left(),
        }
    }
}

impl Walker {
    /// Where the middle of the body is, and where it goes on to.
    #[must_use]
    pub fn at(&self, at_s: f64) -> (Point, Point) {
        self.way.at(self.walked_m(at_s))
    }

    /// The soles on the floor.
    pub fn soles(&self, at_s: f64) -> impl Iterator<Item = Sole> {
        let walked_m = self.walked_m(at_s);
        let Habit { step_m, down_steps, .. } = self.habit;
        let step = (walked_m / step_m).round();
        let near = [step - 1.0, step, step + 1.0].into_iter();
        let down = near.filter(move |step| (walked_m - step * step_m).abs() < down_steps * step_m);
        down.map(move |step| {
            let (along_m, left_m) = self.habit.footfall(step);
            let (at, ahead) = self.way.at(step * step_m + along_m);
            Sole { at: at + self.way.beside(ahead) * left_m, ahead }
        })
    }

    fn walked_m(&self, at_s: f64) -> f64 {
        self.begun_m + self.speed_mps * at_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_turns_at_its_ends_and_at_its_corners() {
        let way = Way::ToAndFro(Point::new(0.0, 0.0), Point::new(2.0, 0.0));
        assert_eq!(way.at(0.5), (Point::new(0.5, 0.0), Point::new(1.0, 0.0)));
        assert_eq!(way.at(3.5), (Point::new(0.5, 0.0), Point::new(-1.0, 0.0)));
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point::new(x, y));
        let square = Way::Round(square.to_vec());
        assert_eq!(square.at(1.25), (Point::new(1.0, 0.25), Point::new(0.0, 1.0)));
        assert_eq!(square.at(4.5).0, Point::new(0.5, 0.0));
    }

    #[test]
    fn one_or_two_soles_are_down_and_the_body_is_between_or_beside_them() {
        let way = Way::ToAndFro(Point::new(0.0, 0.0), Point::new(100.0, 0.0));
        let habit = Habit { step_m: 0.55, beside_m: 0.05, down_steps: 0.6, scatter_m: (0.0, 0.0), seed: 1 };
        let walker = Walker { way, begun_m: 1.0, speed_mps: 1.0, habit };
        let mut both = 0;
        for tenth in 0..200 {
            let at_s = f64::from(tenth) * 0.1;
            let soles: Vec<Sole> = walker.soles(at_s).collect();
            assert!((1..=2).contains(&soles.len()));
            both += usize::from(soles.len() == 2);
            let (body, _) = walker.at(at_s);
            assert!(soles.iter().all(|sole| (sole.at - body).length() < 0.35), "{soles:?}");
        }
        assert!((30..60).contains(&both), "a fifth of the time on both feet: {both}");
    }
}
