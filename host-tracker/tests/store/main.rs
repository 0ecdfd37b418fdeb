//! The database through deaths of the process, full disks, years of people and questions about one day.
//!
//! ```text
//!   this test ── starts itself as a writer ─▶ "offered T" "written N" … ── kill -9 ──▶ opens what is left
//! ```

mod damaged;
#[path = "../people/mod.rs"]
mod people;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use host_tracker::store::answers::Walked;
use host_tracker::store::card::CardKey;
use host_tracker::store::event::{Event, EventKind};
use host_tracker::store::path::TOLERANCE_MM;
use host_tracker::store::pose::{self, Source};
use host_tracker::store::raw::{self, RawScanWriter};
use host_tracker::store::reader::Reader;
use host_tracker::store::{Dropped, Keep, Store, StoreError, export, known_before};
use kehai_tracking::calibration::status::Mounting;
use kehai_tracking::door::Card;
use kehai_tracking::door::doors::Passed;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use parquet::file::reader::{FileReader, SerializedFileReader};
use people::{frame, keep, site, track, walker};
use tempfile::TempDir;

/// In the environment of a child: the database it is to write.
const CHILD: &str = "KEHAI_TEST_STORE";

/// A folder that is gone with its test.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self) -> PathBuf {
        self.0.path().join("kehai.db")
    }
}

/// Not a test by itself: the process that the others start and kill.
#[test]
fn writer() {
    let Some(file) = std::env::var_os(CHILD) else { return };
    let store = Store::open(Path::new(&file), &site(), keep(30)).unwrap();
    loop {
        let now_ms = unix_ms();
        store.record(frame(now_ms, (1..=50).map(|id| walker(id, now_ms)).collect()));
        let state = store.state();
        println!("\noffered {now_ms} {} {}", state.written, state.trouble.unwrap_or_default());
        std::thread::sleep(Duration::from_millis(100));
    }
}

