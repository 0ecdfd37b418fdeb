//! Background, clusters and candidates on real recordings, against what is known of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use host_sim::recording::{RecordedScan, Recording};
use kehai::background::{BeamState, Fingerprint, LearnRequest};
use kehai::pipeline::{Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, Scan, ScanTime};

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
    assert!(std::env::var_os("CI").is_none(), "no recordings at {}", folder.display());
    println!("no recordings at {}: nothing tested", folder.display());
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

#[test]
fn an_empty_scene_stays_empty() {
    let Some(folder) = folder() else { return };
    let recording = open(&folder, "tim_neg");
    let mut pipeline = pipeline(&recording);
    let (mut wide, mut narrow, mut known) = (0, 0, 0);
    for index in 0..recording.scans.len() {
        let judgement = recording.process(index, &mut pipeline);
        if index >= 60 {
            wide += usize::from(judgement.candidates().iter().any(|candidate| !candidate.narrow));
            narrow += usize::from(!judgement.candidates().is_empty());
            known += usize::from(judgement.background_version > 0);
        }
        if std::env::var_os("SHOW").is_some() {
            println!(
                "{index} {:?} {:?}",
                judgement.learning,
                judgement
                    .candidates()
                    .iter()
                    .map(|c| (c.first_step, c.last_step, c.near_mm, c.narrow))
                    .collect::<Vec<_>>()
            );
        }
    }
    let judged = recording.scans.len() - 60;
    println!(
        "tim_neg: {known} of {judged} judged; wide in {:.2} %, any in {:.2} %",
        percent(wide, judged),
        percent(narrow, judged)
    );
    assert!(wide * 100 <= judged && narrow * 20 <= judged);
}

#[test]
fn labelled_legs_are_found() {
    let Some(folder) = folder() else { return };
    let (mut all, mut all_found) = (0, 0);
    for name in ["uhg_positive_1", "uhg_positive_2", "uhg_positive_3"] {
        let recording = open(&folder, name);
        let labels = std::fs::read_to_string(folder.join(format!("{name}_legs.csv"))).unwrap();
        let mut legs: BTreeMap<u64, Vec<(f32, f32)>> = BTreeMap::new();
        for line in labels.lines().filter(|line| !line.starts_with('#')) {
            let values: Vec<f32> = line.split(',').skip(1).map(|value| value.parse().unwrap()).collect();
            legs.entry(line.split(',').next().unwrap().parse().unwrap())
                .or_default()
                .push((values[0], values[1]));
        }
        let mut pipeline = recording.learned(recording.scans.len());
        let (mut near, mut found, mut stamps) = (0, 0, 0);
        for index in 0..recording.scans.len() {
            let stamp_us = recording.scans[index].stamp_us;
            let judgement = recording.process(index, &mut pipeline).clone();
            let Some(legs) = legs.get(&stamp_us) else { continue };
            stamps += 1;
            for &(x, y) in legs.iter().filter(|(x, y)| x.hypot(*y) <= 4.0) {
                near += 1;
                let hit = judgement.candidates().iter().any(|candidate| {
                    let bearing =
                        recording.geometry.bearing_rad(recording.geometry.beam(candidate.near_step));
                    let range = f32::from(candidate.near_mm) / 1000.0;
                    (range * bearing.cos() - x).hypot(range * bearing.sin() - y) <= 0.15
                });
                found += usize::from(hit);
                if !hit && std::env::var_os("SHOW").is_some() {
                    let bearing = y.atan2(x);
                    let beam = (bearing / recording.geometry.step_rad()).round() as usize + 384;
                    let range = x.hypot(y) * 1000.0;
                    println!(
                        "miss {index} beam {beam} range {range:.0} near {:?}",
                        judgement
                            .candidates()
                            .iter()
                            .map(|c| (c.first_step, c.last_step, c.first_mm, c.near_mm, c.last_mm))
                            .collect::<Vec<_>>()
                    );
                    println!("   {:?}", &recording.scans[index].ranges_mm[beam - 6..beam + 7]);
                    println!(
                        "   {:?}",
                        pipeline
                            .background()
                            .profile()
                            .skip(beam - 3)
                            .take(7)
                            .map(|p| (p.state, p.near_mm, p.far_mm, p.spread_mm))
                            .collect::<Vec<_>>()
                    );
                }
            }
        }
        println!(
            "{name}: {found} of {near} legs found ({:.1} %), {stamps} of {} stamps",
            percent(found, near),
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
