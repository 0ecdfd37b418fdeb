//! `kehai-sim sensor`: an emulated URG for any SCIP client.

use std::error::Error;
use std::fmt::Write as _;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::{ArgGroup, Args, ValueEnum};
use host_sim::world::World;
use host_sim::world::scene::Scene;
use kehai_emulator::recording::{Recording, RecordingSource};
use kehai_emulator::serve::{self, Control, Status};
use kehai_emulator::source::{RangeSource, Repeating, StillRoom};
use kehai_emulator::urg::faults::{Fault, KINDS};
use kehai_emulator::urg::model::{MODELS, Model, QuitInTimeSync, URG_04LX, WhileBooting};
use kehai_emulator::urg::{Config, Start, State, Urg};

/// Time between two lines of status while something happens.
const STATUS_EVERY: Duration = Duration::from_secs(5);

/// An emulated URG laser range finder for any SCIP client
///
/// Answers SCIP as the chosen model does: its states, its rhythm, its mistakes. Without a recording or a scene it
/// stands in an empty room, 3 m wide. Ends with Ctrl-C.
#[derive(Debug, Args)]
#[command(
    after_help = EXAMPLES,
    after_long_help = format!("{EXAMPLES}\n\n{}", faults_help()),
    group(ArgGroup::new("link").required(true)),
    group(ArgGroup::new("source")),
)]
pub struct Arguments {
    /// Which sensor [default: urg-04lx, or the scene's]
    #[arg(long, value_parser = model)]
    model: Option<Model>,

    /// Listen for a client here; one at a time
    #[arg(long, group = "link", value_name = "ADDR", value_parser = address)]
    tcp: Option<String>,

    /// Make a serial device with this name (a link to a pseudo terminal)
    #[arg(long, group = "link", value_name = "LINK")]
    pty: Option<PathBuf>,

    /// Measure what a recording holds, again and again; it begins with the first measurement
    #[arg(long, group = "source", value_name = "FILE.csv")]
    recording: Option<PathBuf>,

    /// Stand in a simulated scene, as one of its modules (--module)
    #[arg(long, group = "source", value_name = "FILE.toml", requires = "module")]
    scene: Option<String>,

    /// The module of the scene whose sensor this is
    #[arg(long, value_name = "NAME", requires = "scene")]
    module: Option<String>,

    /// Play a recording once, then fall silent
    #[arg(long, requires = "recording")]
    once: bool,

    /// For everything random: the same seed does the same [default: 1, or the scene's]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// State the sensor is found in
    #[arg(long, value_enum, default_value_t = StartArgument::Idle)]
    start: StartArgument,

    /// Bit rate the sensor is found at [default: 19200, as after power-up]
    #[arg(long, value_name = "N", value_parser = baud)]
    baud: Option<u32>,

    /// What goes wrong; may be given several times (--help lists all)
    #[arg(long = "fault", value_name = "KIND[:ARG]")]
    faults: Vec<Fault>,

    /// Where it does as other sensors of its kind were seen to do; may be given several times
    #[arg(long = "quirk", value_enum, value_name = "KIND")]
    quirks: Vec<Quirk>,

    /// Time the sensor takes to start up, in seconds
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    boot_time: f64,

    /// What the sensor's millisecond counter shows at first (it wraps at 16777216)
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(..1 << 24))]
    clock_ms: Option<u32>,
}

/// States on the command line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum StartArgument {
    /// SCIP 2.0, laser off
    Idle,
    /// SCIP 1.1, as a URG-04LX after each power-up
    Scip11,
    /// Still measuring for a client that is gone
    Streaming,
    /// In the time-sync state
    Timesync,
    /// Just plugged in
    Booting,
    /// Broken: answers 0L until it is rebooted (RB twice); SCIP 2.0 models 50 until they are reset (RS)
    Abnormal,
}

/// Behaviour on which sources or sensors differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Quirk {
    /// A last cluster that is not full is left out: floor(n / cluster) values instead of ceil
    FloorClusters,
    /// QT does not leave the time-sync state: refused with 0E or, in SCIP 2.2, with 10; only TM2 leaves it
    QuitDenied,
    /// Starting up, it answers as if it were ready, and measures nothing
    AnswersBooting,
}

