//! Scores as in the paper: detection frame by frame, and how purely an identity and a person belong together.
//!
//! ```text
//!   detection        precision  segments that show a person, of all        recall  people held by a segment, of all
//!                               two merged in one segment are both detected
//!   identification   precision  of each identity: frames with its person of most frames, of all its frames
//!                    recall     of each person: frames with the identity of most frames, of all the person's frames
//!                    each a mean, together and by the most people in view at a time in those frames
//! ```
//!
//! People are judged while a quarter of them is seen ([`super::Present::is_judged`]); those who are seen less are neither missed
//! nor falsely detected. An identity in a segment belongs to all people of it; one that its tracker carries on without
//! a segment belongs to the nearest person within [`NEAR_M`].

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::world::geometry::Point;

use super::labels::Labelled;
use super::{Present, Shot};

/// A place without a segment means a person within this, m: a body's width.
pub const NEAR_M: f64 = 0.5;

/// A track as its tracker reports it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reported {
    /// Identity.
    pub id: u64,
    /// Where, m.
    pub at: Point,
    /// The segment in which it is seen.
    pub segment: Option<usize>,
}

/// Right ones of all.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Ratio {
    /// How many were right.
    pub right: u64,
    /// Of how many.
    pub of: u64,
}

impl Ratio {
    fn count(&mut self, is_right: bool) {
        self.of += 1;
        self.right += u64::from(is_right);
    }
}

/// Shares by the most people at a time.
pub type ByMost = Vec<(usize, f64)>;

/// What a run came to.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Verdict {
    /// Segments that show a person.
    pub precision: Ratio,
    /// People held by a segment.
    pub recall: Ratio,
    /// Of each identity.
    pub identities: ByMost,
    /// Of each person.
    pub people: ByMost,
}

#[derive(Clone, Debug, Default)]
struct Frames {
    all: u64,
    most: usize,
    by: BTreeMap<u64, u64>,
}

impl Frames {
    fn count(&mut self, at_once: usize, others: impl Iterator<Item = u64>) {
        self.all += 1;
        self.most = self.most.max(at_once);
        for other in others {
            *self.by.entry(other).or_default() += 1;
        }
    }

    fn share(&self) -> (usize, f64) {
        let best = self.by.values().max().copied().unwrap_or(0);
        (self.most, best as f64 / self.all.max(1) as f64)
    }
}

/// Judges a run, frame after frame.
#[derive(Clone, Debug, Default)]
pub struct Judge {
    precision: Ratio,
    recall: Ratio,
    identities: BTreeMap<u64, Frames>,
    people: BTreeMap<u64, Frames>,
}

impl Judge {
    /// Takes a frame.
    pub fn frame(&mut self, shot: &Shot, segments: &[Labelled], reported: &[Reported]) {
        let judged: Vec<&Present> = shot.people.iter().filter(|present| present.is_judged).collect();
        for labelled in segments {
            self.precision.count(labelled.people().next().is_some());
        }
        let held: BTreeSet<u16> =
            segments.iter().flat_map(|labelled| labelled.holds.iter().copied()).collect();
        for present in &judged {
            self.recall.count(held.contains(&present.person));
        }
        let mut ids: BTreeMap<u16, BTreeSet<u64>> = BTreeMap::new();
        for track in reported {
            let of: BTreeSet<u16> = match track.segment.and_then(|index| segments.get(index)) {
                Some(labelled) => labelled.people().collect(),
                None => nearest(track.at, &shot.people).into_iter().collect(),
            };
            let is_unjudged = |person: &u16| !judged.iter().any(|present| present.person == *person);
            if !of.is_empty() && of.iter().all(is_unjudged) {
                continue;
            }
            // A track that is carried on behind another body is in no label, like its person.
            if of.is_empty() && track.segment.is_none() {
                continue;
            }
            for person in &of {
                ids.entry(*person).or_default().insert(track.id);
            }
            let frames = self.identities.entry(track.id).or_default();
            frames.count(judged.len(), of.iter().map(|person| u64::from(*person)));
        }
        for present in &judged {
            let own = ids.get(&present.person).into_iter().flatten().copied();
            self.people.entry(u64::from(present.person)).or_default().count(judged.len(), own);
        }
    }

    /// What it came to.
    #[must_use]
    pub fn finish(&self) -> Verdict {
        Verdict {
            precision: self.precision,
            recall: self.recall,
            identities: self.identities.values().map(Frames::share).collect(),
            people: self.people.values().map(Frames::share).collect(),
        }
    }
}

fn nearest(at: Point, people: &[Present]) -> Option<u16> {
    let near = people.iter().map(|present| ((present.at - at).length(), present.person));
    near.filter(|(off_m, _)| *off_m < NEAR_M)
        .min_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, person)| person)
}

#[cfg(test)]
mod tests {
    use kehai_depth::frame::Frame;
    use kehai_depth::segment::Segment;

    use super::*;

    /// A frame with judged people at 2 m, every metre.
    fn shot(people: &[u16]) -> Shot {
        let present = |person: &u16| Present {
            person: *person,
            at: Point::new(2.0, f64::from(*person)),
            share: 1.0,
            is_judged: true,
        };
        let people = people.iter().map(present).collect();
        Shot { frame: Frame::unseen(1, 1, 0), whose: Vec::new(), people }
    }

    fn segment(holds: &[u16]) -> Labelled {
        Labelled { segment: Segment::of(&[]), holds: holds.to_vec(), part_of: None }
    }

    fn track(id: u64, segment: usize) -> Reported {
        Reported { id, at: Point::default(), segment: Some(segment) }
    }

    #[test]
    fn merged_people_are_detected_and_a_bag_is_a_false_one() {
        let mut judge = Judge::default();
        judge.frame(&shot(&[0, 1, 2]), &[segment(&[0, 1]), segment(&[])], &[]);
        let verdict = judge.finish();
        assert_eq!(
            (verdict.precision, verdict.recall),
            (Ratio { right: 1, of: 2 }, Ratio { right: 2, of: 3 })
        );
    }

    #[test]
    fn an_exchange_of_identities_costs_both_their_precision_and_their_people_their_recall() {
        let mut judge = Judge::default();
        let both = [segment(&[0]), segment(&[1])];
        for number in 0..4 {
            let exchanged = usize::from(number == 3);
            judge.frame(&shot(&[0, 1]), &both, &[track(7, exchanged), track(8, 1 - exchanged)]);
        }
        let verdict = judge.finish();
        assert_eq!(verdict.identities, [(2, 0.75), (2, 0.75)]);
        assert_eq!(verdict.people, [(2, 0.75), (2, 0.75)]);
    }

    #[test]
    fn a_person_without_identity_is_missed_and_a_carried_track_is_the_nearest_person_s() {
        let mut judge = Judge::default();
        let carried = Reported { id: 7, at: Point::new(2.0, 0.3), segment: None };
        judge.frame(&shot(&[0, 1]), &[segment(&[1])], &[carried]);
        judge.frame(&shot(&[0]), &[segment(&[0])], &[track(7, 0)]);
        let verdict = judge.finish();
        assert_eq!(verdict.identities, [(2, 1.0)]);
        assert_eq!(verdict.people, [(2, 1.0), (2, 0.0)]);
    }
}
