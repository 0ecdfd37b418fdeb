//! Tracks of modules and bodies on floors, as one list of people: track-to-track association and fusion.
//!
//! ```text
//!   modules ─▶ tracker ─▶ tracks ─┐                          on the floor, seen        ⊗   one, from both
//!                                 ├─▶ associate ─▶ fuse ─▶   on the floor, hidden      ◖   one, from the floor
//!   floors  ─▶ bodies  ─▶ tracks ─┘                          beside the floor          ✕   one, from the modules
//!                                                            hidden, nothing pressed   –   has gone
//!                                                            pressed, seen to be empty ?   a person after a second
//!                                                            feet of a track that ended,
//!                                                            beside another person     –   what is left of them
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
use crate::explain::glance::Sight;
use crate::explanation::Explanation;
use crate::geometry::Point;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// A hidden track that stands on a floor on which nothing is pressed there has gone after so long, s: twice the longest
/// that both feet are in the air.
const GONE_S: f64 = 1.0;

/// Feet where a module sees nothing stand are a person who lies, or one below its plane, if they stay for so long, s. A floor holds
/// feet for some tenths of a second after they have left.
const LEFT_S: f64 = GONE_S;

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

/// A body on a floor.
#[derive(Clone, Copy, Debug, Default)]
struct Standing {
    /// None: it has been no person yet, or its number went on with a track.
    number: Option<TrackId>,
    /// It is a person though no module sees one: it was one without a track, or its track was hidden at last where no module
    /// could have found it again.
    is_own: bool,
    /// Since when it is alone where a module sees nothing stand, s.
    unseen_s: Option<f64>,
}

/// Which body is which person.
#[derive(Clone, Debug, Default)]
pub struct Fusion {
    /// By the tracker's numbers.
    tracks: BTreeMap<TrackId, Known>,
    /// By the floors' numbers.
    bodies: BTreeMap<TrackId, Standing>,
    newest: TrackId,
}

/// What the devices say of a place.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// Whether it is on a floor that is read and works there.
    pub is_floor: &'a dyn Fn(Point) -> bool,
    /// What the module that sees most of it sees there.
    pub sight: &'a dyn Fn(Point) -> Sight,
}

impl Fusion {
    /// Tracks that come under their numbers of before.
    pub fn restore(&mut self, numbers: impl Iterator<Item = TrackId>) {
        for number in numbers {
            self.newest = self.newest.max(number);
            self.tracks.insert(number, Known { number, body: None, missed_s: None });
        }
    }

    /// The people at `at_s`, by the likeliest explanation of the floors, the first one.
    pub fn fuse(
        &mut self,
        tracks: &[TrackState],
        explanations: &[Explanation],
        ground: Ground<'_>,
        at_s: f64,
    ) -> Vec<TrackState> {
        let is_floor = ground.is_floor;
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
            let of_pair =
                |track: &&&TrackState| pairs.get(&track.id).is_some_and(|paired| paired.id == body.id);
            let track = people.iter().find(of_pair);
            if let Some((track, known)) = track.and_then(|track| Some((track, self.tracks.get(&track.id)?))) {
                let number = Some(known.number);
                // A body that it was paired with before is not that person any more.
                let before = self.bodies.values_mut().filter(|other| other.number == number);
                before.for_each(|other| other.number = None);
                let is_own = track.state == LifeCycle::Occluded
                    && is_floor(track.at)
                    && (ground.sight)(body.at) == Sight::None;
                self.bodies.insert(body.id, Standing { number, is_own, unseen_s: None });
                continue;
            }
            let is_beside = |track: &&TrackState| {
                track.state != LifeCycle::Tentative && (track.at - body.at).length() < pair::REACH_M
            };
            let is_beside = people.iter().any(is_beside);
            let is_empty = (ground.sight)(body.at) == Sight::Empty;
            let number = self.alone(body.id, is_beside, is_empty, at_s);
            fused.extend(number.map(|id| TrackState { id, ..*body }));
        }
        fused
    }

    /// The number of a body without a track, if it is a person. Else it is what is left of the feet of one who has gone, or feet of
    /// those beside it: in a crowd a floor takes feet of two for a third.
    fn alone(&mut self, body: TrackId, is_beside: bool, is_empty: bool, at_s: f64) -> Option<TrackId> {
        let mut standing = self.bodies.get(&body).copied().unwrap_or_default();
        // The number went on with the track that it was paired with before.
        if self.tracks.values().any(|known| Some(known.number) == standing.number) {
            standing.number = None;
        }
        let was_person = standing.number.is_some() && standing.is_own;
        standing.unseen_s = is_empty.then(|| standing.unseen_s.unwrap_or(at_s));
        let may_be_left = standing.unseen_s.is_some_and(|since_s| at_s - since_s < LEFT_S);
        if !was_person && (is_beside || may_be_left) {
            self.bodies.insert(body, standing);
            return None;
        }
        let number = standing.number.unwrap_or_else(|| self.next());
        self.bodies.insert(body, Standing { number: Some(number), is_own: true, ..standing });
        Some(number)
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
            let number = self.bodies.get(&body.id)?.number?;
            let is_track = self.tracks.values().any(|known| known.number == number);
            (!is_track).then_some(TrackState { id: number, ..body })
        };
        for explanation in &mut explanations {
            let bodies = std::mem::take(&mut explanation.people);
            explanation.people = bodies.into_iter().filter_map(numbered).collect();
        }
        explanations
    }

    /// The number of a person: the track's; of one that begins, the body's, if that is not another's.
    fn number(&mut self, track: &TrackState, body: Option<&TrackState>) -> TrackId {
        let own = self.tracks.get(&track.id).map(|known| known.number);
        let is_others = |number: &TrackId| {
            self.tracks.iter().any(|(id, known)| *id != track.id && known.number == *number)
        };
        let of_body = body.and_then(|body| self.bodies.get(&body.id)?.number);
        let of_body = of_body.filter(|number| !is_others(number));
        own.or(of_body).unwrap_or_else(|| self.next())
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
