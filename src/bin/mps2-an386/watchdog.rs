//! The CMSDK watchdog: not fed for [`PERIOD_S`], it raises the NMI; after as long again, it resets
//! the board.
//!
//! ```text
//! 0x000 LOAD  0x004 VALUE  0x008 CTRL (bit 0 count and NMI, bit 1 reset)  0x00c INTCLR  0xc00 LOCK
//! ```
//!
//! Source: ARM DDI 0479 (Cortex-M System Design Kit), part 4.6 "APB watchdog"; address ARM DAI 0386.

use super::mmio::{Register, device};

#[repr(C)]
struct Registers {
    load: Register,
    _value: Register,
    control: Register,
    interrupt_clear: Register,
    _status: [u32; 0x2fc],
    lock: Register,
}

const _: () = assert!(core::mem::offset_of!(Registers, lock) == 0xc00);

const UNLOCK: u32 = 0x1acc_e551;
const COUNT_AND_RESET: u32 = 1 << 0 | 1 << 1;
const CLOCK_HZ: u32 = 25_000_000;

/// The reset comes after twice this; the supervision feeds every second.
const PERIOD_S: u32 = 2;

fn registers() -> &'static Registers {
    // SAFETY: the watchdog of the board.
    unsafe { device(0x4000_8000) }
}

/// The running watchdog.
pub struct Watchdog {
    _only_one: (),
}

impl Watchdog {
    /// Starts it. To be called once; nothing stops it again.
    pub fn start() -> Self {
        registers().lock.write(UNLOCK);
        registers().load.write(PERIOD_S * CLOCK_HZ);
        registers().control.write(COUNT_AND_RESET);
        Self { _only_one: () }
    }

    /// Starts its period anew.
    pub fn feed(&mut self) {
        registers().interrupt_clear.write(1);
    }
}
