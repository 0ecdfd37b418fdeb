//! What an observation of each kind costs the host, and a depth frame the computer behind its camera.
//!
//! ```text
//!   entrance, recorded once ─▶ datagrams, signs ─┬─▶ callgrind: instructions within `counted_observation` and
//!                                                │                                   `counted_line`
//!                                                └─▶ a clock: µs an observation
//!   frames, scans ───────────▶ depth front end, core ─▶ the same of `counted_frame` and `counted_scan`
//! ```
//!
//! `cargo bench -p host-sim` prints the tables and fails when the budget of a depth frame is exceeded: instructions, which are
//! the same in every run. Times are printed and judge nothing.
//!
//! Each kind is alone at its site, but for signs: they are read beside a laser, of its tracks.

mod counted;
mod depth_frame;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use host_sim::baselines::Choice;
use host_sim::entrance::pacing::{COME_S, END_S, IN_S, Source, arrivals, entrance, site};
use host_sim::entrance::tags::TagReader;
use host_sim::run::{Arrival, Record};
use host_sim::world::geometry::Point;
use host_tracker::signs::SignHandle;
use kehai_tracking::site::reader::{Reader, Reads};
use kehai_tracking::site_tracker::SiteTracker;
use serde_json::json;

/// Most instructions of a 320 × 240 frame with four people in view, to candidates and sizes: a tenth above what was measured when
/// this was last changed on purpose. It guards against unintended changes.
const FRAME_BUDGET: u64 = 39_600_000;

/// What a frame is to take on one core, ms; printed, not guarded.
const FRAME_AIM_MS: f64 = 5.0;

/// Between two lines of tracks, µs.
const LINE_US: u64 = 100_000;

/// Stands for the module of what is a sign.
const SIGN: u16 = u16::MAX;

/// People who are there.
const PEOPLE: [u16; 3] = [1, 2, 4];

/// What tells of people.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Laser,
    Camera,
    Floor,
    /// A tag that a camera has read: a pixel of it.
    Tag,
    /// A card at a reader.
    Card,
}

impl Kind {
    const NAMED: [(Self, &'static str); 5] = [
        (Self::Laser, "report of a laser range finder"),
        (Self::Camera, "report of a depth camera, with sizes"),
        (Self::Floor, "reading of a floor of 38 × 26 panels"),
        (Self::Tag, "tag, read by a camera"),
        (Self::Card, "card, read by a reader"),
    ];

    const fn source(self) -> Source {
        match self {
            Self::Laser | Self::Tag | Self::Card => Source::Laser,
            Self::Camera => Source::Camera,
            Self::Floor => Source::Floor,
        }
    }
}

/// Simulates what is in the file, once a run of this program.
fn recorded(kind: Kind, people: u16) -> Result<PathBuf, Box<dyn Error>> {
    let entrance = entrance(people);
    let mut site = site(kind.source())?;
    let mut all = arrivals(kind.source(), &entrance)?;
    let sign = |at_us: u64, text: serde_json::Value| Arrival {
        at_us,
        module: SIGN,
        bytes: text.to_string().into_bytes(),
    };
    if kind == Kind::Card {
        // At the middle of the way of all; one card after the other is read twice a second.
        let reads = Reads::Near { at: Point::new(2.9, 0.0), reach_m: 1.5 };
        site.readers.push(Reader { name: "gate".into(), reads });
        let from_us = (COME_S * 2.0) as u64..(END_S * 2.0) as u64;
        all.extend(from_us.map(|half| {
            let id = format!("04A22B{:04X}", half % u64::from(people));
            sign(half * 500_000, json!({ "id": id, "reader": "gate" }))
        }));
    }
    if kind == Kind::Tag {
        let pixels = site.readers.iter().find_map(|reader| match reader.reads {
            Reads::Pixels { homography, .. } => Some((reader.name.clone(), homography)),
            Reads::Near { .. } => None,
        });
        let (name, homography) = pixels.ok_or("no reader of tags")?;
        let mut reader =
            TagReader::new(Point::new(5.8, 0.0), &homography, 1).ok_or("a homography without an inverse")?;
        while reader.next_s() < END_S {
            let at_s = reader.next_s();
            let read = reader.read(&entrance.people_at(at_s - COME_S)).into_iter();
            all.extend(read.map(|one| {
                let (u, v) = one.pixel;
                sign((at_s * 1e6) as u64, json!({ "id": one.id, "reader": name, "u": u, "v": v }))
            }));
        }
    }
    all.sort_by_key(|arrival| arrival.at_us);
    let record = Record {
        seed: 1,
        duration_s: END_S,
        site,
        modules: Vec::new(),
        events: None,
        arrivals: all,
        truth: Vec::new(),
    };
    let name = format!("bench-source-{}-{people}.run", kind as u8);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    record.save(&path)?;
    Ok(path)
}

/// A host.
struct Host {
    site_tracker: SiteTracker,
    signs: SignHandle,
    reads_signs: bool,
}

impl Host {
    fn observe(&mut self, arrival: &Arrival) -> bool {
        if arrival.module == SIGN {
            return self.signs.tell(&arrival.bytes).is_ok();
        }
        let Some(datagram) = self.site_tracker.sessions_mut().decode(&arrival.bytes) else { return false };
        self.site_tracker.take(&datagram, arrival.at_us).is_some()
    }

