//! `kehai-sim replay`: recorded scans through the emulated sensor, the driver and the pipeline; with a site, through
//! whole modules and the tracker (`replay_site`).

use std::error::Error;
use std::io::{BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::baselines::Choice;
use host_sim::replay::{Learn, Replay, module_name};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use kehai::background::LEARN_SCANS_MIN;
use kehai::floor::sensfloor::Layout;
use kehai_emulator::recording::Recording;

use super::replay_site::Together;

/// Judge a recording as a module would have: recorded scans → emulated sensor → driver → candidates
///
/// The scans leave the emulated sensor as SCIP bytes and come back through the driver and the pipeline of the
/// firmware. The same recording gives the same output every time. With a site, recordings of several sensors are
/// played together, each NAME=FILE.csv, through whole modules and the tracker.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim replay walk.csv                        figures, learned as a module learns
  kehai-sim replay walk.csv --learn all --svg walk.svg
  kehai-sim replay walk.csv --json > candidates.jsonl
  kehai-sim replay --site hall.toml left=l.csv right=r.csv --learn all --out walk
  kehai-sim replay --floor walk.csv                frames of a SensFloor → tracks")]
pub struct Arguments {
    /// The recording; with --site one or more NAME=FILE.csv, NAME a module of the site
    #[arg(value_name = "FILE.csv", required_unless_present = "floor", conflicts_with = "floor")]
    files: Vec<String>,

    /// Play recorded frames of a SensFloor instead (docs/floor.md)
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["site", "learn", "svg", "out", "tracker"])]
    floor: Option<PathBuf>,

    /// Which tiles the floor has [default: all of the group that speaks most]
    #[arg(long, value_name = "GROUP,X,Y,COLUMNS,ROWS", requires = "floor", value_parser = super::replay_floor::layout)]
    tiles: Option<Layout>,

    /// Where the modules are: play the recordings together, and follow people
    #[arg(long, value_name = "FILE.toml")]
    site: Option<PathBuf>,

    /// Learn the empty room from this many scans without movement, or from all of the recording first
    #[arg(long, value_name = "N|all", default_value = "60", value_parser = learn)]
    learn: Learn,

    /// Print JSON lines instead of figures: one a scan, with --site one of tracks every 0.1 s
    #[arg(long)]
    json: bool,

    /// Draw the recording: background, foreground, candidates
    #[arg(long, value_name = "FILE", conflicts_with = "site")]
    svg: Option<PathBuf>,

    /// Write candidates.jsonl and tracks.jsonl to this folder
    #[arg(long, value_name = "DIR", requires = "site")]
    out: Option<PathBuf>,

    /// The tracker [default: kehai]
    #[arg(long, value_name = "NAME", requires = "site")]
    tracker: Option<Choice>,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if let Some(path) = &arguments.floor {
        return super::replay_floor::run(path, arguments.tiles, arguments.json);
    }
    if let Some(site) = &arguments.site {
        let bar = progress_bar("modules");
        let together = Together {
            site,
            files: &arguments.files,
            learn: arguments.learn,
            tracker: arguments.tracker.unwrap_or_default(),
            out: arguments.out.as_deref(),
            json: arguments.json,
        };
        return together.run(|done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
            if done == of {
                bar.finish_and_clear();
            }
        });
    }
    let [file] = arguments.files.as_slice() else {
        return Err("several recordings need --site FILE.toml, which says where their sensors are".into());
    };
    let path = Path::new(file);
    let recording = Recording::open(path)?;
    let name = module_name(path);
    let bar = progress_bar("scans");
    let replay = Replay::run(&recording, &name, arguments.learn, |done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    })
    .map_err(|error| format!("{file}: {error}"))?;
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

/// A bar on stderr, if that is a terminal.
fn progress_bar(what: &str) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let style = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} to go"))
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
