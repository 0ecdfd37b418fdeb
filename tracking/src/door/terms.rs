//! The words of a door: the leaf, the lock, alarms, troubles, refusals. Closed lists, by their names in JSON and topics.
//!
//! ```text
//!   Alarm::PassedBack ◀─▶ "passed-back"
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::card::Card;

/// A number that a lock makes for each time it says that it is ready, of any sort that does not come again soon.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Nonce(pub u64);

/// Whether the leaf is shut.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Contact {
    /// It is not.
    Open,
    /// It is.
    Shut,
}

/// What the lock is to be. It inhibits entry only: from inside the handle always opens.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lock {
    /// No person may enter.
    #[default]
    Locked,
    /// Those who were counted may enter.
    Unlocked,
    /// A person inside has asked to leave: the door opens for them, and any entry is an alarm.
    Exit,
}

/// Why there is an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "DoorAlarm")]
pub enum Alarm {
    /// More went in than were let in.
    Followed,
    /// A person came into the zone while the door was unlocked.
    RanIn,
    /// A person of the group came back out, or left the zone, while the door was unlocked.
    TurnedBack,
    /// A card that has just gone in was shown again.
    PassedBack,
    /// A person went in while none was let in.
    WentIn,
    /// The leaf does not shut.
    HeldOpen,
    /// What happens at the door is not known.
    Trouble,
}

/// What ends an alarm of a door.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EndsWith {
    /// A person in charge has looked, and resets it.
    Reset,
    /// The leaf is shut.
    ShutLeaf,
    /// What happens at the door is known again.
    Recovery,
}

impl Alarm {
    /// What ends it: that alone, whatever else happens, a restart included.
    #[must_use]
    pub const fn ends_with(self) -> EndsWith {
        match self {
            Self::Followed | Self::RanIn | Self::TurnedBack | Self::PassedBack | Self::WentIn => {
                EndsWith::Reset
            }
            Self::HeldOpen => EndsWith::ShutLeaf,
            Self::Trouble => EndsWith::Recovery,
        }
    }

    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Followed => "followed",
            Self::RanIn => "ran-in",
            Self::TurnedBack => "turned-back",
            Self::PassedBack => "passed-back",
            Self::WentIn => "went-in",
            Self::HeldOpen => "held-open",
            Self::Trouble => "trouble",
        }
    }

    /// What it is, in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Followed => "more went in than were let in",
            Self::RanIn => "a person came into the zone while the door was unlocked",
            Self::TurnedBack => "a person of the group turned back while the door was unlocked",
            Self::PassedBack => "a card that had just gone in was shown again",
            Self::WentIn => "a person went in without being let in",
            Self::HeldOpen => "the leaf does not shut",
            Self::Trouble => "what happens at the door is not known",
        }
    }

    /// What to do, in words.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self.ends_with() {
            EndsWith::Reset => "look who it is, then reset the door",
            EndsWith::ShutLeaf => "shut it",
            EndsWith::Recovery => "look after what its trouble names",
        }
    }
}

/// Why a door does not know what happens.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "DoorTrouble")]
pub enum Trouble {
    /// Nothing has been seen since the start.
    Starting,
    /// The tracker says nothing any more.
    NoFrames,
    /// No report of a module that watches the door is used any more.
    ModuleLost,
    /// A module that watches the door has no key: what it says can be forged.
    NoKey,
    /// Hardly anything of the zone is seen.
    Unseen,
    /// The site was changed during a passage.
    SiteChanged,
}

/// Why something that came in changes nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refusal {
    /// A number without a card.
    #[error("no card was shown: show a card first")]
    NoCard,
    /// Another card during a passage.
    #[error("a passage is under way: wait until the door is locked again")]
    Busy,
    /// The same card again while it is asked for the number.
    #[error("this card was taken already: enter the number of people")]
    SameCard,
    /// A number out of range.
    #[error("the number of people must be from 1 to the door's people_max")]
    Number,
    /// An alarm or a trouble must be over first.
    #[error("the door is in alarm or trouble: it takes no cards until that is over")]
    NotNow,
    /// The contact has not said anything since the start: the leaf may be open.
    #[error("the contact has not said yet whether the leaf is shut: the door takes no cards until it has")]
    NoContact,
    /// An acknowledgement of what is no longer said.
    #[error("what is acknowledged is not what is said now")]
    OldAcknowledgement,
    /// Nothing to reset.
    #[error("there is no alarm to reset")]
    NoAlarm,
}
