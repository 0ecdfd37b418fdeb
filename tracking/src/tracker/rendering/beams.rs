//! The beams of a body's window as the other bodies explain them, each one's likelihood ready to be asked for.
//!
//! ```text
//!   others' fields ─▶ mixture of each beam, or nothing where it does not depend on the body
//!                     ┆··▪▪▪▪▪▪··▪▪··┆      from the first that tells of the body to the last: the others are not cast
//! ```

use std::array::from_fn;
use std::ops::Range;

use super::ellipse::{Block, LANES};
use super::field::Field;
use super::ray::{Mixture, Noise};
use super::scan::Scan;
use super::surfaces::{Layer, Met};
use super::window::Window;

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct Beams {
    /// One for each beam of the window, and silent ones that fill up a block.
    mixtures: Vec<Mixture>,
    /// What each hit, m.
    hits_m: Vec<f32>,
    telling: Range<usize>,
}

impl Beams {
    /// Of a window, with what the other bodies put in its way.
    pub fn of(scan: &Scan, window: &Window, others: &[&Field]) -> Self {
        let filled = window.len() + LANES;
        let mut surfaces = Vec::new();
        let mixture = |beam| {
            surfaces.clear();
            surfaces.extend(others.iter().filter_map(|field| field.at(beam)).copied());
            Mixture::new(scan.measured(beam), &mut surfaces)
        };
        let mut mixtures = Vec::with_capacity(filled);
        mixtures.extend(window.beams().map(mixture));
        let telling = 0..mixtures.len();
        mixtures.resize(filled, Mixture::SILENT);
        let hits_m = mixtures.iter().map(Mixture::hit_m).collect();
        Self { mixtures, hits_m, telling }
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

    /// One for each beam of the window, and some silent ones.
    pub fn mixtures(&self) -> &[Mixture] {
        &self.mixtures
    }

    /// Places of the beams of which some tell of the body.
    pub const fn telling(&self) -> &Range<usize> {
        &self.telling
    }

    /// Likelihood of some beams with what they meet, over that without it.
    #[inline]
    pub fn ratio_of_block(&self, &Block { first, opacity, range_m }: &Block, noise: Noise) -> f64 {
        let (Some(mixtures), Some(hits_m)) = (self.mixtures.get(first..), self.hits_m.get(first..)) else {
            return 1.0;
        };
        let (Some(mixtures), Some(hits_m)) = (mixtures.first_chunk(), hits_m.first_chunk()) else {
            return 1.0;
        };
        let (mixtures, hits_m): (&[Mixture; LANES], &[f32; LANES]) = (mixtures, hits_m);
        let steps = steps(hits_m, &range_m);
        let mut product = 1.0;
        for lane in 0..LANES {
            if opacity[lane] > 0.0 {
                product *= mixtures[lane].ratio(opacity[lane], range_m[lane], noise.density(steps[lane]));
            }
        }
        product
    }

    /// Likelihood of one beam with what it meets, over that without it.
    pub fn ratio(&self, place: usize, Met { near, far }: Met, noise: Noise) -> f64 {
        let Some(mixture) = self.mixtures.get(place) else { return 1.0 };
        let ratio = |Layer { opacity, range_m }: Layer| mixture.ratio_alone(opacity, range_m, noise);
        match far {
            None => ratio(near),
            // The likelihood is a mean of what the nearer one holds and of what it lets pass.
            Some(far) => {
                let held = ratio(Layer { opacity: 1.0, ..near });
                near.opacity * held + (1.0 - near.opacity) * ratio(far)
            }
        }
    }
}

/// Steps between what some beams hit and what they meet.
// Inlined, its lanes are taken apart.
#[inline(never)]
fn steps(hits_m: &[f32; LANES], range_m: &[f32; LANES]) -> [u32; LANES] {
    from_fn(|lane| Noise::steps(hits_m[lane], range_m[lane]))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::kehai::scan::{Geometry, URG_04LX};

    use super::super::body::Body;
    use super::super::cloud::Cloud;
    use super::super::ellipse::Opacity;
    use super::super::field::render;
    use super::super::sample::Sample;
    use super::super::scan::Measured;
    use super::super::surfaces::{Arms, meet};
    use super::super::window::window;
    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::observation::View;

    #[test]
    fn a_block_of_beams_is_as_likely_as_each_of_them_alone() {
        let geometry = Geometry::new(URG_04LX).unwrap();
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        let mut scan =
            Scan::of(&Arc::new(View { module: 0, pose, height_m: 1.0, geometry, upside_down: false }));
        let beams = 0..scan.beams();
        scan.set(
            beams.map(|beam| if beam % 5 < 3 { Measured::Hit(1.9) } else { Measured::Free(2.1) }).collect(),
        );
        let (opacity, noise) = (Opacity::of(true), Noise::get());
        let body = |x_m: f64| {
            let sample = |number: i32| Sample {
                at: Point::new(x_m, 0.01 * f64::from(number)),
                velocity: Point::default(),
                heading: Point::new(0.0, 1.0),
                size: 1.0,
                depth: 1.0,
                arm: None,
            };
            Body::begin(1, 5.0, Cloud::new((-20..20).map(sample).collect(), 0.0))
        };
        let (own, other) = (body(2.0), body(2.6));
        let field = render(&other, &scan, &window(&other, &scan, 1).unwrap(), opacity);
        let window = window(&own, &scan, 1).unwrap();
        let beams = Beams::of(&scan, &window, &[&field]);
        let mut least: f64 = 1.0;
        for sample in own.cloud.samples() {
            let (mut fast, mut slow) = (1.0, 1.0);
            let torso = sample.torso();
            let places = window.covered(&torso, &scan, beams.telling());
            let ellipse = torso.before(Point::default(), Point::default());
            ellipse.meet_blocks(&window.fan, places, opacity, |block| {
                fast *= beams.ratio_of_block(&block, noise)
            });
            meet(sample, (&scan, &window, beams.telling()), opacity, &mut Arms::default(), |place, met| {
                slow *= beams.ratio(place, met, noise);
            });
            assert!((fast / slow - 1.0).abs() < 1e-12, "{fast} {slow}");
            least = least.min(slow);
        }
        assert!(least < 0.5, "{least}");
    }
}
