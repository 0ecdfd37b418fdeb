//! The table that leads from each interrupt to its handler.
//!
//! Source: ARM DAI 0386, table of interrupts; cortex-m-rt's section `.vector_table.interrupts`.

use super::interrupts::Interrupt;
use super::{lan9118, lockstep, time_driver, uart};

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
    table[Interrupt::DualTimer as usize] = lockstep::on_step;
    table[Interrupt::Ethernet as usize] = lan9118::on_interrupt;
    table
};
