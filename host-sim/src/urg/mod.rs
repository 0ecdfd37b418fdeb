//! The emulated URG: bytes and the time in, bytes and their times out. It reads no clock and does no I/O.
//!
//! ```text
//!            receive                        take_output
//! host ──▶ lines ─▶ requests ─▶ execute ─▶ replies ─▶ faults ─▶ wire ──▶ host
//!                   (rhythm)        │                  ▲
//!                                stream ─▶ scans ──────┘
//!                                   ▲
//!                      source · mirror · sensor clock
//! ```
//!
//! Requests are answered on the model's own rhythm, scans leave when their revolution is complete, and
//! bytes leave at the speed of the line. A line too slow for every scan loses whole scans.

mod clock;
mod commands;
mod config;
pub mod encode;
mod fault_kinds;
pub mod faults;
mod measurement;
pub mod model;
mod request;
mod scip11;
mod stream;
mod texts;
mod wire;

use std::collections::VecDeque;

use crate::source::RangeSource;
use clock::{Mirror, SensorClock};
pub use config::{Config, Counts, LinkState, ScanTruth, Start, State};
use faults::{Fault, Faults, TimedEvent};
use model::{Family, Interface, Model};
use request::Lines;
use stream::Stream;
pub use wire::Sent;
use wire::Wire;

/// Time between the second `RB` and the link going down.
const REBOOT_US: u64 = 1_000_000;

/// Time the link is down in a reboot.
const DOWN_US: u64 = 300_000;

/// Time an answer takes in the time-sync state.
const TIME_SYNC_REPLY_US: u64 = 300;

/// SCIP 2.2 sensors answer on ticks of 1 ms.
const TICK_US: u64 = 1000;

/// Requests kept until they are answered; more are lost.
const MAX_REQUESTS: usize = 32;

/// Scans whose true times are kept.
const MAX_TRUTH: usize = 65_536;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Power {
    Off,
    Booting { until_us: u64 },
    On,
}

/// An emulated sensor.
pub struct Urg {
    config: Config,
    source: Box<dyn RangeSource>,
    faults: Faults,
    now_us: u64,
    clock: SensorClock,
    mirror: Mirror,
    wire: Wire,
    lines: Lines,
    requests: VecDeque<Vec<u8>>,
    requests_due_us: u64,
    power: Power,
    link: LinkState,
    scip11: bool,
    laser: bool,
    time_sync: bool,
    asleep: bool,
    abnormal: bool,
    wedged: bool,
    baud: u32,
    next_baud: Option<(u64, u32)>,
    speed_level: u8,
    high_sensitivity: bool,
    drill: Option<u8>,
    stream: Option<Stream>,
    catching_up: bool,
    scan_end_us: u64,
    source_ended: bool,
    frozen: Option<(u32, Vec<u32>)>,
    reboot_asked_us: Option<u64>,
    reboot_at_us: Option<u64>,
    counts: Counts,
    truth: VecDeque<ScanTruth>,
}

impl std::fmt::Debug for Urg {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Urg")
            .field("model", &self.config.model.name)
            .field("state", &self.state())
            .field("baud", &self.baud)
            .field("counts", &self.counts)
            .finish_non_exhaustive()
    }
}

impl Urg {
    /// A sensor that is found at `now_us` in the state the configuration says. The geometry of `PP` is the source's.
    #[must_use]
    pub fn new(config: Config, source: Box<dyn RangeSource>, now_us: u64) -> Self {
        let config = Config { model: config.model.with_geometry(source.geometry()), ..config };
        let mut urg = Self {
            faults: Faults::new(&config.faults, config.seed, now_us),
            now_us,
            clock: SensorClock::new(now_us, config.clock_start_ms, config.clock_fast_ppm),
            mirror: Mirror::new(now_us, config.model.geometry.period_us, config.clock_fast_ppm),
            wire: Wire::default(),
            lines: Lines::default(),
            requests: VecDeque::new(),
            requests_due_us: 0,
            power: Power::On,
            link: LinkState::Up,
            scip11: config.start == Start::Scip11,
            laser: false,
            time_sync: config.start == Start::TimeSync,
            asleep: false,
            abnormal: config.start == Start::Abnormal,
            wedged: false,
            baud: config.baud,
            next_baud: None,
            speed_level: 0,
            high_sensitivity: false,
            drill: None,
            stream: None,
            catching_up: false,
            scan_end_us: 0,
            source_ended: false,
            frozen: None,
            reboot_asked_us: None,
            reboot_at_us: None,
            counts: Counts::default(),
            truth: VecDeque::new(),
            source,
            config,
        };
        match urg.config.start {
            Start::Streaming => urg.run_on(),
            Start::Booting => urg.boot(),
            _ => {}
        }
        urg
    }

