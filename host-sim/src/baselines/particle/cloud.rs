//! The particles of one track, as in Noguchi et al. 2009: positions only; the velocity is that of the whole cloud.
//!
//! ```text
//!     ∴∵∴        x ← x + v Δt + w       every particle, w normal
//!    ∵∴·∴∵       weight Π exp(−(dᵢ − R)²/σ²)     dᵢ: from the particle to foreground point i
//!     ∴∵         weight 0 where no person can be;  then resampled by weight
//! ```

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

use kehai_tracking::geometry::Point;

/// Parameters of one cloud: those of paper C, and those that it leaves open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CloudSettings {
    /// Particles.
    pub particles: usize,
    /// R: from the middle of the body to its outline, m.
    pub radius_m: f64,
    /// σ: how far points may be off the circle of R, m.
    pub sigma_m: f64,
    /// Deviation of the particles around the circle's centre at birth, m.
    pub seed_m: f64,
    /// Deviation of w after a second, m/√s.
    pub wander: f64,
    /// Time the velocity takes to follow, s.
    pub velocity_s: f64,
}

/// Particles and what they say together.
#[derive(Clone, Debug)]
pub struct Cloud {
    settings: CloudSettings,
    at_s: f64,
    particles: Vec<Point>,
    mean: Point,
    velocity: Point,
    covariance_m2: [f64; 3],
    random: Pcg64Mcg,
}

impl Cloud {
    /// Around a place, standing. The same `seed` gives the same cloud.
    #[must_use]
    pub fn new(at_s: f64, middle: Point, seed: u32, settings: CloudSettings) -> Self {
        let mut random = Pcg64Mcg::new(u128::from(seed) << 64 | 0x9e37_79b9_7f4a_7c15);
        let particles =
            (0..settings.particles).map(|_| middle + normal_pair(&mut random) * settings.seed_m).collect();
        let variance_m2 = settings.seed_m * settings.seed_m;
        let covariance_m2 = [variance_m2, 0.0, variance_m2];
        Self { settings, at_s, particles, mean: middle, velocity: Point::default(), covariance_m2, random }
    }

    /// When it was last moved, s.
    #[must_use]
    pub const fn at_s(&self) -> f64 {
        self.at_s
    }

    /// The middle, predicted to a time.
    #[must_use]
    pub fn place(&self, at_s: f64) -> Point {
        self.mean + self.velocity * (at_s - self.at_s)
    }

    /// m/s.
    #[must_use]
    pub const fn velocity(&self) -> Point {
        self.velocity
    }

    /// xx, xy, yy at a time, m².
    #[must_use]
    pub fn covariance_m2(&self, at_s: f64) -> [f64; 3] {
        let grown_m2 = self.settings.wander * self.settings.wander * (at_s - self.at_s).max(0.0);
        let [xx, xy, yy] = self.covariance_m2;
        [xx + grown_m2, xy, yy + grown_m2]
    }

    /// Moves the particles to `at_s`, which is not before [`at_s`](Self::at_s), weighs them by foreground points
    /// of that time, and draws them anew. False if no person can be at the place of any of them: then they are only
    /// predicted.
    pub fn follow(&mut self, at_s: f64, points: &[Point], impossible: impl Fn(Point) -> bool) -> bool {
        let step_s = (at_s - self.at_s).max(0.0);
        self.covariance_m2 = self.covariance_m2(at_s);
        let predicted = self.place(at_s);
        (self.mean, self.at_s) = (predicted, at_s);
        let (move_m, shake_m) = (self.velocity * step_s, self.settings.wander * step_s.sqrt());
        for particle in &mut self.particles {
            *particle = *particle + move_m + normal_pair(&mut self.random) * shake_m;
        }
        let weights = self.weights(points, impossible);
        let sum: f64 = weights.iter().sum();
        if sum <= 0.0 {
            return false;
        }
        let weighted = |sum: Point, (particle, weight): (&Point, &f64)| sum + *particle * *weight;
        self.mean = self.particles.iter().zip(&weights).fold(Point::default(), weighted) * (1.0 / sum);
        self.covariance_m2 = [0.0; 3];
        for (&particle, weight) in self.particles.iter().zip(&weights) {
            let (off, share) = (particle - self.mean, weight / sum);
            let [xx, xy, yy] = &mut self.covariance_m2;
            *xx += share * off.x * off.x;
            *xy += share * off.x * off.y;
            *yy += share * off.y * off.y;
        }
        self.velocity =
            self.velocity + (self.mean - predicted) * (1.0 / self.settings.velocity_s.max(step_s));
        self.draw(&weights, sum);
        true
    }

