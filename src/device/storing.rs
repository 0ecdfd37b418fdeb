//! Storing settings and the background: what is to be stored, and what follows from it.
//!
//! ```text
//!   wish to store ─▶ begin: health says so ─▶ (the stream stops, flash is written) ─▶ end: settings count, hosts answered
//! ```

use super::answers::{Answer, RequestKey};
use super::settings::Settings;
use super::trial::Trial;
use super::{Change, Module, Pending};
use crate::background::Background;
use crate::link::Outbox;
use crate::scip::Text;
use crate::seal::Keyring;
use crate::wire::{EventKind, Refusal};

/// A background that could not be stored is tried again after so long, µs: worn flash is not worn further in every round.
const AGAIN_US: u64 = 3_600_000_000;

/// Whether each thing was stored, if it was wished for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Stored {
    /// The settings.
    pub settings: Option<bool>,
    /// The keys.
    pub keys: Option<bool>,
    /// The background.
    pub background: Option<bool>,
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// Reports that the stream is about to stop for storing.
    pub fn begin_storing(&mut self, now_us: u64, out: &mut impl Outbox) {
        self.storing = true;
        self.storing_since_us = now_us;
        self.publish_health(now_us, out);
    }

    /// Settings to be stored, and the trial of their addressing.
    #[must_use]
    pub fn settings_to_store(&self) -> Option<(&Settings, Option<Trial>)> {
        let own = Some(&self.settings).filter(|_| self.addressing_to_store);
        let asked = match &self.pending {
            Some(Pending { change: Change::Settings(settings), .. }) => Some(settings),
            Some(Pending { change: Change::Keys(_), .. }) | None => None,
        };
        let settings = asked.or(own)?;
        Some((settings, self.addressing.trial_of(settings.addressing)))
    }

    /// Keys to be stored.
    #[must_use]
    pub const fn keys_to_store(&self) -> Option<&Keyring> {
        match &self.pending {
            Some(Pending { change: Change::Keys(keyring), .. }) => Some(keyring),
            Some(Pending { change: Change::Settings(_), .. }) | None => None,
        }
    }

    /// The background to be stored, and the serial number of its sensor.
    #[must_use]
    pub fn background_to_store(&self) -> Option<(&Background<BEAMS>, Text<16>)> {
        let background = self.pipeline.background();
        (self.background_to_store && background.is_known()).then_some((background, *self.setup.serial()))
    }

    /// Wishes to store the background again, if it is time to.
    pub(super) fn store_again(&mut self, now_us: u64) {
        if self.store_again_us.is_some_and(|at_us| now_us >= at_us) {
            self.store_again_us = None;
            self.background_to_store = true;
        }
    }

    /// Storing is over. Settings and keys count from now on, and the host that asked for them is answered.
    pub fn end_storing(&mut self, stored: Stored, now_us: u64, out: &mut impl Outbox) {
        self.storing = false;
        self.background_to_store = false;
        self.addressing_to_store = false;
        // Scans begin again now, and renewals that came meanwhile are still to be read.
        self.observed.last_scan_us = self.observed.last_scan_us.map(|_| now_us);
        self.subscribers.extend(now_us.saturating_sub(self.storing_since_us));
        if let Some(is_stored) = stored.background {
            self.store_again_us = if is_stored { None } else { Some(now_us.saturating_add(AGAIN_US)) };
        }
        // A background that is still to be stored is a failure, whatever else was stored.
        self.store_failed = self.store_again_us.is_some();
        for stored in [stored.settings, stored.keys, stored.background].into_iter().flatten() {
            if !stored {
                self.store_failed();
            }
        }
        if let Some(Pending { change, key }) = self.pending.take() {
            let is_stored = match change {
                Change::Settings(_) => stored.settings == Some(true),
                Change::Keys(_) => stored.keys == Some(true),
            };
            let answer = if is_stored { Answer::Done } else { Answer::Refused(Refusal::NotStored) };
            if !is_stored {
                self.counters.count(Refusal::NotStored.counter());
            }
            self.answers.keep(key, answer);
            self.lanes.choose(*key.from.ip(), now_us, &mut self.counters, out);
            if let Some(message) = answer.message(key) {
                // Before other keys count: they may end the session that asked for them.
                self.send_answer(key, &message, out);
            }
            if is_stored {
                self.change(change, key, now_us);
            }
        }
        self.publish_health(now_us, out);
    }

    /// Uses what has been stored.
    fn change(&mut self, change: Change, key: RequestKey, now_us: u64) {
        match change {
            Change::Settings(settings) => {
                self.settings = settings;
                self.withdraw_raw();
                let max_mm = self.setup.geometry().map_or(u16::MAX, |geometry| geometry.range_max_mm());
                self.pipeline.set(self.settings.pipeline(self.setup.model(), max_mm));
                self.event(EventKind::SettingsChanged, key, now_us);
            }
            Change::Keys(keyring) => {
                self.guard.set_keyring(keyring);
                let guard = &self.guard;
                self.subscribers.keep_only(|at| guard.may_subscribe(at));
                self.event(EventKind::KeysSet, key, now_us);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::fixture::{Sent, about};
    use crate::device::starts::ShortStarts;
    use crate::device::trial::StoredAddressing;
    use crate::device::{Addressing, Wish};
    use crate::wire::Alarms;

    #[test]
    fn a_background_that_was_not_stored_is_an_alarm_until_it_is_and_is_tried_again_later() {
        let (mut module, mut out) = (Module::<1>::new(about()), Sent::default());
        let says = |module: &Module<1>| module.alarms(0).has(Alarms::STORE_FAILED);
        module.background_to_store = true;
        module.end_storing(Stored { background: Some(false), ..Stored::default() }, 1000, &mut out);
        assert!(says(&module) && module.wish().is_none(), "not at once again");
        module.end_storing(Stored { settings: Some(true), ..Stored::default() }, 2000, &mut out);
        assert!(says(&module), "settings are no background");
        module.poll(AGAIN_US + 999, &mut out);
        assert_eq!(module.wish(), None);
        module.poll(AGAIN_US + 1000, &mut out);
        assert_eq!(module.wish(), Some(Wish::Store));
        let stored = Stored { background: Some(true), ..Stored::default() };
        module.end_storing(stored, AGAIN_US + 2000, &mut out);
        assert!(!says(&module) && module.wish().is_none());
    }

    #[test]
    fn what_is_stored_in_a_start_over_dhcp_keeps_the_address_that_did_not_last() {
        let mut module = Module::<1>::new(about());
        let addressing = Addressing::from_text(b"10.0.0.7/24").unwrap();
        module.begin(1, Settings { addressing, ..Settings::new() });
        let short_starts = ShortStarts::new(3);
        module.begin_addressing(StoredAddressing { addressing, short_starts, ..StoredAddressing::default() });
        assert_eq!((module.addressing(), module.settings_to_store()), (Addressing::Dhcp, None));
        module.addressing_to_store = true;
        let (settings, trial) = module.settings_to_store().unwrap();
        assert_eq!((settings.addressing, trial), (addressing, None));
    }
}
