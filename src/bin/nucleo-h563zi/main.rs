//! Image for the NUCLEO-H563ZI.
//!
//! | pin | what for |
//! |---|---|
//! | PD5, PD6 | USART2 to the sensor, transmit and receive (CN9 pins 6 and 4, "D53" and "D52") |
//! | PA1 PA2 PA7 PB15 PC1 PC4 PC5 PG11 PG13 | RMII and management of the LAN8742 on the board |
//! | PC13 | blue button "USER", held from power-up for 10 s: settings and background are erased |
//! | PB0 | green LED, how the module is: `kehai::device::led` |
//!
//! Source: UM3115 (board), RM0481 (chip).
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
#[path = "."]
mod image {
    mod ecc;
    #[path = "../common/mod.rs"]
    mod module;
    #[path = "../common/range_finder.rs"]
    mod range_finder;
    mod slots;
    mod uart;

    use defmt_rtt as _;
    use embassy_executor::{Spawner, task};
    use embassy_net::StackResources;
    use embassy_stm32::eth::{Ethernet, GenericPhy, PacketQueue, Sma};
    use embassy_stm32::flash::{FLASH_SIZE, Flash};
    use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
    use embassy_stm32::peripherals::{ETH, ETH_SMA, GPDMA1_CH0, GPDMA1_CH1, RNG, USART2};
    use embassy_stm32::rcc::{Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk, VoltageScale};
    use embassy_stm32::rng::Rng;
    use embassy_stm32::time::Hertz;
    use embassy_stm32::wdg::IndependentWatchdog;
    use embassy_stm32::{Config, bind_interrupts, dma, eth, pac, rng, uid, usart};
    use panic_probe as _;
    use static_cell::StaticCell;

    use kehai::address;
    use module::{Board, FIRST_BAUD, SOCKETS, Watched};
    use uart::Uart;

    bind_interrupts!(struct Interrupts {
        ETH => eth::InterruptHandler;
        RNG => rng::InterruptHandler<RNG>;
        USART2 => usart::InterruptHandler<USART2>;
        GPDMA1_CHANNEL0 => dma::InterruptHandler<GPDMA1_CH0>;
        GPDMA1_CHANNEL1 => dma::InterruptHandler<GPDMA1_CH1>;
    });

    type Chip = Watched<Ethernet<'static, ETH, GenericPhy<Sma<'static, ETH_SMA>>>>;

    /// Frames in either direction that wait in memory.
    type Frames = PacketQueue<4, 8>;

    /// Two of the longest SCIP scans in their two-character form.
    const RING_LEN: usize = 4096;
    /// The last 16 sectors of 8 KiB; memory.x keeps the program out of them.
    const STORAGE_LEN: u32 = 128 * 1024;
    /// Longer than any flash operation; the tasks feed every half second.
    const WATCHDOG_US: u32 = 4_000_000;

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static FRAMES: StaticCell<Frames> = StaticCell::new();
        static RESOURCES: StaticCell<StackResources<SOCKETS>> = StaticCell::new();
        static RING: StaticCell<[u8; RING_LEN]> = StaticCell::new();

        let watchdog_reset = watchdog_reset();
        let pins = embassy_stm32::init(clocks());
        // First of all: without a clock from the PHY, the wait for the Ethernet controller never ends.
        let mut watchdog = IndependentWatchdog::new(pins.IWDG, WATCHDOG_US);
        watchdog.unleash();

        let mac = address::mac_from_unique_id(&uid::uid());
        let chip = Ethernet::new(
            FRAMES.init_with(PacketQueue::new),
            pins.ETH,
            Interrupts,
            pins.PA1,
            pins.PA7,
            pins.PC4,
            pins.PC5,
            pins.PG13,
            pins.PB15,
            pins.PG11,
            mac,
            pins.ETH_SMA,
            pins.PA2,
            pins.PC1,
        );
        let (mut seed, mut secret) = ([0; 8], [0; 16]);
        let mut random = Rng::new(pins.RNG, Interrupts);
        random.fill_bytes(&mut seed);
        random.fill_bytes(&mut secret);
        let (stack, runner) = embassy_net::new(
            Watched::new(chip),
            module::network_config(mac),
            RESOURCES.init_with(StackResources::new),
            u64::from_le_bytes(seed),
        );
        spawner.spawn(network_task(runner).expect("the only one"));

        let mut line = usart::Config::default();
        line.baudrate = FIRST_BAUD;
        let (transmitter, receiver) = usart::Uart::new(
            pins.USART2,
            pins.PD6,
            pins.PD5,
            pins.GPDMA1_CH0,
            pins.GPDMA1_CH1,
            Interrupts,
            line,
        )
        .expect("115200 baud is in reach")
        .split();
        let receiver = receiver.into_ring_buffered(RING.init_with(|| [0; _]));

        let mut led = Output::new(pins.PB0, Level::Low, Speed::Low);
        let button = Input::new(pins.PC13, Pull::Down);
        let storage_range = FLASH_SIZE as u32 - STORAGE_LEN..FLASH_SIZE as u32;
        let board = Board {
            mac,
            secret,
            watchdog_reset,
            stack,
            uart: Uart::new(transmitter, receiver),
            storage: ecc::storage(Flash::new_blocking(pins.FLASH)),
            storage_range,
            slots: Some(&slots::SLOTS),
            feed: || watchdog.pet(),
            led: |on: bool| led.set_level(on.into()),
            button: || button.is_high(),
        };
        module::run(board, range_finder::make, range_finder::operate).await;
    }

    /// Whether the watchdog caused this start. The flags add up until they are taken back.
    fn watchdog_reset() -> bool {
        let bitten = pac::RCC.rsr().read().iwdgrstf();
        pac::RCC.rsr().modify(|flags| flags.set_rmvf(true));
        bitten
    }

    #[task]
    async fn network_task(mut runner: embassy_net::Runner<'static, Chip>) -> ! {
        runner.run().await
    }

    /// 250 MHz from the 8 MHz that the ST-LINK gives: 8 / 2 · 125 / 2.
    fn clocks() -> Config {
        let mut config = Config::default();
        config.rcc.hsi = None;
        config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::BypassDigital });
        config.rcc.pll1 = Some(Pll {
            source: PllSource::HSE,
            prediv: PllPreDiv::DIV2,
            mul: PllMul::MUL125,
            divp: Some(PllDiv::DIV2),
            divq: None,
            divr: None,
        });
        config.rcc.sys = Sysclk::PLL1_P;
        config.rcc.voltage_scale = VoltageScale::Scale0;
        config
    }
}

/// On a PC there is no board.
#[cfg(not(target_os = "none"))]
fn main() {}
