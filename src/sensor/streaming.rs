//! The running stream: its scans, and what is done when they stop.
//!
//! ```text
//!   scans ──▶ 5 intervals without ──▶ Stalled ──▶ at least 0.6 s ──▶ QT, MD ──▶ scans
//!                                                                  └─▶ nothing ─▶ full start
//!   damaged scans only: waited for, 30 s at most: asking anew would not mend the line
//!   0M            this scan has no data: goes on
//!   21 … 49       the sensor verifies an error: waited for
//!   50 … 97, 0L   a fault: rebooted
//!   same stamp    three times: stuck, QT, MD
//!   full starts without a scan: 3 ─▶ RS, 5 ─▶ RB
//! ```

use super::action::ScanTaken;
use super::clock::StampEvent;
use super::session::{Phase, Session, Step};
use super::state::{SensorState, count};
use crate::scan::ScanTime;
use crate::scip::{Measurement, ScanHeader, Status, status::MeasurementStatus};

/// Intervals without a scan after which the stream counts as stalled: more than the longest stalls
/// seen in recordings at 10 Hz (390 ms).
const STALL_INTERVALS: u64 = 5;

/// Least time without a scan before the stream is asked to go on: what is held back for less arrives yet.
const RESUME_US: u64 = 600_000;

/// Longest time in which only damaged scans come.
const DAMAGED_US: u64 = 30_000_000;

/// Longest wait for a reply while scans come in front of it.
const BACKLOG_US: u64 = 4_000_000;

/// Time a sensor may verify an error.
const VERIFY_US: u64 = 10_000_000;

impl Session {
    /// A complete scan is in the caller's buffer.
    pub(super) fn scan(&mut self, header: &ScanHeader, now_us: u64) -> Option<ScanTaken> {
        let plan = self.plan.filter(|_| header.streamed)?;
        if self.phase == Phase::Asked(Step::Measure) {
            // Its `00` was lost.
            self.streaming(now_us);
        }
        let scan_bytes =
            Measurement { cluster: 1, first_step: 1, last_step: header.beams, ..plan.measurement };
        let first_byte_us = self.arrival.scan_end(scan_bytes.reply_bytes(), header.first_byte_us);
        let stamped = self.clock.scan(header.stamp_ms, first_byte_us);
        let time = stamped.time;
        match stamped.event {
            StampEvent::Restarted => {
                count(&mut self.counters.clock_restarts, u32::from(self.counters.scans_accepted > 0));
                self.last_scan = None;
            }
            StampEvent::Stuck => {
                count(&mut self.counters.scans_repeated, 1);
                if self.phase == Phase::Streaming {
                    self.stalled();
                    if self.delivered {
                        self.resume(now_us);
                    } else {
                        self.start_over(now_us);
                    }
                }
                return None;
            }
            StampEvent::Continued => {}
        }
        if self.last_scan.is_some_and(|last| last.sensor_ms == time.sensor_ms) {
            count(&mut self.counters.scans_repeated, 1);
            return None;
        }
        if self.phase == Phase::Streaming {
            self.count_missing(time, plan.interval_us);
            self.alive_us = now_us;
            self.delivered = true;
            self.fruitless = 0;
            self.faults = 0;
            self.set_state(SensorState::Streaming);
            self.deadline_us = now_us.saturating_add(self.stall_us());
            if self.faster_at_us.is_some_and(|at_us| now_us >= at_us) {
                self.search(now_us);
            }
        } else if self.phase == Phase::Asked(Step::Quit) && now_us < self.asked_us.saturating_add(BACKLOG_US)
        {
            // What was held back comes before the reply.
            self.deadline_us = self.deadline_us.max(now_us.saturating_add(self.stall_us()));
        }
        count(&mut self.counters.scans_accepted, 1);
        self.last_scan = Some(time);
        Some(ScanTaken { time, beams: header.beams.min(self.capacity) })
    }

