//! The line to the sensor: its rate, the rates at which the sensor is looked for, and failures of the link.
//!
//! ```text
//!   search   rate 0 ─▶ rate 1 ─▶ … ─▶ last ─▶ pause 0.1, 0.2, 0.4, 0.8, 0.8 … s ─▶ rate 0
//!   faster   refused ─▶ 1 min ─▶ 2 min ─▶ … ─▶ 64 min      a refusal for good is never retried
//!   link     failure: read again at once ─▶ pauses of 4, 16, 64, 256, 500 ms
//! ```

use super::settings::Candidates;

/// The line settles after a change of its speed; drivers of other makers wait 150 ms.
pub const SETTLE_US: u64 = 100_000;

/// Longest pause after all rates were tried.
const ROUND_PAUSE_MAX_US: u64 = 800_000;

/// Until a change of speed that failed is tried again, twice as long each time, up to an hour.
const FASTER_US: u64 = 60_000_000;

/// Longest pause in reading after failures of the link.
const LINK_PAUSE_MAX_US: u64 = 500_000;

/// Failures of the link in a row after which a stream counts as stalled.
const LINK_FAILURES: u8 = 4;

/// The rate of the line, and when a faster one is worth another try.
#[derive(Clone, Debug)]
pub(super) struct LineRate {
    pub(super) baud: u32,
    /// The rate to hand to the link.
    pub(super) new_baud: Option<u32>,
    /// Rate at which the sensor answered last.
    pub(super) last_baud: Option<u32>,
    /// Changing the speed failed: not at this start.
    pub(super) keep_baud: bool,
    /// Starts in a row at which changing the speed failed.
    slow_starts: u8,
    faster_at_us: Option<u64>,
}

impl LineRate {
    pub(super) const fn new() -> Self {
        Self {
            baud: 0,
            new_baud: None,
            last_baud: None,
            keep_baud: false,
            slow_starts: 0,
            faster_at_us: None,
        }
    }

    /// The rate is right, or cannot be bettered: no other try is planned.
    pub(super) const fn cancel_retry(&mut self) {
        self.faster_at_us = None;
    }

    /// The faster rate works.
    pub(super) const fn confirm(&mut self) {
        self.last_baud = Some(self.baud);
        self.slow_starts = 0;
    }

    /// Plans another try of the faster rate.
    pub(super) fn retry_later(&mut self, now_us: u64) {
        let pause_us = FASTER_US << self.slow_starts.min(6);
        self.slow_starts = self.slow_starts.saturating_add(1);
        self.faster_at_us = Some(now_us.saturating_add(pause_us));
    }

    /// Whether the time has come to try the faster rate again.
    pub(super) fn retry_is_due(&self, now_us: u64) -> bool {
        self.faster_at_us.is_some_and(|at_us| now_us >= at_us)
    }
}

/// The rates at which the sensor is looked for, and the present one.
#[derive(Clone, Debug)]
pub(super) struct Search {
    pub(super) candidates: Candidates,
    pub(super) candidate: usize,
    pub(super) candidate_since_us: u64,
    /// Rounds through all rates since the sensor answered last.
    pub(super) rounds: u8,
}

impl Search {
    pub(super) const fn new() -> Self {
        Self { candidates: Candidates::new(), candidate: 0, candidate_since_us: 0, rounds: 0 }
    }

    /// The rate after the present one, by its place in the list; nothing after the last.
    pub(super) fn next(&self) -> Option<usize> {
        let next = self.candidate.saturating_add(1);
        (next < self.candidates.len()).then_some(next)
    }

    /// Counts a round in which no rate was answered; the pause before the next one.
    pub(super) fn end_round(&mut self) -> u64 {
        let pause_us = 100_000u64 << self.rounds.min(3);
        self.rounds = self.rounds.saturating_add(1);
        pause_us.min(ROUND_PAUSE_MAX_US)
    }
}

/// Failures of the link in a row, and the pause in reading that follows them.
#[derive(Clone, Debug)]
pub(super) struct LinkFailures {
    in_a_row: u8,
    pub(super) pause_until_us: u64,
}

impl LinkFailures {
    pub(super) const NONE: Self = Self { in_a_row: 0, pause_until_us: 0 };

    /// The link has delivered bytes. A pause that was begun still ends by itself.
    pub(super) const fn clear(&mut self) {
        self.in_a_row = 0;
    }

    /// Counts a failure; whether a running stream counts as stalled from now on.
    pub(super) fn push(&mut self, now_us: u64) -> bool {
        self.in_a_row = self.in_a_row.saturating_add(1);
        let pause_us = match self.in_a_row {
            1 => 0,
            again => 1000u64 << (2 * again.saturating_sub(1).min(8)),
        };
        self.pause_until_us = now_us.saturating_add(pause_us.min(LINK_PAUSE_MAX_US));
        self.in_a_row == LINK_FAILURES
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_link_is_read_again_at_once_then_after_growing_pauses() {
        let mut link = LinkFailures::NONE;
        let pauses_us: Vec<u64> = (0..7)
            .map(|_| {
                link.push(1000);
                link.pause_until_us - 1000
            })
            .collect();
        assert_eq!(pauses_us, [0, 4000, 16_000, 64_000, 256_000, 500_000, 500_000]);
        link.clear();
        let stalls: Vec<bool> = (0..6).map(|_| link.push(0)).collect();
        assert_eq!(stalls, [false, false, false, true, false, false]);
    }

    #[test]
    fn a_faster_rate_is_tried_again_after_twice_the_time() {
        let mut line = LineRate::new();
        line.retry_later(0);
        assert!(!line.retry_is_due(59_999_999) && line.retry_is_due(60_000_000));
        line.retry_later(0);
        assert!(!line.retry_is_due(119_999_999) && line.retry_is_due(120_000_000));
        (0..20).for_each(|_| line.retry_later(0));
        assert!(!line.retry_is_due(64 * 60_000_000 - 1) && line.retry_is_due(64 * 60_000_000));
        line.confirm();
        line.retry_later(0);
        assert!(line.retry_is_due(60_000_000));
        line.cancel_retry();
        assert!(!line.retry_is_due(u64::MAX));
    }

    #[test]
    fn every_rate_is_tried_before_a_pause() {
        let mut search = Search::new();
        search.candidates.extend([19_200, 115_200]);
        assert_eq!(search.next(), Some(1));
        search.candidate = 1;
        assert_eq!(search.next(), None);
        let pauses_us: Vec<u64> = (0..5).map(|_| search.end_round()).collect();
        assert_eq!(pauses_us, [100_000, 200_000, 400_000, 800_000, 800_000]);
    }
}
