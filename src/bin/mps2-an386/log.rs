//! The log: defmt frames over UART1 (registers in uart.rs), and the last words of a panic.

use core::cell::UnsafeCell;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use critical_section::RestoreState;

use super::mmio::device;
use super::uart::{LEAST_DIVISOR, Registers, TRANSMIT, TRANSMITTER_FULL};

/// A byte that is not taken after so many looks is lost: a log never stops the module.
const PATIENCE: u32 = 1000;

fn uart1() -> &'static Registers {
    // SAFETY: UART1 of the board.
    unsafe { device(0x4000_5000) }
}

/// Opens UART1. Before this, messages vanish.
pub fn start() {
    uart1().baud_divisor.write(LEAST_DIVISOR);
    uart1().control.write(TRANSMIT);
}

fn send(bytes: &[u8]) {
    for &byte in bytes {
        if (0..PATIENCE).any(|_| uart1().state.read() & TRANSMITTER_FULL == 0) {
            uart1().data.write(u32::from(byte));
        }
    }
}

struct State {
    encoder: defmt::Encoder,
    restore: RestoreState,
}

/// State of the message being written; the code that has set [`TAKEN`] owns it.
struct Frame(UnsafeCell<State>);

// SAFETY: touched only between `acquire` and `release`, which is one critical section.
unsafe impl Sync for Frame {}

static FRAME: Frame =
    Frame(UnsafeCell::new(State { encoder: defmt::Encoder::new(), restore: RestoreState::invalid() }));
static TAKEN: AtomicBool = AtomicBool::new(false);

#[defmt::global_logger]
struct Logger;

// SAFETY: a message is written inside a critical section, and a second one within it is refused.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: `release` ends it, in the same context.
        let restore = unsafe { critical_section::acquire() };
        assert!(!TAKEN.swap(true, Ordering::Relaxed), "a message within a message");
        // SAFETY: owned since TAKEN was set.
        let state = unsafe { &mut *FRAME.0.get() };
        state.restore = restore;
        state.encoder.start_frame(send);
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: owned until TAKEN is cleared below.
        let state = unsafe { &mut *FRAME.0.get() };
        state.encoder.end_frame(send);
        let restore = state.restore;
        TAKEN.store(false, Ordering::Relaxed);
        // SAFETY: begun by `acquire`.
        unsafe { critical_section::release(restore) };
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: the caller has acquired the logger.
        let state = unsafe { &mut *FRAME.0.get() };
        state.encoder.write(bytes, send);
    }
}

/// Whether a message can be written here, even in the midst of whatever was interrupted.
pub fn is_free() -> bool {
    !TAKEN.load(Ordering::Relaxed)
}

/// Says why, then starts again.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    if is_free() {
        defmt::error!("{}", defmt::Display2Format(info));
    }
    cortex_m::peripheral::SCB::sys_reset()
}
