//! What a body's cloud puts in the way of the beams of its window, on the average: its mean field.
//!
//! ```text
//!   ●╌╌╌╌╌╌╌·:·:·╌╌╌╌╌     opacity, range and its variance, beam by beam
//! ```

use std::array::from_fn;

use wide::f32x8;

use super::body::Body;
use super::ellipse::{Edge, LANES, Layer, sum};
use super::packet::{Met, Packet};
use super::ray::Surface;
use super::scan::Scan;
use super::window::Window;

/// Samples by which a body enters the others' mixture.
const FIELD: usize = 8;

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
pub fn render(body: &Body, scan: &Scan, window: &Window, edge: Edge) -> Field {
    draw(body, scan, window, edge, true)
}

/// The same without the arms that it stretches out.
pub fn render_torso(body: &Body, scan: &Scan, window: &Window, edge: Edge) -> Field {
    draw(body, scan, window, edge, false)
}

fn draw(body: &Body, scan: &Scan, window: &Window, edge: Edge, with_arms: bool) -> Field {
    let (samples, weights) = (body.cloud.samples(), body.cloud.weights());
    let count = samples.len().min(FIELD);
    let places: [u16; FIELD] = from_fn(|number| (number * samples.len() / count.max(1)) as u16);
    let places = &places[..count];
    let total: f64 = places.iter().map(|place| weights[usize::from(*place)]).sum();
    let share = 1.0 / total.max(1e-300);
    let packets = Packet::some(samples, places, (scan.origin(), window.delay_s), with_arms);
    let covered = packets.iter().map(|packet| window.covered(packet)).filter(|covered| !covered.is_empty());
    let all =
        covered.reduce(|one, other| one.start.min(other.start)..one.end.max(other.end)).unwrap_or_default();
    // Opacity, and its products with range and square of range.
    let (mut sums, mut met) = (vec![[f32x8::ZERO; 3]; all.len()], Vec::with_capacity(all.len()));
    for packet in &packets {
        let mut own = [0.0; LANES];
        for (own, place) in own.iter_mut().zip(packet.places()) {
            *own = (weights[place] * share) as f32;
        }
        packet.meet(&window.rays[all.clone()], edge, &mut met);
        for (sum, Met { near, far }) in sums.iter_mut().zip(&met) {
            let mut passes = f32x8::from(own);
            for Layer { opacity, range_m } in [Some(*near), *far].into_iter().flatten() {
                let held = passes * opacity;
                passes -= held;
                let first = held * range_m;
                *sum = [sum[0] + held, sum[1] + first, sum[2] + first * range_m];
            }
        }
    }
    let existence = body.existence();
    let surface = |sums: [f32x8; 3]| {
        let [held, first, second] = sums.map(sum);
        if held <= 0.0 {
            return Surface::default();
        }
        let range_m = f64::from(first / held);
        let variance_m2 = (f64::from(second / held) - range_m * range_m).max(0.0);
        Surface { opacity: existence * f64::from(held), range_m, variance_m2 }
    };
    let surfaces = sums.into_iter().map(surface).collect();
    Field { first: window.beam(all.start), stride: window.stride, surfaces }
}
