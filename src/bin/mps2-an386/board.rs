//! What this board hands to the program of all boards.

use embassy_executor::{Spawner, task};
use embassy_net::StackResources;
use embedded_storage_async::nor_flash::NorFlash;
use static_cell::StaticCell;

use super::lan9118::Lan9118;
use super::led::{self, Led};
use super::module::{self, Board, FIRST_BAUD, SOCKETS, Watched};
use super::nmi;
use super::psram::psram;
use super::storage::STORAGE_LEN;
use super::time_driver;
use super::uart::Uart;
use super::watchdog::Watchdog;

/// The board; its network runs in a task of its own. To be called once.
pub fn take(
    spawner: Spawner,
) -> Board<Uart, impl NorFlash, impl FnMut(), impl FnMut(bool), impl FnMut() -> bool> {
    static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
    static CHIP: StaticCell<Watched<Lan9118>> = StaticCell::new();

    let watchdog_reset = nmi::caused_reset();
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

    Board {
        mac,
        secret: [g, h, i, j, a, b, c, d, e, f, 0, 0, 0, 0, 0, 0],
        watchdog_reset,
        stack,
        uart: Uart::new(FIRST_BAUD),
        storage: psram(),
        storage_range: 0..STORAGE_LEN as u32,
        #[cfg(feature = "in-slot")]
        slots: Some(&super::slots::SLOTS),
        // Loaded by QEMU at every start: there is no boot loader.
        #[cfg(not(feature = "in-slot"))]
        slots: None,
        feed: move || watchdog.feed(),
        led: |on| Led.set(on),
        button: led::button_pressed,
    }
}

#[task]
async fn network_task(mut runner: embassy_net::Runner<'static, &'static mut Watched<Lan9118>>) -> ! {
    runner.run().await
}
