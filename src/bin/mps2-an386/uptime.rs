//! Microseconds since boot from a 32-bit counter that counts down at 25 MHz and wraps.
//!
//! ```text
//! counter  FIRST ╲        ╱╲
//!                 ╲      ╱  ╲   reload to 2³² − 1
//!                  ╲____╱    ╲  every 171.8 s
//!          power-up  1 s
//! ```
//!
//! The difference of two readings, modulo 2³², is the time between them as long as that is below
//! one period; so [`Uptime::advance`] must run at least once per period, which the interrupt at the
//! wrap sees to. The first wrap comes one second after power-up: every run goes through it.

/// Counts of the timer in a microsecond: it runs at 25 MHz (ARM DAI 0386, SYSCLK).
pub const COUNTS_PER_US: u32 = 25;

/// Where the counter begins: one second before its first wrap.
pub const FIRST: u32 = COUNTS_PER_US * 1_000_000;

/// The time so far, and the reading it was computed from.
#[derive(Clone, Copy)]
pub struct Uptime {
    us: u64,
    /// Counts that do not make up a microsecond yet, 0 to 24.
    rest: u32,
    reading: u32,
}

impl Uptime {
    /// Zero, with the counter at [`FIRST`].
    pub const fn new() -> Self {
        Self { us: 0, rest: 0, reading: FIRST }
    }

    /// Microseconds since boot at this `reading` of the counter.
    pub fn advance(&mut self, reading: u32) -> u64 {
        let counts = self.reading.wrapping_sub(reading);
        self.reading = reading;
        let rest = self.rest + counts % COUNTS_PER_US;
        self.us += u64::from(counts / COUNTS_PER_US + rest / COUNTS_PER_US);
        self.rest = rest % COUNTS_PER_US;
        self.us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_wrap_passes_unnoticed() {
        let mut uptime = Uptime::new();
        assert_eq!(uptime.advance(FIRST), 0);
        assert_eq!(uptime.advance(1), 999_999);
        assert_eq!(uptime.advance(0), 1_000_000);
        assert_eq!(uptime.advance(u32::MAX), 1_000_000);
        assert_eq!(uptime.advance(u32::MAX - 24), 1_000_001);
    }

    #[test]
    fn a_year_of_odd_steps_loses_no_count() {
        let mut uptime = Uptime::new();
        let (mut counts, mut reading) = (0u64, FIRST);
        for turn in 0..200_000u32 {
            let step = 4_000_000_007 - turn % 1000;
            counts += u64::from(step);
            reading = reading.wrapping_sub(step);
            assert_eq!(uptime.advance(reading), counts / u64::from(COUNTS_PER_US));
        }
        assert!(counts / 25_000_000 > 365 * 24 * 3600);
    }

    #[test]
    fn two_equal_readings_are_the_same_instant() {
        let mut uptime = Uptime::new();
        assert_eq!(uptime.advance(7), uptime.advance(7));
    }
}
