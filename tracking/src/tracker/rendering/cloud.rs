//! A cloud: weighted samples of where a body may be, how it moves, where it looks and how large it is.
//!
//! ```text
//!   samples · ·:·.   predict ─▶ weigh by the scan ─▶ resample, roughen
//! ```
//!
//! What a sample is and how it moves: [`super::sample`].

use wide::f32x8;

use super::ellipse::LANES;
use super::ground::Way;
use super::random::Random;
use super::sample::{HIDDEN, Manner, Roughness, SURPRISED, Sample, Shocks, Step, WAITS_MPS, WALKS_MPS};
use crate::geometry::Point;

/// Samples of a cloud. A hidden body needs them: with 100, 65 of 100 come out as themselves, with 240, 87.
pub const SAMPLES: usize = 240;

/// So many are left to a cloud whose deviation is below [`COMPACT_M`], as that of a body in view is: it fills less room. With 80 samples
/// places in view are half a centimetre worse; with 240 they are no better, but those of thighs.
const COMPACT: usize = 112;
const COMPACT_M: f64 = 0.1;

/// One pair of samples in this many takes another velocity in each step, of one who walks or of one who waits in turn. People in a
/// crowd stop, turn and reverse within 0.2 s. An acceleration that allows for it, drawn anew in each step, adds up to 3 m/s, with which
/// a cloud leaves its person for another's place.
const ANEW: usize = 5;

/// A step of prediction is no longer than this, s, as between two scans of one module; nor are there more: after ten seconds a person
/// may be anywhere at any rate.
const STEP_S: f64 = 0.2;
const STEPS: f64 = 50.0;

/// Share of the samples that stretch out an arm in a scan that shows something near which no body explains.
const STRETCHES: f64 = 0.05;

/// Price of doing so, as a log likelihood: an arm is out a tenth of the time, for a second, so it is stretched out in one scan of 200
/// (0.05 s) where this does it in one of 20; and a hand may be anywhere within reach, 1.6 m², where this puts it beside one of
/// some ten hits, on 0.03 m²: 0.1 · 0.03 / 1.6, e to the power of −6.3.
const STRETCH_PRICE: f64 = 6.0;

/// One in so many samples of a body that no scan has looked for is tried where something comes into view: a dozen of them; the others
/// stay where the body is believed to be.
const REAPPEARS: usize = 20;

/// Area over which such samples are spread, m²: as wide as a body, and as deep as its middle may be behind its contour.
const SPOT_M2: f64 = 0.07;

/// A sample whose log likelihood is so far below the best one's weighs nothing: 10⁻¹³ of it.
const NOTHING: f64 = -30.0;

/// A body's middle is so far behind its contour, m.
pub const BEHIND_M: (f64, f64) = (0.08, 0.22);

/// Mean and spread of a cloud.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    pub at: Point,
    /// Covariance of the place: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    pub velocity: Point,
}

impl Moments {
    fn of(samples: &[Sample], weights: &[f64]) -> Self {
        let weighted = || samples.iter().zip(weights);
        let (at, velocity) =
            weighted().fold(<(Point, Point)>::default(), |(at, velocity), (sample, weight)| {
                (at + sample.at * *weight, velocity + sample.velocity * *weight)
            });
        let square = |[xx, xy, yy]: [f64; 3], (sample, weight): (&Sample, &f64)| {
            let off = sample.at - at;
            [xx + weight * off.x * off.x, xy + weight * off.x * off.y, yy + weight * off.y * off.y]
        };
        Self { at, covariance_m2: weighted().fold([0.0; 3], square), velocity }
    }

