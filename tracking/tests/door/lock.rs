//! A lock as docs/door.md describes it: it makes a number twice a second, and opens only by an order with one of its two
//! newest, for as long as that order says, counted from when the number was made.

use kehai_tracking::door::{Lock, LockOrder};

/// Between two numbers, s.
pub const READY_S: f64 = 0.5;

/// The lock's own state.
#[derive(Default)]
pub struct LockDevice {
    /// The numbers that are good, and when they were made, s.
    numbers: [(u64, f64); 2],
    made: u64,
    next_s: f64,
    open_until_s: f64,
    lock: Lock,
}

impl LockDevice {
    /// The number that it says now, if it is time.
    pub fn ready(&mut self, now_s: f64) -> Option<u64> {
        if now_s < self.next_s {
            return None;
        }
        self.next_s = now_s + READY_S;
        // Any sort that does not come again soon; here a count, scattered.
        self.made += 1;
        let number = self.made.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 12;
        self.numbers = [self.numbers[1], (number, now_s)];
        Some(number)
    }

    /// An order came.
    pub fn hear(&mut self, order: LockOrder) {
        let Some(nonce) = order.nonce else { return };
        let Some((_, made_s)) = self.numbers.into_iter().find(|(number, _)| *number == nonce.0) else {
            return;
        };
        self.lock = order.lock;
        self.open_until_s = made_s + f64::from(order.for_ms.unwrap_or(0)) * 1e-3;
    }

    /// What it is.
    pub fn state(&self, now_s: f64) -> Lock {
        if now_s < self.open_until_s { self.lock } else { Lock::Locked }
    }

    /// Its power was cut: it has another count, and is locked.
    pub fn restart(&mut self) {
        *self = Self { made: self.made + 1000, next_s: self.next_s, ..Self::default() };
    }
}
