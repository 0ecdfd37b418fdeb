//! One track: its state and covariance, its existence (log-odds), how long it has gone undetected, and the reason.

use nalgebra::{Matrix2, Vector2};

use super::boxes::Faces;
use super::occlusion::Cloud;
use super::parts::{Company, Tie};
use super::size;
use crate::geometry::Point;
use crate::observation::{BodySize, Detection, LATE_S};
use crate::tracker::attachments::stir::Stirring;
use crate::tracker::history::{History, SeenBy};
use crate::tracker::kalman::Kinematics;
use crate::tracker::{LifeCycle, Origin, TrackState};

/// Upper bound of a track's existence, as log-odds: e⁶, one in four hundred.
pub const SURE: f64 = 6.0;

/// A track below this existence is deleted, as log-odds: one in twelve.
pub const NOBODY: f64 = -2.5;

/// A track without a detection for so long is occluded: three scans.
pub const OCCLUDED_S: f64 = 0.3;

/// One outside every field of view after so long, s: as soon as no report that is still used can hold a detection of it.
const UNHEARD_S: f64 = OCCLUDED_S + LATE_S;

/// Part of the filter's covariance that is stated for a detected person. The filter takes a candidate's deviations as a
/// bound, so that gates are wide; the errors of a walker in the furnished home say what they really are.
const STATED: f64 = 0.45;

/// How long two must have been seen side by side to be two, s: three scans.
const BESIDE_S: f64 = 0.3;

/// Candidates whose beams have held their ranges for so long are still, 0.1 s: a slow walker is across a beam in less.
const STILL_DS: u16 = 8;

/// A candidate that is thinner is no leg of a body, m: legs have 0.1 and more.
pub const THIN_M: f64 = 0.1;

/// A person who walks is never still for so long, s: longer than it takes to find an uncovered thing still.
const WALKS_S: f64 = 1.0;

/// Why a part of a person is not counted.
const PART: &str = "a part of a person: came in beside that person and keeps its place";

/// Why a track that was never detected coming in is not counted.
const UNEXPLAINED: &str = "unexplained: never seen to come in";

/// A person, or a candidate for one.
#[derive(Clone, Debug)]
pub struct Track {
    /// Never used again.
    pub id: u32,
    /// Motion as last seen.
    pub motion: Kinematics,
    /// The particles, while occluded.
    pub cloud: Option<Cloud>,
    /// It is certain that it is a person.
    pub confirmed: bool,
    /// Evidence for a birth, then that a person is there, as log-odds.
    pub existence: f64,
    /// First candidate.
    pub first_s: f64,
    /// Last candidate.
    pub last_hit_s: f64,
    /// Where it was first.
    pub first_at: Point,
    /// Widest candidate so far, m.
    pub width_m: f64,
    /// Modules that have detected it, and when.
    pub seen_by: SeenBy,
    /// Number of the observation that last detected it.
    pub hit_in: u64,
    /// Number of the last observation of a module that reaches it.
    pub near_in: u64,
    /// Scans in which only one of it and another track at the same place was detected.
    pub twin: u32,
    /// When the first of those scans was.
    pub twin_since_s: f64,
    /// Up to when its existence has decayed while occluded, s.
    pub faded_s: f64,
    /// When a module last looked where it is assumed to be occluded, s.
    pub covered_s: f64,
    /// The track beside which it appeared.
    pub beside: Option<u32>,
    /// Where it rests, and since when.
    pub rest: (Point, f64),
    /// Was in an enclosed zone when last seen.
    pub is_inside: bool,
    /// Where it was when it was unknown how it came there; None once that is known.
    pub unexplained: Option<Point>,
    /// When it was last seen by something thin that stood still, s.
    pub still_s: f64,
    /// How often it has stirred.
    pub stirring: Stirring,
    /// How large it is; None if no device that measures sizes has detected it.
    pub size: Option<BodySize>,
    /// The tracks that were there before it; None once it has gone far enough.
    pub company: Option<Company>,
    /// The track of which it is a part.
    pub part_of: Option<Tie>,
    /// Until it is old enough: what it looks like.
    pub faces: Option<Faces>,
    /// When it was first seen, or last came out of hiding.
    pub emerged_s: f64,
    /// Why it is in its state.
    pub reason: &'static str,
}

impl Track {
    /// Where it is taken to be at `at_s`, and how well that is known.
    #[must_use]
    pub fn place(&self, at_s: f64) -> (Point, Matrix2<f64>) {
        match &self.cloud {
            Some(cloud) => cloud.moments(),
            None => (self.motion.place(at_s), self.motion.spread(at_s)),
        }
    }

    /// Whether both were seen at one time: then they are not the same person.
    #[must_use]
    pub fn was_beside(&self, lost: &Self) -> bool {
        self.first_s + BESIDE_S < lost.last_hit_s
    }

    /// Whether it is occluded: no module detects it.
    #[must_use]
    pub const fn is_occluded(&self) -> bool {
        self.cloud.is_some()
    }

