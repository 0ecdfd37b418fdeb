//! Image for the ARM MPS2+ AN386 board as QEMU emulates it, with a SensFloor at UART0 in the place of a sensor. All else is
//! as in `mps2-an386`, whose files these are.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    #[path = "../mps2-an386/board.rs"]
    mod board;
    #[path = "../mps2-an386/executor.rs"]
    mod executor;
    #[path = "../common/floor.rs"]
    mod floor;
    #[path = "../mps2-an386/interrupts.rs"]
    mod interrupts;
    #[path = "../mps2-an386/lan9118.rs"]
    mod lan9118;
    #[path = "../mps2-an386/led.rs"]
    mod led;
    #[path = "../mps2-an386/lockstep.rs"]
    mod lockstep;
    #[path = "../mps2-an386/log.rs"]
    mod log;
    #[path = "../mps2-an386/mmio.rs"]
    mod mmio;
    #[path = "../common/mod.rs"]
    mod module;
    #[path = "../mps2-an386/nmi.rs"]
    mod nmi;
    #[path = "../mps2-an386/psram.rs"]
    mod psram;
    #[cfg(feature = "in-slot")]
    #[path = "../mps2-an386/slots.rs"]
    mod slots;
    #[path = "../mps2-an386/storage.rs"]
    mod storage;
    #[path = "../mps2-an386/time_driver.rs"]
    mod time_driver;
    #[path = "../mps2-an386/uart.rs"]
    mod uart;
    #[path = "../mps2-an386/uptime.rs"]
    mod uptime;
    #[path = "../mps2-an386/vectors.rs"]
    mod vectors;
    #[path = "../mps2-an386/watchdog.rs"]
    mod watchdog;

    use embassy_executor::{Spawner, task};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        log::start();
        time_driver::start();
        lockstep::start();
        executor::run(|spawner| spawner.spawn(module_task(spawner).expect("the only one")))
    }

    #[task]
    async fn module_task(spawner: Spawner) {
        module::run(board::take(spawner), floor::make, floor::operate).await;
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
