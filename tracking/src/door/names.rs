//! Which track a card belongs to, so probably: the model of [`crate::names`], with what is a door's own.
//!
//! ```text
//!   card shown ─▶ each person before the line: a share by the distance from the reader; the rest is "none of them"
//!       ●7a ──── ●                then the share goes with the track, and halves every minute
//!            ●●                   tracks that touch may have been swapped: their shares become alike
//!            ½ ½                  a track that is gone takes its share with it
//! ```
//!
//! How a place weighs a track, when two may have been swapped, and what is worth telling is decided in `crate::names` alone. Of its
//! own a door has the reading (`ARM_M`, `SHOWS_M`), the time (`HALF_LIFE_S`), and that a card that is shown again begins anew, as it may
//! have been handed on.
//!
//! A card is no sign of the site's table ([`crate::names::Names`]): signs are asked for by their IDs, published and kept in the
//! database. Of a door's cards nothing is kept, and frames show the first digits of the keyed hash.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::terms::Card;
use crate::geometry::Point;
use crate::names::Carried;
use crate::tracker::{TrackId, TrackState};

/// Spread of the distance to the reader at which a person shows the card, m: an arm's length.
const ARM_M: f64 = 0.6;

/// A track farther from the reader than this has not shown a card, m. Three spreads away a card is shown as rarely as a reading is
/// wrong: 0.011 and 0.01. The model grants each track that it is given a wrong reading, so many far tracks together would lower the
/// share of the one at the reader.
const SHOWS_M: f64 = 3.0 * ARM_M;

/// In so long a likelihood falls by half, s: a card is read once a passage, which is over in about a minute, and no second reading
/// finds out that the track is another's by then. Signs come again and again, and fade ten times as slowly.
const HALF_LIFE_S: f64 = 60.0;

/// A track and a card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "DoorName")]
pub struct Name {
    /// The track.
    pub track: TrackId,
    /// The first digits of the card's hash.
    pub label: String,
    /// How likely they belong together, 0 to 1.
    pub likelihood: f64,
}

/// The cards that were shown at a door, and their tracks.
#[derive(Clone, Debug)]
pub struct Names {
    cards: Carried<Card>,
    at_s: f64,
}

impl Default for Names {
    fn default() -> Self {
        Self { cards: Carried::with_half_life(HALF_LIFE_S), at_s: 0.0 }
    }
}

