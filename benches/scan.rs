//! What one scan costs, stage by stage: instructions (counted by valgrind, so the same in every run)
//! and nanoseconds on this machine; and the static memory of everything that is kept.
//!
//! `cargo bench -p kehai` prints the table and fails when a budget is exceeded.
//!
//! The scene: a room 5 m wide, four people in it, 3-character codes fed in slices of 64 bytes, as a
//! UART's ring buffer hands them out.

use std::hint::black_box;
use std::mem::size_of;
use std::process::{Command as Process, ExitCode};
use std::time::Instant;

use kehai::background::{Background, Fingerprint};
use kehai::pipeline::{Pipeline, Settings};
use kehai::scan::{Geometry, GeometryParts, MAX_BEAMS, Scan, ScanTime, URG_04LX};
use kehai::scip::{Command, Event, Measurement, Reader, Width};
use kehai::sensor::Session;
use kehai_emulator::urg::encode;

/// Bytes a UART hands out at once.
const SLICE_BYTES: usize = 64;

/// Most memory the state of a module may take, for 1081 steps, learning included.
const MEMORY_BUDGET_BYTES: usize = 48 * 1024;

/// Instructions a scan on the host, by steps and stage: a tenth above what was measured when the stage
/// was last changed on purpose. They guard against unintended changes.
const INSTRUCTION_BUDGETS: [(u16, Stage, u64); 6] = [
    (682, Stage::Decode, 35_000),
    (682, Stage::Background, 7_800),
    (682, Stage::Candidates, 28_400),
    (1081, Stage::Decode, 55_000),
    (1081, Stage::Background, 12_000),
    (1081, Stage::Candidates, 36_400),
];

/// A part of the work on a scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stage {
    /// SCIP bytes to ranges.
    Decode,
    /// The whole pipeline in an empty room: every beam judged, nothing found.
    Background,
    /// What four people add to that: clusters, candidates, unseen spans.
    Candidates,
}

impl Stage {
    const fn name(self) -> &'static str {
        match self {
            Self::Decode => "decode",
            Self::Background => "background",
            Self::Candidates => "cluster + candidates",
        }
    }
}

/// The runs: the reader, the pipeline in an empty room, the pipeline with four people.
const RUNS: [&str; 3] = ["decode", "background", "pipeline"];

fn geometry(steps: u16) -> Geometry {
    let parts = match steps {
        682 => URG_04LX,
        _ => GeometryParts {
            first_step: 0,
            last_step: steps - 1,
            front_step: steps / 2,
            steps_per_turn: 1440,
            period_us: 25_000,
            range_max_mm: 30_000,
            ..URG_04LX
        },
    };
    Geometry::new(parts).expect("the geometry is that of a real sensor")
}

/// Ranges in a room 5 m wide, with `people` cylinders of 0.4 m around the sensor.
fn room(geometry: &Geometry, people: u16, scan: u16) -> Vec<u16> {
    (0..geometry.beams())
        .map(|beam| {
            let bearing_rad = f64::from(geometry.bearing_rad(beam));
            let wall_mm = (2500.0 / bearing_rad.sin().abs().max(bearing_rad.cos().abs())).round();
            let person_mm = (0..people)
                .filter_map(|person| {
                    let place_rad = f64::from(person) * 0.8 - 1.3;
                    let (distance_mm, radius_mm) = (1200.0 + 150.0 * f64::from(person), 200.0_f64);
                    let aside_mm = distance_mm * (bearing_rad - place_rad).sin();
                    let ahead = (bearing_rad - place_rad).cos() > 0.0 && aside_mm.abs() < radius_mm;
                    ahead.then(|| {
                        distance_mm * (bearing_rad - place_rad).cos()
                            - (radius_mm * radius_mm - aside_mm * aside_mm).sqrt()
                    })
                })
                .fold(wall_mm, f64::min);
            // Noise of ±4 mm that repeats itself.
            let noise_mm = (beam.wrapping_mul(7919) ^ scan.wrapping_mul(104)) % 9;
            (person_mm as u16).saturating_add(noise_mm) - 4
        })
        .collect()
}

fn reply(measurement: &Measurement, echo: &[u8], ranges_mm: &[u16]) -> Vec<u8> {
    let mut bytes = echo.to_vec();
    bytes.push(b'\n');
    encode::push_line(&mut bytes, b"99");
    encode::push_stamp(&mut bytes, 123_456);
    let mut block = Vec::new();
    for &range_mm in ranges_mm {
        encode::push_value(&mut block, range_mm.into(), measurement.width.characters().into());
    }
    encode::push_block(&mut bytes, &block);
    bytes.push(b'\n');
    bytes
}

