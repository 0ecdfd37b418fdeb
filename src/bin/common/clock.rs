//! The library's clock over embassy's.

use embassy_time::{Instant, Timer};
use kehai::link::Clock;

/// Time since boot, from the board's time driver.
#[derive(Clone, Copy)]
pub struct BoardClock;

impl Clock for BoardClock {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    async fn wait_until(&self, at_us: u64) {
        Timer::at(Instant::from_micros(at_us)).await;
    }
}
