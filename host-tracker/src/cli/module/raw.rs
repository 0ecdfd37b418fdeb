//! `kehai-tracker module raw`: a module's scans as its sensor gave them, printed or kept for a while.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::frame::unix_ms;
use host_tracker::store::raw::RawKeeper;
use kehai::wire::{Message, RawPart, Request};
use serde::Serialize;

use super::{Target, name, print_json};
use crate::cli::Failure;

/// Print a module's raw scans, a JSON line each, or keep them for a while
///
/// They show people more than anything else does: nothing ever keeps them unless it is asked to, and then with an end.
/// With --db they go into that database, and are deleted there after --keep-hours, by the tracker that uses it or by
/// the next command that opens it; until then every live map says that they are kept. Ranges are the sensor's own values
/// in mm; those below its smallest range are its codes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module raw hall --seconds 5 > hall.jsonl
  kehai-tracker module raw 192.168.1.20 --seconds 1 | head -1
  kehai-tracker module raw hall --seconds 600 --db hall.db --keep-hours 2")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// For so long
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=3600))]
    seconds: u16,

    /// Keep them in this database, made if missing, and print none
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// Hours they are kept there
    #[arg(long, value_name = "N", default_value_t = 24, requires = "db", value_parser = clap::value_parser!(u64).range(1..=MOST_HOURS))]
    keep_hours: u64,
}

/// Longest time raw scans are kept, h: a month.
const MOST_HOURS: u64 = 720;

/// What has been kept, as JSON.
#[derive(Debug, Serialize)]
struct Kept {
    module: String,
    scans: u32,
    until_ms: u64,
}

/// A scan.
#[derive(Debug, Serialize)]
struct Scan {
    sequence: u32,
    stamp_us: u64,
    sensor_ms: u64,
    first_step: u16,
    ranges_mm: Vec<u16>,
}

/// Scans on their way.
#[derive(Debug, Default)]
struct Arriving(BTreeMap<u32, BTreeMap<u8, (u16, Vec<u16>)>>);

/// Scans that are waited for.
const WAITING: usize = 8;

impl Arriving {
    /// The scan this part completes.
    fn take(&mut self, part: &RawPart<'_>) -> Option<Scan> {
        let head = part.head;
        let parts = self.0.entry(head.object).or_default();
        parts.insert(head.part, (head.first_step, part.ranges_mm.iter().collect()));
        if parts.len() < usize::from(head.parts) {
            while self.0.len() > WAITING {
                self.0.pop_first();
            }
            return None;
        }
        let parts = self.0.remove(&head.object)?;
        let first_step = parts.values().next().map_or(0, |(first_step, _)| *first_step);
        let ranges_mm = parts.into_values().flat_map(|(_, ranges_mm)| ranges_mm).collect();
        let (stamp_us, sensor_ms) = (part.time.stamp_us, part.time.sensor_ms);
        Some(Scan { sequence: head.object, stamp_us, sensor_ms, first_step, ranges_mm })
    }
}

/// Asks for them, and prints or keeps them.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut client = arguments.target.connect()?;
    let module = client.ask(Request::Info, |_, message| name(message))?;
    let begun_ms = unix_ms();
    let until_ms = begun_ms + arguments.keep_hours * 3_600_000;
    let keeper = |file: &PathBuf| RawKeeper::begin(file, &module, begun_ms, until_ms);
    let mut keeper = arguments.db.as_ref().map(keeper).transpose()?;
    client.subscribe()?;
    let seconds = arguments.seconds;
    client
        .ask(Request::Raw { seconds }, |_, message| matches!(message, Message::Done { .. }).then_some(()))?;
    let end = Instant::now() + Duration::from_secs(seconds.into());
    let (mut arriving, mut out, mut scans) = (Arriving::default(), io::stdout().lock(), 0u32);
    let stopped = client.watch(Some(end), |message| {
        let Message::RawPart(part) = message else { return None };
        let scan = arriving.take(part)?;
        scans += 1;
        let line = serde_json::to_string(&scan).map_err(io::Error::other);
        let done = line.and_then(|line| match &mut keeper {
            Some(keeper) => keeper.scan(unix_ms(), line).map_err(io::Error::other),
            None => writeln!(out, "{line}"),
        });
        done.err()
    })?;
    if let Some(keeper) = &mut keeper {
        keeper.flush()?;
    }
    drop(out);
    match stopped {
        // Whoever read the lines has had enough.
        Some(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Some(error) => Err(error.into()),
        None if scans == 0 => Err("no scan came: is its sensor there? kehai-tracker module info says".into()),
        None => match &arguments.db {
            None => Ok(()),
            Some(_) if arguments.target.json => print_json(&Kept { module, scans, until_ms }),
            Some(file) => {
                println!(
                    "{scans} scans of {module} are kept in {} for {} h",
                    file.display(),
                    arguments.keep_hours
                );
                Ok(())
            }
        },
    }
}
