//! A database as a partitioned folder, asked by DuckDB: every query of docs/analytics.md, against what the tracker itself reports.
//!
//! ```text
//!   22:30 ━━━━━━━━━━━┿━━━━━━━ 0:40      1:05 ━━━━━ 1:30      three people, a line, a hall; two trackers, and none between
//!         midnight, UTC
//!   database ─┬─ figures, heat ───────────────────────────────╮
//!             └─ export by day ─▶ DuckDB, the page's queries ─┴─ equal
//! ```
#![allow(missing_docs, reason = "a test program")]

mod people;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use host_tracker::store::export::partitioned::{Whose, Written, export};
use host_tracker::store::figures::{edges, figures};
use host_tracker::store::reader::Reader;
use host_tracker::store::{Dropped, Store};
use kehai_tracking::jsonl::{TrackLine, ZoneKnown, ZoneLine};
use kehai_tracking::lines::CrossedLine;
use kehai_tracking::occupancy::Found;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot, unix_ms};
use kehai_tracking::tracker::LifeCycle;
use parquet::file::reader::{FileReader, SerializedFileReader};
use people::{keep, site, track};
use serde_json::Value;

const DAY_MS: u64 = 86_400_000;
const HOUR_MS: u64 = 3_600_000;
const MINUTE_MS: u64 = 60_000;

/// The midnight between both days: some days ago, as a database keeps what is past.
fn midnight_ms() -> u64 {
    (unix_ms() / DAY_MS - 2) * DAY_MS
}

/// Two people walk to and fro between both halves of a room, at up to 0.6 m/s; a third stands. Ten minutes of each hour are unknown.
fn frame(at_ms: u64, begun_ms: u64) -> Arc<Snapshot> {
    let t_s = (at_ms - begun_ms) as f64 * 1e-3;
    let walker = |id: u64, period_s: f64| {
        track(id, 4.0 * (std::f64::consts::TAU * t_s / period_s).cos(), 0.3 * id as f64)
    };
    let tracks = vec![walker(1, 41.0), walker(2, 310.0), track(3, -2.2, 3.1)];
    let crossings = (t_s / 48.5) as u64;
    let is_known = (at_ms / MINUTE_MS) % 60 >= 10;
    let (inward, outward) = (crossings / 2, crossings.div_ceil(2));
    let state = if is_known { ZoneKnown::Known } else { ZoneKnown::Unknown };
    let front = CrossedLine {
        name: "front".into(),
        inward: is_known.then_some(inward),
        outward: is_known.then_some(outward),
        state,
        unknown_s: 0.0,
        unfollowed: 0,
    };
    let left = ModuleLine {
        name: "left".into(),
        state: DeviceState::Watching,
        scans_hz: 10.0,
        ..ModuleLine::default()
    };
    let right = ModuleLine { name: "right".into(), state: DeviceState::Missing, ..ModuleLine::default() };
    let mut frame = Arc::unwrap_or_clone(people::frame(at_ms, tracks));
    frame.lines = vec![front];
    frame.modules = vec![left, right];
    if !is_known {
        frame
            .line
            .zones
            .insert("hall".into(), ZoneLine::new(Found::inside(0, vec![]), 0.0, ZoneKnown::Unknown));
    }
    Arc::new(frame)
}

/// Both trackers' database.
fn database(folder: &Path) -> PathBuf {
    let file = folder.join("office.db");
    let midnight_ms = midnight_ms();
    for (from_min, to_min) in [(-90, 40), (65, 90)] {
        let at_ms = |minute: i64| midnight_ms.saturating_add_signed(minute * MINUTE_MS as i64);
        let store = Store::open(&file, &site(), keep(30)).unwrap();
        for at in (at_ms(from_min)..at_ms(to_min)).step_by(1000) {
            store.see_waiting(frame(at, at_ms(from_min)));
        }
        assert_eq!(store.state().dropped, Dropped::default());
    }
    file
}

fn partitioned(file: &Path, folder: &Path, span_ms: (u64, u64)) -> Written {
    let whose = Whose { site: "Büro 1/2".into(), area: "main".into() };
    export(file, folder, &whose, span_ms).unwrap()
}

fn rows(file: &Path) -> i64 {
    let file = SerializedFileReader::new(std::fs::File::open(file).unwrap()).unwrap();
    file.metadata().file_metadata().num_rows()
}

