//! In tow: a body with the outlines of a box that keeps its place within a person's reach is part of that person, until it parts.
//!
//! ```text
//!   ■ suitcase   ● owner        ● ■■ pushchair       ▐■▌ wheelchair: one of its bodies stays,
//!     tied to ─────▶               ◀── both tied         and is counted; the others are tied to it
//! ```
//!
//! Wheels and the frame of a wheelchair are straight, too: no footprint of a vehicle is needed. A body with parts is never a
//! part itself, so that a vehicle stays one person. A body with round outlines is preferred as the owner: otherwise one half of
//! a pushchair would own the other. What is pushed goes before its owner; a box that came first and has its owner beside it is a
//! wheelchair with a companion. Judgements of outlines and ways are shared with the tracker with rules: `attachments`.

use super::note::{Note, Tie};
use crate::geometry::Point;
use crate::observation::{Detection, View};
use crate::tracker::TrackId;
use crate::tracker::attachments::outlines::WALKING_MPS;
use crate::tracker::attachments::reach::{Reach, SLACK_M, is_within};

/// A part that is so far from its owner has parted from it at any rate, m: half a wheelchair's length and an arm.
pub const PARTED_M: f64 = 0.9;

/// Log odds from which outlines are those of a box: one in a hundred. With seven in twelve straight, as the tracker with
/// rules asks for, people in wide coats were parts of their neighbours.
const BOX: f64 = 4.605;

/// After so long on its way a number without an owner is not judged any more, s: the way from the edge of a module's range to
/// its middle. While it waits nothing is learned of it, and what was not quite sure before a door is seen when both go on.
const JUDGED_S: f64 = 8.0;

/// A person farther away than this is not within reach of an outline, m: half of a pushchair, an arm, and what both
/// places lag behind on the way.
const NEAR_M: f64 = 2.0;

/// Whether a number looks like a box.
pub fn is_box(note: &Note) -> bool {
    note.tow.outlines.log_odds() > BOX
}

/// Whether a number looks like a body, as surely as another like a box.
pub fn is_body(note: &Note) -> bool {
    note.tow.outlines.log_odds() < -BOX
}

/// Takes what an observation shows of each number, ties things to owners, and releases those that have parted. Returns which
/// have.
pub fn judge(notes: &mut [Note], own: &[(usize, &Detection)], view: &View) -> Vec<usize> {
    for &(index, seen) in own {
        look(notes, index, seen, view);
    }
    for index in 0..notes.len() {
        if let Some(tie) = owner(notes, index)
            && let Some(note) = notes.get_mut(index)
        {
            (note.tow.tie, note.tow.was_tied) = (Some(tie), true);
        }
    }
    (0..notes.len()).filter(|&index| parts(notes, index)).collect()
}

/// Takes one outline of a number, and where it is beside the others.
fn look(notes: &mut [Note], index: usize, seen: &Detection, view: &View) {
    let Some(&Note { id, at, velocity, ref tow, .. }) = notes.get(index) else { return };
    let is_known = |other: TrackId| tow.reach.iter().any(|reach| reach.other == other);
    let is_near = |other: &Note| (other.at - at).dot(other.at - at) < NEAR_M * NEAR_M;
    let others = notes.iter().filter(|other| other.seen && other.id != id);
    let others = others.filter(|other| is_near(other) || is_known(other.id));
    let others: Vec<_> = others.map(|other| (other.id, other.place, at - other.at)).collect();
    let Some(Note { tow, .. }) = notes.get_mut(index) else { return };
    if velocity.length() > WALKING_MPS {
        tow.outlines.push(seen, view);
    }
    for (other, place, offset) in others {
        if let Some(reach) = tow.reach.iter_mut().find(|reach| reach.other == other) {
            reach.note(at, offset);
        } else if is_within(&seen.outline, place) {
            tow.reach.push(Reach::begin(other, at, offset));
        }
    }
}

