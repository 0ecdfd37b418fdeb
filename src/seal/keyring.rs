//! The keys that a device knows, and what each of them allows.
//!
//! ```text
//!   key │ id u8 │ role u8 │ 32 bytes │      up to eight; no id 0, none twice, at least one that controls
//!
//!   holder   none ─▶ address: as long as there is no key, any host may ask
//!            role ─▶ what the key of its session allows
//! ```

use heapless::Vec;

use super::{Key, LABEL_BYTES};
use crate::wire::Role;

/// Most keys of a device.
pub const KEYS: usize = 8;

/// Bytes of a key in a record and on the wire.
pub const KEY_BYTES: usize = 1 + 1 + 32;

/// Most bytes of the record of the keys.
pub const KEYS_BYTES: usize = KEYS * KEY_BYTES;

/// The id that opens a session with the label's secret.
pub const LABEL_ID: u8 = 255;

/// By which right a host asks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Holder {
    /// It asks in clear.
    Nothing,
    /// It asks in a session opened with a key of this role.
    Key(Role),
}

/// A key and what it allows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RoleKey {
    /// Names it in the header; 1 to 254.
    pub id: u8,
    /// What it allows.
    pub role: Role,
    /// The key.
    pub key: Key,
}

/// These are no keys of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BadKeys;

/// The keys of a device.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Keyring {
    keys: Vec<RoleKey, KEYS>,
    label: Option<Key>,
    /// What is stored cannot be read: no host is let in, with a key or in clear.
    is_lost: bool,
}

impl Keyring {
    /// A record that is none, for keys that were lost; as the secret of a label it is none, too.
    pub const UNREADABLE: [u8; 1] = [0];

    /// No key: every host may ask in clear.
    #[must_use]
    pub const fn new() -> Self {
        Self { keys: Vec::new(), label: None, is_lost: false }
    }

    /// The keys of a record; a record that cannot be read locks the device rather than opening it.
    #[must_use]
    pub fn restored(record: Result<&[u8], crate::link::StoreError>) -> Self {
        match record {
            Ok([]) => Self::new(),
            Ok(bytes) => Self::of_bytes(bytes).unwrap_or_else(|BadKeys| Self::lost()),
            Err(crate::link::StoreError) => Self::lost(),
        }
    }

    const fn lost() -> Self {
        Self { keys: Vec::new(), label: None, is_lost: true }
    }

    /// With the secret of its label.
    pub fn set_label(&mut self, label: &[u8; LABEL_BYTES]) {
        self.label = Some(Key::of_label(label));
    }

    /// The keys, and the label of `self`.
    ///
    /// # Errors
    /// [`BadKeys`]: cut off, too many, an id twice or one that is kept for the label, an unknown role, or none that
    /// controls.
    pub fn with(&self, bytes: &[u8]) -> Result<Self, BadKeys> {
        Ok(Self { label: self.label, ..Self::of_bytes(bytes)? })
    }

    fn of_bytes(bytes: &[u8]) -> Result<Self, BadKeys> {
        let (records, rest) = bytes.as_chunks::<KEY_BYTES>();
        let mut keys: Vec<RoleKey, KEYS> = Vec::new();
        for [id, role, key @ ..] in records {
            let role = Role::of(*role).ok_or(BadKeys)?;
            let is_taken = keys.iter().any(|other| other.id == *id);
            if matches!(*id, 0 | LABEL_ID) || is_taken {
                return Err(BadKeys);
            }
            keys.push(RoleKey { id: *id, role, key: Key(*key) }).map_err(|_| BadKeys)?;
        }
        let has_control = keys.iter().any(|key| key.role == Role::Control);
        if rest.is_empty() && has_control {
            Ok(Self { keys, label: None, is_lost: false })
        } else {
            Err(BadKeys)
        }
    }

    /// The keys as a record.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8, KEYS_BYTES> {
        let of_key = |key: &RoleKey| [key.id, key.role.into()].into_iter().chain(key.key.0);
        let mut bytes = Vec::new();
        // As many as fit: eight keys do.
        for byte in self.keys.iter().flat_map(of_key) {
            let _ = bytes.push(byte);
        }
        bytes
    }

    /// Whether only holders of a key are listened to.
    #[must_use]
    pub fn is_claimed(&self) -> bool {
        self.is_lost || !self.keys.is_empty()
    }

    /// Whether its keys cannot be read.
    #[must_use]
    pub const fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// The key of an id. The label's opens a device without keys only.
    #[must_use]
    pub fn get(&self, id: u8) -> Option<RoleKey> {
        if id == LABEL_ID {
            let label = self.label.filter(|_| !self.is_claimed());
            return label.map(|key| RoleKey { id, role: Role::Label, key });
        }
        self.keys.iter().find(|key| key.id == id).copied()
    }
}

impl Default for Keyring {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::StoreError;

    fn record(id: u8, role: u8) -> [u8; KEY_BYTES] {
        let mut record = [id; KEY_BYTES];
        record[1] = role;
        record
    }

    #[test]
    fn keys_read_as_they_were_written() {
        let bytes = [record(1, 3), record(2, 1)].concat();
        let keyring = Keyring::restored(Ok(&bytes));
        assert_eq!(keyring.bytes()[..], bytes[..]);
        assert!(keyring.is_claimed() && !keyring.is_lost());
        assert_eq!(keyring.get(2), Some(RoleKey { id: 2, role: Role::Read, key: Key([2; 32]) }));
        assert_eq!(keyring.get(3), None);
    }

    #[test]
    fn what_cannot_be_read_locks_the_device() {
        for bytes in [
            &[1, 3][..],
            &[record(1, 3), record(1, 1)].concat(),
            &[record(0, 3)].concat(),
            &[record(255, 3)].concat(),
            &[record(1, 1)].concat(),
            &[record(1, 3), record(2, 0)].concat(),
            &[record(1, 3), record(2, 9)].concat(),
            &(1..=9).map(|id| record(id, 3)).collect::<std::vec::Vec<_>>().concat(),
        ] {
            let keyring = Keyring::restored(Ok(bytes));
            assert!(keyring.is_lost() && keyring.is_claimed(), "{bytes:?}");
            assert_eq!(Keyring::new().with(bytes), Err(BadKeys));
        }
        assert!(Keyring::restored(Err(StoreError)).is_claimed());
        assert!(!Keyring::restored(Ok(&[])).is_claimed());
    }

    #[test]
    fn the_label_opens_a_device_without_keys_only() {
        let mut keyring = Keyring::new();
        assert_eq!(keyring.get(LABEL_ID), None);
        keyring.set_label(&[5; LABEL_BYTES]);
        assert_eq!(keyring.get(LABEL_ID).map(|key| key.role), Some(Role::Label));
        let claimed = keyring.with(&record(1, 3)).unwrap();
        assert_eq!(claimed.get(LABEL_ID), None);
        let mut lost = Keyring::restored(Err(StoreError));
        lost.set_label(&[5; LABEL_BYTES]);
        assert_eq!(lost.get(LABEL_ID), None, "a record that cannot be read is no way in");
    }
}
