//! One counting line: tracks at times in, crossings out.
//!
//! ```text
//!       away ○        passes      − 1     0     + 1
//!   ┌ ─ ─ ─ ─│─ ─ ─ ┐ 0.225 m     net passes through the line since the track was last away from it:
//!   │ from ══╪══▶ to │             away again with + 1: in, − 1: out, 0: it came back
//!   └ ─ ─ ─ ─│─ ─ ─ ┘
//!            ● away
//! ```
//!
//! A person is away when the whole body is on one side; a person who stands on the line and sways is not counted, and one who goes in and
//! comes back out is counted in both directions. A pass beside the ends of the line is none. What no module sees is believed, not
//! known, and jumps: an occluded track passes when it is seen again, by the straight way from where it was seen last, or when it has been
//! believed to be away on the other side for 2 s, or ends there. A track passes from its first, tentative moment, and is counted once it is a person. One
//! that begins where another was lost goes on with its way.
//!
//! ```text
//!              outside              entry ═══   no track begins or ends inside an enclosed zone: one that begins or is lost so
//!   ┌ ─ ─ from ═╪═══▶ to ─ ─ ┐      ≤ 0.8 m     near the line, with the line between itself and the entry, has crossed
//!   └ ─ ─ ─ ○ ─ ─ ─ ─ ─ ─ ─ ─┘                  it unseen
//! ```

use std::collections::BTreeMap;

use super::Direction;
use crate::cells::Areas;
use crate::doorway::{BESIDE_M, DOORWAY_M};
use crate::geometry::{Point, distance_to_segment, segments_apart_m};
use crate::occupancy::ZoneKnown;
use crate::site::Site;
use crate::site::line::CountingLine;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};
use crate::zones::SEEN_S;

/// A track so far from the line is away from it, m: half of a body 0.45 m wide, so all of it is on one side.
const AWAY_M: f64 = 0.225;

/// A track farther from the line is not followed, m: at 3 m/s, faster than people walk, it takes a second from there to the line, and
/// tracks come ten times as often.
const NEAR_M: f64 = 3.0;

/// Most tracks that are followed at a line: as many as have room within 3 m of one of 20 m, three to a square metre. 104 bytes each.
const TRACKS_MAX: usize = 512;

/// A track that begins so long after another was seen last may be the same person, s: the birth of a track takes up to 1.5 s.
const HEIR_S: f64 = 1.5;

/// It begins so near to where the other would be by then, m: the gate of the tracker's own association.
const HEIR_M: f64 = 0.5;

/// The middle of an entry that is so near to the line lies on it, m: the grid of the map's editor.
const ON_M: f64 = 0.05;

/// An occluded track that has been believed to be on the other side for so long is there, s: as long as what was seen counts as seen.
const BELIEVED_S: f64 = SEEN_S;

/// A crossing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Pass {
    pub track: TrackId,
    pub direction: Direction,
    /// The track passed the line between these times, s; they are the same where it was seen to.
    pub since_s: f64,
    pub at_s: f64,
}

/// A track near the line.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Where and when it was seen last.
    at: Point,
    seen_s: f64,
    velocity: Point,
    /// Where it is believed to be: there, or where it is occluded.
    believed: Point,
    /// It was in the newest tracks, or when it was in them last, s.
    there_s: f64,
    /// Passes through the line since it was away: those to the left less those to the right.
    net: i8,
    /// The last of them happened between these times.
    since_s: f64,
    passed_s: f64,
    /// While occluded: since when it is believed to be away on the other side.
    beyond_s: Option<f64>,
    is_person: bool,
}

impl Way {
    const fn beginning(track: &TrackState, at_s: f64) -> Self {
        let (at, velocity) = (track.at, track.velocity);
        Self {
            at,
            seen_s: at_s,
            velocity,
            believed: at,
            there_s: at_s,
            net: 0,
            since_s: at_s,
            passed_s: at_s,
            beyond_s: None,
            is_person: false,
        }
    }
}

