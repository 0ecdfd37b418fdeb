//! The module: everything it decides. Scans, datagrams and the time in; datagrams and wishes out.
//!
//! ```text
//!   scan ──────▶ ┌────────┐ ──▶ report, raw parts, a profile part    to the subscribers
//!   sensor ────▶ │        │ ──▶ health                               each second, and at every change
//!   datagram ──▶ │ Module │ ──▶ answer, refusal                      to whoever asked
//!   time ──────▶ │        │ ──▶ wish: store this, start anew         for the tasks
//!                └────────┘
//! ```
//!
//! | file | what |
//! |---|---|
//! | `requests` | who may ask what, and what comes of it |
//! | `subscribers`, `cookie`, `answers` | who gets the reports; who is who; what was answered |
//! | `lanes` | by which way answers leave |
//! | `parts` | profiles and raw scans |
//! | `health` | counters, events, alarms |
//! | `setup`, `settings` | what is measured, and what an installer may change |
//! | `status`, `led`, `discovery` | what it shows: to its LED, and to hosts that look for modules |
//!
//! It waits for nothing and sends without waiting: what an [`Outbox`] does not take at once is dropped and
//! counted. Nothing in here panics, whatever comes in.

mod answers;
pub mod cookie;
pub mod discovery;
mod health;
mod lanes;
pub mod led;
mod parts;
mod requests;
pub mod settings;
mod setup;
mod status;
pub mod subscribers;
mod text;

pub use settings::{Addressing, Settings};
pub use status::Status;
pub use subscribers::{LEASE_US, PLACES};

use answers::{Answer, Answers, RequestKey};
use cookie::Cookies;
use health::{Events, Said};
use lanes::AnswerLanes;
use parts::RawScan;
use setup::Setup;
use subscribers::Subscribers;

use crate::background::{Background, Learning};
use crate::link::{NetworkLosses, Outbox};
use crate::pipeline::Pipeline;
use crate::scan::Scan;
use crate::scip::Text;
use crate::sensor::{SensorState, Session};
use crate::wire::{Counter, Counters, DATAGRAM_MAX, EventKind, Identity, Message, ModuleId, Refusal, Report};

/// What is known of a module when it is built and switched on.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Its hardware address.
    pub module: ModuleId,
    /// Keys the cookies: random if the board can, else whatever nobody else knows.
    pub secret: [u8; 16],
    /// Version of the firmware.
    pub firmware: &'static str,
    /// What it was built from.
    pub build: &'static str,
    /// The board it runs on.
    pub board: &'static str,
    /// Whether the watchdog caused this start.
    pub watchdog_reset: bool,
}

/// What the tasks are to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wish {
    /// Stop the stream and store settings or background; say so with [`Module::begin_storing`] and
    /// [`Module::end_storing`].
    Store,
    /// Start anew.
    Restart,
}

/// Settings that are being stored, and who wants to know.
#[derive(Clone, Debug)]
struct PendingSettings {
    settings: Settings,
    key: RequestKey,
}

