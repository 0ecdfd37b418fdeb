//! The host tracker's place: reports of many modules in, counted and followed people out.
//!
//! ```text
//! datagrams ─▶ intake ─▶ Sighting ─▶ tracker ─▶ TrackState ─▶ zones · counts · lines
//! (kehai::wire)  clock     site's frame  │
//!                          host's time   └─ tentative ─▶ confirmed ⇄ occluded ─▶ deleted
//! ```
#![forbid(unsafe_code)]

pub mod calibrate;
mod cells;
pub mod client;
pub mod clock;
pub mod conversation;
pub mod discovery;
pub mod door;
pub mod follower;
pub mod frame;
pub mod geometry;
pub mod health;
pub mod http;
pub mod intake;
pub mod jsonl;
pub mod live;
pub mod metrics;
pub mod mqtt;
pub mod outline;
pub mod peers;
pub mod record;
pub mod reports;
pub mod service;
pub mod sighting;
pub mod site;
pub mod store;
pub mod trackers;
pub mod trouble;
pub mod zones;