fn child(file: &Path, before: &str) -> std::process::Child {
    let program = std::env::current_exe().unwrap();
    let command = format!("{before} exec \"$0\" writer --exact --nocapture --test-threads=1");
    Command::new("sh")
        .args(["-c", &command])
        .arg(program)
        .env(CHILD, file)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn fifty_deaths_at_any_moment_lose_a_second_at_most_and_never_the_file() {
    let folder = Folder::new();
    let mut worst_ms = 0;
    for death in 0..50_u64 {
        let mut child = child(&folder.file(), "");
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        // Offered frames until it dies: another number of them each time.
        let (mut first_ms, mut last_ms, mut gap_ms) = (0, 0, 0);
        for line in lines
            .by_ref()
            .map_while(Result::ok)
            .filter(|line| line.starts_with("offered"))
            .take(7 + (death * 7919 % 13) as usize)
        {
            let offered_ms: u64 = line.split(' ').nth(1).unwrap().parse().unwrap();
            if last_ms == 0 {
                first_ms = offered_ms;
            } else {
                gap_ms = gap_ms.max(offered_ms - last_ms);
            }
            last_ms = offered_ms;
        }
        std::thread::sleep(Duration::from_millis(death * 37 % 100));
        child.kill().unwrap();
        child.wait().unwrap();
        // What it offered between the last line read and its death counts as well.
        let offered = lines.map_while(Result::ok).filter_map(|line| line.split(' ').nth(1)?.parse().ok());
        last_ms = offered.fold(last_ms, u64::max);
        let reader = Reader::open(&folder.file()).unwrap();
        let kept_ms = reader.snapshot().unwrap().map_or(0, |frame| frame.unix_ms);
        if kept_ms >= first_ms {
            let paths = reader.paths(kept_ms - 200, kept_ms).unwrap();
            assert_eq!(paths.len(), 50, "death {death}");
            let ends = |path: &Walked| path.places.last().unwrap().at_ms == kept_ms;
            assert!(paths.iter().all(ends), "one transaction, or none");
        }
        // Before the first transaction all of it is lost.
        let lost_ms = last_ms - kept_ms.max(first_ms);
        worst_ms = worst_ms.max(lost_ms);
        // A machine that was held up offers nothing meanwhile, and writes nothing.
        assert_eq!(reader.check().unwrap(), "ok", "death {death}");
        assert!(lost_ms <= 1000 + gap_ms, "death {death}: {lost_ms} ms lost");
    }
    println!("50 deaths, at most {worst_ms} ms lost");
}

#[test]
fn a_full_disk_is_said_and_what_was_written_stays() {
    let folder = Folder::new();
    // No file may grow beyond a megabyte.
    let mut child = child(&folder.file(), "trap '' XFSZ; ulimit -f 2048;");
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut offered = lines.map_while(Result::ok).filter(|line| line.starts_with("offered"));
    let trouble =
        offered.by_ref().find(|line| line.split(' ').nth(3).is_some_and(|word| !word.is_empty())).unwrap();
    println!("{trouble}");
    assert!(trouble.contains("kehai.db"), "it names the file");
    assert!(offered.by_ref().take(10).count() == 10, "and frames are taken as before");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(Reader::open(&folder.file()).unwrap().snapshot().unwrap().is_some());
}

#[test]
fn a_place_that_cannot_be_written_is_no_reason_to_stop() {
    let store = Store::open(Path::new("/proc/kehai/kehai.db"), &site(), keep(30)).unwrap();
    while store.state().trouble.is_none() {
        store.record(frame(unix_ms(), vec![walker(1, 0)]));
        std::thread::sleep(Duration::from_millis(10));
    }
    let trouble = store.state().trouble.unwrap();
    assert!(trouble.contains("/proc/kehai/kehai.db"), "{trouble}");
}

#[test]
fn what_is_no_database_is_refused_and_left_alone() {
    let folder = Folder::new();
    std::fs::write(folder.file(), "a letter to a friend, longer than a header of a database is, by some words, at least a hundred of bytes").unwrap();
    let error = Store::open(&folder.file(), &site(), keep(30)).unwrap_err();
    assert!(matches!(error, StoreError::Sqlite { .. }) && error.to_string().contains("kehai.db"), "{error}");
    assert!(std::fs::read_to_string(folder.file()).unwrap().starts_with("a letter"));
}

/// Writes `frames` at once and closes.
fn written(folder: &Folder, days: u32, frames: impl Iterator<Item = Arc<Snapshot>>) -> Reader {
    let store = Store::open(&folder.file(), &site(), keep(days)).unwrap();
    frames.for_each(|frame| store.see_waiting(frame));
    let dropped = store.state().dropped;
    drop(store);
    assert_eq!(dropped, Dropped::default());
    Reader::open(&folder.file()).unwrap()
}

/// Bytes of the database, its log included.
fn bytes(folder: &Folder) -> u64 {
    std::fs::read_dir(folder.0.path()).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum()
}

#[test]
fn a_year_at_home_fits_in_2_gb() {
    let (empty, folder) = (Folder::new(), Folder::new());
    let begun_ms = unix_ms() - 3_600_000;
    drop(written(&empty, 365, [frame(begun_ms, vec![])].into_iter()));
    // An hour of three people, ten lines a second.
    let hour = (0..36_000).map(|tenth| begun_ms + 100 * tenth);
    let reader =
        written(&folder, 365, hour.map(|at_ms| frame(at_ms, (1..=3).map(|id| walker(id, at_ms)).collect())));
    let an_hour = bytes(&folder) - bytes(&empty);
    let a_year = an_hour * 6 * 365;
    println!("{an_hour} bytes an hour of three people, {:.2} GB a year of 6 h a day", a_year as f64 * 1e-9);
    assert!(a_year <= 2_000_000_000);
    // What is stored is where they were.
    let paths = reader.paths(begun_ms, begun_ms + 3_600_000).unwrap();
    assert_eq!(paths.len(), 3);
    for (id, path) in (1..).zip(&paths) {
        for place in &path.places {
            let walked = walker(id, place.at_ms);
            let off_mm =
                (walked.x * 1e3 - f64::from(place.x_mm)).hypot(walked.y * 1e3 - f64::from(place.y_mm));
            assert!(off_mm < TOLERANCE_MM);
        }
    }
}

#[test]
fn a_month_at_an_entrance_fits_in_1_gb() {
    let (empty, folder) = (Folder::new(), Folder::new());
    let begun_ms = unix_ms() - 3_600_000;
    drop(written(&empty, 30, [frame(begun_ms, vec![])].into_iter()));
    // 250 passages of 8 s, one after the other: a twentieth of a day's 5000.
    let frames = (0..250 * 80_u64).map(|tenth| {
        let (id, t) = (tenth / 80, (tenth % 80) as f64 * 0.1);
        let noise = 0.01 * ((tenth as f64 * 977.0).sin() * 43_758.5).fract();
        frame(begun_ms + 100 * tenth, vec![track(1 + id, -4.0 + t, 0.3 * (t * 1.3).sin() + noise)])
    });
    drop(written(&folder, 30, frames));
    let a_month = (bytes(&folder) - bytes(&empty)) * 20 * 30;
    println!("{:.2} GB for 5000 passages a day, 30 days", a_month as f64 * 1e-9);
    assert!(a_month <= 1_000_000_000);
}

#[test]
fn questions_about_a_day_use_an_index() {
    let folder = Folder::new();
    let now_ms = unix_ms();
    let reader = written(&folder, 30, [frame(now_ms, vec![walker(1, now_ms)])].into_iter());
    for plan in reader.plans().unwrap() {
        println!("{plan}\n");
        assert!(plan.contains("INDEX") || plan.contains("PRIMARY KEY"), "{plan}");
        let scans = plan.lines().filter(|line| line.starts_with("SCAN")).collect::<Vec<_>>();
        // Zones and counting lines are a handful.
        let are_few = |line: &&str| ["SCAN zone", "SCAN line USING"].iter().any(|few| line.starts_with(few));
        assert!(scans.iter().all(are_few), "{plan}");
    }
}

#[test]
fn what_is_older_than_asked_for_is_deleted() {
    let folder = Folder::new();
    let now_ms = unix_ms();
    let days_ago = |days: u64| now_ms - days * 86_400_000;
    let frames = [days_ago(40), days_ago(10), now_ms - 1000];
    let frames = frames.into_iter().zip(1..).flat_map(|(at_ms, id)| {
        (0..3).map(move |tenth| frame(at_ms + 100 * tenth, vec![track(id, -1.0, 0.0)]))
    });
    drop(written(&folder, 365, frames));
    let reader = written(&folder, 30, [frame(now_ms, vec![])].into_iter());
    let ids: Vec<u64> = reader.paths(0, now_ms).unwrap().iter().map(|path| path.track).collect();
    assert_eq!(ids, [2, 3]);
    assert!(reader.events(0, days_ago(30)).unwrap().is_empty());
}

#[test]
fn what_was_known_half_a_minute_ago_is_taken_back_and_what_is_older_is_not() {
    let folder = Folder::new();
    let now_ms = unix_ms();
    assert_eq!(known_before(&folder.file(), now_ms), (None, None), "there is no database yet");
    drop(written(&folder, 30, [frame(now_ms, vec![walker(1, now_ms), walker(2, now_ms)])].into_iter()));
    let (frame, event) = known_before(&folder.file(), now_ms + 29_000);
    assert_eq!((frame.unwrap().line.tracks.len(), event.unwrap().kind), (2, EventKind::Restored));
    let (frame, event) = known_before(&folder.file(), now_ms + 31_000);
    assert_eq!((frame, event.unwrap().kind), (None, EventKind::Discarded));
    // A clock that was set back says nothing about how long ago it was.
    assert_eq!(known_before(&folder.file(), now_ms - 1000).0, None);
}

#[test]
fn an_export_holds_paths_counts_and_events() {
    let folder = Folder::new();
    let now_ms = unix_ms();
    let frames =
        (0..50).map(|tenth| frame(now_ms + 100 * tenth, vec![track(1, -1.0 + 0.1 * tenth as f64, 0.0)]));
    drop(written(&folder, 30, frames));
    let all = (0, u64::MAX / 2);
    export::export(&folder.file(), &folder.0.path().join("out"), all, export::Format::Csv).unwrap();
    let lines = |name: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.0.path().join("out").join(name)).unwrap();
        text.lines().map(String::from).collect()
    };
    assert_eq!(lines("paths.csv").len(), 1 + 2, "{:?}", lines("paths.csv"));
    let counts = lines("counts.csv");
    let said: Vec<&str> = counts.iter().map(|line| line.rsplit(',').nth(1).unwrap()).collect();
    assert_eq!(said, ["count", "1", "0", ""], "what is no longer followed is unknown: {counts:?}");
    assert!(
        lines("events.csv").iter().any(|line| line.contains(",leave,hall,1,")),
        "{:?}",
        lines("events.csv")
    );
    export::export(&folder.file(), &folder.0.path().join("out"), all, export::Format::Parquet).unwrap();
    let rows = |name: &str| -> Vec<String> {
        let file = std::fs::File::open(folder.0.path().join("out").join(name)).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect()
    };
    assert_eq!(rows("paths.parquet").len(), 2);
    let first = &rows("paths.parquet")[0];
    assert!(
        first.contains("track: 1") && first.contains("x_m: -1") && first.contains("hidden: false"),
        "{first}"
    );
    let counts = rows("counts.parquet");
    assert!(counts.len() == 3 && counts[2].contains("count: null"), "{counts:?}");
    let events = rows("events.parquet");
    assert!(
        events
            .iter()
            .any(|row| row.contains("\"leave\"") && row.contains("\"hall\"") && row.contains("track: 1")),
        "{events:?}"
    );
}

