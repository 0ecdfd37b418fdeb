//! From a line in any state to a running stream.
//!
//! | found | seen as | done |
//! |---|---|---|
//! | another rate | nothing, or no text, for 0.25 s | next rate, the last good one first |
//! | still streaming | text, but no `QT` reply | `QT` again, 4.5 s at most |
//! | SCIP 1.1 | a status of one character | `SCIP2.0` |
//! | time synchronisation | `QT` refused, 0E | `TM2` |
//! | booting | silence; refusals 10 and 01 | asked again, 10 s at most, then searched anew |
//! | fault | 0L | `RB` twice |
//! | `QT` ignored | nothing, once | asked twice at the first rate |
//! | stale replies | replies to nothing asked now | passed over |
//!
//! Then who it is (`VV`, for logs), what it can (`PP`), a faster line (`SS`, proven by a second `PP`),
//! its clock (`TM0`, `TM1`…, `TM2`), and `MD`. Every wait and every repetition has its limit.

use super::session::{Phase, Plan, Session, Step};
use super::settings::{POWER_UP_BAUD, interval_us};
use super::state::{SensorState, count};
use crate::scan::GeometryError;
use crate::scip::{Parameters, Status, TimeReply, Version};

/// Longest time at one rate while text comes: two scans of 2137 bytes at 19 200 baud, one in flight and one
/// begun, and two more replies.
const CANDIDATE_US: u64 = 4_500_000;

/// Most bytes at one rate: what a scan stream of 40 Hz, with intensities, sends in that time, twice.
const CANDIDATE_BYTES: u32 = 2_500_000;

/// Text this long shows that the rate is right.
const TEXT_BYTES: u32 = 24;

/// This many bytes that are mostly no text show that it is wrong, but for noise before the first reply: that
/// is given time to come.
const GARBLED_BYTES: u32 = 64;
const GARBLED_US: u64 = 120_000;

/// Longest pause after all rates were tried.
const ROUND_PAUSE_MAX_US: u64 = 800_000;

/// The line settles after a change of its speed; drivers of other makers wait 150 ms.
const SETTLE_US: u64 = 100_000;

/// Pause before a booting sensor is asked again.
const BOOT_PAUSE_US: u64 = 250_000;

/// Denials after which a booting sensor is searched anew: 10 s.
const DENIALS: u8 = 40;

/// A sensor that was told to reboot answers for a moment longer, 1 s, then it is gone and boots.
const REBOOT_US: u64 = 1_500_000;

/// Pause after `RS`.
const RESET_US: u64 = 300_000;

/// Until a sensor that cannot be used is asked again.
const UNUSABLE_US: u64 = 3_000_000;

/// Longest pause before a sensor that keeps reporting a fault is rebooted again.
const FAULT_PAUSE_MAX_US: u64 = 30_000_000;

/// Exchanges with the sensor's clock: at most this many, for at most this long, fewer when they agree
/// within this. A tick is 1000 µs.
const EXCHANGES: u8 = 32;
const EXCHANGES_US: u64 = 400_000;
const EXCHANGE_WIDTH_US: u32 = 1300;

/// Until a change of speed that failed is tried again, twice as long each time, up to an hour.
const FASTER_US: u64 = 60_000_000;

/// The full start without a scan at which the sensor is reset, or rebooted, instead; and after how many
/// more it is rebooted again, which is once in two minutes.
const RESET_AT: u8 = 4;
const REBOOT_AT: u8 = 6;
const REBOOT_EVERY: u8 = 6;

/// Pause before a full start, doubled for each in a row that brought no scan: up to 25.6 s.
const FRUITLESS_US: u64 = 50_000;
const FRUITLESS_DOUBLED: u8 = 9;

/// Pause before `TM0` is asked again of a sensor that denied it.
const TIME_PAUSE_US: u64 = 50_000;

/// How often it is.
const TIME_DETOURS: u8 = 4;

impl Session {
    /// Looks for the sensor at every rate.
    pub(super) fn search(&mut self, now_us: u64) {
        self.search_at(now_us);
    }