    /// Variance of the place over both directions, m².
    pub fn variance_m2(&self) -> f64 {
        self.covariance_m2[0] + self.covariance_m2[2]
    }
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Cloud {
    samples: Vec<Sample>,
    /// They sum to 1, or to less from [`reach`](Self::reach) until they are weighed.
    weights: Vec<f64>,
    moments: Moments,
    /// Time of the samples, s.
    at_s: f64,
    /// As many as it began with: more it never has.
    whole: usize,
}

impl Cloud {
    /// Of samples that are equally likely.
    pub fn new(samples: Vec<Sample>, at_s: f64) -> Self {
        let weights = vec![1.0 / samples.len().max(1) as f64; samples.len()];
        let moments = Moments::of(&samples, &weights);
        let whole = samples.len();
        Self { samples, weights, moments, at_s, whole }
    }

    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// One weight for each sample.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The samples with their weights.
    pub fn weighted(&self) -> impl Iterator<Item = (&Sample, f64)> {
        self.samples.iter().zip(self.weights.iter().copied())
    }

    pub const fn moments(&self) -> &Moments {
        &self.moments
    }

    /// No sample is farther from the mean, m.
    pub fn radius_m(&self) -> f64 {
        let square = |sample: &Sample| (sample.at - self.moments.at).dot(sample.at - self.moments.at);
        self.samples.iter().map(square).fold(0.0, f64::max).sqrt()
    }

    /// Time of the samples, s.
    pub const fn at_s(&self) -> f64 {
        self.at_s
    }

    /// Moves the cloud to `at_s`, as far as the ground allows.
    pub fn predict(&mut self, at_s: f64, manner: Manner, way: Way<'_>, random: &mut Random) {
        let step_s = at_s - self.at_s;
        if step_s <= 0.0 {
            return;
        }
        self.at_s = at_s;
        // After a gap, in steps that are as short as between scans: in one, the velocity at its end would hold for all of it.
        let steps = (step_s / STEP_S).ceil().clamp(1.0, STEPS);
        let step = Step::new(step_s / steps, manner);
        for _ in 0..steps as usize {
            let way = way.around(self.moments.at, self.radius_m());
            for (index, two) in self.samples.chunks_mut(2).enumerate() {
                let shocks = Shocks::draw(random);
                for (sample, shocks) in two.iter_mut().zip([shocks, shocks.mirrored()]) {
                    sample.predict(&step, anew_mps(index), &way, shocks);
                    sample.gesture(&step, random);
                }
            }
        }
        self.settle();
    }

    /// The weights times the exponentials of `log_ratios` times `power`; they sum to 1.
    pub fn weighed(&self, log_ratios: &[f64], power: f64) -> Vec<f64> {
        let mut weights = relatives(log_ratios, power);
        weights.iter_mut().zip(&self.weights).for_each(|(weight, own)| *weight *= own);
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            let inverse = 1.0 / sum;
            weights.iter_mut().for_each(|weight| *weight *= inverse);
        } else {
            weights.fill(1.0 / self.samples.len().max(1) as f64);
        }
        weights
    }

    /// Takes these weights, one for each sample; they sum to 1.
    pub fn take(&mut self, weights: Vec<f64>) {
        debug_assert_eq!(weights.len(), self.samples.len());
        self.weights = weights;
        self.settle();
    }

    /// Draws as many samples anew by their weights (systematic resampling), and roughens them on their side of walls.
    pub fn resample(&mut self, roughness: Roughness, way: Way<'_>, random: &mut Random) {
        let compact = self.moments.variance_m2() < COMPACT_M * COMPACT_M;
        let count = if compact { self.whole * COMPACT / SAMPLES } else { self.whole };
        self.draw(count, roughness, way, random);
    }

    fn draw(&mut self, count: usize, roughness: Roughness, way: Way<'_>, random: &mut Random) {
        let way = way.around(self.moments.at, self.radius_m());
        let mut drawn = Vec::with_capacity(count);
        let (mut passed, mut index) = (self.weights.first().copied().unwrap_or(1.0), 0);
        let (step, last) = (1.0 / count.max(1) as f64, self.samples.len().saturating_sub(1));
        let mut place = random.uniform() * step;
        let mut shocks = Shocks::draw(random);
        for number in 0..count {
            while passed < place && index < last {
                index += 1;
                passed += self.weights[index];
            }
            place += step;
            shocks = if number % 2 == 0 { Shocks::draw(random) } else { shocks.mirrored() };
            drawn.push(self.samples[index].roughened(roughness, &way, shocks));
        }
        self.samples = drawn;
        self.even_out();
    }

