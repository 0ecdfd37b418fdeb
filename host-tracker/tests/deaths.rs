//! Deaths of the whole tracker at any moment, under load: real modules' reports come in, and what happened is in the
//! database when it is opened again.
//!
//! ```text
//!   three halls side by side, in each: modules ─UDP▶ kehai-tracker run --db ── kill -9 ──▶ opens what is left
//!                                                     └ lines: what it knew, and when ────▶ compares
//! ```
#![cfg(unix)]

mod hall;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use hall::Hall;
use host_tracker::frame::{Frame, unix_ms};
use host_tracker::site::Site;
use host_tracker::store::reader::Reader;
use host_tracker::store::{Keep, Store};
use host_tracker::trackers::LifeCycle;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

/// Deaths in each hall. 51 in all.
const DEATHS: u32 = 17;

const HALLS: u64 = 3;

/// Between two lines, s.
const LINE_S: f64 = 0.1;

/// Between two beats of the metronome.
const BEAT: Duration = Duration::from_millis(50);

/// Writes a byte and waits until it is on the disk, beat after beat: as long as it is held up by this machine, the store
/// may be, too.
struct Metronome {
    stop: Arc<AtomicBool>,
    beating: JoinHandle<f64>,
}

impl Metronome {
    fn start(folder: &Path) -> Self {
        let mut file = File::create(folder.join("metronome")).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let beating = std::thread::spawn(move || {
            let mut latest_s: f64 = 0.0;
            while !stopped.load(Ordering::Relaxed) {
                let begun = Instant::now();
                std::thread::sleep(BEAT);
                file.write_all(b".").unwrap();
                file.sync_all().unwrap();
                latest_s = latest_s.max(begun.elapsed().saturating_sub(BEAT).as_secs_f64());
            }
            latest_s
        });
        Self { stop, beating }
    }

    /// How much later than it should have been its latest beat was, s.
    fn late_s(self) -> f64 {
        self.stop.store(true, Ordering::Relaxed);
        self.beating.join().unwrap()
    }
}

/// What one hall's deaths have shown.
#[derive(Debug, Default)]
struct Shown {
    deaths: u32,
    /// Deaths of a tracker that followed somebody.
    with_people: u32,
    /// Deaths before the first line.
    at_once: u32,
    worst_lost_s: f64,
    /// Of what was lost, what this machine cannot be blamed for.
    worst_own_s: f64,
    events: usize,
    counts: usize,
    paths: usize,
}

#[test]
fn fifty_deaths_of_the_whole_tracker_lose_a_second_at_most_and_never_the_file() {
    let halls: Vec<Shown> = std::thread::scope(|scope| {
        let halls: Vec<_> = (0..HALLS).map(|hall| scope.spawn(move || deaths(hall))).collect();
        halls.into_iter().map(|hall| hall.join().unwrap()).collect()
    });
    let sum = |of: fn(&Shown) -> u32| halls.iter().map(of).sum::<u32>();
    let worst_s = |of: fn(&Shown) -> f64| halls.iter().map(of).fold(0.0, f64::max);
    let (lost_s, own_s) = (worst_s(|hall| hall.worst_lost_s), worst_s(|hall| hall.worst_own_s));
    println!(
        "{} deaths, {} while people were followed, {} before the first line: at most {lost_s:.1} s lost, {own_s:.1} s \
         without what this machine held up",
        sum(|hall| hall.deaths),
        sum(|hall| hall.with_people),
        sum(|hall| hall.at_once),
    );
    assert!(sum(|hall| hall.deaths) >= 50);
    assert!(sum(|hall| hall.with_people) >= 25, "too few deaths with people: {halls:?}");
    assert!(halls.iter().all(|hall| hall.events > 0 && hall.counts > 0 && hall.paths > 0), "{halls:?}");
}

fn deaths(number: u64) -> Shown {
    let hall = Hall::new(number);
    let mut random = Pcg32::new(number, 0);
    let mut ms =
        |from: u32, to: u32| Duration::from_millis(u64::from(from + random.next_u32() % (to - from)));
    let mut shown = Shown::default();
    for death in 0..DEATHS {
        let begun_ms = unix_ms();
        let metronome = Metronome::start(hall.folder.path());
        let tracker = hall.tracker();
        // Every fourth dies while it starts, the others some time after they have found somebody.
        let mut lines = Vec::new();
        if death % 4 == 3 {
            std::thread::sleep(ms(0, 800));
        } else {
            lines = tracker.until_somebody();
            std::thread::sleep(ms(100, 1300));
        }
        lines.extend(tracker.kill());
        let late_s = metronome.late_s();
        shown.deaths += 1;
        let reader = Reader::open(&hall.database).unwrap();
        assert_eq!(reader.check().unwrap(), "ok", "hall {number}, death {death}");
        let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
            shown.at_once += 1;
            continue;
        };
        shown.with_people += u32::from(last.tracks.iter().any(|track| track.state == LifeCycle::Confirmed));
        let kept = reader.snapshot().unwrap().filter(|frame| frame.unix_ms >= begun_ms);
        if let Some(kept) = &kept {
            whole(&reader, kept);
        }
        // A machine that was held up has left out lines, and written nothing meanwhile.
        let gap_s = lines.windows(2).map(|pair| pair[1].t - pair[0].t).fold(LINE_S, f64::max) - LINE_S;
        let lost_s = last.t - kept.map_or(first.t - LINE_S, |kept| kept.line.t);
        let own_s = lost_s - gap_s - late_s;
        shown.worst_lost_s = shown.worst_lost_s.max(lost_s);
        shown.worst_own_s = shown.worst_own_s.max(own_s);
        assert!(
            own_s <= 1.0,
            "hall {number}, death {death}: {lost_s:.1} s lost; lines {gap_s:.1} s late, the disk {late_s:.1} s"
        );
    }
    // It is as good as ever.
    let site = Arc::new(Site::load(&hall.site).unwrap());
    let store = Store::open(&hall.database, &site, Keep::default()).unwrap();
    let now_ms = unix_ms();
    store.see(Arc::new(Frame { unix_ms: now_ms, ..Frame::default() }));
    drop(store);
    let reader = Reader::open(&hall.database).unwrap();
    assert_eq!(reader.snapshot().unwrap().unwrap().unix_ms, now_ms);
    shown.events = reader.events(0, now_ms).unwrap().len();
    shown.counts = reader.counts(0, now_ms).unwrap().len();
    shown.paths = reader.paths(0, now_ms).unwrap().len();
    shown
}

/// A transaction is there or it is not: whoever was followed last has a path up to that time.
fn whole(reader: &Reader, kept: &Frame) {
    let ends: BTreeMap<u64, u64> = reader
        .paths(kept.unix_ms.saturating_sub(200), kept.unix_ms)
        .unwrap()
        .iter()
        .filter_map(|path| Some((path.track, path.places.last()?.at_ms)))
        .collect();
    for track in kept.line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative) {
        assert_eq!(ends.get(&track.id), Some(&kept.unix_ms), "track {}: {ends:?}", track.id);
    }
}
