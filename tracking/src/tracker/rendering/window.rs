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
use super::sample::Sample;
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
    let mut hold = |outline: &Outline| {
        let (middle, reach) = aim.shadow(outline, scan);
        first = first.min(middle - reach);
        last = last.max(middle + reach);
    };
    for sample in body.cloud.samples() {
        hold(&sample.torso());
        if let Some(arm) = sample.outline_of_arm() {
            hold(&arm);
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

    /// No part of these samples is nearer to the module, m.
    pub fn nearest_m(&self, samples: &[Sample], scan: &Scan) -> f64 {
        let origin = scan.origin();
        let nearest_m = |outline: &Outline, moved: Point| {
            (outline.middle + moved - origin).length() - outline.across_m.max(outline.along_m)
        };
        let of_sample = |sample: &Sample| {
            let moved = sample.velocity * self.delay_s;
            let torso_m = nearest_m(&sample.torso(), moved);
            sample.outline_of_arm().map_or(torso_m, |arm| torso_m.min(nearest_m(&arm, moved)))
        };
        samples.iter().map(of_sample).fold(f64::INFINITY, f64::min)
    }

    /// Which of its beams an outline covers, of some of them, counted from its first.
    pub fn covered(&self, outline: &Outline, scan: &Scan, of: &Range<usize>) -> Range<usize> {
        let (middle, reach) = self.aim.shadow(outline, scan);
        let place = |beam: f64| ((beam - self.first as f64) / self.stride as f64).max(0.0);
        let to = (place(middle + reach) as u32 as usize + 1).min(of.end);
        let from = place(middle - reach);
        let before = from as u32;
        let from = before as usize + usize::from(from > f64::from(before));
        from.max(of.start).min(to)..to
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
    #[inline]
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
