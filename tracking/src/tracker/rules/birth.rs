//! Track birth (initiation): what becomes of detections that no track was associated with.
//!
//! ```text
//!   unassigned ─▶ beside a person seen ───────────▶ an arm, a bag or a leg of that person
//!              ─▶ tentative, gathers evidence ────▶ confirmed
//!                  └ inside an enclosed zone, away from its entries: the likeliest occluded track, if one can be here
//! ```

use super::ablation::Idea;
use super::boxes::Faces;
use super::size;
use super::track::{SURE, THIN_M, Track};
use super::{MOVED_M, PROCESS_NOISE, RuleTracker, other_leg};
use crate::geometry::Point;
use crate::observation::{Detection, Observation};
use crate::tracker::attachments::stir::Stirring;
use crate::tracker::history::SeenBy;
use crate::tracker::kalman::Kinematics;
use nalgebra::Vector2;

/// A tentative track is deleted after so long without a candidate, s.
pub const PATIENCE_S: f64 = 0.6;

/// Evidence that confirms a track: eight whole wide candidates, 0.4 s with two modules.
const CONFIRMED_FROM: f64 = 4.0;

/// A narrow candidate so near to a detected person is a part of that person, m: an arm's reach.
const REACH_M: f64 = 0.5;

/// A wide one, m: two bodies cannot be nearer.
const BODY_M: f64 = 0.3;

/// Two appearances nearer than this are one, m: less than two bodies' middles, or two legs'.
const SAME_M: f64 = 0.3;

/// No track is initiated nearer to another, m.
const ROOM_M: f64 = 0.4;

/// What appears so near to a person may have split off from that person, m: a thing at arm's length. People who follow
/// each other keep farther apart.
const BESIDE_M: f64 = 0.8;

/// A track nearer to an entry than this may just have come in, m.
const ENTRY_M: f64 = 0.35;

/// How fast an occluded person may have walked, m/s.
const WALK_MPS: f64 = 1.0;

impl RuleTracker {
    /// Takes away what belongs to people already seen in this scan.
    pub(super) fn drop_limbs(&self, observation: &Observation, pieces: &[Detection], taken: &mut [bool]) {
        let seen = self.seen_places(observation.start_s);
        for (piece, taken) in pieces.iter().zip(taken.iter_mut()).filter(|(_, taken)| !**taken) {
            let centre = Point::new(piece.centre.x, piece.centre.y);
            let reach_m = if piece.candidate.narrow { REACH_M } else { BODY_M };
            *taken = seen.iter().any(|&(_, place)| {
                (place - centre).length() < reach_m || (place - piece.chord_middle()).length() < reach_m
            });
        }
    }

    /// Lets appearances grow on what is left, and new ones begin.
    pub(super) fn grow(&mut self, observation: &Observation, pieces: &[Detection], taken: &mut [bool]) {
        let hits = self.associate(|track| !track.confirmed, observation, pieces, taken);
        for (track, index, _) in &hits {
            self.compare(*track, &pieces[*index]);
            self.face(*track, &pieces[*index], &observation.view);
        }
        let mut ready = Vec::new();
        for (track, index, legs) in hits {
            let gain = self.evidence(&pieces[index], legs, self.tracks[track].id);
            let track = &mut self.tracks[track];
            track.existence += gain;
            let (id, at) = (track.id, track.motion.place(track.last_hit_s));
            // A person who comes through a door is confirmed behind its leaf.
            if track.existence >= CONFIRMED_FROM && track.width_m >= 0.2 && !self.confirms_nobody(at) {
                ready.push(id);
            }
        }
        self.merge_appearances(observation);
        for id in ready {
            self.confirm(id, self.is_beginning(observation));
        }
        for index in 0..pieces.len() {
            if !taken[index] {
                taken[index] = true;
                if self.is_excluded(Point::new(pieces[index].centre.x, pieces[index].centre.y)) {
                    continue;
                }
                let legs = other_leg(index, pieces[index].centre, pieces, |other| !taken[other]);
                if let Some((other, _)) = legs {
                    taken[other] = true;
                }
                self.begin(&pieces[index], legs.map(|(_, middle)| middle), observation);
            }
        }
    }

    /// Evidence of a candidate for a person of its own.
    fn evidence(&self, seen: &Detection, legs: bool, own: u32) -> f64 {
        let centre = Point::new(seen.centre.x, seen.centre.y);
        let beside = |track: &Track| {
            track.id != own
                && track.near_in == self.scan
                && track.is_seen()
                && (track.motion.place(seen.at_s) - centre).length() < ROOM_M
        };
        if self.near.now.iter().filter_map(|&index| self.tracks.get(index)).any(beside) {
            return -0.2;
        }
        let of_shape = match (seen.candidate.narrow && !legs, legs || seen.is_whole()) {
            (false, true) => 0.5,
            (false, false) => 0.3,
            (true, _) => 0.1,
        };
        size::evidence(seen, self.ideas).unwrap_or(of_shape)
    }

