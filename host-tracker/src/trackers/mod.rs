//! Trackers: sightings in, people out. Each is a pure state machine on the host's clock.
//!
//! | name | what it is |
//! |---|---|
//! | `kehai` | ours, the default |
//! | `kehai-without-…` | ours with one idea left out, to measure what it is worth |
//! | `lee`, `lee-38` | paper A's steps as written, with r_c = 19 or 38 cm |
//! | `particle` | paper C's particle filter with grid map and circle-fit birth |

pub mod kalman;
pub mod kehai;
pub mod lee;
pub mod particle;

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use ::kehai::centre::Estimator;

use crate::geometry::Point;
use crate::sighting::Sighting;
use crate::site::Site;
use kehai::ideas::{Idea, Ideas};
use lee::LeeSettings;
use particle::ParticleSettings;

/// Where a track is in its life.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LifeCycle {
    /// Not sure yet that it is somebody.
    Tentative,
    /// Somebody, and seen.
    Confirmed,
    /// Somebody, and hidden.
    Occluded,
}

/// What is known of somebody.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TrackState {
    /// Never used for anybody else.
    pub id: u32,
    /// Where.
    pub at: Point,
    /// m/s.
    pub velocity: Point,
    /// Covariance of the place: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// Where in its life.
    pub state: LifeCycle,
    /// Probability that somebody is there at all.
    pub existence: f64,
    /// Why it is in this state, in words.
    pub reason: &'static str,
    /// Perhaps a thing: nobody saw it come in, and it has not moved.
    pub unexplained: bool,
}

/// Turns sightings into people.
pub trait Tracker {
    /// Takes what a module saw. Sightings come in order of arrival, not of time.
    fn see(&mut self, sighting: &Sighting);

    /// Everybody at `at_s`, s on the host's clock, predicted from what has been seen so far.
    fn tracks(&mut self, at_s: f64) -> Vec<TrackState>;

    /// The same with nothing concluded from the time that has passed: nobody fades or is forgotten by being looked at.
    fn peek(&self, at_s: f64) -> Vec<TrackState>;

    /// Takes people who were known `age_s` before `at_s`, when it was another process that followed them. The papers'
    /// trackers begin with nobody.
    fn restore(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        let _ = (people, age_s, at_s);
    }
}

/// A tracker by its name.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Choice {
    /// Ours.
    Kehai(Ideas),
    /// Paper A's.
    Lee(LeeSettings),
    /// Paper C's.
    Particle(ParticleSettings),
}

/// The names of all trackers.
pub const NAMES: [&str; 4] = ["kehai", "lee", "lee-38", "particle"];

/// Names of our tracker with an idea left out begin so.
const WITHOUT: &str = "kehai-without-";

/// No tracker of that name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no tracker \"{0}\": choose one of {names}, or kehai-without- and {ideas}",
    names = NAMES.join(", "), ideas = Idea::NAMED.map(|(_, name)| name).join(", "))]
pub struct UnknownTracker(String);

impl Default for Choice {
    fn default() -> Self {
        Self::Kehai(Ideas::default())
    }
}

impl FromStr for Choice {
    type Err = UnknownTracker;

    fn from_str(name: &str) -> Result<Self, UnknownTracker> {
        Ok(match name {
            "kehai" => Self::default(),
            "lee" => Self::Lee(LeeSettings::RADIUS_19),
            "lee-38" => Self::Lee(LeeSettings::RADIUS_38),
            "particle" => Self::Particle(ParticleSettings::RADIUS_15),
            _ => {
                let idea = name.strip_prefix(WITHOUT).and_then(|idea| idea.parse().ok());
                Self::Kehai(Ideas::without(idea.ok_or_else(|| UnknownTracker(name.to_owned()))?))
            }
        })
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kehai(ideas) => match ideas.missing() {
                Some(idea) => return write!(f, "{WITHOUT}{idea}"),
                None => "kehai",
            },
            Self::Lee(LeeSettings::RADIUS_38) => "lee-38",
            Self::Lee(_) => "lee",
            Self::Particle(_) => "particle",
        })
    }
}

impl Choice {
    /// How it finds centres.
    #[must_use]
    pub fn estimator(self) -> Estimator {
        match self {
            Self::Kehai(ideas) => ideas.estimator(),
            Self::Particle(_) => Estimator::Silhouette,
            Self::Lee(settings) => Estimator::TwoPoint { radius_mm: settings.radius_mm },
        }
    }

    /// The tracker itself, with nobody in it.
    #[must_use]
    pub fn build(self, site: &Arc<Site>) -> Box<dyn Tracker> {
        match self {
            Self::Kehai(ideas) => Box::new(kehai::Kehai::new(site, ideas)),
            Self::Lee(settings) => Box::new(lee::Lee::new(settings)),
            Self::Particle(settings) => Box::new(particle::Particle::new(site, settings)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_is_found_by_the_name_it_prints() {
        let ideas = Idea::NAMED.map(|(_, name)| format!("{WITHOUT}{name}"));
        for name in NAMES.map(String::from).iter().chain(&ideas) {
            assert_eq!(name.parse::<Choice>().unwrap().to_string(), *name);
        }
        assert!("kehai-without-sense".parse::<Choice>().is_err());
    }
}
