//! Tests in real time, on a machine that may be held up.
//!
//! ```text
//! guest's clock  ──────────────────────────────▶  goes on
//! guest          ████████░░░░░░░░██████████████   waits for a processor of this machine
//! sensor's line  ▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪▪   overflows, or is silent too long
//! ```
//!
//! An emulated board that waits for its processor misses what a real one would not. A test that fails while that
//! happened says nothing about the image: it is done again. One that fails undisturbed has failed. To be held up
//! less, a test and its boards run before everything else on the machine, where that is allowed.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// A test was disturbed if it was held up this long within [`LOOK`]: a scan period of the slowest sensor.
const BUSY: Duration = Duration::from_millis(100);

/// Or for more than one part of so many of the whole time it took: steady load, rather than one long wait.
const BUSY_PART: u32 = 50;

/// Between two looks at the clocks.
const LOOK: Duration = Duration::from_millis(100);

/// Disturbed runs of a test, until it is said that it cannot be judged here.
const TRIES: usize = 5;

/// Disturbed runs of all tests of a file, until none is tried again: a machine that is held up all the time would
/// be at it for an hour.
const TRIES_OF_ALL: usize = 12;

/// Unit of the processors' times in `/proc/stat`.
const TICK: Duration = Duration::from_millis(10);

/// Held while a test runs: two boards would wait for each other.
static ALONE: Mutex<()> = Mutex::new(());

/// Disturbed runs so far.
static DISTURBED: AtomicUsize = AtomicUsize::new(0);

/// Runs `test` while no other does; again if it fails on a machine that was held up meanwhile. If that happens
/// [`TRIES`] times, or [`TRIES_OF_ALL`] times to all tests together, it says so on stderr and judges nothing.
pub fn undisturbed(test: impl Fn()) {
    // Whatever became of the one before.
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    run_first();
    let name = thread::current().name().unwrap_or("a test").to_owned();
    for _ in 0..TRIES {
        let (result, held_up) = watched(&test);
        let Err(failure) = result else { return };
        if !held_up.disturbs() {
            resume_unwind(failure);
        }
        let _ = writeln!(std::io::stderr(), "{name} failed while this machine was held up ({held_up})");
        if DISTURBED.fetch_add(1, Ordering::Relaxed) >= TRIES_OF_ALL {
            break;
        }
    }
    let _ = writeln!(std::io::stderr(), "{name} is NOT JUDGED: this machine was held up each time");
}

/// This thread, and every thread and process it starts from now on, goes before those that share the processors;
/// only root may ask for that; anybody else's tests run like all the rest.
fn run_first() {
    let own = fs::read_link("/proc/thread-self").unwrap_or_default();
    let thread = own.file_name().unwrap_or_default();
    let _ = Command::new("chrt").args(["--rr", "--pid", "1"]).arg(thread).stderr(Stdio::null()).status();
}

fn watched(test: impl Fn()) -> (thread::Result<()>, HeldUp) {
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let watching = scope.spawn(|| HeldUp::until(&stop));
        let result = catch_unwind(AssertUnwindSafe(test));
        stop.store(true, Ordering::Relaxed);
        (result, watching.join().expect("nothing in it fails"))
    })
}

/// For how long this process and its boards could not run though they would have.
#[derive(Default)]
struct HeldUp {
    /// Most within [`LOOK`].
    longest: Duration,
    /// All together.
    total: Duration,
    /// Out of.
    time: Duration,
}

impl HeldUp {
    fn until(stop: &AtomicBool) -> Self {
        let mut held_up = Self::default();
        let begin = Instant::now();
        let (mut stolen_before, mut waits_before) = (stolen(), waits());
        while !stop.load(Ordering::Relaxed) {
            let look = Instant::now();
            thread::sleep(LOOK);
            let late = look.elapsed().saturating_sub(LOOK);
            let (stolen_now, waits_now) = (stolen(), waits());
            let waited_ns: u64 = waits_now
                .iter()
                .map(|(thread, all_ns)| all_ns.saturating_sub(*waits_before.get(thread).unwrap_or(&0)))
                .sum();
            let stolen = stolen_now.saturating_sub(stolen_before);
            let longest = late.max(stolen).max(Duration::from_nanos(waited_ns));
            held_up.longest = held_up.longest.max(longest);
            held_up.total += longest;
            (stolen_before, waits_before) = (stolen_now, waits_now);
        }
        held_up.time = begin.elapsed();
        held_up
    }

    fn disturbs(&self) -> bool {
        self.longest >= BUSY || self.total * BUSY_PART > self.time
    }
}

impl std::fmt::Display for HeldUp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { longest, total, time } = self;
        write!(
            f,
            "{} ms at once, {:.1} of {:.1} s",
            longest.as_millis(),
            total.as_secs_f64(),
            time.as_secs_f64()
        )
    }
}

/// Time that a machine around this one has taken from its processors so far.
fn stolen() -> Duration {
    let all = fs::read_to_string("/proc/stat").unwrap_or_default();
    let ticks = all.lines().next().and_then(|line| line.split_whitespace().nth(8)?.parse().ok());
    TICK * ticks.unwrap_or(0)
}

/// For how long each thread of this process and of its children has waited for a processor so far, ns.
fn waits() -> BTreeMap<String, u64> {
    let own = std::process::id().to_string();
    let threads = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let mut processes: Vec<String> = threads
        .filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok())
        .flat_map(|children| children.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    processes.push(own);
    let mut waits = BTreeMap::new();
    for process in processes {
        for thread in
            fs::read_dir(Path::new("/proc").join(process).join("task")).into_iter().flatten().flatten()
        {
            let times = fs::read_to_string(thread.path().join("schedstat")).unwrap_or_default();
            let waited_ns = times.split_whitespace().nth(1).and_then(|waited| waited.parse().ok());
            waits.insert(thread.file_name().to_string_lossy().into_owned(), waited_ns.unwrap_or(0));
        }
    }
    waits
}
