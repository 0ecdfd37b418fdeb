//! `kehai-sim score`: tracks against the truth.

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::score::pairing::{Paired, score_lines};
use host_sim::score::{Figures, Region, Scorer, Settings};
use kehai_tracking::jsonl::{Line, Lines};
use serde::Serialize;

/// Judge tracks against the truth: counts, CLEAR MOT, IDF1, HOTA, GOSPA, errors and covariances
///
/// Both files hold one JSON object a line. A frame is a line of the truth with the tracks nearest in time, at
/// most 0.05 s away; truth more than 0.5 s from any line of tracks is a frame without tracks. Confirmed and
/// occluded tracks are judged. With a region, people outside are not judged, and neither are tracks that
/// belong to them (nearest within the gate) nor unpaired tracks outside.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim score truth.jsonl tracks.jsonl
  kehai-sim score truth.jsonl tracks.jsonl --region -2,-2.6,2,1 --area -1,-1,1,1 --json")]
pub struct Arguments {
    /// Where people were: {"t":…,"people":[{"id":…,"x":…,"y":…,"beams":…}]}, beams if known
    #[arg(value_name = "TRUTH.jsonl")]
    truth: PathBuf,

    /// What the tracker said: {"t":…,"tracks":[{"id":…,"x":…,"y":…,"cov":[…],"state":…}]}
    #[arg(value_name = "TRACKS.jsonl")]
    tracks: PathBuf,

    /// A track farther than this from a person is not that person, m
    #[arg(long, value_name = "METRES", default_value = "0.5", value_parser = gate, allow_hyphen_values = true)]
    gate: f64,

    /// Judge only here: two opposite corners in metres
    #[arg(long, value_name = "X,Y,X,Y", allow_hyphen_values = true)]
    region: Option<Region>,

    /// Count here; the region without it
    #[arg(long, value_name = "X,Y,X,Y", allow_hyphen_values = true)]
    area: Option<Region>,

    /// Judge tentative tracks as well
    #[arg(long)]
    tentative: bool,

    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed {
    #[serde(flatten)]
    figures: Figures,
    #[serde(flatten)]
    lines: PairedLines,
}

#[derive(Serialize)]
struct PairedLines {
    silent_frames: u64,
    truth_lines_between: u64,
    track_lines_without_truth: u64,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut scorer = Scorer::new(Settings {
        gate_m: arguments.gate,
        region: arguments.region,
        area: arguments.area,
        tentative: arguments.tentative,
    });
    let paired = score_lines(&mut scorer, lines(&arguments.truth)?, lines(&arguments.tracks)?)?;
    if paired.frames == 0 {
        let (truth, tracks) = (arguments.truth.display(), arguments.tracks.display());
        return Err(format!("no line of {tracks} is within 0.05 s of a line of {truth}").into());
    }
    let figures = scorer.finish().0.figures();
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let lines = PairedLines {
            silent_frames: paired.silent,
            truth_lines_between: paired.between,
            track_lines_without_truth: paired.without_truth,
        };
        serde_json::to_writer(&mut out, &Printed { figures, lines })?;
        writeln!(out)?;
    } else {
        let Paired { silent, between, without_truth, .. } = paired;
        writeln!(
            out,
            "{}: {} frames, {} people and {} tracks in them",
            arguments.tracks.display(),
            figures.frames,
            figures.people,
            figures.tracks
        )?;
        writeln!(out, "{}", judged(arguments.region, arguments.area))?;
        if silent + between + without_truth > 0 {
            writeln!(
                out,
                "  lines        {silent} of truth in a silence of the tracker, {between} between, \
                 {without_truth} of tracks without truth"
            )?;
        }
        write!(out, "{figures}")?;
    }
    Ok(())
}

/// Where people are judged and counted.
fn judged(region: Option<Region>, area: Option<Region>) -> String {
    let counted = area.filter(|area| Some(*area) != region).map(|area| format!(", counted in {area}"));
    let counted = counted.unwrap_or_default();
    match region {
        Some(region) => format!("  judged in {region}{counted}"),
        None => format!("  judged everywhere{counted}; --region X,Y,X,Y judges a part"),
    }
}

fn lines<T: Line>(path: &Path) -> Result<Lines<BufReader<File>, T>, String> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|error| format!("{name}: {error}"))?;
    Ok(Lines::new(BufReader::new(file), &name))
}

fn gate(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|gate: &f64| *gate > 0.0 && *gate < 100.0).ok_or("metres, above 0".into())
}
