//! `kehai-tracker module update`: brings a signed image to modules, one after the other.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::firmware::SignedImage;
use host_tracker::firmware::update::{Outcome, hold, known_zones, outcome, runs};
use host_tracker::net::client::{Client, ClientError, Reaction};
use indicatif::{ProgressBar, ProgressStyle};
use kehai::wire::{CHUNK_MAX, ImageFault, Message, Refusal, Request};
use kehai_tracking::keys::Keys;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::text::printable;

use super::super::log::say;
use super::target::{find, keys_in};
use crate::cli::failure::Failure;
use crate::cli::live::LiveArguments;
use crate::cli::output::print;

/// Bring a signed image to modules, one after the other
///
/// A module receives it while it runs, starts anew, and keeps it only if it works: it sees scans, a host listens, and its
/// flash takes what it is given. Else the one before is back within five minutes. The next module follows when the last
/// one's zones are known again. Nothing is begun while a door is in use.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module update hall --keys door.keys pico2.kehai
  kehai-tracker module update --all --keys door.keys pico2.kehai
  kehai-tracker module update --all --keys door.keys --tracker https://kehai.lan:8420 --ca door.cert.pem pico2.kehai
  kehai-tracker module update 192.168.1.20 --keys door.keys --without-tracker pico2.kehai")]
pub struct Arguments {
    /// The modules, each by name, instance name, identity or address; and the signed image, last
    #[arg(value_name = "MODULE… FILE.kehai", required = true)]
    modules_and_file: Vec<String>,

    /// All modules in the file of keys
    #[arg(long)]
    all: bool,

    /// The keys of the site: images are taken sealed only
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: PathBuf,

    // Asked about doors and zones.
    #[command(flatten)]
    live: LiveArguments,

    /// Ask no tracker: then no check of doors and zones is made
    #[arg(long)]
    without_tracker: bool,

    /// Also to a module that says it runs this version
    #[arg(long)]
    again: bool,
}

/// Longest that doors and zones are waited for.
const HOLD: Duration = Duration::from_secs(120);

/// Longest from the restart to the end of the trial: the swap takes up to 15 s, a trial five minutes, and coming back
/// once more as long as the swap.
const TRIAL: Duration = Duration::from_secs(360);

/// Between two looks.
const LOOK: Duration = Duration::from_millis(500);

/// How often the module is asked where it is.
const LOST_PLACE: u32 = 5;

/// Brings it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (file, modules) = arguments.modules_and_file.split_last().ok_or("which image?")?;
    let image = SignedImage::load(file.as_ref())?;
    let keys = keys_in(&arguments.keys)?;
    let modules: Vec<String> = match (arguments.all, modules) {
        (true, []) => keys.devices().map(|(id, _)| id.to_string()).collect(),
        (true, _) => return Err("--all, or modules by name".into()),
        (false, []) => return Err("which modules? --all takes all in the file of keys".into()),
        (false, modules) => modules.to_vec(),
    };
    let known = match arguments.ask_tracker()? {
        Some(snapshot) => known_zones(&snapshot),
        None => BTreeSet::new(),
    };
    for (number, module) in modules.iter().enumerate() {
        let done = arguments.wait(&known).and_then(|()| arguments.update(module, &image, &keys));
        done.map_err(|error| {
            format!("{module}: {error}; {number} of {} modules are done, the others as before", modules.len())
        })?;
    }
    // The last one's zones, too.
    arguments.wait(&known)
}

impl Arguments {
    /// What the tracker says; none without one.
    fn ask_tracker(&self) -> Result<Option<Snapshot>, Failure> {
        if self.without_tracker {
            return Ok(None);
        }
        let snapshot = self.live.get("/api/state").map_err(|why| {
            format!("{why}; --tracker says where the tracker is, --without-tracker goes on without")
        })?;
        Ok(Some(snapshot))
    }

    /// Until doors are idle, and zones known that were.
    fn wait(&self, known: &BTreeSet<String>) -> Result<(), Failure> {
        let (begin, mut said) = (Instant::now(), None);
        loop {
            let held = self.ask_tracker()?.and_then(|snapshot| hold(&snapshot, known));
            let Some(held) = held else { return Ok(()) };
            if begin.elapsed() > HOLD {
                return Err(format!("{held} for {} s", HOLD.as_secs()).into());
            }
            if said.as_ref() != Some(&held) {
                say(format_args!("{held}: waiting"));
                said = Some(held);
            }
            std::thread::sleep(LOOK);
        }
    }