#[test]
fn a_text_with_commas_quotes_and_lines_survives_the_export() {
    let folder = Folder::new();
    let text = "a \"moved\" module,\nor a covered one";
    let store = Store::open(&folder.file(), &site(), keep(30)).unwrap();
    store.happened(Event::new(unix_ms(), EventKind::Alarm, "l,eft", text));
    drop(store);
    let out = folder.0.path().join("out");
    export::export(&folder.file(), &out, (0, u64::MAX / 2), export::Format::Csv).unwrap();
    let rows: Vec<csv::StringRecord> =
        csv::Reader::from_path(out.join("events.csv")).unwrap().records().map(Result::unwrap).collect();
    assert_eq!((&rows[0][2], &rows[0][3], &rows[0][4]), ("l,eft", "", text));
}

#[test]
fn cards_and_raw_scans_have_an_end_of_their_own() {
    let folder = Folder::new();
    let key = CardKey::new([1; 32]);
    let (now_ms, days_ago) = (unix_ms(), |days: u64| unix_ms() - days * 86_400_000);
    let short = Keep { days: 365, card_days: 7 };
    let store = Store::open(&folder.file(), &site(), short).unwrap();
    store.passed(passage(days_ago(8), Some(key.hash("old").into())));
    store.passed(passage(days_ago(6), Some(key.hash("04A2").into())));
    drop(store);
    let mut raw = RawScanWriter::begin(&folder.file(), "hall", now_ms - 10_000, now_ms - 5000).unwrap();
    raw.scan(now_ms - 9000, "{\"expired\": 7}".into()).unwrap();
    raw.flush().unwrap();
    drop(raw);
    let mut raw = RawScanWriter::begin(&folder.file(), "left", now_ms, now_ms + 3_600_000).unwrap();
    raw.scan(now_ms, "{}".into()).unwrap();
    raw.flush().unwrap();
    drop(raw);
    // Deleting what is too old comes after the first batch.
    let store = Store::open(&folder.file(), &site(), short).unwrap();
    while store.state().raw.is_none() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let raw = store.state().raw.unwrap();
    assert!(raw.contains("1 raw scans of left are kept for another"), "{raw}");
    drop(store);
    let reader = Reader::open(&folder.file()).unwrap();
    let cards: Vec<Vec<u8>> = reader.cards(0, now_ms).unwrap().into_iter().map(|card| card.hash).collect();
    assert_eq!(cards, [key.hash("04A2").bytes().to_vec()]);
    // Of the older passage everything else is kept.
    let passages: Vec<(Option<Card>, u32)> = reader
        .passages(0, now_ms)
        .unwrap()
        .into_iter()
        .map(|passed| (passed.passage.card, passed.passage.entered))
        .collect();
    assert_eq!(passages, [(None, 2), (Some(key.hash("04A2").into()), 2)]);
    let kept: Vec<(String, u64)> =
        reader.raw(0).unwrap().into_iter().map(|kept| (kept.module, kept.scans)).collect();
    assert_eq!(kept, [("left".to_owned(), 1)]);
    // Nothing anywhere in the file says which card it was.
    drop(reader);
    // What has expired is nowhere in the file, neither the hash nor the scan.
    let bytes = std::fs::read(folder.file()).unwrap();
    let holds = |what: &[u8]| bytes.windows(what.len()).any(|window| window == what);
    let text = key.hash("old").to_string();
    assert!(
        !holds(b"04A2") && !holds(key.hash("old").bytes()) && !holds(text.as_bytes()) && !holds(b"expired")
    );
    assert!(holds(key.hash("04A2").bytes()));
}

