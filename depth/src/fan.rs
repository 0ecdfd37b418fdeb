//! A depth image as a ring of ranges, as a laser scan has.
//!
//! ```text
//!     from above                     each bearing, of the pixels between the camera's plane and 1 m above it
//!      ╲ │ ╱  wall ━━━━━━━━━          · foreground: the nearest of it
//!    ───◩───                          · none, but most of the background seen: the background, all before it is empty
//!        bearings, equally wide       · most of it not seen: 19, the sensor's code for "cannot be measured"
//!                                     · a background that never returned anything: 0, no return
//! ```
//!
//! Ranges are horizontal, from the camera. A bearing is as wide as 1.25 columns in the middle of the image, where they
//! are widest apart, so that none is without a column.

use kehai::scan::MAX_BEAMS;
use kehai_emulator::source::SensorGeometry;

use crate::background::Background;
use crate::camera::{Camera, Place};
use crate::foreground::Point;
use crate::frame::{Frame, is_measured};

/// What stands for a bearing that was not seen: the blind code of the model `KEHAI-DEPTH` in `kehai::sensor_model`.
pub const NOT_SEEN: u32 = 19;

/// What stands for a bearing from which nothing ever returned.
const NO_RETURN: u32 = 0;

/// Height of the band that is looked at, m: a grown person's body above the plane.
const BAND_M: f32 = 1.0;

/// Range at which a pixel must look into the band, m: the middle of the reach for people.
const LOOK_M: f32 = 2.5;

/// Columns that a bearing is wide at least.
const COLUMNS: f32 = 1.25;

/// Farthest wall, mm: twice the reach for people; beyond it depth in mm is no better than a guess.
const RANGE_MAX_MM: u32 = 10_000;

/// Turns frames into rings.
#[derive(Clone, Debug)]
pub struct Fan {
    plane_m: f32,
    geometry: SensorGeometry,
    bearings: Vec<Bearing>,
    /// Of each pixel of the band: its index and bearing.
    band: Vec<(usize, usize)>,
}

/// What is known of one bearing.
#[derive(Clone, Copy, Default, Debug)]
struct Bearing {
    /// Whether a pixel that looks into the band has a background that never returned anything. At the edges of a camera
    /// that looks down no pixel looks into the band: they are not open, but not seen.
    open: bool,
    /// Pixels whose background lies in the band.
    pixels: usize,
    /// The farthest of that background, mm: a person farther than a shelf in the same bearing must still be nearer
    /// than the background.
    background_mm: u32,
}

impl Fan {
    /// The fan of this camera in front of this background.
    #[must_use]
    pub fn new(camera: &Camera, background: &Background) -> Self {
        let geometry = geometry(camera);
        let mut fan = Self {
            plane_m: camera.plane_m(),
            geometry,
            bearings: vec![Bearing::default(); geometry.steps()],
            band: Vec::new(),
        };
        for (index, &value_mm) in background.values_mm().iter().enumerate() {
            let (column, row) = (index % camera.width, index / camera.width);
            if !is_measured(value_mm) {
                if let Some((at, _)) = fan.bearing(middle(camera, column, row))
                    && let Some(bearing) = fan.bearings.get_mut(at)
                {
                    bearing.open = true;
                }
                continue;
            }
            let place = camera.place(column, row, value_mm);
            let Some((at, range_mm)) = fan.bearing(place) else { continue };
            if let Some(bearing) = fan.bearings.get_mut(at) {
                bearing.pixels += 1;
                bearing.background_mm = bearing.background_mm.max(range_mm);
                fan.band.push((index, at));
            }
        }
        fan
    }

    /// Where the bearings point.
    #[must_use]
    pub const fn geometry(&self) -> SensorGeometry {
        self.geometry
    }

    /// The ranges of a frame, mm, counter-clockwise; `foreground` is its foreground.
    #[must_use]
    pub fn ring(&self, frame: &Frame, foreground: &[Point]) -> Vec<u32> {
        self.ring_and_nearest(frame, foreground).0
    }

    /// As [`ring`](Self::ring), and of each range the number of its point in `foreground`.
    #[must_use]
    pub fn ring_and_nearest(&self, frame: &Frame, foreground: &[Point]) -> (Vec<u32>, Vec<Option<usize>>) {
        let mut nearest = vec![None; self.bearings.len()];
        if frame.blind().is_some() {
            return (self.not_seen(), nearest);
        }
        let mut nearest_mm = vec![u32::MAX; self.bearings.len()];
        for (number, point) in foreground.iter().enumerate() {
            if let Some((at, range_mm)) = self.bearing(point.place)
                && let Some((nearest_mm, nearest)) = nearest_mm.get_mut(at).zip(nearest.get_mut(at))
                && range_mm < *nearest_mm
            {
                (*nearest_mm, *nearest) = (range_mm, Some(number));
            }
        }
        let mut measured = vec![0; self.bearings.len()];
        for &(index, at) in &self.band {
            if frame.depth_mm().get(index).is_some_and(|&value_mm| is_measured(value_mm))
                && let Some(measured) = measured.get_mut(at)
            {
                *measured += 1;
            }
        }
        let bearings = self.bearings.iter().zip(nearest_mm).zip(measured);
        let ranges = bearings.map(|((bearing, nearest_mm), measured)| bearing.range(nearest_mm, measured));
        (ranges.collect(), nearest)
    }

