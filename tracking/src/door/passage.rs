//! A transit (here: passage): one group from its card to the lock, as a record.
//!
//! ```text
//!   card ── number ── unlocked ── through, through ── shut       outcome, and everything that led to it
//!   └ begun_s                                     └ ended_s      its time span is its address on the time line
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::terms::{Alarm, Card};

/// How a passage ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "PassageOutcome")]
pub enum Outcome {
    /// All went through, and the door is locked.
    Complete,
    /// Fewer than were let in went through, and the door is locked.
    Fewer,
    /// No number was entered.
    GaveUp,
    /// The number never matched the count.
    Refused,
    /// There was an alarm.
    Alarmed,
    /// The door was held open.
    HeldOpen,
    /// The door did not know any more what happened.
    Trouble,
}

/// One group from its card to the lock.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Passage {
    /// The door.
    pub door: String,
    /// Counts the door's passages since the start, from 1.
    pub number: u64,
    /// When the card was shown, s on the doors' own clock, which starts with the program.
    pub begun_s: f64,
    /// When it was over, on the same clock.
    pub ended_s: f64,
    /// The card; none when a person went in without.
    pub card: Option<Card>,
    /// The number entered last; 0 if none was.
    pub entered: u32,
    /// Numbers that were checked.
    pub tries: u32,
    /// The count's distribution when the door was unlocked, or when it was refused last.
    pub count_p: Vec<f64>,
    /// Share of the zone that was seen then.
    pub seen_share: f64,
    /// Tracks in the zone when the door was unlocked.
    pub group: Vec<u64>,
    /// Tracks that went through, in order.
    pub through: Vec<u64>,
    /// How it ended.
    pub outcome: Outcome,
    /// The alarm, if there was one.
    pub alarm: Option<Alarm>,
    /// Why, in words.
    pub reason: String,
}