    fn begin(&mut self, seen: &Detection, legs: Option<Vector2<f64>>, observation: &Observation) {
        let middle = legs.unwrap_or(seen.centre);
        let centre = Point::new(middle.x, middle.y);
        let beside = self.beside(centre, seen.at_s);
        let motion = Kinematics::new(seen.at_s, middle, &seen.covariance, 1.0, PROCESS_NOISE);
        self.tracks.push(Track {
            id: self.next_id,
            motion,
            cloud: None,
            confirmed: !self.ideas.has(Idea::StrictBirths),
            existence: if self.ideas.has(Idea::StrictBirths) { 0.0 } else { 2.0 },
            first_s: seen.at_s,
            last_hit_s: seen.at_s,
            first_at: centre,
            width_m: seen.width_m,
            seen_by: SeenBy::of(observation.view.module, seen.at_s),
            hit_in: self.scan,
            near_in: self.scan,
            faded_s: seen.at_s,
            covered_s: seen.at_s,
            beside,
            rest: (centre, seen.at_s),
            is_inside: false,
            unexplained: None,
            still_s: if seen.width_m < THIN_M { seen.at_s } else { f64::NEG_INFINITY },
            stirring: Stirring::default(),
            size: seen.size,
            company: None,
            part_of: None,
            faces: Some(Faces::default()),
            reason: "appeared",
            twin: 0,
            twin_since_s: seen.at_s,
            emerged_s: seen.at_s,
        });
        self.near.now.push(self.tracks.len() - 1);
        self.next_id += 1;
    }

    /// Of two appearances at one place, each perhaps of one module only, the older stays.
    fn merge_appearances(&mut self, observation: &Observation) {
        let of = |track: &Track| (track.id, track.motion.place(observation.start_s), track.existence);
        let near = |track: &&Track| !track.confirmed && track.near_in == self.scan;
        let tracks = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        let all: Vec<_> = tracks.filter(near).map(of).collect();
        for (index, &(younger, place, evidence)) in all.iter().enumerate().skip(1) {
            let same = |(_, other, _): &&(u32, Point, f64)| (*other - place).length() < SAME_M;
            let Some(&(older, ..)) = all.iter().take(index).find(same) else { continue };
            if let Some(index) = self.index_of(younger) {
                self.remove(index);
            }
            if let Some(index) = self.index_of(older) {
                let track = &mut self.tracks[index];
                track.existence = track.existence.max(evidence);
            }
        }
    }

    /// The detected track nearest to a place, if one is beside it.
    fn beside(&self, place: Point, at_s: f64) -> Option<u32> {
        let seen = self.seen_places(at_s);
        let far_m = |(id, other): (u32, Point)| ((other - place).length(), id);
        let near = seen.into_iter().map(far_m).filter(|(distance_m, _)| *distance_m < BESIDE_M);
        near.min_by(|one, two| one.0.total_cmp(&two.0)).map(|(_, id)| id)
    }

    /// Confirms an appearance: as a new person, or as one of the occluded tracks.
    fn confirm(&mut self, id: u32, beginning: bool) {
        self.catch_up_all();
        let Some(index) = self.index_of(id) else { return };
        let track = &self.tracks[index];
        let (at_s, at) = (track.last_hit_s, track.motion.place(track.last_hit_s));
        let interior = self.is_enclosed(track.first_at) && self.plan.walls.entry_m(track.first_at) > ENTRY_M;
        if interior && self.ideas.has(Idea::Relink) {
            let likeliest = self
                .tracks
                .iter()
                .enumerate()
                .filter(|(_, other)| other.confirmed && other.is_occluded() && !track.was_beside(other))
                .map(|(other, hidden)| {
                    let last = hidden.motion.place(hidden.last_hit_s);
                    let reach_m = 0.5 + WALK_MPS * (at_s - hidden.last_hit_s).max(0.0);
                    (other, (last - at).length() / reach_m)
                })
                .filter(|(_, effort)| *effort < 1.0)
                .min_by(|one, two| one.1.total_cmp(&two.1));
            if let Some((hidden, _)) = likeliest {
                let found = self.remove(index);
                let hidden = if hidden > index { hidden - 1 } else { hidden };
                self.tracks[hidden].is_found(&found);
                self.is_near(hidden);
                return;
            }
            if track.existence < 2.0 * CONFIRMED_FROM {
                return;
            }
        }
        let beside = track.beside.or_else(|| self.beside(at, at_s));
        // Legs come in walking; legs that only stand, wherever it is, were put there.
        let stands = track.is_still() && (at - track.first_at).length() < MOVED_M;
        let unexplained = (interior || stands) && !beginning && self.plan.walls.has_entries();
        let unexplained = unexplained && self.ideas.has(Idea::Doubt);
        let track = &mut self.tracks[index];
        track.beside = beside;
        if unexplained {
            track.doubt(track.first_at);
        }
        track.confirmed = true;
        track.existence = SURE * 0.5;
        track.reason = "seen";
        self.judge(index);
    }
}
