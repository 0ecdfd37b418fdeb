//! Reports of many devices in, counted and followed people out. No sockets, no threads, no clock of its own.
//!
//! ```text
//! datagrams ─▶ session ─▶ Observation ─▶ tracker ─▶ TrackState ─▶ zones · counts · doors ─▶ Snapshot
//! (kehai::wire)  clock      site's frame    │
//!                           host's time     └─ tentative ─▶ confirmed ⇄ occluded ─▶ deleted
//! ```
#![forbid(unsafe_code)]

pub mod alarm;
pub mod alarm_list;
pub mod areas;
pub mod assignment;
pub mod calibration;
pub mod capacity;
pub mod card;
mod cells;
pub mod clock;
mod count;
pub mod depth;
pub mod door;
mod doorway;
pub mod estimate;
pub mod expectation;
pub mod explain;
pub mod explanation;
mod figures;
pub mod floor;
pub mod fusion;
pub mod geometry;
pub mod ground;
pub mod jsonl;
pub mod keys;
pub mod lines;
pub mod mounts;
pub mod names;
pub mod now;
pub mod observation;
pub mod occupancy;
pub mod registry;
pub mod remarks;
pub mod session;
pub mod site;
pub mod site_tracker;
pub mod slug;
pub mod snapshot;
pub mod stays;
pub mod survey;
pub mod text;
pub mod total;
pub mod tracker;
pub mod zones;
