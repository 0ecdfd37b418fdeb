//! A module's own clock: it starts with the module and runs a little fast or slow.
//!
//! ```text
//!   module_us = (world − start) · (1 + drift)
//! ```

use kehai::link::Clock;

use kehai_emulator::simulated_time::SimulatedClock;

const MILLION: i128 = 1_000_000;

/// The clock of a module that was switched on at `start_us` of the world.
#[derive(Clone, Debug)]
pub struct ModuleClock {
    world: SimulatedClock,
    start_us: u64,
    fast_ppm: i32,
}

impl ModuleClock {
    /// Shows 0 at `start_us` of the world and runs `fast_ppm` millionths fast.
    #[must_use]
    pub fn new(world: &SimulatedClock, start_us: u64, fast_ppm: i32) -> Self {
        Self { world: world.clone(), start_us, fast_ppm }
    }

    /// Its reading at `world_us`.
    #[must_use]
    pub fn shows_us(&self, world_us: u64) -> u64 {
        let passed_us = i128::from(world_us.saturating_sub(self.start_us));
        (passed_us * (MILLION + i128::from(self.fast_ppm)) / MILLION) as u64
    }

    /// The first moment of the world at which it shows `at_us`.
    fn world_us(&self, at_us: u64) -> u64 {
        let rate = (MILLION + i128::from(self.fast_ppm)).max(1);
        let passed_us = (i128::from(at_us) * MILLION + rate - 1) / rate;
        u64::try_from(passed_us).unwrap_or(u64::MAX).saturating_add(self.start_us)
    }
}

impl Clock for ModuleClock {
    fn now_us(&self) -> u64 {
        self.shows_us(self.world.now_us())
    }

    async fn wait_until(&self, at_us: u64) {
        self.world.wait_until(self.world_us(at_us)).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_ends_at_the_first_moment_that_shows_the_time() {
        for fast_ppm in [-200, -1, 0, 7, 200] {
            let clock = ModuleClock::new(&SimulatedClock::new(), 123_456, fast_ppm);
            for at_us in [0, 1, 999_999, 1_000_000, 3_600_000_017, 86_400_000_000] {
                let world_us = clock.world_us(at_us);
                assert!(clock.shows_us(world_us) >= at_us, "{fast_ppm} {at_us}");
                assert!(at_us == 0 || clock.shows_us(world_us - 1) < at_us, "{fast_ppm} {at_us}");
            }
        }
    }

    #[test]
    fn a_fast_clock_gains() {
        let clock = ModuleClock::new(&SimulatedClock::new(), 0, 200);
        assert_eq!(clock.shows_us(10_000_000), 10_002_000);
    }
}
