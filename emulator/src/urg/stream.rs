//! The running measurement: one scan after another, each sent when its revolution is complete.
//!
//! ```text
//! MD0044072501000 LF        the request
//! MD0044072501000 LF 00P LF LF                      its answer, without data
//! MD0044072501000 LF 99b LF stamp data… LF          every scan; the last two digits count down
//! ```

use super::encode::{checksum, push_block, push_stamp};
use super::measurement::characters;
use super::mode::FAULTY;
use super::power::Power;
use super::request::{Measurement, split_string};
use super::{ScanTruth, Urg, texts};
use crate::source::{Revolution, SourceScan};
use std::collections::VecDeque;

/// Scans that may queue up while the sensor catches up after a stall.
const CATCH_UP_SCANS: u64 = 4;

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

/// The scans of the sensor: those it sends, and those it has sent.
#[derive(Debug, Default)]
pub(super) struct Output {
    pub(super) stream: Option<Stream>,
    /// A stall held scans back: they are sent one behind the other.
    catching_up: bool,
    /// When the last scan has left.
    scan_end_us: u64,
    pub(super) source_ended: bool,
    /// The scan that a stuck sensor repeats: its stamp and ranges.
    pub(super) frozen: Option<(u32, Vec<u32>)>,
    /// The scans sent, oldest first.
    pub(super) truth: VecDeque<ScanTruth>,
}

impl Output {
    /// Keeps the times of a scan, and of `kept` with it.
    fn push_truth(&mut self, scan: ScanTruth, kept: usize) {
        if self.truth.len() >= kept {
            self.truth.pop_front();
        }
        self.truth.push_back(scan);
    }

    /// Whether a line with a speed still carries an earlier scan, so that the one that started at `start_us` is
    /// lost. After a stall, some scans may wait.
    fn line_busy(&mut self, start_us: u64, period_us: u64, now_us: u64) -> bool {
        if self.scan_end_us <= now_us {
            self.catching_up = false;
        }
        let close = self.truth.back().is_some_and(|last| start_us < last.start_us + period_us / 2);
        if close || now_us > start_us + 2 * period_us {
            self.catching_up = true;
        }
        if self.scan_end_us <= now_us {
            return false;
        }
        let last_us = self.truth.back().map_or(0, |truth| truth.queued_us);
        let sending_us = self.scan_end_us.saturating_sub(last_us).max(1);
        let waiting = (self.scan_end_us - now_us) / sending_us;
        !self.catching_up || waiting >= CATCH_UP_SCANS
    }
}