/// The tie of a thing to its owner, once it has gone far enough beside that one.
fn owner(notes: &[Note], index: usize) -> Option<Tie> {
    let thing = notes.get(index)?;
    let is_judged = thing.confirmed && thing.seen && (thing.tow.was_tied || thing.tow.walked_s < JUDGED_S);
    let has_parts = || notes.iter().any(|other| other.tow.owner() == Some(thing.id));
    if !is_judged || !is_box(thing) || thing.tow.tie.is_some() || has_parts() {
        return None;
    }
    let beside = thing.tow.reach.iter().filter_map(|reach| {
        let other = notes.iter().find(|other| other.id == reach.other)?;
        let offset = thing.at - other.at;
        let is_person =
            other.confirmed && !other.put_down.is_doubted() && other.tow.owner() != Some(thing.id);
        let came_first = thing.history.first_s < other.history.first_s;
        (is_person && (!came_first || reach.is_ahead(thing.at, offset))).then_some((reach, other, offset))
    });
    let rank = |(_, other, offset): &(_, &Note, Point)| (is_box(other), offset.length());
    let (reach, other, offset) = beside.min_by(|one, two| {
        let (one, two) = (rank(one), rank(two));
        one.0.cmp(&two.0).then(one.1.total_cmp(&two.1))
    })?;
    let owner = other.tow.owner().unwrap_or(other.id);
    let is_pushed = reach.is_ahead(thing.at, offset);
    let tie = Tie { owner, is_pushed, parted_m: (offset.length() + SLACK_M).max(PARTED_M) };
    reach.is_kept(thing.at, offset).then_some(tie)
}

/// Releases a part that has parted from its owner, and returns true. If the owner is gone, its other parts become parts of
/// this one.
fn parts(notes: &mut [Note], index: usize) -> bool {
    let Some((part, tie)) = notes.get(index).and_then(|part| Some((part, part.tow.tie?))) else {
        return false;
    };
    let id = part.id;
    let owner = notes.iter().find(|other| other.id == tie.owner);
    if owner.is_some_and(|owner| !owner.seen || !part.seen || (owner.at - part.at).length() < tie.parted_m) {
        return false;
    }
    let is_orphan = owner.is_none();
    for note in notes.iter_mut() {
        match &mut note.tow.tie {
            tie if note.id == id => *tie = None,
            Some(other) if is_orphan && other.owner == tie.owner => other.owner = id,
            _ => {}
        }
    }
    !is_orphan
}

#[cfg(test)]
mod tests {
    use super::super::note::tests::at;
    use super::*;
    use crate::tracker::TrackId;
    use crate::tracker::attachments::outlines::Outlines;

    /// With the outlines of a box, or of a body.
    fn looks(mut note: Note, is_box: bool) -> Note {
        note.tow.outlines = Outlines::of(20, if is_box { 18 } else { 4 });
        note
    }

    /// Moves all along y by 5 cm a scan, each seen by a chord across it; returns who has parted.
    fn walk(notes: &mut [Note], scans: usize) -> Vec<TrackId> {
        let mut parted = Vec::new();
        for _ in 0..scans {
            step(notes, &[], 0.05);
            let detections: Vec<Detection> = notes
                .iter()
                .map(|note| Detection::chord((note.at.x - 0.2, note.at.y), (note.at.x + 0.2, note.at.y)))
                .collect();
            let own: Vec<_> = detections.iter().enumerate().collect();
            parted.extend(judge(notes, &own, &View::at_origin()).into_iter().map(|index| notes[index].id));
        }
        parted
    }

    /// Moves all but `stay` along y.
    fn step(notes: &mut [Note], stay: &[TrackId], way_m: f64) {
        for note in notes.iter_mut().filter(|note| !stay.contains(&note.id)) {
            note.at = note.at + Point::new(0.0, way_m);
            note.place = note.at;
        }
    }

    fn owners(notes: &[Note]) -> Vec<Option<TrackId>> {
        notes.iter().map(|note| note.tow.owner()).collect()
    }

    #[test]
    fn a_box_in_tow_is_its_owners_until_it_parts() {
        let mut notes = [looks(at(1, 0.0, 0.0), false), looks(at(2, 0.0, -0.5), true)];
        walk(&mut notes, 10);
        assert_eq!(owners(&notes), [None, None], "after half a metre");
        walk(&mut notes, 10);
        assert_eq!(owners(&notes), [None, Some(1)]);
        step(&mut notes, &[2], 0.3);
        assert!(judge(&mut notes, &[], &View::at_origin()).is_empty());
        step(&mut notes, &[2], 0.2);
        assert_eq!(judge(&mut notes, &[], &View::at_origin()), [1]);
        assert_eq!(owners(&notes), [None, None]);
    }

