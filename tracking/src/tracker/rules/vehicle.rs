//! Vehicles: a person who sits between parts is one rigid body with them, and nothing else fits into it.
//!
//! ```text
//!                 ▲ ahead
//!     ┌─────────────────────┐      a detection whose middle is inside: of the vehicle, no track of its own
//!     │ ▐   ╭──knees──╮   ▌ │      members (the owner and its parts) take detections of inside alone
//!     │ ▐   ╰── user ─╯   ▌ │
//!     │ ▐                 ▌ │      bounds: where the middle can be, so that each outline of a
//!     └─────────────────────┘      member is inside the footprint
//!        ● a person who touches it has the middle outside
//! ```
//!
//! A vehicle is made when the first part is tied to its owner. That part has gone some way by then, and its direction is the
//! axis. What it is worth at a guarded door: docs/door.md.

use nalgebra::{Matrix2, Vector2};

use super::ablation::Idea;
use super::track::{OCCLUDED_S, Track};
use super::{PROCESS_NOISE, RuleTracker};
use crate::geometry::Point;
use crate::observation::{Detection, Observation};
use crate::tracker::kalman::Kinematics;

/// Half the length and half the width of a footprint at the height of the modules, m. From the rim behind the back to the
/// knees: 0.11 and the 0.65 of a long thigh; the footrests are below. Width: 0.7 of ISO 7193, and 0.05 for a hand at each side.
const HALF_M: [f64; 2] = [0.38, 0.40];

/// The middle of a detection that is so far outside may still be inside, m: how far the footprint is misplaced.
const MARGIN_M: f64 = 0.03;

/// A member takes detections so far outside, m. The middle of a person who touches it is half a body's depth, 0.13, behind the rear
/// edge; a detection beyond half of that, 0.065, is nearer to this person.
const MEMBER_M: f64 = 0.05;

/// How far the first middle, that of the members seen, is off at most, m: a third of the wheels' distance, as one of three may be
/// hidden.
const FIRST_M: f64 = 0.2;

/// How fast the bounds of the middle grow, m/s: what a vehicle's speed is misjudged by. Its change of speed in 0.3 s, the
/// longest that it is not seen as a rule, at 1 m/s².
const GROWTH_M_S: f64 = 0.3;

/// Deviation of the middle of the bounds from the vehicle's, besides that of a place anywhere in them, m: knees, hands and
/// wheels that are seen in turn shift it by so much.
const NOISE_M: f64 = 0.1;

/// Faster than this a vehicle's motion tells its axis, m/s: slower, it may turn on the spot.
const ROLLS_M_S: f64 = 0.3;

/// Share by which each detection turns the axis towards the motion: half of the way in 14, which two modules make in 0.3 s.
const TURN: f64 = 0.05;

/// A person with parts, as one rigid body.
#[derive(Clone, Debug)]
pub struct Vehicle {
    /// Number of the owner's track.
    pub owner: u32,
    middle: Kinematics,
    /// Unit vector along it.
    ahead: Point,
    /// When a member was seen last.
    seen_s: f64,
    /// Where the middle can be relative to `middle`, along and across.
    bounds: [(f64, f64); 2],
}

impl Vehicle {
    /// Whether a track is its owner or a part of it.
    fn has(&self, track: &Track) -> bool {
        track.id == self.owner || track.part_of.is_some_and(|tie| tie.owner == self.owner)
    }

    /// Whether it is known where it is.
    fn is_known(&self, at_s: f64) -> bool {
        at_s - self.seen_s < OCCLUDED_S
    }

    /// A place relative to the middle, along and across.
    fn local(&self, at: Point, at_s: f64) -> [f64; 2] {
        let offset = at - self.middle.place(at_s);
        [offset.dot(self.ahead), offset.dot(self.ahead.left())]
    }

    fn bounds(&self, at_s: f64) -> [(f64, f64); 2] {
        let more = GROWTH_M_S * (at_s - self.seen_s).abs();
        self.bounds.map(|(low, high)| (low - more, high + more))
    }

