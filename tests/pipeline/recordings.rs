//! Background, clusters and candidates on real recordings, against known facts about them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use kehai::background::{BeamState, Fingerprint, LearnRequest, Learning};
use kehai::candidate::Candidate;
use kehai::pipeline::{Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, Scan, ScanTime};
use kehai_emulator::recording::{RecordedScan, Recording};

/// A recording and its checked geometry.
struct Clip {
    geometry: Geometry,
    scans: Vec<RecordedScan>,
}

fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/recordings");
    if folder.is_dir() {
        return Some(folder);
    }
    test_support::fail_in_ci_else_skip(format!("no recordings at {}", folder.display()));
    None
}

fn open(folder: &Path, name: &str) -> Clip {
    let Recording { geometry, scans } = Recording::open(&folder.join(name).with_extension("csv")).unwrap();
    Clip { geometry: Geometry::new(geometry).unwrap(), scans }
}

fn pipeline(recording: &Clip) -> Box<Pipeline<MAX_BEAMS>> {
    let mut pipeline = Box::new(Pipeline::new());
    let fingerprint = Fingerprint::of(b"recording", &recording.geometry);
    pipeline.configure(&recording.geometry, Settings::default(), fingerprint).unwrap();
    pipeline
}

impl Clip {
    fn process<'p>(&self, index: usize, pipeline: &'p mut Pipeline<MAX_BEAMS>) -> &'p Judgement {
        let RecordedScan { stamp_us, ranges_mm } = &self.scans[index];
        let time = ScanTime { sensor_ms: stamp_us / 1000, stamp_us: *stamp_us, uncertainty_us: 0 };
        pipeline.process(&Scan { geometry: &self.geometry, ranges_mm, time })
    }

    /// A pipeline that has learned from the first `scans` of the recording.
    fn learned(&self, scans: usize) -> Box<Pipeline<MAX_BEAMS>> {
        let mut pipeline = pipeline(self);
        pipeline.learn(LearnRequest { scans: scans as u16, even_if_moving: true }).unwrap();
        for index in 0..scans {
            self.process(index, &mut pipeline);
        }
        assert!(pipeline.background().is_known());
        pipeline
    }
}

/// Shares in percent for messages.
fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

const ALL: [&str; 12] = [
    "tamu_ex1",
    "tamu_ex2",
    "tamu_ex4",
    "tamu_ex6",
    "angus_demo_simple",
    "obstacle_front",
    "obstacle_rear",
    "uhg_positive_1",
    "uhg_positive_2",
    "uhg_positive_3",
    "uhg_positive_5",
    "tim_neg",
];

#[test]
fn the_learned_model_is_the_exact_median() {
    let Some(folder) = folder() else { return };
    for name in ALL {
        let recording = open(&folder, name);
        for scans in [60, recording.scans.len()] {
            let pipeline = recording.learned(scans);
            let (mut walls, mut good, mut worst) = (0, 0, vec![]);
            for (beam, profile) in pipeline.background().profile().enumerate() {
                if profile.state != BeamState::Wall {
                    continue;
                }
                let values = recording.scans[..scans].iter().map(|scan| scan.ranges_mm[beam]);
                let mut valid: Vec<u16> =
                    values.filter(|&value| recording.geometry.reading(value).range_mm().is_some()).collect();
                valid.sort_unstable();
                let median = valid[valid.len() / 2];
                let off = median.abs_diff(profile.far_mm).min(median.abs_diff(profile.near_mm));
                walls += 1;
                good += usize::from(off <= 20);
                if off > 20 {
                    worst.push((beam, median, profile.near_mm, profile.far_mm));
                }
            }
            println!(
                "{name}, {scans} scans: {walls} wall beams, {:.2} % within 20 mm; off: {worst:?}",
                percent(good, walls)
            );
            assert!(good * 100 >= walls * 99, "{name}");
        }
    }
}

/// Scans from `from` on with a wide and with any candidate, and how many of them were judged.
fn false_candidates(
    recording: &Clip,
    pipeline: &mut Pipeline<MAX_BEAMS>,
    from: usize,
) -> (usize, usize, usize) {
    let (mut wide, mut any, mut judged) = (0, 0, 0);
    for index in 0..recording.scans.len() {
        let judgement = recording.process(index, pipeline);
        if index >= from {
            wide += usize::from(judgement.candidates().iter().any(|candidate| !candidate.narrow));
            any += usize::from(!judgement.candidates().is_empty());
            judged += usize::from(judgement.background_version > 0);
        }
    }
    (wide, any, judged)
}

/// A person sits 4.7 m away in this "empty" scene and shifts by a third of a metre at scan 60: the
/// learning notices and begins anew until nothing moves.
#[test]
fn an_empty_scene_stays_empty() {
    let Some(folder) = folder() else { return };
    let recording = open(&folder, "tim_neg");
    let (wide, any, judged) = false_candidates(&recording, &mut pipeline(&recording), 60);
    let scans = recording.scans.len() - 60;
    println!("tim_neg: {judged} of {scans} scans judged; a wide candidate in {wide}, any in {any}");
    assert!(wide * 100 <= judged && any * 20 <= judged);
    assert!(judged * 2 >= scans);
    let mut forced = pipeline(&recording);
    forced.learn(LearnRequest { scans: 60, even_if_moving: true }).unwrap();
    let (wide, any, judged) = false_candidates(&recording, &mut forced, 60);
    println!("learned although a person moved: {judged} judged; wide in {wide}, any in {any}");
}

