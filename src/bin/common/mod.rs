//! What every board's image does: the same program, over whatever the board hands it.
//!
//! ```text
//! board's main.rs ─▶ Board { uart, storage, stack, feed, led, button } ─▶ range_finder.rs | floor.rs ─▶ run
//! ```
//!
//! It counts its start in the storage, keeps an address on the network, lets hosts find it, shows on its LED how
//! it is, and runs the library's tasks: what is at the end of the serial line, the module at UDP port 4040, the
//! watchdog. When they end it starts anew.

pub mod clock;
mod discovery;
mod led;
mod network;
mod port;
mod recovery;
mod spared_ram;
mod watched;

use core::ops::Range;

use defmt::info;
use embassy_futures::join::join4;
use embassy_futures::select::select3;
use embassy_net::Stack;
use embedded_storage_async::nor_flash::NorFlash;
use kehai::address::{self, Mac};
use kehai::device::starts::ShortStarts;
use kehai::device::{About, Module};
use kehai::link::Watchdog;
use kehai::store::flash::FlashStore;
use kehai::tasks::{self, Notices};
use kehai::update::slots::Slots;
use kehai::wire::ModuleId;

use port::{PORT_SOCKETS, Port};
use spared_ram::SparedRam;
pub use watched::Watched;

/// Version, source and board of this image.
pub const BUILD: &str =
    concat!("kehai ", env!("CARGO_PKG_VERSION"), " ", env!("KEHAI_GIT"), " ", env!("CARGO_BIN_NAME"));

/// Speed the sensor's line begins with.
pub const FIRST_BAUD: u32 = 115_200;
/// Sockets of the network stack: DHCP and the search for a server, the port's, mDNS's two, spare.
pub const SOCKETS: usize = PORT_SOCKETS + 5;

/// What a board brings.
pub struct Board<Line, Flash, Feed, Light, Pressed> {
    /// Hardware address.
    pub mac: Mac,
    /// Keys the module's cookies: random, where the board can.
    pub secret: [u8; 16],
    /// Whether the watchdog caused this start, as far as the board can tell.
    pub watchdog_reset: bool,
    /// The network stack; the board's own task runs its runner.
    pub stack: Stack<'static>,
    /// The serial line to the sensor.
    pub uart: Line,
    /// Flash, and the part of it that is for settings and background.
    pub storage: Flash,
    /// See `storage`.
    pub storage_range: Range<u32>,
    /// Where images are on that flash, if a boot loader starts this one.
    pub slots: Option<&'static Slots>,
    /// Feeds the watchdog.
    pub feed: Feed,
    /// Lights the LED, or not: see [`kehai::device::led`].
    pub led: Light,
    /// Whether the button is pressed: see [`kehai::device::button`].
    pub button: Pressed,
}

/// What the network stack begins with: DHCP under the module's name.
pub fn network_config(mac: Mac) -> embassy_net::Config {
    network::dhcp(mac)
}

/// What the tasks of a start are given.
pub struct Start<'a, Line, Flash: NorFlash, Feed, Driver, const BEAMS: usize> {
    pub module: &'a mut Module<BEAMS>,
    pub uart: Line,
    /// Room for what hears the line.
    pub driver: &'a mut Option<Driver>,
    pub datagrams: Port,
    pub store: FlashStore<Flash>,
    pub watchdog: Fed<Feed>,
    pub notices: &'a Notices,
}

/// Runs a module until it must restart, and restarts it: the tasks that `operate` chooses, and what every module has
/// beside them. `make` puts the module in its place; `operate` is told the speed at which a sensor answered last.
///
/// # Cancellation
/// It never returns; to drop it is as a loss of power.
pub async fn run<Line, Flash, Feed, Light, Pressed, Driver, const BEAMS: usize>(
    mut board: Board<Line, Flash, Feed, Light, Pressed>,
    make: impl FnOnce(About) -> &'static mut Module<BEAMS>,
    operate: impl AsyncFnOnce(Start<'_, Line, Flash, Feed, Driver, BEAMS>, Option<u32>),
) -> !
where
    Flash: NorFlash,
    Feed: FnMut(),
    Light: FnMut(bool),
    Pressed: FnMut() -> bool,
{
    let mut spared_ram = SparedRam::take();
    let short_starts = ShortStarts::begin(&mut spared_ram);
    info!("{=str}", BUILD);
    info!("maths {=u32:08x}", kehai::math::digest());
    let [a, b, c, d, e, f] = board.mac;
    info!("mac {=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}:{=u8:02x}", a, b, c, d, e, f);
    info!("host {=str}", address::host_name(board.mac).as_str());
    let store = FlashStore::new(board.storage, board.storage_range).expect("whole pages");
    let mut store = store.with_slots(board.slots);
    let module = make(About {
        module: ModuleId(board.mac),
        secret: board.secret,
        firmware: env!("CARGO_PKG_VERSION"),
        build: env!("KEHAI_GIT"),
        board: env!("CARGO_BIN_NAME"),
        watchdog_reset: board.watchdog_reset,
    });
    recovery::factory_reset(&mut store, &mut board.button, &mut board.feed, &mut board.led).await;
    let begun = tasks::begin(&mut store, module, short_starts);
    let last_baud = recovery::fed(&mut board.feed, begun).await;
    info!("boot {=u32}", module.identity().boot);
    let notices = Notices::new();
    let beside = join4(
        network::keep_address(board.stack, board.mac, module.addressing()),
        discovery::announce(board.stack, board.mac, &notices),
        led::show(board.stack, &notices, board.led),
        recovery::note_lasting(&mut spared_ram),
    );
    let mut driver = None;
    let start = Start {
        module,
        uart: board.uart,
        driver: &mut driver,
        datagrams: Port::open(board.stack),
        store,
        watchdog: Fed(board.feed),
        notices: &notices,
    };
    let network_dies = recovery::network_dies(board.stack, &notices);
    select3(operate(start, last_baud), network_dies, beside).await;
    info!("restart");
    // Asked for: that start was none that did not last.
    ShortStarts::lasted(&mut spared_ram);
    cortex_m::peripheral::SCB::sys_reset()
}

/// A watchdog, by what feeds it.
pub struct Fed<Feed>(Feed);

impl<Feed: FnMut()> Watchdog for Fed<Feed> {
    fn feed(&mut self) {
        (self.0)();
    }
}
