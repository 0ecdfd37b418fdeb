//! Image for the ARM MPS2+ AN386 board as QEMU emulates it: the board the tests run on.
//!
//! | device | what for |
//! |---|---|
//! | UART0 | the sensor |
//! | UART1 | the log, defmt |
//! | LAN9118 | the network |
//! | TIMER0, TIMER1 | time |
//! | dual timer | lock-step with a test on the PC |
//! | PSRAM | flash |
//! | LED0 | how the module is: `kehai::device::led` |
//! | BUTTON0 | held from power-up for 10 s: settings and background are erased; QEMU never presses it |
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    mod board;
    mod executor;
    mod interrupts;
    mod lan9118;
    mod led;
    mod lockstep;
    mod log;
    mod mmio;
    #[path = "../common/mod.rs"]
    mod module;
    mod nmi;
    mod psram;
    #[path = "../common/range_finder.rs"]
    mod range_finder;
    #[cfg(feature = "in-slot")]
    mod slots;
    mod storage;
    mod time_driver;
    mod uart;
    mod uptime;
    mod vectors;
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
        module::run(board::take(spawner), range_finder::make, range_finder::operate).await;
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
