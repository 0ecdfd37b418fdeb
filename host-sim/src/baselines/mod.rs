//! Trackers of the papers, to compare with: each is run on the same observations as ours.
//!
//! | name | what it is |
//! |---|---|
//! | `lee`, `lee-38` | the steps of Lee et al. 2006 (paper A) as written, with r_c = 19 or 38 cm |
//! | `ukyo` | segments of depth images with their volume, of Ukyo et al. (paper D); run by the table `entrance` alone |
//! | `particle` | the particle filter of Noguchi et al. 2009 (paper C), with grid map and circle-fit birth |
//! | `condensation`, `condensation-joint` | that of Ota et al. 2006 (paper B), on a floor with tags only: `kehai-sim experiment floor` |
//!
//! Titles: docs/bibliography.md.

pub mod condensation;
pub mod lee;
mod outline;
pub mod particle;
pub mod ukyo;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai_tracking::site::Site;
use kehai_tracking::tracker::{Model, Selected, Tracker, UnknownTracker};

use lee::LeeSettings;
use particle::ParticleSettings;

/// The names of the trackers of the published tables.
pub const NAMES: [&str; 5] = ["kehai", "kehai-rules", "lee", "lee-38", "particle"];

/// A tracker by its name: ours, or a paper's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Choice {
    /// One of ours.
    Ours(Selected),
    /// Paper A's.
    Lee(LeeSettings),
    /// Paper C's.
    Particle(ParticleSettings),
}

/// No tracker of that name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{0}; or one of the papers': lee, lee-38, particle")]
pub struct UnknownChoice(#[from] UnknownTracker);

impl Default for Choice {
    fn default() -> Self {
        Self::Ours(Selected::default())
    }
}

impl FromStr for Choice {
    type Err = UnknownChoice;

    fn from_str(name: &str) -> Result<Self, UnknownChoice> {
        Ok(match name {
            "lee" => Self::Lee(LeeSettings::RADIUS_19),
            "lee-38" => Self::Lee(LeeSettings::RADIUS_38),
            "particle" => Self::Particle(ParticleSettings::RADIUS_15),
            _ => Self::Ours(name.parse()?),
        })
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ours(tracker) => tracker.fmt(f),
            Self::Lee(LeeSettings::RADIUS_38) => f.write_str("lee-38"),
            Self::Lee(_) => f.write_str("lee"),
            Self::Particle(_) => f.write_str("particle"),
        }
    }
}

impl Model for Choice {
    fn estimator(&self) -> Estimator {
        match self {
            Self::Ours(tracker) => tracker.estimator(),
            Self::Particle(_) => Estimator::Silhouette,
            Self::Lee(settings) => Estimator::TwoPoint { radius_mm: settings.radius_mm },
        }
    }

    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker> {
        match self {
            Self::Ours(tracker) => tracker.build(site),
            Self::Lee(settings) => Box::new(lee::Lee::new(*settings)),
            Self::Particle(settings) => Box::new(particle::Particle::new(site, *settings)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_is_found_by_the_name_it_prints() {
        for name in NAMES {
            assert_eq!(name.parse::<Choice>().unwrap().to_string(), name);
        }
        let refused = "lees".parse::<Choice>().unwrap_err().to_string();
        assert!(refused.contains("lee-38") && refused.contains("kehai-rules-without-"), "{refused}");
    }
}