#[test]
fn a_day_is_written_again_as_a_whole_and_never_with_less() {
    let folder = tempfile::tempdir().unwrap();
    let (file, lake) = (database(folder.path()), folder.path().join("lake"));
    let until_ms = midnight_ms() + HOUR_MS / 2;
    let first = partitioned(&file, &lake, (0, until_ms));
    assert!(first.left.is_empty());
    let counts = |written: &Written| -> Vec<PathBuf> {
        written.files.iter().filter(|file| file.starts_with(lake.join("counts"))).cloned().collect()
    };
    // Two days of counts, and of the newer one a file of every table.
    let [_, second] = &counts(&first)[..] else { panic!("{first:?}") };
    let name = second.strip_prefix(&lake).unwrap().to_string_lossy().into_owned();
    assert!(
        name.starts_with("counts/site=B%C3%BCro%201%2F2/area=main/day=20")
            && name.ends_with("/kehai.parquet")
    );
    let before = rows(second);
    // The whole of it, though only its last hour is asked for.
    let again = partitioned(&file, &lake, (midnight_ms() + HOUR_MS, midnight_ms() + 3 * HOUR_MS));
    assert_eq!(counts(&again), std::slice::from_ref(second));
    assert!(rows(second) > before, "{before}");
    // What the database has forgotten since stays in the file.
    let whole = rows(second);
    let forget = rusqlite::Connection::open(&file).unwrap();
    forget.execute("DELETE FROM count WHERE at_ms % 2 = 0 OR at_ms % 3 = 0", []).unwrap();
    let less = partitioned(&file, &lake, (midnight_ms(), midnight_ms() + 3 * HOUR_MS));
    assert_eq!((counts(&less), less.left, rows(second)), (vec![], vec![second.clone()], whole));
}

#[test]
fn a_tracker_that_runs_has_not_ended_where_it_has_written_to() {
    let folder = tempfile::tempdir().unwrap();
    let (file, lake) = (folder.path().join("office.db"), folder.path().join("lake"));
    let (begun_ms, ended_ms) = (midnight_ms() + HOUR_MS, midnight_ms() + HOUR_MS + MINUTE_MS);
    let store = Store::open(&file, &site(), keep(30)).unwrap();
    // One who stands: nothing changes.
    for at_ms in (begun_ms..=ended_ms).step_by(1000) {
        store.see_waiting(people::frame(at_ms, vec![track(3, -2.2, 3.1)]));
    }
    drop(store);
    let counts = |written: &Written| -> PathBuf {
        let mut all = written.files.iter().chain(&written.left);
        all.find(|file| file.starts_with(lake.join("counts"))).unwrap().clone()
    };
    let whole = counts(&partitioned(&file, &lake, (midnight_ms(), ended_ms + 500)));
    assert_eq!(rows(&whole), 1, "what it has not written yet is not unknown");
    // By then it was over, and nothing known; but it goes on, and no export may keep that for good.
    assert_eq!(rows(&counts(&partitioned(&file, &lake, (midnight_ms(), ended_ms + MINUTE_MS)))), 2);
    let goes_on = rusqlite::Connection::open(&file).unwrap();
    let later_ms = (ended_ms + HOUR_MS) as i64;
    goes_on.execute("UPDATE run SET ended_ms = ?1", [later_ms]).unwrap();
    goes_on.execute("UPDATE snapshot SET at_ms = ?1", [later_ms]).unwrap();
    let again = partitioned(&file, &lake, (midnight_ms(), ended_ms + HOUR_MS));
    assert_eq!((rows(&counts(&again)), again.left), (1, vec![]));
}

