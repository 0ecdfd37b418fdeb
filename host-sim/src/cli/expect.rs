//! `kehai-sim expect`: the table from which the handover page takes what count is to be expected.

use std::error::Error;
use std::ops::RangeInclusive;

use clap::Args;
use host_sim::plan::sample::sample;

/// Simulate sampled rooms with good and poor layouts, and print how well people are counted in each, as CSV
///
/// The handover page of the tracker looks up those that see as much as the site's modules do. One run is a minute.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-sim expect --runs 3 > docs/tables/expected.csv")]
pub struct Arguments {
    /// First and last room
    #[arg(long, value_name = "FIRST-LAST", default_value = "0-29", value_parser = super::runs::seeds)]
    rooms: RangeInclusive<u64>,

    /// Runs of each layout with each number of people
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut csv = csv::Writer::from_writer(std::io::stdout().lock());
    let bar = super::runs::bar("rooms")?;
    bar.set_length(arguments.rooms.clone().count() as u64);
    for room in arguments.rooms.clone() {
        for line in sample(room, arguments.runs)? {
            csv.serialize(line)?;
        }
        csv.flush()?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}