impl Quirk {
    fn apply(self, config: Config) -> Config {
        let model = config.model;
        match self {
            Self::FloorClusters => Config { drop_incomplete_group: true, ..config },
            Self::QuitDenied => {
                Config { model: Model { quit_in_time_sync: QuitInTimeSync::Refused, ..model }, ..config }
            }
            Self::AnswersBooting => {
                Config { model: Model { while_booting: WhileBooting::Accepts, ..model }, ..config }
            }
        }
    }
}

impl From<StartArgument> for Start {
    fn from(argument: StartArgument) -> Self {
        match argument {
            StartArgument::Idle => Self::Idle,
            StartArgument::Scip11 => Self::Scip11,
            StartArgument::Streaming => Self::Streaming,
            StartArgument::Timesync => Self::TimeSync,
            StartArgument::Booting => Self::Booting,
            StartArgument::Abnormal => Self::Abnormal,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  kehai-sim sensor --model ust-10lx --tcp 127.0.0.1:10940
  kehai-sim sensor --pty /tmp/urg --start scip11
  kehai-sim sensor --pty /tmp/urg --start streaming --baud 115200 --fault bit-flip:0.001
  kehai-sim sensor --tcp 127.0.0.1:10940 --recording walk.csv --fault stall:10,0.39,30
  kehai-sim sensor --model ust-10lx --tcp 127.0.0.1:10940 --start timesync --quirk quit-denied
  kehai-sim sensor --tcp 127.0.0.1:10940 --scene door-area --module left --seed 7";

fn faults_help() -> String {
    let mut help = String::from(
        "Faults (arguments left out have the values in brackets; AT, FOR, EVERY in seconds, EVERY 0 is once):",
    );
    for kind in KINDS {
        // Writing to a string does not fail.
        let _ = write!(help, "\n  {:<26} {}", kind.usage(), kind.help);
    }
    help
}

fn model(name: &str) -> Result<Model, String> {
    Model::named(name).ok_or_else(|| {
        let names = MODELS.map(|model| model.name).join(", ");
        format!("there is no such model; known are {names}")
    })
}

fn address(text: &str) -> Result<String, String> {
    let (host, port) = text.rsplit_once(':').ok_or("an address is HOST:PORT, for example 127.0.0.1:10940")?;
    if host.is_empty() || port.parse::<u16>().is_err() {
        return Err("an address is HOST:PORT, for example 127.0.0.1:10940".to_owned());
    }
    Ok(text.to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.0..=3600.0).contains(seconds));
    seconds.ok_or_else(|| "a time is a number of seconds from 0 to 3600".to_owned())
}

fn baud(text: &str) -> Result<u32, String> {
    let rate = text.parse().ok().filter(|rate| (1200..=4_000_000).contains(rate));
    rate.ok_or_else(|| "a bit rate is a number from 1200 to 4000000".to_owned())
}

/// Serves the sensor until Ctrl-C.
///
/// # Errors
/// One line that says what is wrong with which file or address.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let sensor = sensor(arguments)?;
    let (name, paced) = (sensor.model().name, sensor.paced());
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let (place, listener) = match (&arguments.tcp, &arguments.pty) {
        (Some(address), _) => {
            let listener =
                TcpListener::bind(address).map_err(|error| format!("cannot listen on {address}: {error}"))?;
            (format!("listening on {}", listener.local_addr()?), Some(listener))
        }
        (None, link) => {
            let link = link.as_deref().unwrap_or(Path::new(""));
            (format!("serial device {}", link.display()), None)
        }
    };
    let mut printer = Printer::new(name, place, paced);
    let mut on_status = |status: &Status| printer.show(status);
    let mut control = Control { stop: &stop, on_status: &mut on_status };
    match (&listener, &arguments.pty) {
        (Some(listener), _) => serve::serve_tcp(listener, sensor, &mut control)?,
        (None, Some(link)) => serve_pty(link, sensor, &mut control)?,
        (None, None) => {}
    }
    printer.line();
    Ok(())
}

#[cfg(target_os = "linux")]
fn serve_pty(link: &Path, sensor: Urg, control: &mut Control<'_>) -> Result<(), Box<dyn Error>> {
    serve::serve_pty(link, sensor, control).map_err(|error| format!("{}: {error}", link.display()).into())
}

#[cfg(not(target_os = "linux"))]
fn serve_pty(link: &Path, _: Urg, _: &mut Control<'_>) -> Result<(), Box<dyn Error>> {
    Err(format!("{}: serial devices are emulated on Linux only", link.display()).into())
}

/// The sensor the arguments describe.
fn sensor(arguments: &Arguments) -> Result<Urg, Box<dyn Error>> {
    let (config, source) = match (&arguments.recording, &arguments.scene) {
        (Some(file), _) => {
            let config = Config::new(arguments.model.unwrap_or(URG_04LX));
            let recorded = RecordingSource::new(Recording::open(file)?);
            let source: Box<dyn RangeSource> =
                if arguments.once { Box::new(recorded) } else { Box::new(Repeating::new(recorded)) };
            (config, source)
        }
        (None, Some(file)) => {
            let scene = Scene::load(file)?;
            let world = World::new(&scene, arguments.seed.unwrap_or(scene.seed));
            let module = arguments.module.as_deref().unwrap_or_default();
            let sensor = world.sensor(module).ok_or_else(|| {
                let names: Vec<_> = world.sensors().iter().map(|(name, _)| name.as_str()).collect();
                format!("{file}: there is no module `{module}`; the scene has {}", names.join(", "))
            })?;
            let config = sensor.config();
            let model = arguments.model.unwrap_or(config.model);
            let source = Box::new(sensor.clone());
            (Config { model, paced: Config::new(model).paced, ..config }, source as Box<dyn RangeSource>)
        }
        (None, None) => {
            let model = arguments.model.unwrap_or(URG_04LX);
            (Config::new(model), Box::new(StillRoom::new(model.geometry)) as Box<dyn RangeSource>)
        }
    };
    let config = Config {
        // A serial line has a speed; a socket has none.
        paced: config.paced && arguments.pty.is_some(),
        baud: arguments.baud.unwrap_or(config.model.power_up_baud),
        start: Start::from(arguments.start).of(&config.model)?,
        boot_us: (arguments.boot_time * 1e6) as u64,
        seed: arguments.seed.unwrap_or(config.seed),
        faults: arguments.faults.clone(),
        clock_start_ms: arguments.clock_ms.unwrap_or(config.clock_start_ms),
        ..config
    };
    let config = arguments.quirks.iter().fold(config, |config, quirk| quirk.apply(config));
    Ok(Urg::new(config, source, 0))
}

/// Writes a line on stderr when a client comes or goes, and now and then while scans are sent.
struct Printer {
    name: &'static str,
    place: String,
    has_baud: bool,
    started: Instant,
    printed: Instant,
    shown: Option<Status>,
    last: Option<Status>,
}

impl Printer {
    fn new(name: &'static str, place: String, has_baud: bool) -> Self {
        let now = Instant::now();
        Self { name, place, has_baud, started: now, printed: now, shown: None, last: None }
    }

