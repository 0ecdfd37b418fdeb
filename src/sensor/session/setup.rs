//! Sets up a sensor that was found: version, parameters, a faster line, its clock.
//!
//! ```text
//!   found ─▶ VV ─▶ PP ─▶ SS, proven by a second PP ─▶ TM0, TM1 …, TM2 ─▶ MD
//!                   └ geometry, rate and interval: the plan
//! ```

use super::{Plan, Session, VersionReply};
use crate::scip::{Parameters, Status, TimeReply, Version};
use crate::sensor::request::Step;
use crate::sensor::serial_line::SETTLE_US;
use crate::sensor::settings::interval_us;
use crate::sensor::state::{SensorState, count};
use crate::sensor_model::SensorModel;

/// Exchanges with the sensor's clock: at most this many, for at most this long, fewer when they agree
/// within this. A tick is 1000 µs.
const EXCHANGES: u8 = 32;
const EXCHANGES_US: u64 = 400_000;
const EXCHANGE_WIDTH_US: u32 = 1300;

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
    pub(in crate::sensor) const fn restart(&mut self) {
        self.detours = 0;
        self.denials = 0;
    }

    pub(in crate::sensor) const fn begin_exchanges(&mut self, now_us: u64) {
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
    /// A sensor is there, speaks SCIP 2 and is quiet.
    pub(in crate::sensor) fn begin_setup(&mut self, now_us: u64) {
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
        let missed = core::mem::take(&mut self.sensor.version_reply) == VersionReply::Missed;
        self.ask(if missed { Step::Parameters } else { Step::Version }, now_us);
    }

    /// The stream brought nothing: a full start, after a pause.
    pub(in crate::sensor) fn start_over(&mut self, now_us: u64) {
        let pause_us = self.cures.start_pause_us();
        self.search_at(now_us.saturating_add(pause_us));
    }

    /// Says that it is being set up, unless it is known that this will not lead far.
    pub(in crate::sensor) fn report_start(&mut self) {
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
        self.sensor.version_reply = VersionReply::Read;
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
    pub(in crate::sensor) fn plan(&mut self, parameters: Parameters, now_us: u64) {
        let before = self.sensor.parameters.replace(parameters);
        if self.sensor.version_reply != VersionReply::Read
            && before.is_some_and(|before| before.model != parameters.model)
        {
            // It is that of the sensor before.
            self.sensor.version = None;
        }
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
    pub(in crate::sensor) fn keep_rate(&mut self, status: Status, now_us: u64) {
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

    pub(in crate::sensor) fn adopt_rate(&mut self, rate_baud: u32, now_us: u64) {
        self.change_baud(rate_baud);
        self.ask_at(Step::Verify, now_us.saturating_add(SETTLE_US));
    }

    /// The line is as it should be; now the clock.
    pub(in crate::sensor) fn synchronise(&mut self, now_us: u64) {
        if let Some(plan) = &mut self.sensor.plan {
            let baud = self.settings.has_speed().then_some(self.line.baud);
            plan.interval_us = interval_us(&plan.measurement, plan.geometry.period_us(), baud);
        }
        self.begin_clock();
        self.ask(Step::TimeEnter, now_us);
    }

    /// A scan leaves when its revolution is complete, so by default it is taken to be one late.
    pub(in crate::sensor) fn begin_clock(&mut self) {
        let period_us = self.sensor.plan.map_or(0, |plan| plan.geometry.period_us());
        self.stream.clock.begin(period_us);
    }

    pub(in crate::sensor) fn apply_time(&mut self, time: &TimeReply, now_us: u64) {
        self.stream.clock.exchange(time.stamp_ms, self.request.asked_us, time.first_byte_us);
        let enough = self.setup.push_exchange(self.stream.clock.exchange_width_us(), now_us);
        self.ask(if enough { Step::TimeLeave } else { Step::TimeRead }, now_us);
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
