//! Put down: what its owner has left behind in an enclosed zone is unexplained until it moves by itself, or stirs. It was tied to the owner (`tow`),
//! or both came as one body and have parted (`split`).
//!
//! ```text
//!   ● ■ ─▶ part of ●      ◀─ ●      ■ unexplained       ■ ─▶ 0.3 m: a person after all
//! ```
//!
//! Whether it stirs, the device says: for how long what it sees has been still (`attachments/stir`).

use super::note::Note;
use crate::geometry::Point;
use crate::observation::Detection;

/// Displacement that proves a track is a person, m: twice what a smoothed place at rest is off by.
pub const MOVED_M: f64 = 0.3;

/// Takes what a module's observation shows of each number; clears the doubt about those that move or stir.
pub fn judge(notes: &mut [Note], own: &[(usize, &Detection)], module: usize) {
    for &(index, seen) in own {
        if let Some(note) = notes.get_mut(index) {
            note.put_down.stirring.update(seen, module);
        }
    }
    for note in notes {
        let has_moved = |from: Point| (note.at - from).length() > MOVED_M;
        if note.put_down.at.is_some_and(has_moved) || note.put_down.stirring.is_somebody() {
            note.put_down.at = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::note::tests::at;
    use super::*;

    /// A number that was left at the origin.
    fn left() -> [Note; 1] {
        let mut note = at(1, 0.0, 0.0);
        note.put_down.doubt(note.at);
        [note]
    }

    /// Shows it still for these times, 0.1 s, one after another.
    fn still(notes: &mut [Note], times_ds: &[u16]) {
        for (scan, &static_ds) in times_ds.iter().enumerate() {
            let mut seen = Detection::chord((-0.2, 0.0), (0.2, 0.0));
            (seen.at_s, seen.candidate.static_ds) = (0.1 * scan as f64, static_ds);
            judge(notes, &[(0, &seen)], 0);
        }
    }

    #[test]
    fn what_was_left_is_a_person_once_it_moves() {
        let mut notes = left();
        notes[0].at = Point::new(0.2, 0.0);
        judge(&mut notes, &[], 0);
        assert!(notes[0].put_down.is_doubted());
        notes[0].at = Point::new(0.35, 0.0);
        judge(&mut notes, &[], 0);
        assert!(!notes[0].put_down.is_doubted());
    }

    #[test]
    fn what_was_left_is_a_person_once_it_stirs() {
        let mut notes = left();
        still(&mut notes, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        assert!(notes[0].put_down.is_doubted(), "a thing is ever longer still");
        still(&mut notes, &[1, 5, 1, 5, 1, 5, 1]);
        assert!(!notes[0].put_down.is_doubted());
    }

    #[test]
    fn what_it_did_before_it_was_left_tells_nothing() {
        let mut notes = [at(1, 0.0, 0.0)];
        still(&mut notes, &[1, 5, 1, 5, 1, 5, 1]);
        notes[0].put_down.doubt(Point::default());
        judge(&mut notes, &[], 0);
        assert!(notes[0].put_down.is_doubted());
    }
}