    fn show(&mut self, status: &Status) {
        if self.last.is_none() {
            eprintln!("{}: {}; Ctrl-C ends it", self.name, self.place);
        }
        let client_changed = self.shown.as_ref().map_or(status.client, |shown| shown.client != status.client);
        let changed = self.shown.as_ref() != Some(status);
        self.last = Some(status.clone());
        if client_changed || (changed && self.printed.elapsed() >= STATUS_EVERY) {
            self.line();
        }
    }

    /// Writes what is known last.
    fn line(&mut self) {
        let Some(status) = self.last.clone() else { return };
        let client = if status.client { "client" } else { "no client" };
        let state = match status.state {
            State::Off => "off",
            State::Booting => "starting up",
            State::Scip11 => "SCIP 1.1",
            State::Idle => "idle",
            State::Streaming => "measuring",
            State::TimeSync => "time sync",
            State::Asleep => "asleep",
            State::Abnormal => "broken",
            State::Wedged => "wedged",
        };
        let counts = status.counts;
        let baud = if self.has_baud { format!(", {} baud", status.baud) } else { String::new() };
        eprintln!(
            "{}: {:.1} s: {client}, {state}{baud}; {} requests ({} refused), {} scans sent, {} lost to a slow line or client, \
             {} faults",
            self.name,
            self.started.elapsed().as_secs_f64(),
            counts.requests,
            counts.refusals,
            counts.scans_sent,
            counts.scans_dropped,
            counts.faults,
        );
        self.printed = Instant::now();
        self.shown = Some(status);
    }
}
