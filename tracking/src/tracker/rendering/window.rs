//! Which beams concern a body.
//!
//! ```text
//!            ·:·.            window: every `stride`-th beam from the first to the last that a sample may cover
//!   ●╌╌╌╌╌╌╌·:·:·╌╌╌╌╌
//!     ╲       ·.·            on both sides those that a stretched arm would cover
//! ```

use std::ops::Range;

use super::body::Body;
use super::ellipse::{Fan, MISS, Outline};
use super::scan::Scan;
use crate::geometry::Point;

/// Arc of silhouette that is one independent datum, m: neighbouring beams share the error of the shape, which an arm of 8 cm
/// makes on both of its sides. Of a body that is not seen a sliver comes into view, and each arm's width of it counts.
const DATUM_M: f64 = 0.15;
const DATUM_UNSEEN_M: f64 = 0.08;

/// Beams nearer to each other than this at a body are left out, m; at one that is not seen, of which a sliver may come
/// into view, every one counts that is this far from the next.
const GRAIN_M: f64 = 0.06;
const GRAIN_UNSEEN_M: f64 = 0.03;

/// An arm reaches so far beyond the torso, m.
const REACH_M: f64 = 0.45;

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
    /// Directions of its beams.
    pub fan: Fan,
    aim: Aim,
}

/// The beams of a body's window, one of every `divisor`; none where no beam points.
pub fn window(body: &Body, scan: &Scan, divisor: usize) -> Option<Window> {
    let aim = Aim::at(body.cloud.moments().at, scan);
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in body.cloud.samples() {
        for outline in [Some(sample.torso()), sample.arm()].into_iter().flatten() {
            let (middle, reach) = aim.shadow(&outline, scan);
            first = first.min(middle - reach);
            last = last.max(middle + reach);
        }
    }
    let reach = REACH_M / aim.distance_m.max(0.3) / scan.beam_rad();
    (first, last) = (first - reach, last + reach);
    let beams = scan.beams() as f64;
    if last < 0.0 || first >= beams || scan.beams() == 0 {
        return None;
    }
    let grain_m = aim.distance_m.max(0.2) * scan.beam_rad();
    let is_unseen = body.is_unseen(body.cloud.at_s());
    let (grain, datum_m) = if is_unseen { (GRAIN_UNSEEN_M, DATUM_UNSEEN_M) } else { (GRAIN_M, DATUM_M) };
    let stride = ((grain / grain_m) as usize).max(1) * divisor;
    let (first, last) = (first.max(0.0) as usize / stride * stride, last.min(beams - 1.0) as usize);
    Some(Window {
        first,
        last,
        stride,
        weight: (stride as f64 * grain_m / datum_m).min(1.0),
        delay_s: scan.delay_s(aim.beam),
        fan: Fan::of((first..=last).step_by(stride).map(|beam| scan.towards(beam))),
        aim,
    })
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

    /// Which of its beams an outline covers, counted from its first.
    pub fn covered(&self, outline: &Outline, scan: &Scan) -> Range<usize> {
        let (middle, reach) = self.aim.shadow(outline, scan);
        let place = |beam: f64| ((beam - self.first as f64) / self.stride as f64).max(0.0);
        let to = (place(middle + reach) as usize + 1).min(self.len());
        (place(middle - reach).ceil() as usize).min(to)..to
    }
}

/// A direction: beams near it are found without an arc tangent each.
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

    /// Middle beam of what an outline covers, and how many beams on each side.
    fn shadow(&self, outline: &Outline, scan: &Scan) -> (f64, f64) {
        let offset = outline.middle - scan.origin();
        let (ahead_m, aside_m) = (offset.dot(self.towards), self.towards.cross(offset));
        let half = 1.05 * MISS * outline.half_width_m(offset) / offset.dot(offset).max(0.09);
        // Series of the arc sine and of the arc tangent: off by a third of a beam at most.
        let half_rad = if half < 0.5 { half + half * half * half / 6.0 } else { libm::asin(half.min(1.0)) };
        let middle = if aside_m.abs() < 0.5 * ahead_m {
            let slope = aside_m / ahead_m;
            let square = slope * slope;
            self.beam + slope * (1.0 - square * (1.0 / 3.0 - 0.2 * square)) / scan.beam_rad()
        } else {
            scan.beam_at(outline.middle).0
        };
        (middle, half_rad / scan.beam_rad())
    }
}
