//! Where the middle of a walker is, from steps on a floor.
//!
//! ```text
//!   panels down ─▶ patches ─▶ feet, each from when it lands until it lifts ─▶ of two in a row the middle
//!
//!        ▭    ·    ▭             a body passes over a foot in the middle of the time that it is down;
//!   ────────× · ×───────▶        of two feet in a row the breadth of the hips cancels: × is on the way of the body
//!   ▭         ▭         ▭
//! ```
//!
//! A walker lands one foot before the other lifts, so a foot that was set beside the floor leaves a gap: nothing is said across
//! it. Between one middle and the next the walker is taken to go straight.

use crate::floor::{Patch, Plan, Reading, patches};
use crate::geometry::{Point, Pose};

use super::limits::SLOT_S;

/// Two feet of one person are no farther apart, m: a long step, toe to heel.
const STEP_M: f64 = 0.9;

/// From one reading to the next a patch under one foot moves less than this, m: by the roll from heel to toe.
const ROLLS_M: f64 = 0.15;

/// A foot that is down for longer stands or turns, s: of a slow walk's two steps of 0.75 s each it is down for 60 %.
const STANDS_S: f64 = 0.9;

/// From this speed on a person walks, m/s.
const WALKS_M_S: f64 = 0.4;

/// A panel is down, or up, for half a period on average before it is read, and is believed from the second reading on: at 9 Hz
/// that is so late, s.
const LATE_S: f64 = 1.5 / 9.0;

/// A foot has lifted and another may have landed in so long a silence, s.
const SILENT_S: f64 = 0.5;

/// What a floor shows now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    /// No feet.
    Nobody,
    /// Feet that one person may have.
    One,
    /// Feet too far apart for that.
    Several,
}

/// A foot on the floor.
#[derive(Clone, Debug)]
struct Foot {
    /// Where it was in the newest reading.
    at: Point,
    /// Sum of where it was in all.
    sum: Point,
    readings: u32,
    /// When it landed, and when it was up again, s.
    down_s: (f64, f64),
    /// No panel at the edge was under it: all of it is on the floor.
    is_whole: bool,
}

/// The middle of a walker at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Middle {
    /// Where, m.
    pub at: Point,
    /// When, s.
    pub at_s: f64,
    /// It walks on; else it stands, turns, or begins to walk.
    pub walks: bool,
}

/// The steps on one floor.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    /// Time of the newest reading, s.
    read_s: Option<f64>,
    down: Vec<Foot>,
    /// The foot that lifted last.
    last: Option<Foot>,
    /// The middle of that and the one before.
    middle: Option<Middle>,
}

impl Steps {
    /// Takes the next reading. Says what the floor shows, and adds the walker's middles that are known by now, in the floor's own
    /// frame, one a slot. A reading that comes after a newer one is not used; after a silence all steps begin anew.
    pub fn read(&mut self, reading: &Reading, middles: &mut Vec<Middle>) -> Shows {
        match self.read_s {
            Some(read_s) if reading.at_s <= read_s => {
                return if self.down.is_empty() { Shows::Nobody } else { Shows::One };
            }
            Some(read_s) if reading.at_s - read_s > SILENT_S => *self = Self::default(),
            _ => {}
        }
        self.read_s = Some(reading.at_s);
        let plan = Plan { corner: Pose { at: Point::default(), yaw_rad: 0.0 }, ..reading.plan };
        let mut down = reading.down;
        reading.faulty.iter().for_each(|faulty| down.set(usize::from(faulty.panel), false));
        let patches = patches(&plan, &down);
        let apart = |one: &Patch| patches.iter().any(|other| (other.middle - one.middle).length() > STEP_M);
        if patches.iter().any(apart) {
            *self = Self { read_s: self.read_s, ..Self::default() };
            return Shows::Several;
        }
        let mut before = std::mem::take(&mut self.down);
        for patch in &patches {
            let far_m = |foot: &Foot| (foot.at - patch.middle).length();
            let nearest = (0..before.len()).min_by(|a, b| far_m(&before[*a]).total_cmp(&far_m(&before[*b])));
            let same = nearest.filter(|index| far_m(&before[*index]) < ROLLS_M);
            let foot = same.map(|index| before.swap_remove(index));
            self.down.push(Foot::on(foot, patch, &plan, reading.at_s));
        }
        before.sort_by(|a, b| a.down_s.0.total_cmp(&b.down_s.0));
        for foot in before {
            self.lifted(Foot { down_s: (foot.down_s.0, reading.at_s), ..foot }, middles);
        }
        if patches.is_empty() { Shows::Nobody } else { Shows::One }
    }

