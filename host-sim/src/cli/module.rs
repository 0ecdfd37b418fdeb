//! `kehai-sim module`: the library's own tasks, on a PC.

use std::error::Error;
use std::fs::File;
use std::io::Read as _;
use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use host_sim::module::Fed;
use host_sim::module::flash::{Flash, PAGE_LEN};
use host_sim::module::line::{Line, Place};
use host_sim::module::reactor::Reactor;
use host_sim::module::udp::Udp;
use kehai::address::mac_from_unique_id;
use kehai::module::{About, Module};
use kehai::scan::MAX_BEAMS;
use kehai::sensor::Driver;
use kehai::store::flash::FlashStore;
use kehai::tasks::{self, Hardware};
use kehai::wire::{ModuleId, NAME_MAX, PORT};

/// Pages of the store: as many as on a board.
const PAGES: usize = 32;

/// A module on this PC: the very tasks of the firmware, beside any sensor
///
/// It answers at its UDP port as a module on a board does. Ends with Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The sensor: tcp://HOST:PORT or serial:///dev/NAME
    #[arg(long, value_name = "PLACE")]
    sensor: Place,

    /// Address and port to listen at
    #[arg(long, value_name = "ADDR", default_value_t = SocketAddrV4::new([0; 4].into(), PORT), value_parser = listen)]
    listen: SocketAddrV4,

    /// Name of the module, also what tells several on this PC apart
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<String>,

    /// Keep settings and background in this file [default: forgotten at the end]
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
}

const EXAMPLES: &str = "Examples:
  kehai-sim sensor --tcp 127.0.0.1:10940 &
  kehai-sim module --sensor tcp://127.0.0.1:10940 --name left
  kehai-sim module --sensor serial:///dev/ttyUSB0 --store left.flash";

fn listen(text: &str) -> Result<SocketAddrV4, String> {
    text.parse().map_err(|_| "an address to listen at is IPv4:PORT, for example 0.0.0.0:4040".to_owned())
}

fn name(text: &str) -> Result<String, String> {
    if text.is_empty() || text.len() > NAME_MAX || text.chars().any(char::is_control) {
        return Err(format!("a name has 1 to {NAME_MAX} bytes and no control characters"));
    }
    Ok(text.to_owned())
}

/// Runs the module until Ctrl-C.
///
/// # Errors
/// One line that says what is wrong with which file or address.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let flash = match &arguments.store {
        Some(file) => Flash::open(file, PAGES).map_err(|error| format!("{}: {error}", file.display()))?,
        None => Flash::new(PAGES),
    };
    let port = Udp::bind(arguments.listen, &Reactor::new())
        .map_err(|error| format!("cannot listen at {}: {error}", arguments.listen))?;
    while !stop.load(Ordering::Relaxed) {
        start(arguments, &port, &flash, &stop)?;
    }
    Ok(())
}

/// One start of the module.
fn start(arguments: &Arguments, port: &Udp, flash: &Flash, stop: &AtomicBool) -> Result<(), Box<dyn Error>> {
    let reactor = Reactor::new();
    let range = 0..u32::try_from(PAGES * PAGE_LEN)?;
    let mut store = FlashStore::new(flash.clone(), range).ok_or("the store has no room")?;
    let mut secret = [0; 16];
    File::open("/dev/urandom")
        .and_then(|mut random| random.read_exact(&mut secret))
        .map_err(|error| format!("/dev/urandom: {error}"))?;
    let host = std::fs::read_to_string("/etc/machine-id").unwrap_or_default();
    let own_name = arguments.name.clone().unwrap_or_default();
    let unique = format!("{host}{own_name}{:?}", arguments.sensor);
    let module_id = ModuleId(mac_from_unique_id(unique.as_bytes()));
    let mut module = Box::new(Module::<MAX_BEAMS>::new(About {
        module: module_id,
        secret,
        firmware: env!("CARGO_PKG_VERSION"),
        build: concat!("kehai-sim ", env!("CARGO_PKG_VERSION")),
        board: "pc",
        watchdog_reset: false,
    }));
    let begun = reactor.block_on(stop, async {
        let last_baud = tasks::begin(&mut store, &mut module).await;
        if let Some(name) = &arguments.name {
            module.rename(name);
        }
        last_baud
    });
    let Some(last_baud) = begun else { return Ok(()) };
    let line = arguments.sensor.settings(last_baud);
    let link = Line::new(arguments.sensor.clone(), &reactor);
    let mut driver = Box::new(Driver::new(link, reactor.clone(), module.settings().sensor(line)));
    let address = port.local_addr()?;
    eprintln!("module {module_id} at {address}, start {}; Ctrl-C ends it", module.identity().boot);
    let hardware = Hardware {
        driver: &mut driver,
        line,
        datagrams: port.again(&reactor),
        store,
        watchdog: Fed::default(),
        clock: reactor.clone(),
    };
    let _ = reactor.block_on(stop, tasks::run(&mut module, hardware));
    Ok(())
}
