//! The sensor as the rest of the module sees it: scans, each with its geometry and time, and a state.
//!
//! ```text
//!   link ⇄ driver ⇄ session ── startup     finds the sensor, in whatever state, and sets it up
//!                     │  └──── streaming   takes its scans, brings it back when they stop
//!                     └─────── clock       when a scan was taken, by the module's clock
//! ```
//!
//! Everything but [`driver`] is plain state machines without I/O.

pub mod action;
mod arrival;
pub mod clock;
pub mod driver;
mod envelope;
pub mod session;
pub mod settings;
mod startup;
pub mod state;
mod streaming;

pub use action::{Action, Message, Received, ScanTaken};
pub use driver::{Driver, Happened, Outcome};
pub use session::Session;
pub use settings::{LineSettings, SensorSettings};
pub use state::{SensorCounters, SensorState};
