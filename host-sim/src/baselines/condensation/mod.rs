//! The particle filter of Ota et al. 2006 (docs/bibliography.md, B): particles for all people together, a likelihood of the
//! place and one of each ID apart from it.
//!
//! ```text
//!   places z at t   draw by π ─▶ x ← x + v Δt + w (eq. 2) ─▶ π = Σ N(z; x, Σ) (eq. 3)     π(u) ← k π(u) for each ID (eq. 4)
//!   ID u read at y  places stay ─▶ π(u) = N(y; x, Σ)                                       of this ID only
//!   where is u      Σ π π(u) x / Σ π π(u) (eq. 1)
//! ```
//!
//! What the paper leaves open, and is chosen here once: v is each particle's own last step; π(u) has a floor, without which
//! eq. 4 would change nothing in eq. 1: of an ID that is not read the widely scattered particles gain weight, which is how
//! the paper explains its errors after an occlusion. `condensation-joint` is the filter without the separation: each
//! ID has particles of its own, which both kinds of readings weigh and draw.

mod joint;
mod particle;
#[cfg(test)]
mod tests;

use kehai_tracking::geometry::Point;

use crate::world::random::{Purpose, Stream};
pub use joint::Joint;
use particle::{Particle, drawn, mean, normal, step};

/// Parameters: the paper's, and those that it leaves open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// N: particles.
    pub particles: usize,
    /// Spread of a place around its particle, m, one sigma: eq. 3.
    pub place_m: f64,
    /// The same of the place of an ID.
    pub id_m: f64,
    /// Deviation of w after a second, m/√s: eq. 2.
    pub wander: f64,
    /// k of eq. 4.
    pub decay: f64,
    /// Least likelihood of an ID, as a share of the highest.
    pub least: f64,
}

impl Settings {
    /// Two panels for a place on the floor; a tag's place as exact as that. The paper does not say k: with this one people
    /// who cross are confused about as often as there (B2, development seeds).
    pub const PAPER: Self =
        Self { particles: 1000, place_m: 0.16, id_m: 0.16, wander: 0.3, decay: 0.5, least: 1e-3 };
}

/// The middle and the sides of the area in which particles begin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Area {
    /// Its middle.
    pub middle: Point,
    /// Its sides, m.
    pub sides: Point,
}

/// Particles for all people together, with an ID likelihood apart from that of the place.
#[derive(Clone, Debug)]
pub struct Condensation {
    settings: Settings,
    at_s: f64,
    ids: Vec<u64>,
    particles: Vec<Particle>,
    random: Stream,
}

impl Condensation {
    /// Particles all over the area, alike. The same `seed` gives the same filter.
    #[must_use]
    pub fn new(at_s: f64, area: Area, settings: Settings, seed: u64) -> Self {
        let mut random = Stream::new(seed, Purpose::Walk, [0xc0, 0]);
        let particle = |_| Particle {
            at: area.middle
                + Point::new(
                    area.sides.x * (random.uniform() - 0.5),
                    area.sides.y * (random.uniform() - 0.5),
                ),
            velocity: Point::default(),
            place: 1.0,
            ids: Vec::new(),
        };
        let particles = (0..settings.particles).map(particle).collect();
        Self { settings, at_s, ids: Vec::new(), particles, random }
    }

    /// Places without an ID at `at_s`: draws, moves and weighs the particles.
    pub fn places(&mut self, at_s: f64, places: &[Point]) {
        let step_s = (at_s - self.at_s).max(0.0);
        self.at_s = at_s;
        self.particles = drawn(&self.particles, |particle| particle.place, &mut self.random);
        let Settings { place_m, wander, decay, least, .. } = self.settings;
        for particle in &mut self.particles {
            step(particle, step_s, wander, &mut self.random);
            particle.place = places.iter().map(|place| normal(*place - particle.at, place_m)).sum();
        }
        // Nothing was seen anywhere near: nothing is known of which particle is right.
        if self.particles.iter().all(|particle| particle.place <= 0.0) {
            self.particles.iter_mut().for_each(|particle| particle.place = 1.0);
        }
        for id in 0..self.ids.len() {
            let least = least * normal(Point::default(), self.settings.id_m);
            for likelihood in self.particles.iter_mut().filter_map(|particle| particle.ids.get_mut(id)) {
                *likelihood = (*likelihood * decay).max(least);
            }
        }
    }

    /// An ID was read at a place.
    pub fn id(&mut self, id: u64, place: Point) {
        let index = self.ids.iter().position(|known| *known == id).unwrap_or_else(|| {
            self.ids.push(id);
            self.particles.iter_mut().for_each(|particle| particle.ids.push(0.0));
            self.ids.len() - 1
        });
        let spread_m = self.settings.id_m;
        let least = self.settings.least * normal(Point::default(), spread_m);
        for particle in &mut self.particles {
            let likelihood = normal(place - particle.at, spread_m).max(least);
            if let Some(own) = particle.ids.get_mut(index) {
                *own = likelihood;
            }
        }
    }

    /// Where an ID is: eq. 1; None before it was read.
    #[must_use]
    pub fn place_of(&self, id: u64) -> Option<Point> {
        let index = self.ids.iter().position(|known| *known == id)?;
        let weight = |particle: &Particle| particle.place * particle.ids.get(index).copied().unwrap_or(0.0);
        mean(&self.particles, weight)
    }
}
