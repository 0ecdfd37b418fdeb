//! The module: everything it decides. Scans, datagrams and the time in; datagrams and wishes out.
//!
//! ```text
//!   scan ──────▶ ┌────────┐ ──▶ report, raw parts, a profile part    to the subscribers
//!   panels ────▶ │        │ ──▶ pressed
//!   sensor ────▶ │        │ ──▶ health                               each second, and at every change
//!   datagram ──▶ │ Module │ ──▶ answer, refusal                      to the host that asked
//!   time ──────▶ │        │ ──▶ wish: store this, start anew         for the tasks
//!                └────────┘
//! ```
//!
//! | file | what |
//! |---|---|
//! | `begin` | how a start begins: its number, and what was stored |
//! | `scans` | what is made of a scan |
//! | `requests` | which host may ask what, and what the module does |
//! | `guard` | which datagrams are listened to, and what leaves sealed |
//! | `subscribers`, `cookie`, `answers` | which hosts get the reports; whether a host's address is its own; what was answered |
//! | `lanes` | by which way answers leave |
//! | `panels` | a floor of panels in the place of a sensor |
//! | `tiles` | a SensFloor as such a floor: when it is read and asked |
//! | `parts` | profiles and raw scans |
//! | `health` | counters, events, alarms |
//! | `setup`, `settings` | the sensor and its settings, and the settings of an installer |
//! | `trial`, `starts`, `button` | the ways back from settings that do not work |
//! | `reception` | how many frames at once, and a network that is dead |
//! | `update` | which image is received, and whether the one that runs works |
//! | `status`, `led`, `discovery` | its status: on its LED, and for hosts that look for modules |
//!
//! It waits for nothing and sends without waiting: what an [`Outbox`] does not take at once is dropped and
//! counted. Nothing in here panics, whatever comes in.

mod answers;
mod begin;
pub mod button;
pub mod cookie;
pub mod discovery;
#[cfg(test)]
mod fixture;
mod guard;
mod health;
mod lanes;
pub mod led;
mod panels;
mod parts;
pub mod reception;
mod requests;
mod scans;
pub mod settings;
mod setup;
pub mod starts;
mod status;
mod storing;
pub mod subscribers;
mod text;
pub mod tiles;
pub mod trial;
mod update;

pub use settings::{Addressing, Settings};
pub use status::Status;
pub use storing::Stored;
pub use subscribers::{LEASE_US, PLACES};
pub use update::{ImageStep, ImageWork};

use answers::{Answers, RequestKey};
use cookie::Cookies;
use guard::Guard;
use health::{Events, HealthSchedule};
use lanes::AnswerLanes;
use parts::Parts;
use setup::Setup;
use subscribers::Subscribers;
use trial::AddressingInUse;
use update::Update;

use crate::background::Learning;
use crate::link::{NetworkLosses, Outbox};
use crate::pipeline::Pipeline;
use crate::seal::Keyring;
use crate::sensor::SensorState;
use crate::wire::{Counter, Counters, DATAGRAM_MAX, EventKind, Identity, ModuleId};

/// Identity of a module, and facts fixed when it is built and switched on.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Its hardware address.
    pub module: ModuleId,
    /// Keys the cookies: random if the board can, else any bytes that no host knows.
    pub secret: [u8; 16],
    /// Version of the firmware.
    pub firmware: &'static str,
    /// Sources it was built from.
    pub build: &'static str,
    /// The board it runs on.
    pub board: &'static str,
    /// Whether the watchdog caused this start.
    pub watchdog_reset: bool,
}

/// A task that the module has for its image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wish {
    /// Stop the stream and store settings or background; report this with [`Module::begin_storing`] and
    /// [`Module::end_storing`].
    Store,
    /// Confirm to the boot loader that the image that runs works; report this with [`Module::confirmed`].
    Confirm,
    /// Note that a host was told what has become of the image received last; report this with
    /// [`Module::told`].
    Told,
    /// Start anew.
    Restart,
}

/// What is being stored for a host, and the request to answer afterwards.
#[derive(Clone, Debug)]
struct Pending {
    change: Change,
    key: RequestKey,
}

/// What a host has asked to be stored.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "one at a time, in fixed memory")]
enum Change {
    Settings(Settings),
    Keys(Keyring),
}

/// Latest reports of the sensor and the pipeline.
#[derive(Clone, Copy, Debug)]
struct Observed {
    sensor: SensorState,
    learning: Learning,
    /// Or, with a floor, when that was read last.
    last_scan_us: Option<u64>,
    /// It has a floor instead of a sensor.
    has_floor: bool,
    /// How far the time of the last scan may be off.
    uncertainty_us: u32,
}

impl Observed {
    const NONE: Self = Self {
        sensor: SensorState::Searching,
        learning: Learning::Idle,
        last_scan_us: None,
        has_floor: false,
        uncertainty_us: 0,
    };
}