impl Names {
    /// Notes that a card was shown at the reader by one of these tracks or by none of them. It replaces what was known of the card
    /// before.
    pub fn show<'a>(&mut self, card: Card, tracks: impl IntoIterator<Item = &'a TrackState>, reader: Point) {
        let near = tracks.into_iter().filter(|track| (track.at - reader).length() < SHOWS_M);
        self.cards.read_at(card, near, reader, ARM_M);
    }

    /// Notes where all tracks are at `now_s`; a time before the last one counts as that.
    pub fn follow(&mut self, tracks: &[TrackState], now_s: f64) {
        let passed_s = (now_s - self.at_s).max(0.0);
        self.at_s += passed_s;
        self.cards.follow(tracks, passed_s);
    }

    /// What is worth telling, the likeliest first.
    #[must_use]
    pub fn told(&self) -> Vec<Name> {
        let of = |card: &Card| {
            let label = card.label();
            self.cards.told(card).into_iter().map(move |told| Name {
                track: told.track,
                label: label.clone(),
                likelihood: told.probability,
            })
        };
        let mut all: Vec<Name> = self.cards.names().flat_map(of).collect();
        all.sort_by(|one, other| other.likelihood.total_cmp(&one.likelihood));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::PERSON;

    const ALICE: Card = Card(0xa11c_e000_0000_0000_0000_0000_0000_0000);
    const BOB: Card = Card(0xb0b0_0000_0000_0000_0000_0000_0000_0000);

    /// The place of the reader.
    const READER: Point = Point::new(0.0, 0.0);

    fn track(id: TrackId, x: f64) -> TrackState {
        TrackState { id, at: Point::new(x, 0.0), ..PERSON }
    }

    fn known(names: &Names, label: &str, track: TrackId) -> f64 {
        let found = names.told().into_iter().find(|name| name.label == label && name.track == track);
        found.map_or(0.0, |name| name.likelihood)
    }

    /// Track 1 at the reader and track 2 so far from it for so long, frame by frame, from `from_s` on.
    fn apart(names: &mut Names, apart_m: f64, from_s: f64, seconds: f64) {
        for frame in 1..=(seconds * 10.0) as u32 {
            names.follow(&[track(1, 0.0), track(2, apart_m)], from_s + f64::from(frame) * 0.1);
        }
    }

    #[test]
    fn the_nearest_to_the_reader_has_most_likely_shown_the_card_and_one_alone_far_from_it_has_not() {
        let mut names = Names::default();
        names.show(ALICE, &[track(1, 0.3), track(2, 1.8)], READER);
        assert!(known(&names, "a11ce000", 1) > 0.9, "{:?}", names.told());
        assert_eq!(known(&names, "a11ce000", 2), 0.0);
        names.show(ALICE, &[track(1, 0.3), track(2, -0.3)], READER);
        let [one, other] = [1, 2].map(|track| known(&names, "a11ce000", track));
        assert!((one - other).abs() < 1e-9, "{:?}", names.told());
        names.show(ALICE, &[track(1, 1.7)], READER);
        assert!((0.0..0.5).contains(&known(&names, "a11ce000", 1)), "{:?}", names.told());
    }

    #[test]
    fn tracks_far_from_the_reader_take_nothing_from_the_one_at_it() {
        let mut names = Names::default();
        let far = |id: TrackId| track(id, 3.0 + id as f64);
        names.show(ALICE, &(2..60).map(far).collect::<Vec<_>>(), READER);
        assert_eq!(names.told(), []);
        names.show(ALICE, &(2..60).map(far).chain([track(1, 0.3)]).collect::<Vec<_>>(), READER);
        assert!(known(&names, "a11ce000", 1) > 0.9, "{:?}", names.told());
    }

    #[test]
    fn a_name_stays_with_its_track_and_halves_in_a_minute() {
        let mut names = Names::default();
        names.show(ALICE, &[track(1, 0.0), track(2, 1.3)], READER);
        let before = [1, 2].map(|track| known(&names, "a11ce000", track));
        apart(&mut names, 1.3, 0.0, 60.0);
        let after = [1, 2].map(|track| known(&names, "a11ce000", track));
        assert!(before[0] > 0.8 && (after[0] - 0.5 * before[0]).abs() < 0.002, "{before:?} {after:?}");
        assert!(after[1] < before[1], "{before:?} {after:?}");
        // For ever halving, it is forgotten.
        apart(&mut names, 1.3, 60.0, 600.0);
        assert_eq!((names.told(), names.cards.names().count()), (vec![], 0));
    }

    #[test]
    fn tracks_that_touch_become_alike_and_nothing_is_lost() {
        let mut names = Names::default();
        names.show(ALICE, &[track(1, 0.0)], READER);
        names.show(BOB, &[track(2, 0.0)], READER);
        let begun = known(&names, "a11ce000", 1);
        apart(&mut names, 0.1, 0.0, 0.3);
        assert!(known(&names, "a11ce000", 1) > 0.8 * begun, "in passing hardly anything: {:?}", names.told());
        apart(&mut names, 0.1, 0.3, 10.0);
        for label in ["a11ce000", "b0b00000"] {
            let (one, other) = (known(&names, label, 1), known(&names, label, 2));
            assert!((one - other).abs() < 0.02, "{one} {other}");
            let left = begun * libm::exp2(-10.3 / HALF_LIFE_S);
            assert!((one + other - left).abs() < 0.002, "{one} + {other} is not {left}");
        }
        // Apart again, the tracks stay alike until the card is shown again.
        apart(&mut names, 2.0, 10.3, 3.0);
        assert!(known(&names, "a11ce000", 1) < 0.5);
        names.show(ALICE, &[track(1, 0.0)], READER);
        assert_eq!((known(&names, "a11ce000", 1), known(&names, "a11ce000", 2)), (begun, 0.0));
        assert!(known(&names, "b0b00000", 1) > 0.3, "another card's is as it was");
    }

    #[test]
    fn a_track_that_is_gone_takes_its_name_with_it() {
        let mut names = Names::default();
        names.show(ALICE, &[track(1, 0.0)], READER);
        names.follow(&[track(2, 0.0)], 0.1);
        names.follow(&[track(1, 0.0), track(2, 3.0)], 0.2);
        assert_eq!(names.told(), []);
    }

    #[test]
    fn a_time_that_goes_back_brings_nothing_back() {
        let mut names = Names::default();
        names.show(ALICE, &[track(1, 0.0)], READER);
        let begun = known(&names, "a11ce000", 1);
        names.follow(&[track(1, 0.0)], 60.0);
        names.follow(&[track(1, 0.0)], 0.0);
        assert!((known(&names, "a11ce000", 1) - 0.5 * begun).abs() < 0.002, "{:?}", names.told());
    }
}
