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
    aim: Aim,
}

/// The beams of a body's window, one of every `divisor`; none where no beam points.
pub fn window(body: &Body, scan: &Scan, divisor: usize) -> Option<Window> {
    let aim = Aim::at(body.cloud.moments().at, scan);
    let delay_s = scan.delay_s(aim.beam);
    let reach_m = (body.cloud.radius_m() + BODY_M).max(REACH_M);
    let reach_rad = if reach_m < aim.distance_m { libm::asin(reach_m / aim.distance_m) } else { PI };
    let reach = reach_rad / scan.beam_rad();
    let (first, last) = (aim.beam - reach, aim.beam + reach);
    let beams = scan.beams() as f64;
    if last < 0.0 || first >= beams || scan.beams() == 0 {
        return None;
    }
    let grain_m = aim.distance_m.max(0.2) * scan.beam_rad();
    let datum_m = if body.is_unseen(body.cloud.at_s()) { DATUM_UNSEEN_M } else { DATUM_M };
    let stride = ((GRAIN_M / grain_m) as usize).max(1) * divisor;
    let (first, last) = (first.max(0.0) as usize / stride * stride, last.min(beams - 1.0) as usize);
    let weight = (stride as f64 * grain_m / datum_m).min(1.0);
    let rays = (first..=last).step_by(stride).map(|beam| Ray::along(scan.towards(beam))).collect();
    Some(Window { first, last, stride, weight, delay_s, rays, aim })
}

impl Window {
    /// How many beams it has.
    pub fn len(&self) -> usize {
        (self.last - self.first) / self.stride + 1
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
    pub fn covered(&self, packet: &Packet, scan: &Scan) -> Range<usize> {
        let (first, last) = self.aim.shadow(packet, scan);
        let place = |beam: f64| ((beam - self.first as f64) / self.stride as f64).max(0.0);
        place(first).ceil() as usize..self.len().min((place(last) as usize).saturating_add(1))
    }
}

/// The direction to the middle of a body, from which angles to what it covers are counted.
#[derive(Clone, Copy, Debug)]
struct Aim {
    towards: Point,
    beam: f64,
    distance_m: f64,
}

impl Aim {
    fn at(place: Point, scan: &Scan) -> Self {
        let (beam, distance_m) = scan.beam_at(place);
        let towards = (place - scan.origin()) * (1.0 / distance_m.max(1e-6));
        Self { towards, beam, distance_m }
    }

    /// The first and the last beam that a packet covers.
    fn shadow(&self, packet: &Packet, scan: &Scan) -> (f64, f64) {
        let (first_rad, last_rad) = packet.shadow_rad(self.towards);
        let beam = |off_rad: f64| self.beam + off_rad / scan.beam_rad();
        (beam(first_rad), beam(last_rad))
    }
}
