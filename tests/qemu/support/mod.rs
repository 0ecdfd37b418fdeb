//! The board in QEMU, its sensor, and what is on its network segment.

pub mod board;
pub mod dns;
pub mod hostile;
pub mod lan;
pub mod observer;
pub mod segment;
pub mod station;
