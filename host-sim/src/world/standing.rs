//! Standing people: they sway, and every few minutes they shift their weight.
//!
//! ```text
//!   offset   ▁▁▁▁▁▁▁▁╱▔▔▔▔▔▔▔▔▔▔▔╲▂▂▂▂▂▂▂▂     a new place within `size_m` and a new heading,
//!   time        2–5 min                        taken within 1.2 s
//! ```

use super::geometry::Point;
use super::random::Stream;

/// Time a shift takes.
const SHIFT_S: f64 = 1.2;
/// Largest turn of the chest to either side.
const TURN_RAD: f64 = 0.3;
/// Shifts are computed for at most a day.
const LONGEST_S: f64 = 86_400.0;

/// Shifts of weight, in order of time.
#[derive(Clone, Debug, Default)]
pub struct Shifts(Vec<Shift>);

#[derive(Clone, Copy, Debug)]
struct Shift {
    at_s: f64,
    offset: Point,
    turn_rad: f64,
}

impl Shifts {
    /// Shifts by up to `size_m`, between the shortest and the longest of `every_s` apart, until `until_s`.
    #[must_use]
    pub fn new(size_m: f64, every_s: [f64; 2], until_s: f64, stream: &mut Stream) -> Self {
        let mut shifts = Vec::new();
        let mut at_s = 0.0;
        while size_m > 0.0 && at_s < until_s.min(LONGEST_S) {
            at_s += stream.between(every_s[0], every_s[1]).max(SHIFT_S);
            let offset = Point::new(stream.between(-size_m, size_m), stream.between(-size_m, size_m));
            shifts.push(Shift { at_s, offset, turn_rad: stream.between(-TURN_RAD, TURN_RAD) });
        }
        Self(shifts)
    }

    /// Offset and turn at `time_s`.
    #[must_use]
    pub fn at(&self, time_s: f64) -> (Point, f64) {
        let next = self.0.partition_point(|shift| shift.at_s <= time_s);
        let Some(now) = next.checked_sub(1).and_then(|index| self.0.get(index)) else {
            return (Point::default(), 0.0);
        };
        let rest = Shift { at_s: 0.0, offset: Point::default(), turn_rad: 0.0 };
        let before = next.checked_sub(2).and_then(|index| self.0.get(index)).unwrap_or(&rest);
        let share = ((time_s - now.at_s) / SHIFT_S).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        let offset = before.offset + (now.offset - before.offset) * share;
        (offset, before.turn_rad + (now.turn_rad - before.turn_rad) * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::random::Purpose;

    #[test]
    fn weight_is_shifted_every_few_minutes_without_a_jump() {
        let mut stream = Stream::new(1, Purpose::Walk, [0, 0]);
        let shifts = Shifts::new(0.05, [120.0, 300.0], 3600.0, &mut stream);
        assert!((12..=30).contains(&shifts.0.len()), "{}", shifts.0.len());
        let mut before = shifts.at(0.0);
        let mut way_m = 0.0;
        for tick in 1..36_000 {
            let now = shifts.at(f64::from(tick) * 0.1);
            let moved_m = (now.0 - before.0).length();
            assert!(moved_m < 0.02 && now.0.x.abs() <= 0.05 && now.0.y.abs() <= 0.05, "{now:?}");
            way_m += moved_m;
            before = now;
        }
        assert!(way_m > 0.3, "{way_m}");
    }
}
