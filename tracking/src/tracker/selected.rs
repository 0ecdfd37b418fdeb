//! The tracker that a daemon runs, by its name.
//!
//! ```text
//!   "kehai", "kehai-without-…" ─▶ rules       │ both give tracks from the same observations
//!   "rendering", "rendering-without-…" ─▶ one formula, experimental
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use ::kehai::centre::Estimator;

use super::rendering::{RenderingModel, UnknownVariant};
use super::{Ideas, Model, Tracker, UnknownTracker};
use crate::site::Site;

/// One of this project's trackers. The default is the one with rules.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Selected {
    /// With rules: `kehai`.
    Kehai(Ideas),
    /// With one formula, experimental: `rendering`.
    Rendering(RenderingModel),
}

impl Default for Selected {
    fn default() -> Self {
        Self::Kehai(Ideas::default())
    }
}

impl FromStr for Selected {
    type Err = UnknownTracker;

    fn from_str(name: &str) -> Result<Self, UnknownTracker> {
        match name.parse() {
            Ok(model) => Ok(Self::Rendering(model)),
            Err(UnknownVariant) => name.parse().map(Self::Kehai),
        }
    }
}

impl fmt::Display for Selected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kehai(ideas) => ideas.fmt(f),
            Self::Rendering(model) => model.fmt(f),
        }
    }
}

impl Model for Selected {
    fn estimator(&self) -> Estimator {
        match self {
            Self::Kehai(ideas) => Model::estimator(ideas),
            Self::Rendering(model) => model.estimator(),
        }
    }

    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker> {
        match self {
            Self::Kehai(ideas) => ideas.build(site),
            Self::Rendering(model) => model.build(site),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_is_selected_by_the_name_it_prints() {
        for name in ["kehai", "kehai-without-division", "rendering", "rendering-without-apart"] {
            assert_eq!(name.parse::<Selected>().unwrap().to_string(), name);
        }
        assert_eq!(Selected::default().to_string(), "kehai");
        let refused = "renderings".parse::<Selected>().unwrap_err().to_string();
        assert!(refused.contains("kehai") && refused.contains("rendering"), "{refused}");
    }
}
