//! The running measurement: one scan after another, each sent when its revolution is complete.
//!
//! ```text
//! MD0044072501000 LF        the request
//! MD0044072501000 LF 00P LF LF                      its answer, without data
//! MD0044072501000 LF 99b LF stamp data… LF          every scan; the last two digits count down
//! ```

use super::encode::{checksum, push_block, push_stamp};
use super::measurement::characters;
use super::request::{Measurement, split_string};
use super::{MAX_TRUTH, ScanTruth, Urg, texts};
use crate::source::{Revolution, SourceScan};

/// Scans that may queue up while the sensor catches up after a stall.
const CATCH_UP_SCANS: u64 = 4;

/// Scans sent before a fault drill (`DB03` to `DB05`) begins, and the time it lasts, in scans.
const DRILL_AFTER: u64 = 20;
const DRILL_SCANS: u64 = 10;

/// A running measurement.
#[derive(Debug)]
pub(super) struct Stream {
    asked: Measurement,
    /// The request as it came, for the echo.
    request: Vec<u8>,
    remaining: u8,
    skip_left: u8,
    /// Scans since the measurement began, for drills.
    scans: u64,
    next: Option<SourceScan>,
}

impl Stream {
    /// The echo of a scan: the request with its count replaced by the scans that remain.
    fn echo(&self) -> Vec<u8> {
        let (command, _) = split_string(&self.request);
        let mut echo = self.request.clone();
        let count_at = command.len().saturating_sub(2);
        echo.splice(count_at..command.len(), format!("{:02}", self.remaining).into_bytes());
        echo
    }
}

impl Urg {
    /// Begins a measurement; its first scan is the next whole revolution.
    pub(super) fn start_measuring(&mut self, asked: Measurement, request: &[u8]) {
        self.laser = true;
        let start_us = self.mirror.next_us(self.now_us.saturating_sub(1));
        let next = self.next_scan(start_us, self.now_us);
        self.stream = Some(Stream {
            asked,
            request: request.to_vec(),
            remaining: asked.scans,
            skip_left: 0,
            scans: 0,
            next,
        });
    }

    /// The measurement of a session before this one is still running.
    pub(super) fn run_on(&mut self) {
        let model = &self.config.model;
        let (first, last) = (model.geometry.first_step, model.geometry.last_step);
        let command =
            self.config.left_running.clone().unwrap_or_else(|| format!("MD{first:04}{last:04}01000"));
        let (letters, _) = split_string(command.as_bytes());
        if let Ok(asked) = Measurement::parse(letters, model.max_step) {
            self.start_measuring(asked, command.as_bytes());
        }
    }

    /// Ends a measurement, laser off.
    pub(super) fn stop_measuring(&mut self) {
        self.stream = None;
        self.laser = false;
        self.catching_up = false;
    }

    /// The sensor breaks: a running measurement ends with a status 0L.
    pub(super) fn break_down(&mut self) {
        self.abnormal = true;
        if let Some(stream) = &self.stream {
            let echo = stream.echo();
            self.send_status(&echo, "0L");
        }
        self.stop_measuring();
    }

    fn next_scan(&mut self, start_us: u64, earliest_us: u64) -> Option<SourceScan> {
        let revolution = Revolution { start_us, period_us: self.mirror.period_us(), earliest_us };
        let scan = self.source.scan(revolution);
        self.source_ended |= scan.is_none();
        scan
    }

    /// When the scan under way is sent.
    pub(super) fn scan_due_us(&self) -> Option<u64> {
        let scan = self.stream.as_ref()?.next.as_ref()?;
        Some(self.faults.released_us(scan.ready_us))
    }

    /// The scan under way is complete: sends it, or not, and goes on to the next.
    pub(super) fn finish_scan(&mut self) {
        let Some(mut stream) = self.stream.take() else { return };
        let Some(scan) = stream.next.take() else { return };
        let half_turn_us = u64::from(self.mirror.period_us() / 2);
        stream.next = self.next_scan(self.mirror.next_us(scan.start_us + half_turn_us), scan.start_us);
        if stream.skip_left > 0 {
            stream.skip_left -= 1;
            self.stream = Some(stream);
            return;
        }
        stream.skip_left = stream.asked.skip;
        if self.line_busy(&scan) {
            self.counts.scans_dropped += 1;
            self.stream = Some(stream);
            return;
        }
        if stream.asked.scans > 0 {
            stream.remaining = stream.remaining.saturating_sub(1);
        }
        stream.scans += 1;
        let done = stream.asked.scans > 0 && stream.remaining == 0;
        let failed = self.send_scan(&stream, scan);
        if done || failed {
            self.stop_measuring();
        } else {
            self.stream = Some(stream);
        }
    }

