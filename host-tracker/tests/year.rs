//! A year of a home in the database: written, asked, killed, opened and aged. Twenty minutes of each evening, so that it takes less
//! than a minute; whole evenings take minutes and half a gigabyte:
//!
//! ```text
//!   KEHAI_YEAR_MINUTES=360 cargo test --profile bench -p host-tracker --test year -- --nocapture
//!
//!   365 evenings × 3 people × 10 lines/s ─▶ Store ─▶ size · plans · questions ─▶ kill -9 ─▶ open ─▶ keep 182 days
//! ```

mod people;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use host_tracker::store::figures::{edges, figures};
use host_tracker::store::heat::{Frame, heat};
use host_tracker::store::reader::Reader;
use host_tracker::store::{Dropped, Store};
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use people::{keep, site, walker};

/// In the environment of a child: the database it is to write.
const CHILD: &str = "KEHAI_TEST_YEAR";

const DAY_MS: u64 = 86_400_000;

const DAYS: u64 = 365;

/// People are at home from 17 h on; to 23 h in whole evenings.
const FROM_MS: u64 = 17 * 3_600_000;
const MINUTE_MS: u64 = 60_000;
const EVENING_MIN: u64 = 360;

/// Of each evening unless `KEHAI_YEAR_MINUTES` says otherwise.
const MINUTES: u64 = 20;

/// What the page promises of a year of whole evenings, bytes.
const YEAR_BYTES: u64 = 2_000_000_000;

/// How often the process is killed that writes.
const DEATHS: usize = 3;

/// Lines within which the older half is deleted: an hour of them.
const AGED_LINES: usize = 36_000;

fn frame(unix_ms: u64, ids: impl Iterator<Item = u64>) -> Arc<Snapshot> {
    people::frame(unix_ms, ids.map(|id| walker(id, unix_ms)).collect())
}

/// Bytes of the database, its log included.
fn bytes(folder: &Path) -> u64 {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum()
}

