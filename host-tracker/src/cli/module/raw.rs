//! `kehai-tracker module raw`: a module's scans as its sensor gave them, printed or kept for a while.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use host_tracker::net::client::Reaction;
use host_tracker::store::raw::RawScanWriter;
use kehai::wire::{Message, RawPart, Request};
use kehai_tracking::snapshot::unix_ms;
use serde::Serialize;

use super::target::{Target, name};
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

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
struct Arriving(BTreeMap<u32, Parts>);

/// A scan of which some parts are missing.
#[derive(Debug, Default)]
struct Parts {
    /// First step and ranges, by number.
    arrived: BTreeMap<u8, (u16, Vec<u16>)>,
    /// The parts asked for again, bit i for part i.
    asked: u32,
}

/// What a part leads to.
#[derive(Debug)]
enum Arrival {
    /// The scan is complete.
    Complete(Scan),
    /// Parts before it were lost: to be asked for. The module keeps its newest scan only, so a lost last part, which
    /// only the next scan shows, is gone.
    Lost(Request<'static>),
    /// More parts are to come.
    Incomplete,
}

/// Scans that are waited for.
const WAITING: usize = 8;

impl Arriving {
    fn push(&mut self, part: &RawPart<'_>) -> Arrival {
        let head = part.head;
        let parts = self.0.entry(head.object).or_default();
        parts.arrived.insert(head.part, (head.first_step, part.ranges_mm.iter().collect()));
        if parts.arrived.len() < usize::from(head.parts) {
            let missing = (0..head.part.min(32)).filter(|before| !parts.arrived.contains_key(before));
            let lost = missing.fold(0u32, |lost, before| lost | 1 << before) & !parts.asked;
            parts.asked |= lost;
            while self.0.len() > WAITING {
                self.0.pop_first();
            }
            return match lost {
                0 => Arrival::Incomplete,
                parts => Arrival::Lost(Request::RawAgain { object: head.object, parts }),
            };
        }
        let arrived = self.0.remove(&head.object).unwrap_or_default().arrived;
        let first_step = arrived.values().next().map_or(0, |(first_step, _)| *first_step);
        let ranges_mm = arrived.into_values().flat_map(|(_, ranges_mm)| ranges_mm).collect();
        let (stamp_us, sensor_ms) = (part.time.stamp_us, part.time.sensor_ms);
        Arrival::Complete(Scan { sequence: head.object, stamp_us, sensor_ms, first_step, ranges_mm })
    }
}

/// Asks for them, and prints or keeps them.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut client = arguments.target.connect()?;
    let module = client.ask(Request::Info, |_, message| name(message))?;
    let begun_ms = unix_ms();
    let until_ms = begun_ms + arguments.keep_hours * 3_600_000;
    let writer = |file: &PathBuf| RawScanWriter::begin(file, &module, begun_ms, until_ms);
    let mut writer = arguments.db.as_ref().map(writer).transpose()?;
    client.subscribe()?;
    let seconds = arguments.seconds;
    client
        .ask(Request::Raw { seconds }, |_, message| matches!(message, Message::Done { .. }).then_some(()))?;
    let end = Instant::now() + Duration::from_secs(seconds.into());
    let (mut arriving, mut out, mut scans) = (Arriving::default(), io::stdout().lock(), 0u32);
    let stopped = client.watch(Some(end), |message| {
        let Message::RawPart(part) = message else { return None };
        let scan = match arriving.push(part) {
            Arrival::Complete(scan) => scan,
            Arrival::Lost(request) => return Some(Reaction::Ask(request)),
            Arrival::Incomplete => return None,
        };
        scans += 1;
        let line = serde_json::to_string(&scan).map_err(io::Error::other);
        let done = line.and_then(|line| match &mut writer {
            Some(writer) => writer.scan(unix_ms(), line).map_err(io::Error::other),
            None => writeln!(out, "{line}"),
        });
        done.err().map(Reaction::Done)
    })?;
    if let Some(writer) = &mut writer {
        writer.flush()?;
    }
    drop(out);
    match stopped {
        Some(error) => Err(error.into()),
        None if scans == 0 => Err("no scan came: is its sensor there? kehai-tracker module info says".into()),
        None => match &arguments.db {
            None => Ok(()),
            Some(_) if arguments.target.json => print_json(&Kept { module, scans, until_ms }),
            Some(file) => {
                let (file, hours) = (file.display(), arguments.keep_hours);
                print(format_args!("{scans} scans of {module} are kept in {file} for {hours} h"))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::scan::ScanTime;
    use kehai::wire::{List, PartHead};

    /// Part `part` of 3 of scan `object`, with one range.
    fn push(arriving: &mut Arriving, object: u32, part: u8) -> Arrival {
        let head = PartHead { object, part, parts: 3, first_step: 100 + u16::from(part), setup: 1 };
        let time = ScanTime { sensor_ms: 7, stamp_us: 8, uncertainty_us: 9 };
        arriving.push(&RawPart { head, time, ranges_mm: List::new(&[u16::from(part)]) })
    }

    #[test]
    fn a_scan_is_complete_with_its_last_part_in_whatever_order() {
        let mut arriving = Arriving::default();
        assert!(matches!(push(&mut arriving, 5, 0), Arrival::Incomplete));
        assert!(matches!(push(&mut arriving, 5, 1), Arrival::Incomplete));
        let Arrival::Complete(scan) = push(&mut arriving, 5, 2) else { panic!("incomplete") };
        assert_eq!((scan.sequence, scan.first_step, scan.ranges_mm), (5, 100, vec![0, 1, 2]));
    }

    #[test]
    fn lost_parts_are_asked_for_once() {
        let mut arriving = Arriving::default();
        let Arrival::Lost(request) = push(&mut arriving, 5, 2) else { panic!("nothing is missing") };
        assert_eq!(request, Request::RawAgain { object: 5, parts: 0b11 });
        assert!(matches!(push(&mut arriving, 5, 1), Arrival::Incomplete));
        assert!(matches!(push(&mut arriving, 5, 0), Arrival::Complete(_)));
    }
}
