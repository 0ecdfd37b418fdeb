//! The tracker of Lee et al. 2006 (docs/bibliography.md, paper A), step by step as written: a baseline.
//!
//! ```text
//!   candidates ─▶ centre at r_c (eq. 6) ─▶ nearest to each predicted person, inside the gate ─▶ Kalman (eq. 1–5)
//!                                          unassigned, body-like, no person near ─▶ appearance
//!   person without a candidate: occluded, stays at the predicted place ─▶ after a while: disappearance
//! ```
//!
//! The paper clusters the points of a scan itself. Here candidates come from the modules, which part things 0.12 m
//! or a body's flank apart, and are clustered again by their outlines:
//!
//! ```text
//!   ●·····    ······●      two neighbours on the outline differ in range by more than d_th, and by more than
//!        ╲····╱            a body's flank does over the beams between them: two clusters
//! ```
//!
//! What the paper leaves open (d_th, gate, suppression, hits, forgetting) was found by a search over forty sets in
//! an independent simulation; the sets are named here by their r_c.

use ::kehai::candidate::Candidate;
use ::kehai::centre::Estimator;
use ::kehai::cluster::FLANK_RADIUS_MM;
use nalgebra::{Matrix2, Vector2};

use super::outline;
use kehai_tracking::geometry::Point;
use kehai_tracking::observation::{Detection, Observation, View};
use kehai_tracking::tracker::kalman::Kinematics;
use kehai_tracking::tracker::{LifeCycle, Origin, TrackState, Tracker};

/// Parameters that the paper leaves open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LeeSettings {
    /// r_c: the middle of a person lies so far behind both ends of a cluster, mm.
    pub radius_mm: u16,
    /// d_th: neighbours on an outline whose ranges differ by more are two clusters, mm.
    pub step_mm: u16,
    /// Farthest a candidate may be from the predicted place, m.
    pub gate_m: f64,
    /// No person appears nearer than this to another person, m.
    pub suppression_m: f64,
    /// Fewest beams of a candidate.
    pub beams: u16,
    /// Smallest width of a candidate, m.
    pub width_m: f64,
    /// Candidates until an appearance is confirmed as a person.
    pub hits: u32,
    /// Forgotten after so long without a candidate, s.
    pub forget_s: f64,
}

impl LeeSettings {
    /// With r_c = 19 cm.
    pub const RADIUS_19: Self = Self {
        radius_mm: 190,
        step_mm: 100,
        gate_m: 0.6,
        suppression_m: 0.6,
        beams: 4,
        width_m: 0.2,
        hits: 12,
        forget_s: 5.0,
    };
    /// With r_c = 38 cm taken as a radius.
    pub const RADIUS_38: Self = Self { radius_mm: 380, gate_m: 0.8, suppression_m: 0.8, ..Self::RADIUS_19 };
}

/// Deviation of a measured centre, m: what eq. 6 is off by on a body.
const CENTRE_M: f64 = 0.08;

/// Spectral density of a pedestrian's acceleration, m²/s³.
const PROCESS_NOISE: f64 = 1.0;

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
    /// A tracker without tracks.
    #[must_use]
    pub const fn new(settings: LeeSettings) -> Self {
        Self { settings, people: Vec::new(), next_id: 1 }
    }

    /// The clusters that the paper would have made of a candidate.
    fn clusters(&self, seen: &Detection, observation: &Observation) -> Vec<Detection> {
        let estimator = Estimator::TwoPoint { radius_mm: self.settings.radius_mm };
        let pieces = cut(&seen.candidate, &observation.view, self.settings.step_mm);
        pieces
            .into_iter()
            .map(|piece| Detection::new(piece, &observation.view, observation.start_s, estimator))
            .collect()
    }

    fn forget(&mut self, now_s: f64) {
        let forget_s = self.settings.forget_s;
        self.people.retain(|person| {
            let patience_s = if person.confirmed { forget_s } else { APPEARANCE_S };
            now_s - person.last_hit_s <= patience_s
        });
    }
}

/// Cuts a candidate wherever two neighbours on its outline are more than `step_mm` apart in range, and more than a
/// body's flank can be.
fn cut(candidate: &Candidate, view: &View, step_mm: u16) -> Vec<Candidate> {
    let outline = outline::ranges(candidate, &view.geometry);
    let joins = |one: &(u16, u16), other: &(u16, u16)| {
        let sideways_mm =
            f32::from(other.0 - one.0) * view.geometry.beam_rad() * f32::from(one.1.min(other.1));
        let flank_mm = (2.0 * FLANK_RADIUS_MM as f32 * sideways_mm).sqrt();
        f32::from(one.1.abs_diff(other.1)) <= flank_mm.max(f32::from(step_mm))
    };
    let pieces: Vec<&[(u16, u16)]> = outline.chunk_by(joins).collect();
    if pieces.len() < 2 {
        return vec![candidate.clone()];
    }
    let piece = |points: &[(u16, u16)]| {
        let [(first, first_mm), .., (last, last_mm)] = *points else { return None };
        let (_, mid_mm) = *points.get(points.len() / 2)?;
        Some(Candidate {
            first_step: view.geometry.step(first),
            last_step: view.geometry.step(last),
            first_mm,
            mid_mm,
            last_mm,
            beams: last - first + 1,
            ..candidate.clone()
        })
    };
    pieces.into_iter().filter_map(piece).collect()
}