/// Not a test by itself: the process that is killed.
#[test]
fn writer() {
    let Some(file) = std::env::var_os(CHILD) else { return };
    let store = Store::open(Path::new(&file), &site(), keep(365)).unwrap();
    loop {
        let now_ms = unix_ms();
        store.record(frame(now_ms, 1..=3));
        println!("\noffered {now_ms}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_year_at_home_is_written_asked_killed_and_aged() {
    let folder = std::env::temp_dir().join(format!("kehai-year-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file: PathBuf = folder.join("kehai.db");
    let minutes: u64 =
        std::env::var("KEHAI_YEAR_MINUTES").map_or(MINUTES, |minutes| minutes.parse().unwrap());
    let today_ms = unix_ms() / DAY_MS * DAY_MS;
    let first_ms = today_ms - DAYS * DAY_MS;

    let begun = Instant::now();
    let store = Store::open(&file, &site(), keep(366)).unwrap();
    for day in 0..DAYS {
        let begin_ms = first_ms + day * DAY_MS + FROM_MS;
        for tenth in 0..minutes * 600 {
            // Each evening three other people.
            store.see_waiting(frame(begin_ms + 100 * tenth, (1..=3).map(|id| 3 * day + id)));
        }
        store.see_waiting(frame(begin_ms + minutes * MINUTE_MS, 0..0));
    }
    assert_eq!(store.state().dropped, Dropped::default());
    drop(store);
    let size = bytes(&folder);
    println!(
        "{DAYS} days of {minutes} min written in {:.0} s: {:.3} GB",
        begun.elapsed().as_secs_f64(),
        size as f64 * 1e-9
    );
    assert!(size <= YEAR_BYTES * minutes / EVENING_MIN);

    let reader = Reader::open(&file).unwrap();
    for plan in reader.plans().unwrap() {
        assert!(plan.contains("INDEX") || plan.contains("PRIMARY KEY"), "{plan}");
        let scans = plan.lines().filter(|line| line.starts_with("SCAN")).collect::<Vec<_>>();
        let are_few = |line: &&str| ["SCAN zone", "SCAN line USING"].iter().any(|few| line.starts_with(few));
        assert!(scans.iter().all(are_few), "{plan}");
    }
    let (from_ms, to_ms) = reader.span_ms().unwrap().unwrap();
    assert!(from_ms <= first_ms + FROM_MS && to_ms >= today_ms - DAY_MS + FROM_MS);
    let ask = |name: &str, from_ms: u64, to_ms: u64| {
        let begun = Instant::now();
        let paths = reader.paths(from_ms, to_ms).unwrap();
        let (paths_ms, places) =
            (begun.elapsed().as_millis(), paths.iter().map(|path| path.places.len()).sum::<usize>());
        let begun = Instant::now();
        let counts = reader.counts(from_ms, to_ms).unwrap().len();
        println!(
            "{name}: {} paths of {places} places in {paths_ms} ms, {counts} counts in {} ms",
            paths.len(),
            begun.elapsed().as_millis()
        );
        paths.len()
    };
    for (name, day) in [("first day", 0), ("middle day", DAYS / 2), ("last day", DAYS - 1)] {
        let begin_ms = first_ms + day * DAY_MS;
        assert_eq!(ask(name, begin_ms, begin_ms + DAY_MS), 3);
        assert_eq!(
            ask("  ten minutes of it", begin_ms + FROM_MS + 600_000, begin_ms + FROM_MS + 1_200_000),
            3
        );
    }
    ask("the year", first_ms, today_ms);
    let month = (first_ms, first_ms + 31 * DAY_MS);
    let begun = Instant::now();
    let found = heat(&reader, month, &Frame::around(&site())).unwrap();
    println!("where people were in a month: in {} ms", begun.elapsed().as_millis());
    // Three people each evening, to the end of the last line; a walker is in the hall or beside it.
    let all_s = found.cells.iter().sum::<f64>() + found.outside_s + found.hidden_s;
    let people_s = (31 * 3 * minutes * 60) as f64;
    assert!(
        (all_s / people_s - 1.0).abs() < 0.01 && found.outside_s > 0.1 * all_s,
        "{all_s} of {people_s} s"
    );
    let begun = Instant::now();
    let bins = figures(&reader, &edges(month, 3_600_000)).unwrap().bins;
    println!("{} hours of it in {} ms", bins.len(), begun.elapsed().as_millis());
    let known_h = bins.iter().filter(|bin| bin.zones["hall"].mean.is_some()).count() as u64;
    // In between the number of people is not known.
    assert_eq!((bins.len() as u64, known_h), (31 * 24, 31 * minutes.div_ceil(60)));
    drop(reader);

    let program = std::env::current_exe().unwrap();
    for death in 0..DEATHS {
        let mut command = Command::new(&program);
        command.args(["writer", "--exact", "--nocapture", "--test-threads=1"]).env(CHILD, &file);
        let begun = Instant::now();
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut offered = lines.map_while(Result::ok).filter(|line| line.starts_with("offered"));
        offered.next().unwrap();
        let opened_ms = begun.elapsed().as_millis();
        let last = offered.by_ref().take(20 + death * 3).last().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        let last_ms: u64 =
            offered.chain([last]).filter_map(|line| line.split(' ').nth(1)?.parse().ok()).max().unwrap();
        let begun = Instant::now();
        let reader = Reader::open(&file).unwrap();
        let kept_ms = reader.snapshot().unwrap().unwrap().unix_ms;
        println!(
            "killed: {} ms lost, read again after {} ms; a tracker had opened it in {opened_ms} ms",
            last_ms.saturating_sub(kept_ms),
            begun.elapsed().as_millis()
        );
        assert!(last_ms.saturating_sub(kept_ms) <= 1500);
    }
    let begun = Instant::now();
    assert_eq!(Reader::open(&file).unwrap().check().unwrap(), "ok");
    println!("whole after {DEATHS} deaths: checked in {:.1} s", begun.elapsed().as_secs_f64());

    // From now on only the newer half is kept.
    let half = DAYS / 2;
    let border_ms = unix_ms() - half * DAY_MS;
    let database = rusqlite::Connection::open(&file).unwrap();
    let old = |table: &str, column: &str| -> i64 {
        let question = format!("SELECT COUNT(*) FROM {table} WHERE {column} < ?1");
        database.query_row(&question, [(border_ms - DAY_MS) as i64], |row| row.get(0)).unwrap()
    };
    let begun = Instant::now();
    let store = Store::open(&file, &site(), keep(half as u32)).unwrap();
    let mut lines = 0;
    while old("path", "ended_ms") + old("event", "at_ms") + old("count", "at_ms") > 0 {
        lines += 1;
        assert!(lines < AGED_LINES, "{:?}", store.state());
        store.record(frame(unix_ms(), 1..=3));
        std::thread::sleep(Duration::from_millis(100));
    }
    drop(database);
    let aged_s = begun.elapsed().as_secs_f64();
    drop(store);
    let reader = Reader::open(&file).unwrap();
    assert_eq!(reader.paths(first_ms, border_ms - 2 * DAY_MS).unwrap().len(), 0);
    println!("{half} days kept: aged in {aged_s:.0} s, {:.3} GB", bytes(&folder) as f64 * 1e-9);
    drop(reader);
    std::fs::remove_dir_all(&folder).unwrap();
}
