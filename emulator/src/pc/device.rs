//! One module on a PC, in real time: the library's tasks beside any sensor, or beside a SensFloor.

use std::error::Error;
use std::fs::File;
use std::io::Read as _;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{SystemTime, UNIX_EPOCH};

use embassy_futures::select::{select, select3};
use kehai::address::mac_from_unique_id;
use kehai::device::starts::ShortStarts;
use kehai::device::tiles::Tiles;
use kehai::device::{About, Module};
use kehai::link::Clock as _;
use kehai::scan::MAX_BEAMS;
use kehai::seal::LABEL_BYTES;
use kehai::sensor::Driver;
use kehai::store::flash::FlashStore;
use kehai::tasks::{self, FloorHardware, Hardware, Notices};
use kehai::update::boot::{Policy, prepare};
use kehai::update::manifest::program;
use kehai::wire::{Identity, ModuleId, SensorCode};

use super::Fed;
use super::amended::{Amend, Amended};
use super::blink::Blink;
use super::discovery::Announcement;
pub use super::flash::PAGES;
use super::flash::{Flash, PAGE_LEN};
use super::image::{Fault, Image, PAGES_WITH_IMAGES, SLOTS};
use super::line::{Line, Place};
use super::reactor::Reactor;
use super::udp::Udp;

/// What is at the end of a module's line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Beside {
    /// A range finder.
    Sensor,
    /// A SensFloor.
    Floor,
}

impl Beside {
    const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Floor => "floor",
        }
    }

    /// Why it may not answer.
    const fn hint(self) -> &'static str {
        match self {
            Self::Sensor => "is it switched on, and does it speak SCIP?",
            Self::Floor => "is it switched on, and does the setting `tiles` name its group and its tiles?",
        }
    }
}

/// The program, to those who sign images for it.
pub const PROGRAM: &str = "pc";

/// A module that is switched on.
pub struct Pc<'a> {
    /// What it is beside.
    pub beside: Beside,
    /// Its sensor, or its floor.
    pub sensor: &'a Place,
    /// Its port.
    pub port: &'a Udp,
    /// [`PAGES`] pages for settings and background, or [`PAGES_WITH_IMAGES`]: then it can be updated.
    pub flash: &'a Flash,
    /// Its name; it distinguishes several modules on this PC.
    pub name: Option<&'a str>,
    /// What distinguishes it beside its name, the same at every start; its sensor's place if None.
    pub unique: Option<&'a str>,
    /// Whether it is announced by DNS-SD.
    pub announced: bool,
    /// Whose images it starts.
    pub maker: [u8; 32],
    /// What adds to its datagrams.
    pub amend: Option<Arc<dyn Amend>>,
}

/// Flash that is forgotten at the end. Its starts are counted from the seconds since 1970, so that the next process goes on
/// with larger numbers: hosts take a smaller one for an old datagram.
///
/// # Errors
/// It has no room, or cannot be written.
pub fn forgotten(stop: &AtomicBool) -> Result<Flash, Box<dyn Error>> {
    let flash = Flash::new(PAGES_WITH_IMAGES);
    let range = 0..u32::try_from(PAGES * PAGE_LEN)?;
    let mut store = FlashStore::new(flash.clone(), range).ok_or("the store has no room")?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs();
    // Enough until 2106.
    let boot = u32::try_from(now).unwrap_or_default();
    let counted = Reactor::new().block_on(stop, kehai::store::count_from(&mut store, boot));
    counted.map_or(Ok(()), |done| done.map_err(|_| "the store cannot be written"))?;
    Ok(flash)
}

/// Gives a device the secret of its label, as the maker of a board does.
///
/// # Errors
/// The flash has no room, or cannot be written.
pub fn set_label(flash: &Flash, label: &[u8; LABEL_BYTES], stop: &AtomicBool) -> Result<(), Box<dyn Error>> {
    let range = 0..u32::try_from(PAGES * PAGE_LEN)?;
    let mut store = FlashStore::new(flash.clone(), range).ok_or("the store has no room")?;
    let stored = Reactor::new().block_on(stop, kehai::store::save_label(&mut store, label));
    stored.map_or(Ok(()), |done| done.map_err(|_| "the store cannot be written".into()))
}

