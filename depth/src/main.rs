//! `kehai-depth`: a depth camera as an ordinary device, or a look at what it sees.
#![forbid(unsafe_code)]

use std::error::Error;
use std::io::{self, Write as _};
use std::net::SocketAddrV4;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, Parser, Subcommand};
use kehai::wire::{Identity, NAME_MAX, PORT};
use kehai_depth::background::Background;
use kehai_depth::camera::Camera;
use kehai_depth::cluster::{Density, subsample};
use kehai_depth::device::{self, FanSource, Start};
use kehai_depth::foreground::{self, Limits};
use kehai_depth::segment::{Segment, segments};
use kehai_depth::source::{self, BadFrame, Frames};
use kehai_emulator::pc::device::{PAGES, forgotten};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::reactor::Reactor;
use kehai_emulator::pc::udp::Udp;
use serde::Serialize;

/// A depth camera as an ordinary kehai device
///
/// Its images become a fan of ranges, and the firmware's own tasks report what stands out of it, at a UDP port, as a
/// module on a board does. Ends with Ctrl-C.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Option<RunArguments>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print the bodies in each frame, a JSON line a frame
    Look(LookArguments),
}

#[derive(Debug, Args)]
struct Input {
    /// Size, optics and pose of the camera
    #[arg(long, value_name = "CAM.toml")]
    camera: PathBuf,

    /// A folder of 16-bit PNGs in mm, or a file of little-endian u16 in mm, frame after frame
    #[arg(long, value_name = "FOLDER|FILE.raw")]
    frames: PathBuf,

    /// 30 frames without people to learn the background from [default: the first of --frames]
    #[arg(long, value_name = "FOLDER|FILE.raw")]
    background: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct RunArguments {
    #[command(flatten)]
    input: Input,

    /// Name of the device, also what tells several on this PC apart
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: String,

    /// Address and port to listen at
    #[arg(long, value_name = "ADDR", default_value_t = SocketAddrV4::new([0; 4].into(), PORT))]
    bind: SocketAddrV4,

    /// Keep settings and background in this file [default: forgotten at the end]
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,

    /// Do not announce the device by DNS-SD: only hosts that are told its address find it
    #[arg(long)]
    no_mdns: bool,
}

#[derive(Debug, Args)]
struct LookArguments {
    #[command(flatten)]
    input: Input,

    /// Look at so many points of a frame, chosen at random; a frame with fewer counts as empty (the paper: 1024)
    #[arg(long, value_name = "N")]
    sample: Option<usize>,

    /// For the choice: the same seed chooses the same
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

const EXAMPLES: &str = "Examples:
  kehai-depth --camera hall.toml --frames recordings/hall --name hall
  kehai-depth look --camera hall.toml --frames hall.raw --background empty.raw";

fn name(text: &str) -> Result<String, String> {
    if text.is_empty() || text.len() > NAME_MAX || text.chars().any(char::is_control) {
        return Err(format!("a name has 1 to {NAME_MAX} bytes and no control characters"));
    }
    Ok(text.to_owned())
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match (&cli.command, &cli.run) {
        (Some(Command::Look(arguments)), _) => look(arguments),
        (None, Some(arguments)) => run(arguments),
        (None, None) => Err("nothing to do; see kehai-depth --help".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("kehai-depth: {error}");
            ExitCode::FAILURE
        }
    }
}

fn tell(bad: &BadFrame) {
    eprintln!("{bad}");
}

/// What the frames come with.
type Opened = (Camera, Background, Box<dyn Frames>);

/// Camera, background and the frames after it.
fn opened(input: &Input) -> Result<Opened, Box<dyn Error>> {
    let camera = Camera::open(&input.camera)?;
    let mut frames = source::open(&input.frames, &camera)?;
    let background = match &input.background {
        Some(place) => device::learn(&mut *source::open(place, &camera)?, &mut tell),
        None => device::learn(&mut *frames, &mut tell),
    };
    let place = input.background.as_ref().unwrap_or(&input.frames);
    let background = background.map_err(|error| format!("{}: {error}", place.display()))?;
    Ok((camera, background, frames))
}

fn run(arguments: &RunArguments) -> Result<(), Box<dyn Error>> {
    let (camera, background, frames) = opened(&arguments.input)?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let flash = match &arguments.store {
        Some(file) => Flash::open(file, PAGES).map_err(|error| format!("{}: {error}", file.display()))?,
        None => forgotten(&stop)?,
    };
    let port = Udp::bind(arguments.bind, &Reactor::new())
        .map_err(|error| format!("cannot listen at {}: {error}", arguments.bind))?;
    let address = port.local_addr()?;
    let source = FanSource::new(frames, camera, background, Box::new(tell));
    let counts = source.counts();
    let announced = !arguments.no_mdns;
    let start = Start { port: &port, flash: &flash, name: &arguments.name, announced };
    let done = device::run(source, &start, &stop, |Identity { module, boot }| {
        eprintln!("depth camera {module} at {address}, start {boot}; Ctrl-C ends it");
    });
    let (good, bad) = (counts.good.load(Ordering::Relaxed), counts.bad.load(Ordering::Relaxed));
    eprintln!("{good} frames, and {bad} that could not be used");
    done
}

/// A line of `look`.
#[derive(Serialize)]
struct Line {
    stamp_us: u64,
    /// None: nothing is known of this frame.
    segments: Option<Vec<Segment>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<String>,
}

fn look(arguments: &LookArguments) -> Result<(), Box<dyn Error>> {
    let (camera, background, mut frames) = opened(&arguments.input)?;
    let mut output = io::BufWriter::new(io::stdout().lock());
    while let Some(frame) = frames.next_frame() {
        let line = match frame {
            Ok(frame) => {
                let mut points = foreground::of(&frame, &background, &camera, &Limits::USUAL);
                if let Some(count) = arguments.sample {
                    points = subsample(&points, count, arguments.seed).unwrap_or_default();
                }
                let found = segments(&points, &camera, &Density::USUAL);
                Line { stamp_us: frame.stamp_us, segments: Some(found), fault: None }
            }
            Err(bad) => {
                tell(&bad);
                Line { stamp_us: bad.stamp_us, segments: None, fault: Some(bad.to_string()) }
            }
        };
        let written = serde_json::to_writer(&mut output, &line).map_err(io::Error::from);
        match written.and_then(|()| writeln!(output)) {
            // The reader has seen enough.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
            written => written?,
        }
    }
    Ok(output.flush()?)
}
