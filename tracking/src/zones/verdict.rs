//! Why a zone is known, partly known or unknown: what is said of a zone follows from this.
//!
//! ```text
//!   gap of all modules ─▶ Begins          │ unknown
//!   a module was moved ─▶ Moved           │
//!   seen < 10 %        ─▶ HardlySeen      │
//!   seen < 80 %        ─▶ PartlySeen      │ partly
//!   none found, and    ─▶ NotFoundAgain   │        a gap is just over, and a person is being found, or was there before it
//!                         LeftUnseen      │        the person in it is gone, and no module has looked since
//!                         MayHide         │        a body finds room where nothing was seen since the gap
//!   else               ─▶ Seen            │ known
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::occupancy::ZoneKnown;
use crate::tracker::{LifeCycle, Origin};

/// Why so much is known of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "is")]
pub enum Verdict {
    /// Enough of it is seen.
    Seen,
    /// No module had looked; in so long, s, all who stand in view have been found.
    Begins {
        /// s.
        for_s: f64,
    },
    /// A module that looks there was moved; in so long, s, all have been found.
    Moved {
        /// s.
        for_s: f64,
    },
    /// Too little is seen to say anything.
    HardlySeen,
    /// A part is not seen.
    PartlySeen,
    /// A module looks there again after a gap, and not all who may be in it have been found.
    NotFoundAgain {
        /// s until that is over.
        for_s: f64,
    },
    /// The people counted in it are predicted to be gone, and no module has looked since.
    LeftUnseen,
    /// After a gap a body finds room where nothing was seen since.
    MayHide {
        /// That room, m².
        m2: f64,
    },
}

impl Verdict {
    /// How much is known.
    #[must_use]
    pub const fn known(self) -> ZoneKnown {
        match self {
            Self::Seen => ZoneKnown::Known,
            Self::Begins { .. } | Self::Moved { .. } | Self::HardlySeen => ZoneKnown::Unknown,
            Self::PartlySeen | Self::NotFoundAgain { .. } | Self::LeftUnseen | Self::MayHide { .. } => {
                ZoneKnown::Partly
            }
        }
    }
}

/// What a track is to the number of people in a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// It is a person of the count.
    Counted,
    /// It is not sure yet.
    Tentative,
    /// It was never seen to come in and has not moved: perhaps a thing.
    Unexplained,
    /// It is a part of another track.
    Part,
}

impl Role {
    /// Of a track in a zone that is secure or not. The zone's count, the total, the stays and the people of several areas
    /// are all of the tracks that are counted by this.
    #[must_use]
    pub const fn of(origin: Origin, state: LifeCycle, is_secure: bool) -> Self {
        match (origin, state) {
            // Shown, and never counted: the track that it is a part of stands for both.
            (Origin::PartOf(_), _) => Self::Part,
            (Origin::Unexplained, _) if !is_secure => Self::Unexplained,
            (Origin::Entered, LifeCycle::Tentative) => Self::Tentative,
            (Origin::Unexplained | Origin::Entered, _) => Self::Counted,
        }
    }

    /// It is a person of the count.
    #[must_use]
    pub const fn is_counted(self) -> bool {
        matches!(self, Self::Counted)
    }
}
