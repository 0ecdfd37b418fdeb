//! What a body's cloud puts in the way of the beams of its window, on the average: its mean field.
//!
//! ```text
//!   ●╌╌╌╌╌╌╌·:·:·╌╌╌╌╌     opacity, range and its variance, beam by beam
//! ```

use super::body::Body;
use super::ellipse::Opacity;
use super::ray::Surface;
use super::sample::Sample;
use super::scan::Scan;
use super::surfaces::{Arms, Layer, Met, meet};
use super::window::Window;

/// Samples by which a body enters the others' mixture.
const FIELD: usize = 12;

/// What one body puts in the way of a range of beams: every `stride`-th of them, from `first`.
#[derive(Clone, Debug, Default)]
pub struct Field {
    first: usize,
    stride: usize,
    surfaces: Vec<Surface>,
}

impl Field {
    /// Whether it is in the way of no beam.
    pub fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    /// Whether it is in the way of a window's beams.
    pub fn meets(&self, window: &Window) -> bool {
        let behind_last = self.first + self.surfaces.len() * self.stride;
        self.first <= window.last + self.stride && window.first <= behind_last
    }

    /// At a beam; none where it is nothing.
    pub fn at(&self, beam: usize) -> Option<&Surface> {
        let place = (beam + self.stride / 2).checked_sub(self.first)? / self.stride.max(1);
        self.surfaces.get(place).filter(|surface| surface.opacity > 0.001)
    }
}

/// What a body puts in the way of the beams of its window, on the average of some of its samples.
pub fn render(body: &Body, scan: &Scan, window: &Window, opacity: Opacity) -> Field {
    draw(body, scan, window, opacity, |sample| *sample)
}

/// The same without the arms that it stretches out.
pub fn render_torso(body: &Body, scan: &Scan, window: &Window, opacity: Opacity) -> Field {
    draw(body, scan, window, opacity, |sample| Sample { arm: None, ..*sample })
}

fn draw(
    body: &Body,
    scan: &Scan,
    window: &Window,
    opacity: Opacity,
    shown: impl Fn(&Sample) -> Sample,
) -> Field {
    // Opacity, and its products with range and square of range.
    let mut sums = vec![(0.0, 0.0, 0.0); window.len()];
    let mut total = 0.0;
    let (mut arms, all) = (Arms::default(), 0..window.len());
    for (sample, weight) in body.cloud.weighted().step_by((body.cloud.samples().len() / FIELD).max(1)) {
        total += weight;
        meet(&shown(sample), (scan, window, &all), opacity, &mut arms, |place, Met { near, far }| {
            let mut passes = weight;
            for Layer { opacity, range_m } in [Some(near), far].into_iter().flatten() {
                let (held, range_m) = (passes * opacity, f64::from(range_m));
                passes -= held;
                let (sum, first, second) = sums[place];
                sums[place] = (sum + held, first + held * range_m, second + held * range_m * range_m);
            }
        });
    }
    let existence = body.existence();
    let surface = |(sum, first, second): (f64, f64, f64)| {
        if sum <= 0.0 || total <= 0.0 {
            return Surface::default();
        }
        let range_m = first / sum;
        let variance_m2 = (second / sum - range_m * range_m).max(0.0);
        Surface { opacity: existence * sum / total, range_m, variance_m2 }
    };
    Field { first: window.first, stride: window.stride, surfaces: sums.into_iter().map(surface).collect() }
}
