//! How a start begins: with its number, and with what was stored.
//!
//! ```text
//!   store ─▶ begin: number, settings ─▶ keys ─▶ addressing, and its trial ─▶ background, its sensor ─▶ network
//! ```

use super::Module;
use super::cookie::Cookies;
use super::settings::Settings;
use super::trial::{AddressingInUse, StoredAddressing, Trial};
use crate::background::Background;
use crate::scip::Text;
use crate::seal::Keyring;
use crate::wire::{Counter, EventKind};

impl<const BEAMS: usize> Module<BEAMS> {
    /// A number for a start that cannot be counted: most likely no start has had it.
    #[must_use]
    pub const fn unlikely_boot(&self) -> u32 {
        let [a, b, c, d, ..] = self.about.secret;
        u32::from_le_bytes([a, b, c, d]) | 1 << 31
    }

    /// Start number `boot` begins, with these settings.
    pub fn begin(&mut self, boot: u32, settings: Settings) {
        self.identity.boot = boot;
        self.cookies = Cookies::new(self.about.secret, boot);
        self.settings = settings;
        if self.about.watchdog_reset {
            self.counters.count(Counter::WatchdogResets);
        }
    }

    /// Chooses the addressing of this start from the settings it began with. Returns the trial that must be stored
    /// before anything is sent, if any.
    pub fn begin_addressing(&mut self, stored: StoredAddressing) -> Option<Trial> {
        let beginning = AddressingInUse::begin(stored);
        self.addressing = beginning.in_use;
        // Stored addressing that this start only leaves alone is tried again: settings still name it.
        if beginning.event != Some(EventKind::AddressDefault) {
            self.settings.addressing = beginning.in_use.addressing();
        }
        self.addressing_to_store = beginning.settings_to_store;
        if let Some(kind) = beginning.event {
            self.say(kind, 0);
        }
        beginning.trial_to_store
    }

    /// Uses these keys from now on.
    pub fn begin_keys(&mut self, keyring: Keyring) {
        self.guard.set_keyring(keyring);
    }

    /// A factory reset was carried out as this start began.
    pub fn was_reset(&mut self) {
        self.say(EventKind::FactoryReset, 0);
    }

    /// The background, to be restored from a store.
    pub fn background_mut(&mut self) -> &mut Background<BEAMS> {
        self.pipeline.background_mut()
    }

    /// The serial number of the sensor whose background was restored: sensors do not always report it.
    pub fn remember_serial(&mut self, serial: Text<16>) {
        self.setup.remember_serial(serial);
    }
}
