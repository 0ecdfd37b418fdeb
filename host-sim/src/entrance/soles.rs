//! Where the soles of people at an entrance are: each footfall lies beside the way that its person walks.
//!
//! ```text
//!       ▭           ▭            footfall k: where the body is after k steps, the even ones to the left
//!   ─────────○──────────▶        on the floor while the body is less than 0.6 steps before or behind it;
//!   ▭            ▭               of a standing person both
//! ```

use std::collections::BTreeMap;

use super::stack::{STATURE_M, STRIDE_M};
use super::walk::{Moment, Walk};
use crate::floor::gait::{Habit, Sole};
use crate::world::geometry::Point;
use crate::world::random::{Purpose, Stream};

/// A person slower than this stands, m/s.
const STANDS_MPS: f64 = 0.2;

/// The way of a person: how far it has walked, where it was then, and where it looked.
type Way = Vec<(f64, Point, Point)>;

/// The footfalls of a run.
#[derive(Clone, Debug)]
pub struct Soles {
    seed: u64,
    ways: BTreeMap<u16, Way>,
}

impl Soles {
    /// Those of a walk.
    #[must_use]
    pub fn new(walk: &Walk, seed: u64) -> Self {
        let mut ways: BTreeMap<u16, Way> = BTreeMap::new();
        for one in walk.moments().flatten() {
            ways.entry(one.person).or_default().push((one.walked_m, one.at, one.ahead));
        }
        Self { seed, ways }
    }

    /// The soles of a person that are on the floor.
    #[must_use]
    pub fn of(&self, walker: &Moment) -> Vec<Sole> {
        let Some(way) = self.ways.get(&walker.person) else { return Vec::new() };
        let scale = walker.stature_m / STATURE_M;
        let person = u64::from(walker.person);
        let habit = Habit::random(&mut Stream::new(self.seed, Purpose::Walk, [0xf100, person]));
        let step_m = 0.5 * STRIDE_M * scale;
        let walked = walker.walked_m / step_m;
        let down = if walker.speed_mps < STANDS_MPS { 1.0 } else { habit.down_steps };
        let steps = [walked.floor(), walked.floor() + 1.0].into_iter();
        let steps = steps.filter(|step| (walked - step).abs() < down);
        steps.map(|step| footfall(way, step, step_m, &habit)).collect()
    }
}

fn footfall(way: &Way, step: f64, step_m: f64, habit: &Habit) -> Sole {
    let (along_m, left_m) = habit.footfall(step);
    let (at, ahead) = place(way, step * step_m);
    Sole { at: at + ahead * along_m + ahead.left() * left_m, ahead }
}

/// Where the body is after so many metres; beyond the ends of the way straight on.
fn place(way: &Way, walked_m: f64) -> (Point, Point) {
    let after = way.partition_point(|(metres, ..)| *metres < walked_m);
    match (after.checked_sub(1).and_then(|before| way.get(before)), way.get(after)) {
        (Some(&(from_m, from, ahead)), Some(&(to_m, to, _))) => {
            let share = (walked_m - from_m) / (to_m - from_m).max(1e-9);
            (from + (to - from) * share, ahead)
        }
        (Some(&(metres, at, ahead)), None) | (None, Some(&(metres, at, ahead))) => {
            (at + ahead * (walked_m - metres), ahead)
        }
        (None, None) => (Point::default(), Point::new(1.0, 0.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::FRAMES;
    use super::*;

    #[test]
    fn soles_stay_where_they_are_and_a_body_is_never_without_one() {
        let walk = Walk::lasting(1, FRAMES);
        let soles = Soles::new(&walk, 1);
        let mut last: BTreeMap<u16, Vec<Sole>> = BTreeMap::new();
        let (mut kept, mut all) = (0, 0);
        for number in 0..4000 {
            for walker in walk.at(f64::from(number) * 0.04) {
                let now = soles.of(&walker);
                assert!((1..=2).contains(&now.len()), "{walker:?}");
                for sole in &now {
                    assert!((sole.at - walker.at).length() < 0.8, "{walker:?} {sole:?}");
                }
                let before = last.insert(walker.person, now.clone()).unwrap_or_default();
                kept += before.iter().filter(|sole| now.contains(sole)).count();
                all += before.len();
            }
        }
        assert!(all > 3000 && kept * 10 > all * 8, "{kept} of {all}");
    }
}
