//! Scans that were taken and that arrived, a sample a second, for rates and losses.
//!
//! ```text
//!   sample   at        taken    arrived   damaged
//!            now−60 s   1200      1190       2          ╮ lost = 1 − arrived / taken
//!            …                                          │
//!            now−10 s   1700      1688       2   ╮ rate │
//!            now        1800      1787       3   ╯      ╯
//! ```

use std::collections::VecDeque;

use kehai::wire::{Counter, Counters, ReportHead};

use crate::session::sequence::Arrival;

/// Between two samples, µs.
const SAMPLE_US: u64 = 1_000_000;

/// Over which rates are taken, µs.
pub const RATE_US: u64 = 10_000_000;

/// Over which losses are taken, µs.
pub const LOSS_US: u64 = 60_000_000;

/// What was counted up to a time.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    at_us: u64,
    /// Scans the module took, lost ones included.
    taken: u64,
    /// Reports that arrived, each counted once.
    arrived: u64,
    /// Checksum errors on the sensor's line.
    checksum: u64,
    /// Scans that arrived damaged from the sensor, whatever was wrong with them.
    damaged: u64,
}

/// What was counted since the module's start.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    lost_scans: Option<u32>,
    now: Sample,
    samples: VecDeque<Sample>,
}

impl Statistics {
    /// A report came.
    pub fn report(&mut self, head: &ReportHead, arrival: Arrival) {
        match arrival {
            Arrival::Ahead(ahead) => {
                let before = self.lost_scans.replace(head.lost_scans).unwrap_or(head.lost_scans);
                let lost = head.lost_scans.saturating_sub(before);
                self.now.taken += u64::from(ahead) + u64::from(lost);
                self.now.arrived += 1;
            }
            Arrival::Late => self.now.arrived += 1,
            Arrival::Repeated | Arrival::Far => {}
        }
    }

    /// Health came.
    pub fn counters(&mut self, counters: &Counters) {
        self.now.checksum = counters.get(Counter::SensorChecksum).into();
        self.now.damaged = counters.get(Counter::ScansDamaged).into();
    }

    /// Takes a sample, if it is time to.
    pub fn poll(&mut self, now_us: u64) {
        self.now.at_us = now_us;
        if self.samples.back().is_none_or(|last| now_us >= last.at_us + SAMPLE_US) {
            self.samples.push_back(self.now);
        }
        // The oldest that is kept is as old as it has to be.
        while self.samples.get(1).is_some_and(|second| now_us.saturating_sub(second.at_us) >= LOSS_US) {
            self.samples.pop_front();
        }
    }

    /// The newest sample that is at least this old, or else the oldest.
    fn before(&self, age_us: u64) -> Sample {
        let old = |sample: &&Sample| self.now.at_us.saturating_sub(sample.at_us) >= age_us;
        self.samples.iter().rev().find(old).or_else(|| self.samples.front()).copied().unwrap_or(self.now)
    }

    /// For how long there have been samples, µs, up to [`LOSS_US`].
    pub fn span_us(&self) -> u64 {
        self.now.at_us.saturating_sub(self.before(LOSS_US).at_us)
    }

    /// Per second over the last ten: scans taken and reported, and reports that arrived.
    pub fn rates_hz(&self) -> (f64, f64) {
        let before = self.before(RATE_US);
        let seconds = self.now.at_us.saturating_sub(before.at_us) as f64 * 1e-6;
        if seconds <= 0.0 {
            return (0.0, 0.0);
        }
        let (taken, arrived) = (self.now.taken - before.taken, self.now.arrived - before.arrived);
        (taken as f64 / seconds, arrived as f64 / seconds)
    }

    /// Share of the last minute's scans that did not arrive; none if none was taken.
    pub fn lost_share(&self) -> Option<f64> {
        let before = self.before(LOSS_US);
        let (taken, arrived) = (self.now.taken - before.taken, self.now.arrived - before.arrived);
        (taken > 0).then(|| taken.saturating_sub(arrived) as f64 / taken as f64)
    }

