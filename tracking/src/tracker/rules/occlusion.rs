//! Occlusion: where an occluded person may be, as a particle filter that shrinks wherever a sensor sees free space.
//!
//! ```text
//!   last seen ·:·.     a beam passes      .·:       the particles that are left are in the shadow;
//!            .:·:·.    ─────────────▶   · :·:·       the weight that was lost says how likely
//!             ·.·:                       .·.·        it is that the person is not there at all
//! ```
//!
//! Particles move with a velocity that slows down and with random process noise; they do not pass walls.

use nalgebra::{Matrix2, Vector2};

use crate::geometry::{Point, bounds};
use crate::tracker::kalman::Kinematics;
use crate::tracker::walls::Walls;

/// Number of particles.
pub const PLACES: usize = 96;

/// How fast an occluded person's position becomes uncertain, m/√s: a person who waits shifts their weight, a person in
/// a gathering moves to another place every few seconds.
const WANDER: f64 = 0.22;

/// Time in which an occluded walker is assumed to slow down, s.
const SLOW_DOWN_S: f64 = 0.6;

/// A track that was last detected this fast towards an entry has gone through it, m/s: half a slow walk.
const LEAVING_MPS: f64 = 0.3;

/// A track that walked towards a zone and was so little time away from it, s, when last detected, goes in.
const ENTERING_S: f64 = 1.5;

/// Kernel around each particle when a detection is compared with the particles, m.
const KERNEL_M: f64 = 0.12;

/// Squared deviations from which on a place says nothing.
const FAR: f64 = 18.0;

/// A place and how much is to be said for it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Where.
    pub at: Point,
    velocity: Point,
    /// Its share.
    pub weight: f64,
}

/// Places with weights that sum to 1.
#[derive(Clone, Debug)]
pub struct Cloud {
    at_s: f64,
    places: Vec<Place>,
    /// Walked towards a zone when last seen: goes on, and in.
    enters: bool,
    random: u64,
    around: (Point, f64),
}

impl Cloud {
    /// Around where `motion` leads at `at_s`, on this side of all walls.
    #[must_use]
    pub fn new(at_s: f64, motion: &Kinematics, seen_s: f64, walls: &Walls, seed: u32) -> Self {
        let (seen, middle, spread) = (motion.place(seen_s), motion.place(at_s), motion.spread(at_s));
        let velocity = motion.velocity();
        let mut cloud = Self {
            at_s,
            places: Vec::with_capacity(PLACES),
            enters: false,
            random: u64::from(seed) * 2 + 1,
            around: (middle, 0.0),
        };
        let root = spread.cholesky().map_or_else(|| Matrix2::identity() * 0.1, |root| root.l());
        cloud.enters = walls.waits_outside(seen, velocity)
            || (velocity.length() > LEAVING_MPS && walls.enters(seen, seen + velocity * ENTERING_S));
        // A track that walked out towards an entry when last detected is through it.
        let leaves = velocity.length() > LEAVING_MPS && walls.between(seen, middle);
        let stopped = |at: Point| if leaves { walls.wall_between(seen, at) } else { walls.between(seen, at) };
        for _ in 0..PLACES {
            let offset = root * Vector2::new(cloud.normal(), cloud.normal());
            let pace = 0.6 + 0.4 * cloud.uniform();
            let at = middle + Point::new(offset.x, offset.y);
            cloud.places.push(Place {
                at: if stopped(at) { seen } else { at },
                velocity: velocity * pace,
                weight: 1.0 / PLACES as f64,
            });
        }
        cloud.enclose();
        cloud
    }

    /// Whether it may come in through an entry.
    #[must_use]
    pub const fn enters(&self) -> bool {
        self.enters
    }

    /// Predicts the particles to `at_s`. No particle goes through a wall.
    pub fn predict(&mut self, at_s: f64, walls: &Walls) {
        let step_s = at_s - self.at_s;
        if step_s <= 0.0 {
            return;
        }
        self.at_s = at_s;
        let slower = libm::exp(-step_s / if self.enters { ENTERING_S } else { SLOW_DOWN_S });
        let enters = self.enters;
        let wander_m = WANDER * step_s.sqrt();
        for index in 0..self.places.len() {
            let shake = Point::new(self.normal(), self.normal()) * wander_m;
            let place = &mut self.places[index];
            let next = place.at + place.velocity * step_s + shake;
            let stopped =
                if enters { walls.wall_between(place.at, next) } else { walls.stop(place.at, next) };
            if stopped {
                place.velocity = Point::default();
            } else {
                place.at = next;
                place.velocity = place.velocity * slower;
            }
        }
        self.enclose();
    }

