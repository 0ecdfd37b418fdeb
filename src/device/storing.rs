//! Storing settings and the background: what is to be stored, and what follows from it.
//!
//! ```text
//!   wish to store ─▶ begin: health says so ─▶ (the stream stops, flash is written) ─▶ end: settings count, hosts answered
//! ```

use super::answers::Answer;
use super::settings::Settings;
use super::trial::Trial;
use super::{Module, PendingSettings};
use crate::background::Background;
use crate::link::Outbox;
use crate::scip::Text;
use crate::wire::{EventKind, Refusal};

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
        let settings = self.pending_settings.as_ref().map(|pending| &pending.settings).or(own)?;
        Some((settings, self.addressing.trial_of(settings.addressing)))
    }

    /// The background to be stored, and the serial number of its sensor.
    #[must_use]
    pub fn background_to_store(&self) -> Option<(&Background<BEAMS>, Text<16>)> {
        let background = self.pipeline.background();
        (self.background_to_store && background.is_known()).then_some((background, *self.setup.serial()))
    }

    /// Storing is over; whether each of the two was stored, if it was wished for. Settings count from now
    /// on, and the host that asked for them is answered.
    pub fn end_storing(
        &mut self,
        settings_stored: Option<bool>,
        background_stored: Option<bool>,
        now_us: u64,
        out: &mut impl Outbox,
    ) {
        self.storing = false;
        self.background_to_store = false;
        self.addressing_to_store = false;
        // Scans begin again now, and renewals that came meanwhile are still to be read.
        self.observed.last_scan_us = self.observed.last_scan_us.map(|_| now_us);
        self.subscribers.extend(now_us.saturating_sub(self.storing_since_us));
        self.store_failed = false;
        for stored in [settings_stored, background_stored].into_iter().flatten() {
            if !stored {
                self.store_failed();
            }
        }
        if let Some(PendingSettings { settings, key }) = self.pending_settings.take() {
            let stored = settings_stored == Some(true);
            let answer = if stored { Answer::Done } else { Answer::Refused(Refusal::NotStored) };
            if stored {
                self.settings = settings;
                self.withdraw_raw();
                let max_mm = self.setup.geometry().map_or(u16::MAX, |geometry| geometry.range_max_mm());
                self.pipeline.set(self.settings.pipeline(self.setup.model(), max_mm));
                self.event(EventKind::SettingsChanged, key, now_us);
            } else {
                self.counters.count(Refusal::NotStored.counter());
            }
            self.answers.keep(key, answer);
            self.lanes.choose(*key.from.ip(), now_us, &mut self.counters, out);
            if let Some(message) = answer.message(key) {
                self.send_answer(key.from, &message, out);
            }
        }
        self.publish_health(now_us, out);
    }
}
