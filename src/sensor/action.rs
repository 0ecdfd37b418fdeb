//! What a session wants done, and what it makes of bytes.
//!
//! ```text
//!   poll ─▶ SetBaud ─▶ poll ─▶ Send ─▶ poll ─▶ Wait ─▶ read ─▶ receive ─▶ scan?
//! ```

use crate::scan::ScanTime;
use crate::scip::Request;

/// What is to be done next. Ask again with [`Session::poll`](super::Session::poll) when it is done.
#[must_use]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// Set the line to this speed, after everything sent so far has left.
    SetBaud(u32),
    /// Send these bytes.
    Send(Message),
    /// Read, and hand what comes to [`Session::receive`](super::Session::receive); at this time in µs at the latest, poll.
    Wait(u64),
    /// Do not read until this time in µs: the link fails at the moment.
    Pause(u64),
}

/// Bytes to send: a request, perhaps behind a line feed that ends whatever was begun before.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Message {
    request: Request,
    led: bool,
}

impl Message {
    pub(super) const fn new(request: Request, led: bool) -> Self {
        Self { request, led }
    }

    /// The two parts to send, one after the other; the first may be empty.
    #[must_use]
    pub fn parts(&self) -> [&[u8]; 2] {
        [if self.led { b"\n" } else { b"" }, self.request.as_bytes()]
    }
}

/// What came of some bytes.
#[must_use]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received {
    /// Bytes taken: at least one of a chunk that is not empty. Hand in the rest again.
    pub consumed: usize,
    /// A complete scan: the caller's buffer holds its ranges.
    pub scan: Option<ScanTaken>,
}

/// A scan in the caller's buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScanTaken {
    /// When it was taken.
    pub time: ScanTime,
    /// Ranges, from the start of the buffer; [`Session::geometry`](super::Session::geometry) says where they point.
    pub beams: u16,
}
