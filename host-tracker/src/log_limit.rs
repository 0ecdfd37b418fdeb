//! Lines of the log that a flood of messages must not multiply.
//!
//! ```text
//!   message ─▶ the first is logged at once ─ 10 s ─▶ "12 since the last line" ─ 10 s ─▶ …
//! ```

use std::time::{Duration, Instant};

/// Between two lines of the log: a flood of messages must not fill it.
const BETWEEN: Duration = Duration::from_secs(10);

/// What the log has not said yet of one kind of message.
#[derive(Debug, Default)]
pub struct LogLimit {
    said: Option<Instant>,
    unsaid: u64,
}

impl LogLimit {
    /// One more: how many are to be logged now, if it is time.
    pub fn note(&mut self, now: Instant) -> Option<u64> {
        self.unsaid += 1;
        if self.said.is_some_and(|said| now.duration_since(said) < BETWEEN) {
            return None;
        }
        self.said = Some(now);
        Some(std::mem::take(&mut self.unsaid))
    }
}

/// Counts that only grow, such as those of losses: logged once in a while, and none is left out for good.
#[derive(Debug)]
pub struct CountLog<const LEN: usize> {
    told: [u64; LEN],
    said: Option<Instant>,
}

impl<const LEN: usize> Default for CountLog<LEN> {
    fn default() -> Self {
        Self { told: [0; LEN], said: None }
    }
}

impl<const LEN: usize> CountLog<LEN> {
    /// Whether these counts are to be logged now: they have grown, and it is time.
    pub fn is_due(&mut self, counts: [u64; LEN], now: Instant) -> bool {
        let is_time = self.said.is_none_or(|said| now.duration_since(said) >= BETWEEN);
        if counts == self.told || !is_time {
            return false;
        }
        (self.told, self.said) = (counts, Some(now));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_said_once_in_a_while_and_in_the_end_all_of_them() {
        let (mut log, now) = (CountLog::default(), Instant::now());
        assert!(!log.is_due([0, 0], now));
        assert!(log.is_due([100, 0], now));
        assert!(!log.is_due([200, 1], now + BETWEEN / 2));
        assert!(log.is_due([200, 1], now + BETWEEN));
        assert!(!log.is_due([200, 1], now + 3 * BETWEEN), "nothing was lost since");
        assert!(log.is_due([200, 2], now + 4 * BETWEEN));
    }

    #[test]
    fn the_first_is_said_at_once_and_a_flood_once_in_a_while() {
        let (mut limit, now) = (LogLimit::default(), Instant::now());
        assert_eq!(limit.note(now), Some(1));
        for _ in 0..1000 {
            assert_eq!(limit.note(now + BETWEEN / 2), None);
        }
        assert_eq!(limit.note(now + BETWEEN), Some(1001));
    }
}
