//! Which person is which if one explanation of what was seen is right: names of its own, which it hands on to those that grow out of it.
//!
//! ```text
//!   explanation   4 ──┬─ 4    A: 1   B: 2       signs weigh the names of each; how unlikely they were under them
//!                     ╰─ 7    A: 1   B: 2       is the doubt in it
//!                                               surprise, by what was seen, and doubt, by signs: the least is believed
//! ```
//!
//! Two people pass; who of them has set the next foot is known some steps later. The people of the likeliest explanation are the
//! tracks: when another becomes the likeliest, two tracks change places, and that one has had the right names all along. Where
//! signs speak for another than that of the tracks, its names are told of the tracks nearest to its people.
//!
//! Source: multiple hypothesis tracking, Reid 1979 (docs/bibliography.md), with attributes besides places.

use std::collections::BTreeMap;

use super::known::Known;
use super::person::Person;
use crate::assignment::{Alone, assign};
use crate::card::Card;
use crate::explanation::Explanation;
use crate::tracker::TrackId;

/// A person of one explanation and a track of another may be one body up to here, m: a step, as one of them may have set it
/// already.
const SAME_M: f64 = 0.8;

/// Names under one explanation.
#[derive(Clone, Debug, Default)]
pub(super) struct Believed {
    /// Number of the explanation, and those that it grew out of, the newest first.
    pub(super) line: Vec<u64>,
    /// How much likelier the likeliest is by what was seen, and by signs: natural logarithms.
    surprise: f64,
    doubt: f64,
    pub(super) ids: BTreeMap<Card, Known>,
}

impl Believed {
    /// How much speaks against it.
    fn against(&self) -> f64 {
        self.surprise + self.doubt
    }

    /// A sign that was so likely under its names, as a share of what it could be.
    pub(super) fn doubt(&mut self, likelihood: f64) {
        // A product of shares that are 0 says no more than that.
        self.doubt -= libm::log(likelihood.max(f64::MIN_POSITIVE));
    }
}

/// The likeliest of all; none of none.
pub(super) fn likeliest(all: &[Believed]) -> Option<(usize, &Believed)> {
    all.iter().enumerate().min_by(|(_, one), (_, other)| one.against().total_cmp(&other.against()))
}

/// Each explanation with the names of the one it is, or else of the newest one known that it grew out of, or else of the
/// likeliest.
pub(super) fn descend(mut before: Vec<Believed>, explanations: &[Explanation]) -> Vec<Believed> {
    let likeliest = likeliest(&before).map(|(index, _)| index);
    let index_of = |number: &u64| before.iter().position(|known| known.line.first() == Some(number));
    let from = |explanation: &Explanation| explanation.line.iter().find_map(index_of).or(likeliest);
    let heirs: Vec<Option<usize>> = explanations.iter().map(from).collect();
    let mut next = Vec::with_capacity(explanations.len());
    for (number, (explanation, from)) in explanations.iter().zip(&heirs).enumerate() {
        let is_last = !heirs.iter().skip(number + 1).any(|other| other == from);
        let own = from.and_then(|from| before.get_mut(from));
        let own = own.map(|own| if is_last { std::mem::take(own) } else { own.clone() });
        next.push(Believed {
            line: explanation.line.clone(),
            surprise: explanation.surprise,
            ..own.unwrap_or_default()
        });
    }
    level(&mut next);
    next
}

/// Doubts count beside each other only: the least is 0.
pub(super) fn level(all: &mut [Believed]) {
    let least = all.iter().map(|one| one.doubt).fold(f64::INFINITY, f64::min);
    all.iter_mut().for_each(|one| one.doubt -= least);
}