impl Pc<'_> {
    /// One start of the module, until it is to start anew or `stop` is set. `on_start` is told which module and
    /// which start this is.
    ///
    /// # Errors
    /// What the PC lacks.
    pub fn start(&self, stop: &AtomicBool, on_start: impl FnOnce(Identity)) -> Result<(), Box<dyn Error>> {
        let reactor = Reactor::new();
        let range = 0..u32::try_from(PAGES * PAGE_LEN)?;
        let store = FlashStore::new(self.flash.clone(), range).ok_or("the store has no room")?;
        let has_images = self.flash.len() >= PAGES_WITH_IMAGES * PAGE_LEN;
        if has_images {
            let policy = Policy { program: program(PROGRAM), makers: &[self.maker] };
            prepare(self.flash.clone(), &SLOTS, &policy);
        }
        let image = has_images.then(|| Image::active(self.flash)).flatten();
        if image.as_ref().is_some_and(|image| image.fault == Fault::Hangs) {
            let _ = reactor.block_on(stop, reactor.wait_until(WATCHDOG_US));
            return Ok(());
        }
        let mut store = store.with_slots(has_images.then_some(&SLOTS));
        let mut secret = [0; 16];
        File::open("/dev/urandom")
            .and_then(|mut random| random.read_exact(&mut secret))
            .map_err(|error| format!("/dev/urandom: {error}"))?;
        let mut module = Box::new(Module::<MAX_BEAMS>::new(About {
            module: self.id(),
            secret,
            // Leaked: a few bytes a start.
            firmware: image.map_or(env!("CARGO_PKG_VERSION"), |image| image.version.leak()),
            build: concat!("kehai-sim ", env!("CARGO_PKG_VERSION")),
            board: PROGRAM,
            watchdog_reset: false,
        }));
        let begun = reactor.block_on(stop, async {
            let last_baud = tasks::begin(&mut store, &mut module, ShortStarts::default()).await;
            if let Some(name) = self.name {
                module.rename(name);
            }
            last_baud
        });
        let Some(last_baud) = begun else { return Ok(()) };
        on_start(module.identity());
        let listen = self.port.local_addr()?;
        let notices = Notices::new();
        let (datagrams, clock, watchdog) =
            (Amended::new(self.port.again(&reactor), self.amend.clone()), reactor.clone(), Fed::default());
        let running = async {
            match self.beside {
                Beside::Sensor => {
                    let uart = Line::new(self.sensor.clone(), &reactor, |place, error| {
                        eprintln!("sensor at {place}: {error}; it is tried again and again");
                    });
                    let line = self.sensor.settings(last_baud);
                    let settings = module.settings().sensor(line);
                    let driver = &mut Box::new(Driver::new(uart, reactor.clone(), settings));
                    let notices = &notices;
                    let hardware = Hardware { driver, line, datagrams, store, watchdog, clock, notices };
                    tasks::run(&mut module, hardware).await;
                }
                Beside::Floor => {
                    let line = Line::new(self.sensor.clone(), &reactor, |place, error| {
                        eprintln!("floor at {place}: {error}; it is tried again and again");
                    });
                    let (tiles, notices) = (&mut Box::new(Tiles::new()), &notices);
                    let hardware = FloorHardware { tiles, line, datagrams, store, watchdog, clock, notices };
                    tasks::run_floor(&mut module, hardware).await;
                }
            }
        };
        let announcing = async {
            if self.announced {
                let error = announce(self.id(), listen, &notices, &reactor).await;
                tracing::warn!("module {} cannot be announced: {error}", self.id());
            }
            std::future::pending::<()>().await;
        };
        let blink = Blink::new(self.id(), self.name);
        let blinking = watch_blinking(blink, &notices, &reactor);
        let watching =
            select3(announcing, blinking, watch_line(self.beside, self.sensor, &notices, &reactor));
        let _ = reactor.block_on(stop, select(running, watching));
        Ok(())
    }

    /// Its identity: the same at every start.
    fn id(&self) -> ModuleId {
        let host = std::fs::read_to_string("/etc/machine-id").unwrap_or_default();
        let name = self.name.unwrap_or_default();
        let place = || format!("{:?}", self.sensor);
        let unique = self.unique.map_or_else(place, str::to_owned);
        ModuleId(mac_from_unique_id(format!("{host}{name}{unique}").as_bytes()))
    }
}

/// After which a program that hangs starts anew, µs: the watchdog of the boards.
const WATCHDOG_US: u64 = 4_000_000;

/// Time without an answer after which a sensor is said to be silent, µs: at 19 200 baud, a stream left running may take
/// this long to end.
const SILENT_US: u64 = 5_000_000;

/// Says when the sensor or the floor does not answer, and when it does again. Never returns.
///
/// # Cancellation
/// Nothing more is said.
async fn watch_line(beside: Beside, place: &Place, notices: &Notices, reactor: &Reactor) {
    let (name, hint) = (beside.name(), beside.hint());
    let (mut heard_us, mut is_silent) = (reactor.now_us(), false);
    loop {
        reactor.wait_until(reactor.now_us() + SILENT_US / 10).await;
        if !matches!(notices.status().sensor, SensorCode::Searching | SensorCode::Stalled) {
            heard_us = reactor.now_us();
        }
        let silent = reactor.now_us() - heard_us >= SILENT_US;
        if silent && !is_silent {
            eprintln!("{name} at {place}: no answer; {hint}");
        } else if is_silent && !silent {
            eprintln!("{name} at {place}: it answers");
        }
        is_silent = silent;
    }
}

/// Between two looks at whether it blinks, µs: shorter than a person notices.
const BLINK_US: u64 = 100_000;

/// Says when it blinks, and when it ends. Never returns.
///
/// # Cancellation
/// Nothing more is said.
async fn watch_blinking(mut blink: Blink, notices: &Notices, reactor: &Reactor) {
    loop {
        reactor.wait_until(reactor.now_us() + BLINK_US).await;
        if let Some(line) = blink.line(notices.status().identifying) {
            eprintln!("{line}");
        }
    }
}

/// Announces `module`, which listens at `listen`, until that fails, and why it did.
///
/// # Cancellation
/// The module is no longer announced.
async fn announce(
    module: ModuleId,
    listen: SocketAddr,
    notices: &Notices,
    reactor: &Reactor,
) -> mdns_sd::Error {
    match Announcement::new(listen, module, env!("CARGO_PKG_VERSION")) {
        Ok(mut announcement) => announcement.keep(notices, reactor).await,
        Err(error) => error,
    }
}
