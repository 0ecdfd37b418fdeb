//! A body: a cloud of places, velocities, headings and sizes, and the odds that it is there at all.
//!
//! ```text
//!   samples · ·:·.   predict ─▶ weigh by the scan ─▶ resample, roughen     log odds of existence
//! ```
//!
//! A sample is an ellipse of two half axes ([`super::ray`]) at a place, with a velocity, a heading and a size.

use super::ground::{AHEAD_S, Ground, Passage};
use super::random::Random;
use super::ray::Ellipse;
use crate::geometry::Point;

/// Samples of a cloud.
pub const SAMPLES: usize = 240;

/// Time in which a velocity is forgotten, s: a stride and a half; and of a body that is not seen.
const KEEPS_S: f64 = 1.2;
const KEEPS_UNSEEN_S: f64 = 0.6;

/// Process noise of the velocity, m/s per √s: people in a crowd reverse within 0.2 s; and of a body that is not seen,
/// which mostly stands.
const PROCESS_NOISE: f64 = 2.0;
const PROCESS_NOISE_UNSEEN: f64 = 0.7;

/// One sample in this many has three times the process noise.
const LIVELY: usize = 7;

/// Process noise of the place, m per √s: model error.
const DRIFT: f64 = 0.02;

/// Process noise of the heading, rad per √s: people turn on the spot.
const TURNS: f64 = 0.8;

/// Way after which the heading follows the velocity, m.
const TURN_WAY_M: f64 = 0.3;

/// Process noise of the size per √s, and the time in which it goes back to 1, s.
const GROWS: f64 = 0.03;
const ORDINARY_S: f64 = 2.0;

/// Sizes: a child to a coat.
const SIZES: std::ops::RangeInclusive<f64> = 0.75..=1.3;

/// A body is not seen when no scan has spoken for it for so long, s.
pub const UNSEEN_S: f64 = 0.3;

/// Bounds of the log odds: one in a thousand.
pub const SURE: f64 = 7.0;

/// A possible state of a body.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub at: Point,
    pub velocity: Point,
    /// Unit vector.
    pub heading: Point,
    pub size: f64,
}

/// How much a resampled cloud is roughened.
#[derive(Clone, Copy, Debug)]
pub struct Roughness {
    pub place_m: f64,
    pub velocity_mps: f64,
    pub heading_rad: f64,
}

/// After the first look.
pub const COARSE: Roughness = Roughness { place_m: 0.03, velocity_mps: 0.25, heading_rad: 0.2 };
/// After the second.
pub const FINE: Roughness = Roughness { place_m: 0.008, velocity_mps: 0.02, heading_rad: 0.03 };
/// Of a body that is not seen, which has nothing to walk to.
pub const HIDDEN: Roughness = Roughness { place_m: 0.03, velocity_mps: 0.05, heading_rad: 0.1 };
/// When a scan contradicts the whole cloud.
pub const SURPRISED: Roughness = Roughness { place_m: 0.12, velocity_mps: 0.3, heading_rad: 0.2 };

/// A body that is believed in.
#[derive(Clone, Debug)]
pub struct Body {
    pub id: u64,
    pub confirmed: bool,
    /// Log odds that it is there.
    pub log_odds: f64,
    pub samples: Vec<Sample>,
    /// Weights of the samples; they sum to 1.
    pub weights: Vec<f64>,
    /// Time of the samples, s.
    pub at_s: f64,
    /// When it began, and when a scan last spoke for it, s.
    pub begun_s: f64,
    pub supported_s: f64,
    /// Whether it was near an entry then, so that it may have left.
    pub may_leave: bool,
    /// Log odds with which it began.
    pub prior: f64,
    /// Which entries it was about to cross when a scan last spoke for it.
    pub passage: Passage,
}

impl Body {
    /// Probability that it is there.
    pub fn existence(&self) -> f64 {
        1.0 / (1.0 + libm::exp(-self.log_odds))
    }

    /// Whether no scan has spoken for it lately.
    pub fn is_unseen(&self, at_s: f64) -> bool {
        at_s - self.supported_s > UNSEEN_S
    }

    /// Which entries it may cross.
    fn passage(&self, at_s: f64) -> Passage {
        match self.passage {
            Passage::InView if self.is_unseen(at_s) => Passage::None,
            Passage::Through if at_s - self.supported_s > AHEAD_S => Passage::None,
            passage => passage,
        }
    }