    /// Weights every particle by the likelihood of the observation there; returns the mean likelihood.
    pub fn weigh(&mut self, mut likelihood: impl FnMut(Point) -> f64) -> f64 {
        let mut sum = 0.0;
        for place in &mut self.places {
            place.weight *= likelihood(place.at);
            sum += place.weight;
        }
        if sum > 0.0 {
            for place in &mut self.places {
                place.weight /= sum;
            }
        }
        self.renew();
        sum
    }

    /// The mean likelihood of the observation over the particles, which stay as they are.
    pub fn expect(&self, mut likelihood: impl FnMut(Point) -> f64) -> f64 {
        self.places.iter().map(|place| place.weight * likelihood(place.at)).sum()
    }

    /// Resamples the particles where a few of them carry all the weight.
    fn renew(&mut self) {
        let squares: f64 = self.places.iter().map(|place| place.weight * place.weight).sum();
        if squares * (PLACES as f64) < 2.0 {
            return;
        }
        let offset = self.uniform();
        let mut chosen = Vec::with_capacity(PLACES);
        let (mut index, mut passed) = (0, self.places[0].weight);
        for number in 0..PLACES {
            let share = (number as f64 + offset) / PLACES as f64;
            while passed < share && index + 1 < self.places.len() {
                index += 1;
                passed += self.places[index].weight;
            }
            chosen.push(Place { weight: 1.0 / PLACES as f64, ..self.places[index] });
        }
        self.places = chosen;
    }

    /// Density of the particles at a measured place, per m².
    #[must_use]
    pub fn density(&self, place: Vector2<f64>, noise: &Matrix2<f64>) -> f64 {
        let spread = noise + Matrix2::identity() * (KERNEL_M * KERNEL_M);
        let (middle, radius_m) = self.around;
        let far_m = (place - Vector2::new(middle.x, middle.y)).norm() - radius_m;
        if far_m > 0.0 && far_m * far_m > FAR * spread.trace() {
            return 0.0;
        }
        let Some(inverse) = spread.try_inverse() else { return 0.0 };
        let scale = 1.0 / (core::f64::consts::TAU * spread.determinant().sqrt());
        let one = |candidate: &Place| {
            let off = place - Vector2::new(candidate.at.x, candidate.at.y);
            let distance = (off.transpose() * inverse * off)[(0, 0)];
            if distance > FAR { 0.0 } else { candidate.weight * libm::exp(-0.5 * distance) }
        };
        self.places.iter().map(one).sum::<f64>() * scale
    }

    /// A circle around all places: its middle, and its radius in m.
    #[must_use]
    pub const fn around(&self) -> (Point, f64) {
        self.around
    }

    fn enclose(&mut self) {
        let (low, high) = bounds(self.places.iter().map(|place| place.at)).unwrap_or_default();
        self.around = ((low + high) * 0.5, (high - low).length() * 0.5);
    }

    /// Mean and covariance of the place.
    #[must_use]
    pub fn moments(&self) -> (Point, Matrix2<f64>) {
        let mean = self.places.iter().fold(Point::default(), |sum, place| sum + place.at * place.weight);
        let mut spread = Matrix2::identity() * 1e-4;
        for place in &self.places {
            let off = place.at - mean;
            let off = Vector2::new(off.x, off.y);
            spread += off * off.transpose() * place.weight;
        }
        (mean, spread)
    }

    fn uniform(&mut self) -> f64 {
        self.random =
            self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 40) as f64 / (1_u64 << 24) as f64
    }

    /// Sum of four uniforms: near enough to normal for particles.
    fn normal(&mut self) -> f64 {
        let sum: f64 = (0..4).map(|_| self.uniform()).sum();
        (sum - 2.0) * 1.732
    }
}
