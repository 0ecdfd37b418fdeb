//! Every way from one phase of a door to another. docs/door.md draws them; tests have their names.
//!
//! ```text
//!   idle ─card▶ asked ─number▶ checking ─match▶ unlocked ─all-through▶ closing ─shut▶ idle
//!                 ▲──mismatch────┘                  └──── followed, ran-in, … ──▶ alarmed ─reset▶ idle
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a door is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Locked; no card has been shown.
    Idle,
    /// Locked; a card was shown, the number is asked for.
    Asked,
    /// Locked; the number is compared with the count.
    Checking,
    /// Unlocked; those who were counted go through.
    Unlocked,
    /// Locked again; the leaf is not shut yet.
    Closing,
    /// Locked; the leaf does not shut.
    HeldOpen,
    /// Locked; a person has to look.
    Alarmed,
    /// What happens is unknown: locked or unlocked as the site says.
    Failed,
}

/// Why a door goes from one phase to another.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// A card was shown.
    Card,
    /// A number was entered.
    Number,
    /// It is the count's, as good as certainly, and all of the zone was seen.
    Match,
    /// It is not, or it is not certain.
    Mismatch,
    /// It was not, too often.
    TooOften,
    /// Time is up.
    Timeout,
    /// All people that were let in are in.
    AllThrough,
    /// The leaf is shut.
    Shut,
    /// The leaf does not shut.
    HeldOpen,
    /// One more went in than was let in.
    Followed,
    /// A person came into the zone while the door was unlocked.
    RanIn,
    /// A person of the group came back out, or left.
    TurnedBack,
    /// The card of a person inside was shown.
    PassedBack,
    /// A person went in who was not let in.
    WentIn,
    /// What happens is unknown.
    Trouble,
    /// It is known again.
    Recovered,
    /// It is known again, and the alarm of before still stands.
    StillAlarmed,
    /// A person in charge has looked after the alarm.
    Reset,
}

/// All transitions: from, why, to.
pub const TRANSITIONS: &[(Phase, Cause, Phase)] = {
    use Cause as C;
    use Phase as P;
    &[
        (P::Idle, C::Card, P::Asked),
        (P::Idle, C::PassedBack, P::Alarmed),
        (P::Idle, C::WentIn, P::Alarmed),
        (P::Idle, C::HeldOpen, P::HeldOpen),
        (P::Idle, C::Trouble, P::Failed),
        (P::Asked, C::Number, P::Checking),
        (P::Asked, C::Timeout, P::Idle),
        (P::Asked, C::WentIn, P::Alarmed),
        (P::Asked, C::HeldOpen, P::HeldOpen),
        (P::Asked, C::Trouble, P::Failed),
        (P::Checking, C::Match, P::Unlocked),
        (P::Checking, C::Mismatch, P::Asked),
        (P::Checking, C::TooOften, P::Idle),
        (P::Checking, C::WentIn, P::Alarmed),
        (P::Checking, C::HeldOpen, P::HeldOpen),
        (P::Checking, C::Trouble, P::Failed),
        (P::Unlocked, C::AllThrough, P::Closing),
        (P::Unlocked, C::Timeout, P::Closing),
        (P::Unlocked, C::Followed, P::Alarmed),
        (P::Unlocked, C::RanIn, P::Alarmed),
        (P::Unlocked, C::TurnedBack, P::Alarmed),
        (P::Unlocked, C::PassedBack, P::Alarmed),
        (P::Unlocked, C::Trouble, P::Failed),
        (P::Closing, C::Shut, P::Idle),
        (P::Closing, C::Followed, P::Alarmed),
        (P::Closing, C::TurnedBack, P::Alarmed),
        (P::Closing, C::PassedBack, P::Alarmed),
        (P::Closing, C::HeldOpen, P::HeldOpen),
        (P::Closing, C::Trouble, P::Failed),
        (P::HeldOpen, C::Shut, P::Idle),
        (P::HeldOpen, C::Followed, P::Alarmed),
        (P::HeldOpen, C::WentIn, P::Alarmed),
        (P::HeldOpen, C::TurnedBack, P::Alarmed),
        (P::HeldOpen, C::PassedBack, P::Alarmed),
        (P::HeldOpen, C::Trouble, P::Failed),
        (P::Alarmed, C::Reset, P::Idle),
        (P::Alarmed, C::Trouble, P::Failed),
        (P::Failed, C::Recovered, P::Idle),
        (P::Failed, C::StillAlarmed, P::Alarmed),
        (P::Failed, C::StillAlarmed, P::HeldOpen),
    ]
};

/// The name of a transition, as in `unlocked-followed-alarmed`.
#[must_use]
pub fn name((from, cause, to): (Phase, Cause, Phase)) -> String {
    format!("{from}-{cause}-{to}")
}

macro_rules! shown_as_written {
    ($($kind:ty),*) => {$(
        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.serialize(f)
            }
        }
    )*};
}

shown_as_written!(
    Phase,
    Cause,
    super::terms::Alarm,
    super::terms::Lock,
    super::terms::Trouble,
    super::passage::Outcome
);
