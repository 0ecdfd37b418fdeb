//! The tracker with rules, to compare with: an occluded track is kept until the place has been seen empty.
//!
//! ```text
//!   observation ─▶ divide ─▶ associate ─▶ update ──────────────▶ detected
//!                  merged      seen tracks first,  missed detection ─▶ look: free space, there, or occlusion
//!                  detections  then occluded,      unassigned ───────▶ part of a person? new track? birth
//!                              then tentative
//! ```
//!
//! | step of a multi-target tracker | file |
//! |---|---|
//! | prediction, process noise, covariance | `../kalman.rs` |
//! | gate, active set | `near`, `associate` |
//! | splitting of merged detections | `divide` |
//! | data association | `associate` |
//! | track state, existence probability, confirmation | `track` |
//! | birth | `birth` |
//! | missed detections, existence decay, deletion | `lifetime` |
//! | occlusion, line of sight | `occlusion`, `line_of_sight`, `../walls.rs` |
//! | duplicate tracks, fragments, attachments | `twins`, `birth`, `parts` |
//! | sizes of bodies | `size` |
//! | clutter: things and reflections | `../attachments/stir.rs`, `../reflections.rs` |
//! | ablation switches | `ablation` |

pub mod ablation;
mod associate;
mod birth;
mod boxes;
mod divide;
mod lifetime;
mod line_of_sight;
mod near;
mod occlusion;
mod parts;
mod restore;
mod size;
#[cfg(test)]
mod tests;
mod track;
mod twins;
mod vehicle;

use super::floor_plan::FloorPlan;
use super::history::History;
use super::kalman::PROCESS_NOISE;
use super::reflections::Reflections;
use super::{TrackId, TrackState, Tracker};
use crate::geometry::Point;
use crate::observation::{Detection, Observation};
use crate::site::Site;
use crate::site::change::SiteChange;
use ablation::{Idea, Ideas};
use associate::other_leg;
use near::Near;
use track::Track;
use vehicle::Vehicle;

/// Two tracks nearer than this are at the same place, m: two bodies cannot be.
const TWINS_M: f64 = 0.33;

/// What is nearer to a module touches it, and has no place, mm.
const TOUCHING_MM: u16 = 80;

/// What the face of a mover is unsure by, mm.
const FACE_MM: u16 = 60;

/// For so long after a module began, a person inside was there before, s.
const BEGINNING_S: f64 = 10.0;

/// A module that was silent for so long begins anew, s.
const SILENT_S: f64 = 2.0;

/// Displacement that proves a track is a person, m.
const MOVED_M: f64 = 0.3;

/// Two tracks that came as one have parted at this distance, m: a thing is not carried farther away.
const PARTED_M: f64 = 1.0;

/// A track that is faster than this walks, m/s: half a slow walk, and more than a jump between a chair's legs.
const WALKING_MPS: f64 = 0.5;

/// A track that has not moved for so long rests, s.
const RESTS_S: f64 = 1.0;

/// See the module.
pub struct RuleTracker {
    plan: FloorPlan,
    ideas: Ideas,
    /// In the order of their numbers.
    tracks: Vec<Track>,
    near: Near,
    reflections: Reflections,
    vehicles: Vec<Vehicle>,
    next_id: u32,
    /// The newest observation's time.
    now_s: f64,
    /// Time of the newest observation before this one: up to then existence has decayed.
    passed_s: f64,
    /// Number of the observation.
    scan: u64,
    modules: Vec<Heard>,
}

/// When a module was heard.
#[derive(Clone, Copy)]
struct Heard {
    since_s: f64,
    last_s: f64,
}

impl Heard {
    const NEVER: Self = Self { since_s: f64::NEG_INFINITY, last_s: f64::NEG_INFINITY };
}

impl RuleTracker {
    /// A tracker without tracks.
    #[must_use]
    pub fn new(site: &Site, ideas: Ideas) -> Self {
        Self {
            plan: FloorPlan::of(site),
            ideas,
            tracks: Vec::new(),
            near: Near::over(site),
            reflections: Reflections::default(),
            vehicles: Vec::new(),
            next_id: 1,
            now_s: 0.0,
            passed_s: 0.0,
            scan: 0,
            modules: vec![Heard::NEVER; site.modules.len()],
        }
    }