    /// Takes bytes from the host, correctly received at `now_us`.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        if self.link != LinkState::Up || self.deaf() {
            return;
        }
        for &byte in bytes {
            let Some(line) = self.lines.push(byte) else { continue };
            self.counts.requests += 1;
            if self.requests.len() >= MAX_REQUESTS {
                continue;
            }
            if self.requests.is_empty() {
                self.requests_due_us = self.answer_us(now_us);
            }
            self.requests.push_back(line);
        }
    }

    /// Lets everything happen that is due up to `now_us`.
    pub fn advance(&mut self, now_us: u64) {
        while let Some(at_us) = self.next_event_us() {
            if at_us > now_us {
                break;
            }
            self.now_us = self.now_us.max(at_us);
            self.step();
        }
        self.now_us = self.now_us.max(now_us);
    }

    /// Takes the bytes that have left the sensor at `now_us`, in order.
    pub fn take_output(&mut self, now_us: u64) -> Vec<Sent> {
        self.advance(now_us);
        let sent = self.wire.take(now_us);
        if self.link == LinkState::Up { sent } else { Vec::new() }
    }

    /// When something happens next, inside or on the line.
    #[must_use]
    pub fn next_due_us(&self) -> Option<u64> {
        self.next_chunk_us(1)
    }

    /// As [`next_due_us`](Self::next_due_us), for a reader that waits for `bytes` bytes or a pause.
    #[must_use]
    pub fn next_chunk_us(&self, bytes: usize) -> Option<u64> {
        self.next_event_us().into_iter().chain(self.wire.due_us(bytes)).min()
    }

    /// The client is gone. A sensor on Ethernet stops measuring; on other links it cannot know.
    pub fn client_left(&mut self, now_us: u64) {
        self.advance(now_us);
        self.lines.clear();
        if self.config.model.interface == Interface::Ethernet {
            self.requests.clear();
            self.stop_measuring();
            self.time_sync = false;
            self.wire.clear(now_us);
        }
    }

    /// The model, with the geometry of its source.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.config.model
    }

    /// Bit rate at which the sensor listens now.
    #[must_use]
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// Whether the speed of the line matters.
    #[must_use]
    pub fn paced(&self) -> bool {
        self.config.paced
    }

    /// Whether bytes pass between host and sensor.
    #[must_use]
    pub fn link(&self) -> LinkState {
        self.link
    }

    /// What the sensor is doing.
    #[must_use]
    pub fn state(&self) -> State {
        match self.power {
            Power::Off => State::Off,
            Power::Booting { .. } => State::Booting,
            Power::On if self.wedged => State::Wedged,
            Power::On if self.abnormal => State::Abnormal,
            Power::On if self.scip11 => State::Scip11,
            Power::On if self.time_sync => State::TimeSync,
            Power::On if self.asleep => State::Asleep,
            Power::On if self.stream.is_some() => State::Streaming,
            Power::On => State::Idle,
        }
    }

    /// Whether the laser is on.
    #[must_use]
    pub fn laser(&self) -> bool {
        self.laser
    }

    /// Whether `HS1` is in force.
    #[must_use]
    pub fn high_sensitivity(&self) -> bool {
        self.high_sensitivity
    }

    /// Whether a measurement has asked for more scans than the source has.
    #[must_use]
    pub fn source_ended(&self) -> bool {
        self.source_ended
    }

    /// What has happened so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { faults: self.faults.done(), ..self.counts }
    }

    /// The scans sent, oldest first; the last 65 536 of them.
    pub fn truth(&self) -> impl ExactSizeIterator<Item = ScanTruth> + '_ {
        self.truth.iter().copied()
    }

    /// The sensor's own clock at a moment of the world.
    #[must_use]
    pub fn stamp_ms(&self, at_us: u64) -> u32 {
        self.clock.stamp_ms(at_us)
    }

    /// True time of one revolution in µs.
    #[must_use]
    pub fn period_us(&self) -> u32 {
        self.mirror.period_us()
    }

    /// From now on, these things go wrong, and no others; their times count from now.
    pub fn set_faults(&mut self, faults: &[Fault], now_us: u64) {
        self.advance(now_us);
        self.faults.replace(faults, now_us);
    }

    /// Cuts the power for `off_us`, now.
    pub fn power_cycle(&mut self, now_us: u64, off_us: u64) {
        self.advance(now_us);
        self.power_off();
        self.reboot_at_us = Some(now_us + off_us);
    }

    /// Pulls the cable or puts it back: the sensor itself runs on.
    pub fn set_link(&mut self, now_us: u64, link: LinkState) {
        self.advance(now_us);
        self.change_link(link);
    }

    fn deaf(&self) -> bool {
        let booting = matches!(self.power, Power::Booting { .. });
        self.wedged || self.power == Power::Off || (booting && self.config.model.family != Family::Ust)
    }

    fn situation(&self) -> texts::Situation {
        let level_percent = 100 - u32::from(self.speed_level);
        texts::Situation {
            laser: self.laser,
            measuring: self.stream.is_some(),
            booting: self.power != Power::On,
            rpm: self.config.model.rpm() * level_percent / 100,
            speed_level: self.speed_level,
            baud: self.baud,
            stamp_ms: self.clock.stamp_ms(self.now_us),
            faulty: self.abnormal || self.drill == Some(2),
        }
    }

    /// When a request that is complete at `now_us` is answered.
    fn answer_us(&self, now_us: u64) -> u64 {
        let tick_us = (now_us / TICK_US + 1) * TICK_US;
        match self.config.model.family {
            Family::Ust => tick_us,
            _ if self.time_sync => now_us + TIME_SYNC_REPLY_US,
            Family::Classic | Family::TopUrg => self.mirror.next_us(now_us),
        }
    }

    fn next_event_us(&self) -> Option<u64> {
        let boot_us = match self.power {
            Power::Booting { until_us } => Some(until_us),
            Power::Off | Power::On => None,
        };
        let requests_us = (!self.requests.is_empty()).then(|| self.faults.released_us(self.requests_due_us));
        [
            self.faults.next_us(),
            self.reboot_at_us,
            boot_us,
            self.next_baud.map(|(at_us, _)| at_us),
            self.scan_due_us(),
            requests_us,
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Does the first thing that is due. The order decides between things due at the same time: a scan
    /// that is complete goes out before the answer to a request.
    fn step(&mut self) {
        let due = |at_us: Option<u64>| at_us.is_some_and(|at_us| at_us <= self.now_us);
        if due(self.faults.next_us()) {
            self.timed_fault();
        } else if due(self.reboot_at_us) {
            self.reboot_at_us = None;
            if self.power == Power::Off { self.boot() } else { self.restart() }
        } else if let Power::Booting { until_us } = self.power
            && until_us <= self.now_us
        {
            self.power = Power::On;
            self.mirror = self.new_mirror();
        } else if let Some((at_us, baud)) = self.next_baud
            && at_us <= self.now_us
        {
            self.baud = baud;
            self.next_baud = None;
            self.lines.clear();
        } else if due(self.scan_due_us()) {
            self.finish_scan();
        } else {
            self.answer();
        }
    }

    /// Answers the requests that have come in.
    fn answer(&mut self) {
        let requests = std::mem::take(&mut self.requests);
        let mut kinds: Vec<Vec<u8>> = Vec::new();
        for request in requests {
            if self.deaf() {
                break;
            }
            let (command, _) = request::split_string(&request);
            let kind = command.get(..2).unwrap_or(command).to_vec();
            // `RB` is meant to come twice.
            let repeated = kinds.contains(&kind) && kind != b"RB" && !self.scip11;
            kinds.push(kind);
            self.execute(&request, repeated);
        }
    }

    /// Hands bytes to the transmitter.
    fn send(&mut self, bytes: Vec<u8>) {
        let baud = self.config.paced.then(|| self.next_baud.map_or(self.baud, |(_, baud)| baud));
        let bytes = self.faults.damage_bytes(bytes);
        self.wire.enqueue(self.now_us, bytes, baud);
    }

    fn new_mirror(&self) -> Mirror {
        let percent = 100 - u32::from(self.speed_level.min(10));
        let period_us = self.config.model.geometry.period_us * 100 / percent;
        Mirror::new(self.now_us, period_us, self.config.clock_fast_ppm)
    }

    fn change_link(&mut self, link: LinkState) {
        if self.link != LinkState::Up && link == LinkState::Up {
            // What left while nobody was connected is gone.
            self.wire.take(self.now_us);
        }
        self.link = link;
        self.lines.clear();
    }

    fn timed_fault(&mut self) {
        match self.faults.timed_event(self.now_us) {
            TimedEvent::None => {}
            TimedEvent::Abnormal => self.break_down(),
            TimedEvent::PowerOff => self.power_off(),
            TimedEvent::PowerOn => self.boot(),
            TimedEvent::Link(link) => self.change_link(link),
        }
    }

    fn power_off(&mut self) {
        self.power = Power::Off;
        self.wire.clear(self.now_us);
        self.requests.clear();
        self.lines.clear();
        self.stop_measuring();
        self.next_baud = None;
        self.reboot_at_us = None;
        self.reboot_asked_us = None;
        let silent = self.config.model.interface == Interface::Rs232 && self.config.paced;
        self.link = if silent { LinkState::Silent } else { LinkState::Closed };
    }

    /// Goes down after `RB`; it comes back by itself.
    fn restart(&mut self) {
        self.power_off();
        self.reboot_at_us = Some(self.now_us + DOWN_US);
    }

    fn boot(&mut self) {
        let model = &self.config.model;
        self.power = Power::Booting { until_us: self.now_us + self.config.boot_us };
        self.link = LinkState::Up;
        self.scip11 = model.powers_up_in_scip11;
        self.baud = model.power_up_baud;
        self.clock.reset(self.now_us);
        self.laser = false;
        self.time_sync = false;
        self.asleep = false;
        self.abnormal = false;
        self.wedged = false;
        self.speed_level = 0;
        self.high_sensitivity = false;
        self.drill = None;
        self.frozen = None;
    }
}

#[cfg(test)]
mod tests;