/// A line, and who is near it.
#[derive(Debug)]
pub(super) struct Passing {
    from: Point,
    to: Point,
    /// Middles of the entries at the line.
    entries: Vec<Point>,
    /// Zones in which no person appears and from which none is lost.
    enclosed: Areas,
    ways: BTreeMap<TrackId, Way>,
    /// Tracks that were not followed as there was no room.
    pub overflow: u64,
}

impl Passing {
    pub fn new(line: &CountingLine, site: &Site) -> Self {
        let (from, to) = line.ends();
        let near = |ends: &(Point, Point)| segments_apart_m(*ends, (from, to)) <= DOORWAY_M;
        let entries = site.entries.iter().map(crate::site::Entry::ends).filter(near);
        Self {
            from,
            to,
            entries: entries.map(|(one, other)| (one + other) * 0.5).collect(),
            enclosed: site.enclosed(),
            ways: BTreeMap::new(),
            overflow: 0,
        }
    }

    /// In another site: tracks near the line stay near it, if it has not moved.
    pub fn change_site(&mut self, line: &CountingLine, site: &Site) {
        let before = std::mem::replace(self, Self::new(line, site));
        if (before.from, before.to) == line.ends() {
            self.ways = before.ways;
        }
        self.overflow = before.overflow;
    }

    /// Notes where all tracks are, and how much of the line is seen; returns who has crossed since.
    pub fn observe(&mut self, tracks: &[TrackState], known: ZoneKnown, at_s: f64) -> Vec<Pass> {
        let mut passes = Vec::new();
        for track in tracks {
            if let Some(way) = self.ways.get_mut(&track.id) {
                way.there_s = at_s;
            }
        }
        for track in tracks.iter().filter(|track| !matches!(track.origin, Origin::PartOf(_))) {
            let distance_m = distance_to_segment(track.at, self.from, self.to);
            if self.ways.contains_key(&track.id) || self.begin(track, distance_m, known, at_s) {
                passes.extend(self.follow(track, distance_m, at_s));
            }
        }
        passes.extend(self.forget(at_s));
        passes
    }

    /// Begins to follow a track; false if it is too far away, or there is no room.
    fn begin(&mut self, track: &TrackState, distance_m: f64, known: ZoneKnown, at_s: f64) -> bool {
        if distance_m > NEAR_M {
            return false;
        }
        let heir = self.heir(track, at_s);
        if self.ways.len() >= TRACKS_MAX {
            self.overflow += 1;
            return false;
        }
        let way = heir.unwrap_or_else(|| {
            let came = (known == ZoneKnown::Known && is_seen(track)).then(|| self.unseen(track.at)).flatten();
            Way { net: came.map_or(0, |step| -step), ..Way::beginning(track, at_s) }
        });
        self.ways.insert(track.id, way);
        true
    }

    fn follow(&mut self, track: &TrackState, distance_m: f64, at_s: f64) -> Option<Pass> {
        let way = self.ways.get_mut(&track.id)?;
        way.believed = track.at;
        way.is_person |= track.state != LifeCycle::Tentative;
        let passed = pass((self.from, self.to), way.at, track.at);
        if !is_seen(track) {
            return way.believed_away(track.id, passed.filter(|_| distance_m > AWAY_M), distance_m, at_s);
        }
        way.beyond_s = None;
        if let Some((step, share)) = passed {
            way.net = way.net.saturating_add(step);
            way.passed_s = way.seen_s + (at_s - way.seen_s) * share;
            way.since_s = way.passed_s;
        }
        (way.at, way.seen_s, way.velocity) = (track.at, at_s, track.velocity);
        let settled = if distance_m > AWAY_M && way.is_person { way.settled(track.id) } else { None };
        if distance_m > NEAR_M {
            self.ways.remove(&track.id);
        }
        settled
    }

    /// Gives up tracks that are gone and have no heir. A track lost between passing the line and being away from it has crossed it, and
    /// so has one that ended hidden beyond the line, or where the only way out is across the line.
    fn forget(&mut self, at_s: f64) -> Vec<Pass> {
        let gone: Vec<TrackId> =
            self.ways.iter().filter(|(_, way)| at_s - way.there_s > HEIR_S).map(|(id, _)| *id).collect();
        let pass = |id| {
            let mut way = self.ways.remove(&id).filter(|way| way.is_person)?;
            if way.net == 0
                && let Some(step) = self.believed(&way).or_else(|| self.unseen(way.believed))
            {
                (way.net, way.since_s, way.passed_s) = (step, way.seen_s, way.there_s);
            }
            way.settled(id)
        };
        gone.into_iter().filter_map(pass).collect()
    }

