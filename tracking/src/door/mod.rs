//! A guarded door: it lets in as many people as were entered, and no more (Lee et al. 2006; docs/bibliography.md, A).
//!
//! ```text
//!   card, number, contact, exit ─▶ inbox ─▶ machine ─▶ lock, alarm ─▶ MQTT, HTTP      again until acknowledged
//!   tracks, count of the zone ──────────────▶│   └──▶ passage ─▶ database
//!                                            └──────▶ view ─▶ frame, screen for the entrant
//! ```
//!
//! | file | what |
//! |---|---|
//! | `terms` | cards, lock, alarms, troubles, refusals: closed lists |
//! | `event` | the inputs and the actions of a door |
//! | `machine` | the door itself: events and `now` in, actions out |
//! | `transition` | every way from one phase to another |
//! | `progress` | a passage under way: which tracks have gone through, which are too many |
//! | `crossing` | the line, and which tracks have crossed it |
//! | `cards`, `output` | cards that are inside; outputs that are repeated, and leases that are renewed |
//! | `passage` | a passage as it is kept |
//! | `inbox` | messages from outside: malformed, late, repeated or out of order ones change nothing |
//! | `names` | which track a card belongs to, so probably, by the model of `crate::names` |
//! | `doors` | all doors of a site |
//!
//! The machine has no clock, does no I/O and cannot panic. It inhibits entry only: the handle inside always opens,
//! and a person who asks to leave gets out in every phase. docs/door.md draws it, and says what it is not.
//!
//! Source: Lee et al. 2006 (docs/bibliography.md, paper A), the system around the two sensors.

pub mod cards;
pub mod crossing;
pub mod doors;
pub mod event;
pub mod inbox;
pub mod machine;
pub mod names;
pub mod output;
pub mod passage;
mod progress;
pub mod prompt;
pub mod terms;
pub mod transition;

/// A module is lost when none of its reports was used for so long, s: ten scans.
pub const MODULE_LOST_S: f64 = 1.0;

#[cfg(test)]
mod tests;

pub use event::{Action, Body, Event, LockOrder, Presence, Seen};
pub use inbox::{Inbox, Input, NotTaken};
pub use machine::{DoorLine, Machine};
pub use passage::{Outcome, Passage};
pub use terms::{Alarm, Card, Contact, Lock, Nonce, Refusal, Trouble};
pub use transition::{Cause, Phase, TRANSITIONS};
