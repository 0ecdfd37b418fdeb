//! How far a camera finds people: beyond it, nothing that it sees is called empty.
//!
//! ```text
//!                ╲ picture
//!   lens ◩━━━━━━━━━╲━━━━━━━━━━━━━━━┫ reach      ▒ upper body: from the plane to a short adult's shoulders
//!                  ▒ ╲             ▒            up to the reach it is in the picture, near enough, and wide enough
//!                  ▒   ╲           ▒
//! ```
//!
//! | a person is found up to where | that is | why |
//! |---|---|---|
//! | noise leaves a pixel its fellow | 4.9 m | 3 deviations of two pixels' difference are the 60 mm of [`Limits::USUAL`] |
//! | noise leaves the step | 5.9 m | 5 deviations are the 100 mm by which foreground is nearer |
//! | the foreground ends | 5 m | [`Limits::reach_mm`]: the paper's 5 m, for the two reasons above |
//! | the bearing towards the middle of a body meets it | 27 m at 320 columns and 59° | half of a body from its side is as wide as a bearing |
//! | a part of the upper body is in the picture | 4 m, 2.6 m up and 45° down | rows, height and pitch |
//!
//! The noise is the paper's 0.29 % at 5 m, 14.5 mm, and grows with the square of the distance, as of cameras that triangulate.
//! The least of these counts. It is found straight ahead: aside, the same distance has less depth.

use crate::camera::Camera;
use crate::foreground::Limits;

/// How far the upper body of a short adult (1.45 m) rises above the usual plane of 1 m, m. Children show less of it.
pub const BODY_M: f32 = 0.45;

/// Half of what a body shows at least, m: an adult's torso from its side.
const HALF_BODY_M: f32 = 0.12;

/// The reach is a multiple of this, mm.
const GRID_MM: u32 = 100;

/// The upper body is looked for at so many heights.
const HEIGHTS: u8 = 9;

/// Range up to which the bearing towards the middle of a body meets it, mm, when bearings are so wide.
#[must_use]
pub fn width_mm(step_rad: f32) -> u32 {
    (HALF_BODY_M / step_rad * 1000.0) as u32
}

/// Horizontal range up to which people are found, mm: those who stand before nothing; 0 if none are.
#[must_use]
pub fn reach_mm(camera: &Camera, limits: &Limits, step_rad: f32) -> u32 {
    let rows = 0.0..=camera.height as f32 - 1.0;
    let is_seen = |place| {
        camera.pixel(place).is_some_and(|([_, row], depth_m)| {
            rows.contains(&row) && depth_m * 1000.0 <= f32::from(limits.reach_mm)
        })
    };
    let heights_m = || (0..HEIGHTS).map(|n| BODY_M * f32::from(n) / f32::from(HEIGHTS - 1));
    let is_found = |range_mm: &u32| {
        let range_m = *range_mm as f32 * 1e-3;
        heights_m().any(|above_m| is_seen([range_m, 0.0, camera.plane_m() + above_m]))
    };
    let farthest_mm = u32::from(limits.reach_mm).min(width_mm(step_rad));
    (1..=farthest_mm / GRID_MM).rev().map(|n| n * GRID_MM).find(is_found).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::SMALL;

    /// A deviation of the noise at 5 m, mm.
    const NOISE_MM: f32 = 14.5;

    #[test]
    fn the_limits_of_the_foreground_end_where_the_noise_reaches_them() {
        let Limits { nearer_mm, reach_mm, fellow_mm, .. } = Limits::USUAL;
        let noise_mm = NOISE_MM * (f32::from(reach_mm) / 5000.0).powi(2);
        let fellow = f32::from(fellow_mm.unwrap()) / (noise_mm * 2.0_f32.sqrt());
        let step = f32::from(nearer_mm) / noise_mm;
        assert!((2.9..3.1).contains(&fellow) && step > 5.0, "{fellow} {step}");
    }

    #[test]
    fn a_reach_ends_with_the_depth_the_picture_or_the_bearings() {
        let reach = |camera: Camera| reach_mm(&camera, &Limits::USUAL, 1.25 / camera.focal_px());
        assert_eq!(reach(SMALL), 5000);
        // 16.6 m long on a slope of 25° down, the depth of 5 m is reached 4.9 m away.
        let high = Camera { height_m: 2.6, pitch_deg: 25.0, ..SMALL };
        assert_eq!(reach(high), 4900);
        // The uppermost row looks 28° down and ends on the plane 1.6 m below.
        let down = Camera { height_m: 2.6, pitch_deg: 55.0, ..SMALL };
        assert!((2800..=3100).contains(&reach(down)), "{}", reach(down));
        // The lowest row looks 13° up.
        let up = Camera { pitch_deg: -40.0, ..SMALL };
        assert!((1800..=2000).contains(&reach(up)), "{}", reach(up));
        assert_eq!(reach(Camera { pitch_deg: -80.0, ..SMALL }) / 1000, 0);
        // A column is 4.4 cm wide at a metre.
        let coarse = Camera { width: 32, height: 24, ..SMALL };
        assert_eq!(reach(coarse), 2100);
    }
}
