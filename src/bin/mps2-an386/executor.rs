//! An executor that sleeps with `wfi`.
//!
//! embassy's own sleeps with `wfe`, which QEMU takes for a yield: an idle module would use a whole
//! core of the host. With interrupts masked, `wfi` still wakes for a pending one, so none can slip
//! in between the last look at the flag and the sleep.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_executor::{Spawner, raw};
use static_cell::StaticCell;

/// A task was woken since the last poll.
static WORK: AtomicBool = AtomicBool::new(false);

/// Called by embassy whenever a task is woken, from tasks and interrupts alike.
#[unsafe(export_name = "__pender")]
fn pender(_context: *mut ()) {
    WORK.store(true, Ordering::Release);
}

/// Runs what `start` spawns, for ever.
pub fn run(start: impl FnOnce(Spawner)) -> ! {
    static EXECUTOR: StaticCell<raw::Executor> = StaticCell::new();
    let executor = EXECUTOR.init(raw::Executor::new(core::ptr::null_mut()));
    start(executor.spawner());
    loop {
        WORK.store(false, Ordering::Release);
        // SAFETY: only here, and not from within itself.
        unsafe { executor.poll() };
        cortex_m::interrupt::disable();
        if !WORK.load(Ordering::Acquire) {
            cortex_m::asm::wfi();
        }
        // SAFETY: no critical section is open here.
        unsafe { cortex_m::interrupt::enable() };
    }
}
