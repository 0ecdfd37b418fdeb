//! Boot loader of the MPS2+ AN386: QEMU loads it at every reset, and keeps the images in a file.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    #[path = "../common/loader.rs"]
    mod loader;
    #[allow(dead_code, reason = "an image reads registers, too")]
    mod mmio;
    mod psram;
    mod slots;
    mod storage;
    mod watchdog;

    use core::panic::PanicInfo;

    use psram::{PSRAM, psram};
    use slots::SLOTS;
    use watchdog::Watchdog;

    unsafe extern "C" {
        /// cortex-m-rt's: loops for ever, until the watchdog resets the board.
        fn DefaultHandler();
    }

    /// No interrupt is let through.
    #[unsafe(link_section = ".vector_table.interrupts")]
    #[unsafe(no_mangle)]
    pub static __INTERRUPTS: [unsafe extern "C" fn(); 32] = [DefaultHandler; 32];

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut watchdog = Watchdog::start();
        loader::run(psram(), &SLOTS, PSRAM as u32, move || watchdog.feed())
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        loader::start(PSRAM as u32 + SLOTS.active.start)
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
