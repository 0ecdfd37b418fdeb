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
mod mode;
pub mod model;
mod port;
mod power;
mod request;
mod scip11;
mod stream;
mod texts;
mod transmitter;

use crate::source::RangeSource;
use clock::{Mirror, SensorClock};
pub use config::{Config, Counts, LinkState, ScanTruth, Start, StartError, State};
use faults::{Fault, Faults, TimedEvent};
use mode::Mode;
use model::{Family, Interface, Model, WhileBooting};
use port::Port;
use power::{DOWN_US, Power, Supply};
use request::RequestQueue;
use stream::Output;
pub use transmitter::Sent;

/// Time an answer takes in the time-sync state.
const TIME_SYNC_REPLY_US: u64 = 300;

/// SCIP 2.2 sensors answer on ticks of 1 ms.
const TICK_US: u64 = 1000;

/// An emulated sensor.
pub struct Urg {
    config: Config,
    source: Box<dyn RangeSource>,
    faults: Faults,
    now_us: u64,
    clock: SensorClock,
    mirror: Mirror,
    port: Port,
    requests: RequestQueue,
    supply: Supply,
    mode: Mode,
    output: Output,
    counts: Counts,
}

impl std::fmt::Debug for Urg {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Urg")
            .field("model", &self.config.model.name)
            .field("state", &self.state())
            .field("baud", &self.port.baud)
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
            port: Port::new(config.baud),
            requests: RequestQueue::default(),
            supply: Supply::ON,
            mode: Mode {
                scip11: config.start == Start::Scip11,
                time_sync: config.start == Start::TimeSync,
                ..Mode::default()
            },
            output: Output::default(),
            counts: Counts::default(),
            source,
            config,
        };
        match urg.config.start {
            Start::Streaming => urg.run_on(),
            Start::Booting => urg.boot(),
            Start::Abnormal => urg.break_down(),
            Start::Idle | Start::Scip11 | Start::TimeSync => {}
        }
        urg
    }

    /// Takes bytes from the host, correctly received at `now_us`.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.advance(now_us);
        if self.port.link != LinkState::Up || self.deaf() {
            return;
        }
        let due_us = self.answer_us(now_us);
        for &byte in bytes {
            self.counts.requests += u64::from(self.requests.push(byte, due_us));
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
        let sent = self.port.transmitter.sent_until(now_us);
        if self.port.link == LinkState::Up { sent } else { Vec::new() }
    }

    /// Whether the host has yet to read what it was sent. Meanwhile a sensor without a line speed (USB, Ethernet)
    /// drops its scans, each as a whole, and counts them ([`Counts::scans_dropped`]); answers are still sent.
    pub fn set_reader_behind(&mut self, behind: bool) {
        self.port.reader_behind = behind;
    }

    /// When something happens next, inside or on the line.
    #[must_use]
    pub fn next_due_us(&self) -> Option<u64> {
        self.next_chunk_us(1)
    }

    /// As [`next_due_us`](Self::next_due_us), for a reader that waits for `bytes` bytes or a pause.
    #[must_use]
    pub fn next_chunk_us(&self, bytes: usize) -> Option<u64> {
        self.next_event_us().into_iter().chain(self.port.transmitter.due_us(bytes)).min()
    }

    /// The client is gone. A sensor on Ethernet stops measuring; on other links it cannot know.
    pub fn client_left(&mut self, now_us: u64) {
        self.advance(now_us);
        self.requests.clear_line();
        if self.config.model.interface == Interface::Ethernet {
            self.requests.clear();
            self.stop_measuring();
            self.mode.time_sync = false;
            self.port.transmitter.clear(now_us);
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
        self.port.baud
    }

    /// Whether the speed of the line matters.
    #[must_use]
    pub fn paced(&self) -> bool {
        self.config.paced
    }

    /// Whether bytes pass between host and sensor.
    #[must_use]
    pub fn link(&self) -> LinkState {
        self.port.link
    }

    /// What the sensor is doing.
    #[must_use]
    pub fn state(&self) -> State {
        match self.supply.power {
            Power::Off => State::Off,
            Power::Booting { .. } => State::Booting,
            Power::On => self.mode.state(self.output.stream.is_some()),
        }
    }

    /// Whether the laser is on.
    #[must_use]
    pub fn laser(&self) -> bool {
        self.mode.laser
    }

    /// Whether `HS1` is in force.
    #[must_use]
    pub fn high_sensitivity(&self) -> bool {
        self.mode.high_sensitivity
    }

    /// Whether a measurement has asked for more scans than the source has.
    #[must_use]
    pub fn source_ended(&self) -> bool {
        self.output.source_ended
    }

    /// What has happened so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { faults: self.faults.done(), ..self.counts }
    }

    /// The scans sent, oldest first; the last [`Config::kept_scans`] of them.
    pub fn truth(&self) -> impl ExactSizeIterator<Item = ScanTruth> + '_ {
        self.output.truth.iter().copied()
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
        self.supply.reboot_at_us = Some(now_us + off_us);
    }

    /// Pulls the cable or puts it back: the sensor itself runs on.
    pub fn set_link(&mut self, now_us: u64, link: LinkState) {
        self.advance(now_us);
        self.change_link(link);
    }

    fn deaf(&self) -> bool {
        let booting = matches!(self.supply.power, Power::Booting { .. });
        let silent = self.config.model.while_booting == WhileBooting::Silent;
        self.mode.wedged || self.supply.power == Power::Off || (booting && silent)
    }

    fn situation(&self) -> texts::Situation {
        let level_percent = 100 - u32::from(self.mode.speed_level);
        texts::Situation {
            laser: self.mode.laser,
            measuring: self.output.stream.is_some(),
            booting: self.supply.power != Power::On,
            rpm: self.config.model.rpm() * level_percent / 100,
            speed_level: self.mode.speed_level,
            baud: self.port.baud,
            stamp_ms: self.clock.stamp_ms(self.now_us),
            faulty: self.mode.is_faulty(),
        }
    }

    /// When a request that is complete at `now_us` is answered.
    fn answer_us(&self, now_us: u64) -> u64 {
        let tick_us = (now_us / TICK_US + 1) * TICK_US;
        match self.config.model.family {
            Family::Ust => tick_us,
            _ if self.mode.time_sync => now_us + TIME_SYNC_REPLY_US,
            Family::Classic | Family::TopUrg => self.mirror.next_us(now_us),
        }
    }

    fn next_event_us(&self) -> Option<u64> {
        let boot_us = match self.supply.power {
            Power::Booting { until_us } => Some(until_us),
            Power::Off | Power::On => None,
        };
        let requests_us = self.requests.due_us().map(|due_us| self.faults.released_us(due_us));
        [
            self.faults.next_us(),
            self.supply.reboot_at_us,
            boot_us,
            self.port.next_baud.map(|(at_us, _)| at_us),
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
        } else if due(self.supply.reboot_at_us) {
            self.supply.reboot_at_us = None;
            if self.supply.power == Power::Off { self.boot() } else { self.restart() }
        } else if let Power::Booting { until_us } = self.supply.power
            && until_us <= self.now_us
        {
            self.supply.power = Power::On;
            self.stop_measuring();
            self.mirror = self.new_mirror();
        } else if let Some((at_us, baud)) = self.port.next_baud
            && at_us <= self.now_us
        {
            self.port.baud = baud;
            self.port.next_baud = None;
            self.requests.clear_line();
        } else if due(self.scan_due_us()) {
            self.finish_scan();
        } else {
            self.answer();
        }
    }

    /// Answers the requests that have come in.
    fn answer(&mut self) {
        let requests = self.requests.drain();
        let mut kinds: Vec<Vec<u8>> = Vec::new();
        for request in requests {
            if self.deaf() {
                break;
            }
            let (command, _) = request::split_string(&request);
            let kind = command.get(..2).unwrap_or(command).to_vec();
            // `RB` is meant to come twice.
            let repeated = kinds.contains(&kind) && kind != b"RB" && !self.mode.scip11;
            kinds.push(kind);
            self.execute(&request, repeated);
        }
    }

    /// Hands bytes to the transmitter.
    fn send(&mut self, bytes: Vec<u8>) {
        let baud = self.config.paced.then(|| self.port.sending_baud());
        let bytes = self.faults.damage_bytes(bytes);
        self.port.transmitter.enqueue(self.now_us, bytes, baud);
    }

    fn new_mirror(&self) -> Mirror {
        let percent = 100 - u32::from(self.mode.speed_level.min(10));
        let period_us = self.config.model.geometry.period_us * 100 / percent;
        Mirror::new(self.now_us, period_us, self.config.clock_fast_ppm)
    }

    fn change_link(&mut self, link: LinkState) {
        if self.port.link != LinkState::Up && link == LinkState::Up {
            // Bytes that left while the cable was out are lost.
            self.port.transmitter.sent_until(self.now_us);
        }
        self.port.link = link;
        self.requests.clear_line();
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
        self.supply.switch_off();
        self.port.transmitter.clear(self.now_us);
        self.requests.clear();
        self.requests.clear_line();
        self.stop_measuring();
        self.port.next_baud = None;
        let silent = self.config.model.interface == Interface::Rs232 && self.config.paced;
        self.port.link = if silent { LinkState::Silent } else { LinkState::Closed };
    }

    /// Goes down after `RB`; it comes back by itself.
    fn restart(&mut self) {
        self.power_off();
        self.supply.reboot_at_us = Some(self.now_us + DOWN_US);
    }

    fn boot(&mut self) {
        let model = &self.config.model;
        self.supply.power = Power::Booting { until_us: self.now_us + self.config.boot_us };
        self.port.link = LinkState::Up;
        self.mode = Mode { scip11: model.powers_up_in_scip11, ..Mode::default() };
        self.port.baud = model.power_up_baud;
        self.clock.reset(self.now_us);
        self.output.frozen = None;
    }
}

#[cfg(test)]
mod tests;
