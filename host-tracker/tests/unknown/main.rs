//! Nowhere, at no moment, is a zone said to be empty, or a total to be 0, unless the tracker has said that it is known and
//! empty. Random runs; after each step every surface is held against the tracker's own snapshots.
//!
//! ```text
//!   room ─▶ tracker ─▶ Snapshot ─┬─▶ truth ──────────────────────────────────────────────╮
//!                                ├─▶ WebSocket, API, metrics, MQTT, Home Assistant, reasons ├─▶ judge
//!                                ├─▶ database ─▶ overview, figures, past, report, CSV, Parquet │
//!                                ╰─▶ recording, history ───────────────────────────────────╯
//! ```
//!
//! | file | what |
//! |---|---|
//! | `world` | a room, its modules and people, in a simulated time |
//! | `edits` | what a user does to the site |
//! | `run` | what happens, step by step, and when surfaces are looked at |
//! | `truth` | what the tracker said at each moment |
//! | `live`, `kept`, `map` | the surfaces: of now, of the past, the map's server |
//! | `judge` | which of all that is said is false |
//!
//! `KEHAI_UNKNOWN_SEEDS=500 cargo test -p host-tracker --test unknown -- --nocapture` for more than the usual runs, or
//! `KEHAI_UNKNOWN_SEEDS=17-17` for one of them.

mod edits;
#[path = "../../../tracking/tests/intake/fake.rs"]
mod fake;
mod judge;
mod kept;
mod live;
mod map;
mod run;
#[path = "../../../tracking/tests/intake/scene.rs"]
#[allow(dead_code, reason = "another room's people")]
mod scene;
#[path = "../../../tracking/tests/intake/tracker.rs"]
mod tracker;
mod truth;
mod world;

use std::ops::RangeInclusive;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use judge::Judge;
use run::Run;

/// Runs unless `KEHAI_UNKNOWN_SEEDS` says otherwise: less than a minute of a busy machine of two cores.
const SEEDS: u64 = 8;

/// Runs at once: each waits for the database's thread and the server now and then.
const AT_ONCE: usize = 2;

/// The surfaces, each of which must have said rightly at least once that a place is empty.
const SURFACES: [&str; 17] = [
    "API",
    "CSV",
    "Home Assistant",
    "MQTT",
    "Parquet",
    "WebSocket",
    "explain",
    "figures",
    "history",
    "metrics",
    "metrics, sum of tracks",
    "overview",
    "past",
    "recording",
    "report",
    "report, CSV",
    "snapshot",
];

/// As `200`, or `17-40`.
fn seeds() -> RangeInclusive<u64> {
    let Ok(asked) = std::env::var("KEHAI_UNKNOWN_SEEDS") else { return 1..=SEEDS };
    match asked.split_once('-') {
        Some((first, last)) => first.parse().unwrap()..=last.parse().unwrap(),
        None => 1..=asked.parse().unwrap(),
    }
}

/// Plays a run. The database's thread writes by this machine's clock, so that a question may fall into another moment the next
/// time: what is false counts if it is so twice, and is printed if it is so once.
fn twice(seed: &str, play: impl Fn() -> Judge) -> Judge {
    let judged = play();
    match judged.falsehoods() {
        None => judged,
        Some(once) => {
            println!("seed {seed}, once:\n{once}");
            play()
        }
    }
}

#[test]
fn nobody_is_said_to_be_there_only_where_the_tracker_knows_it() {
    let seeds = seeds();
    let next = AtomicU64::new(*seeds.start());
    let (all, false_in) = (Mutex::new(Judge::default()), Mutex::new(Vec::new()));
    let note = |seed: &str, judged: Judge| {
        if let Some(falsehoods) = judged.falsehoods() {
            false_in.lock().unwrap().push(format!("seed {seed}:\n{falsehoods}"));
        }
        all.lock().unwrap().add(judged);
    };
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if !seeds.contains(&seed) {
                        return;
                    }
                    let seed_text = seed.to_string();
                    note(&seed_text, twice(&seed_text, || Run::new(seed).play()));
                }
            });
        }
    });
    note("calm", twice("calm", || Run::new(0).play_calm()));
    let (all, false_in) = (all.into_inner().unwrap(), false_in.into_inner().unwrap());
    println!("{:#?}", all.right());
    assert!(false_in.is_empty(), "false empties in {} runs\n{}", false_in.len(), false_in.join("\n"));
    for surface in SURFACES {
        assert!(all.right().contains_key(surface), "{surface} was never judged");
    }
}
