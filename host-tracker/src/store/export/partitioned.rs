//! What happened, as Parquet files by table, site, area and day, which DuckDB, Polars and Spark read as one table.
//!
//! ```text
//!   DIR / counts    / site=door / area=main / day=2026-03-14 / kehai.parquet
//!         lines       …                       UTC
//!         paths, crossings, stays, events, poses, health
//!
//!   counts   zone,time,until,count,state      │ midnight
//!   ── 2 ────────────────────────────── 3 ────┼────── 2 ───▶     a span goes on in the next day with a row of its own:
//!   12:00 ▶ 18:00, 2   18:00 ▶ 24:00, 3       │ 0:00 ▶ …, 3      each day can be read alone
//! ```
//!
//! A day is written again as a whole, and at every moment its file is there whole. One with more rows than the database has by
//! now is left alone: the database has forgotten some. Rows that say that nothing was known do not count for that: where a tracker
//! has told nothing by the time of the export, one is added that later exports may not need.
//!
//! Layout: <https://duckdb.org/docs/data/partitioning/hive_partitioning>.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path as File, PathBuf};

use jiff::Timestamp;
use jiff::tz::TimeZone;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::{Field, Row};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use super::super::error::StoreError;
use super::super::figures::{STAY_MS, stays};
use super::super::numbers::integer;
use super::super::reader::Reader;
use super::super::retention::DAY_MS;
use super::table::{Column, Table};
use super::{counts, lines, tables, whole};
use kehai_tracking::occupancy::ZoneKnown;

/// The name of every file.
const FILE: &str = "kehai.parquet";

/// What stands in a name of a folder as it is.
const PLAIN: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.');

/// Whose tables they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Whose {
    /// The site's name.
    pub site: String,
    /// The name of the part of it that one tracker follows.
    pub area: String,
}

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Files that were written.
    pub files: Vec<PathBuf>,
    /// Files that had more rows, and were left alone.
    pub left: Vec<PathBuf>,
}

/// Writes the days that touch the time from `from_ms` to `to_ms`, by UTC. The newest day has a file of every table, also of
/// those without a row, so that a reader finds one.
///
/// # Errors
/// A file cannot be written, or the database not be read.
pub fn export(
    database: &File,
    folder: &File,
    whose: &Whose,
    (from_ms, to_ms): (u64, u64),
) -> Result<Written, StoreError> {
    let failed = |error| StoreError::Sqlite { file: database.to_path_buf(), error };
    let reader = Reader::open_kept(database)?;
    // A tracker that runs has not ended where it has written to.
    let to_ms = reader.until_ms(to_ms).map_err(failed)?;
    let known_ms = reader.span_ms().map_err(failed)?.map_or(to_ms, |(first_ms, _)| first_ms);
    let (first, last) = (from_ms.max(known_ms).min(to_ms) / DAY_MS, to_ms / DAY_MS);
    let mut written = Written::default();
    for day in first..=last {
        let tables = of_day(&reader, day, to_ms).map_err(failed)?;
        for table in tables.iter().filter(|table| day == last || table.rows() > 0) {
            let file = file_of(folder, table.name, whose, day);
            match put(table, &file) {
                Ok(true) => written.files.push(file),
                Ok(false) => written.left.push(file),
                Err(error) => return Err(StoreError::File { file, error }),
            }
        }
    }
    Ok(written)
}

fn file_of(folder: &File, table: &str, whose: &Whose, day: u64) -> PathBuf {
    let begins = Timestamp::from_millisecond(integer(day * DAY_MS)).unwrap_or_default();
    let date = begins.to_zoned(TimeZone::UTC).date();
    let key = |key: &str, value: &str| format!("{key}={}", utf8_percent_encode(value, PLAIN));
    folder
        .join(table)
        .join(key("site", &whose.site))
        .join(key("area", &whose.area))
        .join(key("day", &date.to_string()))
        .join(FILE)
}