/// A module with a sensor of at most `BEAMS` beams.
#[derive(Debug)]
pub struct Module<const BEAMS: usize> {
    about: About,
    identity: Identity,
    cookies: Cookies,
    settings: Settings,
    pipeline: Pipeline<BEAMS>,
    raw: RawScan<BEAMS>,
    subscribers: Subscribers,
    answers: Answers,
    lanes: AnswerLanes,
    counters: Counters,
    events: Events,
    setup: Setup,
    sensor_state: SensorState,
    learning: Learning,
    last_scan_us: Option<u64>,
    uncertainty_us: u32,
    profile_version: u16,
    profile_turn: u8,
    pending_settings: Option<PendingSettings>,
    background_to_store: bool,
    storing: bool,
    storing_since_us: u64,
    store_failed: bool,
    watchdog_reset: bool,
    restarting: bool,
    said: Said,
    health_due_us: u64,
    datagram: [u8; DATAGRAM_MAX],
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// A module that knows neither sensor nor background. It is to be told its start and its settings with
    /// [`begin`](Self::begin) before anything else.
    #[must_use]
    pub fn new(about: About) -> Self {
        Self {
            about,
            identity: Identity { module: about.module, boot: 0 },
            cookies: Cookies::new(about.secret, 0),
            settings: Settings::new(),
            pipeline: Pipeline::new(),
            raw: RawScan::new(),
            subscribers: Subscribers::new(),
            answers: Answers::new(),
            lanes: AnswerLanes::new(),
            counters: Counters::new(),
            events: Events::new(),
            setup: Setup::new(),
            sensor_state: SensorState::Searching,
            learning: Learning::Idle,
            last_scan_us: None,
            uncertainty_us: 0,
            profile_version: 0,
            profile_turn: 0,
            pending_settings: None,
            background_to_store: false,
            storing: false,
            storing_since_us: 0,
            store_failed: false,
            watchdog_reset: about.watchdog_reset,
            restarting: false,
            said: Said::default(),
            health_due_us: 0,
            datagram: [0; DATAGRAM_MAX],
        }
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

    /// Takes another name until the next start; one that is too long is left alone.
    pub fn rename(&mut self, name: &str) {
        if let Ok(name) = name.try_into() {
            self.settings.name = name;
        }
    }

    /// A number for a start that cannot be counted: most likely no start has had it.
    #[must_use]
    pub const fn unlikely_boot(&self) -> u32 {
        let [a, b, c, d, ..] = self.about.secret;
        u32::from_le_bytes([a, b, c, d]) | 1 << 31
    }

    /// A record could not be read or written.
    pub fn store_failed(&mut self) {
        self.store_failed = true;
        self.counters.count(Counter::StoreFailures);
    }

    /// The background, to be restored from a store.
    pub fn background_mut(&mut self) -> &mut Background<BEAMS> {
        self.pipeline.background_mut()
    }

    /// The serial number of the sensor whose background was restored: sensors do not always tell it.
    pub fn remember_serial(&mut self, serial: Text<16>) {
        self.setup.remember_serial(serial);
    }

    /// What the network has lost since the start.
    pub fn network_lost(&mut self, losses: NetworkLosses) {
        self.counters.set(Counter::LinkLosses, losses.links);
        self.counters.set(Counter::DatagramsDropped, losses.datagrams);
    }

    /// A scan from the sensor of `session`: judges and reports it.
    pub fn scan(&mut self, session: &Session, scan: &Scan<'_>, now_us: u64, out: &mut impl Outbox) {
        self.subscribers.expire(now_us, &mut self.counters);
        health::count_sensor(&mut self.counters, session);
        if self.setup.changed(session, scan.geometry, self.settings.skip) {
            self.configure(scan, now_us);
        }
        self.last_scan_us = Some(now_us);
        self.uncertainty_us = scan.time.uncertainty_us;
        let version = self.pipeline.background().version();
        self.pipeline.process(scan);
        self.learned(version, now_us);
        let lost_scans = self.counters.get(Counter::LostScans);
        let report = Report::of(self.pipeline.judgement(), self.setup.number(), lost_scans);
        let encoded = Message::Report(report).encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        let dropped = (&mut self.counters, Counter::ReportsDropped);
        self.subscribers.send(datagram, |_| true, dropped, now_us, out);
        self.send_profile_part(now_us, out);
        self.send_raw(scan, now_us, out);
        self.sensor(session, now_us, out);
    }

    /// Another sensor, or the same one asked for something else.
    fn configure(&mut self, scan: &Scan<'_>, now_us: u64) {
        let known = self.pipeline.background().is_known();
        let settings = self.settings.pipeline(self.setup.model(), scan.geometry.range_max_mm());
        // Refused for more beams than there is room for: the driver hands on no scan of such a sensor.
        let _ = self.pipeline.configure(scan.geometry, settings, self.setup.fingerprint());
        let background = self.pipeline.background();
        if known && !background.is_known() {
            self.events.add(now_us, EventKind::BackgroundForgotten, background.version(), [0; 4]);
        }
    }

    /// Says what learning and drift have come to with the last scan.
    fn learned(&mut self, version_before: u16, now_us: u64) {
        let (before, now) = (self.learning, self.pipeline.judgement().learning);
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
        self.learning = now;
        if let Some(kind) = kind {
            self.events.add(now_us, kind, version, [0; 4]);
        }
    }

    /// Looks at the sensor: at every change of its state, and now and then.
    pub fn sensor(&mut self, session: &Session, now_us: u64, out: &mut impl Outbox) {
        health::count_sensor(&mut self.counters, session);
        self.sensor_state = session.state();
        self.poll(now_us, out);
    }

    /// Lets time pass; returns when this is to be called next, µs.
    pub fn poll(&mut self, now_us: u64, out: &mut impl Outbox) -> u64 {
        self.subscribers.expire(now_us, &mut self.counters);
        if now_us >= self.health_due_us && now_us >= self.no_scan_us() {
            // Without scans, profiles are sent all the same, more slowly.
            self.send_profile_part(now_us, out);
        }
        self.tell_health(now_us, out);
        let alarm_us = Some(self.no_scan_us()).filter(|&at_us| at_us > now_us);
        let due = [Some(self.health_due_us), alarm_us, self.subscribers.next_us()];
        due.into_iter().flatten().min().unwrap_or(self.health_due_us)
    }

    /// What the tasks are to do now.
    #[must_use]
    pub const fn wish(&self) -> Option<Wish> {
        if self.storing {
            None
        } else if self.pending_settings.is_some() || self.background_to_store {
            Some(Wish::Store)
        } else if self.restarting {
            Some(Wish::Restart)
        } else {
            None
        }
    }

    /// The stream is about to be stopped for storing: says so.
    pub fn begin_storing(&mut self, now_us: u64, out: &mut impl Outbox) {
        self.storing = true;
        self.storing_since_us = now_us;
        self.tell_health(now_us, out);
    }

    /// Settings that are to be stored.
    #[must_use]
    pub fn settings_to_store(&self) -> Option<&Settings> {
        self.pending_settings.as_ref().map(|pending| &pending.settings)
    }

    /// The background that is to be stored, and the serial number of its sensor.
    #[must_use]
    pub fn background_to_store(&self) -> Option<(&Background<BEAMS>, Text<16>)> {
        let background = self.pipeline.background();
        (self.background_to_store && background.is_known()).then_some((background, *self.setup.serial()))
    }

    /// Storing is over; whether each of the two was stored, if it was wished for. Settings count from now
    /// on, and whoever asked for them is answered.
    pub fn end_storing(
        &mut self,
        settings_stored: Option<bool>,
        background_stored: Option<bool>,
        now_us: u64,
        out: &mut impl Outbox,
    ) {
        self.storing = false;
        self.background_to_store = false;
        // Scans begin again now, and renewals that came meanwhile are still to be read.
        self.last_scan_us = self.last_scan_us.map(|_| now_us);
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
        self.tell_health(now_us, out);
    }

    /// The settings in use.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Who this module is, in this start.
    #[must_use]
    pub const fn identity(&self) -> Identity {
        self.identity
    }

    /// Everything dropped, refused or done again.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Background and latest judgement.
    #[must_use]
    pub const fn pipeline(&self) -> &Pipeline<BEAMS> {
        &self.pipeline
    }

    /// When the last scan came, µs.
    #[must_use]
    pub const fn last_scan_us(&self) -> Option<u64> {
        self.last_scan_us
    }
}
