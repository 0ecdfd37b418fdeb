//! The surfaces of the past: what the database, its exports and a recording say of the time that was.
//!
//! ```text
//!   database ─┬─▶ GET /api/overview, /api/figures, /api/past     bins, hours, the last ten minutes
//!             ├─▶ kehai-tracker report
//!             └─▶ export: CSV, Parquet
//!   recording ──▶ /lines
//! ```

use std::fs::File;
use std::path::Path;
use std::process::Command;

use host_tracker::store::export::{Format, export};
use host_tracker::store::reader::Reader;
use kehai_tracking::lines::Direction;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use serde_json::Value;

use super::judge::{Judge, When};
use super::map::Map;
use super::truth::{Told, Truth, What};
use super::world::Random;

/// A row of a table of counts: from then on so many.
struct Row {
    zone: String,
    at_ms: u64,
    count: Option<i64>,
}

/// What the map's server says of a time that lies in the run, or beside it.
pub fn asked(judge: &mut Judge, truth: &Truth, map: &Map, database: &Path, random: &mut Random) {
    let (first_ms, last_ms) = truth.span_ms();
    let long_ms = last_ms - first_ms + 20_000;
    let from_ms = (first_ms + random.below(long_ms)).saturating_sub(10_000);
    let to_ms = from_ms + 500 + random.below((2 * long_ms).min(3_500_000));
    let bins = 1 + random.below(400);
    let bin_s = 1 + random.below(60) + to_ms.saturating_sub(from_ms) / 900_000;
    let asked = || {
        ["overview?bins=", "figures?bin=", "past?"].map(|what| {
            let more = match what {
                "overview?bins=" => format!("{bins}&"),
                "figures?bin=" => format!("{bin_s}&"),
                _ => String::new(),
            };
            map.ask(&format!("/api/{what}{more}from={from_ms}&to={to_ms}"))
        })
    };
    // The database's thread writes twice a second by this machine's clock, whatever the run's does meanwhile.
    let written = || Reader::open(database).unwrap().snapshot().unwrap().map(|newest| newest.line.t);
    let (told_s, [glance, found, past]) = loop {
        let (before, answers) = (written(), asked());
        if written() == before {
            break (before.unwrap_or(f64::NEG_INFINITY), answers);
        }
    };
    let told = truth.until(told_s);
    overview(judge, told, &glance);
    figures(judge, told, "figures", &found);
    let row = |row: &Value| Row {
        zone: row["zone"].as_str().unwrap().to_owned(),
        at_ms: row["at_ms"].as_u64().unwrap(),
        count: row["count"].as_i64(),
    };
    let rows: Vec<Row> = past["counts"].as_array().unwrap().iter().map(row).collect();
    let lives: Vec<(u64, u64)> = serde_json::from_value(past["lives"].clone()).unwrap();
    // Who replays it has the lives beside the counts.
    for row in rows.iter().filter(|row| row.count == Some(0)) {
        let Some(life) = lives.iter().find(|life| (life.0..=life.1).contains(&row.at_ms)) else { continue };
        holds(judge, told, "past", &rows, row, life.1.min(to_ms));
    }
}

/// It adds up the zones that made the total then.
fn overview(judge: &mut Judge, told: Told<'_>, glance: &Value) {
    let bins = glance["bins"].as_array().unwrap();
    let (from_ms, to_ms) = (glance["from_ms"].as_u64().unwrap(), glance["to_ms"].as_u64().unwrap());
    let edge = |bin: usize| from_ms + ((to_ms - from_ms) as f64 * bin as f64 / bins.len() as f64) as u64;
    for (bin, _) in bins.iter().enumerate().filter(|(_, people)| **people == 0) {
        let (from_ms, to_ms) = (edge(bin), edge(bin + 1));
        judge.empty("overview", &What::Total, When::Over(from_ms, to_ms, told), "0 in a bin");
    }
}

/// Bins of figures, by the API, or of a report.
fn figures(judge: &mut Judge, told: Told<'_>, surface: &'static str, found: &Value) {
    for bin in found["bins"].as_array().unwrap() {
        let when = When::Over(bin["from_ms"].as_u64().unwrap(), bin["to_ms"].as_u64().unwrap(), told);
        for (name, line) in bin["lines"].as_object().unwrap() {
            for (key, direction) in [("in", Direction::In), ("out", Direction::Out)] {
                if line[key] == 0 {
                    let what = What::Crossed(name.clone(), direction);
                    judge.empty(surface, &what, when, &line.to_string());
                }
            }
        }
        for (name, zone) in bin["zones"].as_object().unwrap() {
            for (key, what) in [
                ("mean", What::Zone(name.clone())),
                ("most", What::Zone(name.clone())),
                ("entered", What::Stays(name.clone())),
                ("stays", What::Stays(name.clone())),
            ] {
                if zone[key].as_f64() == Some(0.0) {
                    judge.empty(surface, &what, when, &format!("{key} of {zone}"));
                }
            }
        }
    }
}

