//! Range finders at the entrance: what their plane cuts of the bodies, beam by beam at its own time.
//!
//! ```text
//!   5.8 m ━━━━━━━━━━━━━━━━━━━━━━━━ wall        each beam: the wall, or the nearest ellipse that its plane cuts;
//!              ◖◗   ╲     ╱   ◩ second         within 16 steps (1.6 ms) people are taken as standing
//!                ○   ╲   ╱
//!     first ◩         ╲ ╱
//!   0 m   ━━━━━━━━━━━━ ◩ camera ━━━
//! ```

use std::sync::Arc;

use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::Config;

use super::Entrance;
use super::image::WALL_M;
use super::stack::Stack;
use crate::world::geometry::{Beam, Outline, Point, Pose};
use crate::world::noise::{Noise, NoiseLevel, Seen};
use crate::world::optics::SensorModel;
use crate::world::raycast::{Caster, FIRST_PERSON, Thing};
use crate::world::sensor::WorldSensor;

/// Height of the plane, m: it cuts torsos of adults, heads or chests of most children.
pub const PLANE_M: f64 = 0.9;

/// Reflectance of the walls and of clothes.
const WALL: f64 = 0.7;
const CLOTHES: f64 = 0.4;

/// Steps within which people are taken as standing.
const STEPS: usize = 16;

/// Half the length of both walls, m.
const ALONG_M: f64 = 6.0;

/// A range finder among the people of an entrance.
pub struct Laser {
    entrance: Arc<Entrance>,
    /// When the first frame of the entrance is taken, s.
    begins_s: f64,
    sensor: WorldSensor,
    noise: Noise,
    pose: Pose,
}

impl Laser {
    /// Number `number` of the entrance, a UHG-08LX at `pose`: the entrance is wider than a URG-04LX sees clothes.
    #[must_use]
    pub fn new(entrance: Arc<Entrance>, begins_s: f64, pose: Pose, (seed, number): (u64, u64)) -> Self {
        let model = SensorModel::Uhg08lx;
        let wall = |x: f64| Thing {
            outline: Outline::Segment(Point::new(x, -ALONG_M), Point::new(x, ALONG_M)),
            reflectance: WALL,
            low_m: 0.0,
            high_m: 3.0,
            mirror: false,
        };
        let caster = Caster::new(pose, PLANE_M, model.optics().geometry, &[wall(0.0), wall(WALL_M)]);
        let no_people = (Arc::from(Vec::new()), Arc::from(Vec::new()));
        let sensor = WorldSensor::new(model, NoiseLevel::Real, caster, no_people, seed, number);
        let noise = Noise::new(NoiseLevel::Real, model.optics(), seed, number);
        Self { entrance, begins_s, sensor, noise, pose }
    }

    /// The emulated sensor, and when its mirror passes the front first, µs.
    #[must_use]
    pub fn config(&self) -> (Config, u64) {
        (self.sensor.config(), self.sensor.clock().phase_us)
    }

    /// What the plane cuts of everybody at a time.
    fn outlines(&self, at_s: f64) -> Vec<(u16, Outline)> {
        let mut outlines = Vec::new();
        for walker in self.entrance.people_at(at_s - self.begins_s) {
            let cuts = Stack::person(&walker).cuts.into_iter();
            let is_cut = |(low_m, high_m): (f64, f64)| (low_m..high_m).contains(&PLANE_M);
            outlines.extend(cuts.filter(|cut| is_cut(cut.heights_m)).map(|cut| {
                let (centre, axis, half_axes_m) = (cut.centre, cut.axis, cut.half_axes_m);
                (walker.person, Outline::Ellipse { centre, axis, half_axes_m })
            }));
        }
        outlines
    }

    fn seen(&self, revolution: Revolution) -> Vec<Option<Seen>> {
        let geometry = self.geometry();
        let mut seen = self.sensor.seen(revolution);
        let step_s = f64::from(revolution.period_us) * 1e-6 / f64::from(geometry.steps_per_turn);
        for (chunk, seen) in seen.chunks_mut(STEPS).enumerate() {
            let first = chunk * STEPS + usize::from(geometry.first_step);
            let at_s = revolution.start_us as f64 * 1e-6 + step_s * (first + STEPS / 2) as f64;
            let outlines = self.outlines(at_s);
            for (index, seen) in seen.iter_mut().enumerate() {
                let bearing_rad = self.pose.yaw_rad + geometry.bearing_rad((first + index) as u16);
                let beam = Beam { origin: self.pose.at, direction: Point::towards(bearing_rad) };
                for (person, outline) in &outlines {
                    let Some(meeting) = outline.meet(&beam) else { continue };
                    if seen.is_none_or(|seen| meeting.range_m < seen.range_m) {
                        *seen = Some(Seen {
                            range_m: meeting.range_m,
                            incidence: meeting.incidence,
                            reflectance: CLOTHES,
                            bias_mm: 0.0,
                            thing: FIRST_PERSON + person,
                        });
                    }
                }
            }
        }
        seen
    }
}

impl RangeSource for Laser {
    fn geometry(&self) -> SensorGeometry {
        self.sensor.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let ranges_mm = self.noise.readings(revolution.start_us, &self.seen(revolution));
        let ready_us = revolution.start_us + u64::from(revolution.period_us);
        Some(SourceScan { start_us: revolution.start_us, ready_us, ranges_mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beam_ends_at_the_body_that_stands_there_at_its_time() {
        let pose = Pose { at: Point::new(0.1, 0.0), yaw_rad: 0.0 };
        let counts = (1..4).map(|seed| beams_ahead(pose, seed));
        let (seen, people) = counts.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        assert!(people > 20 && seen * 100 >= people * 95, "{seen} of {people}");
    }

    /// Of the people straight ahead in 100 s of entrance `seed`, how many end the beam; and how many there are.
    fn beams_ahead(pose: Pose, seed: u64) -> (usize, usize) {
        let entrance = Arc::new(Entrance::new(seed));
        let laser = Laser::new(Arc::clone(&entrance), 0.0, pose, (seed, 0));
        let (mut seen, mut people) = (0, 0);
        for tenth in 0..1000 {
            let start_us = tenth * 100_000;
            let revolution = Revolution { start_us, period_us: 100_000, earliest_us: 0 };
            let scan = laser.seen(revolution);
            // Beams ahead of it pass half way through the turn.
            for walker in entrance.people_at(start_us as f64 * 1e-6 + 0.0375) {
                let local = walker.at - pose.at;
                if walker.stature_m < 1.3 || local.y.abs() > 0.05 || walker.at.x > 4.0 {
                    continue;
                }
                people += 1;
                let ahead = scan[scan.len() / 2].unwrap();
                let off_m = local.x - ahead.range_m;
                // Its own chest, or another person's nearer to the sensor.
                seen += usize::from((0.05..0.35).contains(&off_m) || off_m > 0.35);
            }
        }
        (seen, people)
    }
}
