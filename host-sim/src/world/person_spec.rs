//! A scripted person of a scene, as in its file, and what is wrong with one.
//!
//! ```text
//!   route   ●────▶ ●  3 s ────▶ ●       repeat: stay, leave, loop, back-and-forth
//!   body    drawn by the seed, but for what the file says
//! ```

use super::body::Section;
use super::walker::Repeat;
use serde::Deserialize;

/// A scripted person.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PersonSpec {
    /// Name; by default the number in the file.
    #[serde(default)]
    pub name: String,
    /// What the plane cuts.
    #[serde(default)]
    pub section: Section,
    /// Way points: x, y and optionally seconds to wait. With a single way point the person stands there.
    pub route: Vec<Vec<f64>>,
    /// Walking speed.
    #[serde(default = "ordinary_walk")]
    pub speed_m_s: f64,
    /// What happens at the end of the route.
    #[serde(default)]
    pub repeat: Repeat,
    /// Time of appearance.
    #[serde(default)]
    pub from_s: f64,
    /// Time of leaving the world.
    pub until_s: Option<f64>,
    /// Where the chest points before the first step.
    #[serde(default)]
    pub heading_deg: f64,
    /// How fast they turn round on the spot.
    #[serde(default)]
    pub turn_deg_s: f64,
    /// Standard deviation of the swaying.
    #[serde(default = "ordinary_sway")]
    pub sway_mm: f64,
    /// How far a shift of weight moves them at most.
    #[serde(default)]
    pub shift_mm: f64,
    /// Shortest and longest time between two shifts of weight.
    #[serde(default = "some_minutes")]
    pub shift_every_s: [f64; 2],
    /// How far, by the seed, every way point is moved at most along each axis.
    #[serde(default)]
    pub scatter_m: f64,
    /// People of one group are moved alike.
    pub group: Option<u64>,
    /// Shoulders above the floor.
    pub top_m: Option<f64>,
    /// Begin and end of the time during which the person crouches.
    pub crouches_s: Option<[f64; 2]>,
    /// Numbers of way points, from 0, at which an arm reaches over a table as long as the person waits there; with the section
    /// `by-height`.
    #[serde(default)]
    pub reaches_at: Vec<usize>,
    /// Half the torso's width; random by default, as everything below.
    pub half_width_m: Option<f64>,
    /// Half the torso's depth.
    pub half_depth_m: Option<f64>,
    /// Radius of a thigh.
    pub thigh_radius_m: Option<f64>,
    /// Reflectance of the clothes.
    pub reflectance: Option<f64>,
    /// What the clothes add to a range.
    pub clothing_bias_mm: Option<f64>,
}

const fn some_minutes() -> [f64; 2] {
    [120.0, 300.0]
}

const fn ordinary_walk() -> f64 {
    1.1
}

const fn ordinary_sway() -> f64 {
    4.0
}

impl PersonSpec {
    /// A person on a route, with everything else as in a file that says nothing of it.
    #[must_use]
    pub fn along(route: Vec<Vec<f64>>) -> Self {
        Self {
            name: String::new(),
            section: Section::default(),
            route,
            speed_m_s: ordinary_walk(),
            repeat: Repeat::default(),
            from_s: 0.0,
            until_s: None,
            heading_deg: 0.0,
            turn_deg_s: 0.0,
            sway_mm: ordinary_sway(),
            shift_mm: 0.0,
            shift_every_s: some_minutes(),
            scatter_m: 0.0,
            group: None,
            top_m: None,
            crouches_s: None,
            reaches_at: Vec::new(),
            half_width_m: None,
            half_depth_m: None,
            thigh_radius_m: None,
            reflectance: None,
            clothing_bias_mm: None,
        }
    }

    /// What is wrong with it, in a line.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.route.is_empty() {
            return Err(String::from("route needs at least one point"));
        }
        let wrong = |point: &&Vec<f64>| {
            !(2..=3).contains(&point.len())
                || point.iter().any(|number| !number.is_finite())
                || point.get(2).is_some_and(|wait_s| *wait_s < 0.0)
        };
        if let Some(point) = self.route.iter().find(wrong) {
            return Err(format!("route: a point is [x, y] or [x, y, seconds to wait], not {point:?}"));
        }
        if self.reaches_at.iter().any(|index| *index >= self.route.len()) {
            return Err(String::from("reaches_at: the route has no such way point"));
        }
        let within = [
            ("speed_m_s", Some(self.speed_m_s), 0.05, 4.0),
            ("from_s", Some(self.from_s), 0.0, 86_400.0),
            ("sway_mm", Some(self.sway_mm), 0.0, 200.0),
            ("shift_mm", Some(self.shift_mm), 0.0, 300.0),
            ("scatter_m", Some(self.scatter_m), 0.0, 10.0),
            ("top_m", self.top_m, 0.1, 2.5),
            ("half_width_m", self.half_width_m, 0.05, 0.6),
            ("half_depth_m", self.half_depth_m, 0.05, 0.6),
            ("thigh_radius_m", self.thigh_radius_m, 0.03, 0.2),
            ("reflectance", self.reflectance, 0.0, 1.0),
            ("clothing_bias_mm", self.clothing_bias_mm, -100.0, 100.0),
        ];
        for (key, value, low, high) in within {
            if let Some(value) = value
                && !(low..=high).contains(&value)
            {
                return Err(format!("{key} must be between {low} and {high}, is {value}"));
            }
        }
        Ok(())
    }
}