    /// A line that still carries an earlier scan loses this one, unless it was held back by a stall.
    fn line_busy(&mut self, scan: &SourceScan) -> bool {
        let period_us = u64::from(self.mirror.period_us());
        if self.scan_end_us <= self.now_us || !self.config.paced {
            self.catching_up = false;
        }
        let close = self.truth.back().is_some_and(|last| scan.start_us < last.start_us + period_us / 2);
        if close || self.now_us > scan.start_us + 2 * period_us {
            self.catching_up = true;
        }
        if !self.config.paced || self.scan_end_us <= self.now_us {
            return false;
        }
        let last_us = self.truth.back().map_or(0, |truth| truth.queued_us);
        let sending_us = self.scan_end_us.saturating_sub(last_us).max(1);
        let waiting = (self.scan_end_us - self.now_us) / sending_us;
        !self.catching_up || waiting >= CATCH_UP_SCANS
    }

    /// Sends one scan, or the status that takes its place; true if the measurement ends with it.
    fn send_scan(&mut self, stream: &Stream, scan: SourceScan) -> bool {
        let echo = stream.echo();
        if let Some(status) = self.drill_status(stream.scans, stream.asked.scans) {
            self.send_status(&echo, status);
            return status == "50";
        }
        if self.faults.unstable_scan() {
            self.send_status(&echo, "0M");
            return false;
        }
        let mut stamp_ms = self.clock.stamp_ms(scan.start_us);
        let mut ranges_mm = scan.ranges_mm;
        if self.faults.stuck(self.now_us) {
            (stamp_ms, ranges_mm) = self.frozen.get_or_insert((stamp_ms, ranges_mm)).clone();
        } else {
            self.frozen = None;
        }
        let mut reply = echo;
        reply.extend_from_slice(b"\n99b\n");
        self.push_data(&mut reply, &stream.asked, stamp_ms, &ranges_mm);
        let whole = reply.len();
        let (model, situation) = (self.config.model, self.situation());
        let reply = self.faults.damage_scan(reply, || {
            [b"II\n00P\n".as_slice(), &texts::state(&model, &situation), b"\n"].concat()
        });
        let damaged = reply.len() != whole;
        self.send(reply);
        self.scan_end_us = self.wire.end_us();
        self.counts.scans_sent += 1;
        if self.truth.len() >= MAX_TRUTH {
            self.truth.pop_front();
        }
        let queued_us = self.now_us;
        self.truth.push_back(ScanTruth { start_us: scan.start_us, stamp_ms, queued_us, damaged });
        false
    }

    /// Stamp, data lines and the empty line.
    pub(super) fn push_data(
        &self,
        reply: &mut Vec<u8>,
        asked: &Measurement,
        stamp_ms: u32,
        ranges_mm: &[u32],
    ) {
        push_stamp(reply, stamp_ms);
        let mut asked = *asked;
        let steps = asked.last_step - asked.first_step + 1;
        if self.config.drop_incomplete_group && steps >= asked.cluster {
            asked.last_step -= steps % asked.cluster;
        }
        push_block(reply, &characters(&self.config.model, &asked, ranges_mm));
        reply.push(b'\n');
    }

    /// Echo, status and the empty line.
    pub(super) fn send_status(&mut self, echo: &[u8], status: &str) {
        let mut reply = echo.to_vec();
        reply.push(b'\n');
        reply.extend_from_slice(status.as_bytes());
        reply.push(checksum(status.as_bytes()));
        reply.extend_from_slice(b"\n\n");
        self.send(reply);
    }

    /// The status a fault drill (`DB`) puts in place of a scan.
    fn drill_status(&mut self, scans: u64, asked: u8) -> Option<&'static str> {
        let long = asked == 0 || u64::from(asked) > DRILL_AFTER;
        let since = scans.checked_sub(DRILL_AFTER + 1)?;
        match self.drill? {
            3 if long && since == DRILL_SCANS => {
                self.drill = None;
                Some("98")
            }
            3 | 4 if long && since < DRILL_SCANS => Some("21"),
            4 | 5 if long => {
                self.drill = Some(2);
                Some("50")
            }
            _ => None,
        }
    }
}
