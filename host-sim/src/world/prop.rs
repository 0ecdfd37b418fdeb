//! Things that people carry, push or pull, and perhaps put down and leave behind.
//!
//! ```text
//!          heading ▲         ┌───┐ ahead_m          until `puts_down_at` it moves with its carrier;
//!                  │         │   │                  from then on it stands where it was at that moment
//!               ( person )   └───┘ left_m
//! ```
//!
//! A scene may give several places; the seed chooses one, and the carrier's way point is moved so that the
//! thing lands there.

use super::geometry::{Outline, Point};
use super::motion::Motion;
use super::random::{Purpose, Stream};
use super::walker::WayPoint;
use serde::Deserialize;

/// A carried thing as a scene describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carried {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Name of the carrier.
    pub by: String,
    /// Its corners, if it has corners, about its own middle: x ahead, y to the left.
    #[serde(default)]
    pub polygon: Vec<[f64; 2]>,
    /// Round parts: x, y and radius.
    #[serde(default)]
    pub discs: Vec<[f64; 3]>,
    /// Its middle before the carrier's.
    #[serde(default)]
    pub ahead_m: f64,
    /// Its middle to the left of the carrier's.
    #[serde(default)]
    pub left_m: f64,
    /// Reflectance.
    #[serde(default = "cloth")]
    pub reflectance: f64,
    /// Height of its lower edge above the floor.
    #[serde(default)]
    pub low_m: f64,
    /// Height of its upper edge above the floor.
    #[serde(default = "table_high")]
    pub high_m: f64,
    /// Number of the carrier's way point, from 0, at which it is put down; never, by default.
    pub puts_down_at: Option<usize>,
    /// Where it may be put down; by default where the way point leads.
    #[serde(default)]
    pub places: Vec<[f64; 2]>,
}

const fn cloth() -> f64 {
    0.5
}

const fn table_high() -> f64 {
    1.0
}

/// A thing that is or was carried.
#[derive(Clone, Debug)]
pub struct Prop {
    /// As the scene says.
    pub spec: Carried,
    carrier: Motion,
    put_down_s: f64,
}

impl Prop {
    /// Carried along by `carrier` until `put_down_s`.
    #[must_use]
    pub const fn new(spec: Carried, carrier: Motion, put_down_s: f64) -> Self {
        Self { spec, carrier, put_down_s }
    }

    /// Outlines at `time_s`; empty before the carrier enters, and after the carrier leaves without putting it down.
    #[must_use]
    pub fn outlines(&self, time_s: f64) -> Vec<Outline> {
        let Some(stance) = self.carrier.stance(time_s.min(self.put_down_s)) else { return Vec::new() };
        let ahead = Point::towards(stance.heading_rad);
        let place = |x: f64, y: f64| {
            stance.at + ahead * (self.spec.ahead_m + x) + ahead.left() * (self.spec.left_m + y)
        };
        let corners = self.spec.polygon.iter().map(|[x, y]| place(*x, *y));
        let sides = corners.clone().zip(corners.cycle().skip(1));
        let sides = sides.map(|(from, to)| Outline::Segment(from, to));
        let discs = self.spec.discs.iter().map(|[x, y, radius_m]| Outline::disc(place(*x, *y), *radius_m));
        sides.chain(discs).collect()
    }
}

impl Carried {
    /// Moves the way point at which it is put down to the place that the seed chooses; `number` is that of the
    /// thing in the scene.
    pub fn lead(&self, points: &mut [WayPoint], seed: u64, number: usize) {
        let Some(index) = self.puts_down_at else { return };
        let mut stream = Stream::new(seed, Purpose::Crowd, [number as u64, 3]);
        let chosen = (stream.uniform() * self.places.len() as f64) as usize;
        let Some(place) = self.places.get(chosen) else { return };
        let place = Point::from(*place);
        let before = index.checked_sub(1).and_then(|before| points.get(before)).map(|point| point.at);
        let way = place - before.unwrap_or(place);
        let ahead = way * (1.0 / way.length().max(1e-6));
        if let Some(point) = points.get_mut(index) {
            point.at = place - ahead * self.ahead_m - ahead.left() * self.left_m;
        }
    }

    /// Checks the description.
    ///
    /// # Errors
    /// One sentence without its name.
    pub fn check(&self) -> Result<(), String> {
        if self.discs.is_empty() && self.polygon.len() < 2 {
            return Err(String::from("give it a polygon of at least two corners, or discs"));
        }
        if !self.places.is_empty() && self.puts_down_at.is_none() {
            return Err(String::from("places need puts_down_at"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::motion::Track;

    fn chair(puts_down_at: Option<usize>) -> Carried {
        Carried {
            name: String::new(),
            by: String::new(),
            polygon: Vec::new(),
            discs: vec![[0.0, 0.1, 0.02]],
            ahead_m: 0.5,
            left_m: 0.0,
            reflectance: 0.5,
            low_m: 0.0,
            high_m: 1.0,
            puts_down_at,
            places: vec![[2.0, 0.0], [2.0, 1.0]],
        }
    }

    #[test]
    fn it_moves_with_its_carrier_and_stays_where_it_was_put_down() {
        let positions: Vec<Point> = (0..100).map(|step| Point::new(0.1 * f64::from(step), 0.0)).collect();
        let motion = Motion::Track(Track::new(1.0, 0.1, &positions, 0.0));
        let prop = Prop::new(chair(None), motion, 3.0);
        let at = |time_s| prop.outlines(time_s).first().map(|outline| outline.bounds().0);
        assert_eq!(at(0.5), None);
        assert!((at(2.0).unwrap() - Point::new(1.5, 0.1)).length() < 1e-9);
        assert!((at(50.0).unwrap() - Point::new(2.5, 0.1)).length() < 1e-9);
    }

    #[test]
    fn the_seed_chooses_the_place_and_the_carrier_goes_there() {
        let way = |x: f64| WayPoint { at: Point::new(x, 0.0), wait_s: 1.0 };
        let mut ends: Vec<String> = (0..20)
            .map(|seed| {
                let mut points = [way(-1.0), way(0.0), way(5.0)];
                chair(Some(1)).lead(&mut points, seed, 0);
                assert_eq!((points[0], points[2]), (way(-1.0), way(5.0)));
                let from = points[0].at;
                let ahead = (points[1].at - from) * (1.0 / (points[1].at - from).length());
                let lands = points[1].at + ahead * 0.5;
                format!("{:.3} {:.3}", lands.x, lands.y.abs())
            })
            .collect();
        ends.sort();
        ends.dedup();
        assert_eq!(ends, ["2.000 0.000", "2.000 1.000"]);
    }
}
