//! A zone: its cells, and its line from what was seen of them and the tracks inside.
//!
//! ```text
//!   ┌──┬──┬──┐   a cell is a body wide, and seen for 2 s after a module last saw it empty
//!   │▒▒│  │▒▒│   share of them that is seen ─▶ known · partly · unknown
//!   └──┴──┴──┘   tracks inside, each with its existence, as far as it is inside ─▶ P(0), P(1), …
//! ```
//!
//! After a gap a zone is not known at once. A module that had to learn its background anew may have learned a person who
//! stood there, and what is at that place and behind it is then seen no more: a zone in which no track is stays *partly*
//! known while a body's worth of cells that were seen before the gap has not been seen since. With tracks inside, these
//! are what hides them. A gap too short for that is long enough to lose a person who turns round: until all have been found
//! again a zone is not known to be empty in which there is a tentative track, or in which a person was counted before the gap. And
//! a person leaves only a zone that is looked at: a track that is predicted out of it while no report comes leaves it *partly* known.

pub mod edit;

use super::presence::{Presence, WHOLE};
use super::verdict::{Role, Verdict};
use crate::count::{Doubt, join};
use crate::geometry::{Point, bounds, inside};
use crate::occupancy::{Found, KNOWN_SHARE, ZoneKnown, ZoneLine};
use crate::site;
use crate::tracker::{LifeCycle, Origin, TrackState};

/// Side of a cell, m: a body.
pub const CELL_M: f64 = 0.2;

/// What was last seen so long ago is not seen any more, s: the one limit of all that is known by looking.
pub const SEEN_S: f64 = 2.0;

/// What a range finder saw so long ago may be the newest: a scan of 0.1 s, its way, and the time until the next one, s.
const FRESH_S: f64 = 0.3;

/// Seen share under which nothing is known.
const UNKNOWN: f64 = 0.1;

/// As many cells as a body covers, 0.45 × 0.28 m.
const BODY: usize = 3;

/// So long after a gap a person may stand where no cell has been seen since, s: people who stand shift their weight every
/// few minutes, and then a background learned with them opens. Later it is a thing that was brought in.
const HELD_S: f64 = 600.0;

/// Probability that an unexplained track that has not moved since it appeared is a person: people bring things as often
/// as people in their arms.
const UNEXPLAINED: f64 = 0.5;

/// A zone.
#[derive(Debug)]
pub struct Zone {
    pub name: String,
    pub secure: bool,
    pub cells: Vec<Cell>,
    /// The rectangle around them.
    pub around: (Point, Point),
    /// Before this time nothing is known of it, s.
    pub known_s: f64,
    /// Before this time people in it may not have been found again, s.
    pub found_s: f64,
    /// Before this time one who was counted in it before a gap may have been predicted out of it, s: never later than `found_s`.
    pub missed_s: f64,
    /// When its most recently seen cell had been seen, at the last line that counted a person in it, s.
    pub occupied_s: f64,
    /// The newest time in which too little of it was seen.
    gap: Option<Gap>,
}

/// A time in which too little of a zone was seen to know it, s.
#[derive(Clone, Copy, Debug)]
struct Gap {
    begun_s: f64,
    newest_s: f64,
    /// It goes on.
    is_open: bool,
}

/// A part of a zone.
#[derive(Debug)]
pub struct Cell {
    pub middle: Point,
    pub seen_s: f64,
    /// It was seen before the newest gap of its zone.
    was_seen: bool,
}

impl Cell {
    pub const fn new(middle: Point) -> Self {
        Self { middle, seen_s: f64::NEG_INFINITY, was_seen: false }
    }

    /// Notes that it was seen at `at_s`, or, with negative infinity, that nothing is known of it any more.
    pub const fn note(&mut self, at_s: f64) {
        self.was_seen |= self.seen_s.is_finite();
        self.seen_s = at_s;
    }

    /// Cells of two zones at one place have the same.
    pub fn place(&self) -> (i64, i64) {
        ((self.middle.x / CELL_M).floor() as i64, (self.middle.y / CELL_M).floor() as i64)
    }
}

impl Zone {
    pub fn new(zone: &site::Zone) -> Self {
        let polygon = zone.corners();
        let (low, high) = bounds(polygon.iter().copied()).unwrap_or_default();
        let mut cells = Vec::new();
        let size = high - low;
        let (columns, rows) = ((size.x / CELL_M).ceil() as u32, (size.y / CELL_M).ceil() as u32);
        for row in 0..rows {
            for column in 0..columns {
                let offset = Point::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * CELL_M;
                let middle = low + offset;
                if inside(middle, &polygon) {
                    cells.push(Cell::new(middle));
                }
            }
        }
        Self::of_cells(zone.name.clone(), zone.secure, cells, (low, high))
    }

    /// Of these cells, in the rectangle `around` them.
    pub const fn of_cells(name: String, secure: bool, cells: Vec<Cell>, around: (Point, Point)) -> Self {
        Self {
            name,
            secure,
            cells,
            around,
            known_s: f64::NEG_INFINITY,
            found_s: f64::NEG_INFINITY,
            missed_s: f64::NEG_INFINITY,
            occupied_s: f64::NEG_INFINITY,
            gap: None,
        }
    }

    /// From a place to the rectangle around it, m.
    pub fn distance_m(&self, at: Point) -> f64 {
        let (low, high) = self.around;
        (Point::new(at.x.clamp(low.x, high.x), at.y.clamp(low.y, high.y)) - at).length()
    }

