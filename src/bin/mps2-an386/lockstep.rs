//! Lock-step with the program on the PC that is the rest of the world: sensor, network, hosts.
//!
//! ```text
//! guest   ███ 1 ms ███│ stands │███ 1 ms ███│ stands │ …        time passes only while it runs
//! PC                  │ now ▶ ██│            │ now ▶ ██│          the world, up to the guest's time
//!                     │◀ go     │            │◀ go     │
//! ```
//!
//! Every [`STEP_US`] of the guest's time an interrupt writes the time since the reset, and the divisor the sensor's
//! line runs at, to one FIFO of the PC, and reads another until the same numbers come back. Both are semihosting calls: QEMU does not count them as time, and
//! the guest stands until the read returns. So a PC that is held up holds the guest up, and neither misses
//! anything. An answer to older numbers belongs to a program that was reset meanwhile.
//!
//! With `-icount sleep=off` QEMU jumps over the time a program sleeps, to its next timer, and looks at its sockets
//! once before each jump. A second timer without an interrupt bounds the jumps, so that bytes on their way into the
//! UART, one or 32 at a look, come as fast as the sensor's line carries them.
//!
//! It is on if QEMU's loader has put the longest jump, in µs, at [`SWITCH`]; semihosting is there then, too.
//!
//! Source: "Semihosting for AArch32 and AArch64", release 3.0; ARM DDI 0479, part 4.5 "APB dual-input timers";
//! address ARM DAI 0386.

use core::ffi::CStr;
use core::sync::atomic::{AtomicU32, Ordering};

use super::interrupts::{self, Interrupt};
use super::mmio::{Register, device};
use super::time_driver;
use super::uart;
use super::uptime::COUNTS_PER_US;

/// Guest time between two meetings.
const STEP_US: u32 = 1000;

/// A word of PSRAM behind the storage: the longest jump over sleep in µs, or none and no lock-step.
const SWITCH: usize = 0x2110_0000;
/// Longest jump that makes sense; memory that was never written says more.
const LONGEST_JUMP_US: u32 = STEP_US;

/// The FIFOs, in the folder QEMU runs in.
const TO_PC: &CStr = c"guest-time";
const FROM_PC: &CStr = c"go-on";

/// One half of the dual timer.
#[repr(C)]
struct Timer {
    load: Register,
    _value: Register,
    control: Register,
    interrupt_clear: Register,
    _rest: [u32; 4],
}

/// Runs, periodic, 32 bits wide; and with an interrupt.
const RUN: u32 = 1 << 7 | 1 << 6 | 1 << 1;
const INTERRUPT: u32 = 1 << 5;

fn timers() -> &'static [Timer; 2] {
    // SAFETY: the dual timer of the board.
    unsafe { device(0x4000_2000) }
}

/// Semihosting operations, and the mode "r+b" of a file.
const OPEN: u32 = 0x01;
const WRITE: u32 = 0x05;
const READ: u32 = 0x06;
const READ_AND_WRITE: u32 = 3;

/// Handles of the two FIFOs; written once, before the interrupt is enabled.
static HANDLES: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

/// Asks the debugger, which here is QEMU.
fn semihosting(operation: u32, arguments: [u32; 3]) -> u32 {
    let mut register = operation;
    // SAFETY: the call reads `arguments` and what they point at, and writes nothing but the buffer of `READ`.
    unsafe {
        core::arch::asm!("bkpt 0xab", inout("r0") register, in("r1") arguments.as_ptr(), options(nostack));
    }
    register
}

fn open(name: &CStr) -> u32 {
    semihosting(OPEN, [name.as_ptr().expose_provenance() as u32, READ_AND_WRITE, name.count_bytes() as u32])
}

/// Meets the PC for the first time, and from then on every [`STEP_US`]. To be called once, when time runs.
pub fn start() {
    // SAFETY: a word of the board's memory that nothing else names.
    let switch: &Register = unsafe { device(SWITCH) };
    let jump_us = switch.read();
    if !(1..=LONGEST_JUMP_US).contains(&jump_us) {
        return;
    }
    for (handle, name) in HANDLES.iter().zip([TO_PC, FROM_PC]) {
        handle.store(open(name), Ordering::Relaxed);
    }
    meet();
    let [step, look] = timers();
    look.load.write(jump_us * COUNTS_PER_US);
    look.control.write(RUN);
    step.load.write(STEP_US * COUNTS_PER_US);
    step.control.write(RUN | INTERRUPT);
    interrupts::enable(Interrupt::DualTimer);
}

/// Stands until the PC says go on.
fn meet() {
    let [to_pc, from_pc] = HANDLES.each_ref().map(|handle| handle.load(Ordering::Relaxed));
    let now = [time_driver::now_us(), u64::from(uart::divisor())];
    let mut answer = [u64::MAX; 2];
    let bytes = size_of_val(&now) as u32;
    semihosting(WRITE, [to_pc, now.as_ptr().expose_provenance() as u32, bytes]);
    while answer != now {
        semihosting(READ, [from_pc, answer.as_mut_ptr().expose_provenance() as u32, bytes]);
    }
}

/// A step is over.
pub extern "C" fn on_step() {
    timers()[0].interrupt_clear.write(1);
    meet();
}