/// Python with DuckDB: `./ci.sh test` installs it.
fn answers(lake: &Path) -> Option<Value> {
    let name = std::env::var("KEHAI_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_it = Command::new(&name).args(["-c", "import duckdb"]).output();
    if !has_it.is_ok_and(|output| output.status.success()) {
        test_support::fail_in_ci_else_skip("no python3 with the package duckdb");
        return None;
    }
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (script, page) = (project.join("tests/analytics.py"), project.join("docs/analytics.md"));
    let output = Command::new(name).arg(script).arg(page).arg(lake).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// Whether both are unknown, or nearly the same.
#[track_caller]
fn assert_same(answer: &Value, own: Option<f64>, within: f64, what: &str) {
    match (answer.as_f64(), own) {
        (None, None) => {}
        (Some(answer), Some(own)) => assert!((answer - own).abs() <= within, "{what}: {answer}, {own}"),
        both => panic!("{what}: {both:?}"),
    }
}

#[test]
fn duckdb_finds_what_the_report_says() {
    let folder = tempfile::tempdir().unwrap();
    let (file, lake) = (database(folder.path()), folder.path().join("lake"));
    // All of it is over.
    partitioned(&file, &lake, (0, midnight_ms() + 4 * HOUR_MS));
    let Some(answers) = answers(&lake) else { return };
    let of =
        |number: &str| answers[number].as_array().unwrap_or_else(|| panic!("no answer {number}")).clone();
    for number in 1..=10 {
        assert!(!of(&number.to_string()).is_empty(), "{number}: {answers}");
    }
    let begin_ms = midnight_ms() - 2 * HOUR_MS;
    let own =
        figures(&Reader::open(&file).unwrap(), &edges((begin_ms, begin_ms + 4 * HOUR_MS), HOUR_MS)).unwrap();
    let in_hour = |number: &str, from_ms: u64| {
        let hour = |row: &Value| (row["hour"].as_f64().unwrap() * 1e3).round() as u64;
        of(number).into_iter().find(|row| hour(row) == from_ms).unwrap_or_default()
    };
    let mut compared = 0;
    for bin in &own.bins {
        let (line, zone) = (bin.lines["front"], bin.zones["hall"]);
        let [crossed, full, stayed] = ["1", "3", "4"].map(|number| in_hour(number, bin.from_ms));
        let what = format!("{bin:?}: {crossed} {full} {stayed}");
        assert_eq!(crossed["site"], "Büro 1/2", "{what}");
        assert_same(&crossed["came_in"], line.inward.map(f64::from), 0.0, &what);
        assert_same(&crossed["went_out"], line.outward.map(f64::from), 0.0, &what);
        // A tracker that ends knows nothing from the next millisecond on.
        assert_same(&crossed["unknown_s"], Some(line.unknown_s), 0.0021, &what);
        assert_same(&full["mean"], zone.mean, 1e-5, &what);
        assert_same(&full["most"], zone.most.map(f64::from), 0.0, &what);
        assert_same(&full["unknown_s"], Some(zone.unknown_s), 0.0021, &what);
        assert_same(&stayed["dwell_s"], zone.dwell_s, 1e-6, &what);
        assert_eq!(stayed["stays"].as_u64().unwrap_or(0), u64::from(zone.stays.unwrap_or(0)), "{what}");
        compared += u32::from(line.inward.is_some_and(|inward| inward > 3) && zone.stays > Some(3));
        assert!(zone.unknown_s >= 600.0, "{what}");
    }
    assert!(compared >= 3, "{own:?}");
    // The one who stands is where people are most; what is not known of a module has no number.
    let most = &of("5")[0];
    assert_eq!((most["x_m"].as_f64(), most["y_m"].as_f64()), (Some(-2.5), Some(3.0)), "{most}");
    let modules = of("10");
    let right = modules.iter().find(|row| row["module"] == "right").unwrap();
    assert_eq!((&right["lost_percent"], &right["checksum_errors"]), (&Value::Null, &Value::Null));
    assert_eq!(right["watching_percent"], 0.0);
}

#[test]
fn paths_of_two_databases_with_the_same_numbers_are_not_joined() {
    let folder = tempfile::tempdir().unwrap();
    let (lake, span_ms) = (folder.path().join("lake"), (0, midnight_ms() + 4 * HOUR_MS));
    let lasts_ms = 20 * MINUTE_MS;
    // As after a database was put aside: runs and tracks begin at 1 again.
    for (name, hour_ms) in [("old.db", midnight_ms() - 20 * HOUR_MS), ("new.db", midnight_ms() + HOUR_MS)] {
        let (file, begun_ms) = (folder.path().join(name), hour_ms + 10 * MINUTE_MS);
        let store = Store::open(&file, &site(), keep(30)).unwrap();
        for at_ms in (begun_ms..begun_ms + lasts_ms).step_by(1000) {
            store.see_waiting(frame(at_ms, begun_ms));
        }
        drop(store);
        partitioned(&file, &lake, span_ms);
    }
    let Some(answers) = answers(&lake) else { return };
    let cells = answers["5"].as_array().unwrap();
    let seconds: f64 = cells.iter().map(|cell| cell["seconds"].as_f64().unwrap()).sum();
    let three_twice_s = 3.0 * 2.0 * lasts_ms as f64 * 1e-3;
    assert!((0.8 * three_twice_s..=1.01 * three_twice_s).contains(&seconds), "{seconds} of {three_twice_s}");
}

#[test]
fn a_time_in_which_a_person_was_hidden_is_in_no_cell() {
    let folder = tempfile::tempdir().unwrap();
    let (file, lake) = (folder.path().join("office.db"), folder.path().join("lake"));
    let begun_ms = midnight_ms() + HOUR_MS;
    let store = Store::open(&file, &site(), keep(30)).unwrap();
    // Seen for 20 s, hidden for the next 100 s, seen for 30 s.
    for second in 0..=150_u64 {
        let is_hidden = (21..=120).contains(&second);
        let state = if is_hidden { LifeCycle::Occluded } else { LifeCycle::Confirmed };
        let person = TrackLine { state, ..track(7, -2.2, 3.1) };
        store.see_waiting(people::frame(begun_ms + 1000 * second, vec![person]));
    }
    drop(store);
    partitioned(&file, &lake, (0, midnight_ms() + 4 * HOUR_MS));
    let Some(answers) = answers(&lake) else { return };
    let cells = answers["5"].as_array().unwrap();
    let seconds: f64 = cells.iter().map(|cell| cell["seconds"].as_f64().unwrap()).sum();
    assert!((seconds - 50.0).abs() < 1e-6, "{cells:?}");
}