/// That a zone is empty holds until its next row, or the end.
fn holds(judge: &mut Judge, told: Told<'_>, surface: &'static str, rows: &[Row], row: &Row, end_ms: u64) {
    let later = rows.iter().filter(|other| other.zone == row.zone && other.at_ms > row.at_ms);
    let until_ms = later.map(|other| other.at_ms).min().unwrap_or(end_ms).min(end_ms);
    if until_ms > row.at_ms {
        let when = When::Over(row.at_ms, until_ms, told);
        judge.empty(surface, &What::Zone(row.zone.clone()), when, "0 until the next row");
    }
}

/// The tables that a database is exported to. Who reads one knows nothing but its rows.
pub fn exported(judge: &mut Judge, truth: &Truth, database: &Path, folder: &Path) {
    let (first_ms, last_ms) = truth.span_ms();
    let span = (first_ms - 1000, last_ms + 1000);
    for format in [Format::Csv, Format::Parquet] {
        export(database, folder, span, format).unwrap();
    }
    let mut table = csv::Reader::from_path(folder.join("counts.csv")).unwrap();
    let row = |row: Result<csv::StringRecord, csv::Error>| {
        let row = row.unwrap();
        let at_s: f64 = row[1].parse().unwrap();
        Row { zone: row[0].to_owned(), at_ms: (at_s * 1e3).round() as u64, count: row[2].parse().ok() }
    };
    let rows: Vec<Row> = table.records().map(row).collect();
    for row in rows.iter().filter(|row| row.count == Some(0)) {
        holds(judge, truth.all(), "CSV", &rows, row, last_ms);
    }
    let table = SerializedFileReader::new(File::open(folder.join("counts.parquet")).unwrap()).unwrap();
    let row = |row: parquet::record::Row| Row {
        zone: row.get_string(0).unwrap().clone(),
        at_ms: row.get_timestamp_millis(1).unwrap() as u64,
        count: row.get_long(2).ok(),
    };
    let rows: Vec<Row> = table.get_row_iter(None).unwrap().map(|read| row(read.unwrap())).collect();
    for row in rows.iter().filter(|row| row.count == Some(0)) {
        holds(judge, truth.all(), "Parquet", &rows, row, last_ms);
    }
}

/// `kehai-tracker report` of the day of the run, hour by hour, and of its words.
pub fn reported(judge: &mut Judge, truth: &Truth, database: &Path) {
    let report = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.arg("report").arg(database).args(["--day", super::run::DAY]).args(arguments).env("TZ", "UTC");
        let done = command.output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    };
    let found: Value = serde_json::from_str(&report(&["--json"])).unwrap();
    figures(judge, truth.all(), "report", &found);
    let text = report(&["--csv"]);
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let hours = found["bins"].as_array().unwrap();
    for row in table.deserialize::<std::collections::BTreeMap<String, String>>() {
        let row = row.unwrap();
        let from_ms = (row["time"].parse::<f64>().unwrap() * 1e3).round() as u64;
        let hour = hours.iter().find(|hour| hour["from_ms"] == from_ms).unwrap();
        let when = When::Over(from_ms, hour["to_ms"].as_u64().unwrap(), truth.all());
        let name = || row["name"].clone();
        let figures = if row["kind"] == "line" {
            vec![("in", What::Crossed(name(), Direction::In)), ("out", What::Crossed(name(), Direction::Out))]
        } else {
            let zone = [("mean", What::Zone(name())), ("most", What::Zone(name()))];
            let stays = [("entered", What::Stays(name())), ("stays", What::Stays(name()))];
            zone.into_iter().chain(stays).collect()
        };
        for (key, what) in figures {
            if row[key].parse() == Ok(0.0) {
                judge.empty("report, CSV", &what, when, &format!("{key} of {row:?}"));
            }
        }
    }
}

/// The lines of a recording.
pub fn recorded(judge: &mut Judge, truth: &Truth, file: &Path, life: u32) {
    let bytes = std::fs::read(file).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.topic == "/lines" {
            let line: Value = serde_json::from_slice(&message.data).unwrap();
            let when = When::At(truth.at(life, line["t"].as_f64().unwrap()));
            super::live::frame(judge, "recording", &line, when);
        }
    }
}

/// The last ten minutes, as the map's time line has them.
pub fn history(judge: &mut Judge, truth: &Truth, map: &Map) {
    for line in map.ask("/api/history").as_array().unwrap() {
        // The clock may have been there twice; one of the moments is meant.
        let moments: Vec<_> = truth.of_unix(line["unix_ms"].as_u64().unwrap()).collect();
        for (name, _) in line["zones"].as_object().unwrap().iter().filter(|(_, zone)| zone["count"] == 0) {
            let what = What::Zone(name.clone());
            let of = moments.iter().find(|moment| moment.says(&what, true)).or(moments.first());
            judge.empty("history", &what, When::At(of.copied()), &line["zones"].to_string());
        }
    }
}
