//! The host's clock: µs since it was made, the time that the machine sleeps included.
//!
//! ```text
//!   std's Instant (CLOCK_MONOTONIC)  ────────┐ sleeps ┌────▶   modules' clocks would seem to jump
//!   this clock    (CLOCK_BOOTTIME)   ─────────────────────▶   as the modules' go on
//! ```
//!
//! Source: clock_gettime(2).

use rustix::time::{ClockId, clock_gettime};

/// A clock that begins at 0 and never goes back.
#[derive(Clone, Copy, Debug)]
pub struct HostClock {
    begun_us: u64,
}

impl HostClock {
    /// At 0 now.
    #[must_use]
    pub fn start() -> Self {
        Self { begun_us: boot_us() }
    }

    /// µs since the start.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        boot_us().saturating_sub(self.begun_us)
    }
}

/// Only Linux counts its sleep apart; on others the usual clock is what there is.
fn boot_us() -> u64 {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    let clock = ClockId::Boottime;
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    let clock = ClockId::Monotonic;
    let now = clock_gettime(clock);
    let (seconds, nanoseconds) = (u64::try_from(now.tv_sec), u64::try_from(now.tv_nsec));
    seconds.unwrap_or(0) * 1_000_000 + nanoseconds.unwrap_or(0) / 1000
}
