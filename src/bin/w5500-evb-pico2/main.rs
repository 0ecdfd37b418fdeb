//! Image for the W5500-EVB-Pico2.
//!
//! | pin | what for |
//! |---|---|
//! | GP0, GP1 | UART0 to the sensor, transmit and receive |
//! | GP16 GP17 GP18 GP19 | SPI0 to the W5500 on the board: MISO, select, clock, MOSI |
//! | GP20, GP21 | reset and interrupt of the W5500 |
//! | GP22 | button to ground, held from power-up for 10 s: settings and background are erased |
//! | GP25 | LED, how the module is: `kehai::device::led` |
//!
//! Source: WIZnet, W5500-EVB-Pico2 schematic; RP2350 data sheet.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    #[path = "../common/mod.rs"]
    mod module;
    #[path = "../common/range_finder.rs"]
    mod range_finder;
    mod slots;
    mod uart;

    use defmt_rtt as _;
    use embassy_embedded_hal::adapter::BlockingAsync;
    use embassy_executor::{Spawner, task};
    use embassy_net::StackResources;
    use embassy_net_wiznet::chip::W5500;
    use embassy_net_wiznet::{Device, State};
    use embassy_rp::flash::{Blocking, Flash};
    use embassy_rp::gpio::{Input, Level, Output, Pull};
    use embassy_rp::peripherals::{DMA_CH0, DMA_CH1, FLASH, SPI0, TRNG, UART0};
    use embassy_rp::spi::{Async, Spi};
    use embassy_rp::trng::Trng;
    use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart};
    use embassy_rp::watchdog::{ResetReason, Watchdog};
    use embassy_rp::{bind_interrupts, dma, otp, spi, trng};
    use embassy_time::{Delay, Duration};
    use embedded_hal_bus::spi::ExclusiveDevice;
    use panic_probe as _;
    use static_cell::{ConstStaticCell, StaticCell};

    use kehai::address;
    use module::{Board, FIRST_BAUD, SOCKETS, Watched};
    use uart::Uart;

    bind_interrupts!(struct Interrupts {
        UART0_IRQ => BufferedInterruptHandler<UART0>;
        TRNG_IRQ => trng::InterruptHandler<TRNG>;
        DMA_IRQ_0 => dma::InterruptHandler<DMA_CH0>, dma::InterruptHandler<DMA_CH1>;
    });

    type ChipSpi = ExclusiveDevice<Spi<'static, SPI0, Async>, Output<'static>, Delay>;
    type ChipRunner = embassy_net_wiznet::Runner<'static, W5500, ChipSpi, Input<'static>, Output<'static>>;

    /// Two of the longest SCIP scans in their two-character form.
    const RECEIVED_LEN: usize = 4096;
    /// More than any SCIP command.
    const TO_SEND_LEN: usize = 64;
    const FLASH_LEN: usize = 2 * 1024 * 1024;
    /// The last 32 sectors of 4 KiB; memory.x keeps the program out of them.
    const STORAGE_LEN: u32 = 128 * 1024;
    /// Longer than any flash operation; the tasks feed every half second.
    const WATCHDOG: Duration = Duration::from_secs(4);
    /// The W5500 takes 33 MHz and more over wires as short as these.
    const SPI_HZ: u32 = 33_000_000;

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static STATE: ConstStaticCell<State<8, 4>> = ConstStaticCell::new(State::new());
        static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
        static RECEIVED: ConstStaticCell<[u8; RECEIVED_LEN]> = ConstStaticCell::new([0; _]);
        static TO_SEND: ConstStaticCell<[u8; TO_SEND_LEN]> = ConstStaticCell::new([0; _]);

        let pins = embassy_rp::init(Default::default());
        let mut watchdog = Watchdog::new(pins.WATCHDOG);
        let watchdog_reset = matches!(watchdog.reset_reason(), Some(ResetReason::TimedOut));
        watchdog.start(WATCHDOG);

        let mac = address::mac_from_unique_id(&otp::get_chipid().unwrap_or_default().to_le_bytes());
        let mut bus = spi::Config::default();
        bus.frequency = SPI_HZ;
        let bus = Spi::new(
            pins.SPI0,
            pins.PIN_18,
            pins.PIN_19,
            pins.PIN_16,
            pins.DMA_CH0,
            pins.DMA_CH1,
            Interrupts,
            bus,
        );
        let select = Output::new(pins.PIN_17, Level::High);
        let Ok(bus) = ExclusiveDevice::new(bus, select, Delay);
        let (chip, chip_runner) = embassy_net_wiznet::new(
            mac,
            STATE.take(),
            bus,
            Input::new(pins.PIN_21, Pull::Up),
            Output::new(pins.PIN_20, Level::High),
        )
        .await
        .expect("no W5500 on this board");
        spawner.spawn(chip_task(chip_runner).expect("the only one"));
        let (mut seed, mut secret) = ([0; 8], [0; 16]);
        let mut random = Trng::new(pins.TRNG, Interrupts, Default::default());
        random.blocking_fill_bytes(&mut seed);
        random.blocking_fill_bytes(&mut secret);
        let (stack, runner) = embassy_net::new(
            Watched::new(chip),
            module::network_config(mac),
            RESOURCES.init_with(StackResources::new),
            u64::from_le_bytes(seed),
        );
        spawner.spawn(network_task(runner).expect("the only one"));

        let mut line = embassy_rp::uart::Config::default();
        line.baudrate = FIRST_BAUD;
        let line = BufferedUart::new(
            pins.UART0,
            pins.PIN_0,
            pins.PIN_1,
            Interrupts,
            TO_SEND.take(),
            RECEIVED.take(),
            line,
        );

        let mut led = Output::new(pins.PIN_25, Level::Low);
        let button = Input::new(pins.PIN_22, Pull::Up);
        let flash = Flash::<FLASH, Blocking, FLASH_LEN>::new_blocking(pins.FLASH);
        let board = Board {
            mac,
            secret,
            watchdog_reset,
            stack,
            uart: Uart(line),
            storage: BlockingAsync::new(flash),
            storage_range: FLASH_LEN as u32 - STORAGE_LEN..FLASH_LEN as u32,
            slots: Some(&slots::SLOTS),
            feed: || watchdog.feed(WATCHDOG),
            led: |on: bool| led.set_level(on.into()),
            button: || button.is_low(),
        };
        module::run(board, range_finder::make, range_finder::operate).await;
    }

    #[task]
    async fn chip_task(runner: ChipRunner) -> ! {
        runner.run().await
    }

    #[task]
    async fn network_task(mut runner: embassy_net::Runner<'static, Watched<Device<'static>>>) -> ! {
        runner.run().await
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
