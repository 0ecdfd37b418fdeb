//! The conversation with the sensor: bytes and the time in, what to do next out.
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

use super::action::{Action, Message, Received, ScanTaken};
use super::arrival::Arrival;
use super::clock::SensorClock;
use super::settings::{Candidates, LineSettings, POWER_UP_BAUD, SensorSettings};
use super::state::{SensorCounters, SensorState, count};
use crate::scan::{Geometry, ScanTime};
use crate::scip::{Command, Dropped, Event, Losses, Measurement, Parameters, Reader, Status, Version};

/// Time to wait for a reply, beside that of its bytes on the line: sensors answer on the rhythm of
/// their mirror, 100 ms the slowest, and two of its turns may pass.
const REPLY_US: u64 = 250_000;

/// After a request, bytes may still come out of buffers that were filled at the speed before. They say nothing about
/// this one.
const STALE_US: u64 = 60_000;

/// Bytes of the longest reply but scans, with its request: `VV`, `PP`.
const LONGEST_REPLY_BYTES: u64 = 200;

/// Longest pause in reading after failures of the link.
const LINK_PAUSE_MAX_US: u64 = 500_000;

/// Failures of the link in a row after which a stream counts as stalled.
const LINK_FAILURES: u8 = 4;

/// What the sensor is asked, one thing at a time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Step {
    /// `QT`: is there a sensor at this rate? It also ends a stream that still runs.
    Quit,
    /// `SCIP2.0`, to a sensor that answered in SCIP 1.1.
    Scip20,
    /// `TM2`, to a sensor found in the time-synchronisation state.
    LeaveTimeSync,
    /// `VV`.
    Version,
    /// `PP`.
    Parameters,
    /// `SS`.
    BitRate(u32),
    /// `PP` again, at the new rate.
    Verify,
    /// `TM0`.
    TimeEnter,
    /// `QT` once more, because `TM0` was denied.
    TimeQuit,
    /// `TM1`.
    TimeRead,
    /// `TM2`.
    TimeLeave,
    /// `MD` or `MS`.
    Measure,
    /// `BM`, because measuring was denied.
    LaserOn,
    /// `RS`.
    Reset,
    /// `RB`.
    Reboot,
    /// `RB` for the second time.
    RebootAgain,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Phase {
    /// To be asked at the deadline.
    Due(Step),
    /// Asked; the deadline ends the wait for the reply.
    Asked(Step),
    /// Scans come, or should; the deadline says by when.
    Streaming,
    /// Stopped by [`Session::pause`]: nothing is asked, whatever comes is passed over.
    Paused,
}

/// What sensor and settings make of a measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub(super) measurement: Measurement,
    pub(super) geometry: Geometry,
    /// Time between scans.
    pub(super) interval_us: u64,
}

/// The conversation with one sensor. A sensor is looked for from the first [`poll`](Self::poll) on.
#[derive(Clone, Debug)]
pub struct Session {
    pub(super) settings: SensorSettings,
    /// Beams there is memory for.
    pub(super) capacity: u16,
    pub(super) reader: Reader,
    pub(super) clock: SensorClock,
    pub(super) arrival: Arrival,
    pub(super) counters: SensorCounters,
    state: SensorState,
    state_changed: bool,

    pub(super) phase: Phase,
    pub(super) deadline_us: u64,
    /// Times the present step was asked before.
    pub(super) attempt: u8,
    /// When it was asked last.
    pub(super) asked_us: u64,
    /// Bytes since, but for those that may have been on their way before: those that text is made of, and others.
    pub(super) text_bytes: u32,
    pub(super) other_bytes: u32,
    message: Option<Message>,
    new_baud: Option<u32>,

    pub(super) baud: u32,
    pub(super) last_baud: Option<u32>,
    pub(super) candidates: Candidates,
    pub(super) candidate: usize,
    pub(super) candidate_since_us: u64,
    pub(super) rounds: u8,

