//! kehai (気配): knows where people are, without a camera.
//!
//! This is the core of a module beside a laser range finder. It runs without heap, without
//! `unsafe`, without a clock of its own and without a panic on any input, on a Cortex-M board
//! and on a PC alike; the same bytes in give the same bytes out on both.
//!
//! ```text
//! bytes ─▶ scip ─▶ sensor ─▶ scan ─▶ background ─▶ cluster ─▶ candidate ─▶ centre
//!          lines    session   ranges   wall, open,   runs of     what was    where the
//!          codes    clock     stamp    unknown       foreground  seen        person stands
//!                                     └───────────── pipeline ───────────┘
//! ```
//!
//! | quantity | inside | at the edges |
//! |---|---|---|
//! | range | `u16` mm, `_mm` | mm |
//! | time | `u64` µs since boot, `_us` | s |
//! | sensor time | ms, unwrapped from 24 bits, `_ms` | ms |
//! | angle | rad, `_rad`, counter-clockwise, 0 at the front step | degrees |
//! | place | `f32` m in the sensor's frame: x forward, y left | m |
#![no_std]
#![forbid(unsafe_code)]
#![warn(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::string_slice
)]

#[cfg(test)]
extern crate std;

pub mod address;
pub mod background;
mod breaks;
pub mod candidate;
pub mod centre;
pub mod cluster;
pub mod device;
pub mod floor;
pub mod link;
pub mod math;
mod outline;
pub mod pipeline;
pub mod scan;
pub mod scip;
pub mod seal;
pub mod sensor;
pub mod sensor_model;
pub mod store;
pub mod tasks;
pub mod unseen;
pub mod update;
pub mod visibility;
pub mod wire;
