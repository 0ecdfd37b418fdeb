//! `kehai-sim replay`: recorded scans through the emulated sensor, the driver and the pipeline.

use std::error::Error;
use std::io::{BufWriter, IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use host_sim::recording::Recording;
use host_sim::replay::{Learn, Replay, module_name};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use kehai::background::LEARN_SCANS_MIN;

/// Judge a recording as a module would have: recorded scans → emulated sensor → driver → candidates
///
/// The scans leave the emulated sensor as SCIP bytes and come back through the driver and the pipeline of the
/// firmware. The same recording gives the same output every time.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim replay walk.csv                        figures, learned as a module learns
  kehai-sim replay walk.csv --learn all --svg walk.svg
  kehai-sim replay walk.csv --json > candidates.jsonl")]
pub struct Arguments {
    /// The recording
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,

    /// Learn the empty room from this many scans in which nobody moves, or from all of the recording first
    #[arg(long, value_name = "N|all", default_value = "60", value_parser = learn)]
    learn: Learn,

    /// Print one JSON object a scan instead of figures
    #[arg(long)]
    json: bool,

    /// Draw the recording: background, foreground, candidates
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let recording = Recording::open(&arguments.file)?;
    let name = module_name(&arguments.file);
    let bar = progress_bar();
    let replay = Replay::run(&recording, &name, arguments.learn, |done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    })
    .map_err(|error| format!("{}: {error}", arguments.file.display()))?;
    bar.finish_and_clear();
    if let Some(path) = &arguments.svg {
        replay
            .picture
            .save(path)
            .map_err(|error| format!("{}: cannot be written: {error}", path.display()))?;
    }
    let mut out = BufWriter::new(std::io::stdout().lock());
    if arguments.json {
        for line in &replay.lines {
            serde_json::to_writer(&mut out, line)?;
            writeln!(out)?;
        }
    } else {
        let summary = &replay.summary;
        writeln!(
            out,
            "{name}: {} of {} scans decoded, {} judged",
            summary.decoded, summary.recorded, summary.judged
        )?;
        writeln!(
            out,
            "  beams       {} wall, {} open, {} unknown",
            summary.wall_beams, summary.open_beams, summary.unknown_beams
        )?;
        writeln!(out, "  candidates  wide in {} scans, any in {}", summary.with_wide, summary.with_any)?;
        writeln!(
            out,
            "  at once     {} wide ({} in three scans in a row), {} of any kind",
            summary.most_wide, summary.most_wide_in_three, summary.most_any
        )?;
        if summary.judged == 0 {
            writeln!(out, "  nothing was judged: people move through all of it; try --learn all")?;
        }
        if let Some(path) = &arguments.svg {
            writeln!(out, "  picture     {}", path.display())?;
        }
    }
    out.flush()?;
    Ok(())
}

/// A bar on stderr when somebody watches.
fn progress_bar() -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} scans, {eta} to go")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(None, target).with_style(style)
}

fn learn(text: &str) -> Result<Learn, String> {
    if text == "all" {
        return Ok(Learn::All);
    }
    let scans: u16 =
        text.parse().map_err(|_| format!("a number of scans from {LEARN_SCANS_MIN} on, or all"))?;
    if scans < LEARN_SCANS_MIN {
        return Err(format!("{scans} scans are too few to know a room: at least {LEARN_SCANS_MIN}"));
    }
    Ok(Learn::Scans(scans))
}
