//! The two messages that open a session, in clear and authenticated.
//!
//! ```text
//!   0b open     key: id of a role key │ counter 0 │ tag by the key of this open
//!                0 request id u32 │ 4 cookie 8 u8 │ 12 host nonce 16 u8                     68 bytes
//!   87 opened   key: the session │ counter 0 │ tag by the session's outward key
//!                0 request id u32 │ 4 session u8  │ 5 device nonce 16 u8                    61 bytes
//! ```
//!
//! All of it is associated data: the tag covers the header before it and the message. *Opened* is shorter than *open*, and
//! needs a cookie: no host is sent more than it sent.

use super::derive::{SessionKeys, open_key};
use super::{Key, NONCE_BYTES, Nonce, datagram};
use crate::wire::{Cookie, HEADER_LEN, Header, Identity};

/// Kind of *open*.
pub const OPEN: u8 = 0x0b;
/// Kind of the answer with a cookie, which comes before.
pub const COOKIE: u8 = 0x81;
/// Kind of *opened*.
pub const OPENED: u8 = 0x87;

/// Bytes of *open*.
pub const OPEN_LEN: usize = HEADER_LEN + 4 + 8 + NONCE_BYTES;
/// Bytes of *opened*.
pub const OPENED_LEN: usize = HEADER_LEN + 4 + 1 + NONCE_BYTES;

const _: () = assert!(OPENED_LEN < OPEN_LEN && OPEN_LEN <= HEADER_LEN + datagram::SIGNED_MAX);

/// A host wants a session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Open {
    /// Which key it has.
    pub key_id: u8,
    /// Chosen by the host; comes back.
    pub request_id: u32,
    /// Its cookie.
    pub cookie: Cookie,
    /// Its part of the session.
    pub host: Nonce,
}

/// A session is open.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Opened {
    /// The request this answers.
    pub request_id: u32,
    /// Its number, from 1.
    pub session: u8,
    /// The device's part of it.
    pub device: Nonce,
}

impl Open {
    /// The datagram to device `to`.
    #[must_use]
    pub fn bytes(&self, to: Identity, role_key: Key) -> [u8; OPEN_LEN] {
        let message = self.request_id.to_le_bytes().into_iter().chain(self.cookie.0).chain(self.host.0);
        let mut bytes = written(Header::new(to, OPEN), message);
        datagram::sign(&mut bytes, &open_key(role_key, to.module, self.host), self.key_id, 0);
        bytes
    }

    /// Reads a datagram of this kind, without looking at its tag.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; OPEN_LEN] = bytes.try_into().ok()?;
        let (header, message) = Header::open(bytes).ok()?;
        let (&request_id, rest) = message.split_first_chunk::<4>()?;
        let (&cookie, rest) = rest.split_first_chunk::<8>()?;
        let host = Nonce(rest.try_into().ok()?);
        let request_id = u32::from_le_bytes(request_id);
        let is_open = header.kind == OPEN && header.key != 0 && header.counter == 0;
        is_open.then_some(Self { key_id: header.key, request_id, cookie: Cookie(cookie), host })
    }

    /// Whether it was made by a holder of `role_key`, for this device.
    #[must_use]
    pub fn is_genuine(&self, bytes: &[u8], own: Identity, role_key: Key) -> bool {
        datagram::is_signed(bytes, &open_key(role_key, own.module, self.host), 0)
    }
}

impl Opened {
    /// The datagram of device `from`.
    #[must_use]
    pub(super) fn bytes(&self, from: Identity, keys: &SessionKeys) -> [u8; OPENED_LEN] {
        let message = self.request_id.to_le_bytes().into_iter().chain([self.session]).chain(self.device.0);
        let mut bytes = written(Header::new(from, OPENED), message);
        datagram::sign(&mut bytes, &keys.outward, self.session, 0);
        bytes
    }

    /// Reads a datagram of this kind: header and message, without looking at its tag.
    pub(super) fn read(bytes: &[u8]) -> Option<(Header, Self)> {
        let bytes: &[u8; OPENED_LEN] = bytes.try_into().ok()?;
        let (header, message) = Header::open(bytes).ok()?;
        let (&request_id, rest) = message.split_first_chunk::<4>()?;
        let (&session, rest) = rest.split_first()?;
        let device = Nonce(rest.try_into().ok()?);
        let request_id = u32::from_le_bytes(request_id);
        let is_opened = header.kind == OPENED && header.key == session && session != 0 && header.counter == 0;
        is_opened.then_some((header, Self { request_id, session, device }))
    }
}

fn written<const LEN: usize>(header: Header, message: impl Iterator<Item = u8>) -> [u8; LEN] {
    let mut bytes = [0; LEN];
    bytes.iter_mut().zip(header.bytes().into_iter().chain(message)).for_each(|(slot, byte)| *slot = byte);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::ModuleId;

    #[test]
    fn what_was_changed_anywhere_is_not_genuine() {
        let own = Identity { module: ModuleId([2, 0, 0, 0, 0, 1]), boot: 7 };
        let open = Open { key_id: 3, request_id: 9, cookie: Cookie([4; 8]), host: Nonce([5; 16]) };
        let bytes = open.bytes(own, Key([6; 32]));
        assert_eq!(Open::read(&bytes), Some(open));
        assert!(open.is_genuine(&bytes, own, Key([6; 32])));
        assert!(!open.is_genuine(&bytes, own, Key([7; 32])));
        assert!(!open.is_genuine(&bytes, Identity { module: ModuleId([0; 6]), ..own }, Key([6; 32])));
        for bit in 0..OPEN_LEN * 8 {
            let mut forged = bytes;
            forged[bit / 8] ^= 1 << (bit % 8);
            let is_genuine =
                Open::read(&forged).is_some_and(|open| open.is_genuine(&forged, own, Key([6; 32])));
            assert!(!is_genuine, "bit {bit}");
        }
    }
}
