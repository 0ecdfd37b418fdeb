//! Paper A's tracker, step by step as written: the baseline.
//!
//! ```text
//!   candidates ─▶ centre at r_c (eq. 6) ─▶ nearest to each predicted person, inside the gate ─▶ Kalman (eq. 1–5)
//!                                          left over and body-like, nobody near ─▶ appearance
//!   person without a candidate: occluded, stays at the predicted place ─▶ after a while: disappearance
//! ```
//!
//! What the paper leaves open (gate, suppression, hits, forgetting) was found by a search over forty sets in an
//! independent simulation; the sets are named here by their r_c.

use nalgebra::{Matrix2, Vector2};

use super::kalman::Kinematics;
use super::{LifeCycle, TrackState, Tracker};
use crate::geometry::Point;
use crate::sighting::{Seen, Sighting};

/// What the paper leaves open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LeeSettings {
    /// Farthest a candidate may be from the predicted place, m.
    pub gate_m: f64,
    /// Nobody appears nearer than this to somebody, m.
    pub suppression_m: f64,
    /// Fewest beams of a candidate.
    pub beams: u16,
    /// Smallest width of a candidate, m.
    pub width_m: f64,
    /// Candidates until an appearance is somebody.
    pub hits: u32,
    /// Forgotten after so long without a candidate, s.
    pub forget_s: f64,
}

impl LeeSettings {
    /// With r_c = 19 cm.
    pub const RADIUS_19: Self =
        Self { gate_m: 0.6, suppression_m: 0.6, beams: 4, width_m: 0.2, hits: 12, forget_s: 5.0 };
    /// With r_c = 38 cm taken as a radius.
    pub const RADIUS_38: Self = Self { gate_m: 0.8, suppression_m: 0.8, ..Self::RADIUS_19 };
}

/// Deviation of a measured centre, m: what eq. 6 is off by on a body.
const CENTRE_M: f64 = 0.08;

/// Spectral density of a pedestrian's acceleration, m²/s³.
const AGILITY: f64 = 1.0;

/// An appearance is forgotten after so long without a candidate, s.
const APPEARANCE_S: f64 = 1.0;

struct Person {
    id: u32,
    motion: Kinematics,
    hits: u32,
    last_hit_s: f64,
    confirmed: bool,
    occluded: bool,
}

/// A person without a candidate for so long is occluded, s: two scans of one sensor.
const OCCLUDED_S: f64 = 0.25;

/// Paper A's tracker.
pub struct Lee {
    settings: LeeSettings,
    people: Vec<Person>,
    next_id: u32,
}

impl Lee {
    /// Nobody yet.
    #[must_use]
    pub const fn new(settings: LeeSettings) -> Self {
        Self { settings, people: Vec::new(), next_id: 1 }
    }

    fn forget(&mut self, now_s: f64) {
        let forget_s = self.settings.forget_s;
        self.people.retain(|person| {
            let patience_s = if person.confirmed { forget_s } else { APPEARANCE_S };
            now_s - person.last_hit_s <= patience_s
        });
    }
}

impl Tracker for Lee {
    fn see(&mut self, sighting: &Sighting) {
        let settings = self.settings;
        let noise = Matrix2::identity() * (CENTRE_M * CENTRE_M);
        let like_a_body =
            |seen: &&Seen| seen.candidate.beams >= settings.beams && seen.width_m >= settings.width_m;
        let bodies: Vec<&Seen> = sighting.seen.iter().filter(like_a_body).collect();
        let mut taken = vec![false; bodies.len()];
        for person in &mut self.people {
            let distance_m = |seen: &Seen| {
                let place = person.motion.place(seen.at_s);
                (seen.centre - Vector2::new(place.x, place.y)).norm()
            };
            let nearest = bodies
                .iter()
                .enumerate()
                .filter(|(index, _)| !taken[*index])
                .map(|(index, seen)| (index, distance_m(seen)))
                .min_by(|one, other| one.1.total_cmp(&other.1));
            let Some((index, distance_m)) = nearest else { continue };
            if distance_m > settings.gate_m {
                continue;
            }
            taken[index] = true;
            let seen = bodies[index];
            person.motion.update(seen.at_s, seen.centre, &noise);
            person.hits += 1;
            person.confirmed |= person.hits >= settings.hits;
            person.last_hit_s = person.last_hit_s.max(seen.at_s);
            person.occluded = false;
        }
        for (seen, _) in bodies.iter().zip(&taken).filter(|(_, taken)| !**taken) {
            let centre = Point::new(seen.centre.x, seen.centre.y);
            let near =
                |person: &Person| (person.motion.place(seen.at_s) - centre).length() < settings.suppression_m;
            if !self.people.iter().any(near) {
                let motion = Kinematics::new(seen.at_s, seen.centre, &noise, 1.0, AGILITY);
                let confirmed = settings.hits <= 1;
                self.people.push(Person {
                    id: self.next_id,
                    motion,
                    hits: 1,
                    last_hit_s: seen.at_s,
                    confirmed,
                    occluded: false,
                });
                self.next_id += 1;
            }
        }
        for person in &mut self.people {
            let until_s = person.last_hit_s + OCCLUDED_S;
            if !person.occluded && sighting.start_s > until_s {
                person.motion.stop(until_s);
                person.occluded = true;
            }
        }
        self.forget(sighting.start_s);
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.forget(at_s);
        let state = |person: &Person| {
            let seen = at_s - person.last_hit_s < 0.25;
            let (state, reason) = match (person.confirmed, seen) {
                (false, _) => (LifeCycle::Tentative, "appeared"),
                (true, true) => (LifeCycle::Confirmed, "seen"),
                (true, false) => (LifeCycle::Occluded, "no candidate"),
            };
            let spread = person.motion.spread(at_s);
            TrackState {
                id: person.id,
                at: person.motion.place(at_s),
                velocity: person.motion.velocity(),
                covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
                state,
                existence: if person.confirmed { 1.0 } else { 0.5 },
                reason,
                unexplained: false,
            }
        };
        self.people.iter().map(state).collect()
    }
}
