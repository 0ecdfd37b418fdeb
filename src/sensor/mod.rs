//! The sensor as the rest of the module sees it: scans, each with its geometry and time, and a state.
//!
//! ```text
//!   link ⇄ driver ⇄ session ── startup     finds the sensor, in whatever state, and sets it up
//!                    │ │ └──── streaming   accepts its scans, recovers it when they stop
//!                    │ └────── clock       when a scan was taken, by the module's clock
//!                    └──────── request     what is asked; serial_line: at which rate; timeouts: until when; cures: resets
//! ```
//!
//! Everything but [`driver`] is plain state machines without I/O.

pub mod action;
mod arrival;
pub mod clock;
mod cures;
pub mod driver;
mod envelope;
mod request;
mod serial_line;
pub mod session;
pub mod settings;
pub mod state;
pub(crate) mod timeouts;

pub use action::{Action, Message, Received, ScanTaken};
pub use driver::{Driver, SensorEvent};
pub use session::Session;
pub use settings::{LineSettings, SensorSettings};
pub use state::{SensorCounters, SensorState};
