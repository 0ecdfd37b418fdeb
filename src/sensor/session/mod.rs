//! The session with the sensor: bytes and the time in, what to do next out.
//!
//! ```text
//!              receive(bytes, now)                       poll(now)
//!   link ──▶ reader ──▶ events ──▶ ┌──────────────┐ ──▶ Action: SetBaud, Send, Wait, Pause
//!                                  │ step, asked  │
//!                scans ◀────────── │ or streaming │ ◀── deadline
//!                                  └──────────────┘
//!   search ─▶ QT ─▶ VV ─▶ PP ─▶ SS, PP ─▶ TM0 TM1… TM2 ─▶ MD ─▶ scans      (`startup`)
//!     ▲        └─ 1.1: SCIP2.0    └ faster line  └ clock        │
//!     └───────────────── full start ◀── QT MD ◀── silence ◀─────┘           (`streaming`)
//! ```
//!
//! It does no I/O and reads no clock. Whatever comes in or fails to come in, there is always
//! a next deadline, so nothing waits for ever: not for silence, not for a reply, not for the end of a stream.
//! Steps and their order: SCIP 2.0 (C-42-03320B) and what sensors in the field were seen to do.

mod setup;
mod startup;
mod streaming;

use self::setup::SetupProgress;
use self::streaming::Stream;
use super::action::{Action, Message, Received, ScanTaken};
use super::clock::SensorClock;
use super::cures::Cures;
use super::request::{Phase, RequestState, Step};
use super::serial_line::{LineRate, LinkFailures, Search};
use super::settings::{LineSettings, SensorSettings};
use super::state::{SensorCounters, SensorState, count};
use super::timeouts::REPLY_US;
use crate::scan::Geometry;
use crate::scip::{Command, Dropped, Event, Losses, Measurement, Parameters, Reader, Status, Version};
use crate::sensor_model::POWER_UP_BAUD;

/// Bytes of the longest reply but scans, with its request: `VV`, `PP`.
const LONGEST_REPLY_BYTES: u64 = 200;

/// What sensor and settings make of a measurement.
#[derive(Clone, Copy, Debug)]
pub(in crate::sensor) struct Plan {
    pub(in crate::sensor) measurement: Measurement,
    pub(in crate::sensor) geometry: Geometry,
    /// Time between scans.
    pub(in crate::sensor) interval_us: u64,
}

/// What came of `VV` at the present start.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(in crate::sensor) enum VersionReply {
    /// It was left out, refused, or is still to be answered.
    #[default]
    None,
    Read,
    /// It was not answered: it is left out at the next start.
    Missed,
}

/// What the sensor has said about itself, and what follows for the measurement.
#[derive(Clone, Debug)]
pub(in crate::sensor) struct SensorFacts {
    /// As it was read last: at the present start, or before by a sensor of the same model.
    pub(in crate::sensor) version: Option<Version>,
    pub(in crate::sensor) version_reply: VersionReply,
    pub(in crate::sensor) parameters: Option<Parameters>,
    pub(in crate::sensor) plan: Option<Plan>,
}

/// State and counters, as they are reported.
#[derive(Clone, Debug)]
pub(in crate::sensor) struct Health {
    state: SensorState,
    /// The state has changed since it was reported last.
    changed: bool,
    pub(in crate::sensor) counters: SensorCounters,
}

/// The session with one sensor. The search for a sensor begins with the first [`poll`](Self::poll).
#[derive(Clone, Debug)]
pub struct Session {
    pub(in crate::sensor) settings: SensorSettings,
    /// Beams there is memory for.
    pub(in crate::sensor) capacity: u16,
    pub(in crate::sensor) reader: Reader,
    pub(in crate::sensor) health: Health,
    pub(in crate::sensor) request: RequestState,
    pub(in crate::sensor) line: LineRate,
    pub(in crate::sensor) search: Search,
    pub(in crate::sensor) sensor: SensorFacts,
    pub(in crate::sensor) setup: SetupProgress,
    pub(in crate::sensor) cures: Cures,
    pub(in crate::sensor) stream: Stream,
    link: LinkFailures,
}

