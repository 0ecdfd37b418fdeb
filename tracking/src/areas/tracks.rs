//! A track as its area says it, carried on to the time of the picture, and how far apart two of them are.
//!
//! ```text
//!   frame heard          picture
//!     ●─ ─ ─ ─ ─ ─ ─ ─ ─ ▶ ○      where it would be by now: its velocity, and a covariance that grows with turns
//!     ╰─ age ─╯╰─ gone ──╯        age: since the frame;  gone: since the track was in a frame at all
//! ```
//!
//! Nothing is compared by the clocks of the areas: a track is predicted from when its frame was heard.

use std::ops::RangeInclusive;

use nalgebra::Matrix2;

use super::AreaName;
use crate::geometry::{Point, mahalanobis};
use crate::jsonl::TrackLine;
use crate::tracker::LifeCycle;

/// What two trackers differ by beyond their covariances, m²: frames are a tenth of a second apart, and a pose is calibrated to some
/// centimetres; together 0.15 m in each direction.
const APART_M2: f64 = 0.15 * 0.15;

/// What the velocities of two tracks of a person differ by, m/s: a track that was just begun stands still, and a walker at 1.4 m/s is
/// within two of this.
const VELOCITY_APART_MPS: f64 = 0.7;

/// Two tracks farther apart than this are two persons: 99.9 % of a normal distribution in four dimensions, place and velocity.
pub const GATE: f64 = 18.5;

/// However little is known of them, m: an arm's length beyond both bodies.
pub const GATE_M: f64 = 1.2;

/// Between two frames of an area, s.
const FRAME_S: f64 = 0.1;

/// The velocity of a track that is over may change so much each second, m/s: the variance of its place grows by it.
const TURNS_MPS2: f64 = 0.5;

/// A track of an area, by the number that the area gives it.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Key {
    pub area: AreaName,
    pub epoch: u64,
    pub track: u64,
}

/// The keys of all tracks of an area.
pub fn keys_of(area: &AreaName) -> RangeInclusive<Key> {
    let key = |number: u64| Key { area: area.clone(), epoch: number, track: number };
    key(0)..=key(u64::MAX)
}

/// A track of an area at the time of the picture.
#[derive(Clone, Debug)]
pub struct Heard {
    pub key: Key,
    /// As its area says it.
    pub line: TrackLine,
    /// Since then, s.
    pub age_s: f64,
    /// It is on the ground of another area, which sees that place.
    pub is_abroad: bool,
}

/// A track that was heard.
#[derive(Clone, Debug)]
pub struct Track {
    pub last: Heard,
    /// Since it was in a frame of its area last, s; 0 while it is.
    pub gone_s: f64,
    /// For how long its area has seen it without a break, s; 0 while it is hidden.
    pub seen_s: f64,
    /// For how long it has been unassigned, s.
    pub unassigned_s: f64,
    /// The person to whom it is assigned.
    pub person: Option<u64>,
    /// Whether it was assigned to any person before.
    pub was_assigned: bool,
}

impl Track {
    pub const fn new(last: Heard) -> Self {
        Self { last, gone_s: 0.0, seen_s: 0.0, unassigned_s: 0.0, person: None, was_assigned: false }
    }

    /// Time passes, without news of it so far.
    pub fn wait(&mut self, elapsed_s: f64) {
        self.gone_s += elapsed_s;
    }

    /// Its area says it again, so long after the last time.
    pub fn hear(&mut self, heard: Heard, elapsed_s: f64) {
        self.last = heard;
        self.gone_s = 0.0;
        self.seen_s = if self.is_seen() { self.seen_s + elapsed_s } else { 0.0 };
    }

    /// Whether its area says that it sees it.
    pub fn is_seen(&self) -> bool {
        self.is_there() && self.last.line.state != LifeCycle::Occluded
    }

    /// Whether its area says it at all.
    pub fn is_there(&self) -> bool {
        self.gone_s == 0.0
    }

    /// Where it is by now, if it walks on.
    pub fn at(&self) -> Point {
        let TrackLine { x, y, vx, vy, .. } = self.last.line;
        let walked_s = self.last.age_s + self.gone_s;
        Point::new(x + vx * walked_s, y + vy * walked_s)
    }

    /// Where it is shown: where its area says, unless that frame is older than the next one would be.
    pub fn shown_at(&self) -> Point {
        let TrackLine { x, y, vx, vy, .. } = self.last.line;
        let late_s = (self.last.age_s - FRAME_S).max(0.0);
        Point::new(x + vx * late_s, y + vy * late_s)
    }

    /// The covariance of [`Track::at`], m².
    fn covariance_m2(&self) -> Matrix2<f64> {
        let [xx, xy, yy] = self.last.line.cov.unwrap_or([APART_M2, 0.0, APART_M2]);
        let turned_m = 0.5 * TURNS_MPS2 * self.gone_s * self.gone_s;
        Matrix2::new(xx, xy, xy, yy) + Matrix2::identity() * (turned_m * turned_m)
    }

    /// How unsure its place is, m².
    pub fn spread_m2(&self) -> f64 {
        self.covariance_m2().trace()
    }

    /// How far apart two tracks are, as [`GATE`] measures it; none if they are farther than [`GATE_M`].
    pub fn apart(&self, other: &Self) -> Option<f64> {
        let offset = self.at() - other.at();
        let noise_m2 = Matrix2::identity() * APART_M2;
        let (places, _) = mahalanobis(offset, self.covariance_m2() + other.covariance_m2() + noise_m2);
        let (here, there) = (&self.last.line, &other.last.line);
        let velocities = (here.vx - there.vx).hypot(here.vy - there.vy) / VELOCITY_APART_MPS;
        (offset.length() <= GATE_M).then_some(places + velocities * velocities)
    }
}
