//! The bearings of a fan: where they point, and how far the sensor that is said to measure them reaches.
//!
//! ```text
//!        front_step
//!     ╲  ╲ │ ╱  ╱      from right to left, equally wide: 1.25 columns in the middle of the image, where columns
//!   ────── ◩ ──────    are widest apart, so that none is without a column
//! ```

use kehai::scan::MAX_BEAMS;
use kehai_emulator::source::SensorGeometry;

use crate::camera::{Camera, Place};
use crate::foreground::Limits;
use crate::reach::reach_mm;

/// What stands for a bearing that was not seen: the blind code of the model `KEHAI-DEPTH` in `kehai::sensor_model`.
pub const NOT_SEEN: u32 = 19;

/// Columns that a bearing is wide at least.
const COLUMNS: f32 = 1.25;

/// Equal steps over the field of view, the middle one forward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bearings {
    pub geometry: SensorGeometry,
    /// Range up to which people are found, mm: see [`crate::reach`].
    pub reach_mm: u32,
}

impl Bearings {
    /// Those of a camera whose foreground has these limits. The sensor states twice the reach as its `DMAX`: aside, people are
    /// found farther away; and its model takes half of it for what is surely seen.
    pub fn of(camera: &Camera, limits: &Limits) -> Self {
        let (fov_rad, pitch_rad) = (camera.fov_deg.to_radians(), camera.pitch_deg.to_radians());
        // Seen from above, the columns of a camera that looks down are wider apart.
        let column_rad = 1.0 / camera.focal_px() / pitch_rad.cos();
        let step_rad = (COLUMNS * column_rad).max(fov_rad / (MAX_BEAMS - 2) as f32);
        // A turn has at least 64 steps on the wire (`Geometry::new`).
        let steps_per_turn = (std::f32::consts::TAU / step_rad).floor().max(64.0);
        let step_rad = std::f32::consts::TAU / steps_per_turn;
        let side = (fov_rad / 2.0 / step_rad).floor() as u16;
        let (reach_mm, range_min_mm) = (reach_mm(camera, limits, step_rad), NOT_SEEN + 1);
        let geometry = SensorGeometry {
            first_step: 0,
            last_step: 2 * side,
            front_step: side,
            steps_per_turn: steps_per_turn as u16,
            range_min_mm,
            range_max_mm: 2 * reach_mm.max(range_min_mm),
            period_us: u32::try_from(camera.period_us()).unwrap_or(u32::MAX),
        };
        Self { geometry, reach_mm }
    }

    pub fn count(&self) -> usize {
        self.geometry.steps()
    }

    pub fn step_rad(&self) -> f32 {
        std::f32::consts::TAU / f32::from(self.geometry.steps_per_turn)
    }

    /// Bearing and horizontal range in mm of a place; None beside the fan.
    pub fn towards(&self, [x, y, _]: Place) -> Option<(usize, u32)> {
        let step = (y.atan2(x) / self.step_rad()).round() + f32::from(self.geometry.front_step);
        let inside = (0.0..self.count() as f32).contains(&step);
        let range_mm = (x.hypot(y) * 1000.0).round() as u32;
        inside.then_some((step as usize, range_mm.max(self.geometry.range_min_mm)))
    }
}
