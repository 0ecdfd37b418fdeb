//! Which panels soles press, as the floor's electronics read them.
//!
//! ```text
//!   ┌───┬───┐
//!   │ ▟█│█▙ │      down: a sixth of it, or more, is covered
//!   └───┴───┘
//! ```

use kehai::floor::{Bits, Floor};
use kehai_tracking::floor::{Plan, Reading};
use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor as Mat;

use super::gait::{SOLE_M, Sole};

/// Side of a panel of paper B's floor, m.
pub const PITCH_M: f64 = 0.08;

/// A panel is down when so much of it is covered.
const DOWN_SHARE: f64 = 1.0 / 6.0;

/// Places along a side of a panel that are looked at.
const GRID: usize = 8;

/// What is broken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Broken {
    /// Panels that are always down.
    pub stuck: Vec<usize>,
    /// Panels that are never down.
    pub dead: Vec<usize>,
}

/// The floor's reading while these soles are on it.
#[must_use]
pub fn reading(plan: &Plan, soles: &[Sole], broken: &Broken) -> Bits {
    let mut bits = Bits::default();
    for panel in 0..plan.panels() {
        let middle = plan.middle(panel);
        let far_m = 0.5 * (SOLE_M.0 + SOLE_M.1) + plan.pitch_m;
        let near = soles.iter().filter(|sole| (sole.at - middle).length() < far_m);
        let near: Vec<&Sole> = near.collect();
        let down = !near.is_empty() && covered(plan, middle, &near) >= DOWN_SHARE;
        bits.set(panel, (down || broken.stuck.contains(&panel)) && !broken.dead.contains(&panel));
    }
    bits
}

/// A floor of a site whose panels all work, and its state.
#[derive(Clone, Debug)]
pub struct FloorReader {
    number: usize,
    plan: Plan,
    floor: Floor,
}

impl FloorReader {
    /// One for each floor of a site, by its number.
    #[must_use]
    pub fn all(site: &Site) -> Vec<Self> {
        let one = |(number, mat): (usize, &Mat)| {
            Some(Self { number, plan: Plan::from(mat), floor: Floor::new(mat.columns, mat.rows)? })
        };
        site.floors.iter().enumerate().filter_map(one).collect()
    }

    /// Reads it while these soles are on it.
    pub fn read(&mut self, soles: &[Sole], at_s: f64) -> Reading {
        let bits = reading(&self.plan, soles, &Broken::default());
        // As many bits as the floor has panels.
        let _ = self.floor.read(bits.bytes(self.plan.panels()));
        let down = self.floor.pressed();
        Reading { floor: self.number, plan: self.plan, at_s, down, faulty: Vec::new() }
    }
}

/// The share of a panel that soles cover.
fn covered(plan: &Plan, middle: Point, soles: &[&Sole]) -> f64 {
    let along = Point::towards(plan.corner.yaw_rad) * plan.pitch_m;
    let offset = |index: usize| (index as f64 + 0.5) / GRID as f64 - 0.5;
    let places = (0..GRID).flat_map(|row| (0..GRID).map(move |column| (row, column)));
    let under = places.filter(|&(row, column)| {
        let at = middle + along * offset(column) + along.left() * offset(row);
        soles.iter().any(|sole| {
            let from = at - sole.at;
            from.dot(sole.ahead).abs() < 0.5 * SOLE_M.0 && from.dot(sole.ahead.left()).abs() < 0.5 * SOLE_M.1
        })
    });
    under.count() as f64 / (GRID * GRID) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::geometry::Pose;

    fn plan() -> Plan {
        let corner = Pose { at: Point::default(), yaw_rad: 0.0 };
        Plan { corner, columns: 10, rows: 10, pitch_m: 0.08 }
    }

    #[test]
    fn a_sole_presses_the_panels_of_which_it_covers_a_sixth() {
        let ahead = Point::new(1.0, 0.0);
        // From 0.27 to 0.53 along x: 0.05 m of the fourth panel, and 0.05 m of the seventh; 0.35 to 0.45 across.
        let sole = Sole { at: Point::new(0.40, 0.40), ahead };
        let bits = reading(&plan(), &[sole], &Broken::default());
        let down: Vec<usize> = (0..100).filter(|panel| bits.get(*panel)).collect();
        assert_eq!(down, [43, 44, 45, 46, 53, 54, 55, 56]);
        // From 0.39 to 0.49 across: 0.01 m of a panel is an eighth, not enough.
        let beside = Sole { at: Point::new(0.40, 0.44), ahead };
        let bits = reading(&plan(), &[beside], &Broken::default());
        assert_eq!((0..100).filter(|panel| bits.get(*panel)).count(), 4, "row 5 only");
    }

    #[test]
    fn broken_panels_say_what_they_always_say() {
        let broken = Broken { stuck: vec![3], dead: vec![44] };
        let sole = Sole { at: Point::new(0.40, 0.40), ahead: Point::new(1.0, 0.0) };
        let bits = reading(&plan(), &[sole], &broken);
        assert!(bits.get(3) && !bits.get(44) && bits.get(45));
    }
}