/// A module with a sensor of at most `BEAMS` beams.
#[derive(Debug)]
pub struct Module<const BEAMS: usize> {
    about: About,
    identity: Identity,
    cookies: Cookies,
    settings: Settings,
    addressing: AddressingInUse,
    /// Addressing or its trial have changed otherwise than by a host's request.
    addressing_to_store: bool,
    pipeline: Pipeline<BEAMS>,
    parts: Parts<BEAMS>,
    subscribers: Subscribers,
    answers: Answers,
    lanes: AnswerLanes,
    counters: Counters,
    events: Events,
    setup: Setup,
    observed: Observed,
    pending: Option<Pending>,
    guard: Guard,
    background_to_store: bool,
    /// When a background that could not be stored is tried again, µs.
    store_again_us: Option<u64>,
    storing: bool,
    storing_since_us: u64,
    /// It blinks until then, so that a person finds it.
    identify_until_us: u64,
    store_failed: bool,
    watchdog_reset: bool,
    restarting: bool,
    update: Update,
    health: HealthSchedule,
    datagram: [u8; DATAGRAM_MAX],
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// A module without sensor or background. Before anything else, [`begin`](Self::begin) must give it its start and
    /// its settings.
    #[must_use]
    pub fn new(about: About) -> Self {
        Self {
            about,
            identity: Identity { module: about.module, boot: 0 },
            cookies: Cookies::new(about.secret, 0),
            settings: Settings::new(),
            addressing: AddressingInUse::DEFAULT,
            addressing_to_store: false,
            pipeline: Pipeline::new(),
            parts: Parts::new(),
            subscribers: Subscribers::new(),
            answers: Answers::new(),
            lanes: AnswerLanes::new(),
            counters: Counters::new(),
            events: Events::new(),
            setup: Setup::new(),
            observed: Observed::NONE,
            pending: None,
            guard: Guard::new(about.secret),
            background_to_store: false,
            store_again_us: None,
            storing: false,
            storing_since_us: 0,
            identify_until_us: 0,
            store_failed: false,
            watchdog_reset: about.watchdog_reset,
            restarting: false,
            update: Update::NONE,
            health: HealthSchedule::default(),
            datagram: [0; DATAGRAM_MAX],
        }
    }

    /// Records an event that no host has requested.
    fn say(&mut self, kind: EventKind, at_us: u64) {
        self.events.add(at_us, kind, self.pipeline.background().version(), [0; 4]);
    }

    /// Sets another name until the next start; a name that is too long is ignored.
    pub fn rename(&mut self, name: &str) {
        if let Ok(name) = name.try_into() {
            self.settings.name = name;
        }
    }

    /// A record could not be read or written.
    pub fn store_failed(&mut self) {
        self.store_failed = true;
        self.counters.count(Counter::StoreFailures);
    }

    /// Sets the losses of the network since the start.
    pub fn network_lost(&mut self, losses: NetworkLosses) {
        self.counters.set(Counter::LinkLosses, losses.links);
        self.counters.set(Counter::DatagramsDropped, losses.datagrams);
    }

    /// Does what is due at `now_us`; returns the time of the next call, µs.
    pub fn poll(&mut self, now_us: u64, out: &mut impl Outbox) -> u64 {
        self.subscribers.expire(now_us, &mut self.counters);
        if now_us >= self.health.due_us && now_us >= self.no_scan_us() {
            // Without scans, profiles are sent all the same, more slowly.
            self.send_profile_part(now_us, out);
        }
        if self.addressing.poll(now_us) {
            self.settings.addressing = self.addressing.addressing();
            self.addressing_to_store = true;
            self.restarting = true;
            self.say(EventKind::AddressReturned, now_us);
        }
        self.poll_trial(now_us);
        self.store_again(now_us);
        self.publish_health(now_us, out);
        let alarm_us = Some(self.no_scan_us()).filter(|&at_us| at_us > now_us);
        let trials_us = [self.addressing.ends_us(), self.trial_ends_us().filter(|&at_us| at_us > now_us)];
        let [address_us, image_us] = trials_us;
        let due = [Some(self.health.due_us), alarm_us, self.subscribers.next_us(), address_us, image_us];
        due.into_iter().flatten().min().unwrap_or(self.health.due_us)
    }

    /// The tasks that are due now.
    #[must_use]
    pub const fn wish(&self) -> Option<Wish> {
        if self.storing {
            None
        } else if self.pending.is_some() || self.addressing_to_store || self.background_to_store {
            Some(Wish::Store)
        } else if self.wants_confirmation() {
            Some(Wish::Confirm)
        } else if self.update.is_told() {
            Some(Wish::Told)
        } else if self.restarting {
            Some(Wish::Restart)
        } else {
            None
        }
    }

    /// The settings in use.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The addressing in use: after starts that did not last, another than that of the settings.
    #[must_use]
    pub const fn addressing(&self) -> Addressing {
        self.addressing.addressing()
    }

    /// The identity of this module, in this start.
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
        self.observed.last_scan_us
    }
}
