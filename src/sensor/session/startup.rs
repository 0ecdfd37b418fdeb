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
//! Then its version (`VV`, for logs), its parameters (`PP`), a faster line (`SS`, proven by a second `PP`),
//! its clock (`TM0`, `TM1`…, `TM2`), and `MD`. Every wait and every repetition has its limit.

use super::{Plan, Session};
use crate::scan::GeometryError;
use crate::scip::{Parameters, Status, TimeReply, Version};
use crate::sensor::request::Step;
use crate::sensor::settings::interval_us;
use crate::sensor::state::{SensorState, count};
use crate::sensor_model::{POWER_UP_BAUD, SensorModel};

/// Longest time at one rate while text comes: two scans of 2137 bytes at 19 200 baud, one in flight and one
/// begun, and two more replies.
const CANDIDATE_US: u64 = 4_500_000;

/// The line settles after a change of its speed; drivers of other makers wait 150 ms.
const SETTLE_US: u64 = 100_000;

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

/// Exchanges with the sensor's clock: at most this many, for at most this long, fewer when they agree
/// within this. A tick is 1000 µs.
const EXCHANGES: u8 = 32;
const EXCHANGES_US: u64 = 400_000;
const EXCHANGE_WIDTH_US: u32 = 1300;

/// Pause before `TM0` is asked again of a sensor that denied it.
const TIME_PAUSE_US: u64 = 50_000;

/// Most times `TM0` is asked again.
const TIME_DETOURS: u8 = 4;

/// What the present start is for, and how far it has come.
#[derive(Clone, Debug, Default)]
pub(in crate::sensor) struct SetupProgress {
    /// `QT` and `MD` without a full start are under way.
    pub(in crate::sensor) resuming: bool,
    /// The stream is to be stopped, or is.
    pub(in crate::sensor) pausing: bool,
    /// Ways out of the time-synchronisation state that were tried.
    pub(in crate::sensor) detours: u8,
    /// Answers that the sensor is not ready.
    pub(in crate::sensor) denials: u8,
    /// `TM1` exchanges, and when the first was asked.
    exchanges: u8,
    time_since_us: u64,
}

impl SetupProgress {
    /// The present rate is tried anew, or was the right one.
    const fn restart(&mut self) {
        self.detours = 0;
        self.denials = 0;
    }

    const fn begin_exchanges(&mut self, now_us: u64) {
        self.exchanges = 0;
        self.time_since_us = now_us;
    }

    /// Counts an exchange; whether the sensor's clock is known well enough, given how far the exchanges so far
    /// leave it open.
    fn push_exchange(&mut self, width_us: Option<u32>, now_us: u64) -> bool {
        self.exchanges = self.exchanges.saturating_add(1);
        let narrow = width_us.is_some_and(|width_us| width_us <= EXCHANGE_WIDTH_US);
        let long = now_us.saturating_sub(self.time_since_us) >= EXCHANGES_US;
        self.exchanges >= EXCHANGES || long || narrow && self.exchanges >= EXCHANGES / 4
    }
}

impl Session {
    /// Looks for the sensor at every rate.
    pub(in crate::sensor) fn search(&mut self, now_us: u64) {
        self.search_at(now_us);
    }

