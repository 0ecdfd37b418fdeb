//! Text over UART0; registers as in the board's image, `mps2-an386/uart.rs`.

use core::fmt;

use super::mmio::{Register, device};

#[repr(C)]
struct Uart {
    data: Register,
    state: Register,
    control: Register,
    interrupt: Register,
    baud_divisor: Register,
}

const TRANSMITTER_FULL: u32 = 1 << 0;
const TRANSMIT: u32 = 1 << 0;
const LEAST_DIVISOR: u32 = 16;

fn uart0() -> &'static Uart {
    // SAFETY: UART0 of the board.
    unsafe { device(0x4000_4000) }
}

/// Opens UART0.
pub fn start() {
    uart0().baud_divisor.write(LEAST_DIVISOR);
    uart0().control.write(TRANSMIT);
}

/// Writer to the console.
pub struct Console;

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            while uart0().state.read() & TRANSMITTER_FULL != 0 {}
            uart0().data.write(u32::from(byte));
        }
        Ok(())
    }
}
