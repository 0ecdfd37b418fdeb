//! embassy's time, from the two CMSDK timers: TIMER0 runs free, TIMER1 rings once.
//!
//! ```text
//! 0x00 CTRL    bit 0 run, bit 3 interrupt at zero
//! 0x04 VALUE   counts down at 25 MHz
//! 0x08 RELOAD  what follows zero
//! 0x0c INT     bit 0 pending; write 1 to clear
//! ```
//!
//! There is no tick: the CPU sleeps until the next alarm, or the wrap of TIMER0 every 171.8 s.
//!
//! Source: ARM DDI 0479 (Cortex-M System Design Kit), part 4.4 "APB timer"; addresses ARM DAI 0386.

use core::cell::{Cell, RefCell};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

use super::interrupts::{self, Interrupt};
use super::mmio::{Register, device};
use super::uptime::{COUNTS_PER_US, FIRST, Uptime};

#[repr(C)]
struct Timer {
    control: Register,
    value: Register,
    reload: Register,
    interrupt: Register,
}

const RUN_AND_INTERRUPT: u32 = 1 << 0 | 1 << 3;
const STOP: u32 = 0;
const CLEAR: u32 = 1;

/// An alarm farther away than this rings early, finds nothing to do and is set again.
const FARTHEST_ALARM_US: u64 = 100_000_000;

fn clock() -> &'static Timer {
    // SAFETY: TIMER0 of the board.
    unsafe { device(0x4000_0000) }
}

fn alarm() -> &'static Timer {
    // SAFETY: TIMER1 of the board.
    unsafe { device(0x4000_1000) }
}

struct TimeDriver {
    uptime: Mutex<Cell<Uptime>>,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: TimeDriver = TimeDriver {
    uptime: Mutex::new(Cell::new(Uptime::new())),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

// An alarm is a number of microseconds.
const _: () = assert!(embassy_time_driver::TICK_HZ == 1_000_000);

impl TimeDriver {
    fn now_us(&self, section: CriticalSection<'_>) -> u64 {
        let cell = self.uptime.borrow(section);
        let mut uptime = cell.get();
        let now_us = uptime.advance(clock().value.read());
        cell.set(uptime);
        now_us
    }

    /// Wakes the tasks that are due and sets the alarm for the next one.
    fn ring(&self, section: CriticalSection<'_>, queue: &mut Queue) {
        let now_us = self.now_us(section);
        let at_us = queue.next_expiration(now_us);
        let wait_us = at_us.saturating_sub(now_us).clamp(1, FARTHEST_ALARM_US);
        let counts = wait_us as u32 * COUNTS_PER_US;
        alarm().control.write(STOP);
        alarm().interrupt.write(CLEAR);
        alarm().reload.write(counts);
        alarm().value.write(counts);
        alarm().control.write(RUN_AND_INTERRUPT);
    }
}

impl Driver for TimeDriver {
    fn now(&self) -> u64 {
        critical_section::with(|section| self.now_us(section))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|section| {
            let mut queue = self.queue.borrow_ref_mut(section);
            if queue.schedule_wake(at, waker) {
                self.ring(section, &mut queue);
            }
        });
    }
}

/// Microseconds since the reset.
pub fn now_us() -> u64 {
    DRIVER.now()
}

/// The counter of TIMER0, 25 MHz: its low bits differ from start to start.
pub fn counter() -> u32 {
    clock().value.read()
}

/// Starts time at zero. To be called once, before anything waits.
pub fn start() {
    clock().reload.write(u32::MAX);
    clock().value.write(FIRST);
    clock().control.write(RUN_AND_INTERRUPT);
    interrupts::enable(Interrupt::Timer0);
    interrupts::enable(Interrupt::Timer1);
}

/// TIMER0 has wrapped: reads it, so that no period goes by unread.
pub extern "C" fn on_wrap() {
    clock().interrupt.write(CLEAR);
    DRIVER.now();
}

/// TIMER1 has rung.
pub extern "C" fn on_alarm() {
    alarm().control.write(STOP);
    alarm().interrupt.write(CLEAR);
    critical_section::with(|section| DRIVER.ring(section, &mut DRIVER.queue.borrow_ref_mut(section)));
}
