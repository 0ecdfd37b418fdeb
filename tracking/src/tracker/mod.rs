//! Multi-target trackers: observations in, tracks out. Each is a pure state machine on the host's clock.
//!
//! ```text
//!   observation ─▶ predict ─▶ gate, associate ─▶ update ─▶ birth, missed detections, occlusion ─▶ tracks
//! ```
//!
//! | name | what it is |
//! |---|---|
//! | `kehai` | the default: one formula of how likely a scan is, given the bodies believed in ([`rendering`]) |
//! | `kehai-rules` | what it is compared with: detections are associated with tracks by rules ([`rules`]) |
//! | `kehai-without-…`, `kehai-rules-without-…` | the same with one part left out, to measure what it is worth (an ablation) |

pub mod attachments;
pub mod floor_plan;
pub mod history;
pub mod kalman;
pub mod reflections;
pub mod rendering;
pub mod rules;
pub mod selected;
pub mod walls;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use ::kehai::centre::Estimator;

use crate::geometry::Point;
use crate::observation::Observation;
use crate::site::Site;
use crate::site::change::SiteChange;
use history::History;
use rendering::Part;
pub use rules::ablation::{Idea, Ideas};
pub use selected::Selected;

/// Where a track is in its life.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LifeCycle {
    /// It is not sure yet that the track is a person.
    Tentative,
    /// A person, and detected.
    Confirmed,
    /// A person, and occluded.
    Occluded,
}

/// Number of a track: never used again.
pub type TrackId = u64;

/// How fast a person whom no device sees may move away, m/s: people at home and in offices stand or sit half of the time, and walk
/// at 1 m/s otherwise.
const DRIFT_MPS: f64 = 0.5;

/// How a track came to be, and with that whether it is a person of its own.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// It came in where people come in, or has moved like a person since.
    #[default]
    Entered,
    /// It was never seen to come in and has not moved since: perhaps a thing. Where a zone is secure it is a person.
    Unexplained,
    /// It is a part of another track: wheels, a frame, a load. It is never counted.
    PartOf(TrackId),
}

impl Origin {
    /// The same after `offset` was added to the numbers of all tracks.
    #[must_use]
    pub const fn renumbered(self, offset: TrackId) -> Self {
        match self {
            Self::PartOf(owner) => Self::PartOf(owner + offset),
            Self::Entered | Self::Unexplained => self,
        }
    }
}

/// What is known of a track at one time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TrackState {
    /// Never used for another track.
    pub id: TrackId,
    /// Where.
    pub at: Point,
    /// m/s.
    pub velocity: Point,
    /// Covariance of the place: xx, xy, yy, m².
    pub covariance_m2: [f64; 3],
    /// Where in its life.
    pub state: LifeCycle,
    /// Probability that a person is there at all.
    pub existence: f64,
    /// Why it is in this state, in words, for people only.
    pub reason: &'static str,
    /// How it came to be.
    pub origin: Origin,
}

/// A person in view, for tests.
#[cfg(test)]
pub const PERSON: TrackState = TrackState {
    id: 1,
    at: Point::new(0.5, 0.5),
    velocity: Point::new(0.0, 0.0),
    covariance_m2: [0.01, 0.0, 0.01],
    state: LifeCycle::Confirmed,
    existence: 1.0,
    reason: "seen",
    origin: Origin::Entered,
};

/// Turns observations into people.
pub trait Tracker {
    /// Takes what a module saw. Observations come in order of arrival, not of time.
    fn observe(&mut self, observation: &Observation);

    /// All tracks at `at_s`, s on the host's clock, predicted from the observations so far.
    fn tracks(&mut self, at_s: f64) -> Vec<TrackState>;

    /// The same without any conclusion from the time that has passed: a look changes no existence and deletes no track.
    fn peek(&self, at_s: f64) -> Vec<TrackState>;

    /// What a track has been through; none if there is no such track, or the tracker does not note it.
    fn history(&self, id: TrackId) -> Option<History> {
        let _ = id;
        None
    }

    /// Restores the tracks that another process followed, as they were `age_s` before `at_s`. The papers' trackers
    /// begin without tracks.
    fn restore(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        let _ = (people, age_s, at_s);
    }

    /// Goes on in a site that was edited. False if the tracker cannot: it is built anew then. The papers' trackers cannot.
    fn change_site(&mut self, change: &SiteChange<'_>) -> bool {
        let _ = change;
        false
    }
}

/// A tracker that can be built: its name, how it finds centres, and the tracker itself.
pub trait Model: fmt::Display + Send {
    /// How it finds the centre of a body from what a sensor saw of it.
    fn estimator(&self) -> Estimator;

    /// The tracker, with no tracks yet.
    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker>;
}

/// Name of the tracker with rules.
const NAME: &str = "kehai-rules";

/// Names of the tracker with rules with an idea left out begin so.
const WITHOUT: &str = "kehai-rules-without-";

/// No tracker of that name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no tracker \"{0}\": choose kehai or {NAME}; kehai-without- and {parts}; {WITHOUT} and {ideas}",
    parts = Part::NAMED.map(|(_, name)| name).join(", "),
    ideas = Idea::NAMED.map(|(_, name)| name).join(", "))]
pub struct UnknownTracker(pub String);

impl FromStr for Ideas {
    type Err = UnknownTracker;

    fn from_str(name: &str) -> Result<Self, UnknownTracker> {
        if name == NAME {
            return Ok(Self::default());
        }
        let idea = name.strip_prefix(WITHOUT).and_then(|idea| idea.parse().ok());
        Ok(Self::without(idea.ok_or_else(|| UnknownTracker(name.to_owned()))?))
    }
}

impl fmt::Display for Ideas {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.missing() {
            Some(idea) => write!(f, "{WITHOUT}{idea}"),
            None => f.write_str(NAME),
        }
    }
}

impl Model for Ideas {
    fn estimator(&self) -> Estimator {
        (*self).estimator()
    }

    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker> {
        Box::new(rules::RuleTracker::new(site, *self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_is_found_by_the_name_it_prints() {
        let ideas = Idea::NAMED.map(|(_, name)| format!("{WITHOUT}{name}"));
        for name in [NAME.to_owned()].iter().chain(&ideas) {
            assert_eq!(name.parse::<Ideas>().unwrap().to_string(), *name);
        }
        assert!("kehai-rules-without-sense".parse::<Ideas>().is_err());
    }
}
