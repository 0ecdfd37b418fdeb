//! Scans: what is judged of each, what is learned by it, and what is sent.
//!
//! ```text
//!   scan ─▶ another setup? ─▶ pipeline ─▶ learned, drifted? ─▶ report, a profile part, raw parts ─▶ subscribers
//! ```

use super::{Module, health};
use crate::background::Learning;
use crate::link::Outbox;
use crate::scan::Scan;
use crate::sensor::Session;
use crate::wire::{Counter, EventKind, Message, Report};

impl<const BEAMS: usize> Module<BEAMS> {
    /// A scan from the sensor of `session`: judges and reports it.
    pub fn scan(&mut self, session: &Session, scan: &Scan<'_>, now_us: u64, out: &mut impl Outbox) {
        self.subscribers.expire(now_us, &mut self.counters);
        health::count_sensor(&mut self.counters, session);
        if self.setup.changed(session, scan.geometry, self.settings.skip) {
            self.configure(scan, now_us);
        }
        self.observed.last_scan_us = Some(now_us);
        self.observed.uncertainty_us = scan.time.uncertainty_us;
        let version = self.pipeline.background().version();
        self.pipeline.process(scan);
        self.learned(version, now_us);
        let lost_scans = self.counters.get(Counter::LostScans);
        let report = Report::of(self.pipeline.judgement(), self.setup.number(), lost_scans);
        let encoded = Message::Report(report).encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        let dropped = (&mut self.counters, Counter::ReportsDropped);
        self.subscribers.send(datagram, |_| true, dropped, now_us, &mut self.guard.over(out));
        self.send_profile_part(now_us, out);
        self.send_raw(scan, now_us, out);
        self.sensor(session, now_us, out);
    }

    /// Configures the pipeline for another sensor, or for the same one with other settings.
    fn configure(&mut self, scan: &Scan<'_>, now_us: u64) {
        let known = self.pipeline.background().is_known();
        let settings = self.settings.pipeline(self.setup.model(), scan.geometry.range_max_mm());
        if self.setup.name_background(self.pipeline.background_mut()) {
            self.background_to_store = true;
        }
        // It refuses only more beams than it has room for: the driver delivers no scan of such a sensor.
        let _ = self.pipeline.configure(scan.geometry, settings, self.setup.fingerprint());
        let background = self.pipeline.background();
        if known && !background.is_known() {
            self.events.add(now_us, EventKind::BackgroundForgotten, background.version(), [0; 4]);
        }
    }

    /// Says what learning and drift have come to with the last scan.
    fn learned(&mut self, version_before: u16, now_us: u64) {
        let (before, now) = (self.observed.learning, self.pipeline.judgement().learning);
        let version = self.pipeline.background().version();
        let kind = match (before, now) {
            (Learning::Running { .. }, Learning::Idle) if version != version_before => {
                self.background_to_store = true;
                Some(EventKind::Learned)
            }
            (Learning::Idle, Learning::Running { .. }) => Some(EventKind::LearnStarted),
            (Learning::Running { restarts: before, .. }, Learning::Running { restarts: now, .. })
                if now > before =>
            {
                Some(EventKind::LearnRestarted)
            }
            _ if version != version_before => Some(EventKind::BackgroundDrifted),
            _ => None,
        };
        self.observed.learning = now;
        if let Some(kind) = kind {
            self.events.add(now_us, kind, version, [0; 4]);
        }
    }

    /// Looks at the sensor: at every change of its state, and now and then.
    pub fn sensor(&mut self, session: &Session, now_us: u64, out: &mut impl Outbox) {
        health::count_sensor(&mut self.counters, session);
        self.observed.sensor = session.state();
        self.poll(now_us, out);
    }
}
