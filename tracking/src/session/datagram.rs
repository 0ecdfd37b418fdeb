//! A datagram of a device, decoded: the one place where the host turns bytes into a message.
//!
//! ```text
//!   bytes ─▶ Datagram::decode ─▶ header: which device, which start
//!                                message ─▶ session ─▶ everything else
//! ```

use kehai::wire::{Header, Message, ModuleId, Unreadable};

/// What a device sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Datagram<'a> {
    /// Sender and version.
    pub header: Header,
    /// What it says.
    pub message: Message<'a>,
}

impl<'a> Datagram<'a> {
    /// Reads a datagram of a device.
    ///
    /// # Errors
    /// It is no message of a device, or of a version that is not understood.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, Unreadable> {
        let (header, message) = Message::decode(bytes)?;
        Ok(Self { header, message })
    }

    /// The device that sent it.
    #[must_use]
    pub const fn device(&self) -> ModuleId {
        self.header.identity.module
    }
}