/// For each person of an explanation the track at the same place, one each: `people` are its, and `tracks` those of the
/// tracks. One whom there is none for keeps its own, where that is no other's.
pub(super) fn on_tracks(people: &[Person], tracks: &[Person]) -> BTreeMap<TrackId, TrackId> {
    let found = assign(people.len(), tracks.len(), &Alone::all(1.0), |row, column| {
        let (person, track) = (people.get(row)?, tracks.get(column)?);
        let apart = (person.at - track.at).length() / SAME_M;
        (apart < 1.0).then_some(apart * apart)
    });
    let track = |column: usize| tracks.get(column).map(|track| track.track);
    let mut all: BTreeMap<TrackId, TrackId> = BTreeMap::new();
    for (person, column) in people.iter().zip(&found) {
        all.extend(column.and_then(track).map(|track| (person.track, track)));
    }
    for own in people.iter().map(|person| person.track) {
        let is_track = tracks.iter().any(|track| track.track == own);
        if is_track && !all.values().any(|track| *track == own) {
            all.entry(own).or_insert(own);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use nalgebra::Matrix2;

    fn person(track: TrackId, x: f64) -> Person {
        let at = Point::new(x, 0.0);
        Person {
            track,
            at,
            velocity: Point::default(),
            covariance: Matrix2::identity(),
            existence: 1.0,
            is_told_apart: true,
        }
    }

    fn places(people: &[(TrackId, f64)], tracks: &[(TrackId, f64)]) -> Vec<(TrackId, TrackId)> {
        let [people, tracks] =
            [people, tracks].map(|all| all.iter().map(|(id, x)| person(*id, *x)).collect::<Vec<_>>());
        on_tracks(&people, &tracks).into_iter().collect()
    }

    #[test]
    fn each_stands_for_the_nearest_track_and_none_for_two() {
        assert_eq!(places(&[(1, 2.1), (2, 0.1)], &[(1, 0.0), (2, 2.0)]), [(1, 2), (2, 1)]);
        // Both are nearer to the first: the one who is farther off has the other.
        assert_eq!(places(&[(1, 0.3), (2, 0.0)], &[(1, 0.0), (2, 0.7)]), [(1, 2), (2, 1)]);
        // No body is at track 3; the one that is far from all keeps its own, unless another has it or there is none.
        assert_eq!(places(&[(1, 5.0), (2, 2.0)], &[(1, 0.0), (2, 2.0), (3, 3.0)]), [(1, 1), (2, 2)]);
        assert_eq!(places(&[(1, 5.0), (2, 0.0)], &[(1, 0.0), (2, 2.0)]), [(2, 1)]);
        assert_eq!(places(&[(7, 5.0)], &[(1, 0.0)]), []);
    }

    #[test]
    fn each_explanation_has_the_names_of_the_newest_that_it_grew_out_of() {
        let of =
            |line: &[u64], surprise: f64| Explanation { line: line.to_vec(), surprise, people: Vec::new() };
        let named = |card: u128, line: u64, doubt: f64| Believed {
            line: vec![line],
            doubt,
            ids: [(Card(card), Known::default())].into(),
            ..Believed::default()
        };
        let before = || vec![named(1, 4, 0.5), named(2, 5, 0.0)];
        let all = descend(before(), &[of(&[4], 0.0), of(&[9, 4], 1.0), of(&[8, 5, 4], 2.0), of(&[7], 3.0)]);
        let cards: Vec<Vec<Card>> = all.iter().map(|one| one.ids.keys().copied().collect()).collect();
        assert_eq!(
            cards,
            [[Card(1)], [Card(1)], [Card(2)], [Card(2)]],
            "none is known of 7: those of the likeliest"
        );
        assert_eq!(all.iter().map(Believed::against).collect::<Vec<_>>(), [0.5, 1.5, 2.0, 3.0]);
        assert_eq!(likeliest(&all).map(|(index, _)| index), Some(0));
        // Doubt counts beside that of the others only.
        let alone = descend(before(), &[of(&[4], 0.0)]);
        assert_eq!(alone[0].against(), 0.0);
        assert_eq!(descend(Vec::new(), &[of(&[1], 0.0)]).len(), 1);
    }
}