    fn search_at(&mut self, at_us: u64) {
        self.resuming = false;
        self.reader.forget();
        self.candidates = self.settings.candidates(self.last_baud);
        self.try_candidate(0, at_us);
    }

    fn try_candidate(&mut self, candidate: usize, at_us: u64) {
        let rate_baud = self.candidates.get(candidate).copied().unwrap_or_else(|| self.first_baud());
        self.candidate = candidate;
        self.candidate_since_us = at_us;
        self.detours = 0;
        self.denials = 0;
        self.change_baud(rate_baud);
        self.ask(Step::Quit, at_us);
    }

    fn next_candidate(&mut self, now_us: u64) {
        let next = self.candidate.saturating_add(1);
        if next < self.candidates.len() {
            self.try_candidate(next, now_us);
            return;
        }
        self.set_state(SensorState::Searching);
        let pause_us = 100_000u64 << self.rounds.min(3);
        self.rounds = self.rounds.saturating_add(1);
        self.search_at(now_us.saturating_add(pause_us.min(ROUND_PAUSE_MAX_US)));
    }

    /// No answer to `step`.
    pub(super) fn timed_out(&mut self, step: Step, now_us: u64) {
        match step {
            Step::Quit if self.pausing => {
                if !self.again(step, now_us, 2) {
                    self.paused();
                }
            }
            Step::Quit if self.resuming => {
                if !self.again(step, now_us, 2) {
                    self.set_state(SensorState::Searching);
                    self.search(now_us);
                }
            }
            Step::Quit => {
                let text = self.text_bytes >= TEXT_BYTES && self.other_bytes <= self.text_bytes / 8;
                let time_left = now_us.saturating_sub(self.candidate_since_us) < CANDIDATE_US;
                let first = self.candidate == 0 && self.attempt == 0 && !self.garbled();
                if !((text && time_left || first) && self.again(step, now_us, u8::MAX)) {
                    self.next_candidate(now_us);
                }
            }
            Step::LeaveTimeSync => self.detour(now_us),
            Step::Version => {
                // Asked too often some sensors fall silent: not the next time.
                self.skip_version = true;
                self.ask(Step::Parameters, now_us);
            }
            // The answer may have been lost and the speed changed; the search finds out.
            Step::BitRate(rate_baud) => {
                self.last_baud = Some(rate_baud);
                self.keep_baud = true;
                self.search(now_us);
            }
            Step::Verify if self.attempt >= 2 => {
                self.keep_baud = true;
                self.search(now_us);
            }
            Step::TimeEnter | Step::TimeRead => self.ask(Step::TimeLeave, now_us),
            Step::TimeQuit => self.ask(Step::TimeEnter, now_us),
            Step::Reset => self.search_at(now_us.saturating_add(RESET_US)),
            // Some reboot without an answer.
            Step::Reboot => self.ask(Step::RebootAgain, now_us),
            Step::RebootAgain => self.rebooting(now_us),
            Step::Scip20
            | Step::Parameters
            | Step::Verify
            | Step::TimeLeave
            | Step::Measure
            | Step::LaserOn => {
                if !self.again(step, now_us, 3) {
                    self.search(now_us);
                }
            }
        }
    }

    /// The reply to `step` came damaged.
    pub(super) fn damaged(&mut self, step: Step, now_us: u64) {
        match step {
            // It was understood; only the answer suffered.
            Step::BitRate(rate_baud) => self.changed_baud(rate_baud, now_us),
            Step::Quit | Step::Reboot | Step::RebootAgain | Step::Reset => {}
            _ => {
                if !self.again(step, now_us, 12) {
                    self.keep_baud = step == Step::Verify;
                    self.search(now_us);
                }
            }
        }
    }

