//! The wire: what modules and hosts send each other in UDP datagrams. The one implementation for both.
//!
//! ```text
//!          host                                     module (port 4040)
//!            │  subscribe, no cookie                   │
//!            ├────────────────────────────────────────▶│
//!            │                      cookie, no longer  │
//!            │◀────────────────────────────────────────┤
//!            │  subscribe, cookie, t1   (every second) │
//!            ├────────────────────────────────────────▶│ one of four places, for 5 s
//!            │              subscribed, t1, t2, t3     │
//!            │◀────────────────────────────────────────┤
//!            │                  report, for every scan │
//!            │◀────────────────────────────────────────┤
//!            │         health, once a second at least  │
//!            │◀────────────────────────────────────────┤
//!            │  learn, absorb, …, cookie, request id   │
//!            ├────────────────────────────────────────▶│
//!            │               the answer, or a refusal  │
//!            │◀────────────────────────────────────────┤
//!
//!  datagram  ┌───────────┬────────────────────────────┬───────────────┐
//!            │ header 40 │ message, by kind (postcard)│ added later   │  1400 bytes at most
//!            └───────────┴────────────────────────────┴───────────────┘
//! ```
//!
//! | file | what |
//! |---|---|
//! | `header` | magic, version, identity, kind, room for authentication |
//! | `request` | what hosts send: [`Request`], and [`Incoming`] as a module reads it |
//! | `message` | what modules send: [`Message`] |
//! | `report` | candidates and unseen spans of a scan |
//! | `pressed` | panels of a pressure floor that are down |
//! | `health`, `counters` | how the module is, and what it has dropped |
//! | `info` | its identity, sensor and geometry |
//! | `part` | background profiles and raw scans |
//! | `role` | the right that a request needs, and a key gives |
//! | `refusal` | why a request is refused |
//! | `codec` | values to bytes and back, lists |
//!
//! `docs/wire.md` has it all for programs in other languages.
//!
//! **Compatibility.** The header, subscribe and its answers, info and the refusal of a version are
//! frozen. Within a version, fields are added at the end of a message only, never in an item of a list:
//! a peer that does not know them ignores them; a peer that misses them takes their default. Codes are only
//! added. Kinds not known are counted, and refused as [`Refusal::Unsupported`].
//!
//! **No panic.** Nothing in here panics on any bytes or values. What is not ours, cut off or
//! impossible comes back as [`Unreadable`] or [`Refusal`]; [`TooLong`] is the only error of writing.
//!
//! Nothing here knows a socket or a clock: sequences, starts, cookies and times are the callers'.

mod codec;
mod counters;
mod header;
mod health;
mod info;
mod message;
mod part;
mod pressed;
mod refusal;
mod report;
mod request;
mod role;

pub use codec::{List, TooLong};
pub use counters::{COUNTERS, Counter, Counters};
pub use header::{
    AUTHENTICATION_LEN, HEADER_LEN, Header, Identity, MAGIC, ModuleId, Unreadable, VERSION, VERSION_MIN,
};
pub use health::{
    Alarms, EVENTS, Event, EventKind, HEALTH_MAX, Health, HealthHead, LearningProgress, SensorCode,
    SensorHealth,
};
pub use info::{INFO_MAX, Info, NAME_MAX, SensorInfo};
pub use message::{Message, SETTINGS_MAX, Subscribed};
pub use part::{
    PROFILE_PART_BEAMS, PROFILE_PART_MAX, PartHead, ProfilePart, RAW_PART_BEAMS, RAW_PART_MAX, RawPart,
};
pub use pressed::{FaultyPanel, PRESSED_MAX, Pressed};
pub use refusal::{ImageFault, Refusal, Refused, SettingFault};
pub use report::{BEYOND_UNIT_MM, NECK_UNIT_MM, REPORT_MAX, Report, ReportHead, SIZED_MAX, Size};
pub use request::{CHUNK_MAX, Cookie, IDENTIFY_MAX_S, Incoming, REQUEST_MAX, Request, SETTINGS_TEXT_MAX};
pub use role::Role;

/// The port modules listen at, and answer from.
pub const PORT: u16 = 4040;

/// Longest datagram, bytes of UDP payload: an Ethernet frame carries 1500 bytes, IPv4 and UDP take 28
/// of them (with IPv6 48), and tunnels on the way some more.
pub const DATAGRAM_MAX: usize = 1400;
