//! The tracker that a daemon runs, by its name.
//!
//! ```text
//!   "kehai", "kehai-without-…", "kehai-draw-…" ─▶ one formula    │ both give tracks from the same observations
//!   "kehai-rules", "kehai-rules-without-…" ─▶ rules              │
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use ::kehai::centre::Estimator;

use super::rendering::{RenderingModel, UnknownVariant};
use super::{Ideas, Model, Tracker, UnknownTracker};
use crate::site::Site;

/// One of this project's trackers. The default is the one that renders what it believes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Selected {
    /// With one formula: `kehai`.
    Rendering(RenderingModel),
    /// With rules, to compare with: `kehai-rules`.
    Rules(Ideas),
}

impl Default for Selected {
    fn default() -> Self {
        Self::Rendering(RenderingModel::default())
    }
}

impl FromStr for Selected {
    type Err = UnknownTracker;

    fn from_str(name: &str) -> Result<Self, UnknownTracker> {
        match name.parse() {
            Ok(model) => Ok(Self::Rendering(model)),
            Err(UnknownVariant) => name.parse().map(Self::Rules),
        }
    }
}

impl fmt::Display for Selected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rules(ideas) => ideas.fmt(f),
            Self::Rendering(model) => model.fmt(f),
        }
    }
}

impl Model for Selected {
    fn estimator(&self) -> Estimator {
        match self {
            Self::Rules(ideas) => Model::estimator(ideas),
            Self::Rendering(model) => model.estimator(),
        }
    }

    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker> {
        match self {
            Self::Rules(ideas) => ideas.build(site),
            Self::Rendering(model) => model.build(site),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_is_selected_by_the_name_it_prints() {
        for name in ["kehai", "kehai-without-apart", "kehai-rules", "kehai-rules-without-division"] {
            assert_eq!(name.parse::<Selected>().unwrap().to_string(), name);
        }
        assert_eq!(Selected::default().to_string(), "kehai");
        let refused = "rules".parse::<Selected>().unwrap_err().to_string();
        assert!(refused.contains("kehai-without-") && refused.contains("kehai-rules"), "{refused}");
    }
}