    fn lifted(&mut self, foot: Foot, middles: &mut Vec<Middle>) {
        let before = self.last.replace(foot.clone());
        let from = self.middle.take();
        let Some(before) = before else { return };
        let is_next = before.down_s.0 < foot.down_s.0 && foot.down_s.0 <= before.down_s.1;
        if !(is_next && before.is_whole && foot.is_whole) {
            return;
        }
        let walks = before.walks() && foot.walks();
        let at_s = 0.5 * (before.over_s() + foot.over_s());
        let to = Middle { at: (before.place() + foot.place()) * 0.5, at_s, walks };
        if let Some(from) = from.filter(|from| from.at_s < to.at_s) {
            let speed = (to.at - from.at) * (1.0 / (to.at_s - from.at_s));
            let walks = from.walks && to.walks && speed.length() >= WALKS_M_S;
            let slots = ((from.at_s / SLOT_S).floor() as i64 + 1)..=((to.at_s / SLOT_S).floor() as i64);
            middles.extend(slots.map(|slot| {
                let at_s = slot as f64 * SLOT_S;
                Middle { at: from.at + speed * (at_s - from.at_s), at_s, walks }
            }));
        }
        self.middle = Some(to);
    }
}

impl Foot {
    /// A foot that was there before, or lands.
    fn on(before: Option<Self>, patch: &Patch, plan: &Plan, at_s: f64) -> Self {
        let (width_m, depth_m) =
            (f64::from(plan.columns) * plan.pitch_m, f64::from(plan.rows) * plan.pitch_m);
        let is_inside = |panel: &Point| {
            let inside = |metres: f64, size_m: f64| (plan.pitch_m..size_m - plan.pitch_m).contains(&metres);
            inside(panel.x, width_m) && inside(panel.y, depth_m)
        };
        let is_whole = patch.panels.iter().all(is_inside);
        let new = Self {
            at: patch.middle,
            sum: Point::default(),
            readings: 0,
            down_s: (at_s, f64::INFINITY),
            is_whole: true,
        };
        let foot = before.unwrap_or(new);
        Self {
            at: patch.middle,
            sum: foot.sum + patch.middle,
            readings: foot.readings + 1,
            is_whole: foot.is_whole && is_whole,
            ..foot
        }
    }

    fn place(&self) -> Point {
        self.sum * (1.0 / f64::from(self.readings.max(1)))
    }

    /// When the body passes over it.
    fn over_s(&self) -> f64 {
        0.5 * (self.down_s.0 + self.down_s.1) - LATE_S
    }