    /// The ring of a frame in which nothing was seen: nothing is known, nothing is empty.
    #[must_use]
    pub fn not_seen(&self) -> Vec<u32> {
        vec![NOT_SEEN; self.bearings.len()]
    }

    /// Bearing and horizontal range in mm of a place in the band; None outside.
    fn bearing(&self, [x, y, z]: Place) -> Option<(usize, u32)> {
        if !(self.plane_m..=self.plane_m + BAND_M).contains(&z) {
            return None;
        }
        let step_rad = std::f32::consts::TAU / f32::from(self.geometry.steps_per_turn);
        let step = (y.atan2(x) / step_rad).round() + f32::from(self.geometry.front_step);
        let inside = (0.0..self.bearings.len() as f32).contains(&step);
        let range_mm = (x.hypot(y) * 1000.0).round() as u32;
        inside.then_some((step as usize, range_mm.max(self.geometry.range_min_mm)))
    }
}

impl Bearing {
    fn range(&self, nearest_mm: u32, measured: usize) -> u32 {
        if nearest_mm != u32::MAX {
            nearest_mm
        } else if self.pixels == 0 && !self.open {
            NOT_SEEN
        } else if self.pixels == 0 || measured * 2 >= self.pixels && self.background_mm > RANGE_MAX_MM {
            NO_RETURN
        } else if measured * 2 >= self.pixels {
            self.background_mm
        } else {
            NOT_SEEN
        }
    }
}

/// Where a pixel looks, [`LOOK_M`] from the camera.
fn middle(camera: &Camera, column: usize, row: usize) -> Place {
    let [x, y, z] = camera.ray(column, row);
    let stretch = LOOK_M / x.hypot(y).max(f32::MIN_POSITIVE);
    [x * stretch, y * stretch, camera.height_m + z * stretch]
}

/// Equal steps over the field of view, the middle one forward.
fn geometry(camera: &Camera) -> SensorGeometry {
    let (fov_rad, pitch_rad) = (camera.fov_deg.to_radians(), camera.pitch_deg.to_radians());
    // Seen from above, the columns of a camera that looks down are wider apart.
    let column_rad = 1.0 / camera.focal_px() / pitch_rad.cos();
    let step_rad = (COLUMNS * column_rad).max(fov_rad / (MAX_BEAMS - 2) as f32);
    // A turn has at least 64 steps on the wire (`Geometry::new`).
    let steps_per_turn = (std::f32::consts::TAU / step_rad).floor().max(64.0);
    let side = (fov_rad / 2.0 / (std::f32::consts::TAU / steps_per_turn)).floor() as u16;
    SensorGeometry {
        first_step: 0,
        last_step: 2 * side,
        front_step: side,
        steps_per_turn: steps_per_turn as u16,
        range_min_mm: NOT_SEEN + 1,
        range_max_mm: RANGE_MAX_MM,
        period_us: u32::try_from(camera.period_us()).unwrap_or(u32::MAX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::SMALL;
    use crate::foreground::{self, Limits};
    use crate::golden::{Body, background, render};

    fn ring(frame: &Frame, camera: &Camera) -> (Fan, Vec<u32>) {
        let background = background(camera);
        let fan = Fan::new(camera, &background);
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
    fn an_open_door_returns_nothing_and_a_person_in_it_does() {
        let nothing = crate::background::still(SMALL.width, vec![0; SMALL.width * SMALL.height]);
        let fan = Fan::new(&SMALL, &nothing);
        let body = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.2, top_m: 1.7 };
        let frame = render(&SMALL, &[body], 0);
        let points: Vec<_> = foreground::of(&frame, &nothing, &SMALL, &Limits::USUAL)
            .into_iter()
            .filter(|point| point.place[0] < 2.5)
            .collect();
        let ring = fan.ring(&frame, &points);
        assert_eq!((ring[0], ring[27], ring[54]), (NO_RETURN, 1801, NO_RETURN));
    }

    #[test]
    fn every_bearing_of_any_camera_has_a_column_or_counts_as_not_seen() {
        for (width, fov_deg, pitch_deg) in
            [(80, 70.0, 0.0), (320, 60.0, 10.0), (640, 90.0, 20.0), (1280, 70.0, 0.0)]
        {
            let camera = Camera { width, height: width * 3 / 4, fov_deg, pitch_deg, height_m: 1.5, ..SMALL };
            let fan = Fan::new(&camera, &background(&camera));
            assert!(fan.bearings.len() <= MAX_BEAMS);
            for bearing in &fan.bearings {
                let range = bearing.range(u32::MAX, bearing.pixels);
                assert!(if bearing.pixels > 0 { range > 3000 } else { range == NOT_SEEN }, "{camera:?}");
            }
            let unseen = fan.bearings.iter().filter(|bearing| bearing.pixels == 0).count();
            assert!(unseen <= fan.bearings.len() / 100, "{unseen}: {camera:?}");
        }
    }
}
