//! The sensor's clock: 24 bits of milliseconds, not quite as fast as the world's, and the mirror it drives.
//!
//! ```text
//! stamp = (start + (world − origin) · rate) mod 2^24 ms          wraps after 4 h 39 m 37.216 s
//! ```
//!
//! Recordings show sensors about 0.3 % fast against the host: a nominal revolution of 100 ms takes
//! 99.63–99.74 ms.

/// The counter has 24 bits.
pub(crate) const STAMP_MASK: u64 = 0x00ff_ffff;

/// Millionths by which the sensor's clock runs fast unless told otherwise: revolutions of 99.7 ms.
pub(crate) const FAST_PPM: i32 = 3000;

const MILLION: i64 = 1_000_000;

/// A sensor's millisecond counter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct SensorClock {
    origin_us: u64,
    start_ms: u64,
    fast_ppm: i32,
}

impl SensorClock {
    /// Shows `start_ms` at `now_us` and then runs `fast_ppm` millionths fast.
    #[must_use]
    pub(crate) fn new(now_us: u64, start_ms: u32, fast_ppm: i32) -> Self {
        Self { origin_us: now_us, start_ms: u64::from(start_ms), fast_ppm }
    }

    /// The counter at a moment of the world; moments before the clock's origin count backwards.
    #[must_use]
    pub(crate) fn stamp_ms(&self, at_us: u64) -> u32 {
        let world_us = at_us.cast_signed() - self.origin_us.cast_signed();
        let rate = i128::from(MILLION + i64::from(self.fast_ppm));
        let sensor_us = (i128::from(world_us) * rate).div_euclid(i128::from(MILLION)) as i64;
        let stamp_ms = self.start_ms.cast_signed() + sensor_us.div_euclid(1000);
        (stamp_ms.cast_unsigned() & STAMP_MASK) as u32
    }

    /// Sets the counter to 0.
    pub(crate) fn reset(&mut self, now_us: u64) {
        self.origin_us = now_us;
        self.start_ms = 0;
    }
}

/// The turning mirror: when step 0 passes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Mirror {
    origin_us: u64,
    period_ns: u64,
}

impl Mirror {
    /// Step 0 passes at `now_us`; a revolution takes `nominal_us` by a clock that runs `fast_ppm` fast.
    #[must_use]
    pub(crate) fn new(now_us: u64, nominal_us: u32, fast_ppm: i32) -> Self {
        let rate = (MILLION + i64::from(fast_ppm)).max(1).cast_unsigned();
        Self { origin_us: now_us, period_ns: (u64::from(nominal_us) * 1_000_000_000 / rate).max(1000) }
    }

    /// True time of a revolution.
    #[must_use]
    pub(crate) fn period_us(&self) -> u32 {
        u32::try_from((self.period_ns + 500) / 1000).unwrap_or(u32::MAX)
    }

    fn revolution_us(&self, number: u64) -> u64 {
        self.origin_us + (u128::from(number) * u128::from(self.period_ns) / 1000) as u64
    }

    fn number(&self, at_us: u64) -> u64 {
        (u128::from(at_us.saturating_sub(self.origin_us)) * 1000 / u128::from(self.period_ns)) as u64
    }

    /// The first time after `at_us` at which step 0 passes.
    #[must_use]
    pub(crate) fn next_us(&self, at_us: u64) -> u64 {
        // Microseconds are rounded down, so the division may name the revolution before.
        let number = self.number(at_us);
        let next_us = self.revolution_us(number + 1);
        if next_us > at_us { next_us } else { self.revolution_us(number + 2) }
    }

    /// Start of the last revolution that was complete at `at_us`.
    #[must_use]
    pub(crate) fn complete_us(&self, at_us: u64) -> u64 {
        self.revolution_us(self.number(at_us + 1).saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_clock_gains_three_milliseconds_a_second() {
        let clock = SensorClock::new(5_000_000, 100, 3000);
        assert_eq!(clock.stamp_ms(5_000_000), 100);
        assert_eq!(clock.stamp_ms(15_000_000), 10_130);
    }

    #[test]
    fn the_stamp_wraps_at_24_bits() {
        let mut clock = SensorClock::new(0, 0xff_ffff, 0);
        assert_eq!(clock.stamp_ms(999), 0xff_ffff);
        assert_eq!(clock.stamp_ms(1000), 0);
        clock.reset(2_000_000);
        assert_eq!(clock.stamp_ms(2_005_999), 5);
        assert_eq!(clock.stamp_ms(1_999_999), 0xff_ffff);
    }

    #[test]
    fn a_nominal_revolution_of_100_ms_takes_99_7() {
        let mirror = Mirror::new(0, 100_000, FAST_PPM);
        assert_eq!(mirror.period_us(), 99_701);
        assert_eq!(mirror.next_us(0), 99_700);
        assert_eq!(mirror.next_us(99_699), 99_700);
        assert_eq!(mirror.next_us(99_700), 199_401);
        assert_eq!(mirror.complete_us(199_401), 99_700);
        assert_eq!(mirror.complete_us(199_500), 99_700);
    }
}