#[test]
fn raw_scans_that_have_expired_are_deleted_by_whatever_opens_the_database() {
    let folder = Folder::new();
    let now_ms = unix_ms();
    let request = |module: &str, until_ms: u64| {
        let mut raw = RawScanWriter::begin(&folder.file(), module, now_ms - 10_000, until_ms).unwrap();
        // Two that arrive in the same millisecond are two.
        for _ in 0..2 {
            raw.scan(now_ms - 9000, "{\"scan\": 1}".into()).unwrap();
        }
        raw.flush().unwrap();
    };
    let scans = || -> i64 {
        let database = rusqlite::Connection::open(folder.file()).unwrap();
        database.query_row("SELECT COUNT(*) FROM raw", [], |row| row.get(0)).unwrap()
    };
    request("hall", now_ms - 5000);
    request("left", now_ms - 4000);
    assert_eq!(scans(), 4, "at that time nothing had expired");
    raw::forget_expired(&folder.file(), now_ms - 4500).unwrap();
    assert_eq!(scans(), 2);
    pose::note(&folder.file(), &[], now_ms, Source::Calibration).unwrap();
    assert_eq!(scans(), 0);
    assert_eq!(Reader::open(&folder.file()).unwrap().raw(0).unwrap(), []);
    assert!(raw::forget_expired(&folder.0.path().join("none.db"), now_ms).is_err());
    assert!(!folder.0.path().join("none.db").exists());
}

