//! Parts: what comes in close to somebody, keeps its place there and is longer than a body is deep is a part of him:
//! wheels, a frame, a load.
//!
//! ```text
//!        ▲ walks         of one in a wheelchair:            two people:
//!     ╭──┴──╮  knees     nearer than a stride, always at    as deep as a body from chest to back, and
//!   ▐ ╰─────╯ ▌ wheels   the same place, and long           their distance changes with every step
//! ```
//!
//! Judged only once, when an appearance has gone far enough. A part is shown, and not counted, until it parts from its
//! owner.

use super::Kehai;
use super::ideas::Idea;
use super::track::Track;
use crate::geometry::Point;
use crate::sighting::Seen;

/// A part's middle is nearer to its owner's, m: half a wheelchair's length and what places are off by. A stride.
const NEAR_M: f64 = 0.75;

/// How far the place of a part beside its owner is misjudged at most on that way, m.
const RIGID_M: f64 = 0.36;

/// How far an appearance has gone when it is judged, m.
const WAY_M: f64 = 0.35;

/// Who has not gone so far after this time stands, and is somebody, s.
const STANDS_S: f64 = 3.0;

/// Length along the way beyond that of a body, m. Who walks beside somebody shows up to 0.3 on average, arms and all, as
/// hundreds did in pairs, crowds and a building of several rooms; wheels show 0.38 and more.
const LONG_M: f64 = 0.35;

/// A new track's first places are guesses for so long, s.
const GUESS_S: f64 = 0.2;

/// What is so far from its owner has parted from him, m.
const PARTED_M: f64 = 0.9;

/// Who was there when an appearance came, and what it looked like since.
#[derive(Clone, Debug)]
pub struct Company {
    /// Where it was first.
    from: Point,
    /// Sum of its outlines' chords, each in the direction it has gone, m.
    chords: Point,
    hits: f64,
    near: Vec<Beside>,
}

/// One of those who were there before, and between which places beside him an appearance was.
#[derive(Clone, Debug)]
struct Beside {
    owner: u32,
    low: Point,
    high: Point,
}

impl Kehai {
    /// Notes where an appearance is beside those who were there before it, and how long it is.
    pub(super) fn compare(&mut self, index: usize, seen: &Seen) {
        let Some(track) = self.tracks.get(index) else { return };
        let (id, at_s) = (track.id, track.last_hit_s);
        if at_s - track.first_s < GUESS_S {
            return;
        }
        let at = track.motion.place(at_s);
        let older = |other: &&Track| other.id < id && other.near_in == self.scan && !other.is_hidden();
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        let offsets = near.filter(older).map(|other| (other.id, at - other.motion.place(at_s)));
        let mut company = if let Some(mut company) = track.company.clone() {
            for (owner, offset) in offsets {
                company.near.retain_mut(|known| known.owner != owner || known.stays(offset));
            }
            company
        } else {
            let near = offsets.filter(|(_, offset)| offset.length() < NEAR_M);
            let near = near.map(|(owner, offset)| Beside { owner, low: offset, high: offset }).collect();
            Company { from: at, chords: Point::default(), hits: 0.0, near }
        };
        let chord = seen.outline[2] - seen.outline[0];
        let forwards = chord.dot(track.motion.velocity()) >= 0.0;
        company.chords = if forwards { company.chords + chord } else { company.chords - chord };
        company.hits += 1.0;
        if let Some(track) = self.tracks.get_mut(index) {
            track.company = Some(company);
        }
    }

    /// Says whose part somebody is who came not long ago, once he has gone far enough.
    pub(super) fn judge(&mut self, index: usize) {
        let Some(track) = self.tracks.get(index) else { return };
        let Some(company) = &track.company else { return };
        let way = track.motion.place(track.last_hit_s) - company.from;
        let stands = track.last_hit_s - track.first_s > STANDS_S;
        if !track.confirmed || (way.length() < WAY_M && !stands && !company.near.is_empty()) {
            return;
        }
        let is_judged = !stands && self.ideas.has(Idea::Parts);
        let owner = if is_judged { self.owner(company, way) } else { None };
        if let Some(track) = self.tracks.get_mut(index) {
            track.part_of = owner;
            track.company = None;
        }
    }

    fn owner(&self, company: &Company, way: Point) -> Option<u32> {
        if company.chords.dot(way) < LONG_M * company.hits * way.length() {
            return None;
        }
        let owners = company.near.iter().filter_map(|near| self.tracks.get(self.index_of(near.owner)?));
        let owner = owners.filter(|owner| owner.confirmed).min_by_key(|owner| owner.id)?;
        Some(owner.part_of.unwrap_or(owner.id))
    }

    /// Lets go of a part that has parted from its owner, or is left without one: what else was his is then its own.
    pub(super) fn let_go(&mut self, index: usize) {
        let Some((track, owner)) = self.tracks.get(index).and_then(|track| Some((track, track.part_of?)))
        else {
            return;
        };
        let (id, at_s, at) = (track.id, track.last_hit_s, track.motion.place(track.last_hit_s));
        let found = self.find(owner);
        match found.and_then(|index| self.tracks.get(index)) {
            Some(owner) if owner.is_hidden() || (owner.motion.place(at_s) - at).length() < PARTED_M => return,
            Some(_) => {}
            None => {
                let orphans = self.tracks.iter_mut().filter(|other| other.part_of == Some(owner));
                orphans.for_each(|orphan| orphan.part_of = Some(id));
            }
        }
        if let Some(track) = self.tracks.get_mut(index) {
            track.part_of = None;
        }
    }
}

impl Beside {
    /// Takes one more offset; whether it is near, and where it was before.
    fn stays(&mut self, offset: Point) -> bool {
        self.low = Point::new(self.low.x.min(offset.x), self.low.y.min(offset.y));
        self.high = Point::new(self.high.x.max(offset.x), self.high.y.max(offset.y));
        let size = self.high - self.low;
        offset.length() < NEAR_M && size.x.max(size.y) < RIGID_M
    }
}
