//! Tracks of modules and bodies on floors, as one list of people: track-to-track association and fusion.
//!
//! ```text
//!   modules ─▶ tracker ─▶ tracks ─┐                          on the floor, seen        ⊗   one, from both
//!                                 ├─▶ associate ─▶ fuse ─▶   on the floor, hidden      ◖   one, from the floor
//!   floors  ─▶ bodies  ─▶ tracks ─┘                          beside the floor          ✕   one, from the modules
//!                                                            hidden, nothing pressed   –   has gone
//! ```
//!
//! Each side follows people by its own means and knows where the other is blind: beams end at the first body, a floor
//! ends at its edge. A person keeps one number across both. Neither side learns from the other, so a source that is
//! wrong or unplugged harms nothing but its own tracks.
//!
//! | file | what |
//! |---|---|
//! | `pair` | how likely a track and a body are the same person, and where that person is |
//! | `mod` | who is paired with whom, under which number, and who has gone |
//!
//! Source: Bar-Shalom and Campo 1986 (docs/bibliography.md): the fusion of two tracks of one target.

mod pair;

use std::collections::BTreeMap;

use crate::assignment::{Alone, assign};
use crate::explanation::Explanation;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// A hidden track that stands on a floor on which nothing is pressed there has gone after so long, s: twice the longest
/// that both feet are in the air.
const GONE_S: f64 = 1.0;

/// How surely a place is on a floor: that of a hidden track and all within so many sigmas.
const WITHIN_SIGMAS: f64 = 2.0;

/// A track of the modules.
#[derive(Clone, Copy, Debug)]
struct Known {
    number: TrackId,
    /// The body it was paired with at last.
    body: Option<TrackId>,
    /// Since when it should press panels and does not, s.
    missed_s: Option<f64>,
}

/// Which body is which person.
#[derive(Clone, Debug, Default)]
pub struct Fusion {
    /// By the tracker's numbers.
    tracks: BTreeMap<TrackId, Known>,
    /// Numbers of bodies, by the floors' numbers.
    bodies: BTreeMap<TrackId, TrackId>,
    newest: TrackId,
}

impl Fusion {
    /// Tracks that come under their numbers of before.
    pub fn restore(&mut self, numbers: impl Iterator<Item = TrackId>) {
        for number in numbers {
            self.newest = self.newest.max(number);
            self.tracks.insert(number, Known { number, body: None, missed_s: None });
        }
    }

    /// The people at `at_s`, by the likeliest explanation of the floors, the first one. `is_floor` says of a place whether it is
    /// on a floor that is read and works there.
    pub fn fuse(
        &mut self,
        tracks: &[TrackState],
        explanations: &[Explanation],
        is_floor: impl Fn(crate::geometry::Point) -> bool,
        at_s: f64,
    ) -> Vec<TrackState> {
        let bodies = explanations.first().map_or(&[][..], |likeliest| &likeliest.people);
        self.tracks.retain(|id, _| tracks.iter().any(|track| track.id == *id));
        // A body that another explanation has may be in the likeliest again.
        let all = || explanations.iter().flat_map(|explanation| &explanation.people);
        self.bodies.retain(|id, _| all().any(|body| body.id == *id));
        let is_whole = |track: &&TrackState| !matches!(track.origin, Origin::PartOf(_));
        let people: Vec<&TrackState> = tracks.iter().filter(is_whole).collect();
        let paired = assign(people.len(), bodies.len(), &Alone::all(pair::ALONE), |row, column| {
            let (track, body) = (people.get(row)?, bodies.get(column)?);
            let before = self.tracks.get(&track.id).and_then(|known| known.body);
            pair::cost(track, body, before == Some(body.id))
        });
        let mut pairs: BTreeMap<TrackId, &TrackState> = BTreeMap::new();
        for (track, body) in people.iter().zip(paired) {
            pairs.extend(body.and_then(|body| bodies.get(body)).map(|body| (track.id, body)));
        }
        let beside = people.iter().copied().filter(|track| !is_floor(track.at));
        pair_hidden(&mut pairs, &beside.collect::<Vec<_>>(), bodies);
        let mut fused = Vec::with_capacity(tracks.len() + bodies.len());
        for track in tracks {
            let body = pairs.get(&track.id).copied();
            let number = self.number(track, body);
            let on_floor = || pair::around(track, WITHIN_SIGMAS).iter().all(|at| is_floor(*at));
            let is_missed = body.is_none() && track.state == LifeCycle::Occluded && on_floor();
            let missed_s = self.tracks.get(&track.id).and_then(|known| known.missed_s);
            let missed_s = is_missed.then_some(missed_s.unwrap_or(at_s));
            self.tracks.insert(track.id, Known { number, body: body.map(|body| body.id), missed_s });
            if missed_s.is_none_or(|since_s| at_s - since_s < GONE_S) {
                let one = body.map_or(*track, |body| pair::fused(track, body));
                fused.push(TrackState { id: number, ..one });
            }
        }
        for track in &mut fused {
            if let Origin::PartOf(owner) = track.origin {
                let number = self.tracks.get(&owner).map_or(owner, |known| known.number);
                track.origin = Origin::PartOf(number);
            }
        }
        for body in bodies {
            let taken = pairs.iter().find(|(_, paired)| paired.id == body.id);
            if let Some(known) = taken.and_then(|(track, _)| self.tracks.get(track)) {
                // A body that it was paired with before is not that person any more.
                self.bodies.retain(|_, number| *number != known.number);
                self.bodies.insert(body.id, known.number);
                continue;
            }
            // The number went on with the track that it was paired with before.
            let of_a_track = |number: &TrackId| self.tracks.values().any(|known| known.number == *number);
            let own = self.bodies.get(&body.id).copied().filter(|number| !of_a_track(number));
            // A body that was never a person of its own: in a crowd a floor takes feet of two for a third.
            let is_feet_of = |track: &&TrackState| {
                track.state != LifeCycle::Tentative && (track.at - body.at).length() < pair::REACH_M
            };
            if own.is_none() && people.iter().any(is_feet_of) {
                continue;
            }
            let number = own.unwrap_or_else(|| self.next());
            self.bodies.insert(body.id, number);
            fused.push(TrackState { id: number, ..*body });
        }
        fused
    }

