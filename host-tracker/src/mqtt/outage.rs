//! Which failures to reach the broker are logged.
//!
//! ```text
//!   failure  1 ─▶ warning    2, 4, 8 … ─▶ news    3, 5, 6, 7 … ─▶ nothing    connected ─▶ news, if any was logged
//! ```
//!
//! A broker that comes and goes is a warning once in a while.

use std::time::Instant;

use tracing::Level;

use crate::log_limit::LogLimit;

/// What the log says of failures to reach the broker.
#[derive(Debug, Default)]
pub(super) struct Outage {
    /// Since the last connection.
    failures: u64,
    is_logged: bool,
    limit: LogLimit,
}

impl Outage {
    /// One more failure: how grave it is, if it is to be logged.
    pub(super) fn failed(&mut self, now: Instant) -> Option<Level> {
        self.failures += 1;
        let level = match self.failures {
            1 => self.limit.note(now).map(|_| Level::WARN),
            again => again.is_power_of_two().then_some(Level::INFO),
        };
        self.is_logged |= level.is_some();
        level
    }

    /// Ends, as the broker has taken the connection: whether that is to be logged.
    pub(super) fn end(&mut self) -> bool {
        self.failures = 0;
        std::mem::take(&mut self.is_logged)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_broker_that_is_away_is_a_warning_once_then_news_more_and_more_rarely() {
        let (mut outage, now) = (Outage::default(), Instant::now());
        assert!(!outage.end(), "the first connection of all is no news");
        let levels: Vec<Option<Level>> = (0..8).map(|_| outage.failed(now)).collect();
        let info = Some(Level::INFO);
        assert_eq!(levels, [Some(Level::WARN), info, None, info, None, None, None, info]);
        assert!(outage.end());
        for _ in 0..100 {
            assert!(outage.failed(now).is_none() && !outage.end(), "one that comes and goes");
        }
        assert_eq!(outage.failed(now + Duration::from_secs(10)), Some(Level::WARN));
    }
}
