//! What is told of a calibration: how far the walk is, and what was found.
//!
//! ```text
//!   Status ─┬▶ advice, progress, pairs of modules     while a person walks
//!           └▶ found: quality, modules, coverage      after it is finished, or why nothing was
//! ```

use schemars::JsonSchema;
use serde::Serialize;

use super::coverage::Coverage;
use super::told::{Quality, ToldAdvice, ToldRefusal};
use crate::geometry::Pose;

/// How far it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationStatus")]
pub struct Status {
    /// Whether a calibration has begun.
    pub active: bool,
    /// How long ago, s.
    pub since_s: f64,
    /// How much of what is needed is there, 0 to 1.
    pub progress: f64,
    /// Whether the guide says that it is enough.
    pub enough: bool,
    /// What to do now, in words.
    pub advice: String,
    /// The same, for pages that say it in another language; null before it has begun.
    pub advice_is: Option<ToldAdvice>,
    /// A place to go to, in the site as it was before.
    pub place: Option<[f64; 2]>,
    /// Modules that see the walker now.
    pub sees: Vec<String>,
    /// For how long several people were in view; those moments are not used, s.
    pub crowded_s: f64,
    /// Every pair that has seen the walker together.
    pub pairs: Vec<PairStatus>,
    /// What was found, after `finish`.
    pub found: Option<FoundStatus>,
    /// Why nothing was found, after `finish`.
    pub refused: Option<String>,
    /// The same, for pages that say it in another language.
    pub refused_is: Option<ToldRefusal>,
}

/// A pair of modules.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationPair")]
pub struct PairStatus {
    /// Their names.
    pub modules: [String; 2],
    /// How long they have seen the walker together, s.
    pub common_s: f64,
    /// How long they should, s.
    pub needed_s: f64,
    /// How far apart they see the walker, m; after `finish`.
    pub residual_m: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationFound")]
pub struct FoundStatus {
    /// How good it is, in a sentence.
    pub quality: String,
    /// By which figures; null of a single module, whose place is by definition.
    pub quality_is: Option<Quality>,
    /// Each module's place.
    pub modules: Vec<ModuleStatus>,
    /// Which modules see what from there.
    pub coverage: Coverage,
}

/// Which way up a module hangs, as the walk says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationHang")]
pub struct HangStatus {
    /// Whether that is not as the site had it.
    pub turned: bool,
    /// How far apart it and another module see the walker so, m; null: the walk does not say.
    pub right_m: Option<f64>,
    /// And the other way up, m.
    pub wrong_m: Option<f64>,
}

/// Where a module or a floor was found.
#[derive(Clone, PartialEq, Debug)]
pub struct Mounting {
    /// Its name in the site.
    pub name: String,
    /// Where it is; of a floor its outer corner.
    pub pose: Pose,
    /// Whether it hangs head down; a floor never does.
    pub upside_down: bool,
}

/// A module's place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationModule")]
pub struct ModuleStatus {
    /// Its name.
    pub name: String,
    /// Its place, m, and direction, degrees.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// See `x`.
    pub yaw_deg: f64,
    /// Whether it hangs head down; of a floor false.
    pub upside_down: bool,
    /// How clearly the walk says so; absent of the module that is held fixed, and of a floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hang: Option<HangStatus>,
    /// Within which it is with 95 %, m.
    pub within_m: f64,
    /// The same for its direction, degrees.
    pub within_deg: f64,
    /// How far that is from where the site had it, m; absent if it had no place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved_m: Option<f64>,
    /// How far what it saw is from the walk, m: median.
    pub residual_m: f64,
    /// How far its clock is behind, ms.
    pub clock_ms: f64,
    /// Within which its clock is with 95 %, ms; absent of a floor, which has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock_within_ms: Option<f64>,
    /// All that in words.
    pub text: String,
}
