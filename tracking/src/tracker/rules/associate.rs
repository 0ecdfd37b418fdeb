//! Data association: which detection belongs to which track, and how a detection updates its track.
//!
//! ```text
//!              candidates
//!   tracks     c11  c12  c13 │ u  ∞      cost = −ln likelihood of the candidate, given the track
//!              c21  c22  c23 │ ∞  u      u: the track stays without a detection (a missed detection)
//! ```
//!
//! One-to-one assignment with the least total cost (`assignment.rs`). Only pairs inside the
//! gate take part: at most 0.8 m apart, or, for an occluded track, where its particles are.

use std::cell::LazyCell;
use std::ops::Deref;

use nalgebra::{Matrix2, Vector2};

use super::line_of_sight::Eye;
use super::size;
use super::track::{SURE, Track};
use super::{RuleTracker, TWINS_M};
use crate::assignment::{Alone, assign};
use crate::geometry::Point;
use crate::observation::{Detection, Observation};

/// The gate: a candidate farther from a track than this is never its own, m.
pub(super) const GATE_M: f64 = 0.8;

/// Cost of a track without a candidate, −ln per m²: about four deviations of a well known place. A pair that costs more is not
/// made: a second gate, by covariance.
const UNASSIGNED: f64 = 5.0;

/// Added to that for a track in full view, and subtracted for an occluded track: e², about seven times less likely.
const MISSED: f64 = 2.0;

/// Between the middles of two legs, m.
const STRIDE_M: core::ops::Range<f64> = 0.08..0.45;

/// Deviation of the middle between two legs from their owner's, m.
const LEGS_M: f64 = 0.06;

impl RuleTracker {
    /// Whether a candidate belongs to an appearance that was there while the occluded `track` was still detected.
    fn is_another_person(&self, track: &Track, seen: &Detection) -> bool {
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        near.filter(|other| !other.confirmed && other.was_beside(track)).any(|other| {
            let place = other.motion.place(seen.at_s);
            (seen.centre - Vector2::new(place.x, place.y)).norm() < TWINS_M
        })
    }

    /// Cost of a track without a candidate: little where it is occluded.
    fn unassigned<'a>(track: &Track, at_s: f64, eye: &impl Deref<Target = Eye<'a>>) -> f64 {
        if !track.is_seen() {
            return UNASSIGNED;
        }
        let look = eye.at_body(track.motion.place(at_s));
        UNASSIGNED + MISSED * (look.judged() - look.hidden)
    }

    /// Finds a candidate for each of the tracks `of` within reach; returns which of them got which,
    /// and whether it was one of two legs.
    pub(super) fn associate(
        &mut self,
        of: impl Fn(&Track) -> bool,
        observation: &Observation,
        pieces: &[Detection],
        taken: &mut [bool],
    ) -> Vec<(usize, usize, bool)> {
        let ideas = self.ideas;
        let free: Vec<usize> = (0..pieces.len()).filter(|&index| !taken[index]).collect();
        let is_row = |index: &usize| {
            let track = &self.tracks[*index];
            track.near_in == self.scan && of(track)
        };
        let rows: Vec<usize> = self.near.now.iter().copied().filter(is_row).collect();
        let eye = LazyCell::new(|| Eye::of(observation));
        let alone = Alone {
            least: UNASSIGNED - MISSED,
            of: |row: usize| Self::unassigned(&self.tracks[rows[row]], observation.start_s, &eye),
        };
        let assigned = assign(rows.len(), free.len(), &alone, |row, column| {
            let (track, seen) = (&self.tracks[rows[row]], &pieces[free[column]]);
            let cost = cost(track, seen)? + size::cost(track.size, seen, ideas);
            let is_other =
                (track.is_occluded() && self.is_another_person(track, seen)) || !self.may_be_of(track, seen);
            (cost < UNASSIGNED && !is_other).then_some(cost)
        });
        let pair = |(track, column): (&usize, Option<usize>)| Some((*track, free[column?], false));
        let mut hits: Vec<(usize, usize, bool)> = rows.iter().zip(assigned).filter_map(pair).collect();
        for (_, index, _) in &hits {
            taken[*index] = true;
        }
        for (track, index, is_pair) in &mut hits {
            *is_pair = self.hit(*track, *index, observation, pieces, taken);
        }
        hits
    }

    /// Gives a track its candidate, and the other leg to a leg; returns whether there was one.
    pub(super) fn hit(
        &mut self,
        track: usize,
        index: usize,
        observation: &Observation,
        pieces: &[Detection],
        taken: &mut [bool],
    ) -> bool {
        let seen = &pieces[index];
        let (mut centre, mut noise) = (seen.centre, seen.covariance);
        let legs = if seen.candidate.narrow {
            let expected = self.tracks[track].place(seen.at_s).0;
            let own = self.tracks[track].id;
            let others = self.seen_places(seen.at_s);
            let is_own = |leg: &Detection| {
                let far_m = |place: Point| (leg.centre - Vector2::new(place.x, place.y)).norm();
                others.iter().all(|(id, place)| *id == own || far_m(*place) > far_m(expected))
            };
            let expected = Vector2::new(expected.x, expected.y);
            other_leg(index, expected, pieces, |other| !taken[other] && is_own(&pieces[other]))
                .filter(|(_, middle)| (middle - expected).norm() < (centre - expected).norm().max(0.2))
        } else {
            None
        };
        let hit = track;
        let track = &mut self.tracks[hit];
        if let Some((other, middle)) = legs {
            taken[other] = true;
            centre = middle;
            noise = Matrix2::identity() * (LEGS_M * LEGS_M);
            track.width_m = track.width_m.max((pieces[other].centre - seen.centre).norm() + seen.width_m);
        }
        track.hit(seen, centre, &noise, observation.view.module);
        track.hit_in = self.scan;
        if track.confirmed {
            track.existence = (track.existence + 2.0).min(SURE);
            track.reason = "seen";
        }
        self.ride(hit, seen);
        legs.is_some()
    }
}

/// The free narrow candidate that is a pair of legs with a narrow one, and the middle of both: nearest to where
/// their owner is expected.
pub fn other_leg(
    index: usize,
    expected: Vector2<f64>,
    pieces: &[Detection],
    is_free: impl Fn(usize) -> bool,
) -> Option<(usize, Vector2<f64>)> {
    let seen = pieces.get(index).filter(|seen| seen.candidate.narrow)?;
    (0..pieces.len())
        .filter(|&other| other != index && pieces[other].candidate.narrow && is_free(other))
        .filter(|&other| STRIDE_M.contains(&(pieces[other].centre - seen.centre).norm()))
        .map(|other| (other, (pieces[other].centre + seen.centre) * 0.5))
        .min_by(|one, two| (one.1 - expected).norm().total_cmp(&(two.1 - expected).norm()))
}

/// −ln likelihood of a candidate, given a track; None outside its gate.
fn cost(track: &Track, seen: &Detection) -> Option<f64> {
    if let Some(cloud) = &track.cloud {
        let density = cloud.density(seen.centre, &seen.covariance);
        return (density > 1e-6).then(|| -libm::log(density));
    }
    let place = track.motion.place(seen.at_s);
    if (seen.centre - Vector2::new(place.x, place.y)).norm() > GATE_M {
        return None;
    }
    let (distance, log_determinant) = track.motion.distance(seen.at_s, seen.centre, &seen.covariance);
    Some(0.5 * distance + 0.5 * log_determinant + libm::log(core::f64::consts::TAU))
}
