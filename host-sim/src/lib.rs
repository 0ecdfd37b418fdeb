//! Emulated range finders, simulated worlds and recordings.
//!
//! ```text
//! source ─▶ urg ─▶ link | serve ─▶ any SCIP client
//! ranges    SCIP    bytes in memory on virtual time | TCP or a pseudo terminal in real time
//! ```
#![forbid(unsafe_code)]

pub mod link;
pub mod simulated_time;
pub mod source;
pub mod uart;
pub mod urg;