    /// Notes that a module was heard, and which tracks are within its reach.
    fn note(&mut self, observation: &Observation) {
        self.passed_s = self.now_s;
        self.now_s = self.now_s.max(observation.start_s);
        self.scan += 1;
        if let Some(heard) = self.modules.get_mut(observation.view.module) {
            if observation.start_s - heard.last_s > SILENT_S {
                heard.since_s = observation.start_s;
            }
            heard.last_s = heard.last_s.max(observation.start_s);
        }
        self.find_near(observation);
    }

    /// Whether people may have been inside before the module of this observation began.
    fn is_beginning(&self, observation: &Observation) -> bool {
        let heard = self.modules.get(observation.view.module);
        heard.is_none_or(|heard| observation.start_s - heard.since_s < BEGINNING_S)
    }

    /// Positions of the tracks that the module detects.
    fn seen_places(&self, at_s: f64) -> Vec<(u32, Point)> {
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        let seen = near.filter(|track| track.near_in == self.scan && track.is_seen());
        seen.map(|track| (track.id, track.motion.place(at_s))).collect()
    }

    /// Whether a person gets to a place only across an entry.
    fn is_enclosed(&self, place: Point) -> bool {
        self.plan.enclosed.hold(place)
    }

    /// Whether no track is confirmed at a place: a door leaf or a curtain moves there, or it is excluded.
    fn confirms_nobody(&self, place: Point) -> bool {
        self.plan.movers.hold(place) || self.is_excluded(place)
    }

    /// Whether no track begins at a place.
    fn is_excluded(&self, place: Point) -> bool {
        self.plan.excluded.hold(place)
    }

    /// The observation with everything before a door leaf or a curtain taken as empty, up to its outline: of a body
    /// only its nearest point says what is empty, of a leaf its whole face does. None without one.
    fn before_movers(&self, observation: &Observation) -> Option<Observation> {
        if self.plan.movers.is_empty() || !observation.detections.iter().any(|seen| self.plan.is_mover(seen))
        {
            return None;
        }
        let mut cleared = observation.clone();
        for seen in observation.detections.iter().filter(|seen| self.plan.is_mover(seen)) {
            let geometry = &observation.view.geometry;
            let candidate = &seen.candidate;
            for beam in geometry.beam(candidate.first_step)..=geometry.beam(candidate.last_step) {
                let face_mm = divide::range_mm(candidate, geometry.step(beam)).saturating_sub(FACE_MM);
                if let Some(empty_mm) = cleared.empty_mm.get_mut(usize::from(beam)) {
                    *empty_mm = face_mm.max(*empty_mm);
                }
            }
        }
        Some(cleared)
    }

    /// Clears the doubt about tracks that walk. If two tracks came as one and one of them walks out, that one is the
    /// person who came in: the other may be a thing, and has to move first.
    fn explain(&mut self) {
        for place in 0..self.near.now.len() {
            let index = self.near.now[place];
            let track = &self.tracks[index];
            if track.hit_in != self.scan || track.is_occluded() {
                continue;
            }
            let place = track.motion.place(track.last_hit_s);
            let is_inside = self.is_enclosed(place);
            let track = &mut self.tracks[index];
            track.is_inside = is_inside;
            if (place - track.rest.0).length() > MOVED_M {
                track.rest = (place, if track.walks() { track.last_hit_s } else { track.rest.1 });
            }
            let has_moved = |from: Point| track.walks() && (place - from).length() > MOVED_M;
            if track.stirring.is_somebody() || track.unexplained.is_some_and(has_moved) {
                track.unexplained = None;
            }
            self.let_go(index);
            let track = &self.tracks[index];
            if track.confirmed && track.beside.is_some() && self.ideas.has(Idea::Doubt) {
                self.separate(index);
            }
        }
    }

