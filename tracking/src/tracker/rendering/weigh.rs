//! Weighing: the samples of one body are weighed by the likelihood of the scan, given all other bodies.
//!
//! ```text
//!   others' fields ─▶ mixture of each beam ─▶ log likelihood ratio of each sample ─▶ weights, existence
//! ```

use super::apart::{apart, keepers};
use super::body::{COARSE, FINE, HIDDEN, SAMPLES};
use super::ground::Ground;
use super::ray::Mixture;
use super::scan::Scan;
use super::window::{Window, covered, shadow};
use super::{Part, Rendering};

/// Power of the likelihood in the first look (annealing).
const TEMPER: f64 = 0.3;

/// A look at a scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Look {
    /// With a tempered likelihood: the cloud walks to the data.
    Coarse,
    /// With the whole likelihood.
    Fine,
}

impl Rendering {
    /// One look of one body at a scan: weighs its samples. Returns what the scan says of its existence.
    pub(super) fn look(&mut self, index: usize, scan: &Scan, window: Window, look: Look) -> f64 {
        let mixtures = self.mixtures(index, scan, window);
        if mixtures.iter().all(Option::is_none) {
            return 0.0;
        }
        let keepers = if self.model.has(Part::Apart) { keepers(&self.bodies, index) } else { Vec::new() };
        let tables = self.tables;
        let ratios: Vec<f64> = self.bodies[index]
            .samples
            .iter()
            .map(|sample| {
                let ellipse = sample.ellipse(scan.origin(), window.delay_s);
                let (middle, reach) = shadow(sample.at, scan);
                let mut product = 1.0;
                for (beam, mixture) in covered(window, middle, reach).zip_mixtures(&mixtures) {
                    let (opacity, range_m) = ellipse.meet(scan.towards(beam), tables);
                    if opacity > 0.0 {
                        product *= mixture.ratio(opacity, range_m, tables);
                    }
                }
                window.weight * libm::log(product.max(1e-300)) + apart(sample.at, sample.heading, &keepers)
            })
            .collect();
        let (least, most) =
            ratios.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &ratio| {
                (least.min(ratio), most.max(ratio))
            });
        let ground = Ground {
            walls: &self.walls,
            enclosed: &self.enclosed,
            guards: self.model.has(Part::Entries),
            scans: &self.scans,
            newest: scan,
        };
        let standing = self.is_standing(index, self.bodies[index].at_s);
        let body = &mut self.bodies[index];
        if most - least > 0.01 {
            match look {
                Look::Coarse => {
                    body.weigh(&ratios, TEMPER);
                    body.resample(COARSE, ground, &mut self.random);
                }
                Look::Fine => {
                    body.weigh(&ratios, 1.0);
                    if body.effective() < SAMPLES as f64 / 2.0 {
                        let roughness = if standing { HIDDEN } else { FINE };
                        body.resample(roughness, ground, &mut self.random);
                    }
                }
            }
        }
        best(ratios, if self.model.has(Part::BestQuarter) { 4 } else { 1 })
    }

    /// The beams of a window without this body.
    fn mixtures(&self, index: usize, scan: &Scan, window: Window) -> Vec<Option<Mixture>> {
        let mut surfaces = Vec::new();
        (window.first..=window.last)
            .step_by(window.stride)
            .map(|beam| {
                surfaces.clear();
                let others = self.fields.iter().enumerate().filter(|(other, _)| *other != index);
                surfaces.extend(others.filter_map(|(_, field)| field.at(beam)).copied());
                Mixture::new(scan.measured(beam), &mut surfaces)
            })
            .collect()
    }
}

/// Log mean of the exponentials of the best part, one in `of`: is there any place that the scan does not contradict?
pub fn best(mut ratios: Vec<f64>, of: usize) -> f64 {
    let quarter = (ratios.len() / of).max(1);
    ratios.sort_unstable_by(|one, other| other.total_cmp(one));
    let Some(&most) = ratios.first() else { return 0.0 };
    let sum: f64 = ratios.iter().take(quarter).map(|ratio| libm::exp(ratio - most)).sum();
    most + libm::log(sum / quarter as f64)
}