    fn update(&self, module: &str, image: &SignedImage, keys: &Keys) -> Result<(), Failure> {
        let mut client = Client::with_keys(find(module)?, keys.clone().into())?;
        let (name, board, firmware) = about(&mut client)?;
        if board.is_empty() {
            return Err(format!("{name} has keys, and they are not in {}", self.keys.display()).into());
        }
        let (program, version) = (image.about.program_name(), image.about.version);
        if board != program {
            return Err(format!("the image is for {program}, and {name} is {board}").into());
        }
        if runs(&firmware, version) && !self.again {
            return print(format_args!("{name}: runs {version} already"));
        }
        client.subscribe()?;
        send(&mut client, &name, image)?;
        // It is dark while it starts anew: a person may be in transit by now.
        self.wait(&BTreeSet::new())?;
        client.ask(Request::UpdateInstall, |_, message| {
            matches!(message, Message::Done { .. }).then_some(())
        })?;
        let boot = client.identity().boot;
        match await_outcome(&client, boot, keys)? {
            (Outcome::Confirmed, _) => print(format_args!("{name}: runs {version}, and it stays")),
            (Outcome::Kept(why), firmware) => Err(format!("{why}; it runs {firmware}").into()),
        }
    }
}

/// Name, board and version of a module; to a host that it does not listen to it says its name only.
fn about(client: &mut Client) -> Result<(String, String, String), ClientError> {
    client.ask(Request::Info, |_, message| match message {
        Message::Info(info) => Some((printable(info.name), printable(info.board), printable(info.firmware))),
        _ => None,
    })
}

/// Sends an image, from where the module has it.
fn send(client: &mut Client, name: &str, image: &SignedImage) -> Result<(), Failure> {
    let next = |_, message: &Message<'_>| match message {
        Message::Receiving { next, .. } => Some(*next as usize),
        _ => None,
    };
    let bar = ProgressBar::new(u64::from(image.about.size)).with_style(
        ProgressStyle::with_template("{msg} {bar:30} {bytes} of {total_bytes}")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.set_message(name.to_owned());
    let begin = Request::Update { manifest: &image.manifest };
    let (mut at, mut lost) = (client.ask(begin, next)?, 0);
    while at < image.bytes.len() {
        bar.set_position(at as u64);
        let rest = image.bytes.get(at..).unwrap_or(&[]);
        let bytes = rest.get(..CHUNK_MAX).unwrap_or(rest);
        let offset = u32::try_from(at)?;
        at = match client.ask(Request::UpdateChunk { offset, bytes }, next) {
            Ok(at) => at,
            // It has started anew, or another host sends it something else.
            Err(ClientError::Refused(Refusal::Image(ImageFault::Sequence))) if lost < LOST_PLACE => {
                lost += 1;
                client.ask(begin, next)?
            }
            Err(error) => return Err(error.into()),
        };
    }
    bar.finish_and_clear();
    Ok(())
}

/// What becomes of the image once the module has started anew, and what it says it runs then.
fn await_outcome(before: &Client, boot: u32, keys: &Keys) -> Result<(Outcome, String), Failure> {
    let (begin, address) = (Instant::now(), before.address());
    while begin.elapsed() < TRIAL {
        std::thread::sleep(LOOK);
        let Ok(mut client) = Client::with_keys(address, keys.clone().into()) else { continue };
        if client.identity().boot == boot {
            continue;
        }
        let Ok((_, _, firmware)) = about(&mut client) else { continue };
        // Subscribed meanwhile: an image on trial waits for that.
        if client.subscribe().is_err() {
            continue;
        }
        let end = begin + TRIAL;
        let found = client.watch(Some(end), |message| match message {
            Message::Health(health) => {
                outcome(health.events.iter().map(|event| event.kind)).map(Reaction::Done)
            }
            _ => None,
        });
        // Silent: it has started anew once more.
        if let Ok(Some(found)) = found {
            return Ok((found, firmware));
        }
    }
    Err(format!("it has not said what became of the image within {} s", TRIAL.as_secs()).into())
}
