//! Every recording through emulated sensor, SCIP bytes, driver and pipeline: all of it, the same twice,
//! and the same as the pipeline makes of the ranges directly.

use std::path::{Path, PathBuf};

use host_sim::jsonl::CandidatesLine;
use host_sim::replay::{Learn, Replay};
use kehai::background::{Fingerprint, LearnRequest};
use kehai::pipeline::{Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, Scan, ScanTime};
use kehai_emulator::recording::Recording;

/// The recordings, or nothing in a clone that does not have them (never nothing in continuous integration).
fn recordings() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        test_support::fail_in_ci_else_skip(format!("no recordings at {}", folder.display()));
        return Vec::new();
    };
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "csv"))
        .filter(|path| !path.to_string_lossy().contains("_legs"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "no recording in {}", folder.display());
    paths
}

/// Results of the pipeline on the recorded ranges, without sensor, bytes and driver between.
fn judged_directly(recording: &Recording) -> Vec<CandidatesLine> {
    let geometry = Geometry::new(recording.geometry).unwrap();
    let learn = LearnRequest { scans: recording.scans.len() as u16, even_if_moving: true };
    let mut pipeline = Box::new(Pipeline::<MAX_BEAMS>::new());
    let fingerprint = Fingerprint::of(b"direct", &geometry);
    pipeline.configure(&geometry, Settings { learn, ..Settings::default() }, fingerprint).unwrap();
    let mut lines = Vec::new();
    for pass in 0..2 {
        for (number, recorded) in (1..).zip(&recording.scans) {
            let time = ScanTime { sensor_ms: recorded.stamp_us / 1000, ..ScanTime::default() };
            let scan = Scan { geometry: &geometry, ranges_mm: &recorded.ranges_mm, time };
            let judgement = pipeline.process(&scan);
            if pass == 1 {
                let line =
                    CandidatesLine::new(recorded.stamp_us as f64 / 1e6, "direct", &geometry, judgement);
                lines.push(CandidatesLine { seq: number, ..line });
            }
        }
    }
    lines
}

#[test]
fn every_recording_runs_to_its_end_and_gives_the_same_twice() {
    for path in recordings() {
        let recording = Recording::open(&path).unwrap();
        let run = || Replay::run(&recording, "direct", Learn::All, |_, _| {}).unwrap();
        let replay = run();
        let name = path.file_stem().unwrap().to_string_lossy();
        println!("{name}: {}", replay.summary.in_words());
        assert_eq!(replay.summary.decoded, recording.scans.len(), "{name}: scans are missing");
        assert_eq!(replay.lines, run().lines, "{name}: two runs differ");
        // The sensor's clock runs 0.3 % fast, so only how long things have stood still may differ.
        let without_time = |lines: Vec<CandidatesLine>| {
            let mut lines = lines;
            lines
                .iter_mut()
                .flat_map(|line| &mut line.candidates)
                .for_each(|candidate| candidate.static_s = 0.0);
            lines
        };
        let direct = without_time(judged_directly(&recording));
        for (line, direct) in without_time(replay.lines).iter().zip(&direct) {
            assert_eq!(line, direct, "{name}: what came through the driver differs from what was recorded");
        }
    }
}
