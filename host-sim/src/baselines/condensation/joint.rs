//! `condensation-joint`: the filter without the separation of places and IDs, to measure what that is worth.
//!
//! ```text
//!   each ID has particles of its own:   places z ─▶ draw, move, weigh      ID read at y ─▶ draw, move, weigh
//! ```

use kehai_tracking::geometry::Point;

use super::particle::{Particle, drawn, mean, normal, step};
use super::{Area, Condensation, Settings};
use crate::world::random::Stream;

/// The filter without the separation: each ID has particles, which places and readings weigh alike.
#[derive(Clone, Debug)]
pub struct Joint {
    settings: Settings,
    area: Area,
    seed: u64,
    /// Each ID with the time of its particles, and its particles.
    clouds: Vec<(u64, f64, Vec<Particle>, Stream)>,
}

impl Joint {
    /// With no ID read yet.
    #[must_use]
    pub const fn new(area: Area, settings: Settings, seed: u64) -> Self {
        Self { settings, area, seed, clouds: Vec::new() }
    }

    /// Places without an ID at `at_s`.
    pub fn places(&mut self, at_s: f64, places: &[Point]) {
        let spread_m = self.settings.place_m;
        let likelihood = |at: Point| places.iter().map(|place| normal(*place - at, spread_m)).sum();
        for cloud in &mut self.clouds {
            weigh(cloud, at_s, self.settings.wander, likelihood);
        }
    }

    /// An ID was read at a place, at `at_s`.
    pub fn id(&mut self, id: u64, at_s: f64, place: Point) {
        let index = self.clouds.iter().position(|cloud| cloud.0 == id).unwrap_or_else(|| {
            let all = Condensation::new(at_s, self.area, self.settings, self.seed ^ id);
            self.clouds.push((id, at_s, all.particles, all.random));
            self.clouds.len() - 1
        });
        let spread_m = self.settings.id_m;
        if let Some(cloud) = self.clouds.get_mut(index) {
            weigh(cloud, at_s, self.settings.wander, |at| normal(place - at, spread_m));
        }
    }

    /// Where an ID is; None before it was read.
    #[must_use]
    pub fn place_of(&self, id: u64) -> Option<Point> {
        let (.., particles, _) = self.clouds.iter().find(|cloud| cloud.0 == id)?;
        mean(particles, |particle| particle.place)
    }
}

/// One step of a cloud: draw, move, weigh.
fn weigh(
    (_, cloud_s, particles, random): &mut (u64, f64, Vec<Particle>, Stream),
    at_s: f64,
    wander: f64,
    likelihood: impl Fn(Point) -> f64,
) {
    let step_s = (at_s - *cloud_s).max(0.0);
    *cloud_s = at_s;
    *particles = drawn(particles, |particle| particle.place, random);
    for particle in particles.iter_mut() {
        step(particle, step_s, wander, random);
        particle.place = likelihood(particle.at);
    }
    if particles.iter().all(|particle| particle.place <= 0.0) {
        particles.iter_mut().for_each(|particle| particle.place = 1.0);
    }
}
