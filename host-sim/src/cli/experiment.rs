//! `kehai-sim experiment`: tables of trackers in simulated scenes, from one command.

use std::error::Error;
use std::fs::File;
use std::path::PathBuf;

use clap::Args;
use host_sim::experiment::plan::Table;
use host_sim::experiment::{picture, runner, table};
use host_sim::run::{Conditions, Options};
use host_tracker::trackers::Choice;
use indicatif::{ProgressBar, ProgressStyle};

/// Run a table of experiments: scenes × people × seeds × trackers, on all cores
///
/// The same table and seeds give the same figures on every machine.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim experiment door --out door          every figure of docs/accuracy.md's first table
  kehai-sim experiment ideas --seeds 0-39       what each idea is worth, on development seeds
  kehai-sim experiment door --seeds 0-9 --tracker kehai --tracker lee")]
pub struct Arguments {
    /// The table
    #[arg(value_enum)]
    table: Table,

    /// First and last seed; 10000-10199 are held out: tune on none of them
    #[arg(long, value_name = "FIRST-LAST", default_value = "10000-10199", value_parser = seeds)]
    seeds: std::ops::RangeInclusive<u64>,

    /// Trackers in the place of the table's own
    #[arg(long, value_name = "NAME")]
    tracker: Vec<Choice>,

    /// Network and clocks: ideal, lan or disturbed
    #[arg(long, value_name = "NAME", default_value = "lan", value_parser = super::scene::conditions)]
    network: Conditions,

    /// Write table.csv, table.md and table.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn seeds(text: &str) -> Result<std::ops::RangeInclusive<u64>, String> {
    let bounds =
        text.split_once('-').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    match bounds {
        Some((first, last)) if first <= last => Ok(first..=last),
        _ => Err("first and last seed, as in 10000-10199".into()),
    }
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let cases = arguments.table.cases(&arguments.tracker);
    let runs = cases.len() as u64 * (arguments.seeds.end() - arguments.seeds.start() + 1);
    let bar = ProgressBar::new(runs);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {eta} left")?);
    let options = Options { conditions: arguments.network, ..Options::default() };
    let rows = runner::run(&cases, &arguments.seeds, &options, || bar.inc(1))?;
    bar.finish_and_clear();
    let text = format!("{}\n{}", table::success_markdown(&rows), table::figures_markdown(&rows));
    print!("{text}");
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        table::write_csv(&rows, File::create(folder.join("table.csv"))?)?;
        std::fs::write(folder.join("table.md"), text)?;
        let title = "People counted right, by number of people";
        std::fs::write(folder.join("table.svg"), picture::draw(&rows, title).to_string())?;
    }
    Ok(())
}
