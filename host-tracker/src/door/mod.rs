//! A door that lets in as many people as it was told, and no more: paper A's system.
//!
//! ```text
//!   card, number, contact, exit ─▶ inbox ─▶ machine ─▶ lock, alarm ─▶ MQTT, HTTP      again until acknowledged
//!   tracks, count of the zone ──────────────▶│   └──▶ passage ─▶ database
//!                                            └──────▶ view ─▶ frame, screen for the entrant
//! ```
//!
//! | file | what |
//! |---|---|
//! | `event` | what a door is told, and what it does |
//! | `machine` | the door itself: events and `now` in, actions out |
//! | `transition` | every way from one phase to another |
//! | `progress` | a passage under way: who has gone through, who is too many |
//! | `gate` | the line, and who has crossed it |
//! | `cards`, `output` | cards that are inside; outputs that are repeated |
//! | `passage` | a passage as it is kept |
//! | `inbox` | messages from outside: malformed, late, repeated or out of order ones change nothing |
//! | `names` | which track a card belongs to, so probably |
//! | `service` | the thread that runs all doors of a site |
//!
//! The machine has no clock, does no I/O and cannot panic. It inhibits entry only: the handle inside always opens,
//! and whoever asks to leave gets out in every phase. docs/door.md draws it, and says what it is not.
//!
//! Source: paper A (Lee, Kim, Kawata, Ohya, Yuta), the system around the two sensors.

pub mod cards;
pub mod event;
pub mod gate;
pub mod inbox;
pub mod machine;
pub mod names;
pub mod output;
pub mod passage;
mod progress;
pub mod service;
pub mod transition;

/// Silent for so long a module is lost, s: ten scans.
pub const MODULE_LOST_S: f64 = 1.0;

#[cfg(test)]
mod tests;

pub use event::{Action, Alarm, Body, Card, Contact, Event, Lock, Refusal, Seen, Trouble};
pub use inbox::{Inbox, Input, NotTaken};
pub use machine::{DoorLine, Machine};
pub use passage::{Outcome, Passage};
pub use service::{DoorDesk, DoorState, Doors, Passed, Shown, Told, Why};
pub use transition::{Cause, Phase, TRANSITIONS};
