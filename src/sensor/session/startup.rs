//! From a line in any state to a running stream.
//!
//! | found | seen as | done |
//! |---|---|---|
//! | another rate | nothing, or no text, for 0.25 s | next rate, the last good one first |
//! | still streaming | text, but no `QT` reply | `QT` again, 4.5 s at most |
//! | SCIP 1.1 | a status of one character | `SCIP2.0` |
//! | time synchronisation | `QT` refused, 0E or 10 | `TM2`, then `QT` again |
//! | booting | silence; refusals 10 and 01; no scan | asked again, 10 s at most, then searched anew |
//! | answers, but no scan | refusals, or silence, in place of scans | after 40 s `RS`, then `RB` |
//! | fault | 0L | `RB` twice |
//! | `QT` ignored | nothing, once | asked twice at the first rate |
//! | stale replies | replies to nothing asked now | passed over |
//!
//! Then it is set up: `setup`. Every wait and every repetition has its limit.

use super::{Session, VersionReply};
use crate::scan::GeometryError;
use crate::scip::Status;
use crate::sensor::request::Step;
use crate::sensor::serial_line::SETTLE_US;
use crate::sensor::state::{SensorState, count};
use crate::sensor_model::POWER_UP_BAUD;

/// Longest time at one rate while text comes: two scans of 2137 bytes at 19 200 baud, one in flight and one
/// begun, and two more replies.
const CANDIDATE_US: u64 = 4_500_000;

/// Pause before a booting sensor is asked again.
const BOOT_PAUSE_US: u64 = 250_000;

/// Denials after which a booting sensor is searched anew: 10 s.
const DENIALS: u8 = 40;

/// After `RB` a sensor answers for a moment longer, 1 s, then it is gone and boots.
const REBOOT_US: u64 = 1_500_000;

/// Pause after `RS`.
const RESET_US: u64 = 300_000;

/// Until a sensor that cannot be used is asked again.
const UNUSABLE_US: u64 = 3_000_000;

/// Pause before `TM0` is asked again of a sensor that denied it.
const TIME_PAUSE_US: u64 = 50_000;

/// Most times `TM0` is asked again.
const TIME_DETOURS: u8 = 4;

impl Session {
    /// Looks for the sensor at every rate.
    pub(in crate::sensor) fn search(&mut self, now_us: u64) {
        self.search_at(now_us);
    }

    pub(in crate::sensor) fn search_at(&mut self, at_us: u64) {
        self.setup.resuming = false;
        self.reader.forget();
        self.search.candidates = self.settings.candidates(self.line.last_baud);
        self.try_candidate(0, at_us);
    }

    fn try_candidate(&mut self, candidate: usize, at_us: u64) {
        let rate_baud = self.search.candidates.get(candidate).copied().unwrap_or_else(|| self.first_baud());
        self.search.candidate = candidate;
        self.search.candidate_since_us = at_us;
        self.setup.restart();
        self.change_baud(rate_baud);
        self.ask(Step::Quit, at_us);
    }

    fn next_candidate(&mut self, now_us: u64) {
        if let Some(next) = self.search.next() {
            self.try_candidate(next, now_us);
            return;
        }
        self.set_state(SensorState::Searching);
        self.cures.restart_time();
        let pause_us = self.search.end_round();
        self.search_at(now_us.saturating_add(pause_us));
    }

