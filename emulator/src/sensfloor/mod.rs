//! An emulated SensFloor: feet in, the bytes of its serial line out.
//!
//! ```text
//!   soles at a time ─▶ signal: a tick of 66.7 ms ─▶ frames ─▶ device ─▶ bytes of the line
//!                              ▲ a tile is asked ◀─ requests ◀──┘   ◀─
//! ```
//!
//! It writes and reads bytes by itself, and shares only the types of a frame and of a layout with `kehai::floor::sensfloor`:
//! one mistake cannot cancel another.

mod device;
mod signal;

pub use device::{LineState, SensFloor};
pub use signal::{Place, Signal, Sole, TICK_US, TILE_M};

use kehai::floor::sensfloor::Frame;

/// The bytes of a frame that a floor sends of itself.
#[must_use]
pub fn bytes(frame: &Frame) -> [u8; 17] {
    let mut bytes = [0xfd, 0, 0, frame.tile.0, frame.tile.1, 0x80, 0x01, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes[1] = (frame.group >> 8) as u8;
    bytes[2] = (frame.group & 0xff) as u8;
    bytes[9..].copy_from_slice(&frame.values);
    bytes
}
