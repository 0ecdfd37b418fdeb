//! Boot loader of the NUCLEO-H563ZI. It runs from the chip's own oscillator, and leaves all else as a reset does.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    mod ecc;
    #[path = "../common/loader.rs"]
    mod loader;
    mod slots;

    use core::panic::PanicInfo;

    use defmt_rtt as _;
    use embassy_stm32::flash::{FLASH_BASE, Flash};
    use embassy_stm32::wdg::IndependentWatchdog;

    use slots::SLOTS;

    /// Longer than any flash operation, and than the image takes to feed it.
    const WATCHDOG_US: u32 = 4_000_000;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let pins = embassy_stm32::init(embassy_stm32::Config::default());
        let mut watchdog = IndependentWatchdog::new(pins.IWDG, WATCHDOG_US);
        watchdog.unleash();
        let flash = ecc::storage(Flash::new_blocking(pins.FLASH));
        loader::run(flash, &SLOTS, FLASH_BASE as u32, || watchdog.pet())
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        loader::start(FLASH_BASE as u32 + SLOTS.active.start)
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