    /// No answer to `step`.
    pub(in crate::sensor) fn handle_timeout(&mut self, step: Step, now_us: u64) {
        match step {
            Step::Quit if self.setup.pausing => {
                if !self.repeat(step, now_us, 2) {
                    self.enter_pause();
                }
            }
            Step::Quit if self.setup.resuming => {
                if !self.repeat(step, now_us, 2) {
                    self.set_state(SensorState::Searching);
                    self.search(now_us);
                }
            }
            Step::Quit => {
                let reply = self.request.reply;
                let time_left = now_us.saturating_sub(self.search.candidate_since_us) < CANDIDATE_US;
                let first = self.search.candidate == 0 && self.request.attempt == 0 && !reply.is_garbled();
                if !((reply.is_text() && time_left || first) && self.repeat(step, now_us, u8::MAX)) {
                    self.next_candidate(now_us);
                }
            }
            Step::LeaveTimeSync => self.detour(now_us),
            Step::Version => {
                // Asked too often some sensors fall silent: not the next time.
                self.sensor.version_reply = VersionReply::Missed;
                self.ask(Step::Parameters, now_us);
            }
            // The answer may have been lost and the speed changed; the search finds out.
            Step::BitRate(rate_baud) => {
                self.line.last_baud = Some(rate_baud);
                self.line.keep_baud = true;
                self.search(now_us);
            }
            Step::Verify if self.request.attempt >= 2 => {
                self.line.keep_baud = true;
                self.search(now_us);
            }
            Step::TimeEnter | Step::TimeRead => self.ask(Step::TimeLeave, now_us),
            Step::TimeQuit => self.ask(Step::TimeEnter, now_us),
            Step::Reset => self.search_at(now_us.saturating_add(RESET_US)),
            // Some reboot without an answer.
            Step::Reboot => self.ask(Step::RebootAgain, now_us),
            Step::RebootAgain => self.await_reboot(now_us),
            Step::Scip20
            | Step::Parameters
            | Step::Verify
            | Step::TimeLeave
            | Step::Measure
            | Step::LaserOn => {
                if !self.repeat(step, now_us, 3) {
                    self.search(now_us);
                }
            }
        }
    }

    /// The reply to `step` came damaged.
    pub(in crate::sensor) fn handle_damaged_reply(&mut self, step: Step, now_us: u64) {
        match step {
            // It was understood; only the answer suffered.
            Step::BitRate(rate_baud) => self.adopt_rate(rate_baud, now_us),
            Step::Quit | Step::Reboot | Step::RebootAgain | Step::Reset => {}
            _ => {
                if !self.repeat(step, now_us, 12) {
                    self.line.keep_baud = step == Step::Verify;
                    self.search(now_us);
                }
            }
        }
    }

    /// `step` was answered with nothing but a status.
    pub(in crate::sensor) fn handle_status(&mut self, step: Step, status: Status, now_us: u64) {
        if self.setup.pausing {
            self.enter_pause();
            return;
        }
        if status == Status::ABNORMAL && !matches!(step, Step::Reboot | Step::RebootAgain) {
            self.reboot_faulty(now_us);
            return;
        }
        match (step, status) {
            (Step::Quit, Status::OK) => self.begin_setup(now_us),
            (Step::Quit, Status::NOT_DEFINED) => self.ask(Step::LeaveTimeSync, now_us),
            // Booting sensors deny it too: `TM2` is tried once.
            (Step::Quit, Status::DENIED) if self.setup.detours == 0 => self.ask(Step::LeaveTimeSync, now_us),
            // Too many at once; the first is still being worked on.
            (Step::Quit, Status([b'0', b'B'])) => {}
            (Step::Quit, _) => self.retry_denied(Step::Quit, now_us),
            (Step::LeaveTimeSync, _) => self.detour(now_us),
            (Step::Scip20, _) => self.begin_setup(now_us),
            (Step::Version, _) => self.ask(Step::Parameters, now_us),
            (Step::Parameters, _) => self.retry_denied(Step::Parameters, now_us),
            (Step::BitRate(rate_baud), Status::OK) => self.adopt_rate(rate_baud, now_us),
            (Step::BitRate(_), _) => self.keep_rate(status, now_us),
            (Step::Verify, _) => {
                if !self.repeat(step, now_us.saturating_add(SETTLE_US), 3) {
                    self.search(now_us);
                }
            }
            (Step::TimeEnter, Status::OK | Status::ALREADY) => {
                self.setup.begin_exchanges(now_us);
                self.ask(Step::TimeRead, now_us);
            }
            (Step::TimeEnter, Status::DENIED) if self.setup.detours < TIME_DETOURS => {
                self.setup.detours = self.setup.detours.saturating_add(1);
                self.ask(Step::TimeQuit, now_us);
            }
            (Step::TimeEnter, _) => self.ask(Step::Measure, now_us),
            (Step::TimeQuit, _) => self.ask_at(Step::TimeEnter, now_us.saturating_add(TIME_PAUSE_US)),
            (Step::TimeRead, _) => self.ask(Step::TimeLeave, now_us),
            (Step::TimeLeave, _) => self.ask(Step::Measure, now_us),
            (Step::LaserOn, Status::OK | Status::ALREADY) => {
                if self.setup.denials < DENIALS {
                    self.ask(Step::Measure, now_us);
                } else {
                    self.search(now_us);
                }
            }
            (Step::LaserOn, _) => {
                self.setup.detours = TIME_DETOURS - 1;
                self.retry_denied(Step::TimeEnter, now_us);
            }
            (Step::Reset, _) => self.search_at(now_us.saturating_add(RESET_US)),
            (Step::Reboot, Status::NOT_DEFINED | Status::NOT_SUPPORTED) => self.ask(Step::Reset, now_us),
            (Step::Reboot, _) => self.ask(Step::RebootAgain, now_us),
            (Step::RebootAgain, _) => self.await_reboot(now_us),
            // Answered through its status as a measurement.
            (Step::Measure, _) => {}
        }
    }