    /// Whether the middle of a detection's chord, which is inside of what it is of, is in the footprint or so near to it.
    fn holds(&self, seen: &Detection, margin_m: f64) -> bool {
        let local = self.local(seen.chord_middle(), seen.at_s);
        let sides = local.into_iter().zip(self.bounds(seen.at_s)).zip(HALF_M);
        let mut inside =
            sides.map(|((at, (low, high)), half)| at > low - half - margin_m && at < high + half + margin_m);
        self.is_known(seen.at_s) && inside.all(|is| is)
    }

    /// Takes a detection of a member: the footprint contains its outline.
    fn contain(&mut self, seen: &Detection) {
        let at_s = seen.at_s.max(self.seen_s);
        if !self.is_known(at_s) {
            let middle = seen.chord_middle();
            let spread = Matrix2::identity() * (FIRST_M * FIRST_M);
            self.middle =
                Kinematics::new(at_s, Vector2::new(middle.x, middle.y), &spread, 1.0, PROCESS_NOISE);
            self.bounds = HALF_M.map(|half| (-half, half));
            self.seen_s = at_s;
        }
        let outline = seen.outline.map(|point| self.local(point, seen.at_s));
        let mut bounds = self.bounds(at_s);
        for (axis, bounds) in bounds.iter_mut().enumerate() {
            *bounds = contained(*bounds, outline.map(|point| point[axis]), HALF_M[axis]);
        }
        let [along, across] = bounds.map(|(low, high)| 0.5 * (low + high));
        let [noise_along, noise_across] =
            bounds.map(|(low, high)| (high - low) * (high - low) / 12.0 + NOISE_M * NOISE_M);
        let before = self.middle.place(at_s);
        let left = self.ahead.left();
        let to = before + self.ahead * along + left * across;
        let square = |way: Point| Vector2::new(way.x, way.y) * Vector2::new(way.x, way.y).transpose();
        let noise = square(self.ahead) * noise_along + square(left) * noise_across;
        self.middle.update(at_s, Vector2::new(to.x, to.y), &noise);
        let moved = self.local(before, at_s);
        for ((low, high), moved) in bounds.iter_mut().zip(moved) {
            (*low, *high) = (*low + moved, *high + moved);
        }
        (self.bounds, self.seen_s) = (bounds, at_s);
        self.turn();
    }

    /// Turns the axis to where it rolls, forwards or backwards.
    fn turn(&mut self) {
        let velocity = self.middle.velocity();
        if velocity.length() > ROLLS_M_S {
            let way = velocity * (1.0 / velocity.length());
            let way = if way.dot(self.ahead) < 0.0 { way * -1.0 } else { way };
            let turned = self.ahead + (way - self.ahead) * TURN;
            self.ahead = turned * (1.0 / turned.length());
        }
    }
}

/// Where a middle can be along an axis: within `bounds`, and so that `half` to both sides contains the points of an
/// outline; next to both if there is no such place.
fn contained(bounds: (f64, f64), outline: [f64; 3], half: f64) -> (f64, f64) {
    let low = outline.into_iter().fold(f64::INFINITY, f64::min);
    let high = outline.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let (least, most) = (high - half, low + half);
    if least > most {
        let middle = 0.5 * (least + most);
        return (middle, middle);
    }
    let both = (bounds.0.max(least), bounds.1.min(most));
    if both.0 <= both.1 {
        return both;
    }
    let middle = (0.5 * (bounds.0 + bounds.1)).clamp(least, most);
    (middle, middle)
}