    /// Draws more samples if there are fewer than of a body that is not seen: it may be in many places.
    pub fn spread(&mut self, way: Way<'_>, random: &mut Random) {
        if self.samples.len() < self.whole {
            self.draw(self.whole, HIDDEN, way, random);
        }
    }

    /// Lets some samples stretch out an arm to one of these places, which no body explains.
    pub fn reach(&mut self, unexplained: &[Point], random: &mut Random) {
        if unexplained.is_empty() {
            return;
        }
        let price = libm::exp(-STRETCH_PRICE);
        for (sample, weight) in self.samples.iter_mut().zip(&mut self.weights) {
            if sample.arm.is_some() || random.uniform() > STRETCHES {
                continue;
            }
            let drawn = (random.uniform() * unexplained.len() as f64) as usize;
            if let Some(&place) = unexplained.get(drawn)
                && sample.reach(place, random)
            {
                *weight *= price;
            }
        }
    }

    /// Density of the cloud at a place, each sample as a normal distribution with this deviation, up to a factor of 2π, 1/m².
    pub fn density(&self, at: Point, kernel_m: f64) -> f64 {
        let kernel = |(sample, weight): (&Sample, f64)| {
            let off_m = (sample.at - at).length() / kernel_m;
            weight * libm::exp(-0.5 * off_m * off_m)
        };
        self.weighted().map(kernel).sum::<f64>() / (kernel_m * kernel_m)
    }

    /// Moves some samples of a body that no scan has looked for to behind contours that no body explains, of a module at `origin`. A sample
    /// there is as likely as the cloud is dense there, and not as often as it is tried (importance sampling).
    pub fn reappear(
        &mut self,
        contours: &[Point],
        (origin, kernel_m): (Point, f64),
        may_go: impl Fn(Point, Point) -> bool,
        random: &mut Random,
    ) {
        let share = 1.0 / REAPPEARS as f64;
        let first = (random.uniform() * REAPPEARS as f64) as usize;
        let mut moved = Vec::new();
        for index in (first..self.samples.len()).step_by(REAPPEARS) {
            let drawn = (random.uniform() * contours.len() as f64) as usize;
            let (Some(&contour), Some(&sample)) = (contours.get(drawn), self.samples.get(index)) else {
                break;
            };
            let at = behind(contour, origin, random);
            if may_go(sample.at, at) {
                let expected = self.density(at, kernel_m) / core::f64::consts::TAU * SPOT_M2;
                moved.push((index, at, expected / ((1.0 - share) * expected + share)));
            }
        }
        let even = 1.0 / self.samples.len().max(1) as f64;
        for (index, at, weight) in moved {
            self.samples[index] = Sample { at, velocity: Point::default(), ..self.samples[index] };
            self.weights[index] = even * weight;
        }
        let sum: f64 = self.weights.iter().sum();
        self.weights.iter_mut().for_each(|weight| *weight /= sum);
        self.settle();
    }

    /// Roughens every third sample: the body must be somewhere that no scan contradicts.
    pub fn surprise(&mut self, standing: bool, way: Way<'_>, random: &mut Random) {
        let velocity_mps = if standing { HIDDEN.velocity_mps } else { SURPRISED.velocity_mps };
        let roughness = Roughness { velocity_mps, ..SURPRISED };
        for sample in self.samples.iter_mut().step_by(3) {
            *sample = sample.roughened(roughness, &way, Shocks::draw(random));
        }
        self.settle();
    }

    /// Multiplies the weight of each sample by a factor. Returns what was left of their sum; if nothing was, the weights stay, and
    /// the body where it was.
    pub fn thin(&mut self, factor: impl Fn(&Sample) -> f64) -> f64 {
        let weights: Vec<f64> = self.weighted().map(|(sample, weight)| weight * factor(sample)).collect();
        let left: f64 = weights.iter().sum();
        if left > 0.0 {
            self.take(weights.into_iter().map(|weight| weight / left).collect());
        }
        left
    }

    fn even_out(&mut self) {
        let count = self.samples.len();
        self.weights.clear();
        self.weights.resize(count, 1.0 / count.max(1) as f64);
        self.settle();
    }

