//! What a door tells the entrant: a closed set, so that each screen says it in its own language.
//!
//! ```text
//!   Prompt::HowMany ─▶ "how-many"   "How many people go in?"
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the entrant is to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "DoorPrompt")]
pub enum Prompt {
    /// To wait: nothing has been seen since the start.
    #[default]
    Starting,
    /// To show a card.
    Ready,
    /// To enter the number of people.
    HowMany,
    /// To wait while they are counted.
    Counting,
    /// To go in.
    GoIn,
    /// Nothing: the door closes.
    Closing,
    /// To let the door shut.
    LetShut,
    /// To call for help: the door does not know what happens.
    OutOfOrder,
    /// To wait: an alarm stands, and help has been called.
    Called,
    /// To move a little and enter the number again: not all of the area is seen.
    NotSeen,
    /// To count again and enter the number: it does not match.
    CountAgain,
    /// To stand a little apart and enter the number again: the count is not sure.
    StandApart,
    /// To begin again with the card: the number did not match too often.
    BeginAgain,
}

impl Prompt {
    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Starting => "The door is starting: please wait",
            Self::Ready => "Please show your card",
            Self::HowMany => "How many people go in?",
            Self::Counting => "Please wait: counting",
            Self::GoIn => "Please go in",
            Self::Closing => "The door is closing",
            Self::LetShut => "Please let the door shut",
            Self::OutOfOrder => "The door is out of order: please call for help",
            Self::Called => "Alarm: help has been called",
            Self::NotSeen => "Not all of the area is seen: please move a little and enter the number again",
            Self::CountAgain => "The number does not match: please count again and enter it",
            Self::StandApart => {
                "The count is not sure yet: please stand a little apart and enter the number again"
            }
            Self::BeginAgain => "The number did not match: please begin again with the card",
        }
    }
}
