//! One person on a SensFloor is one track, never two: over walkers of different gaits, from the tiles' frames on. The signal
//! is simulated (`kehai_emulator::sensfloor`).
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;
use std::process::{Command, Output};

use host_sim::floor::gait::{Habit, Walker, Way};
use host_sim::floor::replay::{FloorChain, FloorReplay, LINE_US, layout_of};
use host_sim::world::random::{Purpose, Stream};
use kehai::floor::FAULTY;
use kehai::floor::sensfloor::{Frame, Layout};
use kehai_emulator::recording::floor::FloorRecording;
use kehai_emulator::sensfloor::{Signal, Sole, bytes};
use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{TrackLine, TracksLine};
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::tracker::LifeCycle;

const SEEDS: u64 = 40;

/// Until then the floor is empty, µs: two rounds of requests, and time to believe that it is empty.
const COMES_US: u64 = 8_000_000;

/// A walker is followed for so long, µs.
const WALK_US: u64 = 60_000_000;

/// Time in which the walker is found, s: a tile that hears a first step, two readings, three of a body.
const FOUND_S: f64 = 2.0;

/// Time in which every tile on the way has been walked on, and has learned its rest, s.
const LEARNED_S: f64 = 15.0;

/// From then on, the longest that a walker may be two, s: a slow stride, two steps of 0.6 m at 0.4 m/s. By then each foot was set
/// anew.
const TWO_S: f64 = 3.0;

fn layout() -> Layout {
    Layout::new(10, (1, 1), (6, 4)).unwrap()
}

/// To and fro, or round, on a floor of 3 × 2 m: slow and fast, long steps and short ones, narrow and wide.
fn walker(seed: u64) -> Walker {
    let mut random = Stream::new(seed, Purpose::Walk, [0x5e45, 1]);
    let at = |x, y| Point::new(x, y);
    let y_m = random.between(0.5, 1.5);
    let way = if seed.is_multiple_of(2) {
        Way::ToAndFro(at(0.3, y_m), at(2.7, random.between(0.5, 1.5)))
    } else {
        Way::Round(vec![at(0.4, 0.4), at(2.6, 0.4), at(2.6, 1.6), at(0.4, 1.6)])
    };
    let speed_mps = random.between(0.4, 1.3);
    Walker { way, begun_m: random.between(0.0, 2.0), speed_mps, habit: Habit::random(&mut random) }
}

fn confirmed(line: &TracksLine) -> usize {
    line.tracks.iter().filter(|track| track.state == LifeCycle::Confirmed).count()
}

/// What a floor that gets no requests says of a walker.
fn recorded(seed: u64) -> FloorRecording {
    let (mut signal, walker) = (Signal::new(&layout(), seed), walker(seed));
    let mut frames = Vec::new();
    while signal.next_us() < WALK_US {
        let at_us = signal.next_us();
        let soles: Vec<Sole> = walker.soles(at_us as f64 * 1e-6).map(|sole| sole.felt()).collect();
        frames.extend(signal.tick(&soles).into_iter().map(|frame| (at_us, frame)));
    }
    FloorRecording { frames }
}

/// What a device and a host make of a floor that is asked, and on which a walker comes at [`COMES_US`].
fn live(seed: u64) -> Vec<TracksLine> {
    let (mut signal, walker) = (Signal::new(&layout(), seed), walker(seed));
    let mut chain = FloorChain::new(&layout()).unwrap();
    let mut lines = Vec::new();
    for line_us in (LINE_US..COMES_US + WALK_US).step_by(LINE_US as usize) {
        while signal.next_us() <= line_us {
            let at_us = signal.next_us();
            for (_, request) in chain.until(at_us) {
                signal.ask((request[3], request[4]));
            }
            let soles = walker.soles(at_us as f64 * 1e-6).filter(|_| at_us > COMES_US);
            let soles: Vec<Sole> = soles.map(|sole| sole.felt()).collect();
            for frame in signal.tick(&soles) {
                chain.receive(&bytes(&frame), at_us);
            }
        }
        for (_, request) in chain.until(line_us) {
            signal.ask((request[3], request[4]));
        }
        lines.push(chain.line(line_us));
    }
    lines
}