    /// `step` was answered with nothing but a status.
    pub(super) fn answered(&mut self, step: Step, status: Status, now_us: u64) {
        if self.pausing {
            self.paused();
            return;
        }
        if status == Status::ABNORMAL && !matches!(step, Step::Reboot | Step::RebootAgain) {
            self.abnormal(now_us);
            return;
        }
        match (step, status) {
            (Step::Quit, Status::OK) => self.found(now_us),
            (Step::Quit, Status::NOT_DEFINED) => self.ask(Step::LeaveTimeSync, now_us),
            // Too many at once; the first is still being worked on.
            (Step::Quit, Status([b'0', b'B'])) => {}
            (Step::Quit, _) => self.denied(Step::Quit, now_us),
            (Step::LeaveTimeSync, _) => self.detour(now_us),
            (Step::Scip20, _) => self.found(now_us),
            (Step::Version, _) => self.ask(Step::Parameters, now_us),
            (Step::Parameters, _) => self.denied(Step::Parameters, now_us),
            (Step::BitRate(rate_baud), Status::OK) => self.changed_baud(rate_baud, now_us),
            (Step::BitRate(_), _) => self.keeps_baud(status, now_us),
            (Step::Verify, _) => {
                if !self.again(step, now_us.saturating_add(SETTLE_US), 3) {
                    self.search(now_us);
                }
            }
            (Step::TimeEnter, Status::OK | Status::ALREADY) => {
                self.exchanges = 0;
                self.time_since_us = now_us;
                self.ask(Step::TimeRead, now_us);
            }
            (Step::TimeEnter, Status::DENIED) if self.detours < TIME_DETOURS => {
                self.detours = self.detours.saturating_add(1);
                self.ask(Step::TimeQuit, now_us);
            }
            (Step::TimeEnter, _) => self.ask(Step::Measure, now_us),
            (Step::TimeQuit, _) => self.ask_at(Step::TimeEnter, now_us.saturating_add(TIME_PAUSE_US)),
            (Step::TimeRead, _) => self.ask(Step::TimeLeave, now_us),
            (Step::TimeLeave, _) => self.ask(Step::Measure, now_us),
            (Step::LaserOn, Status::OK | Status::ALREADY) => {
                if self.denials < DENIALS {
                    self.ask(Step::Measure, now_us);
                } else {
                    self.search(now_us);
                }
            }
            (Step::LaserOn, _) => {
                self.detours = TIME_DETOURS - 1;
                self.denied(Step::TimeEnter, now_us);
            }
            (Step::Reset, _) => self.search_at(now_us.saturating_add(RESET_US)),
            (Step::Reboot, Status::NOT_DEFINED | Status::NOT_SUPPORTED) => self.ask(Step::Reset, now_us),
            (Step::Reboot, _) => self.ask(Step::RebootAgain, now_us),
            (Step::RebootAgain, _) => self.rebooting(now_us),
            // Answered through its status as a measurement.
            (Step::Measure, _) => {}
        }
    }

    /// `step` was answered in SCIP 1.1.
    pub(super) fn answered_in_scip11(&mut self, step: Step, status: u8, now_us: u64) {
        if self.pausing {
            self.paused();
        } else if step == Step::Scip20 && status == b'0' {
            self.found(now_us);
        } else if step == Step::Scip20 {
            self.denied(Step::Scip20, now_us);
        } else {
            self.resuming = false;
            self.ask(Step::Scip20, now_us);
        }
    }

    /// It is not ready: asked again after a pause.
    fn denied(&mut self, step: Step, now_us: u64) {
        self.denials = self.denials.saturating_add(1);
        if self.denials > DENIALS {
            self.search(now_us);
        } else {
            self.set_state(SensorState::Booting);
            self.ask_at(step, now_us.saturating_add(BOOT_PAUSE_US));
        }
    }

    /// The time-synchronisation state should be left: `QT` again.
    fn detour(&mut self, now_us: u64) {
        self.detours = self.detours.saturating_add(1);
        if self.detours <= 3 {
            self.ask(Step::Quit, now_us);
        } else {
            self.next_candidate(now_us);
        }
    }