    /// A module looks at it again after a gap: until `found_s` people in it may not have been found again. One who turned round in the gap
    /// is predicted to go on, out of a zone that no person has been seen to leave.
    pub fn look_again(&mut self, found_s: f64) {
        self.found_s = self.found_s.max(found_s);
        if self.occupied_s.is_finite() && self.occupied_s >= self.newest_s() {
            self.missed_s = self.missed_s.max(found_s);
        }
    }

    /// The record of this zone, from the tracks inside.
    pub fn line(&mut self, tracks: &[Presence<'_>], at_s: f64) -> ZoneLine {
        if at_s < self.known_s {
            return ZoneLine::unknown();
        }
        let (found, is_found_again) = self.found(tracks, at_s);
        let (seen_share, seen_s) = (self.seen_share(at_s), self.newest_s());
        self.note(seen_share < KNOWN_SHARE, at_s);
        if found.count > 0 {
            self.occupied_s = seen_s;
        }
        let verdict = self.judge(found.count, is_found_again, (seen_share, seen_s), at_s);
        ZoneLine::new(found, seen_share, verdict.known())
    }

    /// Why it is as known as its line of `at_s` says, from the same tracks.
    pub fn verdict(&self, tracks: &[Presence<'_>], at_s: f64) -> Verdict {
        if at_s < self.known_s {
            return Verdict::Moved { for_s: self.known_s - at_s };
        }
        let (found, is_found_again) = self.found(tracks, at_s);
        self.judge(found.count, is_found_again, (self.seen_share(at_s), self.newest_s()), at_s)
    }

    /// How many are counted in it where so much is known.
    pub fn count(&self, tracks: &[Presence<'_>], state: ZoneKnown, at_s: f64) -> Option<u32> {
        let (found, _) = self.found(tracks, at_s);
        ZoneLine::new(found, 0.0, state).count()
    }

    /// `seen_share`: how much of it is seen; `seen_s`: when anything of it was seen last.
    fn judge(
        &self,
        count: u32,
        is_found_again: bool,
        (seen_share, seen_s): (f64, f64),
        at_s: f64,
    ) -> Verdict {
        match seen_share {
            share if share < UNKNOWN => Verdict::HardlySeen,
            share if share < KNOWN_SHARE => Verdict::PartlySeen,
            _ if count > 0 => Verdict::Seen,
            _ if !is_found_again => Verdict::NotFoundAgain { for_s: (self.found_s - at_s).max(0.0) },
            _ if seen_s <= self.occupied_s && at_s - seen_s >= FRESH_S => Verdict::LeftUnseen,
            _ => match self.may_hide(at_s) {
                cells if cells >= BODY => Verdict::MayHide { m2: cells as f64 * CELL_M * CELL_M },
                _ => Verdict::Seen,
            },
        }
    }

    /// What a track inside is to its count.
    pub const fn role(&self, track: &TrackState) -> Role {
        Role::of(track.origin, track.state, self.secure)
    }

    /// Who is found inside, and whether all have been found that may have been lost in a gap.
    fn found(&self, tracks: &[Presence<'_>], at_s: f64) -> (Found, bool) {
        let mut found = Found { count: 0, p: vec![1.0], counted_p: vec![1.0] };
        let mut is_found_again = at_s >= self.missed_s;
        for Presence { track, is_inside, parts } in tracks {
            let role = self.role(track);
            let existence = match role {
                Role::Part => continue,
                // Perhaps a thing: the count may be higher by one.
                Role::Unexplained => UNEXPLAINED * track.existence,
                Role::Tentative | Role::Counted => track.existence,
            };
            join(&mut found.p, existence * f64::from(*parts) / f64::from(WHOLE), Doubt::OF_TRACKS);
            is_found_again &= !(*is_inside && track.state == LifeCycle::Tentative && at_s < self.found_s);
            // A tentative track is not believed in yet; at a door it is what its passage is judged by.
            let may_count = role == Role::Counted || track.origin == Origin::Unexplained;
            if may_count && *is_inside {
                join(&mut found.counted_p, existence, Doubt::NONE);
                found.count += u32::from(role == Role::Counted);
            }
        }
        (found, is_found_again)
    }

    /// Share of its cells that are seen.
    pub fn seen_share(&self, at_s: f64) -> f64 {
        let seen = self.cells.iter().filter(|cell| at_s - cell.seen_s < SEEN_S).count();
        seen as f64 / self.cells.len().max(1) as f64
    }

    /// When its most recently seen cell was, s.
    fn newest_s(&self) -> f64 {
        self.cells.iter().map(|cell| cell.seen_s).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Notes whether too little of it is seen to know it.
    fn note(&mut self, is_gap: bool, at_s: f64) {
        match &mut self.gap {
            Some(gap) if is_gap && gap.is_open => gap.newest_s = at_s,
            Some(gap) if !is_gap => gap.is_open = false,
            Some(_) | None if is_gap => {
                self.gap = Some(Gap { begun_s: at_s, newest_s: at_s, is_open: true });
                self.cells.iter_mut().for_each(|cell| cell.was_seen |= cell.seen_s.is_finite());
            }
            Some(_) | None => {}
        }
    }

    /// How many cells have not been seen since the newest gap, and were before.
    fn may_hide(&self, at_s: f64) -> usize {
        let Some(gap) = self.gap.filter(|gap| at_s - gap.newest_s < HELD_S) else { return 0 };
        self.cells.iter().filter(|cell| cell.was_seen && cell.seen_s < gap.begun_s).count()
    }
}

#[cfg(test)]
mod tests;
