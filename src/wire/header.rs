//! The first 40 bytes of every datagram, and its sender. Frozen for ever.
//!
//! ```text
//!       0       1       2       3       4       5       6       7
//!   0 ┌───────────────────────┬───────┬───────────────────────────────┐
//!     │ magic  E6 B0 97       │version│ boot                  (u32)   │
//!   8 ├───────────────────────┴───────┴───────────────┬───────┬───────┤
//!     │ module id: hardware address                   │ kind  │ key   │
//!  16 ├───────────────────────────────────────────────┴───────┴───────┤
//!     │ counter                                               (u64)   │
//!  24 ├───────────────────────────────────────────────────────────────┤
//!     │ tag                                                           │
//!     │                                                               │
//!  40 └───────────────────────────────────────────────────────────────┘
//!       little endian                               then the message
//! ```
//!
//! The magic is 気 in UTF-8. Key, counter and tag (25 bytes) are 0 in a message in clear. In a sealed one the key is the number
//! of its session, the counter is another in each datagram, and the tag shows that neither header nor message was changed
//! ([`crate::seal::datagram`]).
//!
//! From a module, id and boot are its own. To a module they are those it is expected to have;
//! 0 where they are not known yet.

use super::DATAGRAM_MAX;
use super::codec::{Malformed, TooLong, Writer};
use super::counters::Counter;

/// First bytes of every datagram: 気.
pub const MAGIC: [u8; 3] = [0xE6, 0xB0, 0x97];

/// The version of the protocol spoken here.
pub const VERSION: u8 = 1;

/// The oldest version understood here.
pub const VERSION_MIN: u8 = 1;

/// Bytes of the header.
pub const HEADER_LEN: usize = 40;

/// Bytes of the header that are for authentication.
pub const AUTHENTICATION_LEN: usize = 1 + 8 + 16;

const _: () = assert!(MAGIC.len() + 1 + 4 + 6 + 1 + AUTHENTICATION_LEN == HEADER_LEN);

/// Set in the kinds that modules send, clear in those that hosts send.
pub(crate) const FROM_MODULE: u8 = 0x80;

/// A module's hardware address. All 0 means any module.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModuleId(pub [u8; 6]);

impl ModuleId {
    /// Whichever module receives it.
    pub const ANY: Self = Self([0; 6]);
}

impl core::fmt::Display for ModuleId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self([a, b, c, d, e, g]) = self;
        write!(f, "{a:02x}:{b:02x}:{c:02x}:{d:02x}:{e:02x}:{g:02x}")
    }
}

/// A module in one of its lives.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// Which module.
    pub module: ModuleId,
    /// Counts its starts, from 1; 0: any.
    pub boot: u32,
}

/// Everything before the message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Protocol version of the sender.
    pub version: u8,
    /// The module that sent it, or is to receive it.
    pub identity: Identity,
    /// Kind of the message.
    pub kind: u8,
    /// Number of the key it is authenticated with; 0: none.
    pub key: u8,
    /// Counts the datagrams authenticated with the key.
    pub counter: u64,
    /// Proves key, counter and content.
    pub tag: [u8; 16],
}

/// Why a datagram is dropped without an answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unreadable {
    /// It does not begin like one of ours.
    Foreign,
    /// Shorter than its fixed part.
    TooShort,
    /// Longer than [`DATAGRAM_MAX`].
    TooLong,
    /// A module's message came to a module, or a host's to a host.
    WrongDirection,
    /// The sender speaks this other version, and the message is not one of the frozen ones.
    Version(u8),
    /// A message of this unknown kind, from a newer peer.
    Kind(u8),
    /// The message ends too soon or holds a value that cannot be.
    Malformed,
}

impl core::fmt::Display for Unreadable {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Foreign => f.write_str("not a datagram of this protocol"),
            Self::TooShort => f.write_str("the datagram is too short"),
            Self::TooLong => f.write_str("the datagram is too long"),
            Self::WrongDirection => f.write_str("a message for the other side"),
            Self::Version(version) => write!(f, "the peer speaks version {version} of the protocol"),
            Self::Kind(kind) => write!(f, "unknown kind of message {kind:#04x}"),
            Self::Malformed => f.write_str("the message is malformed"),
        }
    }
}

impl core::error::Error for Unreadable {}

impl Unreadable {
    /// Where a module counts it.
    #[must_use]
    pub const fn counter(self) -> Counter {
        match self {
            Self::Foreign => Counter::DatagramsForeign,
            Self::TooShort => Counter::DatagramsTooShort,
            Self::TooLong => Counter::DatagramsTooLong,
            Self::WrongDirection => Counter::DatagramsWrongDirection,
            Self::Version(_) => Counter::RefusedVersion,
            Self::Kind(_) => Counter::RefusedUnsupported,
            Self::Malformed => Counter::RefusedMalformed,
        }
    }
}