impl RuleTracker {
    /// Makes a vehicle of the track `owner`, of which a track that has gone this `way` is a part now.
    pub(super) fn mount(&mut self, owner: u32, way: Point) {
        let is_known = self.vehicles.iter().any(|vehicle| vehicle.owner == owner);
        let Some(track) = self.find(owner).and_then(|index| self.tracks.get(index)) else { return };
        if is_known || !self.ideas.has(Idea::Vehicles) {
            return;
        }
        let mut vehicle = Vehicle {
            owner,
            middle: track.motion.clone(),
            ahead: way * (1.0 / way.length().max(1e-6)),
            seen_s: self.now_s,
            bounds: [(-FIRST_M, FIRST_M); 2],
        };
        let members = self.tracks.iter().filter(|track| vehicle.has(track) && !track.is_occluded());
        let places: Vec<Point> = members.map(|track| track.motion.place(self.now_s)).collect();
        vehicle.middle.predict(self.now_s);
        if !places.is_empty() {
            let at = places.iter().fold(Point::default(), |sum, at| sum + *at) * (1.0 / places.len() as f64);
            (vehicle.middle.mean[0], vehicle.middle.mean[1]) = (at.x, at.y);
        }
        self.vehicles.push(vehicle);
    }

    /// Whether a detection may be of a track, as far as vehicles say.
    pub(super) fn may_be_of(&self, track: &Track, seen: &Detection) -> bool {
        self.vehicles.iter().filter(|vehicle| vehicle.is_known(seen.at_s)).all(|vehicle| {
            if vehicle.has(track) {
                vehicle.holds(seen, MEMBER_M)
            } else {
                track.confirmed || !vehicle.holds(seen, MARGIN_M)
            }
        })
    }

    /// The owner of the vehicle that holds a detection.
    pub(super) fn vehicle_around(&self, seen: &Detection) -> Option<u32> {
        self.vehicles.iter().find(|vehicle| vehicle.holds(seen, MARGIN_M)).map(|vehicle| vehicle.owner)
    }

    /// Moves the vehicle of a track that has taken a detection.
    pub(super) fn ride(&mut self, index: usize, seen: &Detection) {
        let Self { vehicles, tracks, .. } = self;
        let Some(track) = tracks.get(index) else { return };
        for vehicle in vehicles.iter_mut().filter(|vehicle| vehicle.has(track)) {
            vehicle.contain(seen);
        }
    }

    /// Takes away what is left inside vehicles. Of it an occluded owner is found again.
    pub(super) fn drop_pieces(
        &mut self,
        observation: &Observation,
        pieces: &[Detection],
        taken: &mut [bool],
    ) {
        for (index, piece) in pieces.iter().enumerate() {
            if taken.get(index).is_none_or(|taken| *taken) {
                continue;
            }
            let Some(owner) = self.vehicle_around(piece) else { continue };
            let owner = self.find(owner);
            let is_missed = |track: &Track| {
                track.is_occluded() && track.near_in == self.scan && track.hit_in != self.scan
            };
            if let Some(owner) = owner.filter(|owner| self.tracks.get(*owner).is_some_and(is_missed)) {
                self.hit(owner, index, observation, pieces, taken);
                self.is_near(owner);
            }
            if let Some(taken) = taken.get_mut(index) {
                *taken = true;
            }
        }
    }

    /// Forgets vehicles without members.
    pub(super) fn park(&mut self) {
        let Self { vehicles, tracks, .. } = self;
        vehicles.retain(|vehicle| tracks.iter().any(|track| vehicle.has(track)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_where_the_footprint_contains_an_outline() {
        // Half a length of 0.38: what reaches from 0.1 to 0.3 ahead has a middle between -0.08 and 0.48.
        let outline = [0.1, 0.2, 0.3];
        assert_eq!(contained((-1.0, 1.0), outline, 0.38), (0.3 - 0.38, 0.1 + 0.38));
        assert_eq!(contained((-0.05, 0.1), outline, 0.38), (-0.05, 0.1), "known better before");
        assert_eq!(contained((-0.4, -0.2), outline, 0.38), (0.3 - 0.38, 0.3 - 0.38), "the nearest place");
        let (low, high) = contained((-1.0, 1.0), [-0.5, 0.0, 0.5], 0.38);
        assert!(low == high && low.abs() < 1e-9, "longer than the footprint: about its middle");
    }
}
