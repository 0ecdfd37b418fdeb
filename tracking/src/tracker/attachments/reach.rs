//! Within reach: how long a body and another have kept their places beside each other on their way.
//!
//! ```text
//!     ●        ●        ●    owner
//!    /        /        /     offset: its bounds stay within 0.36 m
//!   ■ ─────▶ ■ ─────▶ ■      way, from where both came within reach
//! ```

use crate::geometry::Point;

/// An arm and the handle at its end, m: an outline nearer to a person may be that person's.
const REACH_M: f64 = 0.6;

/// How far the place of a thing beside its owner changes at most on the way, m: half of a thing's length, as it swings.
/// A change beyond it begins the way anew: first places are guesses, and a thing in tow swings as its owner turns.
const RIGID_M: f64 = 0.36;

/// How far a thing in tow has gone with its owner when it is judged, m.
const TOWED_M: f64 = 0.7;

/// The same of a thing beside or before its owner, m: at the end of that way a vehicle is seen from its sides, and has
/// shown its wheels.
const PUSHED_M: f64 = 1.8;

/// So far behind its owner, along the way, a thing is in tow, m: half the depth of a body.
const BEHIND_M: f64 = 0.14;

/// A thing has parted from its owner when it is so much farther away than when it was judged, m: two thirds of a stride.
pub const SLACK_M: f64 = 0.4;

/// Whether an outline is within arm's reach of a place.
#[must_use]
pub fn is_within(outline: &[Point], place: Point) -> bool {
    outline.iter().any(|point| (*point - place).length() < REACH_M)
}

/// Bounds of the offsets of a body from another.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    /// Of one offset.
    #[must_use]
    pub const fn of(offset: Point) -> Self {
        Self { low: offset, high: offset }
    }

    /// Takes one more.
    pub fn take(&mut self, offset: Point) {
        self.low = Point::new(self.low.x.min(offset.x), self.low.y.min(offset.y));
        self.high = Point::new(self.high.x.max(offset.x), self.high.y.max(offset.y));
    }

    /// Whether both keep their places beside each other, as far as places are known.
    #[must_use]
    pub fn are_rigid(self) -> bool {
        let size = self.high - self.low;
        size.x.max(size.y) < RIGID_M
    }
}

/// Another body within reach; `Id` is a tracker's number of it.
#[derive(Clone, Debug)]
pub struct Reach<Id> {
    /// The other.
    pub other: Id,
    /// Where the way of both began: they came within reach, or their places beside each other had changed.
    from: Point,
    /// Offsets from the other since.
    offsets: Bounds,
}

impl<Id: Copy> Reach<Id> {
    /// Begins where a body is that came within reach of another, `offset` from that one.
    pub const fn begin(other: Id, at: Point, offset: Point) -> Self {
        Self { other, from: at, offsets: Bounds::of(offset) }
    }

    /// Takes where the body is, and its offset from the other.
    pub fn note(&mut self, at: Point, offset: Point) {
        self.offsets.take(offset);
        if !self.offsets.are_rigid() {
            *self = Self::begin(self.other, at, offset);
        }
    }

    /// Whether it goes before the other, as what is pushed does: on its way it is less beside than ahead.
    #[must_use]
    pub fn is_ahead(&self, at: Point, offset: Point) -> bool {
        let way = at - self.from;
        offset.dot(way) > offset.cross(way).abs()
    }

    /// Whether both have gone far enough beside each other for a thing at `at` to be the other's.
    #[must_use]
    pub fn is_kept(&self, at: Point, offset: Point) -> bool {
        let way = at - self.from;
        let is_towed = offset.dot(way) < -BEHIND_M * way.length();
        way.length() > if is_towed { TOWED_M } else { PUSHED_M }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a thing is its owner's after both went `way_m` along y, the thing `ahead_m` before its owner, and `swings_m`
    /// farther aside at the end.
    fn is_kept(ahead_m: f64, way_m: f64, swings_m: f64) -> bool {
        let offset = |share: f64| Point::new(swings_m * share, ahead_m);
        let at = |share: f64| Point::new(0.0, way_m * share) + offset(share);
        let mut reach = Reach::begin(1, at(0.0), offset(0.0));
        for share in (1..=10).map(|step| f64::from(step) / 10.0) {
            reach.note(at(share), offset(share));
        }
        reach.is_kept(at(1.0), offset(1.0))
    }

    #[test]
    fn a_thing_in_tow_goes_a_stride_and_one_that_is_pushed_a_few() {
        assert!(is_kept(-0.5, 0.8, 0.0) && !is_kept(-0.5, 0.6, 0.0), "in tow");
        assert!(is_kept(0.7, 1.9, 0.0) && !is_kept(0.7, 1.6, 0.0), "pushed");
    }

    #[test]
    fn a_change_of_places_begins_the_way_anew() {
        assert!(is_kept(-0.5, 0.8, 0.3) && !is_kept(-0.5, 0.8, 0.5));
    }

    #[test]
    fn an_outline_is_within_reach_by_its_nearest_point() {
        let outline = [Point::new(0.5, 0.0), Point::new(0.8, 0.0)];
        assert!(is_within(&outline, Point::default()) && !is_within(&outline[1..], Point::default()));
    }
}
