//! What every boot loader does: lets the library decide which image is in the active slot, and starts it.
//!
//! ```text
//!   reset ─▶ watchdog ─▶ update::boot::prepare ─▶ interrupts off, vectors of the image, its stack, its reset
//! ```
//!
//! The watchdog goes on: an image that hangs is started anew by it, and swapped back. Whatever goes wrong in here, the
//! image in the active slot is started.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use kehai::update::boot::{Policy, prepare};
use kehai::update::manifest::program;
use kehai::update::slots::Slots;

// The makers' public keys: `MAKERS`, by build.rs.
include!(concat!(env!("OUT_DIR"), "/makers.rs"));

/// Flash that feeds the watchdog at every access: a swap takes longer than it waits.
struct Fed<F, W> {
    flash: F,
    feed: W,
}

impl<F: NorFlash, W: FnMut()> ErrorType for Fed<F, W> {
    type Error = F::Error;
}

impl<F: NorFlash, W: FnMut()> ReadNorFlash for Fed<F, W> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, at: u32, bytes: &mut [u8]) -> impl Future<Output = Result<(), F::Error>> {
        (self.feed)();
        self.flash.read(at, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash, W: FnMut()> NorFlash for Fed<F, W> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), F::Error>> {
        (self.feed)();
        self.flash.erase(from, to)
    }

    fn write(&mut self, at: u32, bytes: &[u8]) -> impl Future<Output = Result<(), F::Error>> {
        (self.feed)();
        self.flash.write(at, bytes)
    }
}

/// Prepares the active slot of this flash, and starts the image there: flash begins at `base`.
pub fn run(flash: impl NorFlash, slots: &Slots, base: u32, feed: impl FnMut()) -> ! {
    let policy = Policy { program: program(env!("KEHAI_BOARD")), makers: MAKERS };
    prepare(Fed { flash, feed }, slots, &policy);
    start(base + slots.active.start)
}

/// Starts the image whose vectors are at this address.
pub fn start(address: u32) -> ! {
    // SAFETY: nothing else runs any more. The address is that of the active slot, which begins with the vectors of an
    // image: its stack, and its reset.
    unsafe {
        let core = cortex_m::Peripherals::steal();
        for (enabled, pending) in core.NVIC.icer.iter().zip(&core.NVIC.icpr) {
            enabled.write(u32::MAX);
            pending.write(u32::MAX);
        }
        core.SCB.vtor.write(address);
        cortex_m::asm::bootload(core::ptr::with_exposed_provenance(address as usize))
    }
}
