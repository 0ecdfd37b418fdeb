//! `kehai-sim halls`: four halls as one site, by one tracker and by a tracker of each.

use std::error::Error;
use std::ops::RangeInclusive;

use clap::Args;
#[cfg(feature = "daemon")]
use host_sim::halls::live;
use host_sim::halls::simulated::{Outcome, play};
use host_sim::halls::table::markdown;
use host_sim::halls::world::{AREAS, Borders, Halls};
use kehai_tracking::tracker::Selected;
use rayon::prelude::*;

use super::runs::{bar, seeds};

/// Follow people through four halls, by one tracker and by a tracker of each hall put together, and compare
///
/// The same datagrams go to both. A person who walks into another hall is to keep number and name; the totals are to agree. Once with all
/// frames of the areas, once with a share of them lost. On simulated time: the same seeds give the same figures on every machine.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim halls
  kehai-sim halls --borders open --people 16 --seeds 0-39
  kehai-sim halls --silent 'south border'         a module at a border falls silent half-way
  kehai-sim halls --seeds 3-3 --list              each crossing that had another number after it
  kehai-sim halls --tracker kehai-rules           by another tracker
  kehai-sim halls --live --people 8 --seconds 60  the same by processes, in real time")]
pub struct Arguments {
    /// What is between two halls
    #[arg(long, value_name = "KIND", default_value = "doorways")]
    borders: Borders,

    /// How many people
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=60))]
    people: u64,

    /// How long each run is, s; the first twenty are not judged
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u64).range(30..=3600))]
    seconds: u64,

    /// First and last seed, a run each
    #[arg(long, value_name = "FIRST-LAST", default_value = "0-3", value_parser = seeds)]
    seeds: RangeInclusive<u64>,

    /// Share of the areas' frames that is lost the second time
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, value_parser = share)]
    lost: f64,

    /// In real time: every tracker, the router and the service of the site as processes of this machine
    #[cfg(feature = "daemon")]
    #[arg(long)]
    live: bool,

    /// The tracker, by the names of kehai-tracker run
    #[arg(long, value_name = "NAME", default_value_t)]
    tracker: Selected,

    /// The kehai-tracker of --live [default: the one beside this program]
    #[cfg(feature = "daemon")]
    #[arg(long, value_name = "FILE", requires = "live")]
    program: Option<std::path::PathBuf>,

    /// A module that falls silent half-way, as "south border"
    #[cfg_attr(feature = "daemon", arg(conflicts_with = "live"))]
    #[arg(long, value_name = "MODULE")]
    silent: Option<String>,

    /// List the crossings after which a person had another number
    #[arg(long)]
    list: bool,
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share| (0.0..1.0).contains(share));
    share.ok_or_else(|| "a share is from 0 to less than 1".to_owned())
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let conditions = [0.0, arguments.lost];
    let seeds: Vec<u64> = arguments.seeds.clone().collect();
    let bar = bar("halls")?;
    bar.set_length(seeds.len() as u64);
    let first = Halls {
        borders: arguments.borders,
        people: arguments.people as usize,
        seconds: arguments.seconds as f64,
        seed: *arguments.seeds.start(),
        silent: None,
        tracker: arguments.tracker,
    };
    let number = |name| {
        first.module(name).ok_or_else(|| format!("--silent: there is no module \"{name}\" in the halls"))
    };
    let silent = arguments.silent.as_deref().map(number).transpose()?;
    let halls = |seed| Halls { seed, silent, ..first };
    #[cfg(feature = "daemon")]
    if arguments.live {
        bar.finish_and_clear();
        return live(arguments, &conditions, &first, &seeds);
    }
    let one = |seed: &u64| {
        let followed = play(&halls(*seed))?;
        bar.inc(1);
        Ok(conditions.map(|lost| followed.together(lost)))
    };
    let runs: Vec<[Outcome; 2]> = seeds.par_iter().map(one).collect::<Result<_, String>>()?;
    let mut columns = conditions.map(|lost| (heading(lost), Outcome::default()));
    for (seed, outcomes) in seeds.iter().zip(runs) {
        for ((heading, all), outcome) in columns.iter_mut().zip(outcomes) {
            if arguments.list {
                bar.suspend(|| list(heading, *seed, &outcome));
            }
            all.add(outcome);
        }
    }
    bar.finish_and_clear();
    print!("{}", markdown(&columns));
    Ok(())
}

fn heading(lost: f64) -> String {
    if lost == 0.0 { "four and a site".into() } else { format!("{:.0} % lost", lost * 100.0) }
}

/// In real time.
#[cfg(feature = "daemon")]
fn live(
    arguments: &Arguments,
    conditions: &[f64; 2],
    first: &Halls,
    seeds: &[u64],
) -> Result<(), Box<dyn Error>> {
    let program = live::tracker(arguments.program.as_deref())?;
    let mut columns = conditions.map(|lost| (heading(lost), Outcome::default()));
    for &seed in seeds {
        let halls = Halls { seed, ..*first };
        for (&lost, (heading, all)) in conditions.iter().zip(&mut columns) {
            let found = live::play(&halls, lost, &program)?;
            println!(
                "seed {seed}, {heading}: {} pictures, {} of them missed; of a module's reports at most {:.1} % lost to the one tracker, {:.1} % to an area's; a frame of an area has up to {} bytes",
                found.pictures, found.missed, found.lost_percent[0], found.lost_percent[1], found.frame_bytes
            );
            if arguments.list {
                list(heading, seed, &found.outcome);
            }
            all.add(found.outcome);
        }
    }
    print!("{}", markdown(&columns));
    Ok(())
}

fn list(heading: &str, seed: u64, outcome: &Outcome) {
    for (who, side) in [("one tracker", &outcome.one), (heading, &outcome.four)] {
        for found in &side.renumbered {
            let [from, to] = found.halls.map(|hall| AREAS.get(hall).copied().unwrap_or_default());
            let by = if found.at_border { ", by the border alone" } else { "" };
            println!(
                "seed {seed}, {who}: {:.1} s, person {}, {from} to {to}: {} became {}{by}",
                found.t_s, found.person, found.numbers[0], found.numbers[1]
            );
        }
    }
}
