//! The sensor's end of the line: whether bytes pass, how fast, and those that are on their way.

use super::LinkState;
use super::transmitter::Transmitter;

/// The sensor's end of the line.
#[derive(Debug)]
pub(super) struct Port {
    pub(super) link: LinkState,
    pub(super) transmitter: Transmitter,
    /// Bit rate at which the sensor listens.
    pub(super) baud: u32,
    /// The rate to come, and from when on.
    pub(super) next_baud: Option<(u64, u32)>,
    /// The host has yet to read what it was sent.
    pub(super) reader_behind: bool,
}

impl Port {
    pub(super) fn new(baud: u32) -> Self {
        Self {
            link: LinkState::Up,
            transmitter: Transmitter::default(),
            baud,
            next_baud: None,
            reader_behind: false,
        }
    }

    /// Changes the speed when everything queued has been sent at the old one.
    pub(super) fn change_baud_later(&mut self, baud: u32, now_us: u64) {
        self.next_baud = Some((self.transmitter.end_us().max(now_us), baud));
    }

    /// Bit rate of the bytes that are queued now.
    pub(super) fn sending_baud(&self) -> u32 {
        self.next_baud.map_or(self.baud, |(_, baud)| baud)
    }
}
