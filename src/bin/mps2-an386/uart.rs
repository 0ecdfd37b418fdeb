//! The CMSDK UART: UART0 carries the sensor, UART1 the log (log.rs).
//!
//! ```text
//! 0x00 DATA       one byte either way; no FIFO
//! 0x04 STATE      bit 0 transmitter full, bit 1 receiver full, bits 2 and 3 overrun
//! 0x08 CTRL       bit 0 transmit, bit 1 receive, bits 2 and 3 their interrupts
//! 0x0c INT        bit 0 transmit, bit 1 receive; write 1 to clear
//! 0x10 BAUDDIV    25 MHz / baud rate, at least 16
//! ```
//!
//! Every received byte goes from its interrupt into a pipe that holds [`PIPE_LEN`] of them.
//!
//! Source: ARM DDI 0479 (Cortex-M System Design Kit), part 4.3 "APB UART"; addresses ARM DAI 0386.

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::waitqueue::AtomicWaker;
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use kehai::link::Baud;

use super::interrupts::{self, Interrupt};
use super::mmio::{Register, device};

#[repr(C)]
pub struct Registers {
    pub data: Register,
    pub state: Register,
    pub control: Register,
    pub interrupt: Register,
    pub baud_divisor: Register,
}

pub const TRANSMITTER_FULL: u32 = 1 << 0;
pub const RECEIVER_FULL: u32 = 1 << 1;
pub const TRANSMIT: u32 = 1 << 0;
pub const RECEIVE: u32 = 1 << 1;
const TRANSMIT_INTERRUPT: u32 = 1 << 2;
const RECEIVE_INTERRUPT: u32 = 1 << 3;

/// Clock of the UARTs.
pub const CLOCK_HZ: u32 = 25_000_000;
/// Smallest divisor of the UART.
pub const LEAST_DIVISOR: u32 = 16;

/// Two of the longest SCIP scans in their two-character form, so that a scan may be late by a period.
const PIPE_LEN: usize = 4096;

static RECEIVED: Pipe<CriticalSectionRawMutex, PIPE_LEN> = Pipe::new();
static OVERRUN: AtomicBool = AtomicBool::new(false);
static TRANSMITTED: AtomicWaker = AtomicWaker::new();

fn uart0() -> &'static Registers {
    // SAFETY: UART0 of the board.
    unsafe { device(0x4000_4000) }
}

/// Bytes came faster than they were read, and some are lost.
#[derive(Clone, Copy, PartialEq, Eq, Debug, defmt::Format)]
pub struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("bytes were received faster than they were read")
    }
}

impl core::error::Error for Overrun {}

impl embedded_io_async::Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::OutOfMemory
    }
}

/// The serial line to the sensor.
pub struct Uart {
    _only_one: (),
}

impl Uart {
    /// Opens UART0. To be called once.
    pub fn new(rate_baud: u32) -> Self {
        set_rate(rate_baud);
        uart0().control.write(TRANSMIT | RECEIVE | TRANSMIT_INTERRUPT | RECEIVE_INTERRUPT);
        interrupts::enable(Interrupt::Uart0Receive);
        interrupts::enable(Interrupt::Uart0Transmit);
        Self { _only_one: () }
    }
}

fn set_rate(rate_baud: u32) {
    uart0().baud_divisor.write((CLOCK_HZ / rate_baud.max(1)).max(LEAST_DIVISOR));
}

/// Present divisor: the line's speed is [`CLOCK_HZ`] divided by it.
pub fn divisor() -> u32 {
    uart0().baud_divisor.read()
}

/// Returns when the transmitter can accept a byte.
async fn transmitter_ready() {
    poll_fn(|context| {
        TRANSMITTED.register(context.waker());
        if uart0().state.read() & TRANSMITTER_FULL == 0 { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
}

impl ErrorType for Uart {
    type Error = Overrun;
}

impl Read for Uart {
    /// # Cancellation
    /// Nothing is lost.
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        if OVERRUN.swap(false, Ordering::Relaxed) {
            return Err(Overrun);
        }
        Ok(RECEIVED.read(buffer).await)
    }
}

impl Write for Uart {
    /// # Cancellation
    /// Nothing is sent.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Overrun> {
        let Some((&first, rest)) = bytes.split_first() else { return Ok(0) };
        transmitter_ready().await;
        uart0().data.write(u32::from(first));
        let mut sent = 1;
        for &byte in rest {
            if uart0().state.read() & TRANSMITTER_FULL != 0 {
                break;
            }
            uart0().data.write(u32::from(byte));
            sent += 1;
        }
        Ok(sent)
    }

    async fn flush(&mut self) -> Result<(), Overrun> {
        transmitter_ready().await;
        Ok(())
    }
}

impl Baud for Uart {
    async fn set_baud(&mut self, rate_baud: u32) {
        transmitter_ready().await;
        set_rate(rate_baud);
    }
}

/// A byte has arrived. The interrupt is cleared before the byte is taken: taking it can bring in
/// the next one at once.
pub extern "C" fn on_receive() {
    uart0().interrupt.write(RECEIVE);
    while uart0().state.read() & RECEIVER_FULL != 0 {
        let byte = uart0().data.read() as u8;
        if RECEIVED.try_write(&[byte]).is_err() {
            OVERRUN.store(true, Ordering::Relaxed);
        }
    }
}

/// The transmitter takes the next byte.
pub extern "C" fn on_transmit() {
    uart0().interrupt.write(TRANSMIT);
    TRANSMITTED.wake();
}
