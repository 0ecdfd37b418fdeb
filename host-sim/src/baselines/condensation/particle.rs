//! A particle, and what both filters do with many: draw, move, weigh.

use kehai_tracking::geometry::Point;

use crate::world::random::Stream;

/// A particle: s, π, and π(u) of each ID.
#[derive(Clone, Debug)]
pub(super) struct Particle {
    pub(super) at: Point,
    pub(super) velocity: Point,
    pub(super) place: f64,
    pub(super) ids: Vec<f64>,
}

/// Eq. 2, and the particle's own velocity after it.
pub(super) fn step(particle: &mut Particle, step_s: f64, wander: f64, random: &mut Stream) {
    let noise = Point::new(random.normal(), random.normal()) * (wander * step_s.sqrt());
    let moved = particle.velocity * step_s + noise;
    particle.at = particle.at + moved;
    if step_s > 0.0 {
        // Half of it: a walker's step, and not that of the noise, goes on.
        particle.velocity = moved * (0.5 / step_s);
    }
}

/// Eq. 3: the normal density of an offset, 1/m².
pub(super) fn normal(offset: Point, spread_m: f64) -> f64 {
    let variance_m2 = spread_m * spread_m;
    libm::exp(-0.5 * offset.dot(offset) / variance_m2) / (std::f64::consts::TAU * variance_m2)
}

/// As many particles, each as often as its weight says (systematic resampling).
pub(super) fn drawn(
    particles: &[Particle],
    weight: impl Fn(&Particle) -> f64,
    random: &mut Stream,
) -> Vec<Particle> {
    let sum: f64 = particles.iter().map(&weight).sum();
    let share = sum / particles.len() as f64;
    let (mut wanted, mut passed) = (share * random.uniform(), 0.0);
    let mut drawn = Vec::with_capacity(particles.len());
    for particle in particles {
        passed += weight(particle);
        while wanted < passed && drawn.len() < particles.len() {
            drawn.push(particle.clone());
            wanted += share;
        }
    }
    // Rounding may leave the last of them out.
    while let (true, Some(last)) = (drawn.len() < particles.len(), drawn.last().cloned()) {
        drawn.push(last);
    }
    drawn
}

/// The weighted mean of places; None without weight.
pub(super) fn mean(particles: &[Particle], weight: impl Fn(&Particle) -> f64) -> Option<Point> {
    let sum: f64 = particles.iter().map(&weight).sum();
    let weighted =
        particles.iter().fold(Point::default(), |sum, particle| sum + particle.at * weight(particle));
    (sum > 0.0).then(|| weighted * (1.0 / sum))
}
