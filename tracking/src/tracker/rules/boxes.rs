//! Boxes: what looks like a thing and has come within arm's reach of a person is that person's.
//!
//! ```text
//!        ▲ walks
//!    ╭───┴──╮ reach ┌─────┐     straight outlines (`attachments/outlines`), the same place beside a person
//!    ╰──────╯ ─ ─ ─ │     │     all the way (`attachments/reach`): a part of that person
//!                   └─────┘
//! ```
//!
//! A suitcase in tow and a pushchair are boxes. A thing that has parts of its own is a vehicle with a driver, and no part.

use super::RuleTracker;
use super::ablation::Idea;
use super::parts::Tie;
use crate::geometry::Point;
use crate::observation::{Detection, View};
use crate::tracker::attachments::outlines::{Outlines, WALKING_MPS};
use crate::tracker::attachments::reach::{Reach, SLACK_M, is_within};

/// After this time an appearance is not judged any more, s: the way from the edge of a module's range to its middle.
const JUDGED_S: f64 = 8.0;

/// What an appearance looks like, and which tracks have been within reach of it.
#[derive(Clone, Debug, Default)]
pub struct Faces {
    outlines: Outlines,
    reach: Vec<Reach<u32>>,
}

impl Faces {
    /// Takes where another track is, `offset` before the appearance, which is at `at`.
    fn accompany(&mut self, other: u32, at: Point, offset: Point, is_near: bool) {
        if let Some(reach) = self.reach.iter_mut().find(|reach| reach.other == other) {
            reach.note(at, offset);
        } else if is_near {
            self.reach.push(Reach::begin(other, at, offset));
        }
    }
}

impl RuleTracker {
    /// Takes one more candidate of an appearance; ties it to its owner once it is a thing and has gone far enough.
    pub(super) fn face(&mut self, index: usize, seen: &Detection, view: &View) {
        let Some(track) = self.tracks.get_mut(index) else { return };
        let Some(mut faces) = track.faces.take() else { return };
        let (id, at_s) = (track.id, track.last_hit_s);
        let at = track.motion.place(at_s);
        let is_old = at_s - track.first_s > JUDGED_S;
        if track.motion.velocity().length() > WALKING_MPS {
            faces.outlines.push(seen, view);
        }
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        for other in near.filter(|other| other.id != id && other.near_in == self.scan && !other.is_occluded())
        {
            let place = other.motion.place(at_s);
            faces.accompany(other.id, at, at - place, is_within(&seen.outline, place));
        }
        let owner = if faces.outlines.are_of_thing() && self.ideas.has(Idea::Parts) {
            self.owner_of_thing(index, &faces, at, at_s)
        } else {
            None
        };
        let Some(track) = self.tracks.get_mut(index) else { return };
        if let Some((owner, apart_m)) = owner {
            track.part_of = Some(Tie::at(owner, apart_m + SLACK_M));
        } else if !is_old {
            track.faces = Some(faces);
        }
    }

    /// The nearest person that a thing has accompanied for long enough, and how far away, m.
    fn owner_of_thing(&self, index: usize, faces: &Faces, at: Point, at_s: f64) -> Option<(u32, f64)> {
        let thing = self.tracks.get(index)?;
        let has_parts =
            || self.tracks.iter().any(|other| other.part_of.is_some_and(|tie| tie.owner == thing.id));
        if !thing.confirmed || thing.part_of.is_some() || has_parts() {
            return None;
        }
        let owner = |reach: &Reach<u32>| {
            let other = self.tracks.get(self.index_of(reach.other)?)?;
            let offset = at - other.motion.place(at_s);
            let root = other.part_of.map_or(other.id, |tie| tie.owner);
            let is_person = other.confirmed && other.unexplained.is_none() && root != thing.id;
            (is_person && reach.is_kept(at, offset)).then_some((root, offset.length()))
        };
        faces.reach.iter().filter_map(owner).min_by(|one, other| one.1.total_cmp(&other.1))
    }
}