/// Where the nearest point of a candidate is, m.
fn nearest_point_m(recording: &Clip, candidate: &Candidate) -> (f64, f64) {
    let beam = recording.geometry.beam(candidate.near_step);
    let bearing = f64::from(recording.geometry.bearing_rad(beam));
    let range = f64::from(candidate.near_mm) / 1000.0;
    (range * bearing.cos(), range * bearing.sin())
}

#[test]
fn labelled_legs_are_found() {
    let Some(folder) = folder() else { return };
    let (mut all, mut all_found) = (0, 0);
    for name in ["uhg_positive_1", "uhg_positive_2", "uhg_positive_3"] {
        let recording = open(&folder, name);
        let labels = std::fs::read_to_string(folder.join(format!("{name}_legs.csv"))).unwrap();
        let mut legs: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
        for line in labels.lines().filter(|line| !line.starts_with('#')) {
            let values: Vec<f64> = line.split(',').skip(1).map(|value| value.parse().unwrap()).collect();
            legs.entry(line.split(',').next().unwrap().parse().unwrap())
                .or_default()
                .push((values[0], values[1]));
        }
        let mut pipeline = recording.learned(recording.scans.len());
        let (mut near, mut found, mut stamps) = (0, 0, 0);
        let (mut within, mut right) = (0, 0);
        for index in 0..recording.scans.len() {
            let stamp_us = recording.scans[index].stamp_us;
            let judgement = recording.process(index, &mut pipeline);
            let Some(legs) = legs.get(&stamp_us) else { continue };
            stamps += 1;
            for candidate in judgement.candidates() {
                let (x, y) = nearest_point_m(&recording, candidate);
                within += usize::from(x.hypot(y) <= 4.0);
                right += usize::from(
                    x.hypot(y) <= 4.0 && legs.iter().any(|leg| (x - leg.0).hypot(y - leg.1) <= 0.15),
                );
            }
            for &(x, y) in legs.iter().filter(|(x, y)| x.hypot(*y) <= 4.0) {
                near += 1;
                let hit = judgement.candidates().iter().any(|candidate| {
                    let near = nearest_point_m(&recording, candidate);
                    (near.0 - x).hypot(near.1 - y) <= 0.15
                });
                found += usize::from(hit);
            }
        }
        println!(
            "{name}: {found} of {near} legs found ({:.1} %); {right} of {within} candidates are a leg ({:.1} %); \
             {stamps} of {} stamps",
            percent(found, near),
            percent(right, within),
            legs.len()
        );
        all += near;
        all_found += found;
    }
    println!("all: {:.1} %", percent(all_found, all));
    assert!(all_found * 100 >= all * 95);
}

#[test]
fn there_are_never_more_wide_candidates_than_people() {
    let Some(folder) = folder() else { return };
    for (name, people) in [("tamu_ex1", 1), ("tamu_ex2", 3), ("tamu_ex4", 1), ("tamu_ex6", 2)] {
        let recording = open(&folder, name);
        let mut pipeline = recording.learned(recording.scans.len());
        let wide: Vec<usize> = (0..recording.scans.len())
            .map(|index| {
                recording.process(index, &mut pipeline).candidates().iter().filter(|c| !c.narrow).count()
            })
            .collect();
        let lasting = wide.windows(3).map(|three| *three.iter().min().unwrap()).max().unwrap();
        let seen = wide.iter().filter(|&&count| count > 0).count();
        println!(
            "{name}: {lasting} wide at once ({people} people), {} in one scan, some in {seen} of {} scans",
            wide.iter().max().unwrap(),
            wide.len()
        );
        assert!(lasting <= people, "{name}");
    }
}

#[test]
fn learning_waits_until_no_person_moves() {
    let Some(folder) = folder() else { return };
    // In these two no person walks in the first 60 scans; in the others one does.
    let still = ["obstacle_front", "obstacle_rear"];
    for name in ALL {
        let recording = open(&folder, name);
        let mut pipeline = pipeline(&recording);
        let mut known_at = None;
        let mut waited = 0;
        for index in 0..recording.scans.len() {
            if let Learning::Running { restarts, .. } = recording.process(index, &mut pipeline).learning {
                waited = restarts;
            }
            if pipeline.background().is_known() {
                known_at = known_at.or(Some(index));
            }
        }
        let suspects = pipeline.background().suspects().len();
        println!("{name}: known at scan {known_at:?}, {waited} new beginnings, {suspects} suspects");
        assert_eq!(known_at == Some(59), still.contains(&name), "{name}");
        assert!(still.contains(&name) || waited > 0, "{name}");
    }
}
