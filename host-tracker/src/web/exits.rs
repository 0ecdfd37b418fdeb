//! Ways out that were asked for by nobody who is known: they are taken, and said in the log now and then.
//!
//! ```text
//!   exit, no token ─▶ taken ─▶ the first at once ─ 10 s ─▶ "12 more" ─ 10 s ─▶ …
//! ```

use std::time::{Duration, Instant};

/// Between two lines of the log: a flood of requests must not fill it.
const BETWEEN: Duration = Duration::from_secs(10);

/// Those that the log has not said yet.
#[derive(Debug, Default)]
pub struct Exits {
    said: Option<Instant>,
    unsaid: u64,
}

impl Exits {
    /// One more: how many are to be said now, if it is time.
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
        let (mut exits, now) = (Exits::default(), Instant::now());
        assert_eq!(exits.note(now), Some(1));
        for _ in 0..1000 {
            assert_eq!(exits.note(now + BETWEEN / 2), None);
        }
        assert_eq!(exits.note(now + BETWEEN), Some(1001));
    }
}
