//! Which beams concern a body, and what its cloud puts in their way on the average (its mean field).
//!
//! ```text
//!            ·:·.            window: every `stride`-th beam from the first to the last that a sample may cover
//!   ●╌╌╌╌╌╌╌·:·:·╌╌╌╌╌
//!     ╲       ·.·            field: opacity, range and its variance, for each of them
//! ```

use super::body::{Body, SAMPLES};
use super::ray::{ACROSS_M, Ellipse, MISS, Mixture, Surface, Tables};
use super::scan::Scan;
use crate::geometry::Point;

/// Arc of silhouette that is one independent datum, m: neighbouring beams share the error of the shape.
const DATUM_M: f64 = 0.08;

/// Beams nearer to each other than this at a body are left out, m.
const GRAIN_M: f64 = 0.04;

/// Samples by which a body enters the others' mixture.
const FIELD: usize = 24;

/// What one body puts in the way of a range of beams: every `stride`-th of them, from `first`.
#[derive(Clone, Debug, Default)]
pub struct Field {
    first: usize,
    stride: usize,
    surfaces: Vec<Surface>,
}

impl Field {
    /// At a beam; none where it is nothing.
    pub fn at(&self, beam: usize) -> Option<&Surface> {
        let place = (beam + self.stride / 2).checked_sub(self.first)? / self.stride.max(1);
        self.surfaces.get(place).filter(|surface| surface.opacity > 0.001)
    }
}

/// Beams that a body may concern.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    pub first: usize,
    pub last: usize,
    pub stride: usize,
    /// Independent data to a beam.
    pub weight: f64,
    /// When its middle beam passes after step 0, s.
    pub delay_s: f64,
}

/// The beams of a body's window; none where no beam points.
pub fn window(body: &Body, scan: &Scan) -> Option<Window> {
    let (mut first, mut last, mut nearest_m) = (f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY);
    for sample in &body.samples {
        let (middle, reach) = shadow(sample.at, scan);
        first = first.min(middle - reach);
        last = last.max(middle + reach);
        nearest_m = nearest_m.min((sample.at - scan.origin()).length());
    }
    let beams = scan.beams() as f64;
    if last < 0.0 || first >= beams || scan.beams() == 0 {
        return None;
    }
    let (mean, _, _) = body.moments();
    let (middle, distance_m) = scan.beam_at(mean);
    let grain_m = distance_m.max(0.2) * scan.beam_rad();
    let stride = ((GRAIN_M / grain_m) as usize).max(1);
    let aligned = first.max(0.0) as usize / stride * stride;
    Some(Window {
        first: aligned,
        last: (last.min(beams - 1.0)) as usize,
        stride,
        weight: (stride as f64 * grain_m / DATUM_M).min(1.0),
        delay_s: scan.delay_s(middle),
    })
}

/// Middle beam of what a body at a place covers, and how many beams on each side.
pub fn shadow(at: Point, scan: &Scan) -> (f64, f64) {
    let (middle, distance_m) = scan.beam_at(at);
    let half = MISS * ACROSS_M * 1.1 / distance_m.max(0.3);
    (middle, libm::asin(half.min(1.0)) / scan.beam_rad())
}

/// The beams of a window that a sample covers.
#[derive(Clone, Copy)]
pub struct Covered {
    window: Window,
    from: usize,
    to: usize,
}

pub fn covered(window: Window, middle: f64, reach: f64) -> Covered {
    let place = |beam: f64| ((beam - window.first as f64) / window.stride as f64).max(0.0);
    Covered { window, from: place(middle - reach).ceil() as usize, to: place(middle + reach) as usize + 1 }
}

impl Covered {
    pub fn zip_mixtures(self, mixtures: &[Option<Mixture>]) -> impl Iterator<Item = (usize, &Mixture)> {
        let to = self.to.min(mixtures.len());
        let own = mixtures.get(self.from.min(to)..to).unwrap_or_default();
        own.iter().enumerate().filter_map(move |(place, mixture)| {
            Some((self.window.first + (self.from + place) * self.window.stride, mixture.as_ref()?))
        })
    }
}

/// What a body puts in the way of the beams of its window, on the average of some of its samples.
pub fn render(body: &Body, scan: &Scan, window: Window, tables: Tables) -> Field {
    let places = (window.last - window.first) / window.stride + 1;
    // Opacity, and its products with range and square of range.
    let mut sums = vec![(0.0, 0.0, 0.0); places];
    let mut total = 0.0;
    let some = body.samples.iter().zip(&body.weights).step_by(SAMPLES / FIELD);
    for (sample, weight) in some {
        total += weight;
        let ellipse: Ellipse = sample.ellipse(scan.origin(), window.delay_s);
        let (middle, reach) = shadow(sample.at, scan);
        let covered = covered(window, middle, reach);
        for (place, sums) in sums.iter_mut().enumerate().take(covered.to).skip(covered.from) {
            let beam = window.first + place * window.stride;
            let (opacity, range_m) = ellipse.meet(scan.towards(beam), tables);
            let opacity = weight * opacity;
            let (sum, first, second) = *sums;
            *sums = (sum + opacity, first + opacity * range_m, second + opacity * range_m * range_m);
        }
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