    /// The track of the modules that is the person of this number.
    #[must_use]
    pub fn track_of(&self, number: TrackId) -> Option<TrackId> {
        self.tracks.iter().find(|(_, known)| known.number == number).map(|(track, _)| *track)
    }

    /// Explanations of the floors, with the numbers that [`fuse`](Self::fuse) has given. They tell only of people that only the
    /// floors show: where the others are, the modules know.
    #[must_use]
    pub fn explained(&self, mut explanations: Vec<Explanation>) -> Vec<Explanation> {
        let numbered = |body: TrackState| {
            let number = self.bodies.get(&body.id).copied()?;
            let is_track = self.tracks.values().any(|known| known.number == number);
            (!is_track).then_some(TrackState { id: number, ..body })
        };
        for explanation in &mut explanations {
            let bodies = std::mem::take(&mut explanation.people);
            explanation.people = bodies.into_iter().filter_map(numbered).collect();
        }
        explanations
    }

    /// The number of a person: the older one of the two, if it is not another's.
    fn number(&mut self, track: &TrackState, body: Option<&TrackState>) -> TrackId {
        let own = self.tracks.get(&track.id).map(|known| known.number);
        let is_others = |number: &TrackId| {
            self.tracks.iter().any(|(id, known)| *id != track.id && known.number == *number)
        };
        let of_body = body.and_then(|body| self.bodies.get(&body.id)).copied();
        let of_body = of_body.filter(|number| !is_others(number));
        own.into_iter().chain(of_body).min().unwrap_or_else(|| self.next())
    }

    const fn next(&mut self) -> TrackId {
        self.newest += 1;
        self.newest
    }
}

/// Pairs bodies that are left with hidden people who are left beside the floor and within reach: no device has seen where a
/// hidden person has walked, and feet on the floor are not those of a person who is beside it.
fn pair_hidden<'a>(
    pairs: &mut BTreeMap<TrackId, &'a TrackState>,
    people: &[&TrackState],
    bodies: &'a [TrackState],
) {
    for body in bodies {
        if pairs.values().any(|paired| paired.id == body.id) {
            continue;
        }
        let off_m = |track: &TrackState| (track.at - body.at).length();
        let is_left = |track: &&&TrackState| {
            track.state == LifeCycle::Occluded
                && off_m(track) < pair::REACH_M
                && !pairs.contains_key(&track.id)
        };
        let nearest = people.iter().filter(is_left).min_by(|one, two| off_m(one).total_cmp(&off_m(two)));
        if let Some(track) = nearest {
            pairs.insert(track.id, body);
        }
    }
}

#[cfg(test)]
mod tests;