impl Session {
    /// A session that keeps to `settings` and has memory for `capacity` beams.
    #[must_use]
    pub fn new(settings: SensorSettings, capacity: u16) -> Self {
        Self {
            settings,
            capacity,
            reader: Reader::new(),
            health: Health {
                state: SensorState::Searching,
                changed: true,
                counters: SensorCounters::default(),
            },
            request: RequestState::new(),
            line: LineRate::new(),
            search: Search::new(),
            sensor: SensorFacts {
                version: None,
                version_reply: VersionReply::None,
                parameters: None,
                plan: None,
            },
            setup: SetupProgress::default(),
            cures: Cures::NONE,
            stream: Stream::new(),
            link: LinkFailures::NONE,
        }
    }

    /// What to do now. Between two calls at the same time at most a handful of actions pass before it is
    /// [`Action::Wait`] or [`Action::Pause`].
    pub fn poll(&mut self, now_us: u64) -> Action {
        if self.search.candidates.is_empty() && !self.setup.pausing {
            self.search(now_us);
        }
        if self.line.new_baud.is_none()
            && self.request.message.is_none()
            && now_us >= self.request.deadline_us
        {
            match self.request.phase {
                Phase::Due(step) => self.send(step, now_us),
                Phase::Asked(step) => {
                    count(&mut self.health.counters.timeouts, 1);
                    self.handle_timeout(step, now_us);
                }
                Phase::Streaming => self.handle_silence(now_us),
                Phase::Paused => self.request.deadline_us = u64::MAX,
            }
        }
        if let Some(rate_baud) = self.line.new_baud.take() {
            self.reader.restart();
            // Errors at a wrong rate say nothing of this one.
            self.link = LinkFailures::NONE;
            return Action::SetBaud(rate_baud);
        }
        if let Some(message) = self.request.message.take() {
            return Action::Send(message);
        }
        if self.link.pause_until_us > now_us {
            Action::Pause(self.link.pause_until_us.min(self.request.deadline_us))
        } else {
            Action::Wait(self.request.deadline_us)
        }
    }