    /// Scans that should have come since the last one of this stream, by their stamps; for the
    /// first, those that were seen to be damaged.
    fn count_missing(&mut self, time: ScanTime, interval_us: u64) {
        let missing = match self.last_scan.filter(|_| self.delivered) {
            None => u64::from(core::mem::take(&mut self.damaged_first)),
            Some(last) => {
                let interval_ms = (interval_us / 1000).max(1);
                let gap_ms = time.sensor_ms.saturating_sub(last.sensor_ms);
                (gap_ms.saturating_add(interval_ms / 2) / interval_ms).saturating_sub(1)
            }
        };
        count(&mut self.counters.scans_missing, u32::try_from(missing).unwrap_or(u32::MAX));
    }

    /// Something came that was, or seems to have been, a scan.
    pub(super) fn scan_damaged(&mut self) {
        if !self.delivered {
            self.damaged_first = self.damaged_first.saturating_add(1);
        }
    }

    /// A scan began and came damaged, or without data: the sensor is alive.
    pub(super) fn scan_lost(&mut self, now_us: u64) {
        if now_us >= self.alive_us.saturating_add(self.stall_us()) && self.state() == SensorState::Streaming {
            self.stalled();
        }
        let patience_us = self.alive_us.saturating_add(DAMAGED_US);
        let longer_us = now_us.saturating_add(self.stall_us()).min(patience_us);
        self.deadline_us = self.deadline_us.max(longer_us);
    }

    /// A reply to the measurement that carries no scan.
    pub(super) fn measurement_status(&mut self, meaning: MeasurementStatus, status: Status, now_us: u64) {
        let asked = self.phase == Phase::Asked(Step::Measure);
        if !asked && self.phase != Phase::Streaming {
            return;
        }
        match meaning {
            MeasurementStatus::Accepted | MeasurementStatus::Resumed | MeasurementStatus::Data => {
                if asked {
                    self.streaming(now_us);
                } else {
                    self.deadline_us = now_us.saturating_add(self.stall_us());
                }
            }
            MeasurementStatus::Unstable => {
                count(&mut self.counters.scans_unstable, 1);
                self.scan_damaged();
                self.scan_lost(now_us);
            }
            MeasurementStatus::Verifying => {
                let patience_us = self.alive_us.saturating_add(VERIFY_US);
                self.deadline_us = now_us.saturating_add(self.stall_us()).max(patience_us);
            }
            MeasurementStatus::Abnormal | MeasurementStatus::Hardware => self.abnormal(now_us),
            MeasurementStatus::Refused if !asked => {}
            MeasurementStatus::Refused => {
                count(&mut self.counters.refusals, 1);
                if status == Status::DENIED {
                    self.measurement_denied(now_us);
                } else {
                    self.hopeless(SensorState::Refused(status), now_us);
                }
            }
        }
    }

    pub(super) fn streaming(&mut self, now_us: u64) {
        self.phase = Phase::Streaming;
        self.alive_us = now_us;
        self.delivered = false;
        self.damaged_first = 0;
        // The first one is yet to be measured, and sent.
        self.deadline_us = now_us.saturating_add(self.stall_us()).saturating_add(self.stall_us());
    }

    /// Nothing came until the deadline.
    pub(super) fn silent(&mut self, now_us: u64) {
        let resume_at_us = self.alive_us.saturating_add(RESUME_US.max(self.stall_us()));
        if self.state() == SensorState::Streaming {
            self.stalled();
        }
        if now_us < resume_at_us {
            self.deadline_us = resume_at_us;
        } else if self.delivered {
            self.resume(now_us);
        } else {
            self.start_over(now_us);
        }
    }

    fn stalled(&mut self) {
        count(&mut self.counters.stalls, 1);
        self.set_state(SensorState::Stalled);
    }

    /// `QT`, and the measurement again.
    fn resume(&mut self, now_us: u64) {
        self.resuming = true;
        self.denials = 0;
        self.ask(Step::Quit, now_us);
    }

    fn stall_us(&self) -> u64 {
        self.plan.map_or(RESUME_US, |plan| plan.interval_us.saturating_mul(STALL_INTERVALS))
    }
}
