//! Which track a card belongs to, so probably: identity beside position, never moving it.
//!
//! ```text
//!   card shown ─▶ who stands at the reader: likelihood of each      then it decays: half in a minute
//!   L(track, card) = max(L so far, likelihood)                      a track that is gone has none
//! ```
//!
//! Source: paper B (Ota, Sakamoto, Kogure, Fujinami): an ID observation leaves positions alone, and every ID likelihood
//! decays by a factor between observations (eq. 4).

use serde::{Deserialize, Serialize};

use super::event::Card;

/// In so long a likelihood falls by half, s: half a minute later somebody has been hidden among others.
const HALF_S: f64 = 60.0;

/// Less likely is not worth telling.
const LEAST: f64 = 0.05;

/// A track and a card.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Name {
    /// The track.
    pub track: u64,
    /// The card's hash.
    pub card: Card,
    /// How likely they belong together, 0 to 1.
    pub likelihood: f64,
}

/// All that are known.
#[derive(Clone, Debug, Default)]
pub struct Names {
    names: Vec<Name>,
    at_s: f64,
}

impl Names {
    /// A card was shown at `now_s`, by this track with this likelihood.
    pub fn shown(&mut self, track: u64, card: Card, likelihood: f64, now_s: f64) {
        self.decay(now_s);
        let known = self.names.iter_mut().find(|name| (name.track, name.card) == (track, card));
        match known {
            Some(name) => name.likelihood = name.likelihood.max(likelihood),
            None => self.names.push(Name { track, card, likelihood }),
        }
        self.names.retain(|name| name.likelihood >= LEAST);
    }

    /// Those of these tracks at `now_s`; others are forgotten.
    pub fn of(&mut self, tracks: &[u64], now_s: f64) -> &[Name] {
        self.decay(now_s);
        self.names.retain(|name| name.likelihood >= LEAST && tracks.contains(&name.track));
        &self.names
    }

    fn decay(&mut self, now_s: f64) {
        let factor = libm::exp2(-(now_s - self.at_s).max(0.0) / HALF_S);
        self.names.iter_mut().for_each(|name| name.likelihood *= factor);
        self.at_s = self.at_s.max(now_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_fades_and_goes_with_its_track() {
        let mut names = Names::default();
        names.shown(1, Card(7), 0.8, 10.0);
        names.shown(2, Card(7), 0.01, 10.0);
        assert_eq!(names.of(&[1, 2], 10.0).len(), 1, "hardly likely is nothing");
        let half = names.of(&[1], 70.0)[0].likelihood;
        assert!((half - 0.4).abs() < 1e-9, "{half}");
        assert!(names.of(&[2], 70.0).is_empty() && names.of(&[1], 70.0).is_empty());
    }
}