/// Two went in, with this card or without one.
fn passage(begun_ms: u64, card: Option<Card>) -> Box<Passed> {
    let passed = r#"{"begun_ms": 100000, "ended_ms": 109000, "passage": {"door": "front", "number": 1, "begun_s": 1.5,
        "ended_s": 10.5, "card": null, "entered": 2, "tries": 1, "count_p": [0.0, 0.03, 0.97],
        "seen_share": 0.98, "group": [4, 7], "through": [7, 4, 9], "outcome": "alarmed", "alarm": "followed",
        "reason": "more went in than were let in"}}"#;
    let mut passed: Passed = serde_json::from_str(passed).unwrap();
    (passed.begun_ms, passed.ended_ms, passed.passage.card) = (begun_ms, begun_ms + 9000, card);
    Box::new(passed)
}

#[test]
fn where_modules_were_is_known_for_good() {
    let folder = Folder::new();
    let mut site = (*site()).clone();
    site.modules = vec![toml::from_str("name = \"left\"\nx = 1.0\ny = 2.0").unwrap()];
    for _start in 0..3 {
        drop(Store::open(&folder.file(), &Arc::new(site.clone()), keep(1)).unwrap());
    }
    site.modules[0].yaw_deg = 30.0;
    let (name, pose) = ("left".to_owned(), site.modules[0].pose());
    let found = [Mounting { name, pose, upside_down: false }];
    pose::note(&folder.file(), &found, unix_ms() + 5, Source::Calibration).unwrap();
    let poses = Reader::open(&folder.file()).unwrap().poses().unwrap();
    let said: Vec<(f64, Source)> = poses.iter().map(|pose| (pose.yaw_deg, pose.source)).collect();
    assert_eq!(said, [(0.0, Source::File), (30.0, Source::Calibration)]);
}

#[test]
fn a_passage_is_kept_whole_and_found_by_its_time() {
    let folder = Folder::new();
    let passed = passage(100_000, Some(Card(0xa11ce0)));
    let store = Store::open(&folder.file(), &site(), Keep { days: 40_000, card_days: 40_000 }).unwrap();
    store.passed(passed.clone());
    drop(store);
    let reader = Reader::open(&folder.file()).unwrap();
    assert_eq!(reader.passages(0, 99_999).unwrap(), []);
    assert_eq!(reader.passages(100_000, 200_000).unwrap(), [*passed]);
    let events = reader.events(0, 200_000).unwrap();
    let kinds: Vec<(&str, &str)> = events.iter().map(|event| (event.kind.name(), &*event.text)).collect();
    assert_eq!(kinds, [("door-alarm", "3 of 2 went in: more went in than were let in")]);
}

#[test]
fn each_run_says_which_zones_made_the_total_though_it_be_as_before() {
    let folder = Folder::new();
    let zone = |name: &str| {
        let text = format!("name = \"{name}\"\npolygon = [[0, 0], [4, 0], [4, 4]]\ncount = true");
        toml::from_str(&text).unwrap()
    };
    let now_ms = unix_ms();
    // The clock is set back in the third run, which counts another zone.
    for (at_ms, name) in [(now_ms, "hall"), (now_ms + 60_000, "hall"), (now_ms + 30_000, "study")] {
        let site = Arc::new(kehai_tracking::site::Site { zones: vec![zone(name)], ..(*site()).clone() });
        let store = Store::open(&folder.file(), &site, keep(30)).unwrap();
        store.see_waiting(frame(at_ms, vec![]));
    }
    let totals = Reader::open(&folder.file()).unwrap().totals().unwrap();
    let said: Vec<(u64, bool)> =
        totals.iter().map(|total| (total.at_ms - now_ms, total.zones.contains("hall"))).collect();
    assert_eq!(said, [(0, true), (30_000, false), (60_000, true)]);
}
