//! A note: what is kept of a number besides its body.
//!
//! ```text
//!   number ─┬ where it is, smoothed; since when, and which modules have seen it
//!           ├ in tow: what it looks like, whom it accompanies, whose it is
//!           ├ split: which track it has been one with
//!           └ put down: where it was left, and whether it has stirred since
//! ```
//!
//! A note belongs to a number and not to a body: numbers are exchanged between bodies, and a body that comes into view
//! takes the number of a hidden one.

use super::body::Body;
use crate::geometry::Point;
use crate::tracker::attachments::outlines::{Outlines, WALKING_MPS};
use crate::tracker::attachments::reach::Reach;
use crate::tracker::attachments::stir::Stirring;
use crate::tracker::history::{History, SeenBy};
use crate::tracker::{Origin, TrackId};

/// Time over which a place and a velocity are smoothed, s: the mean of a cloud jumps by a decimetre from scan to scan, and
/// six scans of two modules halve that.
const SMOOTHED_S: f64 = 0.3;

/// What is kept of a number.
#[derive(Clone, Debug)]
pub struct Note {
    pub id: TrackId,
    /// Where its body is, m.
    pub place: Point,
    /// The same and its velocity, smoothed, m and m/s: those of all are late by the same time.
    pub at: Point,
    pub velocity: Point,
    /// When both were taken last, s.
    at_s: f64,
    /// When and where it began, and which modules have seen it.
    pub history: History,
    pub confirmed: bool,
    /// Whether a scan has spoken for it lately.
    pub seen: bool,
    pub tow: Tow,
    pub split: Split,
    pub put_down: PutDown,
}

impl Note {
    /// Of a number that is new at `at_s`.
    pub fn new(id: TrackId, place: Point, velocity: Point, at_s: f64) -> Self {
        Self {
            id,
            place,
            at: place,
            velocity,
            at_s,
            history: History { first_s: at_s, first_at: place, last_s: at_s, seen_by: SeenBy::default() },
            confirmed: false,
            seen: true,
            tow: Tow::default(),
            split: Split::default(),
            put_down: PutDown::default(),
        }
    }

    /// Takes where its body is after a scan of a module, as long as it is seen.
    pub fn follow(&mut self, body: &Body, module: usize, at_s: f64) {
        let moments = body.cloud.moments();
        if body.supported_s >= at_s {
            self.history.last_s = self.history.last_s.max(at_s);
            self.history.seen_by.note(module, at_s);
        }
        (self.confirmed, self.seen) = (body.confirmed, !body.is_unseen(at_s));
        if self.seen {
            let share = 1.0 - libm::exp(-(at_s - self.at_s).max(0.0) / SMOOTHED_S);
            self.place = moments.at;
            self.at = self.at + (moments.at - self.at) * share;
            self.velocity = self.velocity + (moments.velocity - self.velocity) * share;
            if self.velocity.length() > WALKING_MPS {
                self.tow.walked_s += (at_s - self.at_s).max(0.0);
            }
            self.at_s = self.at_s.max(at_s);
        }
    }

    /// How it came to be.
    pub fn origin(&self) -> Origin {
        match self.tow.owner().or(self.tow.aboard) {
            Some(owner) => Origin::PartOf(owner),
            None if self.put_down.is_doubted() => Origin::Unexplained,
            None => Origin::Entered,
        }
    }
}

/// Where the note of a number is among notes in the order of their numbers, or where it belongs.
pub fn place(notes: &[Note], id: TrackId) -> Result<usize, usize> {
    notes.binary_search_by_key(&id, |note| note.id)
}

/// What a number looks like, whom it accompanies, and whose it is.
#[derive(Clone, Debug, Default)]
pub struct Tow {
    pub outlines: Outlines,
    /// For how long it has been on its way while it was seen, s.
    pub walked_s: f64,
    pub reach: Vec<Reach<TrackId>>,
    pub tie: Option<Tie>,
    /// Whether it has had an owner.
    pub was_tied: bool,
    /// Which vehicle it is another side of, as long as it is tentative.
    pub aboard: Option<TrackId>,
}

/// What ties a number to its owner.
#[derive(Clone, Copy, Debug)]
pub struct Tie {
    pub owner: TrackId,
    /// Whether it went before its owner.
    pub is_pushed: bool,
    /// At this distance it has parted, m.
    pub parted_m: f64,
}

impl Tow {
    /// Whose it is.
    pub fn owner(&self) -> Option<TrackId> {
        self.tie.map(|tie| tie.owner)
    }

    /// Whether it is no part but because it appeared beside a vehicle.
    pub fn is_aboard(&self) -> bool {
        self.tie.is_none() && self.aboard.is_some()
    }

    /// Forgets those who are gone.
    pub fn forget(&mut self, is_gone: impl Fn(TrackId) -> bool) {
        self.reach.retain(|reach| !is_gone(reach.other));
        self.aboard = self.aboard.filter(|&vehicle| !is_gone(vehicle));
    }
}

/// From which track a number may have split.
#[derive(Clone, Copy, Debug, Default)]
pub enum Split {
    #[default]
    None,
    /// It is tentative, and was last beside this track.
    Beside(TrackId),
    /// It is confirmed, and neither has moved since: where both were then, m.
    Parting { from: TrackId, at: Point, from_at: Point },
}

/// Whether a number was left behind.
#[derive(Clone, Copy, Debug, Default)]
pub struct PutDown {
    /// Where, while it is not known to be a person.
    pub at: Option<Point>,
    pub stirring: Stirring,
}

impl PutDown {
    /// Whether it is not known to be a person.
    pub const fn is_doubted(&self) -> bool {
        self.at.is_some()
    }

    /// It was left at a place: it has to move, or to stir.
    pub fn doubt(&mut self, at: Point) {
        *self = Self { at: Some(at), stirring: Stirring::default() };
    }
}

#[cfg(test)]
pub mod tests {
    use super::super::cloud::Cloud;
    use super::super::sample::Sample;
    use super::*;

    /// A confirmed number at a place.
    pub fn at(id: TrackId, x: f64, y: f64) -> Note {
        Note { confirmed: true, ..Note::new(id, Point::new(x, y), Point::default(), 0.0) }
    }

    #[test]
    fn a_number_is_on_its_way_as_long_as_it_walks() {
        let sample =
            |speed_mps| Sample::new(Point::default(), Point::new(speed_mps, 0.0), Point::new(1.0, 0.0));
        let mut note = at(1, 0.0, 0.0);
        let mut follow = |speed_mps, from_s: f64| {
            for scan in 0..40 {
                let at_s = from_s + f64::from(scan) * 0.05;
                let mut body = Body::begin(1, 5.0, Cloud::new(vec![sample(speed_mps); 4], at_s));
                body.supported_s = at_s;
                note.follow(&body, 0, at_s);
            }
            note.tow.walked_s
        };
        let walked_s = follow(1.0, 0.0);
        assert!((1.6..2.0).contains(&walked_s), "{walked_s}");
        let waited_s = follow(0.0, 2.0) - walked_s;
        assert!(waited_s < 0.5, "{waited_s}");
    }
}
