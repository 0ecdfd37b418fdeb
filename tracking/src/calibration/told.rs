//! Calibration for pages that say it in the visitor's language: what [`words`](super::words) says in English, as closed sets
//! with their facts.

use schemars::JsonSchema;
use serde::Serialize;

use super::advice::Advice;
use super::names::Names;
use super::{Calibration, ENOUGH_S, Refusal, median};
use crate::geometry::Point;
use crate::site::FARTHEST_M;

/// Length of a step at an ordinary pace, m.
const STEP_M: f64 = 0.7;

/// Wall that two modules see, and that helps to place them, is longer than this, m.
const WALL_M: f64 = 1.0;

/// On which side of a module a place is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "CalibrationSide")]
pub enum Side {
    /// Straight ahead of it.
    Ahead,
    /// Ahead of it, to its left.
    AheadLeft,
    /// Ahead of it, to its right.
    AheadRight,
    /// On its left.
    Left,
    /// On its right.
    Right,
}

/// A place as a walker finds it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationPlace")]
pub struct Place {
    /// Steps from the module, at least one.
    pub steps: u32,
    /// On which side of it.
    pub side: Side,
}

impl Place {
    /// A place in a module's frame.
    #[must_use]
    pub fn of(at: Point) -> Self {
        let degrees = at.angle_rad().to_degrees();
        let side = match degrees.abs() {
            ..20.0 => Side::Ahead,
            20.0..70.0 if degrees > 0.0 => Side::AheadLeft,
            20.0..70.0 => Side::AheadRight,
            _ if degrees > 0.0 => Side::Left,
            _ => Side::Right,
        };
        Self { steps: (at.length() / STEP_M).round().max(1.0) as u32, side }
    }
}

/// What the walker is to do.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "is")]
#[schemars(rename = "CalibrationAdvice")]
pub enum ToldAdvice {
    /// One module alone needs no walk.
    Single,
    /// Several people are in view of a module: all but one are to leave.
    Alone {
        /// Its name.
        module: String,
    },
    /// To walk about in front of the first module.
    Begin {
        /// Its name.
        module: String,
    },
    /// To walk to a module that no other is linked with.
    Reach {
        /// Its name.
        module: String,
    },
    /// The same of a floor.
    ReachFloor {
        /// Its name.
        module: String,
    },
    /// To walk where two modules see the walker.
    Together {
        /// The first of them.
        one: String,
        /// The other.
        other: String,
        /// Such a place, from the first of them; null if none is known.
        place: Option<Place>,
    },
    /// To walk across a floor where a module sees it.
    CrossFloor {
        /// The module.
        module: String,
        /// The floor.
        floor: String,
    },
    /// Every pair has enough.
    Enough,
}

impl ToldAdvice {
    /// An advice with the names of those it is about.
    #[must_use]
    pub fn of(advice: &Advice, names: &Names) -> Self {
        let name = |module: usize| names.of(module).to_owned();
        match advice {
            _ if names.all.len() == 1 => Self::Single,
            Advice::Alone { module } => Self::Alone { module: name(*module) },
            Advice::Begin => Self::Begin { module: name(0) },
            Advice::Reach { module } if names.is_floor(*module) => Self::ReachFloor { module: name(*module) },
            Advice::Reach { module } => Self::Reach { module: name(*module) },
            Advice::Together { modules, .. } if names.has_floor(*modules) => {
                let (module, floor) = names.pair(*modules);
                Self::CrossFloor { module: module.to_owned(), floor: floor.to_owned() }
            }
            Advice::Together { modules: (one, other), place, .. } => {
                Self::Together { one: name(*one), other: name(*other), place: place.map(Place::of) }
            }
            Advice::Enough => Self::Enough,
        }
    }
}

