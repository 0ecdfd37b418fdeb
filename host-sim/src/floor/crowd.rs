//! The feet of all people in a world: they follow from how the world moves the bodies.

use crate::world::person::Person;

use super::feet::Feet;
use super::gait::Sole;

/// Between two places of a body from which its feet follow, µs.
const GAIT_US: u64 = 10_000;

/// The feet.
#[derive(Clone, Debug)]
pub struct Crowd {
    feet: Vec<Option<Feet>>,
    now_us: u64,
}

impl Crowd {
    /// Of so many people, at time 0.
    #[must_use]
    pub fn new(people: usize) -> Self {
        Self { feet: vec![None; people], now_us: 0 }
    }

    /// Lets time pass up to `until_us`; the same people each time.
    pub fn follow(&mut self, people: &[Person], until_us: u64) {
        while self.now_us + GAIT_US <= until_us {
            self.now_us += GAIT_US;
            let at_s = self.now_us as f64 * 1e-6;
            for (person, feet) in people.iter().zip(&mut self.feet) {
                let Some(stance) = person.motion.stance(at_s) else {
                    *feet = None;
                    continue;
                };
                let feet = feet.get_or_insert_with(|| Feet::new(at_s, stance.at, stance.heading_rad));
                feet.follow(at_s, stance.at, stance.heading_rad);
            }
        }
    }

    /// The soles that are on the floor.
    #[must_use]
    pub fn soles(&self) -> Vec<Sole> {
        self.feet.iter().flatten().flat_map(Feet::soles).collect()
    }
}
