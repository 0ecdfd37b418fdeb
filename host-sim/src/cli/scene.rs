//! `kehai-sim scene`: a simulated world through sensors, modules, network and tracker, faster than real time.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::baselines::Choice;
use host_sim::experiment::log::{around, zone};
use host_sim::picture::site::SitePicture;
use host_sim::run::{Conditions, Options, Record, scans};
use host_sim::score::{Estimate, Figures, Frame, Region, Scorer, Settings, Target};
use host_sim::world::World;
use host_sim::world::body::Section;
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use kehai_tracking::jsonl::{TracksLine, TruthLine, write_line};
use kehai_tracking::tracker::LifeCycle;
use serde::Serialize;

/// Run a scene: world → sensors → modules → network → tracker, faster than real time
///
/// The same scene, seed and options give the same output every time. Tracks are judged against the truth in the
/// rectangle around the first zone that counts, or everywhere where there is none; `kehai-sim score` judges
/// elsewhere.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim scene crossing --out crossing           candidates, tracks, truth, a picture
  kehai-sim scene crossing --scans crossing         scans to replay, as of a sensor: crossing/wall.csv
  kehai-sim scene door-area --people 5 --condition H --sensors 3 --seed 10000
  kehai-sim scene standing --network disturbed --json")]
pub struct Arguments {
    /// The scene's file, or the name of a built-in one
    #[arg(value_name = "FILE.toml")]
    file: String,

    /// Seed of everything random [default: the scene's]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// Write candidates.jsonl, tracks.jsonl, truth.jsonl and scene.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Write what the sensors measure, MODULE.csv each, and site.toml to this folder: recordings for kehai-sim replay
    #[arg(long, value_name = "DIR")]
    scans: Option<PathBuf>,

    /// Print the figures as one JSON object
    #[arg(long)]
    json: bool,

    /// The tracker
    #[arg(long, value_name = "NAME", default_value_t = Choice::default())]
    tracker: Choice,

    /// People of the gathering
    #[arg(long, value_name = "N")]
    people: Option<usize>,

    /// How they come and wait: D spread, H dense, P in pairs, T seen at the thighs
    #[arg(long, value_name = "D|H|P|T")]
    condition: Option<Letter>,

    /// An arrangement of sensors, by its name in the scene
    #[arg(long, value_name = "NAME")]
    sensors: Option<String>,

    /// What the plane cuts of everybody: torso, torso-only or thighs
    #[arg(long, value_name = "PART")]
    section: Option<Section>,

    /// Watch it at least so long
    #[arg(long, value_name = "N")]
    seconds: Option<u32>,

    /// Network and clocks: ideal, lan or disturbed
    #[arg(long, value_name = "NAME", default_value = "lan", value_parser = conditions)]
    network: Conditions,

    /// Keep everything the host received, and truth, for development
    #[arg(long, value_name = "FILE")]
    save_arrivals: Option<PathBuf>,
}

pub fn conditions(text: &str) -> Result<Conditions, String> {
    Conditions::named(text).ok_or_else(|| {
        let names: Vec<&str> = Conditions::NAMED.iter().map(|(name, _)| *name).collect();
        format!("one of {}", names.join(", "))
    })
}

