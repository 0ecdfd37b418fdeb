//! What the camera adds to the truth: noise, missing and flying pixels, a patch of sun.
//!
//! ```text
//!   depth + 0.29 % noise       ▓▓▓▓      ▒ edge: now and then a depth between both sides, in empty air
//!   2 % missing               ▓▓ ▓▓▒  ▒   ☼ the sun on the floor and on what passes: half of it missing, the rest noisier
//! ```
//!
//! One number a pixel: its upper bits choose a normal deviation from a table, the rest decides what becomes of the
//! pixel. A table of 4096 has no deviation beyond 4 σ, and a pixel that is 4 σ off at 5 m is so by 6 cm: background.

use kehai_depth::frame::{Frame, MISSING};

use crate::world::random::{Purpose, Stream};

use super::CAMERA;
use super::image::Image;

/// The camera's noise, of the depth: the paper's 0.29 %, as a standard deviation.
const NOISE: f64 = 0.0029;

/// Share of pixels that are missing anywhere, and in the sun.
const MISSING_SHARE: f64 = 0.02;
const DAZZLED_SHARE: f64 = 0.5;

/// How many times as noisy a pixel in the sun is.
const DAZZLED_NOISE: f64 = 3.0;

/// Two neighbours farther apart than this have an edge between them, m; share of edge pixels that fly.
const EDGE_M: f32 = 0.2;
const FLYING_SHARE: f64 = 0.1;

/// Share of pixels anywhere that are at a random depth.
const STRAY_SHARE: f64 = 0.0005;

/// Beyond this nothing comes back, m.
const FARTHEST_M: f64 = 10.0;

/// The sun's patch: so far from the camera and so wide, m, from the floor up to a body's chest.
const SUN_M: [(f64, f64); 2] = [(2.2, 3.2), (0.4, 1.2)];
const SUN_HIGH_M: f64 = 1.3;

const TABLE: usize = 4096;

/// The flaws of a run.
#[derive(Clone, Debug)]
pub struct Flaws {
    seed: u64,
    normals: Vec<f32>,
    /// Where the sun falls in this run.
    sun_y_m: f64,
}

impl Flaws {
    pub(super) fn new(seed: u64) -> Self {
        let mut stream = Stream::new(seed, Purpose::Entrance, [1, 0]);
        let sun_y_m = stream.between(-2.0, 1.0);
        Self { seed, normals: (0..TABLE).map(|_| stream.normal() as f32).collect(), sun_y_m }
    }

    /// What the camera hands out as its frame of this number.
    pub(super) fn frame(&self, image: &Image, number: u64) -> Option<Frame> {
        let mut stream = Stream::new(self.seed, Purpose::Entrance, [2, number]);
        let focal_px = f64::from(CAMERA.focal_px());
        let mut depth_mm = Vec::with_capacity(image.depth_m.len());
        for (row, depths_m) in image.depth_m.chunks_exact(CAMERA.width).enumerate() {
            let up = (CAMERA.height as f64 * 0.5 - 0.5 - row as f64) / focal_px;
            for (column, exact_m) in depths_m.iter().enumerate() {
                let left = (CAMERA.width as f64 * 0.5 - 0.5 - column as f64) / focal_px;
                let exact_m = f64::from(*exact_m);
                let drawn = stream.uniform() * TABLE as f64;
                let normal = self.normals.get(drawn as usize).copied().unwrap_or(0.0);
                let chance = drawn.fract();
                let is_sunny =
                    self.is_sunny(exact_m, exact_m * left, f64::from(CAMERA.height_m) + exact_m * up);
                let (missing, noise) =
                    if is_sunny { (DAZZLED_SHARE, NOISE * DAZZLED_NOISE) } else { (MISSING_SHARE, NOISE) };
                let mut seen_m = exact_m * (1.0 + noise * f64::from(normal));
                let rest = 1.0 - chance;
                let beside_m = depths_m.get(column + 1).copied().map_or(exact_m, f64::from);
                if rest < STRAY_SHARE {
                    seen_m = rest / STRAY_SHARE * FARTHEST_M;
                } else if (beside_m - exact_m).abs() > f64::from(EDGE_M) && rest < FLYING_SHARE {
                    seen_m = exact_m + (beside_m - exact_m) * rest / FLYING_SHARE;
                }
                let is_missing = chance < missing || !(0.3..FARTHEST_M).contains(&seen_m);
                depth_mm.push(if is_missing { MISSING } else { (seen_m * 1000.0).round() as u16 });
            }
        }
        let stamp_us = number * CAMERA.period_us();
        Frame::new(CAMERA.width, CAMERA.height, depth_mm, stamp_us)
    }

    fn is_sunny(&self, x_m: f64, y_m: f64, z_m: f64) -> bool {
        let [(from_m, to_m), (low_m, high_m)] = SUN_M;
        let aside_m = y_m - self.sun_y_m;
        (from_m..to_m).contains(&x_m) && (low_m..high_m).contains(&aside_m) && z_m < SUN_HIGH_M
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_noisy_missing_or_flies_as_often_as_said() {
        let (flaws, image) = (Flaws::new(5), Image::empty());
        let frame = flaws.frame(&image, 0).unwrap();
        let (mut missing, mut squares, mut seen, mut stray) = (0, 0.0, 0.0, 0);
        // The upper half looks at the wall, where no sun is.
        let pixels = CAMERA.width * CAMERA.height / 2;
        for (value_mm, exact_m) in frame.depth_mm().iter().zip(&image.depth_m).take(pixels) {
            let off = f64::from(*value_mm) / 1000.0 / f64::from(*exact_m) - 1.0;
            if *value_mm == MISSING {
                missing += 1;
            } else if off.abs() > 0.02 {
                stray += 1;
            } else {
                squares += off * off;
                seen += 1.0;
            }
        }
        let share = f64::from(missing) / pixels as f64;
        let sigma = libm::sqrt(squares / seen);
        assert!((share - MISSING_SHARE).abs() < 0.003 && (sigma - NOISE).abs() < 0.0003, "{share} {sigma}");
        assert!((5..60).contains(&stray), "{stray}");
        assert_ne!(frame, flaws.frame(&image, 1).unwrap());
    }

    #[test]
    fn half_of_the_sunny_floor_is_missing() {
        let (flaws, image) = (Flaws { sun_y_m: -0.8, ..Flaws::new(5) }, Image::empty());
        let frame = flaws.frame(&image, 0).unwrap();
        let at = |row: usize| {
            let pixels = &frame.depth_mm()[row * CAMERA.width..][..CAMERA.width];
            pixels.iter().filter(|value_mm| **value_mm == MISSING).count()
        };
        // The lowest row sees the floor at 2.4 m, 2.7 m wide.
        assert!((30..80).contains(&at(239)), "{}", at(239));
        assert!(at(130) < 20, "{}", at(130));
    }
}
