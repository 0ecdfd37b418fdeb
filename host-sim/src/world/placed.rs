//! Things that stand somewhere and are moved again and again: a vase, a box, a pile of books on a table.
//!
//! ```text
//!   places[0] ── the person reaches moved_at[0] ─▶ places[1] ── moved_at[1] ─▶ places[2]      each within a second
//! ```
//!
//! At first it is part of the empty room; where it stood then, a beam later goes farther than what was learned.

use super::geometry::{Outline, Point};
use serde::Deserialize;

/// From reaching a way point to laying hands on the thing, s, and how long it is under way, s.
const TAKEN_S: f64 = 1.0;
const UNDER_WAY_S: f64 = 1.0;

/// A thing that is moved, as a scene describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacedSpec {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Name of the person who moves it.
    pub by: String,
    /// Radius, if it is round; else `sides_m`.
    pub radius_m: Option<f64>,
    /// Its sides along x and y.
    pub sides_m: Option<[f64; 2]>,
    /// Reflectance.
    #[serde(default = "wood")]
    pub reflectance: f64,
    /// Height of its lower edge above the floor.
    pub low_m: f64,
    /// Height of its upper edge above the floor.
    pub high_m: f64,
    /// Where its middle is, one place after the other.
    pub places: Vec<[f64; 2]>,
    /// Numbers of the person's way points, from 0, at which it is moved to the next place.
    pub moved_at: Vec<usize>,
}

const fn wood() -> f64 {
    0.5
}

/// A thing that is moved at known times.
#[derive(Clone, Debug)]
pub struct Placed {
    /// As the scene says.
    pub spec: PlacedSpec,
    /// When it is laid hands on, in order.
    moves_s: Vec<f64>,
}

impl Placed {
    /// Moved by a person who reaches the way points at these times, s.
    #[must_use]
    pub fn new(spec: PlacedSpec, reached_s: impl Iterator<Item = f64>) -> Self {
        Self { spec, moves_s: reached_s.map(|reached_s| reached_s + TAKEN_S).collect() }
    }

    /// Where its middle is.
    fn at(&self, time_s: f64) -> Point {
        let moved = self.moves_s.iter().take_while(|move_s| **move_s <= time_s).count();
        let place = |index: usize| self.spec.places.get(index).or(self.spec.places.last()).copied();
        let to = Point::from(place(moved).unwrap_or_default());
        let Some(before) = moved.checked_sub(1) else { return to };
        let from = Point::from(place(before).unwrap_or_default());
        let begun_s = self.moves_s.get(before).copied().unwrap_or(time_s);
        from + (to - from) * ((time_s - begun_s) / UNDER_WAY_S).min(1.0)
    }

    /// Outlines at `time_s`.
    #[must_use]
    pub fn outlines(&self, time_s: f64) -> Vec<Outline> {
        let at = self.at(time_s);
        if let Some(radius_m) = self.spec.radius_m {
            return vec![Outline::disc(at, radius_m)];
        }
        let [x, y] = self.spec.sides_m.unwrap_or_default().map(|side_m| 0.5 * side_m);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)].map(|(x, y)| at + Point::new(x, y));
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        sides.map(|(from, to)| Outline::Segment(*from, *to)).collect()
    }
}

impl PlacedSpec {
    /// Checks the description.
    ///
    /// # Errors
    /// One sentence without its name.
    pub fn check(&self) -> Result<(), String> {
        if self.radius_m.is_some() == self.sides_m.is_some() {
            return Err(String::from("give it radius_m or sides_m"));
        }
        if self.places.len() != self.moved_at.len() + 1 {
            return Err(String::from("it needs one place more than moved_at has numbers"));
        }
        if !self.moved_at.is_sorted() {
            return Err(String::from("moved_at must rise"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stands_is_moved_within_a_second_and_stands_elsewhere() {
        let text =
            "by = \"anna\"\nradius_m = 0.1\nlow_m = 0.7\nhigh_m = 0.9\nplaces = [[0, 0], [1, 0], [1, 2]]
            moved_at = [3, 5]";
        let spec: PlacedSpec = toml::from_str(text).unwrap();
        spec.check().unwrap();
        let placed = Placed::new(spec.clone(), [10.0, 20.0].into_iter());
        let at = |time_s| placed.outlines(time_s)[0].bounds().0;
        assert_eq!([0.0, 10.9, 12.0, 21.0, 60.0].map(|time_s| at(time_s).x), [0.0, 0.0, 1.0, 1.0, 1.0]);
        assert!((at(11.5).x - 0.5).abs() < 1e-9 && (at(21.5).y - 1.0).abs() < 1e-9);
        let wrong = PlacedSpec { moved_at: vec![3], ..spec };
        assert!(wrong.check().unwrap_err().contains("one place more"));
    }
}