    /// In which direction a person has passed the line who was hidden before it, and whose track has ended beyond it.
    fn believed(&self, way: &Way) -> Option<i8> {
        let (step, _) = pass((self.from, self.to), way.at, way.believed)?;
        (distance_to_segment(way.believed, self.from, self.to) > AWAY_M).then_some(step)
    }

    /// In which direction a person passes the line who is lost here, if that is the only way to be lost here.
    fn unseen(&self, at: Point) -> Option<i8> {
        let side = self.to - self.from;
        let left_m = |place: Point| side.cross(place - self.from) / side.length();
        let is_near = distance_to_segment(at, self.from, self.to) <= DOORWAY_M && self.enclosed.hold(at);
        let step = if left_m(at) >= 0.0 { -1 } else { 1 };
        let is_between = |entry: &Point| f64::from(step) * left_m(*entry) > -ON_M;
        (is_near && self.entries.iter().any(is_between)).then_some(step)
    }

    /// The way of the track that was lost where this one begins.
    fn heir(&mut self, track: &TrackState, at_s: f64) -> Option<Way> {
        let distance_m = |way: &Way| {
            let expected = way.at + way.velocity * (at_s - way.seen_s).min(HEIR_S);
            (expected - track.at).length().min((way.believed - track.at).length())
        };
        let is_lost = |way: &Way| way.there_s < at_s || way.seen_s < way.there_s;
        let lost = self.ways.iter().filter(|(_, way)| is_lost(way) && distance_m(way) <= HEIR_M);
        let (&id, _) = lost.min_by(|(_, one), (_, other)| distance_m(one).total_cmp(&distance_m(other)))?;
        self.ways.remove(&id)
    }
}

impl Way {
    /// What it has done at the line since it was last away from it.
    fn settled(&mut self, track: TrackId) -> Option<Pass> {
        let direction = match std::mem::take(&mut self.net) {
            0 => return None,
            1.. => Direction::In,
            _ => Direction::Out,
        };
        Some(Pass { track, direction, since_s: self.since_s, at_s: self.passed_s })
    }

    /// An occluded person is believed to be away from the line: as it was seen to pass, or, after a while, having passed unseen.
    fn believed_away(
        &mut self,
        track: TrackId,
        passed: Option<(i8, f64)>,
        distance_m: f64,
        at_s: f64,
    ) -> Option<Pass> {
        match passed {
            None => {
                self.beyond_s = None;
                // It has passed already, and went on.
                (distance_m > AWAY_M && self.is_person).then(|| self.settled(track)).flatten()
            }
            Some((step, _)) if at_s - *self.beyond_s.get_or_insert(at_s) >= BELIEVED_S => {
                (self.net, self.since_s, self.passed_s) = (self.net.saturating_add(step), self.seen_s, at_s);
                self.at = self.believed;
                self.settled(track).filter(|_| self.is_person)
            }
            Some(_) => None,
        }
    }
}

/// Whether a track is where it is said to be.
const fn is_seen(track: &TrackState) -> bool {
    !matches!(track.state, LifeCycle::Occluded)
}

/// In which direction the straight way `before` → `after` passes the line, and after which share of it.
fn pass((from, to): (Point, Point), before: Point, after: Point) -> Option<(i8, f64)> {
    let side = to - from;
    let (was, is) = (side.cross(before - from), side.cross(after - from));
    if (was >= 0.0) == (is >= 0.0) {
        return None;
    }
    let share = was / (was - is);
    let length_m = side.length();
    let along_m = (before + (after - before) * share - from).dot(side) / length_m;
    let is_through = (-BESIDE_M..=length_m + BESIDE_M).contains(&along_m);
    is_through.then_some((if is >= 0.0 { 1 } else { -1 }, share))
}