    pub(super) version: Option<Version>,
    pub(super) skip_version: bool,
    pub(super) parameters: Option<Parameters>,
    pub(super) plan: Option<Plan>,
    /// Changing the speed failed: not at this start.
    pub(super) keep_baud: bool,
    /// How often in a row, and when to try again.
    pub(super) slow_starts: u8,
    pub(super) faster_at_us: Option<u64>,
    pub(super) detours: u8,
    pub(super) denials: u8,
    pub(super) exchanges: u8,
    pub(super) time_since_us: u64,

    /// `QT` and `MD` without a full start are under way.
    pub(super) resuming: bool,
    /// The stream is to be stopped, or is.
    pub(super) pausing: bool,
    /// Full starts, and reports of a fault, since the last accepted scan.
    pub(super) fruitless: u8,
    pub(super) faults: u8,
    pub(super) last_scan: Option<ScanTime>,
    /// When the last scan came, or the stream began.
    pub(super) alive_us: u64,
    /// A scan came since the stream began.
    pub(super) delivered: bool,
    /// Damaged scans before that.
    pub(super) damaged_first: u8,

    link_failures: u8,
    pause_until_us: u64,
}

impl Session {
    /// A session that keeps to `settings` and has memory for `capacity` beams.
    #[must_use]
    pub fn new(settings: SensorSettings, capacity: u16) -> Self {
        Self {
            settings,
            capacity,
            reader: Reader::new(),
            clock: SensorClock::new(),
            arrival: Arrival::NONE,
            counters: SensorCounters::default(),
            state: SensorState::Searching,
            state_changed: true,
            phase: Phase::Due(Step::Quit),
            deadline_us: 0,
            attempt: 0,
            asked_us: 0,
            text_bytes: 0,
            other_bytes: 0,
            message: None,
            new_baud: None,
            baud: 0,
            last_baud: None,
            candidates: Candidates::new(),
            candidate: 0,
            candidate_since_us: 0,
            rounds: 0,
            version: None,
            skip_version: false,
            parameters: None,
            plan: None,
            keep_baud: false,
            slow_starts: 0,
            faster_at_us: None,
            detours: 0,
            denials: 0,
            exchanges: 0,
            time_since_us: 0,
            resuming: false,
            pausing: false,
            fruitless: 0,
            faults: 0,
            last_scan: None,
            alive_us: 0,
            delivered: false,
            damaged_first: 0,
            link_failures: 0,
            pause_until_us: 0,
        }
    }

    /// What to do now. Between two calls at the same time at most a handful of actions pass before it is
    /// [`Action::Wait`] or [`Action::Pause`].
    pub fn poll(&mut self, now_us: u64) -> Action {
        if self.candidates.is_empty() && !self.pausing {
            self.search(now_us);
        }
        if self.new_baud.is_none() && self.message.is_none() && now_us >= self.deadline_us {
            match self.phase {
                Phase::Due(step) => self.send(step, now_us),
                Phase::Asked(step) => {
                    count(&mut self.counters.timeouts, 1);
                    self.timed_out(step, now_us);
                }
                Phase::Streaming => self.silent(now_us),
                Phase::Paused => self.deadline_us = u64::MAX,
            }
        }
        if let Some(rate_baud) = self.new_baud.take() {
            self.reader.restart();
            return Action::SetBaud(rate_baud);
        }
        if let Some(message) = self.message.take() {
            return Action::Send(message);
        }
        if self.pause_until_us > now_us {
            Action::Pause(self.pause_until_us.min(self.deadline_us))
        } else {
            Action::Wait(self.deadline_us)
        }
    }

