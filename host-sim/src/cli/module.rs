//! `kehai-sim module`: the library's own tasks, on a PC.

use std::error::Error;
use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use kehai::update::maker::DEVELOPMENT;
use kehai::wire::{Identity, NAME_MAX, PORT};
use kehai_emulator::pc::device::{self, Beside, Pc};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::image::PAGES_WITH_IMAGES;
use kehai_emulator::pc::line::Place;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use kehai_tracking::keys::Label;

/// A module on this PC: the very tasks of the firmware, beside any sensor or a SensFloor
///
/// It answers at its UDP port as a module on a board does, and hosts find it by DNS-SD as _kehai._udp. Ends with
/// Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The sensor: tcp://HOST:PORT or serial:///dev/NAME
    #[arg(long, value_name = "PLACE", required_unless_present = "floor")]
    sensor: Option<Place>,

    /// A SensFloor instead; the setting `tiles` says which tiles it has (docs/floor.md)
    #[arg(long, value_name = "PLACE", conflicts_with = "sensor")]
    floor: Option<Place>,

    /// Address and port to listen at
    #[arg(long, value_name = "ADDR", default_value_t = SocketAddrV4::new([0; 4].into(), PORT), value_parser = listen)]
    listen: SocketAddrV4,

    /// Name of the module, also what tells several on this PC apart
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<String>,

    /// Keep settings, background and images in this file [default: forgotten at the end]
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,

    /// The code of its label, by which kehai-tracker module claim gives it keys; kehai-tracker module label makes one
    #[arg(long, value_name = "CODE", value_parser = label)]
    label: Option<Label>,

    /// The public key of those whose images it starts, 64 hexadecimal digits; kehai-tracker firmware key prints one
    /// [default: the one whose secret is in the repository]
    #[arg(long, value_name = "KEY", value_parser = maker)]
    maker: Option<[u8; 32]>,

    /// Do not announce the module by DNS-SD: only hosts that are told its address find it
    #[arg(long)]
    no_mdns: bool,
}

const EXAMPLES: &str = "Examples:
  kehai-sim sensor --tcp 127.0.0.1:10940 &
  kehai-sim module --sensor tcp://127.0.0.1:10940 --name left
  kehai-sim module --sensor serial:///dev/ttyUSB0 --store left.flash
  kehai-sim module --floor serial:///dev/ttyUSB0 --name mat --store mat.flash";

pub(super) fn listen(text: &str) -> Result<SocketAddrV4, String> {
    text.parse().map_err(|_| "an address to listen at is IPv4:PORT, for example 0.0.0.0:4040".to_owned())
}

fn label(text: &str) -> Result<Label, String> {
    Label::parse(text).ok_or_else(|| "a label's code has 26 letters and digits".to_owned())
}

fn maker(text: &str) -> Result<[u8; 32], String> {
    let key = data_encoding::HEXLOWER_PERMISSIVE.decode(text.as_bytes()).ok();
    key.and_then(|key| key.try_into().ok()).ok_or_else(|| "a public key has 64 hexadecimal digits".to_owned())
}

pub(super) fn name(text: &str) -> Result<String, String> {
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
    let (beside, place) = match (&arguments.sensor, &arguments.floor) {
        (_, Some(floor)) => (Beside::Floor, floor),
        (Some(sensor), None) => (Beside::Sensor, sensor),
        (None, None) => return Err("--sensor or --floor says what the module is beside".into()),
    };
    let flash = match &arguments.store {
        Some(file) => {
            Flash::open(file, PAGES_WITH_IMAGES).map_err(|error| format!("{}: {error}", file.display()))?
        }
        None => device::forgotten(&stop)?,
    };
    if let Some(Label(label)) = &arguments.label {
        device::set_label(&flash, label, &stop)?;
    }
    let port = Udp::bind(arguments.listen, &Reactor::new())
        .map_err(|error| format!("cannot listen at {}: {error}", arguments.listen))?;
    let address = port.local_addr()?;
    let pc = Pc {
        beside,
        sensor: place,
        port: &port,
        flash: &flash,
        name: arguments.name.as_deref(),
        unique: None,
        maker: arguments.maker.unwrap_or(DEVELOPMENT),
        announced: !arguments.no_mdns,
        amend: None,
    };
    while !stop.load(Ordering::Relaxed) {
        pc.start(&stop, |Identity { module, boot }| {
            eprintln!("module {module} at {address}, start {boot}; Ctrl-C ends it");
        })?;
    }
    Ok(())
}
