//! The running stream: its scans, and what is done when they stop.
//!
//! ```text
//!   scans ──▶ 5 intervals without ──▶ Stalled ──▶ at least 0.6 s ──▶ QT, MD ──▶ scans
//!                                                                  └─▶ nothing ─▶ full start
//!   damaged scans only: waited for, 30 s at most: asking anew would not mend the line
//!   0M            this scan has no data: goes on
//!   21 … 49       the sensor verifies an error: waited for, 10 s at most
//!   50 … 97, 0L   a fault: rebooted
//!   same stamp    three times: stuck, QT, MD
//!   answers, but no scan: 40 s ─▶ RS, 20 s ─▶ RB, then RB every 120 s
//! ```

use super::Session;
use crate::scan::ScanTime;
use crate::scip::{Measurement, ScanHeader, Status, status::MeasurementStatus};
use crate::sensor::action::ScanTaken;
use crate::sensor::arrival::Arrival;
use crate::sensor::clock::{SensorClock, StampEvent};
use crate::sensor::request::{Phase, Step};
use crate::sensor::state::{SensorState, count};
use crate::sensor::timeouts::{BACKLOG_US, DAMAGED_US, RESUME_US, STALL_INTERVALS, VERIFY_US};

/// The scans of the stream: their clock, and those that came and should have come.
#[derive(Clone, Debug)]
pub(in crate::sensor) struct Stream {
    pub(in crate::sensor) clock: SensorClock,
    pub(in crate::sensor) arrival: Arrival,
    last_scan: Option<ScanTime>,
    /// When the last scan came, or the stream began.
    alive_us: u64,
    /// A scan came since the stream began.
    delivered: bool,
    /// Damaged scans before that.
    damaged_first: u8,
}

impl Stream {
    pub(in crate::sensor) const fn new() -> Self {
        Self {
            clock: SensorClock::new(),
            arrival: Arrival::NONE,
            last_scan: None,
            alive_us: 0,
            delivered: false,
            damaged_first: 0,
        }
    }

    /// The measurement was accepted: scans come from now on.
    const fn begin(&mut self, now_us: u64) {
        self.alive_us = now_us;
        self.delivered = false;
        self.damaged_first = 0;
    }

    /// Counts a damaged scan before the first complete one.
    const fn push_damaged(&mut self) {
        if !self.delivered {
            self.damaged_first = self.damaged_first.saturating_add(1);
        }
    }

    /// Scans missing before the one of `time`: by their stamps, if a scan of this stream came before it; else the
    /// damaged ones.
    fn missing(&mut self, time: ScanTime, interval_us: u64) -> u32 {
        let missing = match self.last_scan.filter(|_| self.delivered) {
            None => u64::from(core::mem::take(&mut self.damaged_first)),
            Some(last) => {
                let interval_ms = (interval_us / 1000).max(1);
                let gap_ms = time.sensor_ms.saturating_sub(last.sensor_ms);
                (gap_ms.saturating_add(interval_ms / 2) / interval_ms).saturating_sub(1)
            }
        };
        u32::try_from(missing).unwrap_or(u32::MAX)
    }
}

impl Session {
    /// A complete scan is in the caller's buffer.
    pub(in crate::sensor) fn accept_scan(&mut self, header: &ScanHeader, now_us: u64) -> Option<ScanTaken> {
        let plan = self.sensor.plan.filter(|_| header.streamed)?;
        if self.request.phase == Phase::Asked(Step::Measure) {
            // Its `00` was lost.
            self.begin_stream(now_us);
        }
        let scan_bytes =
            Measurement { cluster: 1, first_step: 1, last_step: header.beams, ..plan.measurement };
        let first_byte_us = self.stream.arrival.scan_end(scan_bytes.reply_bytes(), header.first_byte_us);
        let stamped = self.stream.clock.scan(header.stamp_ms, first_byte_us);
        let time = stamped.time;
        match stamped.event {
            StampEvent::Restarted => {
                count(
                    &mut self.health.counters.clock_restarts,
                    u32::from(self.health.counters.scans_accepted > 0),
                );
                self.stream.last_scan = None;
            }
            StampEvent::Stuck => {
                count(&mut self.health.counters.scans_repeated, 1);
                if self.request.phase == Phase::Streaming {
                    self.report_stall();
                    if self.stream.delivered {
                        self.resume(now_us);
                    } else {
                        self.start_over(now_us);
                    }
                }
                return None;
            }
            StampEvent::Continued => {}
        }
        if self.stream.last_scan.is_some_and(|last| last.sensor_ms == time.sensor_ms) {
            count(&mut self.health.counters.scans_repeated, 1);
            return None;
        }
        if self.request.phase == Phase::Streaming {
            self.count_missing(time, plan.interval_us);
            self.stream.alive_us = now_us;
            self.stream.delivered = true;
            self.cures.clear();
            self.set_state(SensorState::Streaming);
            self.request.deadline_us = now_us.saturating_add(self.stall_us());
            if self.line.retry_is_due(now_us) {
                self.search(now_us);
            }
        } else if self.request.phase == Phase::Asked(Step::Quit)
            && now_us < self.request.asked_us.saturating_add(BACKLOG_US)
        {
            // What was held back comes before the reply.
            self.request.deadline_us = self.request.deadline_us.max(now_us.saturating_add(self.stall_us()));
        }
        count(&mut self.health.counters.scans_accepted, 1);
        self.stream.last_scan = Some(time);
        Some(ScanTaken { time, beams: header.beams.min(self.capacity) })
    }

