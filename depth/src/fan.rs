//! A depth image as a ring of ranges, as a laser scan has.
//!
//! ```text
//!     from above                     each bearing, of the pixels between the camera's plane and 1 m above it
//!      ╲ │ ╱  wall ━━━━━━━━━          · foreground: the nearest of it
//!    ───◩───                          · none, and what ends the bearing is seen (`ends`): a wall is its range; open, 0, no
//!        bearings, equally wide         return: it is empty up to the reach (`reach`), and beyond nothing is known
//!                                     · most of its end not seen: 19, the sensor's code for "cannot be measured"
//! ```
//!
//! Ranges are horizontal, from the camera.

use kehai_emulator::source::SensorGeometry;

use crate::background::Background;
use crate::bearings::Bearings;
pub use crate::bearings::NOT_SEEN;
use crate::camera::{Camera, Place};
use crate::ends::Ends;
use crate::foreground::{Limits, Point};
use crate::frame::Frame;

/// Height of the band that is looked at, m: a grown person's body above the plane.
const BAND_M: f32 = 1.0;

/// Turns frames into rings.
#[derive(Clone, Debug)]
pub struct Fan {
    plane_m: f32,
    bearings: Bearings,
    ends: Ends,
}

impl Fan {
    /// The fan of this camera in front of this background, whose foreground has these limits.
    #[must_use]
    pub fn new(camera: &Camera, background: &Background, limits: &Limits) -> Self {
        let bearings = Bearings::of(camera, limits);
        let ends = Ends::of(&bearings, camera, background, limits);
        Self { plane_m: camera.plane_m(), bearings, ends }
    }

    /// Where the bearings point.
    #[must_use]
    pub const fn geometry(&self) -> SensorGeometry {
        self.bearings.geometry
    }

    /// The ranges of a frame, mm, counter-clockwise; `foreground` is its foreground.
    #[must_use]
    pub fn ring(&self, frame: &Frame, foreground: &[Point]) -> Vec<u32> {
        self.ring_and_nearest(frame, foreground).0
    }

    /// As [`ring`](Self::ring), and of each range the number of its point in `foreground`.
    #[must_use]
    pub fn ring_and_nearest(&self, frame: &Frame, foreground: &[Point]) -> (Vec<u32>, Vec<Option<usize>>) {
        let mut nearest = vec![None; self.bearings.count()];
        if frame.blind().is_some() {
            return (self.not_seen(), nearest);
        }
        let mut nearest_mm: Vec<Option<u32>> = vec![None; self.bearings.count()];
        for (number, point) in foreground.iter().enumerate() {
            if self.is_in_band(point.place)
                && let Some((at, range_mm)) = self.bearings.towards(point.place)
                && let Some((nearest_mm, nearest)) = nearest_mm.get_mut(at).zip(nearest.get_mut(at))
                && nearest_mm.is_none_or(|nearest_mm| range_mm < nearest_mm)
            {
                (*nearest_mm, *nearest) = (Some(range_mm), Some(number));
            }
        }
        (self.ends.ranges(frame, &nearest_mm), nearest)
    }

    /// The ring of a frame in which nothing was seen: nothing is known, nothing is empty.
    #[must_use]
    pub fn not_seen(&self) -> Vec<u32> {
        vec![NOT_SEEN; self.bearings.count()]
    }

    fn is_in_band(&self, [_, _, z]: Place) -> bool {
        (self.plane_m..=self.plane_m + BAND_M).contains(&z)
    }
}

#[cfg(test)]
mod tests {
    use kehai::scan::MAX_BEAMS;

    use super::*;
    use crate::camera::SMALL;
    use crate::foreground;
    use crate::golden::{Body, background, render};

    fn ring(frame: &Frame, camera: &Camera) -> (Fan, Vec<u32>) {
        let background = background(camera);
        let fan = Fan::new(camera, &background, &Limits::USUAL);
        let ring = fan.ring(frame, &foreground::of(frame, &background, camera, &Limits::USUAL));
        (fan, ring)
    }

    #[test]
    fn an_empty_hall_reads_its_wall_in_every_bearing() {
        let (fan, ring) = ring(&render(&SMALL, &[], 0), &SMALL);
        let geometry = fan.geometry();
        assert_eq!((ring.len(), geometry.front_step), (55, 27));
        for (step, &range_mm) in ring.iter().enumerate() {
            let wall_mm = 4000.0 / geometry.bearing_rad(step as u16).cos();
            assert!((f64::from(range_mm) - wall_mm).abs() < 80.0, "{step}: {range_mm}, {wall_mm}");
        }
    }

    #[test]
    fn a_body_is_nearer_in_its_own_bearings_only() {
        let body = Body { x_m: 2.0, y_m: 0.5, radius_m: 0.2, top_m: 1.7 };
        let (fan, ring) = ring(&render(&SMALL, &[body], 0), &SMALL);
        let bearing = 0.5f64.atan2(2.0);
        for (step, &range_mm) in ring.iter().enumerate() {
            let off = (fan.geometry().bearing_rad(step as u16) - bearing).abs();
            if off < 0.08 {
                assert!((1840..=2062).contains(&range_mm), "{step}: {range_mm}");
            } else if off > 0.13 {
                assert!(range_mm > 3900, "{step}: {range_mm}");
            }
        }
    }

    #[test]
    fn what_is_not_seen_is_neither_empty_nor_a_wall() {
        let whole = render(&SMALL, &[], 0);
        let mut values = whole.depth_mm().to_vec();
        for (index, value_mm) in values.iter_mut().enumerate() {
            if index % SMALL.width < 20 {
                *value_mm = 0;
            }
        }
        let torn = Frame::new(SMALL.width, SMALL.height, values, 0).unwrap();
        let (fan, ring) = ring(&torn, &SMALL);
        // The image's left is the ring's end.
        assert_eq!(ring[54], NOT_SEEN);
        assert!(ring[0] > 3900 && ring[27] > 3900);
        let blind = Frame::unseen(SMALL.width, SMALL.height, 0);
        assert!(fan.ring(&blind, &[]).iter().all(|&range_mm| range_mm == NOT_SEEN));
    }

    #[test]
    fn every_bearing_of_any_camera_has_a_column_or_counts_as_not_seen() {
        for (width, fov_deg, pitch_deg) in
            [(80, 70.0, 0.0), (320, 60.0, 10.0), (640, 90.0, 20.0), (1280, 70.0, 0.0)]
        {
            let camera = Camera { width, height: width * 3 / 4, fov_deg, pitch_deg, height_m: 1.5, ..SMALL };
            let fan = Fan::new(&camera, &background(&camera), &Limits::USUAL);
            assert!(fan.bearings.count() <= MAX_BEAMS);
            let whole = fan.ring(&render(&camera, &[], 0), &[]);
            assert!(whole.iter().all(|range_mm| *range_mm > 3000 || *range_mm == NOT_SEEN), "{camera:?}");
            let unseen = fan.bearings.count() - fan.ends.known();
            assert!(unseen <= fan.bearings.count() / 100, "{unseen}: {camera:?}");
        }
    }
}
