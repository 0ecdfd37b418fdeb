//! Splits: a body that was beside a track until it was confirmed may have come as one with it. Which of the two stays behind may be a thing.
//!
//! ```text
//!   ■ track    ◌ ─ beside, may be its limb ─▶ ● confirmed ─▶ 0.3 m       ■ stays behind: unexplained
//!   a chair      its carrier                                              (`put_down`)
//! ```
//!
//! A carrier goes behind what he carries before him, so that the thing is found first and is the track. A track that has shown the outlines of
//! a body is no thing.

use super::note::{Note, Split, place};
use super::put_down::MOVED_M;
use super::tow::is_body;
use crate::tracker::TrackId;

/// Beside a track is what is nearer to it than this, m: an arm's reach, 0.75, and half of a body's width.
const BESIDE_M: f64 = 1.0;

/// What has moved by less stays when the other has moved, m: half of that. Two bodies that walk away pass that distance one soon after the other.
const STAYS_M: f64 = 0.5 * MOVED_M;

/// Follows every split from where its two are now. Returns which notes have just been left behind, by their places among all.
pub fn judge(notes: &mut [Note]) -> Vec<usize> {
    (0..notes.len()).filter_map(|index| left_behind(notes, index)).collect()
}

/// Follows the split of one note. Returns which of its two has just been left behind, if either.
fn left_behind(notes: &mut [Note], index: usize) -> Option<usize> {
    let note = notes.get(index)?;
    let of = |id: TrackId| notes.get(place(notes, id).ok()?);
    let at_of = |id: TrackId| Some(of(id)?.at);
    let is_one_hidden = |id: TrackId| !note.seen || of(id).is_some_and(|other| !other.seen);
    let (split, left) = match note.split {
        split if !note.confirmed => (beside(notes, note).map_or(split, Split::Beside), None),
        Split::None => return None,
        // Where one of them has gone is not known while it is hidden.
        Split::Beside(from) | Split::Parting { from, .. } if is_one_hidden(from) => return None,
        Split::Beside(from) => {
            let parting = |from_at| Split::Parting { from, at: note.at, from_at };
            (at_of(from).map(parting).unwrap_or_default(), None)
        }
        Split::Parting { from, at, from_at } => {
            let moved_m = (note.at - at).length();
            match at_of(from).map(|now| (now - from_at).length()) {
                Some(from_m) if moved_m.max(from_m) <= MOVED_M => return None,
                Some(from_m) if from_m < STAYS_M => (Split::None, place(notes, from).ok()),
                Some(_) if moved_m < STAYS_M => (Split::None, Some(index)),
                _ => (Split::None, None),
            }
        }
    };
    notes.get_mut(index)?.split = split;
    left.filter(|&left| notes.get(left).is_some_and(|left| !is_body(left)))
}

/// The confirmed number that is nearest to one, if it is beside that.
fn beside(notes: &[Note], of: &Note) -> Option<TrackId> {
    let distance_m = |note: &Note| (note.place - of.place).length();
    let tracks = notes.iter().filter(|note| note.confirmed && distance_m(note) < BESIDE_M);
    tracks.min_by(|one, other| distance_m(one).total_cmp(&distance_m(other))).map(|track| track.id)
}

#[cfg(test)]
mod tests {
    use super::super::note::tests::at;
    use super::*;
    use crate::geometry::Point;
    use crate::tracker::attachments::outlines::Outlines;

    /// A track at the origin, and what is so far behind it and tentative, then confirmed.
    fn pair(behind_m: f64) -> [Note; 2] {
        let mut notes = [at(1, 0.0, 0.0), at(2, 0.0, -behind_m)];
        notes[1].confirmed = false;
        assert!(judge(&mut notes).is_empty());
        notes[1].confirmed = true;
        assert!(judge(&mut notes).is_empty());
        notes
    }

    /// Moves one along y, 0.1 m at a time; returns which were left behind.
    fn go(notes: &mut [Note], index: usize, times: usize) -> Vec<usize> {
        let mut left = Vec::new();
        for _ in 0..times {
            notes[index].at = notes[index].at - Point::new(0.0, 0.1);
            left.extend(judge(notes));
        }
        left
    }

    #[test]
    fn a_track_that_what_was_beside_it_leaves_is_left_behind() {
        let mut notes = pair(0.5);
        assert!(go(&mut notes, 1, 3).is_empty(), "0.3 m are not enough");
        assert_eq!(go(&mut notes, 1, 10), [0], "once");
    }

    #[test]
    fn what_was_beside_a_track_that_leaves_is_left_behind() {
        assert_eq!(go(&mut pair(0.5), 0, 10), [1]);
    }

    #[test]
    fn what_was_confirmed_elsewhere_leaves_none_behind() {
        assert!(go(&mut pair(1.1), 1, 10).is_empty());
    }

    #[test]
    fn two_who_were_tracks_before_they_met_leave_none_behind() {
        let mut notes = [at(1, 0.0, 0.0), at(2, 0.0, -0.5)];
        assert!(go(&mut notes, 1, 10).is_empty());
    }

    #[test]
    fn a_track_with_the_outlines_of_a_body_is_not_left_behind() {
        for (straight, left) in [(4, &[][..]), (10, &[0]), (18, &[0])] {
            let mut notes = pair(0.5);
            notes[0].tow.outlines = Outlines::of(20, straight);
            assert_eq!(go(&mut notes, 1, 10), left, "{straight} of 20 outlines are straight");
        }
    }

    #[test]
    fn of_two_who_both_go_on_none_is_left_behind() {
        let mut notes = pair(0.5);
        notes[0].at = Point::new(0.0, -0.2);
        assert!(go(&mut notes, 1, 10).is_empty());
    }

    #[test]
    fn of_two_of_which_one_is_hidden_none_is_left_behind() {
        for (hidden, goes) in [(0, 1), (1, 0)] {
            let mut notes = pair(0.5);
            notes[hidden].seen = false;
            assert!(go(&mut notes, goes, 10).is_empty());
            // It comes into view where it has gone meanwhile.
            notes[hidden].seen = true;
            notes[hidden].at = notes[hidden].at - Point::new(0.0, 1.0);
            assert!(judge(&mut notes).is_empty());
        }
    }

    #[test]
    fn a_track_that_is_gone_is_not_left_behind() {
        let mut notes = pair(0.5);
        assert!(go(&mut notes[1..], 0, 10).is_empty());
    }
}