    /// Whether what it is seen by may walk: a track jumps between the legs of a chair, and they stand still.
    #[must_use]
    pub fn walks(&self) -> bool {
        self.last_hit_s - self.still_s > WALKS_S
    }

    /// Whether it was thin and still when last seen.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.still_s >= self.last_hit_s
    }

    /// Notes that it is unknown how the track came to `place`: it has to move, or to stir.
    pub fn doubt(&mut self, place: Point) {
        if self.unexplained.is_none() {
            self.unexplained = Some(place);
            self.stirring = Stirring::default();
        }
    }

    /// How it came to be: a part is a part, whether it was seen to come in or not.
    fn origin(&self) -> Origin {
        match (self.part_of, self.unexplained) {
            (Some(tie), _) => Origin::PartOf(tie.owner.into()),
            (None, Some(_)) => Origin::Unexplained,
            (None, None) => Origin::Entered,
        }
    }

    /// Whether it is a person, and detected.
    #[must_use]
    pub const fn is_seen(&self) -> bool {
        self.confirmed && !self.is_occluded()
    }

    /// Takes a candidate.
    pub fn hit(&mut self, seen: &Detection, centre: Vector2<f64>, noise: &Matrix2<f64>, module: usize) {
        if let Some(cloud) = self.cloud.take() {
            // Where it comes out of occlusion, its velocity is initiated again.
            self.emerged_s = seen.at_s;
            self.twin = 0;
            let (_, spread) = cloud.moments();
            let process_noise = self.motion.process_noise;
            self.motion = Kinematics::new(
                seen.at_s,
                centre,
                &(spread.map(|part| part.min(0.04)) + noise),
                0.7,
                process_noise,
            );
            self.motion.update(seen.at_s, centre, noise);
        } else {
            self.motion.update(seen.at_s, centre, noise);
        }
        self.last_hit_s = self.last_hit_s.max(seen.at_s);
        self.stirring.update(seen, module);
        self.size = size::after(self.size, seen.size);
        if seen.candidate.static_ds >= STILL_DS && seen.width_m < THIN_M {
            self.still_s = self.last_hit_s;
        }
        self.width_m = self.width_m.max(seen.width_m);
        self.seen_by.note(module, seen.at_s);
    }

    /// Comes out of hiding where an appearance was.
    pub fn is_found(&mut self, as_found: &Self) {
        self.cloud = None;
        self.motion = as_found.motion.clone();
        self.last_hit_s = as_found.last_hit_s;
        self.hit_in = as_found.hit_in;
        self.emerged_s = as_found.last_hit_s;
        self.still_s = as_found.still_s;
        self.seen_by.add(&as_found.seen_by);
        self.twin = 0;
        self.existence = SURE;
        self.reason = "came out of hiding";
    }

    /// The modules have other numbers: by each number now, the one before.
    pub fn renumber(&mut self, before: &[Option<usize>]) {
        self.seen_by.renumber(before);
        self.stirring.begin_anew();
    }

    /// Whether this module has ever detected it.
    #[must_use]
    pub fn known_to(&self, module: usize) -> bool {
        self.seen_by.has(module)
    }

    /// What it has been through.
    #[must_use]
    pub fn history(&self) -> History {
        let seen_by = self.seen_by.clone();
        History { first_s: self.first_s, first_at: self.first_at, last_s: self.last_hit_s, seen_by }
    }

    /// Outside every field of view: no report that is still used can hold a detection of it.
    fn is_unheard(&self, at_s: f64) -> bool {
        !self.is_occluded() && at_s - self.last_hit_s > UNHEARD_S
    }

    /// As published.
    #[must_use]
    pub fn state(&self, at_s: f64) -> TrackState {
        let (at, mut spread) = self.place(at_s);
        if !self.is_occluded() {
            spread *= STATED;
        }
        // A person whom no module sees may have stopped: the place stays, and only its spread grows.
        let at = if self.is_unheard(at_s) { self.motion.place(self.last_hit_s + UNHEARD_S) } else { at };
        let is_still = self.is_occluded() || self.is_unheard(at_s);
        let velocity = if is_still { Point::default() } else { self.motion.velocity() };
        let origin = self.origin();
        TrackState {
            id: self.id.into(),
            at,
            velocity,
            covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
            state: match (self.confirmed && origin == Origin::Entered, is_still) {
                (false, _) => LifeCycle::Tentative,
                (true, false) => LifeCycle::Confirmed,
                (true, true) => LifeCycle::Occluded,
            },
            existence: 1.0 / (1.0 + libm::exp(-self.existence)),
            reason: match origin {
                Origin::PartOf(_) => PART,
                Origin::Unexplained => UNEXPLAINED,
                Origin::Entered if self.is_unheard(at_s) => "out of view",
                Origin::Entered => self.reason,
            },
            origin,
        }
    }
}