impl From<Malformed> for Unreadable {
    fn from(_: Malformed) -> Self {
        Self::Malformed
    }
}

impl Header {
    /// The header of a message of this version, not authenticated.
    #[must_use]
    pub const fn new(identity: Identity, kind: u8) -> Self {
        Self { version: VERSION, identity, kind, key: 0, counter: 0, tag: [0; 16] }
    }

    /// Header and message of a datagram.
    ///
    /// # Errors
    /// [`Unreadable::Foreign`] before [`Unreadable::TooLong`] before [`Unreadable::TooShort`].
    pub fn open(datagram: &[u8]) -> Result<(Self, &[u8]), Unreadable> {
        let known = MAGIC.len().min(datagram.len());
        if datagram.get(..known) != MAGIC.get(..known) {
            return Err(Unreadable::Foreign);
        }
        if datagram.len() > DATAGRAM_MAX {
            return Err(Unreadable::TooLong);
        }
        let (&header, message) = datagram.split_first_chunk::<HEADER_LEN>().ok_or(Unreadable::TooShort)?;
        let [_, _, _, version, b0, b1, b2, b3, m0, m1, m2, m3, m4, m5, kind, key, rest @ ..] = header;
        let [c0, c1, c2, c3, c4, c5, c6, c7, tag @ ..] = rest;
        let identity = Identity {
            module: ModuleId([m0, m1, m2, m3, m4, m5]),
            boot: u32::from_le_bytes([b0, b1, b2, b3]),
        };
        let counter = u64::from_le_bytes([c0, c1, c2, c3, c4, c5, c6, c7]);
        Ok((Self { version, identity, kind, key, counter, tag }, message))
    }

    /// Writes the header to the start of `out`; returns where the message goes.
    pub(super) fn start<'a>(&self, out: &'a mut [u8]) -> Result<Writer<'a>, TooLong> {
        let (header, message) = out.split_first_chunk_mut::<HEADER_LEN>().ok_or(TooLong)?;
        *header = self.bytes();
        let room = message.len().min(DATAGRAM_MAX - HEADER_LEN);
        Ok(Writer::new(message.get_mut(..room).ok_or(TooLong)?))
    }

    /// The header as bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; HEADER_LEN] {
        let [g0, g1, g2] = MAGIC;
        let [b0, b1, b2, b3] = self.identity.boot.to_le_bytes();
        let ModuleId([m0, m1, m2, m3, m4, m5]) = self.identity.module;
        let front = [g0, g1, g2, self.version, b0, b1, b2, b3, m0, m1, m2, m3, m4, m5, self.kind, self.key];
        let mut bytes = [0; HEADER_LEN];
        let all = front.into_iter().chain(self.counter.to_le_bytes()).chain(self.tag);
        bytes.iter_mut().zip(all).for_each(|(slot, byte)| *slot = byte);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_reads_as_it_was_written() {
        let identity = Identity { module: ModuleId([1, 2, 3, 4, 5, 6]), boot: 0x0a0b_0c0d };
        let tag = core::array::from_fn(|i| i as u8 + 100);
        let header = Header { key: 7, counter: 0x1122_3344_5566_7788, tag, ..Header::new(identity, 0x90) };
        let mut datagram = std::vec::Vec::from(header.bytes());
        datagram.extend([9, 9]);
        assert_eq!(Header::open(&datagram), Ok((header, &[9, 9][..])));
        assert_eq!(datagram[..16], [0xE6, 0xB0, 0x97, 1, 0x0d, 0x0c, 0x0b, 0x0a, 1, 2, 3, 4, 5, 6, 0x90, 7]);
    }

    #[test]
    fn what_is_not_ours_is_told_from_what_is_cut_off() {
        let bytes = Header::new(Identity::default(), 0x90).bytes();
        for cut in 0..HEADER_LEN {
            assert_eq!(Header::open(&bytes[..cut]), Err(Unreadable::TooShort));
        }
        assert_eq!(Header::open(b"GET / HTTP/1.1"), Err(Unreadable::Foreign));
        assert_eq!(Header::open(&[0xE6, 0xB0]), Err(Unreadable::TooShort));
        let mut long = [0; DATAGRAM_MAX + 1];
        assert_eq!(Header::open(&long), Err(Unreadable::Foreign));
        long[..3].copy_from_slice(&MAGIC);
        assert_eq!(Header::open(&long), Err(Unreadable::TooLong));
        assert!(Header::open(&long[..DATAGRAM_MAX]).is_ok());
    }
}