    /// A sensor is there, speaks SCIP 2 and is quiet.
    fn found(&mut self, now_us: u64) {
        self.last_baud = Some(self.baud);
        self.rounds = 0;
        self.denials = 0;
        self.detours = 0;
        if core::mem::take(&mut self.resuming) && self.plan.is_some() {
            count(&mut self.counters.resumes, 1);
            self.begin_clock();
            self.ask(Step::Measure, now_us);
            return;
        }
        count(&mut self.counters.starts, 1);
        self.fruitless = self.fruitless.saturating_add(1);
        match self.fruitless {
            RESET_AT => self.reboot(Step::Reset, now_us),
            REBOOT_AT => self.reboot(Step::Reboot, now_us),
            _ => {
                self.starting();
                let skipped = core::mem::take(&mut self.skip_version);
                self.ask(if skipped { Step::Parameters } else { Step::Version }, now_us);
            }
        }
    }

    /// The stream brought nothing: a full start, after a pause that grows.
    pub(super) fn start_over(&mut self, now_us: u64) {
        let pause_us = FRUITLESS_US << self.fruitless.min(FRUITLESS_DOUBLED);
        if self.fruitless >= REBOOT_AT + REBOOT_EVERY {
            self.fruitless = REBOOT_AT - 1;
        }
        self.search_at(now_us.saturating_add(pause_us));
    }

    /// Says that it is being set up, unless it is known that this will not lead far.
    fn starting(&mut self) {
        let hopeless = matches!(
            self.state(),
            SensorState::TooLarge { .. }
                | SensorState::Unusable(_)
                | SensorState::Refused(_)
                | SensorState::Abnormal
        );
        if !hopeless {
            self.set_state(SensorState::Starting);
        }
    }

    pub(super) fn has_version(&mut self, version: Version, now_us: u64) {
        self.version = Some(version);
        self.ask(Step::Parameters, now_us);
    }

    pub(super) fn has_parameters(&mut self, step: Step, parameters: Parameters, now_us: u64) {
        match step {
            Step::Parameters => self.plan(parameters, now_us),
            Step::Verify => {
                self.last_baud = Some(self.baud);
                self.slow_starts = 0;
                count(&mut self.counters.baud_changes, 1);
                self.synchronise(now_us);
            }
            _ => {}
        }
    }

    /// What can be measured is known: how, and how fast must the line be?
    fn plan(&mut self, parameters: Parameters, now_us: u64) {
        self.parameters = Some(parameters);
        let measurement = self.settings.measurement(&parameters);
        let geometry = match parameters.geometry(&measurement) {
            Ok(geometry) => geometry,
            Err(error) => return self.unusable(error, now_us),
        };
        if geometry.beams() > self.capacity {
            let refused = SensorState::TooLarge { beams: geometry.beams(), capacity: self.capacity };
            return self.hopeless(refused, now_us);
        }
        let interval_us = interval_us(&measurement, geometry.period_us(), self.line_baud());
        self.plan = Some(Plan { measurement, geometry, interval_us });
        let keep = core::mem::take(&mut self.keep_baud);
        self.faster_at_us = None;
        match self.settings.better_baud(&measurement, geometry.period_us(), self.baud) {
            Some(rate_baud) if !keep => self.ask(Step::BitRate(rate_baud), now_us),
            Some(_) => {
                self.faster_later(now_us);
                self.synchronise(now_us);
            }
            None => self.synchronise(now_us),
        }
    }

    /// `SS` was refused: for good where the sensor has no such rate, or the line no speed at all (USB).
    fn keeps_baud(&mut self, status: Status, now_us: u64) {
        let for_good = matches!(
            status,
            Status::ALREADY
                | Status::ALREADY_AT_RATE
                | Status::NOT_FOR_MODEL
                | Status::NOT_DEFINED
                | Status::NOT_SUPPORTED
        );
        if !for_good {
            self.faster_later(now_us);
        }
        self.synchronise(now_us);
    }

    fn faster_later(&mut self, now_us: u64) {
        let pause_us = FASTER_US << self.slow_starts.min(6);
        self.slow_starts = self.slow_starts.saturating_add(1);
        self.faster_at_us = Some(now_us.saturating_add(pause_us));
    }