    /// Relative to the heaviest, so that products of many small factors do not vanish.
    fn weights(&self, points: &[Point], impossible: impl Fn(Point) -> bool) -> Vec<f64> {
        let CloudSettings { radius_m, sigma_m, .. } = self.settings;
        let logarithm = |particle: &Point| {
            if impossible(*particle) {
                return f64::NEG_INFINITY;
            }
            let square = |point: &Point| {
                let off_m = (*particle - *point).length() - radius_m;
                off_m * off_m
            };
            -points.iter().map(square).sum::<f64>() / (sigma_m * sigma_m)
        };
        let mut weights: Vec<f64> = self.particles.iter().map(logarithm).collect();
        let heaviest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for weight in &mut weights {
            *weight = if weight.is_finite() { libm::exp(*weight - heaviest) } else { 0.0 };
        }
        weights
    }

    /// Draws as many particles as before, each as often as its weight says (systematic resampling).
    fn draw(&mut self, weights: &[f64], sum: f64) {
        let step = sum / self.particles.len() as f64;
        let mut wanted = step * uniform(&mut self.random);
        let mut passed = 0.0;
        let mut drawn = Vec::with_capacity(self.particles.len());
        for (&particle, weight) in self.particles.iter().zip(weights) {
            passed += weight;
            while wanted < passed && drawn.len() < self.particles.len() {
                drawn.push(particle);
                wanted += step;
            }
        }
        // Rounding may leave the last of them out.
        while let (true, Some(&last)) = (drawn.len() < self.particles.len(), drawn.last()) {
            drawn.push(last);
        }
        self.particles = drawn;
    }
}

/// In [0, 1).
fn uniform(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// Two independent standard normal numbers (Box and Muller).
fn normal_pair(random: &mut Pcg64Mcg) -> Point {
    let radius = (-2.0 * libm::log(1.0 - uniform(random))).sqrt();
    Point::towards(core::f64::consts::TAU * uniform(random)) * radius
}

#[cfg(test)]
mod tests {
    use super::super::ParticleSettings;
    use super::*;

    const SETTINGS: CloudSettings = ParticleSettings::RADIUS_15.cloud;

    /// What a sensor at the origin sees of a round body of R at (`x`, 0).
    fn front(x: f64) -> Vec<Point> {
        let place = |angle_deg: i32| {
            Point::new(x, 0.0) + Point::towards(f64::from(angle_deg).to_radians()) * SETTINGS.radius_m
        };
        (110..=250).step_by(20).map(place).collect()
    }

    #[test]
    fn particles_gather_at_the_middle_of_a_body() {
        let mut cloud = Cloud::new(0.0, Point::new(2.1, 0.1), 1, SETTINGS);
        for scan in 1..6 {
            assert!(cloud.follow(f64::from(scan) * 0.1, &front(2.0), |_| false));
        }
        assert!((cloud.place(0.5) - Point::new(2.0, 0.0)).length() < 0.05, "{:?}", cloud.place(0.5));
        // Half as wide as it was at birth.
        assert!(cloud.covariance_m2(0.5)[0] < 0.25 * SETTINGS.seed_m * SETTINGS.seed_m);
    }

    #[test]
    fn a_walker_is_followed_and_predicted() {
        let mut cloud = Cloud::new(0.0, Point::new(2.0, 0.0), 1, SETTINGS);
        for scan in 1..30 {
            let at_s = f64::from(scan) * 0.1;
            assert!(cloud.follow(at_s, &front(2.0 + at_s), |_| false));
        }
        assert!((cloud.velocity() - Point::new(1.0, 0.0)).length() < 0.25, "{:?}", cloud.velocity());
        assert!((cloud.place(3.2) - Point::new(5.2, 0.0)).length() < 0.12, "{:?}", cloud.place(3.2));
    }

    #[test]
    fn particles_where_no_person_can_be_weigh_nothing() {
        // A flat front fits a body before it as well as one behind it.
        let flat: Vec<Point> = (-3..=3).map(|step| Point::new(2.0, 0.04 * f64::from(step))).collect();
        let mut cloud = Cloud::new(0.0, Point::new(2.0, 0.0), 1, SETTINGS);
        assert!(cloud.follow(0.1, &flat, |place| place.x < 2.0));
        assert!(cloud.particles.iter().all(|particle| particle.x >= 2.0));
        let before = cloud.place(0.2);
        assert!(!cloud.follow(0.2, &flat, |_| true));
        assert_eq!(cloud.place(0.2), before);
        assert_eq!(cloud.particles.len(), SETTINGS.particles);
    }

    #[test]
    fn the_same_seed_gives_the_same_cloud() {
        let run = |seed| {
            let mut cloud = Cloud::new(0.0, Point::new(2.0, 0.0), seed, SETTINGS);
            cloud.follow(0.1, &front(2.05), |_| false);
            cloud.place(0.1)
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }
}
