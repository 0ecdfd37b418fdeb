//! Aboard: a tentative body that appears at a vehicle may be another side of it, and is part of it until it is confirmed.
//!
//! ```text
//!   ▐■▌   ▪ a rear wheel, a knee, a corner of a pushchair that turns: now one is in view, now another
//!   vehicle
//! ```
//!
//! A torso explains one side of a vehicle; what it leaves begins bodies that live for a moment. Without this a door that
//! counts one person right stays locked, since what may be a person stands beside. Inside an enclosed zone, away from
//! its entries, no person appears: there no side is confirmed. And a side that is lost on the way in is not expected inside (`life`).

use super::note::Note;
use super::tow::{PARTED_M, is_body, is_box};
use crate::geometry::Point;
use crate::tracker::TrackId;

/// What is farther from a vehicle is no side of it, m: a side begins no farther than [`PARTED_M`], and shifts by as much at most when the
/// vehicle turns.
const FAR_M: f64 = 2.0 * PARTED_M;

/// Notes of each tentative body the vehicle that it is aboard: it appeared within a vehicle's length of it. What is in tow is no
/// vehicle: a suitcase is smaller than a body. What shows the outlines of a body on the way is no side: a person who touches a vehicle
/// from behind appears as its sides do, and stays within half a metre of it.
pub fn board(notes: &mut [Note]) {
    let is_vehicle =
        |note: &&Note| note.confirmed && is_box(note) && note.tow.tie.is_none_or(|tie| tie.is_pushed);
    let vehicles = notes.iter().filter(is_vehicle).map(|note| (note.id, note.place, note.history.first_s));
    let vehicles: Vec<(TrackId, Point, f64)> = vehicles.collect();
    for note in notes {
        let is_of = |&&(vehicle, place, first_s): &&(TrackId, Point, f64)| {
            let off_m = (place - note.place).length();
            (note.tow.aboard == Some(vehicle) && off_m < FAR_M)
                || (first_s < note.history.first_s && off_m < PARTED_M)
        };
        let may_be_side = !note.confirmed && !is_body(note);
        let vehicle = vehicles.iter().filter(|_| may_be_side).find(is_of);
        note.tow.aboard = vehicle.map(|&(vehicle, ..)| vehicle);
    }
}

#[cfg(test)]
mod tests {
    use super::super::note::Tie;
    use super::super::note::tests::at;
    use super::*;
    use crate::tracker::Origin;
    use crate::tracker::attachments::outlines::Outlines;

    fn vehicle() -> Note {
        let mut note = at(1, 0.0, 0.0);
        note.tow.outlines = Outlines::of(20, 18);
        note
    }

    #[test]
    fn what_appears_at_a_box_is_aboard_until_it_is_confirmed() {
        let origins = |notes: &[Note]| notes.iter().map(Note::origin).collect::<Vec<_>>();
        let mut notes = vec![vehicle(), at(2, 5.0, 0.0)];
        for (id, x) in [(3, 0.6), (4, 5.6), (5, 1.5)] {
            let mut side = at(id, x, 0.0);
            (side.confirmed, side.history.first_s) = (false, 1.0);
            notes.push(side);
        }
        board(&mut notes);
        let entered = Origin::Entered;
        assert_eq!(origins(&notes), [entered, entered, Origin::PartOf(1), entered, entered]);
        assert!(notes[2].tow.is_aboard() && !notes[3].tow.is_aboard());
        // It shifts while it is seen from another side.
        notes[2].place = Point::new(1.2, 0.0);
        board(&mut notes);
        assert_eq!(notes[2].origin(), Origin::PartOf(1));
        notes[2].place = Point::new(1.9, 0.0);
        board(&mut notes);
        assert_eq!(notes[2].origin(), entered, "it has gone away");
        notes[2].place = Point::new(0.6, 0.0);
        board(&mut notes);
        notes[2].confirmed = true;
        board(&mut notes);
        assert_eq!(notes[2].origin(), entered);
    }

    #[test]
    fn a_pushchair_has_sides_and_a_suitcase_in_tow_has_none() {
        for is_pushed in [true, false] {
            let mut notes = [vehicle(), at(2, 0.0, 0.6), at(3, 0.3, -0.3)];
            notes[0].tow.tie = Some(Tie { owner: 2, is_pushed, parted_m: PARTED_M });
            (notes[2].confirmed, notes[2].history.first_s) = (false, 1.0);
            board(&mut notes);
            assert_eq!(notes[2].origin() == Origin::PartOf(1), is_pushed);
            assert!(!notes[0].tow.is_aboard(), "in tow");
        }
    }

    #[test]
    fn who_touches_a_vehicle_from_behind_is_no_side_of_it() {
        let mut notes = [vehicle(), at(2, 0.5, 0.0)];
        (notes[1].confirmed, notes[1].history.first_s) = (false, 1.0);
        board(&mut notes);
        assert_eq!(notes[1].origin(), Origin::PartOf(1), "nothing is known of it");
        notes[1].tow.outlines = Outlines::of(8, 5);
        board(&mut notes);
        assert_eq!(notes[1].origin(), Origin::PartOf(1), "it may be a side that is not straight everywhere");
        notes[1].tow.outlines = Outlines::of(20, 8);
        board(&mut notes);
        assert_eq!(notes[1].origin(), Origin::Entered);
    }

    #[test]
    fn a_side_of_a_vehicle_that_is_gone_has_no_owner() {
        let mut side = at(2, 0.0, 0.0);
        side.tow.aboard = Some(1);
        side.tow.forget(|other| other == 1);
        assert_eq!(side.origin(), Origin::Entered);
    }
}