    fn changed_baud(&mut self, rate_baud: u32, now_us: u64) {
        self.change_baud(rate_baud);
        self.ask_at(Step::Verify, now_us.saturating_add(SETTLE_US));
    }

    /// The line is as it should be; now the clock.
    fn synchronise(&mut self, now_us: u64) {
        if let Some(plan) = &mut self.plan {
            let baud = self.settings.has_speed().then_some(self.baud);
            plan.interval_us = interval_us(&plan.measurement, plan.geometry.period_us(), baud);
        }
        self.begin_clock();
        self.ask(Step::TimeEnter, now_us);
    }

    /// A scan leaves when its revolution is complete, so by default it is taken to be one late.
    fn begin_clock(&mut self) {
        let period_us = self.plan.map_or(0, |plan| plan.geometry.period_us());
        self.clock.begin(period_us);
    }

    pub(super) fn has_time(&mut self, time: &TimeReply, now_us: u64) {
        self.clock.exchange(time.stamp_ms, self.asked_us, time.first_byte_us);
        self.exchanges = self.exchanges.saturating_add(1);
        let narrow = self.clock.exchange_width_us().is_some_and(|width_us| width_us <= EXCHANGE_WIDTH_US);
        let long = now_us.saturating_sub(self.time_since_us) >= EXCHANGES_US;
        let enough = self.exchanges >= EXCHANGES || long || narrow && self.exchanges >= EXCHANGES / 4;
        self.ask(if enough { Step::TimeLeave } else { Step::TimeRead }, now_us);
    }

    /// Measuring was denied: the laser may be off, or it is still booting.
    pub(super) fn measurement_denied(&mut self, now_us: u64) {
        self.denials = self.denials.saturating_add(1);
        self.ask(Step::LaserOn, now_us);
    }

    pub(super) fn unusable(&mut self, error: GeometryError, now_us: u64) {
        self.hopeless(SensorState::Unusable(error), now_us);
    }

    /// It cannot be used, but that may change: asked again, slowly.
    pub(super) fn hopeless(&mut self, state: SensorState, now_us: u64) {
        self.set_state(state);
        self.fruitless = 0;
        self.search_at(now_us.saturating_add(UNUSABLE_US));
    }

    /// It reports a fault: rebooted, the first time at once.
    pub(super) fn abnormal(&mut self, now_us: u64) {
        self.set_state(SensorState::Abnormal);
        let pause_us = match self.faults {
            0 => 0,
            faults => 1_000_000u64 << faults.min(5),
        };
        self.faults = self.faults.saturating_add(1);
        count(&mut self.counters.reboots, 1);
        self.ask_at(Step::Reboot, now_us.saturating_add(pause_us.min(FAULT_PAUSE_MAX_US)));
    }

    fn reboot(&mut self, step: Step, now_us: u64) {
        count(&mut self.counters.reboots, 1);
        self.set_state(SensorState::Booting);
        self.ask(step, now_us);
    }

    /// It goes down, and comes back as after power-up.
    fn rebooting(&mut self, now_us: u64) {
        if self.state() != SensorState::Abnormal {
            self.set_state(SensorState::Booting);
        }
        self.last_baud = Some(POWER_UP_BAUD);
        self.search_at(now_us.saturating_add(REBOOT_US));
    }

    /// Bytes came in that shorten the wait: far too many, or such that the rate must be wrong.
    pub(super) fn impatient(&mut self, now_us: u64) {
        if !matches!(self.phase, Phase::Asked(_)) {
            return;
        }
        if self.text_bytes.saturating_add(self.other_bytes) > CANDIDATE_BYTES {
            self.deadline_us = self.deadline_us.min(now_us);
        } else if self.phase == Phase::Asked(Step::Quit) && !self.resuming && self.garbled() {
            self.deadline_us = self.deadline_us.min(self.asked_us.saturating_add(GARBLED_US));
        }
    }

    /// What came is no text: it was sent at another rate.
    fn garbled(&self) -> bool {
        self.text_bytes.saturating_add(self.other_bytes) >= GARBLED_BYTES
            && self.other_bytes > self.text_bytes / 2
    }
}