    /// `step` was answered in SCIP 1.1.
    pub(in crate::sensor) fn handle_scip11_status(&mut self, step: Step, status: u8, now_us: u64) {
        if self.setup.pausing {
            self.enter_pause();
        } else if step == Step::Scip20 && status == b'0' {
            self.begin_setup(now_us);
        } else if step == Step::Scip20 {
            self.retry_denied(Step::Scip20, now_us);
        } else {
            self.setup.resuming = false;
            self.ask(Step::Scip20, now_us);
        }
    }

    /// It is not ready: asked again after a pause.
    fn retry_denied(&mut self, step: Step, now_us: u64) {
        self.setup.denials = self.setup.denials.saturating_add(1);
        self.cures.push_denial(now_us);
        if self.setup.denials > DENIALS {
            match self.cures.next(now_us) {
                Some(step) => self.reboot(step, now_us),
                None => self.search(now_us),
            }
        } else {
            self.set_state(SensorState::Booting);
            self.ask_at(step, now_us.saturating_add(BOOT_PAUSE_US));
        }
    }

    /// The time-synchronisation state should be left: `QT` again.
    pub(in crate::sensor) fn detour(&mut self, now_us: u64) {
        self.setup.detours = self.setup.detours.saturating_add(1);
        if self.setup.detours <= 3 {
            self.ask(Step::Quit, now_us);
        } else {
            self.next_candidate(now_us);
        }
    }

    /// Measuring was denied: the laser may be off, or it is still booting.
    pub(in crate::sensor) fn retry_with_laser_on(&mut self, now_us: u64) {
        self.setup.denials = self.setup.denials.saturating_add(1);
        self.ask(Step::LaserOn, now_us);
    }

    pub(in crate::sensor) fn reject_geometry(&mut self, error: GeometryError, now_us: u64) {
        self.give_up(SensorState::Unusable(error), now_us);
    }

    /// It cannot be used, but that may change: asked again, slowly.
    pub(in crate::sensor) fn give_up(&mut self, state: SensorState, now_us: u64) {
        self.set_state(state);
        self.cures.give_up();
        self.search_at(now_us.saturating_add(UNUSABLE_US));
    }

    /// It reports a fault: rebooted, the first time at once.
    pub(in crate::sensor) fn reboot_faulty(&mut self, now_us: u64) {
        self.set_state(SensorState::Abnormal);
        let pause_us = self.cures.push_fault();
        count(&mut self.health.counters.reboots, 1);
        self.ask_at(Step::Reboot, now_us.saturating_add(pause_us));
    }

    pub(in crate::sensor) fn reboot(&mut self, step: Step, now_us: u64) {
        count(&mut self.health.counters.reboots, 1);
        self.set_state(SensorState::Booting);
        self.ask(step, now_us);
    }

    /// It goes down, and comes back as after power-up.
    fn await_reboot(&mut self, now_us: u64) {
        if self.state() != SensorState::Abnormal {
            self.set_state(SensorState::Booting);
        }
        self.line.last_baud = Some(POWER_UP_BAUD);
        self.search_at(now_us.saturating_add(REBOOT_US));
    }
}
