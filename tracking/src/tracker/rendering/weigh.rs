//! Weighing: the samples of one body are weighed by the likelihood of the scan, given all other bodies.
//!
//! ```text
//!   others' fields ─▶ mixture of each beam ─▶ log likelihood ratio of each sample ─▶ weights, existence
//! ```

use super::apart::{apart, keepers};
use super::cloud::effective;
use super::field::Field;
use super::ray::Mixture;
use super::sample::{COARSE, FINE, HIDDEN, Sample};
use super::scan::{Measured, Scan};
use super::surfaces::{Arms, Met, meet};
use super::window::Window;
use super::{Part, Rendering};
use crate::geometry::Point;

/// Power of the likelihood in the first look (annealing).
const TEMPER: f64 = 0.3;

/// Effective share of the samples from which on a cloud is where the data is, and a first look need not be tempered.
const THERE: f64 = 0.2;

/// Effective share below which a cloud is resampled.
const WORN: f64 = 0.5;

/// Log likelihood ratios that differ by less say nothing about where a body is.
const FLAT: f64 = 0.01;

/// Hits farther from the middle of a body are not its arm's, m.
const ARM_M: f64 = 0.75;

/// A look at a scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Look {
    /// With a tempered likelihood, so that the cloud walks to the data, unless it is there already.
    Coarse,
    /// With the whole likelihood.
    Fine,
}

/// What came of a look.
#[derive(Clone, Copy, Debug, Default)]
pub struct Looked {
    /// What the scan says of the body's existence, as log odds.
    pub evidence: f64,
    /// Whether the scan needs no further look.
    pub done: bool,
}

impl Rendering {
    /// One look of one body at a scan: weighs its samples.
    pub(super) fn look(&mut self, index: usize, scan: &Scan, window: &Window, look: Look) -> Looked {
        let mixtures = self.mixtures(index, scan, window);
        if mixtures.iter().all(Option::is_none) {
            return Looked { evidence: 0.0, done: true };
        }
        if look == Look::Coarse && self.model.has(Part::Arms) {
            let unexplained = self.unexplained(index, (scan, window), &mixtures);
            self.bodies[index].cloud.reach(&unexplained, &mut self.random);
        }
        let log_ratios = self.log_ratios(index, (scan, window), &mixtures);
        let (least, most) =
            log_ratios.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &ratio| {
                (least.min(ratio), most.max(ratio))
            });
        let at_s = self.bodies[index].cloud.at_s();
        let standing = self.is_standing(index, at_s);
        let body = &mut self.bodies[index];
        let way = body.way(self.terrain.ground(self.model, scan), at_s);
        let whole = body.cloud.weighed(&log_ratios, 1.0);
        let tempered = look == Look::Coarse && effective(&whole) < THERE;
        if most - least > FLAT {
            if tempered {
                body.cloud.take(body.cloud.weighed(&log_ratios, TEMPER));
                body.cloud.resample(COARSE, way, &mut self.random);
            } else {
                let worn = effective(&whole) < WORN;
                body.cloud.take(whole);
                if worn {
                    body.cloud.resample(if standing { HIDDEN } else { FINE }, way, &mut self.random);
                }
            }
        }
        let of = if self.model.has(Part::BestQuarter) { 4 } else { 1 };
        Looked { evidence: best(log_ratios, of), done: !tempered }
    }

    /// Log likelihood of the scan with each sample of a body over that without it.
    fn log_ratios(
        &self,
        index: usize,
        (scan, window): (&Scan, &Window),
        mixtures: &[Option<Mixture>],
    ) -> Vec<f64> {
        let keepers = if self.model.has(Part::Apart) { keepers(&self.bodies, index) } else { Vec::new() };
        let noise = self.noise;
        let mut arms = Arms::default();
        let log_ratio = |sample: &Sample| {
            let mut product = 1.0;
            meet(sample, (scan, window), self.opacity, &mut arms, |place, Met { near, far }| {
                let Some(Some(mixture)) = mixtures.get(place) else { return };
                product *= match far {
                    None => mixture.ratio(near.opacity, near.range_m, noise),
                    // The likelihood is a mean of what the nearer one holds and of what it lets pass.
                    Some(far) => {
                        let held = mixture.ratio(1.0, near.range_m, noise);
                        let passes = mixture.ratio(far.opacity, far.range_m, noise);
                        near.opacity * held + (1.0 - near.opacity) * passes
                    }
                };
            });
            window.weight * libm::log(product.max(1e-300)) + apart(sample.at, sample.heading, &keepers)
        };
        self.bodies[index].cloud.samples().iter().map(log_ratio).collect()
    }

    /// Where something is within reach of a body that no body explains.
    fn unexplained(
        &self,
        index: usize,
        (scan, window): (&Scan, &Window),
        mixtures: &[Option<Mixture>],
    ) -> Vec<Point> {
        let middle = self.bodies[index].cloud.moments().at;
        let hit = |(beam, mixture): (usize, &Option<Mixture>)| {
            let Measured::Hit(range_m) = scan.measured(beam) else { return None };
            let place = scan.origin() + scan.towards(beam) * range_m;
            let is_clutter = mixture.as_ref().is_some_and(Mixture::is_clutter);
            (is_clutter && (place - middle).length() < ARM_M).then_some(place)
        };
        window.beams().zip(mixtures).filter_map(hit).collect()
    }

    /// The beams of a window without this body.
    fn mixtures(&self, index: usize, scan: &Scan, window: &Window) -> Vec<Option<Mixture>> {
        let others = self.fields.iter().enumerate().filter(|(other, _)| *other != index);
        let others: Vec<&Field> =
            others.map(|(_, field)| field).filter(|field| field.meets(window)).collect();
        let mut surfaces = Vec::new();
        let mixture = |beam| {
            surfaces.clear();
            surfaces.extend(others.iter().filter_map(|field| field.at(beam)).copied());
            Mixture::new(scan.measured(beam), &mut surfaces)
        };
        window.beams().map(mixture).collect()
    }
}

/// Log mean of the exponentials of the best part, one in `of`: is there any place that the scan does not contradict?
pub fn best(mut ratios: Vec<f64>, of: usize) -> f64 {
    let count = (ratios.len() / of).max(1);
    if ratios.is_empty() {
        return 0.0;
    }
    ratios.select_nth_unstable_by(count - 1, |one, other| other.total_cmp(one));
    ratios.truncate(count);
    let most = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = ratios.iter().map(|ratio| libm::exp(ratio - most)).sum();
    most + libm::log(sum / count as f64)
}
