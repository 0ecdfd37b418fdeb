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

#[cfg(test)]
mod tests {
    use super::*;

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
