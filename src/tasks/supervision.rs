//! Supervision: the watchdog is fed only while the other task comes round, for what it says it waits for.
//!
//! ```text
//!   operation ──▶ pulse (what it waits for, since when) ──▶ supervision ──▶ watchdog
//! ```

use core::cell::Cell;

use crate::link::{Clock, Watchdog};

/// Between two looks at the pulse, µs.
const FEED_US: u64 = 500_000;

/// What the module waits for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Waiting {
    /// The next scan.
    Scans,
    /// The sensor: to be found, set up, brought back, or in a state in which it cannot be used.
    Sensor,
    /// The store.
    Storing,
    /// The restart.
    Restart,
}

impl Waiting {
    /// How long that may take without a sign of life, µs.
    const fn limit_us(self) -> u64 {
        match self {
            // The driver says that it is stalled after five scan intervals: 18 s with 1081 beams at 9600 baud.
            Self::Scans => 30_000_000,
            // Looked at twice a second.
            Self::Sensor => 5_000_000,
            // Ten records, each with a page of 256 KiB to be erased.
            Self::Storing => 40_000_000,
            Self::Restart => 5_000_000,
        }
    }
}

/// The last sign of life.
#[derive(Debug)]
pub struct Pulse {
    last: Cell<(Waiting, u64)>,
}

impl Pulse {
    /// Alive now, with the sensor still to be found.
    #[must_use]
    pub const fn new(now_us: u64) -> Self {
        Self { last: Cell::new((Waiting::Sensor, now_us)) }
    }

    /// A sign of life.
    pub fn beat(&self, waiting: Waiting, now_us: u64) {
        self.last.set((waiting, now_us));
    }

    /// Whether all is well.
    #[must_use]
    pub fn is_alive(&self, now_us: u64) -> bool {
        let (waiting, since_us) = self.last.get();
        now_us < since_us.saturating_add(waiting.limit_us())
    }
}

/// Feeds the watchdog, for ever.
///
/// # Cancellation
/// The watchdog is no longer fed.
pub(super) async fn run(mut watchdog: impl Watchdog, clock: &impl Clock, pulse: &Pulse) {
    loop {
        let now_us = clock.now_us();
        if pulse.is_alive(now_us) {
            watchdog.feed();
        }
        clock.wait_until(now_us.saturating_add(FEED_US)).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wait_has_its_limit() {
        let pulse = Pulse::new(1_000_000);
        assert!(pulse.is_alive(5_999_999));
        assert!(!pulse.is_alive(6_000_000));
        pulse.beat(Waiting::Storing, 6_000_000);
        assert!(pulse.is_alive(45_999_999));
        assert!(!pulse.is_alive(46_000_000));
    }
}