    fn settle(&mut self) {
        self.moments = Moments::of(&self.samples, &self.weights);
    }
}

/// Deviation of the velocity that a pair of samples takes in this step, if it takes another, m/s.
const fn anew_mps(pair: usize) -> Option<f64> {
    match pair % (2 * ANEW) {
        0 => Some(WALKS_MPS),
        ANEW => Some(WAITS_MPS),
        _ => None,
    }
}

/// A place of a body behind a contour that a module at `origin` sees.
pub fn behind(contour: Point, origin: Point, random: &mut Random) -> Point {
    let way = contour - origin;
    let way = way * (1.0 / way.length().max(1e-6));
    let (across, along) = random.pair();
    let behind_m = BEHIND_M.0 + (BEHIND_M.1 - BEHIND_M.0) * random.uniform();
    contour + way * (behind_m + 0.02 * along) + way.left() * (0.08 * across)
}

/// How likely something is beside the best, by the difference of the log likelihoods. Most are far below it.
pub fn relative(log_ratio: f64) -> f64 {
    if log_ratio < NOTHING { 0.0 } else { libm::exp(log_ratio) }
}

/// How likely each is beside the most likely one, by the log likelihoods times `power`.
pub fn relatives(log_ratios: &[f64], power: f64) -> Vec<f64> {
    let most = log_ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut relatives = Vec::with_capacity(log_ratios.len() + LANES);
    for lanes in log_ratios.chunks(LANES) {
        let off: [f32; LANES] =
            std::array::from_fn(|lane| lanes.get(lane).map_or(0.0, |ratio| (power * (ratio - most)) as f32));
        relatives.extend(exponentials(f32x8::from(off)).to_array().map(f64::from));
    }
    relatives.truncate(log_ratios.len());
    relatives
}

/// Exponentials of what is not positive; 0 below [`NOTHING`]. Off by 10⁻⁵ of it above −5 and by 2 % at −30.
fn exponentials(logs: f32x8) -> f32x8 {
    let is_something = f32x8::splat(NOTHING as f32).simd_lt(logs);
    // The series of a 64th, and its square six times.
    let part = logs.fast_max(f32x8::splat(NOTHING as f32)) * (1.0 / 64.0);
    let series = 1.0 + part * (1.0 + part * (0.5 + part * (1.0 / 6.0 + part * (1.0 / 24.0))));
    let power = (0..6).fold(series, |power, _| power * power);
    is_something.bitselect(power, f32x8::ZERO)
}

/// Effective share of samples with these weights, which sum to 1.
pub fn effective(weights: &[f64]) -> f64 {
    let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
    1.0 / (squares * weights.len() as f64).max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_of_which_nothing_is_left_stays_where_it_was() {
        let sample = |x| Sample::new(Point::new(x, 5.0), Point::default(), Point::new(1.0, 0.0));
        let mut cloud = Cloud::new(vec![sample(3.0), sample(4.0)], 0.0);
        assert_eq!(cloud.thin(|_| 0.0), 0.0);
        assert_eq!(cloud.moments().at, Point::new(3.5, 5.0));
        assert_eq!(cloud.thin(|sample| if sample.at.x > 3.5 { 0.5 } else { 0.0 }), 0.25);
        assert_eq!(cloud.moments().at, Point::new(4.0, 5.0));
    }

    #[test]
    fn how_likely_each_is_beside_the_most_likely_is_an_exponential() {
        let ratios: Vec<f64> = (0..75).map(|step| 3.0 - 0.5 * f64::from(step)).collect();
        for power in [1.0, 0.3] {
            let all = relatives(&ratios, power);
            assert_eq!(all.len(), ratios.len());
            for (relative, ratio) in all.iter().zip(&ratios) {
                let log = power * (ratio - 3.0);
                let off = relative / libm::exp(log) - 1.0;
                let most = if log > -5.0 { 1e-5 } else { 0.02 };
                assert!(off.abs() < most || (*relative == 0.0 && log <= NOTHING), "{log}: {relative}");
            }
        }
    }
}
