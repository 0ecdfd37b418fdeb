//! Boot loader of the W5500-EVB-Pico2: the boot ROM starts it.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    #[path = "../common/loader.rs"]
    mod loader;
    mod slots;

    use core::panic::PanicInfo;

    use defmt_rtt as _;
    use embassy_embedded_hal::adapter::BlockingAsync;
    use embassy_rp::flash::{Blocking, Flash};
    use embassy_rp::peripherals::FLASH;
    use embassy_rp::watchdog::Watchdog;
    use embassy_time::Duration;

    use slots::SLOTS;

    /// Where flash is read.
    const FLASH_BASE: u32 = 0x1000_0000;
    const FLASH_LEN: usize = 2 * 1024 * 1024;
    /// Longer than any flash operation, and than the image takes to feed it.
    const WATCHDOG: Duration = Duration::from_secs(4);

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let pins = embassy_rp::init(Default::default());
        let mut watchdog = Watchdog::new(pins.WATCHDOG);
        watchdog.start(WATCHDOG);
        let flash = Flash::<FLASH, Blocking, FLASH_LEN>::new_blocking(pins.FLASH);
        loader::run(BlockingAsync::new(flash), &SLOTS, FLASH_BASE, || watchdog.feed(WATCHDOG))
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        loader::start(FLASH_BASE + SLOTS.active.start)
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
