//! The keys of a site's devices, and the sealed ways to them.
//!
//! ```text
//!   site secret ─┬─ device A, generation 1 ─▶ read, raw, control
//!                └─ device B, generation 2 ─▶ read, raw, control        a device knows its own three, and no others
//! ```
//!
//! | file | what |
//! |---|---|
//! | `label` | the secret on a device's label |
//! | `links` | what is sent and what comes, sealed for devices with a key |

mod label;
mod links;

use std::collections::BTreeMap;

use kehai::seal::{Key, Role};
use kehai::wire::ModuleId;

pub use label::Label;
pub use links::{Arrived, Clear, Links, Standing};

/// Roles of the keys that a device is given.
const ROLES: [Role; 3] = [Role::Read, Role::Raw, Role::Control];

/// Most generations of keys that have ids of their own: after them the first ids come again.
const GENERATIONS: u8 = 84;

/// A device that has been given keys of the site.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Claimed {
    /// Its name when it was given them: no device without keys is taken for it.
    pub name: String,
    /// Which of its keys are in use: each rotation counts one on.
    pub generation: u8,
}

/// The site's secret, and the devices that have keys made of it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Keys {
    secret: Key,
    devices: BTreeMap<ModuleId, Claimed>,
}

impl Keys {
    /// A site with this secret, of no device yet.
    #[must_use]
    pub const fn new(secret: Key) -> Self {
        Self { secret, devices: BTreeMap::new() }
    }

    /// No keys: every device is spoken to in clear.
    #[must_use]
    pub const fn none() -> Self {
        Self::new(Key([0; 32]))
    }

    /// The secret all keys are made of.
    #[must_use]
    pub const fn secret(&self) -> Key {
        self.secret
    }

    /// A device has keys of the site from now on.
    pub fn insert(&mut self, device: ModuleId, claimed: Claimed) {
        self.devices.insert(device, claimed);
    }

    /// The devices that have keys.
    pub fn devices(&self) -> impl Iterator<Item = (ModuleId, &Claimed)> {
        self.devices.iter().map(|(device, claimed)| (*device, claimed))
    }

    /// A device, if it has keys.
    #[must_use]
    pub fn get(&self, device: ModuleId) -> Option<&Claimed> {
        self.devices.get(&device)
    }

    /// Whether no device has keys.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.devices.is_empty()
    }

    /// Whether a name is that of a device with keys.
    #[must_use]
    pub fn has_name(&self, name: &str) -> bool {
        self.devices.values().any(|claimed| claimed.name == name)
    }

    /// Id and key of a device for a role; none if it has no keys.
    #[must_use]
    pub fn key(&self, device: ModuleId, role: Role) -> Option<(u8, Key)> {
        let generation = self.get(device)?.generation;
        Some(self.key_of(device, role, generation))
    }

    /// The same for any device and generation, whether it has been given them or not.
    #[must_use]
    pub fn key_of(&self, device: ModuleId, role: Role, generation: u8) -> (u8, Key) {
        let id = (generation % GENERATIONS) * 3 + u8::from(role);
        (id, self.secret.of_device(device, role, generation))
    }

    /// What a device is to be given, as *set keys* carries it: all roles of each of these generations.
    #[must_use]
    pub fn records(&self, device: ModuleId, generations: &[u8]) -> Vec<u8> {
        let all = generations.iter().flat_map(|&generation| ROLES.map(|role| (role, generation)));
        all.flat_map(|(role, generation)| {
            let (id, Key(key)) = self.key_of(device, role, generation);
            [id, role.into()].into_iter().chain(key)
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::seal::Keyring;

    #[test]
    fn a_device_takes_what_it_is_given_also_two_generations_at_once() {
        let (keys, device) = (Keys::new(Key([1; 32])), ModuleId([2, 0, 0, 0, 0, 1]));
        for generation in [1, 83, 84, 254] {
            let keyring = Keyring::restored(Ok(&keys.records(device, &[generation, generation + 1])));
            assert!(!keyring.is_lost(), "{generation}");
            for of in [generation, generation + 1] {
                let (id, key) = keys.key_of(device, Role::Control, of);
                assert_eq!(keyring.get(id).map(|known| (known.role, known.key)), Some((Role::Control, key)));
            }
        }
    }

    #[test]
    fn devices_have_different_keys() {
        let keys = Keys::new(Key([1; 32]));
        let key = |last| keys.key_of(ModuleId([2, 0, 0, 0, 0, last]), Role::Read, 1).1;
        assert_ne!(key(1), key(2));
    }
}