/// Why nothing was found.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "is")]
#[schemars(rename = "CalibrationRefusal")]
pub enum ToldRefusal {
    /// There are not two modules.
    Alone,
    /// A module has seen no person walk together with any other.
    Apart {
        /// Its name.
        module: String,
    },
    /// The same of a floor.
    ApartFloor {
        /// Its name.
        module: String,
    },
    /// Two modules have not seen the walker together for long enough.
    Short {
        /// One of them.
        one: String,
        /// The other.
        other: String,
        /// How long they did, s.
        common_s: f64,
        /// How long they should, s.
        needed_s: f64,
    },
    /// The same of a module and a floor, the other.
    ShortFloor {
        /// The module.
        one: String,
        /// The floor.
        other: String,
        /// How long they did, s.
        common_s: f64,
        /// How long they should, s.
        needed_s: f64,
    },
    /// They have, but always at the same place.
    Narrow {
        /// One of them.
        one: String,
        /// The other.
        other: String,
        /// How far the walk spreads about its middle, m.
        spread_m: f64,
    },
    /// The same of a module and a floor, the other.
    NarrowFloor {
        /// The module.
        one: String,
        /// The floor.
        other: String,
        /// How far the walk spreads about its middle, m.
        spread_m: f64,
    },
    /// What they saw does not fit together.
    Contradiction {
        /// One of them.
        one: String,
        /// The other.
        other: String,
        /// The share of the walk that does.
        share: f64,
    },
    /// Found, but not well enough.
    Vague {
        /// The module with the uncertain place.
        module: String,
        /// Within which it is with 95 %, m.
        within_m: f64,
        /// The same for its direction, degrees.
        within_deg: f64,
    },
    /// What was seen is no walk.
    Unsolved,
    /// The site has got other modules or floors since the walk began, or has them elsewhere or the other way up.
    SiteChanged,
}

impl ToldRefusal {
    /// A refusal with the names of those it is about.
    #[must_use]
    pub fn of(refusal: &Refusal, names: &Names) -> Self {
        let name = |module: usize| names.of(module).to_owned();
        let two = |modules: (usize, usize)| {
            let (one, other) = if names.has_floor(modules) {
                names.pair(modules)
            } else {
                (names.of(modules.0), names.of(modules.1))
            };
            (one.to_owned(), other.to_owned())
        };
        match *refusal {
            Refusal::Alone => Self::Alone,
            Refusal::Apart { module } if names.is_floor(module) => Self::ApartFloor { module: name(module) },
            Refusal::Apart { module } => Self::Apart { module: name(module) },
            Refusal::Short { modules, common_s } => {
                let ((one, other), needed_s) = (two(modules), ENOUGH_S);
                if names.has_floor(modules) {
                    Self::ShortFloor { one, other, common_s, needed_s }
                } else {
                    Self::Short { one, other, common_s, needed_s }
                }
            }
            Refusal::Narrow { modules, spread_m } => {
                let (one, other) = two(modules);
                if names.has_floor(modules) {
                    Self::NarrowFloor { one, other, spread_m }
                } else {
                    Self::Narrow { one, other, spread_m }
                }
            }
            Refusal::Contradiction { modules, share } => {
                let (one, other) = two(modules);
                Self::Contradiction { one, other, share }
            }
            Refusal::Vague { module, within_m, within_rad } => {
                // JSON has no infinity.
                let (within_m, within_deg) = (within_m.min(FARTHEST_M), within_rad.to_degrees().min(180.0));
                Self::Vague { module: name(module), within_m, within_deg }
            }
            Refusal::Unsolved => Self::Unsolved,
            Refusal::SiteChanged => Self::SiteChanged,
        }
    }
}

/// How good the whole is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "CalibrationGrade")]
pub enum Grade {
    /// Within 6 cm.
    VeryGood,
    /// Within 12 cm.
    Good,
    /// Within 18 cm.
    Fair,
    /// Worse.
    Poor,
}

/// How good the whole is, and by which figures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CalibrationQuality")]
pub struct Quality {
    /// In a word.
    pub grade: Grade,
    /// How far apart two modules see the walker, m: median of the pairs.
    pub apart_m: f64,
    /// Length of wall that two of them see and that fits, too, m; null if it is too short to help.
    pub wall_m: Option<f64>,
    /// Within which the worst of them is with 95 %, m.
    pub within_m: f64,
}

impl Quality {
    /// That of a result; none of a single module, whose place is by definition.
    #[must_use]
    pub fn of(calibration: &Calibration) -> Option<Self> {
        if calibration.modules.len() == 1 {
            return None;
        }
        let mut apart: Vec<f64> = calibration.pairs.iter().map(|pair| pair.residual_m).collect();
        let within_m = calibration.modules.iter().map(|placed| placed.bounds().0).fold(0.0, f64::max);
        let grade = match within_m {
            ..0.06 => Grade::VeryGood,
            ..0.12 => Grade::Good,
            ..0.18 => Grade::Fair,
            _ => Grade::Poor,
        };
        let wall_m = Some(calibration.shared_wall_m).filter(|wall_m| *wall_m > WALL_M);
        Some(Self { grade, apart_m: median(&mut apart), wall_m, within_m })
    }
}