/// The figures of a run.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    scene: &'a str,
    seed: u64,
    tracker: String,
    duration_s: f64,
    modules: usize,
    datagrams: usize,
    /// Everybody who was ever there.
    people: usize,
    /// The most at one time, true and found.
    most_true: usize,
    most_found: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    events: Option<host_sim::world::Events>,
    /// Where tracks are judged, X,Y,X,Y; everywhere without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<String>,
    /// Tracks against the truth.
    score: Figures,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::load(&arguments.file)?;
    let Arguments { people, condition, sensors, section, seconds, .. } = arguments;
    let variation = Variation {
        people: *people,
        condition: *condition,
        sensors: sensors.clone(),
        section: *section,
        duration_s: *seconds,
    };
    scene.vary(&variation).map_err(|error| format!("{}: {error}", arguments.file))?;
    let seed = arguments.seed.unwrap_or(scene.seed);
    let options = Options { conditions: arguments.network, ..Options::default() };
    let record = Record::of(&scene, seed, &options)?;
    if let Some(path) = &arguments.save_arrivals {
        record.save(path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    if let Some(folder) = &arguments.scans {
        save_scans(folder, &arguments.file, &scene, seed)?;
    }
    let tracks = record.tracks_lines(arguments.tracker);
    let truth: Vec<TruthLine> = record.truth_lines().collect();
    let mut ids: Vec<u64> = truth.iter().flat_map(|line| line.people.iter().map(|who| who.id)).collect();
    ids.sort_unstable();
    ids.dedup();
    let summary = Summary {
        scene: &arguments.file,
        seed,
        tracker: arguments.tracker.to_string(),
        duration_s: record.duration_s,
        modules: record.modules.len(),
        datagrams: record.arrivals.len(),
        people: ids.len(),
        most_true: truth.iter().map(|line| line.people.len()).max().unwrap_or(0),
        most_found: tracks.iter().map(found).max().unwrap_or(0),
        events: record.events,
        region: area(&record).map(|area| area.to_string()),
        score: score(&record, &truth, &tracks),
    };
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        write(&folder.join("candidates.jsonl"), &record.candidates_lines())?;
        write(&folder.join("tracks.jsonl"), &tracks)?;
        write(&folder.join("truth.jsonl"), &truth)?;
        let events = record.events.map(|events| {
            vec![("all in", events.all_in_s), ("door opens", events.door_opens_s), ("empty", events.empty_s)]
        });
        let picture = SitePicture {
            title: format!("{}, seed {seed}", arguments.file),
            subtitle: format!(
                "{}: {} modules, {} people, tracker {}",
                scene.about, summary.modules, summary.people, summary.tracker
            ),
            site: &record.site,
            truth: &truth,
            tracks: &tracks,
            marks: events.unwrap_or_default(),
        };
        let path = folder.join("scene.svg");
        picture.save(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    print(&summary, area(&record), arguments.json)
}

/// What the sensors measure, and the site. A file of another site is not written over.
fn save_scans(folder: &Path, name: &str, scene: &Scene, seed: u64) -> Result<(), Box<dyn Error>> {
    let at = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    std::fs::create_dir_all(folder).map_err(|error| at(folder, error))?;
    let (site, text) = (folder.join("site.toml"), toml::to_string(&scene.site)?);
    match std::fs::read(&site) {
        Ok(there) if there != text.as_bytes() => {
            return Err(format!("{}: is another site: give --scans another folder", site.display()).into());
        }
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(at(&site, error).into()),
        Ok(_) | Err(_) => {}
    }
    for (module, recording) in scans(&World::new(scene, seed)) {
        // A name may have a dot, which is no extension, and a slash, which is no folder.
        if Path::new(&module).file_name().is_none_or(|file| file != module.as_str()) {
            return Err(format!("{name}: module \"{module}\": no file can have this name: rename it").into());
        }
        let path = folder.join(format!("{module}.csv"));
        let written = || {
            let mut out = BufWriter::new(File::create(&path)?);
            recording.write(&mut out, &format!("simulated, {name}, seed {seed}"))?;
            out.flush()
        };
        written().map_err(|error| at(&path, error))?;
    }
    std::fs::write(&site, text).map_err(|error| at(&site, error))?;
    Ok(())
}

/// Where people are judged: around the zone that counts.
fn area(record: &Record) -> Option<Region> {
    zone(&record.site).and_then(around)
}

/// The tracks against the truth, where people are counted.
fn score(record: &Record, truth: &[TruthLine], tracks: &[TracksLine]) -> Figures {
    let area = area(record);
    let mut scorer = Scorer::new(Settings { region: area, area, ..Settings::default() });
    for (truth, tracks) in truth.iter().zip(tracks) {
        let people: Vec<Target> = truth.people.iter().map(Target::from).collect();
        let tracks: Vec<Estimate> = tracks.tracks.iter().map(Estimate::from).collect();
        scorer.frame(&Frame { t_s: truth.t, truth: &people, tracks: &tracks });
    }
    scorer.finish().0.figures()
}

/// Tracks that count.
fn found(line: &TracksLine) -> usize {
    line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative).count()
}

/// Lines of JSON to a file.
pub fn write(path: &Path, lines: &[impl Serialize]) -> Result<(), String> {
    let written = || {
        let mut out = BufWriter::new(File::create(path)?);
        lines.iter().try_for_each(|line| write_line(&mut out, line))?;
        out.flush()
    };
    written().map_err(|error| format!("{}: {error}", path.display()))
}

fn print(summary: &Summary<'_>, area: Option<Region>, json: bool) -> Result<(), Box<dyn Error>> {
    let mut out = std::io::stdout().lock();
    if json {
        serde_json::to_writer(&mut out, summary)?;
        writeln!(out)?;
        return Ok(());
    }
    let Summary { scene, seed, tracker, duration_s, modules, datagrams, .. } = summary;
    writeln!(out, "{scene}, seed {seed}: {duration_s:.1} s, {modules} modules, {datagrams} datagrams")?;
    if let Some(events) = summary.events {
        writeln!(
            out,
            "  all in at {:.1} s, door opens at {:.1} s, empty at {:.1} s",
            events.all_in_s, events.door_opens_s, events.empty_s
        )?;
    }
    writeln!(
        out,
        "  {} people, at most {} at once; tracker {tracker} found at most {}",
        summary.people, summary.most_true, summary.most_found
    )?;
    let judged = area.map_or_else(
        || "  judged everywhere".to_owned(),
        |area| format!("  judged in {area}, as kehai-sim score does with --region {area}"),
    );
    writeln!(out, "{judged}")?;
    write!(out, "{}", summary.score)?;
    Ok(())
}
