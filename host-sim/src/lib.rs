//! A world for the kehai core to live in, on a PC: emulated range finders, simulated scenes,
//! recordings, and everything that judges what the core makes of them.
//!
//! ```text
//! source ─▶ urg ─▶ link | serve ─▶ any SCIP client
//! ranges    SCIP    bytes in memory on virtual time | TCP, terminal or datagrams in real time
//! ```
#![forbid(unsafe_code)]

pub mod building;
pub mod chain;
pub mod experiment;
pub mod jsonl;
pub mod link;
pub mod module;
pub mod passage;
pub mod picture;
#[cfg(feature = "qemu")]
pub mod qemu;
pub mod recording;
pub mod replay;
pub mod run;
pub mod score;
pub mod serve;
pub mod simulated_time;
pub mod source;
pub mod uart;
pub mod urg;
pub mod world;