    fn count_missing(&mut self, time: ScanTime, interval_us: u64) {
        let missing = self.stream.missing(time, interval_us);
        count(&mut self.health.counters.scans_missing, missing);
    }

    /// Something came that was, or seems to have been, a scan.
    pub(in crate::sensor) fn count_damaged_scan(&mut self) {
        self.stream.push_damaged();
    }

    /// A scan began and came damaged, or without data, or none was in a reply: the sensor is alive.
    pub(in crate::sensor) fn extend_wait_for_scan(&mut self, now_us: u64) {
        if now_us >= self.stream.alive_us.saturating_add(self.stall_us())
            && self.state() == SensorState::Streaming
        {
            self.report_stall();
        }
        let patience_us = self.stream.alive_us.saturating_add(DAMAGED_US);
        let longer_us = now_us.saturating_add(self.stall_us()).min(patience_us);
        self.request.deadline_us = self.request.deadline_us.max(longer_us);
    }

    /// A reply to the measurement that carries no scan.
    pub(in crate::sensor) fn handle_measurement_status(
        &mut self,
        meaning: MeasurementStatus,
        status: Status,
        now_us: u64,
    ) {
        let asked = self.request.phase == Phase::Asked(Step::Measure);
        if !asked && self.request.phase != Phase::Streaming {
            return;
        }
        match meaning {
            MeasurementStatus::Accepted | MeasurementStatus::Resumed | MeasurementStatus::Data => {
                if asked {
                    self.begin_stream(now_us);
                } else {
                    self.extend_wait_for_scan(now_us);
                }
            }
            MeasurementStatus::Unstable => {
                count(&mut self.health.counters.scans_unstable, 1);
                self.count_damaged_scan();
                self.extend_wait_for_scan(now_us);
            }
            MeasurementStatus::Verifying => {
                let patience_us = self.stream.alive_us.saturating_add(VERIFY_US);
                self.request.deadline_us = self.request.deadline_us.max(patience_us);
            }
            MeasurementStatus::Abnormal | MeasurementStatus::Hardware => self.reboot_faulty(now_us),
            MeasurementStatus::Refused if !asked => {}
            MeasurementStatus::Refused => {
                count(&mut self.health.counters.refusals, 1);
                if status == Status::DENIED {
                    self.retry_with_laser_on(now_us);
                } else {
                    self.give_up(SensorState::Refused(status), now_us);
                }
            }
        }
    }

    /// The measurement was accepted: scans come from now on.
    pub(in crate::sensor) fn begin_stream(&mut self, now_us: u64) {
        self.request.phase = Phase::Streaming;
        self.stream.begin(now_us);
        // The first scan is yet to be measured, and sent.
        self.request.deadline_us = now_us.saturating_add(self.stall_us()).saturating_add(self.stall_us());
    }

    /// Nothing came until the deadline.
    pub(in crate::sensor) fn handle_silence(&mut self, now_us: u64) {
        let resume_at_us = self.stream.alive_us.saturating_add(RESUME_US.max(self.stall_us()));
        if self.state() == SensorState::Streaming {
            self.report_stall();
        }
        if now_us < resume_at_us {
            self.request.deadline_us = resume_at_us;
        } else if self.stream.delivered {
            self.resume(now_us);
        } else {
            self.start_over(now_us);
        }
    }

    fn report_stall(&mut self) {
        count(&mut self.health.counters.stalls, 1);
        self.set_state(SensorState::Stalled);
    }

    /// `QT`, and the measurement again.
    fn resume(&mut self, now_us: u64) {
        self.setup.resuming = true;
        self.setup.denials = 0;
        self.setup.detours = 0;
        self.ask(Step::Quit, now_us);
    }

    fn stall_us(&self) -> u64 {
        self.sensor.plan.map_or(RESUME_US, |plan| plan.interval_us.saturating_mul(STALL_INTERVALS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_ms(sensor_ms: u64) -> ScanTime {
        ScanTime { sensor_ms, stamp_us: 0, uncertainty_us: 0 }
    }

    #[test]
    fn missing_scans_are_counted_by_stamps_once_one_has_come() {
        let mut stream = Stream::new();
        stream.last_scan = Some(at_ms(1000));
        stream.begin(0);
        stream.push_damaged();
        stream.push_damaged();
        // The scan before belongs to an earlier stream: only the damaged ones are known to be missing.
        assert_eq!(stream.missing(at_ms(9000), 100_000), 2);
        stream.delivered = true;
        stream.push_damaged();
        assert_eq!(stream.missing(at_ms(1100), 100_000), 0);
        assert_eq!(stream.missing(at_ms(1149), 100_000), 0);
        assert_eq!(stream.missing(at_ms(1150), 100_000), 1);
        assert_eq!(stream.missing(at_ms(1400), 100_000), 3);
        assert_eq!(stream.missing(at_ms(900), 100_000), 0);
    }
}
