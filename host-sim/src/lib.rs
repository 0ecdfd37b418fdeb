//! A world for the kehai core to live in, on a PC: emulated range finders, simulated scenes,
//! recordings, and everything that judges what the core makes of them.
#![forbid(unsafe_code)]

pub mod picture;
pub mod recording;