impl Tracker for Lee {
    fn observe(&mut self, observation: &Observation) {
        let settings = self.settings;
        let noise = Matrix2::identity() * (CENTRE_M * CENTRE_M);
        let like_a_body =
            |seen: &&Detection| seen.candidate.beams >= settings.beams && seen.width_m >= settings.width_m;
        let clusters: Vec<Detection> =
            observation.detections.iter().flat_map(|seen| self.clusters(seen, observation)).collect();
        let bodies: Vec<&Detection> = clusters.iter().filter(like_a_body).collect();
        let mut taken = vec![false; bodies.len()];
        for person in &mut self.people {
            let distance_m = |seen: &Detection| {
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
                let motion = Kinematics::new(seen.at_s, seen.centre, &noise, 1.0, PROCESS_NOISE);
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
            if !person.occluded && observation.start_s > until_s {
                person.motion.stop(until_s);
                person.occluded = true;
            }
        }
        self.forget(observation.start_s);
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.forget(at_s);
        self.peek(at_s)
    }

    fn peek(&self, at_s: f64) -> Vec<TrackState> {
        let state = |person: &Person| {
            let seen = at_s - person.last_hit_s < 0.25;
            let (state, reason) = match (person.confirmed, seen) {
                (false, _) => (LifeCycle::Tentative, "appeared"),
                (true, true) => (LifeCycle::Confirmed, "seen"),
                (true, false) => (LifeCycle::Occluded, "no candidate"),
            };
            let spread = person.motion.spread(at_s);
            TrackState {
                id: person.id.into(),
                at: person.motion.place(at_s),
                velocity: person.motion.velocity(),
                covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
                state,
                existence: if person.confirmed { 1.0 } else { 0.5 },
                reason,
                origin: Origin::Entered,
            }
        };
        self.people.iter().map(state).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::kehai::scan::{Geometry, URG_04LX};
    use kehai_tracking::geometry::Pose;

    fn view() -> View {
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        View {
            module: 0,
            pose,
            height_m: 0.6,
            geometry: Geometry::new(URG_04LX).unwrap(),
            upside_down: false,
        }
    }

    /// Nine beams with a range, `apart` from each other, the middle one straight ahead.
    fn candidate(apart: u16, ranges_mm: [u16; 9]) -> Candidate {
        let [first_mm, .., last_mm] = ranges_mm;
        let near_mm = ranges_mm.into_iter().min().unwrap();
        let near = ranges_mm.iter().position(|range_mm| *range_mm == near_mm).unwrap() as u16;
        Candidate {
            first_step: view().geometry.step(360 - 4 * apart),
            last_step: view().geometry.step(360 + 4 * apart),
            first_mm,
            last_mm,
            near_mm,
            near_step: view().geometry.step(360 - 4 * apart + apart * near),
            mid_mm: ranges_mm[4],
            beams: 8 * apart + 1,
            contour: ranges_mm[1..8].iter().map(|range_mm| ((range_mm - near_mm) / 4) as u8).collect(),
            ..Candidate::default()
        }
    }

    fn beams(candidate: &Candidate, step_mm: u16) -> Vec<(u16, u16)> {
        let geometry = view().geometry;
        let ends = |piece: &Candidate| (geometry.beam(piece.first_step), geometry.beam(piece.last_step));
        cut(candidate, &view(), step_mm).iter().map(ends).collect()
    }

    #[test]
    fn a_person_behind_another_is_a_cluster_of_their_own() {
        let two = candidate(5, [1000, 1000, 1000, 1000, 1000, 1160, 1160, 1160, 1160]);
        assert_eq!(beams(&two, 100), [(340, 360), (365, 380)]);
        assert_eq!(beams(&two, 200), [(340, 380)]);
    }

    #[test]
    fn the_flank_of_a_body_is_not_cut_off() {
        // A disc of 0.2 m a metre away, as far as it is seen: its last points lie more than 0.1 m apart.
        let one = candidate(8, [976, 853, 821, 805, 800, 805, 821, 853, 976]);
        assert_eq!(beams(&one, 100), [(328, 392)]);
    }
}
