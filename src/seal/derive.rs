//! Keys made of keys: BLAKE2s keyed by the one, over what the other is for.
//!
//! ```text
//!   site secret ─┬─ "kehai role",    device, role, generation ─▶ role key of a device
//!   label ───────┴─ "kehai label" ─────────────────────────────▶ its key
//!   role key ────┬─ "kehai open",    device, host nonce ───────▶ key of one open
//!                └─ "kehai inward",  device, start, host nonce, device nonce ─▶ host to device
//!                   "kehai outward", the same ────────────────────────────────▶ device to host
//! ```
//!
//! The purpose is padded with zeros to 16 bytes and the whole text to 64, and what follows a purpose has one length only, so that
//! no two inputs can be read as each other. Source: RFC 7693.

use blake2::Blake2sMac256;
use blake2::digest::{FixedOutput, KeyInit, Update};

use super::{Key, LABEL_BYTES, Nonce, Role};
use crate::wire::{Identity, ModuleId};

/// What a derived key is for.
#[derive(Clone, Copy)]
enum Purpose {
    Role,
    Label,
    Open,
    Inward,
    Outward,
    Nonce,
}

/// Bytes of a text: a block of the hash, and more than the longest one, of a session's key, has.
const TEXT_BYTES: usize = 64;

const _: () = assert!(16 + 6 + 4 + 2 * super::NONCE_BYTES <= TEXT_BYTES);

impl Purpose {
    const fn text(self) -> &'static [u8; 16] {
        match self {
            Self::Role => b"kehai role\0\0\0\0\0\0",
            Self::Label => b"kehai label\0\0\0\0\0",
            Self::Open => b"kehai open\0\0\0\0\0\0",
            Self::Inward => b"kehai inward\0\0\0\0",
            Self::Outward => b"kehai outward\0\0\0",
            Self::Nonce => b"kehai nonce\0\0\0\0\0",
        }
    }
}

fn derive<const PARTS: usize>(key: Key, purpose: Purpose, parts: [&[u8]; PARTS]) -> Key {
    let mut text = [0; TEXT_BYTES];
    let all = parts.into_iter().flatten();
    text.iter_mut().zip(purpose.text().iter().chain(all)).for_each(|(slot, byte)| *slot = *byte);
    // Only longer keys are refused; the constructor that takes no slice links a panic all the same.
    let Ok(mut hash) = Blake2sMac256::new_from_slice(&key.0) else { return key };
    // At once: in pieces the buffer links a panic.
    hash.update(&text);
    Key(hash.finalize_fixed().into())
}

pub(super) fn role_key(secret: Key, device: ModuleId, role: Role, generation: u8) -> Key {
    derive(secret, Purpose::Role, [&device.0, &[role.into(), generation]])
}

pub(super) fn label_key(label: &[u8; LABEL_BYTES]) -> Key {
    let mut padded = Key([0; 32]);
    padded.0.iter_mut().zip(label).for_each(|(slot, byte)| *slot = *byte);
    derive(padded, Purpose::Label, [])
}

/// The key that *open* is authenticated with: used once, as the host's nonce is.
pub(super) fn open_key(role_key: Key, device: ModuleId, host: Nonce) -> Key {
    derive(role_key, Purpose::Open, [&device.0, &host.0])
}

/// The keys of a session.
#[derive(Clone, Copy, Debug)]
pub(super) struct SessionKeys {
    /// From the host to the device.
    pub inward: Key,
    /// From the device to the host.
    pub outward: Key,
}

impl SessionKeys {
    pub(super) fn of(role_key: Key, identity: Identity, host: Nonce, device: Nonce) -> Self {
        let Identity { module, boot } = identity;
        let boot = boot.to_le_bytes();
        let of = |purpose| derive(role_key, purpose, [&module.0, &boot, &host.0, &device.0]);
        Self { inward: of(Purpose::Inward), outward: of(Purpose::Outward) }
    }
}

/// A nonce that differs for each start and each number, and cannot be told in advance if the secret cannot.
pub(super) fn nonce(secret: [u8; 16], boot: u32, number: u64) -> Nonce {
    let mut padded = Key([0; 32]);
    padded.0.iter_mut().zip(secret).for_each(|(slot, byte)| *slot = byte);
    let Key(bytes) = derive(padded, Purpose::Nonce, [&boot.to_le_bytes(), &number.to_le_bytes()]);
    let mut nonce = Nonce([0; 16]);
    nonce.0.iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = byte);
    nonce
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_differ_by_everything_they_are_made_of() {
        let (host, device) = (Nonce([1; 16]), Nonce([2; 16]));
        let identity = Identity { module: ModuleId([1, 2, 3, 4, 5, 6]), boot: 7 };
        let keys = SessionKeys::of(Key([9; 32]), identity, host, device);
        let others = [
            SessionKeys::of(Key([8; 32]), identity, host, device),
            SessionKeys::of(Key([9; 32]), Identity { boot: 8, ..identity }, host, device),
            SessionKeys::of(Key([9; 32]), Identity { module: ModuleId([0; 6]), ..identity }, host, device),
            SessionKeys::of(Key([9; 32]), identity, device, device),
            SessionKeys::of(Key([9; 32]), identity, host, host),
        ];
        assert_ne!(keys.inward, keys.outward);
        assert!(others.iter().all(|other| other.inward != keys.inward && other.outward != keys.outward));
        assert_ne!(nonce([1; 16], 1, 1), nonce([1; 16], 1, 2));
        assert_ne!(nonce([1; 16], 1, 1), nonce([1; 16], 2, 1));
    }
}