/// Shares of the time.
#[derive(Default)]
struct Figures {
    all: usize,
    one: usize,
    more: usize,
    identities: usize,
    /// The least of a walker, %.
    worst: Option<f64>,
    /// The longest that there was more than one track, s; and the longest of those that began [`LEARNED_S`] after the first step.
    longest_s: f64,
    longest_later_s: f64,
    off_m: Vec<f64>,
}

impl Figures {
    /// Adds a walker's lines from `begin_s` on.
    fn add(&mut self, lines: &[TracksLine], walker: &Walker, begin_s: f64) {
        let judged = || {
            lines.iter().filter(|line| line.t > begin_s && line.t < begin_s + WALK_US as f64 * 1e-6 - FOUND_S)
        };
        let count = |wanted: fn(usize) -> bool| judged().filter(|line| wanted(confirmed(line))).count();
        let (all, one, more) = (judged().count(), count(|people| people == 1), count(|people| people > 1));
        let identities = host_sim::replay::identities(lines, LINE_US as f64 * 1e-6).len();
        let share = 100.0 * one as f64 / all as f64;
        let longest = |from_s: f64| {
            let is_more: Vec<bool> =
                judged().filter(|line| line.t > from_s).map(|line| confirmed(line) > 1).collect();
            let stretches = is_more.chunk_by(|one, next| one == next).filter(|stretch| stretch[0]);
            stretches.map(|stretch| stretch.len() as f64 * LINE_US as f64 * 1e-6).fold(0.0, f64::max)
        };
        let longest_s = longest(begin_s);
        self.longest_s = self.longest_s.max(longest_s);
        self.longest_later_s = self.longest_later_s.max(longest(begin_s + LEARNED_S));
        println!(
            "{:.2} m/s, steps of {:.2} m: one {share:5.1} %, more {:4.1} %, for {longest_s:.1} s at most, {identities} identities",
            walker.speed_mps,
            walker.habit.step_m,
            100.0 * more as f64 / all as f64
        );
        self.worst = Some(self.worst.map_or(share, |worst| worst.min(share)));
        for line in judged() {
            let truth = walker.at(line.t).0;
            let off = |track: &TrackLine| (Point::new(track.x, track.y) - truth).length();
            self.off_m
                .extend(line.tracks.iter().filter(|track| track.state == LifeCycle::Confirmed).map(off));
        }
        self.all += all;
        self.one += one;
        self.more += more;
        self.identities += identities;
    }

    /// Says them, and judges: one person is one track, and two for no longer than an explanation holds.
    fn conclude(mut self, what: &str) {
        self.off_m.sort_by(f64::total_cmp);
        let share = |count: usize| 100.0 * count as f64 / self.all as f64;
        println!(
            "{what}: {SEEDS} walkers: one {:.2} % of the time (worst walker {:.1}), more {:.2} %, for {:.1} s at most, {:.1} s later on, {} \
             identities, median {:.2} m off",
            share(self.one),
            self.worst.unwrap_or_default(),
            share(self.more),
            self.longest_s,
            self.longest_later_s,
            self.identities,
            self.off_m[self.off_m.len() / 2]
        );
        let (share, longest_s) = (share(self.one), self.longest_later_s);
        assert!(share >= 95.0, "{share:.2} %");
        assert!(longest_s <= TWO_S, "two for {longest_s:.1} s");
    }
}

#[test]
fn one_person_who_walks_is_one_track_in_95_percent_of_the_time() {
    let mut figures = Figures::default();
    for seed in 0..SEEDS {
        figures.add(&live(seed), &walker(seed), COMES_US as f64 * 1e-6 + FOUND_S);
    }
    figures.conclude("asked");
}

