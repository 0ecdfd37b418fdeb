//! Everything that moves and is no person: doors, curtains, fans, and things that people carry.
//!
//! ```text
//!   curtain   ├~~~~~~~~~┤    fixed at both ends, swaying most in the middle
//!   fan         ──◉──        a flat head that turns to and fro
//! ```

use super::door::{Door, LiveDoor};
use super::geometry::{Outline, Point};
use super::placed::Placed;
use super::prop::Prop;
use serde::Deserialize;
use std::f64::consts::{PI, TAU};

/// A curtain that sways, as a scene describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curtain {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Its two ends.
    pub line: [[f64; 2]; 2],
    /// How far its middle sways to either side.
    #[serde(default = "palm")]
    pub sway_m: f64,
    /// Time of one sway.
    #[serde(default = "four_seconds")]
    pub period_s: f64,
    /// When it begins to sway.
    #[serde(default)]
    pub from_s: f64,
    /// Reflectance: the share of the light that comes back.
    #[serde(default = "half")]
    pub reflectance: f64,
}

/// A fan that turns to and fro, as a scene describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fan {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Its axis.
    pub at: [f64; 2],
    /// Heading in the middle of its swing.
    #[serde(default)]
    pub yaw_deg: f64,
    /// How far it turns to either side.
    #[serde(default = "half_right")]
    pub swing_deg: f64,
    /// Time of one turn to and fro.
    #[serde(default = "eight_seconds")]
    pub period_s: f64,
    /// Width of its head, which hangs before its axis.
    #[serde(default = "forearm")]
    pub width_m: f64,
    /// When it is switched on.
    #[serde(default)]
    pub from_s: f64,
    /// Reflectance: the share of the light that comes back.
    #[serde(default = "half")]
    pub reflectance: f64,
}

const fn palm() -> f64 {
    0.1
}

const fn four_seconds() -> f64 {
    4.0
}

const fn eight_seconds() -> f64 {
    8.0
}

const fn half() -> f64 {
    0.5
}

const fn half_right() -> f64 {
    45.0
}

const fn forearm() -> f64 {
    0.4
}

/// Pieces a curtain is made of.
const PIECES: i32 = 10;
/// A fan's head hangs so far before its axis.
const HEAD_M: f64 = 0.1;

impl Curtain {
    /// Its pieces at `time_s`.
    #[must_use]
    pub fn outlines(&self, time_s: f64) -> Vec<Outline> {
        let [from, to] = self.line.map(Point::from);
        let along = to - from;
        let aside = along.left() * (1.0 / along.length().max(1e-6));
        let phase = TAU * (time_s - self.from_s).max(0.0) / self.period_s.max(0.1);
        // Two tones whose periods have no common multiple, so that the sway never repeats.
        let swing = self.sway_m * (0.7 * libm::sin(phase) + 0.3 * libm::sin(phase * 2.3));
        let place = |piece: i32| {
            let share = f64::from(piece) / f64::from(PIECES);
            from + along * share + aside * (swing * libm::sin(PI * share))
        };
        (0..PIECES).map(|piece| Outline::Segment(place(piece), place(piece + 1))).collect()
    }
}

impl Fan {
    /// Its head at `time_s`.
    #[must_use]
    pub fn outlines(&self, time_s: f64) -> Vec<Outline> {
        let phase = TAU * (time_s - self.from_s).max(0.0) / self.period_s.max(0.1);
        let ahead = Point::towards((self.yaw_deg + self.swing_deg * libm::sin(phase)).to_radians());
        let middle = Point::from(self.at) + ahead * HEAD_M;
        let aside = ahead.left() * (self.width_m / 2.0);
        vec![Outline::Segment(middle - aside, middle + aside), Outline::disc(self.at.into(), 0.03)]
    }
}

/// Anything that moves and is no person.
#[derive(Clone, Debug)]
pub enum Moving {
    /// A door's leaf.
    Door(Door),
    /// A leaf that obeys a lock.
    Live(LiveDoor),
    /// A curtain.
    Curtain(Curtain),
    /// A fan.
    Fan(Fan),
    /// Carried, or put down.
    Prop(Box<Prop>),
    /// Moved from place to place.
    Placed(Box<Placed>),
}

impl Moving {
    /// Its outlines at `time_s`.
    #[must_use]
    pub fn outlines(&self, time_s: f64) -> Vec<Outline> {
        match self {
            Self::Door(door) => vec![door.outline(time_s)],
            Self::Live(live) => vec![live.outline(time_s)],
            Self::Curtain(curtain) => curtain.outlines(time_s),
            Self::Fan(fan) => fan.outlines(time_s),
            Self::Prop(prop) => prop.outlines(time_s),
            Self::Placed(placed) => placed.outlines(time_s),
        }
    }

    /// Reflectance: the share of the light that comes back.
    #[must_use]
    pub const fn reflectance(&self) -> f64 {
        match self {
            Self::Door(door) => door.reflectance,
            Self::Live(live) => live.door.reflectance,
            Self::Curtain(curtain) => curtain.reflectance,
            Self::Fan(fan) => fan.reflectance,
            Self::Prop(prop) => prop.spec.reflectance,
            Self::Placed(placed) => placed.spec.reflectance,
        }
    }

    /// Whether a plane at this height cuts it.
    #[must_use]
    pub fn is_cut(&self, height_m: f64) -> bool {
        match self {
            Self::Prop(prop) => (prop.spec.low_m..=prop.spec.high_m).contains(&height_m),
            Self::Placed(placed) => (placed.spec.low_m..=placed.spec.high_m).contains(&height_m),
            Self::Door(_) | Self::Live(_) | Self::Curtain(_) | Self::Fan(_) => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curtain_sways_and_keeps_its_ends() {
        let text = "line = [[0, 0], [2, 0]]\nsway_m = 0.2\nfrom_s = 5";
        let curtain: Curtain = toml::from_str(text).unwrap();
        let depth_m = |time_s: f64| {
            let low = |outline: &Outline| outline.bounds().0.y;
            curtain
                .outlines(time_s)
                .iter()
                .map(low)
                .fold(0.0, |most: f64, y| if y.abs() > most.abs() { y } else { most })
        };
        assert_eq!(depth_m(3.0), 0.0, "still at first");
        assert!(depth_m(6.0) > 0.08 && depth_m(8.0) < -0.08, "{} {}", depth_m(6.0), depth_m(8.0));
        for outline in [curtain.outlines(6.3).first().copied(), curtain.outlines(6.3).last().copied()] {
            let Some(Outline::Segment(from, to)) = outline else { panic!("{outline:?}") };
            assert!(from.length() < 1e-9 || (to - Point::new(2.0, 0.0)).length() < 1e-9);
        }
    }

    #[test]
    fn a_fan_turns_to_both_sides() {
        let fan: Fan = toml::from_str("at = [1, 1]\nperiod_s = 8").unwrap();
        let ahead =
            |time_s| (fan.outlines(time_s)[0].bounds().0 - Point::new(1.0, 1.0)).angle_rad().to_degrees();
        assert!((ahead(2.0) - 45.0).abs() < 1e-6 && (ahead(6.0) + 45.0).abs() < 1e-6);
    }
}