impl Urg {
    /// Begins a measurement; its first scan is the next whole revolution.
    pub(super) fn start_measuring(&mut self, asked: Measurement, request: &[u8]) {
        self.mode.laser = true;
        let start_us = self.mirror.next_us(self.now_us.saturating_sub(1));
        let next = self.next_scan(start_us, self.now_us);
        self.output.stream = Some(Stream {
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
        self.output.stream = None;
        self.mode.laser = false;
        self.output.catching_up = false;
    }

    /// The sensor breaks: a running measurement ends with a status 0L, in SCIP 2.0 with 50.
    pub(super) fn break_down(&mut self) {
        let status = if self.config.model.reboots() {
            self.mode.abnormal = true;
            "0L"
        } else {
            self.mode.drill = Some(FAULTY);
            "50"
        };
        if let Some(stream) = &self.output.stream {
            let echo = stream.echo();
            self.send_status(&echo, status);
        }
        self.stop_measuring();
    }

    fn next_scan(&mut self, start_us: u64, earliest_us: u64) -> Option<SourceScan> {
        let revolution = Revolution { start_us, period_us: self.mirror.period_us(), earliest_us };
        let scan = self.source.scan(revolution);
        self.output.source_ended |= scan.is_none();
        scan
    }

    /// When the scan under way is sent.
    pub(super) fn scan_due_us(&self) -> Option<u64> {
        if self.supply.power != Power::On {
            return None;
        }
        let scan = self.output.stream.as_ref()?.next.as_ref()?;
        Some(self.faults.released_us(scan.ready_us))
    }

    /// The scan under way is complete: sends it, or not, and goes on to the next.
    pub(super) fn finish_scan(&mut self) {
        let Some(mut stream) = self.output.stream.take() else { return };
        let Some(scan) = stream.next.take() else { return };
        let half_turn_us = u64::from(self.mirror.period_us() / 2);
        stream.next = self.next_scan(self.mirror.next_us(scan.start_us + half_turn_us), scan.start_us);
        if stream.skip_left > 0 {
            stream.skip_left -= 1;
            self.output.stream = Some(stream);
            return;
        }
        stream.skip_left = stream.asked.skip;
        if self.port.reader_behind || self.line_busy(&scan) {
            self.counts.scans_dropped += 1;
            self.output.stream = Some(stream);
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
            self.output.stream = Some(stream);
        }
    }

    /// A line that still carries an earlier scan loses this one, unless it was held back by a stall.
    fn line_busy(&mut self, scan: &SourceScan) -> bool {
        if !self.config.paced {
            self.output.catching_up = false;
            return false;
        }
        self.output.line_busy(scan.start_us, u64::from(self.mirror.period_us()), self.now_us)
    }

    /// Sends one scan, or the status that takes its place; true if the measurement ends with it.
    fn send_scan(&mut self, stream: &Stream, scan: SourceScan) -> bool {
        let echo = stream.echo();
        if let Some(status) = self.mode.drill_status(stream.scans, stream.asked.scans) {
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
            (stamp_ms, ranges_mm) = self.output.frozen.get_or_insert((stamp_ms, ranges_mm)).clone();
        } else {
            self.output.frozen = None;
        }
        let mut reply = echo;
        reply.extend_from_slice(b"\n99b\n");
        self.push_data(&mut reply, &stream.asked, stamp_ms, &ranges_mm);
        let (model, situation) = (self.config.model, self.situation());
        let (reply, damaged) = self.faults.damage_scan(reply, || {
            [b"II\n00P\n".as_slice(), &texts::state(&model, &situation), b"\n"].concat()
        });
        self.send(reply);
        self.output.scan_end_us = self.port.transmitter.end_us();
        self.counts.scans_sent += 1;
        let queued_us = self.now_us;
        let truth = ScanTruth { start_us: scan.start_us, stamp_ms, queued_us, damaged };
        self.output.push_truth(truth, self.config.kept_scans);
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scan that started at 0 was queued at 100 ms and leaves until 300 ms: a line too slow for 10 Hz.
    fn slow_line() -> Output {
        let mut output = Output { scan_end_us: 300_000, ..Output::default() };
        let truth = ScanTruth { start_us: 0, stamp_ms: 0, queued_us: 100_000, damaged: false };
        output.push_truth(truth, 1);
        output
    }

    #[test]
    fn a_slow_line_loses_the_scans_between() {
        let mut output = slow_line();
        assert!(output.line_busy(100_000, 100_000, 200_000));
        assert!(!output.line_busy(200_000, 100_000, 300_000));
    }

    #[test]
    fn after_a_stall_four_scans_may_wait() {
        let mut output = slow_line();
        // A scan takes the line 200 ms. The next, complete at 200 ms, was held back until 301 ms.
        for waiting in 0..CATCH_UP_SCANS {
            output.scan_end_us = 301_000 + 1 + waiting * 200_000;
            output.truth[0].queued_us = output.scan_end_us.saturating_sub(200_000);
            assert!(!output.line_busy(100_000, 100_000, 301_000), "{waiting} scans wait");
        }
        output.scan_end_us = 301_000 + 1 + CATCH_UP_SCANS * 200_000;
        output.truth[0].queued_us = output.scan_end_us - 200_000;
        assert!(output.line_busy(100_000, 100_000, 301_000));
    }
}
