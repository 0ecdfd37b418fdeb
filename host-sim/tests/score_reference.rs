//! Every figure of `kehai-sim score` against py-motmetrics, TrackEval and small computations in Python.
//!
//! `score_reference.py` makes the runs and scores them; its packages, with pinned versions, are kept in a virtual
//! environment under `target/tmp`. Without Python or network the comparison is left out, but not under CI.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use host_sim::score::pairing::score_lines;
use host_sim::score::{Scorer, Settings, Tally};
use kehai_tracking::jsonl::Lines;
use serde_json::{Map, Value};

/// Largest difference of a figure: what adding in another order and whole-number distances may do.
const TOLERANCE: f64 = 1e-6;
/// The region of interest of the cases that have one, as in `score_reference.py`.
const REGIONS: [(&str, &str); 2] = [("edge", "-1.5,-1.5,1.5,1.5"), ("edge-swaps", "-1,-2,2,1")];
/// The cases that are pooled, as in `score_reference.py`.
const POOLED: [&str; 4] = ["crowd", "swaps", "gaps", "clutter"];
/// What describes the files and not the tracker, and what follows from two figures that are compared.
const NOT_COMPARED: [&str; 5] =
    ["runs", "silent_frames", "truth_lines_between", "track_lines_without_truth", "detection_f"];

type Reference = BTreeMap<String, Map<String, Value>>;

fn here(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

fn run(command: &mut Command) -> Result<Output, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        Ok(output)
    } else {
        Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)))
    }
}

/// A Python with the packages of `score_requirements.txt`: made once, again when these change.
fn python() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("score-venv");
    let (python, done) = (folder.join("bin/python"), folder.join("installed.txt"));
    let wanted = fs::read_to_string(here("score_requirements.txt")).map_err(|error| error.to_string())?;
    if fs::read_to_string(&done).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--no-deps"])
        .args(["--disable-pip-version-check", "--requirement"])
        .arg(here("score_requirements.txt")))?;
    fs::write(done, wanted).map_err(|error| error.to_string())?;
    Ok(python)
}

fn reference(folder: &Path) -> Result<Reference, String> {
    let python = python()?;
    let script = |what| run(Command::new(&python).arg(here("score_reference.py")).arg(what).arg(folder));
    script("make")?;
    serde_json::from_slice(&script("score")?.stdout).map_err(|error| error.to_string())
}

/// What `kehai-sim score --json` says of a case.
fn ours(folder: &Path, name: &str) -> Map<String, Value> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    command.args(["score", "--json"]);
    command.arg(folder.join(format!("{name}-truth.jsonl"))).arg(folder.join(format!("{name}-tracks.jsonl")));
    if let Some((_, region)) = REGIONS.iter().find(|(case, _)| *case == name) {
        command.args(["--region", region]);
    }
    serde_json::from_slice(&run(&mut command).unwrap().stdout).unwrap()
}

/// The sums of a case, through the library.
fn tally(folder: &Path, name: &str) -> Tally {
    let file = |kind| BufReader::new(File::open(folder.join(format!("{name}-{kind}.jsonl"))).unwrap());
    let mut scorer = Scorer::new(Settings::default());
    score_lines(&mut scorer, Lines::new(file("truth"), "truth"), Lines::new(file("tracks"), "tracks"))
        .unwrap();
    scorer.finish().0
}

/// Whether two figures agree. A figure that is none is 0 or none to the others.
fn agree(ours: &Value, theirs: &Value) -> bool {
    match (ours.as_f64(), theirs.as_f64()) {
        (Some(ours), Some(theirs)) => (ours - theirs).abs() <= TOLERANCE,
        (None, Some(theirs)) => theirs == 0.0,
        (Some(_), None) => false,
        (None, None) => true,
    }
}

/// Compares a case and gives the number of figures compared and the largest difference.
fn compare(name: &str, ours: &Map<String, Value>, theirs: &Map<String, Value>) -> (usize, f64) {
    let mut largest = 0.0_f64;
    for (key, theirs) in theirs {
        let own = match key.as_str() {
            "motmetrics_idf1" => "idf1",
            "motmetrics_idp" => "id_precision",
            "motmetrics_idr" => "id_recall",
            key => key,
        };
        assert!(agree(&ours[own], theirs), "{name}: {key}: ours {}, theirs {theirs}", ours[own]);
        largest = largest.max((ours[own].as_f64().unwrap_or(0.0) - theirs.as_f64().unwrap_or(0.0)).abs());
    }
    for key in ours.keys().filter(|key| !NOT_COMPARED.contains(&key.as_str())) {
        assert!(theirs.contains_key(key), "{name}: the reference has no {key}");
    }
    (theirs.len(), largest)
}

#[test]
fn every_figure_agrees_with_independent_implementations() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("score-reference");
    fs::create_dir_all(&folder).unwrap();
    let reference = match reference(&folder) {
        Ok(reference) => reference,
        Err(problem) => return test_support::fail_in_ci_else_skip(problem),
    };
    assert_eq!(reference.len(), 10);
    for (name, theirs) in &reference {
        let ours = if name == "pooled" {
            let mut pooled = Tally::default();
            for case in POOLED {
                pooled += &tally(&folder, case);
            }
            serde_json::to_value(pooled.figures()).unwrap().as_object().unwrap().clone()
        } else {
            ours(&folder, name)
        };
        let (figures, largest) = compare(name, &ours, theirs);
        println!("{name:12} {figures} figures agree within {largest:.1e}");
    }
}
