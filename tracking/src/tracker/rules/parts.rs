//! Attachments: a track that arrives close to a person, keeps its relative place and is longer than a body is deep is
//! part of that person: wheels, a frame, a load.
//!
//! ```text
//!        ▲ walks         a wheelchair user:             two people:
//!     ╭──┴──╮  knees     nearer than a stride, always at    as deep as a body from chest to back, and
//!   ▐ ╰─────╯ ▌ wheels   the same place, and long           their distance changes with every step
//! ```
//!
//! Judged only once, when a tentative track has gone far enough. A part is shown and not counted, until it leaves its
//! owner.

use super::RuleTracker;
use super::ablation::Idea;
use crate::geometry::Point;
use crate::observation::Detection;
use crate::tracker::attachments::reach::Bounds;

/// A part's middle is nearer to its owner's, m: half a wheelchair's length and what places are off by. A stride.
const NEAR_M: f64 = 0.75;

/// How far an appearance has gone when it is judged, m.
const WAY_M: f64 = 0.35;

/// A track that has not gone so far after this time stands, and is a person, s.
const STANDS_S: f64 = 3.0;

/// Length along the way beyond that of a body, m. A person who walks beside another shows up to 0.3 on average, arms
/// included: measured on hundreds in pairs, crowds and a building of several rooms. Wheels show 0.38 and more.
const LONG_M: f64 = 0.35;

/// What was inside a vehicle for this share of the way is a part of it, however long it is.
const HELD: f64 = 0.5;

/// A new track's first places are guesses for so long, s.
const GUESS_S: f64 = 0.2;

/// A part that is so far from its owner has parted from it, m.
const PARTED_M: f64 = 0.9;

/// What ties a part to its owner.
#[derive(Clone, Copy, Debug)]
pub struct Tie {
    /// Number of the owner's track.
    pub owner: u32,
    /// At this distance from the owner it has parted, m.
    parted_m: f64,
}

impl Tie {
    /// A tie to the track `owner`; the part has left it at a distance of `parted_m`.
    pub const fn at(owner: u32, parted_m: f64) -> Self {
        Self { owner, parted_m: if parted_m > PARTED_M { parted_m } else { PARTED_M } }
    }
}

/// The tracks that were there when an appearance came, and what it has looked like since.
#[derive(Clone, Debug)]
pub struct Company {
    /// Where it was first.
    from: Point,
    /// Sum of its outlines' chords, each in the direction it has gone, m.
    chords: Point,
    hits: f64,
    /// How many of them were inside a vehicle.
    held: f64,
    near: Vec<Beside>,
}

/// One of the tracks that were there before, and between which positions relative to it an appearance was.
#[derive(Clone, Debug)]
struct Beside {
    owner: u32,
    offsets: Bounds,
}

impl RuleTracker {
    /// Notes where an appearance is relative to the tracks that were there before it, and how long it is.
    pub(super) fn compare(&mut self, index: usize, seen: &Detection) {
        let Some(track) = self.tracks.get(index) else { return };
        let (id, at_s) = (track.id, track.last_hit_s);
        if at_s - track.first_s < GUESS_S {
            return;
        }
        let at = track.motion.place(at_s);
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        let older = near.filter(|other| other.id < id && other.near_in == self.scan && !other.is_occluded());
        let offsets = older.map(|other| (other.id, at - other.motion.place(at_s)));
        let mut company = if let Some(mut company) = track.company.clone() {
            for (owner, offset) in offsets {
                company.near.retain_mut(|known| known.owner != owner || known.stays(offset));
            }
            company
        } else {
            let near = offsets.filter(|(_, offset)| offset.length() < NEAR_M);
            let near = near.map(|(owner, offset)| Beside { owner, offsets: Bounds::of(offset) }).collect();
            Company { from: at, chords: Point::default(), hits: 0.0, held: 0.0, near }
        };
        let chord = seen.outline[2] - seen.outline[0];
        let forwards = chord.dot(track.motion.velocity()) >= 0.0;
        company.chords = if forwards { company.chords + chord } else { company.chords - chord };
        company.hits += 1.0;
        company.held += f64::from(u8::from(self.vehicle_around(seen).is_some()));
        if let Some(track) = self.tracks.get_mut(index) {
            track.company = Some(company);
        }
    }

    /// Decides of which track a recent appearance is a part, once it has gone far enough.
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
            track.part_of = owner.map(|owner| Tie::at(owner, PARTED_M));
            track.company = None;
        }
        if let Some(owner) = owner {
            self.mount(owner, way);
        }
    }

    fn owner(&self, company: &Company, way: Point) -> Option<u32> {
        let is_long = company.chords.dot(way) >= LONG_M * company.hits * way.length();
        if !is_long && company.held < HELD * company.hits {
            return None;
        }
        let owners = company.near.iter().filter_map(|near| self.tracks.get(self.index_of(near.owner)?));
        let owner = owners.filter(|owner| owner.confirmed).min_by_key(|owner| owner.id)?;
        Some(owner.part_of.map_or(owner.id, |tie| tie.owner))
    }

    /// Releases a part that has parted from its owner, or has lost it: then the owner's other parts become parts of
    /// this one.
    pub(super) fn let_go(&mut self, index: usize) {
        let Some((track, tie)) = self.tracks.get(index).and_then(|track| Some((track, track.part_of?)))
        else {
            return;
        };
        let owner = tie.owner;
        let (id, at_s, at) = (track.id, track.last_hit_s, track.motion.place(track.last_hit_s));
        let found = self.find(owner);
        match found.and_then(|index| self.tracks.get(index)) {
            Some(owner) if owner.is_occluded() || (owner.motion.place(at_s) - at).length() < tie.parted_m => {
                return;
            }
            Some(_) => {}
            None => {
                let ties = self.tracks.iter_mut().filter_map(|other| other.part_of.as_mut());
                ties.filter(|tie| tie.owner == owner).for_each(|tie| tie.owner = id);
                let vehicles = self.vehicles.iter_mut().filter(|vehicle| vehicle.owner == owner);
                vehicles.for_each(|vehicle| vehicle.owner = id);
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
        self.offsets.take(offset);
        offset.length() < NEAR_M && self.offsets.are_rigid()
    }
}