    fn line(&mut self, now_us: u64) -> usize {
        let known = self.site_tracker.estimate(now_us as f64 * 1e-6);
        if self.reads_signs {
            std::hint::black_box(self.signs.observe(&known));
        }
        known.tracks.len()
    }
}

/// What is measured of an observation, and of a line.
#[inline(never)]
fn counted_observation(host: &mut Host, arrival: &Arrival) -> bool {
    host.observe(arrival)
}

#[inline(never)]
fn counted_line(host: &mut Host, now_us: u64) -> usize {
    host.line(now_us)
}

/// What was fed while all are in.
#[derive(Default)]
struct Fed {
    observations: u64,
    took: Duration,
    lines: u64,
    tracks: usize,
}

/// Feeds a record; only signs are measured where there are any.
fn feed(record: &Record) -> Fed {
    let site = Arc::new(record.site.clone());
    let has_signs = record.arrivals.iter().any(|arrival| arrival.module == SIGN);
    let mut host = Host {
        site_tracker: SiteTracker::new(&site, Choice::default()),
        signs: SignHandle::new(&site, None),
        reads_signs: has_signs,
    };
    let mut fed = Fed::default();
    let mut arrivals = record.arrivals.iter().peekable();
    for line in 1..=(END_S * 1e6) as u64 / LINE_US {
        let now_us = line * LINE_US;
        let is_in = now_us > (IN_S * 1e6) as u64;
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us <= now_us) {
            if is_in && (arrival.module == SIGN) == has_signs {
                let begun = Instant::now();
                let counts = counted_observation(&mut host, arrival);
                fed.took += begun.elapsed();
                fed.observations += u64::from(counts);
            } else {
                host.observe(arrival);
            }
        }
        if is_in {
            fed.tracks = counted_line(&mut host, now_us);
            fed.lines += 1;
        } else {
            host.line(now_us);
        }
    }
    fed
}

fn observations() -> Result<(), Box<dyn Error>> {
    println!(
        "{:<40}{:>8}{:>8}{:>14}{:>8}{:>14}",
        "an observation", "people", "tracks", "instructions", "µs", "and a line"
    );
    for (kind, what) in Kind::NAMED {
        for people in PEOPLE {
            let path = recorded(kind, people)?;
            let fed = feed(&Record::load(&path)?);
            let count = |only: &str| counted::instructions(&["--feed", path.to_str()?], Some(only));
            let each = |count: Option<u64>, of: u64| counted::shown(count.map(|count| count / of.max(1)));
            println!(
                "{what:<40}{people:>8}{:>8}{:>14}{:>8.1}{:>14}",
                fed.tracks,
                each(count("counted_observation"), fed.observations),
                fed.took.as_secs_f64() * 1e6 / fed.observations.max(1) as f64,
                each(count("counted_line"), fed.lines)
            );
        }
    }
    Ok(())
}

/// Prints a depth frame beside a laser scan; whether it keeps its budget.
fn frame() -> Result<bool, Box<dyn Error>> {
    let each_ms = |took: Duration| took.as_secs_f64() * 1e3 / depth_frame::MEASURED as f64;
    let (mut frame_ms, mut scan_ms) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..5 {
        let took = depth_frame::run()?;
        if took.in_frames == 0 || took.in_scans == 0 {
            return Err("no person is found in the frames, or in the scans".into());
        }
        frame_ms = frame_ms.min(each_ms(took.frames));
        scan_ms = scan_ms.min(each_ms(took.scans));
    }
    let count = |only: &str| {
        let all = counted::instructions(&["--frames"], Some(only))?;
        Some(all / depth_frame::MEASURED as u64)
    };
    let (in_frame, in_scan) = (count(depth_frame::FRAME), count(depth_frame::SCAN));
    println!("\n{:<40}{:>8}{:>16}{:>14}{:>10}", "", "people", "instructions", "budget", "ms");
    let print = |what: &str, count: Option<u64>, budget: &str, ms: f64| {
        println!("{what:<40}{:>8}{:>16}{budget:>14}{ms:>10.3}", depth_frame::PEOPLE, counted::shown(count));
    };
    print("a depth frame of 320 × 240", in_frame, &FRAME_BUDGET.to_string(), frame_ms);
    print("a scan of a UHG-08LX, in the core", in_scan, "", scan_ms);
    println!(
        "a frame takes {:.0} times a scan's time, {frame_ms:.2} ms, aim {FRAME_AIM_MS}",
        frame_ms / scan_ms
    );
    let over = in_frame.filter(|count| *count > FRAME_BUDGET);
    if let Some(count) = over {
        eprintln!("over budget: a depth frame takes {count} instructions, more than {FRAME_BUDGET}");
    }
    Ok(over.is_none())
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["--feed", path] => _ = std::hint::black_box(feed(&Record::load(Path::new(path))?)),
        ["--frames"] => _ = std::hint::black_box(depth_frame::run()?),
        _ => {
            observations()?;
            return Ok(if frame()? { ExitCode::SUCCESS } else { ExitCode::FAILURE });
        }
    }
    Ok(ExitCode::SUCCESS)
}
