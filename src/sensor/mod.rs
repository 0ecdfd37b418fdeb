//! The sensor as the rest of the module sees it: scans, each with its geometry and time, and a state.
//!
//! ```text
//!   link ⇄ driver ⇄ session ── startup     finds the sensor, in whatever state, and sets it up
//!                     │  └──── streaming   takes its scans, brings it back when they stop
//!                     └─────── clock       when a scan was taken, by the module's clock
//! ```
//!
//! Everything but [`driver`] is plain state machines without I/O.

pub mod clock;
pub mod driver;
mod envelope;
pub mod session;
pub mod settings;
mod startup;
pub mod state;
mod streaming;

pub use driver::{Driver, Happened, Outcome};
pub use session::{Action, Session};
pub use settings::{LineSettings, SensorSettings};
pub use state::{SensorCounters, SensorState};
