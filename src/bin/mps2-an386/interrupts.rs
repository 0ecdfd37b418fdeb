//! The board's interrupts: their numbers, and the table that leads to their handlers.
//!
//! Source: ARM DAI 0386, table of interrupts; Ethernet as QEMU wires it (hw/arm/mps2.c).

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;

use super::{lan9118, time_driver, uart};

/// External interrupts of the Cortex-M that this image uses.
#[derive(Clone, Copy)]
#[repr(u16)]
pub enum Interrupt {
    Uart0Receive = 0,
    Uart0Transmit = 1,
    Timer0 = 8,
    Timer1 = 9,
    Ethernet = 13,
}

// SAFETY: the numbers are those of the board and below 32, and stay what they are.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

unsafe extern "C" {
    /// cortex-m-rt's: loops for ever, until the watchdog resets the board.
    fn DefaultHandler();
}

/// Vectors of the board's 32 interrupts, placed by cortex-m-rt's linker script.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); 32] = {
    let mut table: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];
    table[Interrupt::Uart0Receive as usize] = uart::on_receive;
    table[Interrupt::Uart0Transmit as usize] = uart::on_transmit;
    table[Interrupt::Timer0 as usize] = time_driver::on_wrap;
    table[Interrupt::Timer1 as usize] = time_driver::on_alarm;
    table[Interrupt::Ethernet as usize] = lan9118::on_interrupt;
    table
};

/// Lets `interrupt` through. Its device must be set up.
pub fn enable(interrupt: Interrupt) {
    // SAFETY: every handler in the table is ready from the start, and no code relies on a masked
    // interrupt for exclusion (critical sections do that).
    unsafe { NVIC::unmask(interrupt) }
}