/// Puts a table in the place of a file; not in that of one with more rows.
fn put(table: &Table, file: &File) -> io::Result<bool> {
    if has_more(file, table.rows() - table.count(is_unknown)).unwrap_or(false) {
        return Ok(false);
    }
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    whole::put(file, |file| table.parquet(file))?;
    Ok(true)
}

/// Whether a file has more than so many rows, but for those that say that nothing was known; none if it cannot be read.
fn has_more(file: &File, rows: usize) -> Option<bool> {
    let there = SerializedFileReader::new(fs::File::open(file).ok()?).ok()?;
    if there.metadata().file_metadata().num_rows().unsigned_abs() <= rows as u64 {
        return Some(false);
    }
    let says_unknown = |row: &Row| {
        let mut columns = row.get_column_iter();
        columns.any(|(name, value)| matches!(value, Field::Str(text) if is_unknown(name, text)))
    };
    let mut told = 0;
    for row in there.get_row_iter(None).ok()? {
        told += usize::from(!says_unknown(&row.ok()?));
    }
    Some(told > rows)
}

/// Whether a column of this name says by this text that nothing was known of a zone or a line.
fn is_unknown(column: &str, text: &str) -> bool {
    column == "state" && text == ZoneKnown::Unknown.name()
}

/// The tables of a day, until `to_ms`.
fn of_day(reader: &Reader, day: u64, to_ms: u64) -> rusqlite::Result<[Table; 8]> {
    let (begin_ms, end_ms) = (day * DAY_MS, ((day + 1) * DAY_MS).min(to_ms.saturating_add(1)));
    let is_now = |at_ms: u64| (begin_ms..end_ms).contains(&at_ms);
    // What a question includes.
    let (before_ms, last_ms) = (begin_ms.saturating_sub(STAY_MS), end_ms.saturating_sub(1));
    let lives = reader.lives(before_ms, last_ms)?;
    let mut events = reader.events(before_ms, last_ms)?;
    let mut stays = stays(&events, &lives);
    stays.retain(|stay| is_now(stay.ended_ms));
    events.retain(|event| is_now(event.at_ms));
    let mut poses = reader.poses()?;
    poses.retain(|pose| is_now(pose.at_ms));

    let mut counts = counts(reader, &lives, (begin_ms, end_ms))?;
    counts.iter_mut().for_each(|row| row.at_ms = row.at_ms.max(begin_ms));
    let (counts, until) = spans(counts, end_ms, |row| (row.zone.clone(), row.at_ms));
    let mut counts = tables::counts(&counts);
    counts.columns.insert(2, ("until", Column::Time(until)));

    let mut lines = lines(reader, &lives, (begin_ms, end_ms))?;
    lines.iter_mut().for_each(|row| row.at_ms = row.at_ms.max(begin_ms));
    let (lines, until) = spans(lines, end_ms, |row| (row.line.clone(), row.at_ms));
    let mut lines = tables::lines(&lines);
    lines.columns.insert(2, ("until", Column::Time(until)));
    Ok([
        tables::paths(&reader.paths(begin_ms, last_ms)?, |place| is_now(place.at_ms)),
        counts,
        tables::crossings(&reader.crossings(begin_ms, last_ms)?),
        lines,
        tables::stays(&stays),
        tables::events(&events),
        tables::poses(&poses),
        tables::health(&reader.health(begin_ms, last_ms)?),
    ])
}

/// Until when each row holds: until the next of the same name, or the end. `rows` in order of time; one that holds for no
/// time is left out.
fn spans<T>(rows: Vec<T>, end_ms: u64, of: impl Fn(&T) -> (String, u64)) -> (Vec<T>, Vec<u64>) {
    let mut next_ms: BTreeMap<String, u64> = BTreeMap::new();
    let mut spans: Vec<(T, u64)> = Vec::with_capacity(rows.len());
    for row in rows.into_iter().rev() {
        let (name, at_ms) = of(&row);
        let until_ms = next_ms.insert(name, at_ms).unwrap_or(end_ms);
        if at_ms < until_ms {
            spans.push((row, until_ms));
        }
    }
    spans.into_iter().rev().unzip()
}
