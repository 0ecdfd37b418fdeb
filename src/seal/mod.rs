//! Authenticated and encrypted datagrams: what is sealed has come from a holder of the key, once, and as it was sent.
//!
//! ```text
//!   host                                               device                       both then derive
//!    │ 01 subscribe, cookie 0 ───────────────────────▶   │
//!    │ ◀─────────────────────────────── 81 cookie        │                          in clear, nothing is kept
//!    │ 0b open: cookie, host nonce, tag ─────────────▶   │  key id in the header
//!    │ ◀──────────────── 87 opened: session, device nonce, tag                      inward, outward = KDF(role key,
//!    │ any request, sealed ──────────────────────────▶   │  the session is proven        identity, both nonces)
//!    │ ◀─────────────────────── any message, sealed      │
//!
//!   sealed datagram     0 ───────────── 24 ────── 40 ─────────────
//!                       │ header, in clear │ tag    │ message, encrypted
//!                         key: the session's number; counter: never twice under one key
//! ```
//!
//! Source: RFC 8439 (ChaCha20-Poly1305), RFC 7693 (BLAKE2s as a keyed hash), RFC 6479 (replay window). Neither end has to
//! remember a counter over a restart, as each session has a nonce of either end. There is no forward secrecy: a role
//! key that leaks opens recordings of what was sent under it.
//!
//! | file | what |
//! |---|---|
//! | `aead` | bytes sealed and opened |
//! | `derive` | the keys of a session |
//! | `window` | no counter is taken twice |
//! | `datagram` | a datagram sealed and opened in its place |
//! | `handshake` | the bytes of *open* and *opened* |
//! | `keyring` | the keys that a device knows, and what each allows |
//! | `sessions` | the device's end |
//! | `channel` | the host's end |

mod aead;
pub mod channel;
pub mod datagram;
mod derive;
pub mod handshake;
pub mod keyring;
pub mod sessions;
pub mod window;

pub use crate::wire::Role;
pub use channel::{Channel, Incoming};
pub use keyring::{Holder, KEYS, Keyring, LABEL_ID, RoleKey};
pub use sessions::{SESSIONS, Sessions};

#[cfg(test)]
mod tests;

/// A key of 256 bits.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key(pub [u8; 32]);

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(…)")
    }
}

impl Key {
    /// The role key of a device, made of the site's secret: an attacker who takes one device apart has the keys of that device only.
    #[must_use]
    pub fn of_device(self, device: crate::wire::ModuleId, role: Role, generation: u8) -> Self {
        derive::role_key(self, device, role, generation)
    }

    /// The key of a label's secret.
    #[must_use]
    pub fn of_label(label: &[u8; LABEL_BYTES]) -> Self {
        derive::label_key(label)
    }
}

/// Bytes of the secret on a device's label.
pub const LABEL_BYTES: usize = 16;

/// Bytes of each end's part of a session.
pub const NONCE_BYTES: usize = 16;

/// Each end's part of a session: never the same twice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Nonce(pub [u8; NONCE_BYTES]);

/// Nonces that none can tell in advance without the secret they are made from.
#[derive(Clone, Debug)]
pub struct Nonces {
    secret: [u8; NONCE_BYTES],
    made: u64,
}

impl Nonces {
    /// A row of them. The same secret makes the same row: it must be random at each start.
    #[must_use]
    pub const fn new(secret: [u8; NONCE_BYTES]) -> Self {
        Self { secret, made: 0 }
    }

    /// One more.
    #[must_use]
    pub fn fresh(&mut self) -> Nonce {
        self.made = self.made.wrapping_add(1);
        derive::nonce(self.secret, 0, self.made)
    }
}

/// Why a sealed datagram is dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unsealed {
    /// It names no session with its sender.
    Session,
    /// Its counter was taken before, or is too old to tell.
    Replayed,
    /// Its tag is not that of a holder of the key, or it was changed on the way.
    Forged,
}