    #[test]
    fn two_who_are_round_are_two() {
        let mut notes = [looks(at(1, 0.0, 0.0), false), looks(at(2, 0.0, -0.5), false)];
        walk(&mut notes, 60);
        assert_eq!(owners(&notes), [None, None]);
    }

    #[test]
    fn two_in_wide_coats_are_two() {
        let mut notes = [at(1, 0.0, 0.0), at(2, 0.0, -0.5)];
        notes.iter_mut().for_each(|note| note.tow.outlines = Outlines::of(26, 13));
        walk(&mut notes, 60);
        assert_eq!(owners(&notes), [None, None]);
    }

    #[test]
    fn of_bodies_that_are_all_boxes_one_is_a_person() {
        let boxes = [at(1, 0.0, 0.0), at(2, 0.2, -0.3), at(3, -0.2, -0.3)];
        let mut notes = boxes.map(|note| looks(note, true));
        walk(&mut notes, 60);
        let parts = owners(&notes).into_iter().flatten();
        assert_eq!(parts.clone().count(), 2, "{:?}", owners(&notes));
        let owner = notes.iter().find(|note| note.tow.owner().is_none()).unwrap().id;
        assert!(parts.into_iter().all(|of| of == owner));
    }

    #[test]
    fn a_track_with_parts_is_no_part() {
        let mut notes = vec![looks(at(1, 0.0, 0.0), true), looks(at(2, 0.2, -0.4), true)];
        walk(&mut notes, 60);
        assert_eq!(owners(&notes), [None, Some(1)]);
        let behind = notes[0].at - Point::new(0.0, 0.5);
        notes.push(looks(at(3, behind.x, behind.y), false));
        walk(&mut notes, 60);
        assert_eq!(owners(&notes), [None, Some(1), None], "a wheelchair that a person pushes");
    }

    #[test]
    fn a_box_that_came_first_is_pushed_or_without_an_owner() {
        // A wheelchair and its user, and a person who catches up with them: beside it, or behind it.
        for (x, y, tied) in [(0.5, 0.0, None), (0.0, -0.5, Some(2))] {
            let mut notes = [looks(at(1, 0.0, 0.0), true), looks(at(2, x, y), false)];
            notes[1].history.first_s = 1.0;
            walk(&mut notes, 60);
            assert_eq!(owners(&notes), [tied, None]);
        }
    }

    #[test]
    fn both_halves_of_a_pushchair_are_of_who_pushes_it() {
        let mut notes =
            [looks(at(1, 0.0, 1.0), true), looks(at(2, 0.0, 0.5), true), looks(at(3, 0.0, 0.0), false)];
        // The front half is within reach of who pushes by the far end of its outline.
        notes[0].tow.reach.push(Reach::begin(3, notes[0].at, Point::new(0.0, 1.0)));
        walk(&mut notes, 60);
        assert_eq!(owners(&notes), [Some(3), Some(3), None]);
    }

    #[test]
    fn the_parts_of_an_owner_who_is_gone_are_one_person() {
        let mut notes = vec![
            looks(at(1, 0.0, 0.0), false),
            looks(at(2, 0.2, -0.4), true),
            looks(at(3, -0.2, -0.4), true),
        ];
        walk(&mut notes, 20);
        assert_eq!(owners(&notes), [None, Some(1), Some(1)]);
        notes.remove(0);
        assert!(judge(&mut notes, &[], &View::at_origin()).is_empty(), "none is left behind");
        assert_eq!(owners(&notes), [None, Some(2)]);
    }

    #[test]
    fn a_box_that_waited_with_its_owner_is_judged_when_both_go_on() {
        let tied = |walked_s| {
            let mut notes = [looks(at(1, 0.0, 0.0), false), looks(at(2, 0.0, -0.5), true)];
            notes[1].tow.walked_s = walked_s;
            walk(&mut notes, 20);
            owners(&notes)[1]
        };
        assert_eq!(tied(5.0), Some(1));
        assert_eq!(tied(9.0), None, "without an owner for so long");
    }

    #[test]
    fn a_hidden_part_does_not_part() {
        let mut notes = [looks(at(1, 0.0, 0.0), false), looks(at(2, 0.0, -0.5), true)];
        walk(&mut notes, 20);
        notes[1].seen = false;
        step(&mut notes, &[2], 2.0);
        assert!(judge(&mut notes, &[], &View::at_origin()).is_empty());
        assert_eq!(owners(&notes), [None, Some(1)]);
    }
}
