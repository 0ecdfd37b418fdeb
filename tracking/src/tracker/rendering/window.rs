//! Which beams concern a body.
//!
//! ```text
//!            ·:·.            window: every `stride`-th beam from the first to the last that a sample may cover
//!   ●╌╌╌╌╌╌╌·:·:·╌╌╌╌╌
//!     ╲       ·.·            on both sides those that a stretched arm would cover
//! ```

use std::f64::consts::PI;
use std::ops::Range;

use super::body::Body;
use super::ellipse::Ray;
use super::packet::Packet;
use super::scan::Scan;
use crate::geometry::Point;

/// Arc of silhouette that is one independent datum, m: neighbouring beams share the error of the shape, which an arm of 8 cm
/// makes on both of its sides. Of a body that is not seen a sliver comes into view, and each arm's width of it counts.
const DATUM_M: f64 = 0.15;
const DATUM_UNSEEN_M: f64 = 0.08;

/// Beams nearer to each other than this at a body are left out, m: one that is not seen comes into view by a sliver.
const GRAIN_M: f64 = 0.03;

/// No part of a torso is farther from its middle, m: half of 0.52 m, of the largest, with its soft edge.
const BODY_M: f64 = 0.41;

/// Nor is a stretched hand, m.
const REACH_M: f64 = 0.8;

/// Beams that a body may concern.
#[derive(Clone, Debug)]
pub struct Window {
    pub first: usize,
    pub last: usize,
    pub stride: usize,
    /// Independent data to a beam.
    pub weight: f64,
    /// When its middle beam passes after step 0, s.
    pub delay_s: f64,
    /// Its beams as rays.
    pub rays: Vec<Ray>,
    /// The direction to the middle of the body, the beam that points there, and the angle between two beams.
    towards: Point,
    beam: f64,
    beam_rad: f64,
}

/// The beams of a body's window, one of every `divisor`; none where no beam points.
pub fn window(body: &Body, scan: &Scan, divisor: usize) -> Option<Window> {
    let place = body.cloud.moments().at;
    let (beam, distance_m) = scan.beam_at(place);
    let towards = (place - scan.origin()) * (1.0 / distance_m.max(1e-6));
    let (beam_rad, delay_s) = (scan.beam_rad(), scan.delay_s(beam));
    let reach_m = (body.cloud.radius_m() + BODY_M).max(REACH_M);
    let reach_rad = if reach_m < distance_m { libm::asin(reach_m / distance_m) } else { PI };
    let reach = reach_rad / beam_rad;
    let (first, last) = (beam - reach, beam + reach);
    let beams = scan.beams() as f64;
    if last < 0.0 || first >= beams || scan.beams() == 0 {
        return None;
    }
    let grain_m = distance_m.max(0.2) * beam_rad;
    let datum_m = if body.is_unseen(body.cloud.at_s()) { DATUM_UNSEEN_M } else { DATUM_M };
    let stride = ((GRAIN_M / grain_m) as usize).max(1) * divisor;
    let (first, last) = (first.max(0.0) as usize / stride * stride, last.min(beams - 1.0) as usize);
    let weight = (stride as f64 * grain_m / datum_m).min(1.0);
    let rays = (first..=last).step_by(stride).map(|beam| Ray::along(scan.towards(beam))).collect();
    Some(Window { first, last, stride, weight, delay_s, rays, towards, beam, beam_rad })
}

impl Window {
    /// How many beams it has.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Its beams.
    pub fn beams(&self) -> impl Iterator<Item = usize> {
        (self.first..=self.last).step_by(self.stride)
    }

    /// The beam at a place among them.
    pub const fn beam(&self, place: usize) -> usize {
        self.first + place * self.stride
    }

    /// Which of its beams a packet covers, counted from its first.
    pub fn covered(&self, packet: &Packet) -> Range<usize> {
        let place = |off_rad: f64| {
            let beam = self.beam + off_rad / self.beam_rad;
            ((beam - self.first as f64) / self.stride as f64).max(0.0)
        };
        let (first_rad, last_rad) = packet.shadow_rad(self.towards);
        place(first_rad).ceil() as usize..self.len().min((place(last_rad) as usize).saturating_add(1))
    }
}
