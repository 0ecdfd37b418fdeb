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
use std::sync::Arc;
use std::time::Duration;

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

/// What one hall's deaths have shown.
#[derive(Debug, Default)]
struct Shown {
    deaths: u32,
    /// Deaths of a tracker that followed somebody.
    with_people: u32,
    /// Deaths before the first line.
    at_once: u32,
    worst_lost_s: f64,
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
    let worst_s = halls.iter().map(|hall| hall.worst_lost_s).fold(0.0, f64::max);
    println!(
        "{} deaths, {} while people were followed, {} before the first line: at most {worst_s:.1} s lost",
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
        let gap_s = lines.windows(2).map(|pair| pair[1].t - pair[0].t).fold(0.0, f64::max);
        let lost_s = last.t - kept.map_or(first.t - 0.1, |kept| kept.line.t);
        shown.worst_lost_s = shown.worst_lost_s.max(lost_s);
        assert!(lost_s <= 1.0 + gap_s, "hall {number}, death {death}: {lost_s:.1} s lost");
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