    /// Checksum errors since the module's start.
    pub const fn checksum_errors(&self) -> u64 {
        self.now.checksum
    }

    /// Share of the last minute's scans that arrived damaged from the sensor. Replies that are no scans have checksums, too, and a
    /// scan that has lost bytes may have no line with a wrong one.
    pub fn damaged_share(&self) -> f64 {
        let before = self.before(LOSS_US);
        let damaged = self.now.damaged.saturating_sub(before.damaged);
        damaged as f64 / (self.now.taken - before.taken).max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::sequence::Sequences;

    /// 20 Hz for `seconds`, of which the reports `arrives` likes arrive.
    fn after(seconds: u32, lost_scans: impl Fn(u32) -> u32, arrives: impl Fn(u32) -> bool) -> Statistics {
        let (mut statistics, mut sequences) = (Statistics::default(), Sequences::default());
        for sequence in 1..=20 * seconds {
            if arrives(sequence) {
                let lost_scans = lost_scans(sequence);
                let head = ReportHead { sequence, lost_scans, ..ReportHead::default() };
                statistics.report(&head, sequences.record(sequence, false));
            }
            statistics.poll(u64::from(sequence) * 50_000);
        }
        statistics
    }

    #[test]
    fn rates_and_losses_are_those_of_the_last_seconds() {
        let statistics = after(100, |_| 7, |_| true);
        assert_eq!(statistics.rates_hz(), (20.0, 20.0));
        assert_eq!(statistics.lost_share(), Some(0.0));
        // The first half minute of losses is long ago.
        let statistics = after(100, |_| 0, |sequence| sequence > 600 || sequence % 2 == 0);
        assert_eq!(statistics.lost_share(), Some(0.0));
    }

    #[test]
    fn what_the_network_loses_is_no_lower_rate_but_a_loss() {
        let statistics = after(100, |_| 0, |sequence| sequence % 4 != 0);
        let (taken_hz, arrived_hz) = statistics.rates_hz();
        assert!((taken_hz - 20.0).abs() < 0.2 && (arrived_hz - 15.0).abs() < 0.2, "{taken_hz} {arrived_hz}");
        let lost = statistics.lost_share().unwrap();
        assert!((lost - 0.25).abs() < 0.01, "{lost}");
    }

    #[test]
    fn what_the_module_itself_has_lost_is_lost_too() {
        let statistics = after(100, |sequence| sequence / 10, |_| true);
        let lost = statistics.lost_share().unwrap();
        assert!((lost - 1.0 / 11.0).abs() < 0.01, "{lost}");
    }

    #[test]
    fn a_report_that_comes_twice_makes_up_for_none() {
        let (mut statistics, mut sequences) = (Statistics::default(), Sequences::default());
        for sequence in 1..=200 {
            if sequence % 2 == 0 {
                let head = ReportHead { sequence, ..ReportHead::default() };
                statistics.report(&head, sequences.record(sequence, false));
                statistics.report(&head, sequences.record(sequence, false));
            }
            statistics.poll(u64::from(sequence) * 50_000);
        }
        let lost = statistics.lost_share().unwrap();
        assert!((lost - 0.5).abs() < 0.02, "{lost}");
    }

    #[test]
    fn with_nothing_coming_the_rate_falls_to_nothing() {
        let mut statistics = after(20, |_| 0, |_| true);
        for second in 21..=90 {
            statistics.poll(second * 1_000_000);
            if second == 40 {
                assert_eq!((statistics.rates_hz(), statistics.lost_share()), ((0.0, 0.0), Some(0.0)));
            }
        }
        assert_eq!(statistics.lost_share(), None, "a minute without a scan");
        assert_eq!(Statistics::default().rates_hz(), (0.0, 0.0));
        assert_eq!(Statistics::default().lost_share(), None);
    }
}
