//! `kehai-sim experiment counts`: is the count as sure as is said?

use std::error::Error;
use std::fs::File;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::Args;
use host_sim::baselines::Choice;
use host_sim::experiment::jobs::Runs;
use host_sim::experiment::{counts, counts_picture, counts_table, worlds};
use host_sim::world::variation::Letter;

use super::runs::{bar, seeds};

/// Compare what trackers say of the count, as a distribution, with how often it is true
///
/// Each second of each run of the door area in worlds that disagree, and of cases of another simulator. Printed are scores, and
/// what was said in bins with how often it came true.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Only these worlds, beside the own one [default: all]
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// How people come and wait: D, H, P, T
    #[arg(long, value_name = "LETTER", default_values = ["D", "H"])]
    condition: Vec<Letter>,
    /// How many people
    #[arg(long, value_name = "N", default_values = ["1", "3", "5", "7"])]
    people: Vec<usize>,
    /// First and last seed
    #[arg(long, value_name = "FIRST-LAST", default_value = "400-407", value_parser = seeds)]
    seeds: RangeInclusive<u64>,
    /// The trackers [default: kehai]
    #[arg(long, value_name = "NAME")]
    tracker: Vec<Choice>,
    /// A folder of cases of another simulator, with their truth
    #[arg(long, value_name = "DIR")]
    cases: Option<PathBuf>,
    /// Write counts.md, counts.csv with every bin, counts-seconds.csv with all that was said, and counts.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let Arguments { only, condition, people, seeds, tracker, cases, out } = arguments;
    let trackers = if tracker.is_empty() { vec![Choice::default()] } else { tracker.clone() };
    let worlds = worlds::Plan {
        only: only.clone(),
        conditions: condition.clone(),
        people: people.clone(),
        seeds: seeds.clone(),
        trackers,
    };
    let runs = Runs { bar: bar("counts")?, ..Runs::default() };
    let all = counts::run(&counts::Plan { worlds, cases: cases.clone() }, &runs)?;
    runs.bar.finish_and_clear();
    let judged = counts::judge(&all);
    let text = counts_table::markdown(&judged);
    print!("{text}");
    let Some(folder) = out else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let create = |name: &str| {
        let path = folder.join(name);
        File::create(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    counts_table::write_bins(&judged, create("counts.csv")?)?;
    counts_table::write_seconds(&all, create("counts-seconds.csv")?)?;
    std::fs::write(folder.join("counts.md"), &text)?;
    svg::write(create("counts.svg")?, &counts_picture::draw(&judged, "Is the count as sure as is said?"))?;
    Ok(())
}