    fn search_at(&mut self, at_us: u64) {
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
                self.sensor.skip_version = true;
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
    fn detour(&mut self, now_us: u64) {
        self.setup.detours = self.setup.detours.saturating_add(1);
        if self.setup.detours <= 3 {
            self.ask(Step::Quit, now_us);
        } else {
            self.next_candidate(now_us);
        }
    }

    /// A sensor is there, speaks SCIP 2 and is quiet.
    fn begin_setup(&mut self, now_us: u64) {
        self.line.last_baud = Some(self.line.baud);
        self.search.rounds = 0;
        self.setup.restart();
        if core::mem::take(&mut self.setup.resuming) && self.sensor.plan.is_some() {
            count(&mut self.health.counters.resumes, 1);
            self.stream.clock.resume();
            self.ask(Step::Measure, now_us);
            return;
        }
        count(&mut self.health.counters.starts, 1);
        if let Some(step) = self.cures.next(now_us) {
            return self.reboot(step, now_us);
        }
        self.report_start();
        let skipped = core::mem::take(&mut self.sensor.skip_version);
        self.ask(if skipped { Step::Parameters } else { Step::Version }, now_us);
    }

    /// The stream brought nothing: a full start, after a pause.
    pub(in crate::sensor) fn start_over(&mut self, now_us: u64) {
        let pause_us = self.cures.start_pause_us();
        self.search_at(now_us.saturating_add(pause_us));
    }

    /// Says that it is being set up, unless it is known that this will not lead far.
    fn report_start(&mut self) {
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

    pub(in crate::sensor) fn apply_version(&mut self, version: Version, now_us: u64) {
        self.sensor.version = Some(version);
        self.ask(Step::Parameters, now_us);
    }

    pub(in crate::sensor) fn apply_parameters(&mut self, step: Step, parameters: Parameters, now_us: u64) {
        match step {
            Step::Parameters => self.plan(parameters, now_us),
            Step::Verify => {
                self.line.confirm();
                count(&mut self.health.counters.baud_changes, 1);
                self.synchronise(now_us);
            }
            _ => {}
        }
    }

    /// What can be measured is known: how, and how fast must the line be?
    fn plan(&mut self, parameters: Parameters, now_us: u64) {
        self.sensor.parameters = Some(parameters);
        let measurement = self.settings.measurement(&parameters);
        let geometry = match parameters.geometry(&measurement) {
            Ok(geometry) => geometry,
            Err(error) => return self.reject_geometry(error, now_us),
        };
        if geometry.beams() > self.capacity {
            let refused = SensorState::TooLarge { beams: geometry.beams(), capacity: self.capacity };
            return self.give_up(refused, now_us);
        }
        let interval_us = interval_us(&measurement, geometry.period_us(), self.line_baud());
        self.sensor.plan = Some(Plan { measurement, geometry, interval_us });
        let keep = core::mem::take(&mut self.line.keep_baud);
        self.line.cancel_retry();
        let model = SensorModel::of(parameters.model.as_str());
        match self.settings.better_baud(&model, &measurement, geometry.period_us(), self.line.baud) {
            Some(rate_baud) if !keep => self.ask(Step::BitRate(rate_baud), now_us),
            Some(_) => {
                self.line.retry_later(now_us);
                self.synchronise(now_us);
            }
            None => self.synchronise(now_us),
        }
    }

    /// `SS` was refused: for good where the sensor has no such rate, or the line no speed at all (USB).
    fn keep_rate(&mut self, status: Status, now_us: u64) {
        let for_good = matches!(
            status,
            Status::ALREADY
                | Status::ALREADY_AT_RATE
                | Status::NOT_FOR_MODEL
                | Status::NOT_DEFINED
                | Status::NOT_SUPPORTED
        );
        if !for_good {
            self.line.retry_later(now_us);
        }
        self.synchronise(now_us);
    }

    fn adopt_rate(&mut self, rate_baud: u32, now_us: u64) {
        self.change_baud(rate_baud);
        self.ask_at(Step::Verify, now_us.saturating_add(SETTLE_US));
    }

    /// The line is as it should be; now the clock.
    fn synchronise(&mut self, now_us: u64) {
        if let Some(plan) = &mut self.sensor.plan {
            let baud = self.settings.has_speed().then_some(self.line.baud);
            plan.interval_us = interval_us(&plan.measurement, plan.geometry.period_us(), baud);
        }
        self.begin_clock();
        self.ask(Step::TimeEnter, now_us);
    }

    /// A scan leaves when its revolution is complete, so by default it is taken to be one late.
    fn begin_clock(&mut self) {
        let period_us = self.sensor.plan.map_or(0, |plan| plan.geometry.period_us());
        self.stream.clock.begin(period_us);
    }

    pub(in crate::sensor) fn apply_time(&mut self, time: &TimeReply, now_us: u64) {
        self.stream.clock.exchange(time.stamp_ms, self.request.asked_us, time.first_byte_us);
        let enough = self.setup.push_exchange(self.stream.clock.exchange_width_us(), now_us);
        self.ask(if enough { Step::TimeLeave } else { Step::TimeRead }, now_us);
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

    fn reboot(&mut self, step: Step, now_us: u64) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_exchanges_are_enough_only_if_they_agree() {
        let exchanges_until_enough = |width_us, step_us: u64| {
            let mut setup = SetupProgress::default();
            setup.begin_exchanges(0);
            (1..100).find(|&count| setup.push_exchange(width_us, count * step_us))
        };
        assert_eq!(exchanges_until_enough(Some(EXCHANGE_WIDTH_US), 1), Some(8));
        assert_eq!(exchanges_until_enough(Some(EXCHANGE_WIDTH_US + 1), 1), Some(32));
        assert_eq!(exchanges_until_enough(None, 100_000), Some(4));
    }
}
