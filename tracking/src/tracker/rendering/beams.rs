//! The beams of a body's window as the other bodies explain them, each one's likelihood ready to be asked for.
//!
//! ```text
//!   others' fields ─▶ mixture of each beam, or nothing where it does not depend on the body
//!                     ┆··▪▪▪▪▪▪··▪▪··┆      from the first that tells of the body to the last: the others are not cast
//! ```

use std::ops::Range;

use wide::f32x8;

use super::ellipse::{Edge, LANES};
use super::field::Field;
use super::packet::{Met, Packet};
use super::ray::Mixture;
use super::scan::Scan;
use super::window::Window;

/// So many ratios are multiplied in single precision: each is between 0.004 and 150, and their product between 10⁻²⁰ and 10¹⁸.
const MULTIPLIED: usize = 8;

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct Beams {
    /// One for each beam of the window.
    mixtures: Vec<Mixture>,
    telling: Range<usize>,
}

impl Beams {
    /// Of a window, with what the other bodies put in its way.
    pub fn of(scan: &Scan, window: &Window, others: &[&Field]) -> Self {
        let mut surfaces = Vec::new();
        let mixture = |beam| {
            surfaces.clear();
            surfaces.extend(others.iter().filter_map(|field| field.at(beam)).copied());
            Mixture::new(scan.measured(beam), &mut surfaces)
        };
        let mixtures: Vec<Mixture> = window.beams().map(mixture).collect();
        let telling = 0..mixtures.len();
        Self { mixtures, telling }
    }

    /// Silences those that tell nothing of a body of which no part is nearer to the module than this, m.
    pub fn silence(&mut self, nearest_m: f64) {
        let mut telling: Option<Range<usize>> = None;
        for (place, mixture) in self.mixtures.iter_mut().enumerate() {
            if mixture.tells(nearest_m) {
                telling = Some(telling.map_or(place, |telling| telling.start)..place + 1);
            } else {
                *mixture = Mixture::SILENT;
            }
        }
        self.telling = telling.unwrap_or_default();
    }

    /// One for each beam of the window.
    pub fn mixtures(&self) -> &[Mixture] {
        &self.mixtures
    }

    /// Places of the beams of which some tell of the body.
    pub const fn telling(&self) -> &Range<usize> {
        &self.telling
    }

    /// Likelihood of all beams with what they meet of each of eight samples, over that without it. `met`: room for that.
    pub fn ratios(&self, packet: &Packet, window: &Window, edge: Edge, met: &mut Vec<Met>) -> [f64; LANES] {
        let covered = window.covered(packet);
        let places = covered.start.max(self.telling.start)..covered.end.min(self.telling.end);
        let (mut all, mut some, mut multiplied) = ([1.0; LANES], f32x8::ONE, 0);
        let mut fold = |some: f32x8| {
            for (all, some) in all.iter_mut().zip(some.to_array()) {
                *all *= f64::from(some);
            }
        };
        let (Some(mixtures), Some(rays)) = (self.mixtures.get(places.clone()), window.rays.get(places))
        else {
            return all;
        };
        packet.meet(rays, edge, met);
        for (mixture, Met { near, far }) in mixtures.iter().zip(met.iter()) {
            if mixture.is_silent() {
                continue;
            }
            some *= far.as_ref().map_or_else(|| mixture.ratios(near), |far| mixture.ratios_of_two(near, far));
            multiplied += 1;
            if multiplied % MULTIPLIED == 0 {
                fold(some);
                some = f32x8::ONE;
            }
        }
        fold(some);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::Body;
    use super::super::cloud::Cloud;
    use super::super::ellipse::Outline;
    use super::super::field::render;
    use super::super::sample::{Arm, Sample};
    use super::super::scan::Measured;
    use super::super::window::window;
    use super::*;
    use crate::geometry::Point;

    /// Samples beside each other at a distance, one in three of them with an arm.
    fn body(x_m: f64) -> Body {
        let sample = |number: i32| {
            let at = Point::new(x_m, 0.01 * f64::from(number));
            let arm = (number % 3 == 0).then_some(Arm { hand: Point::new(0.3, 0.3), is_level: true });
            Sample { arm, ..Sample::new(at, Point::new(0.0, 0.2), Point::new(0.0, 1.0)) }
        };
        Body::begin(1, 5.0, Cloud::new((-20..20).map(sample).collect(), 0.0))
    }

    #[test]
    fn eight_samples_at_once_are_as_likely_as_each_of_them_before_every_beam() {
        let mut scan = Scan::at_origin();
        let measured = |beam| if beam % 5 < 3 { Measured::Hit(1.9) } else { Measured::Free(2.1) };
        scan.set((0..scan.beams()).map(measured).collect());
        let (edge, own, other) = (Edge::of(true), body(2.0), body(2.6));
        let field = render(&other, &scan, &window(&other, &scan, 1).unwrap(), edge);
        let window = window(&own, &scan, 1).unwrap();
        let beams = Beams::of(&scan, &window, &[&field]);
        let (mut least, mut seen, mut room): (f64, _, _) = (1.0, 0, Vec::new());
        for packet in Packet::all(own.cloud.samples(), scan.origin(), window.delay_s) {
            let fast = beams.ratios(&packet, &window, edge, &mut room);
            for (place, fast) in packet.places().zip(fast) {
                let sample = &own.cloud.samples()[place];
                let moved = |outline: Outline| Outline {
                    middle: outline.middle + sample.velocity * window.delay_s,
                    ..outline
                };
                let mut slow = 1.0;
                for (number, mixture) in beams.mixtures().iter().enumerate() {
                    let towards = scan.towards(window.beam(number));
                    let (opacity, range_m) = moved(sample.torso()).meet_one(towards, edge);
                    let alone = |opacity, range_m| mixture.ratio_alone(opacity, range_m);
                    slow *= match sample.outline_of_arm().map(|arm| moved(arm).meet_one(towards, edge)) {
                        None => alone(opacity, range_m),
                        Some((arm, arm_m)) if arm_m < range_m => {
                            arm * alone(1.0, arm_m) + (1.0 - arm) * alone(opacity, range_m)
                        }
                        Some((arm, arm_m)) => {
                            opacity * alone(1.0, range_m) + (1.0 - opacity) * alone(arm, arm_m)
                        }
                    };
                }
                assert!((fast / slow - 1.0).abs() < 1e-3, "{place}: {fast} {slow}");
                (least, seen) = (least.min(slow), seen + 1);
            }
        }
        assert!(least < 0.5 && seen == 40, "{least} {seen}");
    }
}