    /// Takes bytes that came at `now_us`, up to the first scan; hand in the rest again until all are
    /// consumed. `ranges_mm` must be the same buffer every time, and be left alone in between.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64, ranges_mm: &mut [u16]) -> Received {
        self.link_failures = 0;
        let mut rest = bytes;
        while !rest.is_empty() {
            let fed = self.reader.feed(rest, now_us, ranges_mm);
            let (taken, behind) = rest.split_at_checked(fed.consumed.max(1)).unwrap_or((rest, &[]));
            rest = behind;
            self.arrival.note(taken.len(), now_us, self.line_baud());
            if self.phase != Phase::Streaming {
                self.note(taken, now_us);
                self.impatient(now_us);
            }
            let scan = fed.event.and_then(|event| self.happened(event, now_us));
            if scan.is_some() {
                return Received { consumed: bytes.len().saturating_sub(rest.len()), scan };
            }
        }
        Received { consumed: bytes.len(), scan: None }
    }

    /// A read or write failed, or the read found the end of file. It is read again at once: after an overrun bytes
    /// wait, and whoever leaves them loses what comes next as well. When that fails too, reading pauses for a
    /// moment, longer each time; everything else goes on by its deadlines.
    pub fn link_failed(&mut self, now_us: u64) {
        count(&mut self.counters.link_failures, 1);
        self.link_failures = self.link_failures.saturating_add(1);
        let pause_us = match self.link_failures {
            1 => 0,
            again => 1000u64 << (2 * again.saturating_sub(1).min(8)),
        };
        self.pause_until_us = now_us.saturating_add(pause_us.min(LINK_PAUSE_MAX_US));
        if self.link_failures == LINK_FAILURES && self.phase == Phase::Streaming {
            self.deadline_us = self.deadline_us.min(now_us);
        }
    }

    /// Stops the stream; whatever was going on ends. The state becomes [`SensorState::Paused`] when the sensor
    /// has answered, or did not in time.
    pub fn pause(&mut self, now_us: u64) {
        self.pausing = true;
        self.resuming = matches!(self.phase, Phase::Streaming) || self.resuming;
        self.ask(Step::Quit, now_us);
    }

    /// Goes on after [`pause`](Self::pause), with these settings; the sensor is set up anew if they differ.
    pub fn resume_with(&mut self, settings: SensorSettings, now_us: u64) {
        let changed = settings != self.settings;
        self.settings = settings;
        self.pausing = false;
        self.set_state(if self.plan.is_some() { SensorState::Starting } else { SensorState::Searching });
        if changed || !self.resuming || self.plan.is_none() {
            self.search(now_us);
        } else {
            self.ask(Step::Quit, now_us);
        }
    }

    /// The sensor is quiet, or silent.
    pub(super) fn paused(&mut self) {
        self.phase = Phase::Paused;
        self.deadline_us = u64::MAX;
        self.set_state(SensorState::Paused);
    }

    /// How the sensor is.
    #[must_use]
    pub const fn state(&self) -> SensorState {
        self.state
    }

    /// The state, if it has changed since the last call.
    #[must_use]
    pub fn state_change(&mut self) -> Option<SensorState> {
        core::mem::take(&mut self.state_changed).then_some(self.state)
    }

    /// What happened so far.
    #[must_use]
    pub const fn counters(&self) -> &SensorCounters {
        &self.counters
    }

    /// What the reader dropped so far, by cause.
    #[must_use]
    pub const fn losses(&self) -> &Losses {
        self.reader.losses()
    }

    /// Who the sensor says it is, once it has.
    #[must_use]
    pub const fn version(&self) -> Option<&Version> {
        self.version.as_ref()
    }

    /// What the sensor says it can measure, once it has.
    #[must_use]
    pub const fn parameters(&self) -> Option<&Parameters> {
        self.parameters.as_ref()
    }

    /// Where the beams of the scans point, once the sensor is known.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.plan.as_ref().map(|plan| &plan.geometry)
    }

    /// The mapping between the sensor's clock and the module's.
    #[must_use]
    pub const fn clock(&self) -> &SensorClock {
        &self.clock
    }

    /// Speed at which the sensor answered last: worth remembering for the next start of the module.
    #[must_use]
    pub fn last_baud(&self) -> Option<u32> {
        self.last_baud.filter(|_| self.settings.has_speed())
    }

    pub(super) fn set_state(&mut self, state: SensorState) {
        self.state_changed |= self.state != state;
        self.state = state;
    }

    /// Asks `step` as soon as possible.
    pub(super) fn ask(&mut self, step: Step, now_us: u64) {
        self.ask_at(step, now_us);
    }

    /// Asks `step` at `at_us`.
    pub(super) fn ask_at(&mut self, step: Step, at_us: u64) {
        self.phase = Phase::Due(step);
        self.deadline_us = at_us;
        self.attempt = 0;
    }

    /// Asks the present step once more if it was asked fewer than `limit` times.
    pub(super) fn again(&mut self, step: Step, at_us: u64, limit: u8) -> bool {
        let attempt = self.attempt.saturating_add(1);
        if attempt < limit {
            self.ask_at(step, at_us);
            self.attempt = attempt;
        }
        attempt < limit
    }

    pub(super) fn change_baud(&mut self, rate_baud: u32) {
        self.baud = rate_baud;
        if self.settings.has_speed() {
            self.new_baud = Some(rate_baud);
        }
    }

    /// The speed of the line, if it has one.
    pub(super) fn line_baud(&self) -> Option<u32> {
        self.settings.has_speed().then_some(self.baud)
    }

    /// The rate remembered from the module's settings, or the sensor's own.
    pub(super) fn first_baud(&self) -> u32 {
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
            Step::Measure => match self.plan {
                Some(plan) => Command::Measure(plan.measurement),
                None => return self.search(now_us),
            },
        };
        self.phase = Phase::Asked(step);
        self.asked_us = now_us;
        self.text_bytes = 0;
        self.other_bytes = 0;
        let line_us =
            self.line_baud().map_or(0, |baud| LONGEST_REPLY_BYTES * 10_000_000 / u64::from(baud.max(1)));
        self.deadline_us = now_us.saturating_add(REPLY_US + line_us);
        match command.encode() {
            Ok(request) => {
                self.reader.expect(&request);
                self.message = Some(Message::new(request, step == Step::Quit));
            }
            // Only a measurement of steps beyond 9999 cannot be said.
            Err(_) => self.unusable(crate::scan::GeometryError::StepsPerTurn, now_us),
        }
    }

    /// Counts what text is made of, and what is not.
    fn note(&mut self, bytes: &[u8], now_us: u64) {
        if now_us.saturating_sub(self.asked_us) < STALE_US {
            return;
        }
        for byte in bytes {
            let counter = match byte {
                b'\n' | b'\r' | b' '..=b'~' => &mut self.text_bytes,
                _ => &mut self.other_bytes,
            };
            *counter = counter.saturating_add(1);
        }
    }

    fn happened(&mut self, event: Event, now_us: u64) -> Option<ScanTaken> {
        match (event, self.phase) {
            (Event::Scan(header), _) => return self.scan(&header, now_us),
            (Event::Reply(reply), _) if matches!(reply.command, Command::Measure(_)) => {
                self.measurement_status(reply.status.of_measurement(), reply.status, now_us);
            }
            (Event::Lost(loss), Phase::Streaming) if loss.dropped == Dropped::Scan => {
                self.scan_damaged();
                self.scan_lost(now_us);
            }
            // The `00` that begins the stream counts as a scan there.
            (Event::Lost(loss), Phase::Asked(Step::Measure)) if loss.dropped == Dropped::Scan => {
                self.streaming(now_us);
            }
            (Event::Unexpected(Status::DATA), Phase::Streaming) => self.scan_damaged(),
            (Event::Reply(reply), Phase::Asked(step)) => {
                if !matches!(reply.status, Status::OK) {
                    count(&mut self.counters.refusals, 1);
                }
                self.answered(step, reply.status, now_us);
            }
            (Event::Scip11(reply), Phase::Asked(step)) => self.answered_in_scip11(step, reply.status, now_us),
            (Event::Version(version), Phase::Asked(Step::Version)) => self.has_version(version, now_us),
            (Event::Parameters(parameters), Phase::Asked(step)) => {
                self.has_parameters(step, parameters, now_us)
            }
            (Event::Time(time), Phase::Asked(Step::TimeRead)) => self.has_time(&time, now_us),
            (Event::Lost(loss), Phase::Asked(step)) if matches!(loss.dropped, Dropped::Reply(_)) => {
                self.damaged(step, now_us);
            }
            // Late replies, replies to somebody else, and what was left of damaged ones.
            _ => {}
        }
        None
    }
}
