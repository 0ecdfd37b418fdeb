//! Doors: leaves that slide or swing open and shut, seen by the sensors and walked through by people.
//!
//! ```text
//!   shut   ├──────┤            sliding: the leaf moves along `slide`
//!   open         ├──────┤      swinging: it turns by `swing_deg` about the first end of its line
//! ```

use super::crowd::STEP_S;
use super::geometry::{Outline, Point};
use serde::Deserialize;
use std::sync::Arc;

use parking_lot::Mutex;

/// A door as a scene describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Door {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// The leaf when shut.
    pub line: [[f64; 2]; 2],
    /// How far the leaf moves when it opens, x and y.
    #[serde(default)]
    pub slide: [f64; 2],
    /// How far it turns about its first end when it opens.
    #[serde(default)]
    pub swing_deg: f64,
    /// When it begins to open; a gathering opens the doors of its scene itself.
    pub opens_s: Option<f64>,
    /// When it begins to shut.
    pub closes_s: Option<f64>,
    /// Period of the whole cycle, s; by default it happens once.
    pub every_s: Option<f64>,
    /// How long opening and shutting take.
    #[serde(default = "one_second")]
    pub takes_s: f64,
    /// Reflectance of the leaf.
    #[serde(default = "painted")]
    pub reflectance: f64,
}

const fn one_second() -> f64 {
    1.0
}

const fn painted() -> f64 {
    0.53
}

impl Door {
    /// How far it is open at `time_s`, 0 to 1.
    #[must_use]
    pub fn open_share(&self, time_s: f64) -> f64 {
        let first_s = self.opens_s.unwrap_or(0.0);
        let time_s = match self.every_s {
            Some(every_s) if time_s > first_s => first_s + (time_s - first_s) % every_s,
            _ => time_s,
        };
        let since = |begin_s: Option<f64>| {
            let passed_s = begin_s.map_or(f64::NEG_INFINITY, |begin_s| time_s - begin_s);
            (passed_s / self.takes_s.max(1e-3)).clamp(0.0, 1.0)
        };
        (since(self.opens_s) - since(self.closes_s)).max(0.0)
    }

    /// Where the leaf is at `time_s`.
    #[must_use]
    pub fn outline(&self, time_s: f64) -> Outline {
        self.outline_at(self.open_share(time_s))
    }

    /// Where the leaf is when it is open by `share`, 0 to 1.
    #[must_use]
    pub fn outline_at(&self, share: f64) -> Outline {
        let [hinge, end] = self.line.map(Point::from);
        let moved = Point::from(self.slide) * share;
        let turn = Point::towards((self.swing_deg * share).to_radians());
        let leaf = end - hinge;
        let leaf = turn * leaf.x + turn.left() * leaf.y;
        Outline::Segment(hinge + moved, hinge + moved + leaf)
    }

    /// Checks the description.
    ///
    /// # Errors
    /// One sentence without the door's name.
    pub fn check(&self) -> Result<(), String> {
        let [from, to] = self.line.map(Point::from);
        if (to - from).length() < 0.05 {
            return Err(String::from("line must be at least 0.05 m long"));
        }
        if !(self.takes_s > 0.0 && self.takes_s <= 60.0) {
            return Err(format!("takes_s must be more than 0 and at most 60, is {}", self.takes_s));
        }
        if !(0.0..=1.0).contains(&self.reflectance) {
            return Err(String::from("reflectance must be between 0 and 1"));
        }
        if self.closes_s.is_some_and(|closes_s| self.opens_s.is_none_or(|opens_s| closes_s < opens_s)) {
            return Err(String::from("closes_s needs an earlier opens_s"));
        }
        if self.every_s.is_some_and(|every_s| !(1.0..=86_400.0).contains(&every_s)) {
            return Err(String::from("every_s must be between 1 and 86400"));
        }
        Ok(())
    }
}

/// A door whose leaf is moved while the simulation runs, some time ahead of the sensors: it obeys a real lock.
#[derive(Clone, Debug)]
pub struct LiveDoor {
    /// The door.
    pub door: Door,
    /// How far it is open, every [`STEP_S`] from time 0 on.
    pub shares: Arc<Mutex<Vec<f64>>>,
}

impl LiveDoor {
    /// Where its leaf is at `time_s`.
    #[must_use]
    pub fn outline(&self, time_s: f64) -> Outline {
        let shares = self.shares.lock();
        let index = (time_s.max(0.0) / STEP_S) as usize;
        let share = shares.get(index).or(shares.last()).copied().unwrap_or(0.0);
        self.door.outline_at(share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door(slide: [f64; 2], swing_deg: f64) -> Door {
        Door {
            name: String::new(),
            line: [[0.0, 1.0], [0.9, 1.0]],
            slide,
            swing_deg,
            opens_s: Some(10.0),
            closes_s: Some(20.0),
            every_s: None,
            takes_s: 2.0,
            reflectance: 0.7,
        }
    }

    #[test]
    fn a_door_opens_in_its_time_and_shuts_again() {
        let door = door([0.0, 0.0], 90.0);
        let shares: Vec<f64> =
            [0.0, 10.0, 11.0, 12.0, 19.0, 21.0, 30.0].iter().map(|time_s| door.open_share(*time_s)).collect();
        assert_eq!(shares, [0.0, 0.0, 0.5, 1.0, 1.0, 0.5, 0.0]);
        let again = Door { every_s: Some(60.0), ..door };
        assert_eq!([9.0, 71.0, 131.0, 145.0].map(|time_s| again.open_share(time_s)), [0.0, 0.5, 0.5, 0.0]);
    }

    #[test]
    fn sliding_leaves_slide_and_swinging_leaves_turn_about_their_hinge() {
        let ends = |door: Door| match door.outline(15.0) {
            Outline::Segment(from, to) => (from, to),
            Outline::Ellipse { .. } | Outline::Superellipse { .. } => unreachable!("a leaf is straight"),
        };
        let (from, to) = ends(door([0.9, 0.0], 0.0));
        assert_eq!((from, to), (Point::new(0.9, 1.0), Point::new(1.8, 1.0)));
        let (from, to) = ends(door([0.0, 0.0], 90.0));
        assert_eq!(from, Point::new(0.0, 1.0));
        assert!((to - Point::new(0.0, 1.9)).length() < 1e-12);
    }
}