    /// Takes bytes that came at `now_us`, up to the first scan; hand in the rest again until all are
    /// consumed. `ranges_mm` must be the same buffer every time, and be left alone in between.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64, ranges_mm: &mut [u16]) -> Received {
        self.link.clear();
        let mut rest = bytes;
        while !rest.is_empty() {
            let fed = self.reader.feed(rest, now_us, ranges_mm);
            let (taken, behind) = rest.split_at_checked(fed.consumed.max(1)).unwrap_or((rest, &[]));
            rest = behind;
            self.stream.arrival.push(taken.len(), now_us, self.line_baud());
            if self.request.phase != Phase::Streaming {
                self.request.count_bytes(taken, !self.setup.resuming, now_us);
            }
            let scan = fed.event.and_then(|event| self.handle_event(event, now_us));
            if scan.is_some() {
                return Received { consumed: bytes.len().saturating_sub(rest.len()), scan };
            }
        }
        Received { consumed: bytes.len(), scan: None }
    }

    /// A read or write failed, or the read found the end of file. The link is read again at once: after an overrun
    /// bytes wait, and bytes that come later are lost as long as these are not read. When the next read fails too,
    /// reading pauses for a moment, longer each time; everything else goes on by its deadlines.
    pub fn link_failed(&mut self, now_us: u64) {
        count(&mut self.health.counters.link_failures, 1);
        let stalls = self.link.push(now_us);
        if stalls && self.request.phase == Phase::Streaming {
            self.request.deadline_us = self.request.deadline_us.min(now_us);
        }
    }

    /// Stops the stream; whatever was going on ends. The state becomes [`SensorState::Paused`] when the sensor
    /// has answered, or did not in time.
    pub fn pause(&mut self, now_us: u64) {
        self.setup.pausing = true;
        self.setup.resuming = matches!(self.request.phase, Phase::Streaming) || self.setup.resuming;
        self.ask(Step::Quit, now_us);
    }

    /// Goes on after [`pause`](Self::pause), with these settings; the sensor is set up anew if they differ.
    pub fn resume_with(&mut self, settings: SensorSettings, now_us: u64) {
        let changed = settings != self.settings;
        self.settings = settings;
        self.setup.pausing = false;
        self.set_state(if self.sensor.plan.is_some() {
            SensorState::Starting
        } else {
            SensorState::Searching
        });
        if changed || !self.setup.resuming || self.sensor.plan.is_none() {
            self.search(now_us);
        } else {
            self.setup.detours = 0;
            self.ask(Step::Quit, now_us);
        }
    }

    /// The sensor is quiet, or silent.
    pub(in crate::sensor) fn enter_pause(&mut self) {
        self.request.phase = Phase::Paused;
        self.request.deadline_us = u64::MAX;
        self.set_state(SensorState::Paused);
    }

    /// How the sensor is.
    #[must_use]
    pub const fn state(&self) -> SensorState {
        self.health.state
    }

    /// The state, if it has changed since the last call.
    #[must_use]
    pub fn state_change(&mut self) -> Option<SensorState> {
        core::mem::take(&mut self.health.changed).then_some(self.health.state)
    }

    /// What happened so far.
    #[must_use]
    pub const fn counters(&self) -> &SensorCounters {
        &self.health.counters
    }

    /// What the reader dropped so far, by cause.
    #[must_use]
    pub const fn losses(&self) -> &Losses {
        self.reader.losses()
    }

    /// What the sensor answered to `VV`, once it has. A sensor that does not answer is taken for the one before if it is of
    /// the same model.
    #[must_use]
    pub const fn version(&self) -> Option<&Version> {
        self.sensor.version.as_ref()
    }

    /// What the sensor answered to `PP`: what it can measure.
    #[must_use]
    pub const fn parameters(&self) -> Option<&Parameters> {
        self.sensor.parameters.as_ref()
    }

    /// Where the beams of the scans point, once the sensor is known.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.sensor.plan.as_ref().map(|plan| &plan.geometry)
    }

    /// Time between two scans, µs, once the sensor is known: that of the turns left out, or longer on a line that is too
    /// slow for it.
    #[must_use]
    pub fn interval_us(&self) -> Option<u64> {
        self.sensor.plan.as_ref().map(|plan| plan.interval_us)
    }

    /// The mapping between the sensor's clock and the module's.
    #[must_use]
    pub const fn clock(&self) -> &SensorClock {
        &self.stream.clock
    }

    /// Speed at which the sensor answered last: worth remembering for the next start of the module.
    #[must_use]
    pub fn last_baud(&self) -> Option<u32> {
        self.line.last_baud.filter(|_| self.settings.has_speed())
    }

    pub(in crate::sensor) fn set_state(&mut self, state: SensorState) {
        self.health.changed |= self.health.state != state;
        self.health.state = state;
    }

    /// Asks `step` as soon as possible.
    pub(in crate::sensor) fn ask(&mut self, step: Step, now_us: u64) {
        self.ask_at(step, now_us);
    }

    /// Asks `step` at `at_us`.
    pub(in crate::sensor) fn ask_at(&mut self, step: Step, at_us: u64) {
        self.request.schedule(step, at_us);
    }

    /// Asks the present step once more if it was asked fewer than `limit` times.
    pub(in crate::sensor) fn repeat(&mut self, step: Step, at_us: u64, limit: u8) -> bool {
        self.request.repeat(step, at_us, limit)
    }

    pub(in crate::sensor) fn change_baud(&mut self, rate_baud: u32) {
        self.line.baud = rate_baud;
        if self.settings.has_speed() {
            self.line.new_baud = Some(rate_baud);
        }
    }

    /// The line is not at its speed yet: the next [`poll`](Self::poll) asks for that again, unless [it is set](Self::baud_is_set) before.
    pub(in crate::sensor) const fn repeat_baud(&mut self) {
        self.line.new_baud = Some(self.line.baud);
    }

    /// The line is at its speed.
    pub(in crate::sensor) const fn baud_is_set(&mut self) {
        self.line.new_baud = None;
    }

    /// The speed of the line, if it has one.
    pub(in crate::sensor) fn line_baud(&self) -> Option<u32> {
        self.settings.has_speed().then_some(self.line.baud)
    }

    /// The rate remembered from the module's settings, or the sensor's own.
    pub(in crate::sensor) fn first_baud(&self) -> u32 {
        match self.settings.line {
            LineSettings::Serial { last_baud: Some(rate_baud), .. } => rate_baud,
            _ => POWER_UP_BAUD,
        }
    }

    fn send(&mut self, step: Step, now_us: u64) {
        let command = match step {
            Step::Quit | Step::TimeQuit => Command::Quit,
            Step::Scip20 => Command::Scip20,
            Step::Version => Command::Version,
            Step::Parameters | Step::Verify => Command::Parameters,
            Step::BitRate(rate_baud) => Command::BitRate(rate_baud),
            Step::TimeEnter => Command::TimeEnter,
            Step::TimeRead => Command::TimeRead,
            Step::LeaveTimeSync | Step::TimeLeave => Command::TimeLeave,
            Step::LaserOn => Command::LaserOn,
            Step::Reset => Command::Reset,
            Step::Reboot | Step::RebootAgain => Command::Reboot,
            Step::Measure => match self.sensor.plan {
                Some(plan) => Command::Measure(plan.measurement),
                None => return self.search(now_us),
            },
        };
        let line_us =
            self.line_baud().map_or(0, |baud| LONGEST_REPLY_BYTES * 10_000_000 / u64::from(baud.max(1)));
        self.request.sent(step, now_us, REPLY_US + line_us);
        match command.encode() {
            Ok(request) => {
                self.reader.expect(&request);
                self.request.message = Some(Message::new(request, step == Step::Quit));
            }
            // Only a measurement of steps beyond 9999 cannot be said.
            Err(_) => self.reject_geometry(crate::scan::GeometryError::StepsPerTurn, now_us),
        }
    }

    fn handle_event(&mut self, event: Event, now_us: u64) -> Option<ScanTaken> {
        match (event, self.request.phase) {
            (Event::Scan(header), _) => return self.accept_scan(&header, now_us),
            (Event::Reply(reply), _) if matches!(reply.command, Command::Measure(_)) => {
                self.handle_measurement_status(reply.status.of_measurement(), reply.status, now_us);
            }
            (Event::Lost(loss), Phase::Streaming) if loss.dropped == Dropped::Scan => {
                self.count_damaged_scan();
                self.extend_wait_for_scan(now_us);
            }
            // The `00` that begins the stream counts as a scan there.
            (Event::Lost(loss), Phase::Asked(Step::Measure)) if loss.dropped == Dropped::Scan => {
                self.begin_stream(now_us);
            }
            (Event::Unexpected(Status::DATA), Phase::Streaming) => self.count_damaged_scan(),
            (Event::Reply(reply), Phase::Asked(step)) => {
                if !matches!(reply.status, Status::OK) {
                    count(&mut self.health.counters.refusals, 1);
                }
                self.handle_status(step, reply.status, now_us);
            }
            (Event::Scip11(reply), Phase::Asked(step)) => {
                self.handle_scip11_status(step, reply.status, now_us)
            }
            (Event::Version(version), Phase::Asked(Step::Version)) => self.apply_version(version, now_us),
            (Event::Parameters(parameters), Phase::Asked(step)) => {
                self.apply_parameters(step, parameters, now_us)
            }
            (Event::Time(time), Phase::Asked(Step::TimeRead)) => self.apply_time(&time, now_us),
            (Event::Lost(loss), Phase::Asked(step)) if matches!(loss.dropped, Dropped::Reply(_)) => {
                self.handle_damaged_reply(step, now_us);
            }
            // Late replies, replies to the requests of another client, and the rest of damaged replies.
            _ => {}
        }
        None
    }
}
