//! The notes of all numbers, by which those are judged that may be no person of their own.
//!
//! ```text
//!   detections ─▶ the seen bodies they are of ─▶ `tow`: a part of a person? ─┐
//!   where all bodies are ──────────────────────▶ `split`: from which track? ─┴▶ `put_down`: left behind?
//! ```

use super::aboard::board;
use super::body::Body;
use super::model::{Part, RenderingModel};
use super::note::{Note, place};
use super::{put_down, split, tow};
use crate::cells::Areas;
use crate::geometry::Point;
use crate::observation::{Detection, Observation};
use crate::tracker::history::History;
use crate::tracker::{Origin, TrackId};

/// A detection is of the seen body that is nearest to the middle of its chord, no farther away than this, m: a body's half
/// width, 0.26, and what its place is off by.
const OWN_M: f64 = 0.4;

/// It is also of the bodies this near to its chord, m: inside of what has that outline. A pushchair is as long as two
/// bodies, and is believed to be two. Half of a body's depth is 0.14; a person who pushes stands 0.4 behind.
const INSIDE_M: f64 = 0.2;

/// The notes of all numbers.
#[derive(Debug, Default)]
pub struct Notes {
    /// In the order of their numbers.
    notes: Vec<Note>,
    /// The numbers there were at the last observation, in the order of the bodies: mostly the same as now.
    ids: Vec<TrackId>,
}

impl Notes {
    /// In the order of their numbers.
    #[cfg(test)]
    pub fn of(notes: Vec<Note>) -> Self {
        Self { notes, ids: Vec::new() }
    }

    /// Takes where all bodies are after an observation, and judges what it shows of those that it concerned.
    pub fn update(&mut self, bodies: &[Body], seen: &Observation, enclosed: &Areas, model: RenderingModel) {
        self.forget(bodies);
        let concerned = bodies.iter().filter(|body| body.cloud.at_s() >= seen.start_s);
        let mut followed: Vec<TrackId> = Vec::new();
        for body in concerned {
            followed.push(body.id);
            let place = self.place(body.id).unwrap_or_else(|place| {
                let moments = body.cloud.moments();
                self.notes.insert(place, Note::new(body.id, moments.at, moments.velocity, seen.start_s));
                place
            });
            self.notes[place].follow(body, seen.view.module, seen.start_s);
        }
        let mut among: Vec<usize> = followed.into_iter().filter_map(|id| self.place(id).ok()).collect();
        among.sort_unstable();
        let own = own(&self.notes, &among, &seen.detections);
        let mut parted = Vec::new();
        if model.has(Part::Tow) {
            parted = tow::judge(&mut self.notes, &own, &seen.view);
            board(&mut self.notes);
        }
        if model.has(Part::PutDown) {
            put_down::judge(&mut self.notes, &own, seen.view.module);
            parted.extend(split::judge(&mut self.notes));
            for index in parted {
                if let Some(note) = self.notes.get_mut(index)
                    && enclosed.hold(note.at)
                {
                    note.put_down.doubt(note.at);
                }
            }
        }
    }

    /// Forgets the numbers that no body has any more.
    fn forget(&mut self, bodies: &[Body]) {
        if self.ids.iter().copied().eq(bodies.iter().map(|body| body.id)) {
            return;
        }
        self.ids.clear();
        self.ids.extend(bodies.iter().map(|body| body.id));
        let mut ids = self.ids.clone();
        ids.sort_unstable();
        let is_there = |id: TrackId| ids.binary_search(&id).is_ok();
        self.notes.retain(|note| is_there(note.id));
        self.notes.iter_mut().for_each(|note| note.tow.forget(|other| !is_there(other)));
    }

    /// How a number came to be.
    pub fn origin(&self, id: TrackId) -> Origin {
        self.place(id).map_or(Origin::Entered, |place| self.notes[place].origin())
    }

    /// Whether a number is a part because it appeared beside a vehicle.
    pub fn is_aboard(&self, id: TrackId) -> bool {
        let is_aboard = |place: usize| self.notes.get(place).is_some_and(|note| note.tow.is_aboard());
        self.place(id).is_ok_and(is_aboard)
    }

    /// What a number has been through; none if it is not known.
    pub fn history(&self, id: TrackId) -> Option<History> {
        self.place(id).ok().map(|place| self.notes[place].history.clone())
    }

    /// The modules have other numbers: by each number now, the one before.
    pub fn renumber(&mut self, before: &[Option<usize>]) {
        for note in &mut self.notes {
            note.history.seen_by.renumber(before);
            note.put_down.stirring.begin_anew();
        }
    }

    /// Where the note of a number is, or belongs.
    fn place(&self, id: TrackId) -> Result<usize, usize> {
        place(&self.notes, id)
    }
}

/// Which of some notes each detection is of, in the order of the notes and of the beams.
fn own<'a>(notes: &[Note], among: &[usize], detections: &'a [Detection]) -> Vec<(usize, &'a Detection)> {
    let mut own = Vec::new();
    for seen in detections {
        let far_m = |note: &Note| (note.place - seen.chord_middle()).length();
        let visible = among.iter().filter_map(|&index| Some((index, notes.get(index)?)));
        let visible = visible.filter(|(_, note)| note.seen);
        let nearest = visible.clone().min_by(|one, other| far_m(one.1).total_cmp(&far_m(other.1)));
        let nearest = nearest.filter(|(_, note)| far_m(note) < OWN_M).map(|(index, _)| index);
        let is_of =
            |(index, note): &(usize, &Note)| Some(*index) == nearest || chord_m(seen, note.place) < INSIDE_M;
        own.extend(visible.filter(is_of).map(|(index, _)| (index, seen)));
    }
    own.sort_by_key(|(index, seen)| (*index, seen.candidate.first_step));
    own
}

/// Distance of a place from a detection's chord, m.
fn chord_m(seen: &Detection, place: Point) -> f64 {
    let [first, _, last] = seen.outline;
    let chord = last - first;
    let share = (place - first).dot(chord) / chord.dot(chord).max(1e-9);
    (first + chord * share.clamp(0.0, 1.0) - place).length()
}

#[cfg(test)]
mod tests {
    use super::super::note::tests::at;
    use super::*;

    fn owners(notes: &[Note], seen: &Detection) -> Vec<TrackId> {
        let all: Vec<usize> = (0..notes.len()).collect();
        own(notes, &all, std::slice::from_ref(seen)).into_iter().map(|(index, _)| notes[index].id).collect()
    }

    #[test]
    fn a_detection_is_of_the_nearest_body_and_of_those_inside_its_outline() {
        let notes = [at(1, 0.0, 0.3), at(2, 0.0, -0.3), at(3, 0.0, -0.9)];
        // The side of a pushchair and who pushes it.
        assert_eq!(owners(&notes, &Detection::chord((0.1, 0.5), (0.1, -0.5))), [1, 2]);
        assert_eq!(owners(&notes, &Detection::chord((-0.2, -0.75), (0.2, -0.75))), [3]);
        assert_eq!(owners(&notes, &Detection::chord((-0.2, -1.5), (0.2, -1.5))), [0; 0], "of none");
    }

    #[test]
    fn a_detection_is_of_no_body_that_is_not_seen() {
        let mut hidden = at(1, 0.0, 0.0);
        hidden.seen = false;
        assert_eq!(owners(&[hidden, at(2, 0.0, 0.3)], &Detection::chord((-0.2, 0.0), (0.2, 0.0))), [2]);
    }
}
