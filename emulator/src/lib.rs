//! The sensor's and the device's side on a PC: an emulated URG, recordings, and the device's own tasks.
//!
//! ```text
//! source ─▶ urg ─▶ link | serve ─▶ any SCIP client
//! ranges    SCIP    bytes in memory on virtual time | TCP, terminal or datagrams in real time
//! feet ─▶ sensfloor ─▶ bytes of a floor's line
//!
//! sensor (serial or TCP) ─▶ pc: the device's tasks ─▶ UDP      qemu: the real image, emulated
//! ```
//!
//! The emulator encodes SCIP by itself and shares no code with `kehai::scip`, so that one mistake cannot cancel
//! another.
#![forbid(unsafe_code)]

pub mod chain;
pub mod link;
pub mod pc;
pub mod ports;
#[cfg(feature = "qemu")]
pub mod qemu;
pub mod recording;
pub mod sensfloor;
pub mod serve;
pub mod simulated_time;
pub mod source;
pub mod uart;
pub mod urg;
