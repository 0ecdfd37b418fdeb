//! The tracker's memory has a bound that can be worked out beforehand: bytes are counted as they are taken and given back.
//!
//! ```text
//!   most bytes = 128 kB  +  40 kB · modules  +  33 kB · people
//!                        +  0.7 kB · m² of zones  +  0.4 kB · m² each module sees of them
//!                        +  0.5 kB · m² of the rectangle around the walls, 4 MB at most
//! ```
//!
//! Of a module 24 kB are the rays of its newest scan, of a person 25 kB the samples. The same is said in `docs/design.md`.
#![allow(missing_docs, reason = "a test program")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use host_sim::baselines::Choice;
use host_sim::run::{Options, Record};
use host_sim::world::scene::Scene;
use host_sim::world::variation::Variation;
use kehai_tracking::site_tracker::SiteTracker;

struct Counting;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is handed on to the system's allocator as it came; only sizes are added up beside.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let live = LIVE.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(live, Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Sides of the hall, m, and from one to the next.
const HALL_M: f64 = 8.0;
const APART_M: f64 = 8.2;

/// What a URG-04LX sees of the hall it stands in a corner of, m²: a quarter of a disc of 5.6 m and what its edge adds.
const SEEN_M2: f64 = 27.0;

fn bound(halls: usize, modules: usize, people: usize) -> f64 {
    let side_m = (halls as f64).sqrt().ceil() * APART_M;
    128e3
        + 40e3 * modules as f64
        + 33e3 * people as f64
        + 700.0 * HALL_M * HALL_M * halls as f64
        + 400.0 * SEEN_M2 * modules as f64
        + (500.0 * side_m * side_m).min(4e6)
}

/// The most bytes a site's tracker has at once, from its first datagram to its last, and the tracks it has in the end.
fn most_bytes(record: &Record) -> (usize, usize) {
    let site = Arc::new(record.site.clone());
    let before = LIVE.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let mut site_tracker = SiteTracker::new(&site, Choice::default());
    let mut arrivals = record.arrivals.iter().peekable();
    let mut tracks = 0;
    for moment in &record.truth {
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us as f64 * 1e-6 <= moment.t) {
            site_tracker.receive(&arrival.bytes, arrival.at_us);
        }
        tracks = site_tracker.line(moment.t).tracks.len();
    }
    (MOST.load(Ordering::Relaxed) - before, tracks)
}

/// One test alone: another one at the same time would be counted, too.
#[test]
fn memory_stays_below_a_bound_in_modules_and_people() {
    let record = |duration_s| {
        let mut scene = Scene::load("hall").unwrap();
        scene.vary(&Variation { duration_s: Some(duration_s), ..Variation::default() }).unwrap();
        Record::of(&scene, 1, &Options::default()).unwrap()
    };
    let (short, long) = (record(20), record(150));
    for halls in [1, 4, 16] {
        let (bytes, tracks) = most_bytes(&short.copies(halls, APART_M));
        let (modules, people) = (4 * halls, 4 * halls);
        let most = bound(halls, modules, people);
        println!("{modules} modules, {people} people: {bytes} bytes, {tracks} tracks, at most {most:.0}");
        assert!((bytes as f64) < most, "{bytes} bytes, {most:.0} expected at most");
        assert!(bytes as f64 > most / 8.0, "the bound says nothing: {bytes} of {most:.0}");
    }
    // Two minutes on, when every history is full, it has grown no more.
    let (bytes, _) = most_bytes(&long);
    println!("after 150 s: {bytes} bytes, at most {:.0}", bound(1, 4, 4));
    assert!((bytes as f64) < bound(1, 4, 4));
}
