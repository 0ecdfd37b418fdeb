//! `kehai-sim soak`: devices and tracker for simulated weeks.

use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use host_sim::soak::{Sample, Soak, drift, tenths};
use host_sim::world::scene::Scene;

/// Run devices and tracker for simulated weeks, and fail if memory, clocks or backgrounds drift
///
/// Two sensors with the firmware's tasks, a network, and the tracker, in a room that people visit and sit in. After each
/// tenth a line: bytes in use, error of the sessions' clocks against the truth, walls that are elsewhere than at first, tracks.
/// People are judged in the first zone of the scene that counts, or everywhere where there is none.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim soak --scans 40000                  half an hour of two sensors: some seconds
  kehai-sim soak --scans 10000000               six days: a day has 1.7 million scans of two sensors")]
pub struct Arguments {
    /// Scans of all sensors together; 40000 at least
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    scans: u64,

    /// Another scene than the built-in `soak`: its name, or a file
    #[arg(long, value_name = "SCENE", default_value = "soak")]
    scene: PathBuf,

    /// The seed [default: the scene's]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// End with the first tenth that is done after so many minutes
    #[arg(long, value_name = "MINUTES")]
    at_most_min: Option<u64>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = Scene::load(&arguments.scene.to_string_lossy())?;
    let begun = Instant::now();
    let most = arguments.at_most_min.map(|minutes| Duration::from_secs(60 * minutes));
    let mut soak = Soak::new(&scene, arguments.seed.unwrap_or(scene.seed))
        .map_err(|error| format!("{}: {error}", arguments.scene.display()))?;
    let heap = || crate::HEAP.allocated() as u64;
    println!(
        "     scans  days  kB in use, most  clock: mean, worst, ms  walls elsewhere, %  tracks  numbers  visits  right, %"
    );
    let mut first = None;
    let mut drifts = Vec::new();
    for scans in tenths(arguments.scans) {
        let sample = soak.until(scans, &heap)?;
        print(&sample);
        let found = drift(first.get_or_insert(sample), &sample, soak.size());
        found.iter().for_each(|drift| println!("  {drift}"));
        drifts.extend(found);
        if most.is_some_and(|most| begun.elapsed() > most) {
            println!("{scans} of {} scans in {} min", arguments.scans, begun.elapsed().as_secs() / 60);
            break;
        }
    }
    match drifts.first() {
        None => Ok(()),
        Some(drift) => Err(format!("drifted: {drift}").into()),
    }
}

fn print(sample: &Sample) {
    println!(
        "{:>10} {:>5.2} {:>9.0} {:>6.0} {:>12.2} {:>10.2} {:>19.2} {:>7} {:>8} {:>7} {:>9.2}",
        sample.scans,
        sample.days,
        sample.heap_bytes as f64 * 1e-3,
        sample.most_bytes as f64 * 1e-3,
        sample.clock_ms,
        sample.worst_clock_ms,
        100.0 * sample.elsewhere_share,
        sample.tracks,
        sample.numbers,
        sample.visits,
        100.0 * sample.right_share,
    );
}
