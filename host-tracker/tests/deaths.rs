//! Deaths of the whole tracker at any moment, under load: real modules' reports come in, and what happened is in the
//! database when it is opened again.
//!
//! ```text
//!   three halls side by side, in each: modules ─UDP▶ kehai-tracker run --db ── kill -9 ──▶ opens what is left
//!                                                     └ lines: what it knew, and when ────▶ compares
//! ```
#![cfg(unix)]

mod described;
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
use host_tracker::site_file;
use host_tracker::store::reader::Reader;
use host_tracker::store::{Keep, Store};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use kehai_tracking::tracker::LifeCycle;
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
    beating: JoinHandle<Vec<Beat>>,
}

/// One byte that is on the disk.
struct Beat {
    /// When it was there, ms since 1970.
    unix_ms: u64,
    /// How much later than it should have been, s.
    late_s: f64,
}

impl Metronome {
    fn start(folder: &Path) -> Self {
        let mut file = File::create(folder.join("metronome")).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let beating = std::thread::spawn(move || {
            let mut beats = Vec::new();
            while !stopped.load(Ordering::Relaxed) {
                let begun = Instant::now();
                std::thread::sleep(BEAT);
                file.write_all(b".").unwrap();
                file.sync_all().unwrap();
                let late_s = begun.elapsed().saturating_sub(BEAT).as_secs_f64();
                beats.push(Beat { unix_ms: unix_ms(), late_s });
            }
            beats
        });
        Self { stop, beating }
    }

    /// All its beats.
    fn stop(self) -> Vec<Beat> {
        self.stop.store(true, Ordering::Relaxed);
        self.beating.join().unwrap()
    }
}

/// What one hall's deaths have shown.
#[derive(Debug, Default)]
struct DeathReport {
    deaths: u32,
    /// Deaths of a tracker that followed people.
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
    let halls: Vec<DeathReport> = std::thread::scope(|scope| {
        let halls: Vec<_> = (0..HALLS).map(|hall| scope.spawn(move || deaths(hall))).collect();
        halls.into_iter().map(|hall| hall.join().unwrap()).collect()
    });
    let sum = |of: fn(&DeathReport) -> u32| halls.iter().map(of).sum::<u32>();
    let worst_s = |of: fn(&DeathReport) -> f64| halls.iter().map(of).fold(0.0, f64::max);
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

fn deaths(number: u64) -> DeathReport {
    let hall = Hall::new(number);
    let mut random = Pcg32::new(number, 0);
    let mut ms =
        |from: u32, to: u32| Duration::from_millis(u64::from(from + random.next_u32() % (to - from)));
    let mut shown = DeathReport::default();
    for death in 0..DEATHS {
        let begun_ms = unix_ms();
        let metronome = Metronome::start(hall.folder.path());
        let tracker = hall.tracker();
        // Every fourth dies while it starts, the others some time after they have found a person.
        let mut lines = Vec::new();
        if death % 4 == 3 {
            std::thread::sleep(ms(0, 800));
        } else {
            lines = tracker.until_a_person();
            std::thread::sleep(ms(100, 1300));
        }
        lines.extend(tracker.kill());
        let beats = metronome.stop();
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
        let kept_s = kept.as_ref().map_or(first.t - LINE_S, |kept| kept.line.t);
        let lost_s = last.t - kept_s;
        let held_up_s = held_up_s(&lines, kept_s, &beats, kept.map_or(begun_ms, |kept| kept.unix_ms));
        let own_s = lost_s - held_up_s;
        shown.worst_lost_s = shown.worst_lost_s.max(lost_s);
        shown.worst_own_s = shown.worst_own_s.max(own_s);
        assert!(
            own_s <= 1.0,
            "hall {number}, death {death}: {lost_s:.1} s lost; the machine held it up for {held_up_s:.1} s"
        );
    }
    // It is as good as ever.
    let site = Arc::new(site_file::load(&hall.site).unwrap());
    let store = Store::open(&hall.database, &site, Keep::USUAL).unwrap();
    let now_ms = unix_ms();
    store.record(Arc::new(Snapshot { unix_ms: now_ms, ..Snapshot::default() }));
    drop(store);
    let reader = Reader::open(&hall.database).unwrap();
    assert_eq!(reader.snapshot().unwrap().unwrap().unix_ms, now_ms);
    shown.events = reader.events(0, now_ms).unwrap().len();
    shown.counts = reader.counts(0, now_ms).unwrap().len();
    shown.paths = reader.paths(0, now_ms).unwrap().len();
    shown
}

/// For how long the machine held the tracker up since what it kept last, s: it left out lines, or the disk was late.
/// One hold-up does both, so only the longer of the two is an excuse; nothing before the last transaction is one.
fn held_up_s(lines: &[TracksLine], kept_s: f64, beats: &[Beat], kept_ms: u64) -> f64 {
    let pairs = lines.windows(2).filter(|pair| pair[1].t > kept_s);
    let gap_s = pairs.map(|pair| pair[1].t - pair[0].t).fold(LINE_S, f64::max) - LINE_S;
    let late_s =
        beats.iter().filter(|beat| beat.unix_ms >= kept_ms).map(|beat| beat.late_s).fold(0.0, f64::max);
    gap_s.max(late_s)
}

#[test]
fn one_hold_up_of_the_machine_excuses_once_and_only_what_came_after_it() {
    let line = |t| TracksLine { t, ..TracksLine::default() };
    let lines = [0.0, 2.0, 2.1, 2.8, 2.9].map(line);
    let beat = |unix_ms, late_s| Beat { unix_ms, late_s };
    let close =
        |value: f64, wanted: f64| assert!((value - wanted).abs() < 1e-9, "{value} instead of {wanted}");
    // Lines and disk are late by the same 0.6 s; the 1.9 s before were over when the last transaction was made.
    close(held_up_s(&lines, 2.1, &[beat(2_000, 1.9), beat(2_800, 0.6)], 2_100), 0.6);
    close(held_up_s(&lines, 0.0, &[beat(2_000, 1.9), beat(2_800, 0.6)], 0), 1.9);
    close(held_up_s(&lines[..1], 0.0, &[], 0), 0.0);
}

/// A transaction is there or it is not: each track that was followed last has a path up to that time.
fn whole(reader: &Reader, kept: &Snapshot) {
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