/// Prepares a run and returns what does it once.
fn prepare(run: &str, steps: u16) -> Box<dyn FnMut()> {
    let geometry = geometry(steps);
    let parts = geometry.parts();
    let people = if run == "background" { 0 } else { 4 };
    let scans: Vec<_> = (0..8).map(|scan| room(&geometry, people, scan)).collect();
    if run == "decode" {
        let measurement = Measurement {
            first_step: parts.first_step,
            last_step: parts.last_step,
            cluster: 1,
            skip: 0,
            scans: 0,
            width: Width::Three,
        };
        let request = Command::Measure(measurement).encode().expect("a legal measurement");
        let replies: Vec<_> =
            scans.iter().map(|ranges| reply(&measurement, request.echo(), ranges)).collect();
        let mut reader = Reader::new();
        reader.expect(&request);
        let mut ranges_mm = [0; MAX_BEAMS];
        let mut turn = 0;
        return Box::new(move || {
            turn = (turn + 1) % replies.len();
            let mut scans = 0;
            for slice in replies[turn].chunks(SLICE_BYTES) {
                let mut rest = slice;
                while !rest.is_empty() {
                    let fed = reader.feed(black_box(rest), 0, &mut ranges_mm);
                    rest = &rest[fed.consumed..];
                    scans += u32::from(matches!(fed.event, Some(Event::Scan(_))));
                }
            }
            assert_eq!(black_box(scans), 1, "the scan was not decoded");
        });
    }
    let empty: Vec<_> = (0..60).map(|scan| room(&geometry, 0, scan)).collect();
    let time = |scan: u64| ScanTime { sensor_ms: scan * 100, stamp_us: scan * 100_000, uncertainty_us: 0 };
    let mut scan_number = 60;
    let mut pipeline = Box::new(Pipeline::<MAX_BEAMS>::new());
    pipeline
        .configure(&geometry, Settings::default(), Fingerprint::of(b"bench", &geometry))
        .expect("there is room for every sensor");
    let mut turn = 0;
    for (number, ranges_mm) in (0..).zip(&empty) {
        pipeline.process(&Scan { geometry: &geometry, ranges_mm, time: time(number) });
    }
    assert!(pipeline.background().is_known(), "nothing was learned");
    Box::new(move || {
        turn = (turn + 1) % scans.len();
        scan_number += 1;
        let scan = Scan { geometry: &geometry, ranges_mm: black_box(&scans[turn]), time: time(scan_number) };
        let judgement = pipeline.process(&scan);
        assert_eq!(black_box(judgement.candidates().len()), usize::from(people), "not everybody was seen");
    })
}

/// Nanoseconds of one run: the smallest of ten means, which noise can only raise.
fn nanoseconds(run: &str, steps: u16) -> f64 {
    const ROUND: u32 = 400;
    let mut once = prepare(run, steps);
    let rounds = (0..10).map(|_| {
        let start = Instant::now();
        (0..ROUND).for_each(|_| once());
        start.elapsed().as_nanos() as f64 / f64::from(ROUND)
    });
    rounds.fold(f64::INFINITY, f64::min)
}

/// Instructions of one run, counted by valgrind; None if valgrind is not installed.
fn instructions(run: &str, steps: u16) -> Option<u64> {
    let count = |times: u32| {
        let output = Process::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(std::env::current_exe().ok()?)
            .args(["--run", run, &steps.to_string(), &times.to_string()])
            .output()
            .ok()?;
        let text = String::from_utf8_lossy(&output.stderr);
        text.lines().find_map(|line| line.split("Collected : ").nth(1)?.trim().parse::<u64>().ok())
    };
    Some((count(40)? - count(8)?) / 32)
}

fn report() -> ExitCode {
    let mut over = Vec::new();
    println!("{:>5}  {:<22}{:>14}{:>12}{:>12}", "steps", "stage", "instructions", "budget", "ns/scan");
    for steps in [682, 1081] {
        let counted: Vec<_> =
            RUNS.iter().map(|run| (instructions(run, steps), nanoseconds(run, steps))).collect();
        let difference = (
            counted[2].0.zip(counted[1].0).map(|(all, part)| all.saturating_sub(part)),
            (counted[2].1 - counted[1].1).max(0.0),
        );
        for (stage, (instructions, ns)) in
            [(Stage::Decode, counted[0]), (Stage::Background, counted[1]), (Stage::Candidates, difference)]
        {
            let budget = INSTRUCTION_BUDGETS
                .iter()
                .find(|entry| entry.0 == steps && entry.1 == stage)
                .map_or(0, |entry| entry.2);
            let counted = instructions.map_or("no valgrind".into(), |count| count.to_string());
            println!("{steps:>5}  {:<22}{counted:>14}{budget:>12}{ns:>12.0}", stage.name());
            if instructions.is_some_and(|count| count > budget) {
                over.push(format!(
                    "{} of {steps} steps takes {counted} instructions, more than {budget}",
                    stage.name()
                ));
            }
        }
    }
    let (state, reader) = (size_of::<Pipeline<MAX_BEAMS>>(), size_of::<Session>() + 2 * MAX_BEAMS);
    println!(
        "\nstatic memory for {MAX_BEAMS} steps: pipeline {state} bytes, learning included (background {}),",
        size_of::<Background<MAX_BEAMS>>()
    );
    println!(
        "session, reader and scan buffer {reader} bytes; together {} of {MEMORY_BUDGET_BYTES}",
        state + reader
    );
    if state + reader > MEMORY_BUDGET_BYTES {
        over.push(format!("the state takes {} bytes", state + reader));
    }
    for line in &over {
        eprintln!("over budget: {line}");
    }
    if over.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    if let [flag, run, steps, times] = arguments.as_slice()
        && flag == "--run"
    {
        let (steps, times) = (steps.parse().unwrap_or(682), times.parse().unwrap_or(1));
        let mut once = prepare(run, steps);
        (0..times).for_each(|_: u32| once());
        return ExitCode::SUCCESS;
    }
    report()
}
