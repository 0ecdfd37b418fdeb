//! The board's interrupts: their numbers, and how they are let through. The table of their handlers is in `vectors`.
//!
//! Source: ARM DAI 0386, table of interrupts; Ethernet as QEMU wires it (hw/arm/mps2.c).

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

/// External interrupts of the Cortex-M that this image uses.
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Interrupt {
    Uart0Receive = 0,
    Uart0Transmit = 1,
    Timer0 = 8,
    Timer1 = 9,
    DualTimer = 10,
    Ethernet = 13,
}

// SAFETY: the numbers are those of the board and below 32, and stay what they are.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Lets `interrupt` through. Its device must be set up.
pub fn enable(interrupt: Interrupt) {
    // SAFETY: every handler in the table is ready from the start, and no code relies on a masked
    // interrupt for exclusion (critical sections do that).
    unsafe { NVIC::unmask(interrupt) }
}
