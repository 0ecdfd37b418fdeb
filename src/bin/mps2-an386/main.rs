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
    mod executor;
    mod interrupts;
    mod lan9118;
    mod led;
    mod lockstep;
    mod log;
    mod mmio;
    #[path = "../common/mod.rs"]
    mod module;
    mod storage;
    mod time_driver;
    mod uart;
    mod uptime;
    mod vectors;
    mod watchdog;

    use embassy_executor::{Spawner, task};
    use embassy_net::StackResources;
    use embedded_storage_async::nor_flash::NorFlash;
    use static_cell::StaticCell;

    use lan9118::Lan9118;
    use led::Led;
    use module::{Board, FIRST_BAUD, SOCKETS, Watched};
    use storage::{Control, STORAGE_LEN};
    use uart::Uart;
    use watchdog::Watchdog;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        log::start();
        time_driver::start();
        lockstep::start();
        executor::run(|spawner| spawner.spawn(module_task(spawner).expect("the only one")))
    }

    #[task]
    async fn module_task(spawner: Spawner) {
        static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
        static CHIP: StaticCell<Watched<Lan9118>> = StaticCell::new();

        let watchdog_reset = watchdog::caused_reset();
        let mut watchdog = Watchdog::start();
        let chip = Lan9118::new().expect("no LAN9118 in this machine");
        let mac = chip.mac();
        // No random numbers on this board: modules differ by address, starts by their number and by how far the
        // timer has come. That is no secret, and good for tests only.
        let [a, b, c, d, e, f] = mac;
        let [g, h, i, j] = time_driver::counter().to_le_bytes();
        let seed = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        let (stack, runner) = embassy_net::new(
            CHIP.init(Watched::new(chip)),
            module::network_config(mac),
            RESOURCES.init(StackResources::new()),
            seed,
        );
        spawner.spawn(network_task(runner).expect("the only one"));

        let mut led = Led;
        module::run(Board {
            mac,
            secret: [g, h, i, j, a, b, c, d, e, f, 0, 0, 0, 0, 0, 0],
            watchdog_reset,
            stack,
            uart: Uart::new(FIRST_BAUD),
            storage: psram(),
            storage_range: 0..STORAGE_LEN as u32,
            feed: || watchdog.feed(),
            led: |on| led.set(on),
            button: led::button_pressed,
        })
        .await;
    }

    #[task]
    async fn network_task(mut runner: embassy_net::Runner<'static, &'static mut Watched<Lan9118>>) -> ! {
        runner.run().await
    }

    /// Where the PSRAM begins.
    const PSRAM: usize = 0x2100_0000;

    /// The part of the PSRAM that stands for flash, and what says how it fails behind it. To be called once.
    fn psram() -> impl NorFlash {
        // SAFETY: memory of the board, outside of what the linker hands out, and borrowed only here.
        let memory = unsafe {
            core::slice::from_raw_parts_mut(core::ptr::with_exposed_provenance_mut(PSRAM), STORAGE_LEN)
        };
        // SAFETY: as above; any bits are a control, and a test that changes them changes atomics.
        let control = unsafe { &*core::ptr::with_exposed_provenance::<Control>(PSRAM + STORAGE_LEN) };
        storage::storage(memory, control)
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