    fn walks(&self) -> bool {
        self.down_s.1 - self.down_s.0 < STANDS_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::floor::Bits;

    const PLAN: Plan = Plan {
        corner: Pose { at: Point { x: 5.0, y: 5.0 }, yaw_rad: 1.0 },
        columns: 30,
        rows: 30,
        pitch_m: 0.08,
    };

    /// Half a second a step, each foot down for 1.2 steps.
    const STEP_S: f64 = 0.5;

    /// What is said of a person whose body is at `body` by time, on the floor that is read for 4 s.
    fn walked(body: impl Fn(f64) -> Point) -> (Vec<Middle>, Vec<Shows>) {
        let (mut steps, mut middles, mut shown) = (Steps::default(), Vec::new(), Vec::new());
        for number in 0..36 {
            let at_s = f64::from(number) / 9.0;
            let mut down = Bits::default();
            for step in 0..9 {
                let over_s = f64::from(step) * STEP_S;
                let side_m = if step % 2 == 0 { 0.09 } else { -0.09 };
                let foot = body(over_s) + Point::new(0.0, side_m);
                if (at_s - over_s).abs() < 0.6 * STEP_S {
                    press(&mut down, foot);
                }
            }
            // As late as it is believed.
            let reading = Reading { floor: 0, plan: PLAN, at_s: at_s + 1.0 / 9.0, down, faulty: Vec::new() };
            shown.push(steps.read(&reading, &mut middles));
        }
        (middles, shown)
    }

    fn press(down: &mut Bits, foot: Point) {
        let own = Plan { corner: Pose { at: Point::default(), yaw_rad: 0.0 }, ..PLAN };
        for panel in 0..own.panels() {
            let off = own.middle(panel) - foot;
            if off.x.abs() < 0.13 && off.y.abs() < 0.05 {
                down.set(panel, true);
            }
        }
    }

    #[test]
    fn the_middle_of_a_walker_is_between_the_feet_one_a_slot() {
        let body = |at_s: f64| Point::new(-0.5 + 0.9 * at_s, 1.2);
        let (middles, shown) = walked(body);
        assert!((10..25).contains(&middles.len()), "{middles:?}");
        for middle in &middles {
            let off = middle.at - body(middle.at_s);
            assert!(middle.walks && off.x.abs() < 0.08 && off.y.abs() < 0.03, "{middle:?} {off:?}");
        }
        let slots = middles.windows(2).all(|two| (two[1].at_s - two[0].at_s - SLOT_S).abs() < 1e-9);
        assert!(slots && !shown.contains(&Shows::Several), "{middles:?}");
    }

    #[test]
    fn a_late_reading_is_not_used_and_no_foot_is_down_across_a_silence() {
        let (mut steps, mut middles) = (Steps::default(), Vec::new());
        let mut read = |at_s: f64, foot: Option<Point>| {
            let mut down = Bits::default();
            foot.into_iter().for_each(|foot| press(&mut down, foot));
            steps.read(&Reading { floor: 0, plan: PLAN, at_s, down, faulty: Vec::new() }, &mut middles)
        };
        assert_eq!(read(1.0, Some(Point::new(0.5, 1.2))), Shows::One);
        assert_eq!(read(0.9, None), Shows::One, "older");
        assert_eq!(read(1.1, Some(Point::new(0.5, 1.2))), Shows::One);
        assert_eq!(read(2.0, Some(Point::new(0.5, 1.2))), Shows::One);
        assert_eq!(steps.down[0].down_s.0, 2.0, "another foot, or lifted and set again");
    }

    #[test]
    fn a_person_who_walks_with_one_foot_beside_the_floor_says_nothing() {
        let (middles, shown) = walked(|at_s| Point::new(-0.5 + 0.9 * at_s, 0.02));
        assert_eq!((middles, shown.contains(&Shows::One)), (Vec::new(), true));
    }

    #[test]
    fn a_person_who_stands_does_not_walk_and_two_are_several() {
        let (middles, _) = walked(|at_s| Point::new(1.2 + 0.1 * at_s, 1.2));
        assert!(middles.len() > 5 && middles.iter().all(|middle| !middle.walks), "{middles:?}");
        let mut down = Bits::default();
        press(&mut down, Point::new(0.5, 0.5));
        press(&mut down, Point::new(2.0, 0.5));
        let reading = Reading { floor: 0, plan: PLAN, at_s: 1.0, down, faulty: Vec::new() };
        assert_eq!(Steps::default().read(&reading, &mut Vec::new()), Shows::Several);
    }
}