    /// Checks whether a track that appeared beside another has parted from it, and which of the two walked.
    fn separate(&mut self, index: usize) {
        let Some(other) = self.tracks[index].beside.and_then(|other| self.find(other)) else {
            self.tracks[index].beside = None;
            return;
        };
        let place = |index: usize| self.tracks[index].place(self.now_s).0;
        if (place(index) - place(other)).length() < PARTED_M {
            return;
        }
        let rests = |index: usize| self.now_s - self.tracks[index].rest.1 > RESTS_S;
        let is_inside = |index: usize| self.tracks[index].is_inside;
        for (walks, stays) in [(index, other), (other, index)] {
            if !is_inside(walks) && is_inside(stays) && rests(stays) {
                let rest = self.tracks[stays].rest.0;
                self.tracks[stays].doubt(rest);
                // What came in with one of them came in with the other.
                let (walks, stays) = (self.tracks[walks].id, self.tracks[stays].id);
                for track in self.tracks.iter_mut().filter(|track| track.beside == Some(stays)) {
                    track.beside = (track.id != walks).then_some(walks);
                }
                return;
            }
        }
        let walks = |track: &Track| track.walks() && track.motion.velocity().length() > WALKING_MPS;
        if walks(&self.tracks[index]) && walks(&self.tracks[other]) {
            self.tracks[index].beside = None;
        }
    }
}

impl Tracker for RuleTracker {
    fn observe(&mut self, observation: &Observation) {
        let with_movers = self.before_movers(observation);
        let observation = with_movers.as_ref().unwrap_or(observation);
        self.note(observation);
        let places: Vec<Point> =
            self.seen_places(observation.start_s).into_iter().map(|(_, place)| place).collect();
        let from = self.plan.walls.seen_from(&observation.view.pose);
        let is_thing = |seen: &&Detection| seen.candidate.near_mm < TOUCHING_MM || self.plan.is_mover(seen);
        let stands_out = observation.detections.iter().filter(|seen| !is_thing(seen));
        let (reflected, real): (Vec<&Detection>, Vec<&Detection>) =
            stands_out.partition(|seen| self.plan.is_reflection(from, seen));
        self.reflections.follow(reflected.into_iter(), self.now_s, || {
            self.next_id += 1;
            TrackId::from(self.next_id - 1)
        });
        let estimator = self.ideas.estimator();
        let has_division = self.ideas.has(Idea::Division);
        let mut pieces = Vec::with_capacity(real.len());
        for seen in real {
            let divide = || divide::divide(seen, &observation.view, observation.start_s, &places, estimator);
            match has_division.then(divide).flatten() {
                Some(parts) => pieces.extend(parts),
                None => pieces.push(seen.clone()),
            }
        }
        let mut taken = vec![false; pieces.len()];
        for (track, index, _) in self.associate(Track::is_seen, observation, &pieces, &mut taken) {
            if self.tracks[track].company.is_some() {
                self.compare(track, &pieces[index]);
                self.judge(track);
            }
            self.face(track, &pieces[index], &observation.view);
        }
        if self.ideas.has(Idea::Limbs) {
            self.drop_limbs(observation, &pieces, &mut taken);
        }
        self.associate(|track| track.confirmed && track.is_occluded(), observation, &pieces, &mut taken);
        self.drop_pieces(observation, &pieces, &mut taken);
        self.grow(observation, &pieces, &mut taken);
        self.miss(observation);
        self.fade_near(self.now_s);
        self.explain();
        self.park();
        if self.ideas.has(Idea::Twins) {
            self.part_twins(self.now_s);
        }
        self.bury_near(self.now_s);
        self.settle();
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.fade_all(at_s);
        self.settle();
        self.peek(at_s)
    }

    fn peek(&self, at_s: f64) -> Vec<TrackState> {
        self.tracks.iter().map(|track| track.state(at_s)).chain(self.reflections.states(at_s)).collect()
    }

    fn history(&self, id: TrackId) -> Option<History> {
        self.tracks.iter().find(|track| TrackId::from(track.id) == id).map(Track::history)
    }

    fn restore(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        self.take_back(people, age_s, at_s);
    }

    fn change_site(&mut self, change: &SiteChange<'_>) -> bool {
        let site = change.now;
        self.plan = FloorPlan::of(site);
        self.near = Near::over(site);
        let numbers = change.numbers_before();
        let heard = |number: &Option<usize>| number.and_then(|number| self.modules.get(number).copied());
        self.modules = numbers.iter().map(|number| heard(number).unwrap_or(Heard::NEVER)).collect();
        self.tracks.iter_mut().for_each(|track| track.renumber(&numbers));
        true
    }
}
