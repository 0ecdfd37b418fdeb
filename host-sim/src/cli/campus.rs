//! `kehai-sim campus`: how large a site one service can put together.

use std::error::Error;

use clap::Args;
use host_sim::halls::load::{Size, measure};

/// Measure what the service of a site costs: frames of so many areas, read and put together ten times a second
///
/// A quarter of the people walk to and fro over the borders. On one thread of this machine, as kehai-tracker site does it; without network, map and MQTT.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-sim campus --areas 10 --areas 100 --people 20 --modules 100")]
pub struct Arguments {
    /// How many areas; several give a line each
    #[arg(long, value_name = "N", default_values = ["4", "10", "30", "100"], value_parser = clap::value_parser!(u64).range(1..=100))]
    areas: Vec<u64>,

    /// People in each area
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(0..=1000))]
    people: u64,

    /// Modules of each area
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(0..=1000))]
    modules: u64,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    println!(
        "| areas | people shown | frame, kB | all frames, MB/s | to read one, ms | picture, ms | of a core | hand-overs/s | another number |"
    );
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for &areas in &arguments.areas {
        let size = Size {
            areas: areas as usize,
            people: arguments.people as usize,
            modules: arguments.modules as usize,
        };
        let load = measure(&size)?;
        let kilobytes = load.frame_bytes as f64 * 1e-3;
        println!(
            "| {areas} | {} | {kilobytes:.1} | {:.1} | {:.2} | {:.1} | {:.0} % | {:.0} | {} |",
            load.people,
            kilobytes * areas as f64 * 1e-2,
            load.read.as_secs_f64() * 1e3,
            load.picture.as_secs_f64() * 1e3,
            load.core_share(size.areas) * 100.0,
            load.handed_over_hz,
            load.renumbered
        );
    }
    Ok(())
}
