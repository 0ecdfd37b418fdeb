//! Instructions, by TIMER0: it runs at 25 MHz, and under `-icount shift=10` one takes 1024 ns.

use core::hint::black_box;

use super::mmio::{Register, device};

#[repr(C)]
struct Timer {
    control: Register,
    value: Register,
    reload: Register,
}

const RUN: u32 = 1 << 0;

/// Nanoseconds of one count, and of one instruction.
const COUNT_NS: u64 = 40;
const INSTRUCTION_NS: u64 = 1024;

fn timer0() -> &'static Timer {
    // SAFETY: TIMER0 of the board.
    unsafe { device(0x4000_0000) }
}

/// Starts the timer: it counts down from the largest number, again and again.
pub fn start() {
    timer0().reload.write(u32::MAX);
    timer0().value.write(u32::MAX);
    timer0().control.write(RUN);
}

/// Counts the instructions of a piece of work.
pub struct Counter {
    /// Cost of an empty measurement.
    own: u32,
}

impl Counter {
    /// A counter that knows its own cost.
    pub fn new() -> Self {
        let (own, ()) = Self { own: 0 }.count(|| ());
        Self { own }
    }

    /// Instructions of `work`, and its result.
    #[inline(always)]
    pub fn count<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let begin = timer0().value.read();
        let result = black_box(work());
        let end = timer0().value.read();
        let passed_ns = u64::from(begin.wrapping_sub(end)) * COUNT_NS;
        // Counts are whole, instructions are 25.6 of them: to the nearest.
        let instructions = (passed_ns + INSTRUCTION_NS / 2) / INSTRUCTION_NS;
        ((instructions as u32).saturating_sub(self.own), result)
    }
}