    /// Moves the cloud to `at_s`, as far as the ground allows. `standing`: it mostly stands.
    pub fn predict(&mut self, at_s: f64, standing: bool, ground: Ground<'_>, random: &mut Random) {
        let step_s = at_s - self.at_s;
        if step_s <= 0.0 {
            return;
        }
        self.at_s = at_s;
        let (keeps_s, process_noise) =
            if standing { (KEEPS_UNSEEN_S, PROCESS_NOISE_UNSEEN) } else { (KEEPS_S, PROCESS_NOISE) };
        let passage = self.passage(at_s);
        let slower = libm::exp(-step_s / keeps_s);
        let root = step_s.sqrt();
        for (index, sample) in self.samples.iter_mut().enumerate() {
            let lively = if index % LIVELY == 0 { 3.0 } else { 1.0 };
            let (x, y) = random.pair();
            sample.velocity = sample.velocity * slower + Point::new(x, y) * (lively * process_noise * root);
            let (x, y) = random.pair();
            let next = sample.at + sample.velocity * step_s + Point::new(x, y) * (DRIFT * root);
            if ground.stops(sample.at, next, passage) {
                sample.velocity = Point::default();
            } else {
                sample.at = next;
            }
            let (turn, growth) = random.pair();
            let speed = sample.velocity.length();
            let follows = (speed * step_s / TURN_WAY_M).min(1.0);
            let forwards = sample.heading.cross(sample.velocity) * sample.heading.dot(sample.velocity);
            let towards = if speed > 0.0 { follows * forwards / (speed * speed) } else { 0.0 };
            sample.heading = turned(sample.heading, towards + TURNS * root * turn);
            let size = sample.size + (1.0 - sample.size) * step_s / ORDINARY_S + GROWS * root * growth;
            sample.size = size.clamp(*SIZES.start(), *SIZES.end());
        }
    }

    /// Mean and covariance (xx, xy, yy) of the place, and mean velocity.
    pub fn moments(&self) -> (Point, [f64; 3], Point) {
        let weighted = || self.samples.iter().zip(&self.weights);
        let mean = weighted().fold(Point::default(), |sum, (sample, weight)| sum + sample.at * *weight);
        let velocity =
            weighted().fold(Point::default(), |sum, (sample, weight)| sum + sample.velocity * *weight);
        let square = |[xx, xy, yy]: [f64; 3], (sample, weight): (&Sample, &f64)| {
            let off = sample.at - mean;
            [xx + weight * off.x * off.x, xy + weight * off.x * off.y, yy + weight * off.y * off.y]
        };
        (mean, weighted().fold([0.0; 3], square), velocity)
    }

    /// Effective number of samples.
    pub fn effective(&self) -> f64 {
        1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>().max(1e-300)
    }

    /// Multiplies the weights by the exponentials of `log_ratios` times `power`.
    pub fn weigh(&mut self, log_ratios: &[f64], power: f64) {
        let most = log_ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (weight, ratio) in self.weights.iter_mut().zip(log_ratios) {
            *weight *= libm::exp(power * (ratio - most));
        }
        let sum: f64 = self.weights.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            self.weights.iter_mut().for_each(|weight| *weight /= sum);
        } else {
            self.even_out();
        }
    }

    /// Draws as many samples anew by their weights (systematic resampling), and roughens them on their side of walls.
    pub fn resample(&mut self, roughness: Roughness, ground: Ground<'_>, random: &mut Random) {
        let count = self.samples.len();
        let passage = self.passage(self.at_s);
        let mut drawn = Vec::with_capacity(count);
        let (mut passed, mut index) = (self.weights.first().copied().unwrap_or(1.0), 0);
        let offset = random.uniform();
        for number in 0..count {
            let place = (number as f64 + offset) / count as f64;
            while passed < place && index + 1 < count {
                index += 1;
                passed += self.weights[index];
            }
            drawn.push(roughened(self.samples[index], roughness, passage, ground, random));
        }
        self.samples = drawn;
        self.even_out();
    }

    /// Roughens every third sample: the body must be somewhere that no scan contradicts.
    pub fn surprise(&mut self, standing: bool, ground: Ground<'_>, random: &mut Random) {
        let passage = self.passage(self.at_s);
        let velocity_mps = if standing { HIDDEN.velocity_mps } else { SURPRISED.velocity_mps };
        let roughness = Roughness { velocity_mps, ..SURPRISED };
        for sample in self.samples.iter_mut().step_by(3) {
            *sample = roughened(*sample, roughness, passage, ground, random);
        }
    }

    fn even_out(&mut self) {
        self.weights.fill(1.0 / self.samples.len().max(1) as f64);
    }
}

fn roughened(
    mut sample: Sample,
    roughness: Roughness,
    passage: Passage,
    ground: Ground<'_>,
    random: &mut Random,
) -> Sample {
    let (x, y) = random.pair();
    let next = sample.at + Point::new(x, y) * roughness.place_m;
    if !ground.stops(sample.at, next, passage) {
        sample.at = next;
    }
    let (x, y) = random.pair();
    sample.velocity = sample.velocity + Point::new(x, y) * roughness.velocity_mps;
    let (turn, _) = random.pair();
    sample.heading = turned(sample.heading, turn * roughness.heading_rad);
    sample
}

/// A unit vector turned by a small angle.
fn turned(heading: Point, angle_rad: f64) -> Point {
    let next = heading + heading.left() * angle_rad.clamp(-1.0, 1.0);
    next * (1.0 / next.length())
}

impl Sample {
    /// Its ellipse as a ray from `origin` meets it, `delay_s` after the time of the samples.
    pub fn ellipse(&self, origin: Point, delay_s: f64) -> Ellipse {
        Ellipse::new(self.at + self.velocity * delay_s - origin, self.heading, self.size)
    }
}