/// No requests are sent in a recording: tiles are first heard under a foot, and their rest is learned late.
#[test]
fn one_person_in_a_recording_is_one_track_in_95_percent_of_the_time() {
    let mut figures = Figures::default();
    for seed in 0..SEEDS {
        let recording = recorded(seed);
        let replay = FloorReplay::run(&recording, &layout_of(&recording.frames).unwrap()).unwrap();
        figures.add(&replay.lines, &walker(seed), recording.frames[0].0 as f64 * 1e-6 + FOUND_S);
    }
    figures.conclude("recorded");
}

fn kehai_sim(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(arguments).output().unwrap()
}

#[test]
fn the_command_prints_what_a_recording_shows_and_one_line_for_one_that_cannot_be_used() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("floor-walk.csv");
    let mut file = Vec::new();
    recorded(4).write(&mut file).unwrap();
    std::fs::write(&path, &file).unwrap();
    let path = path.to_str().unwrap();
    let output = kehai_sim(&["replay", "--floor", path]);
    let said = String::from_utf8(output.stdout).unwrap();
    println!("{said}");
    assert!(output.status.success() && said.contains("0 of other floors, 0 damaged; group 10"), "{said}");
    // Tiles that got no request and no foot were silent.
    assert!(
        said.contains("32 or more panels were silent or stuck at the end: nothing is known there"),
        "{said}"
    );
    assert!(said.contains("identities from"), "{said}");
    let json = kehai_sim(&["replay", "--floor", path, "--json"]);
    let lines = String::from_utf8(json.stdout).unwrap();
    let lines: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines.len() > 500 && lines[100]["zones"]["floor"].is_object(), "{}", lines.len());
    let refused = |arguments: &[&str], wanted: &str, status: i32| {
        let output = kehai_sim(&[&["replay", "--floor"], arguments].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{said}");
        assert!(said.contains(wanted) && (status == 2 || said.lines().count() == 1), "{said}");
    };
    refused(&["/nowhere.csv"], "/nowhere.csv: cannot be read", 1);
    refused(&[path, "--tiles", "11,1,1,6,4"], "no frame is of the floor's tiles", 1);
    refused(&[path, "--tiles", "10,1,1,9,9"], "at most 64 tiles", 2);
    let torn = Path::new(env!("CARGO_TARGET_TMPDIR")).join("floor-torn.csv");
    std::fs::write(&torn, &file[..file.len() - 9]).unwrap();
    let last = file.iter().filter(|byte| **byte == b'\n').count();
    refused(&[torn.to_str().unwrap()], &format!("floor-torn.csv:{last}: "), 1);
}

/// For more than an hour a load lies on the upper half of a floor of 6 × 4 tiles. It comes at once, so its panels are stuck at
/// once: a zone of which four fifths are seen is known.
#[test]
fn with_half_of_the_panels_stuck_that_half_is_unknown_and_the_floor_is_never_empty() {
    let mut frames = Vec::new();
    for second in (0..3_800_u64).step_by(5) {
        for index in 0..24_u8 {
            let (x, y) = (1 + index % 6, 1 + index / 6);
            let values = [if y > 2 && second > 0 { 190 } else { 128 }; 8];
            frames.push((second * 1_000_000, Frame { group: 10, tile: (x, y), values }));
        }
        // Meanwhile one speaks, so that the line is not silent.
        for half in 1..10 {
            let at_us = second * 1_000_000 + half * 500_000;
            frames.push((at_us, Frame { group: 10, tile: (1, 1), values: [128; 8] }));
        }
    }
    let replay = FloorReplay::run(&FloorRecording { frames }, &layout()).unwrap();
    assert_eq!(replay.faulty, FAULTY, "48 are stuck");
    let minute = replay.lines.iter().rev().skip(50).take(600);
    for zone in minute.map(|line| &line.zones["floor"]) {
        assert_eq!((zone.state(), zone.count()), (ZoneKnown::Partly, None));
        assert!(zone.seen_share() < 0.51, "{}", zone.seen_share());
    }
    let empty = |line: &&TracksLine| line.t > 20.0 && line.zones["floor"].count() == Some(0);
    assert_eq!(replay.lines.iter().filter(empty).count(), 0);
}
