//! The watchdog's first time-out, as an image hears of it: this board does not record the cause of a reset, so a note is
//! left in memory that a reset spares.

use core::mem::MaybeUninit;

use cortex_m_rt::exception;

use super::log;
use super::mmio::{Register, device};

/// Value of the note; the memory of a board just switched on never holds it.
const BITTEN: u32 = 0x5761_7463;

/// Register of the note.
fn note() -> &'static Register {
    #[unsafe(link_section = ".uninit.watchdog")]
    static mut NOTE: MaybeUninit<u32> = MaybeUninit::uninit();
    // SAFETY: a word of memory that nothing else names, and that is only read and written as a register is.
    unsafe { device((&raw const NOTE).expose_provenance()) }
}

/// Whether the watchdog caused this start. True once.
pub fn caused_reset() -> bool {
    let bitten = note().read() == BITTEN;
    note().write(0);
    bitten
}

/// First time-out: logs it, and waits for the second one.
#[exception]
unsafe fn NonMaskableInt() {
    note().write(BITTEN);
    if log::is_free() {
        defmt::error!("watchdog: a task hangs");
    }
    loop {
        cortex_m::asm::nop();
    }
}
