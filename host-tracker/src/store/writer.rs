//! Rows into the file: one transaction a batch, and what is too old out of it.

use std::collections::BTreeMap;
use std::path::Path as File;

use rusqlite::{Connection, Transaction, params};

use super::alarm_rows;
use super::connection;
use super::error::StoreError;
use super::numbers::integer;
use super::pose;
use super::raw_rows::{self, RawKept};
use super::retention::{DAY_MS, Doubt, Keep, may_delete};
use super::row::{PathRow, Row};
use kehai_tracking::snapshot::Snapshot;

/// Most rows of a table deleted in one go, so that no batch waits for them.
const DELETE_AT_ONCE: u32 = 2000;

/// Pages given back to the file system in one go.
const PAGES_AT_ONCE: u32 = 256;

/// The connection that writes.
#[derive(Debug)]
pub struct Writer {
    connection: Connection,
    run: i64,
}

impl Writer {
    /// Opens the file, or makes it, and begins a run at `now_ms`, since 1970; or goes on with `run`, if the file has it.
    ///
    /// # Errors
    /// It cannot be opened or written, is no database, or was made by a newer version.
    pub fn open(file: &File, now_ms: u64, run: Option<i64>) -> Result<Self, StoreError> {
        let failed = |error| StoreError::Sqlite { file: file.to_path_buf(), error };
        let connection = connection::open(file)?;
        if let Some(run) = run {
            let asked = "SELECT EXISTS (SELECT 1 FROM run WHERE run = ?1)";
            if connection.query_row(asked, [run], |row| row.get(0)).map_err(failed)? {
                return Ok(Self { connection, run });
            }
        }
        let mut writer = Self { connection, run: 0 };
        writer.begin_run(now_ms).map_err(failed)?;
        Ok(writer)
    }

    /// Begins another run at `now_ms`, since 1970.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn begin_run(&mut self, now_ms: u64) -> rusqlite::Result<()> {
        let begins = "INSERT INTO run (begun_ms, ended_ms) VALUES (?1, ?1)";
        self.connection.execute(begins, params![integer(now_ms)])?;
        self.run = self.connection.last_insert_rowid();
        Ok(())
    }

    /// Writes all of it, or nothing.
    ///
    /// # Errors
    /// What SQLite says; the file is as before.
    pub fn write(
        &mut self,
        rows: &[Row],
        paths: &BTreeMap<(u64, u32), PathRow>,
        newest: Option<&Snapshot>,
    ) -> rusqlite::Result<()> {
        let run = self.run;
        let transaction = self.connection.transaction()?;
        for (&(track, part), path) in paths {
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO path (run, track, part, begun_ms, ended_ms, points)
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                )?
                .execute(params![
                    run,
                    integer(track),
                    part,
                    integer(path.begun_ms),
                    integer(path.ended_ms),
                    path.points
                ])?;
        }
        for row in rows {
            write_row(&transaction, row, run)?;
        }
        if let Some(frame) = newest {
            let text = serde_json::to_string(frame).unwrap_or_default();
            transaction
                .prepare_cached("INSERT OR REPLACE INTO snapshot (only, at_ms, frame) VALUES (1, ?1, ?2)")?
                .execute(params![integer(frame.unix_ms), text])?;
            let first_ms = paths.values().map(|path| path.begun_ms).min().unwrap_or(frame.unix_ms);
            transaction
                .prepare_cached("UPDATE run SET begun_ms = MIN(begun_ms, ?2), ended_ms = ?3 WHERE run = ?1")?
                .execute(params![run, integer(first_ms), integer(frame.unix_ms)])?;
        }
        transaction.commit()
    }

    /// Whether the clock may be trusted with deleting; if not, why.
    ///
    /// # Errors
    /// What SQLite says.
    pub(super) fn doubt(&self, now_ms: u64, keep: Keep) -> rusqlite::Result<Option<Doubt>> {
        let mut asked = self
            .connection
            .prepare_cached("SELECT begun_ms, COALESCE(ended_ms, begun_ms) FROM run ORDER BY begun_ms")?;
        let time = |ms: i64| u64::try_from(ms).unwrap_or_default();
        let runs: Vec<(u64, u64)> = asked
            .query_map([], |row| Ok((time(row.get(0)?), time(row.get(1)?))))?
            .collect::<rusqlite::Result<_>>()?;
        Ok(may_delete(runs.into_iter(), now_ms, keep).err())
    }

    /// Deletes some of what is older than it is to be kept; true if there may be more. Raw scans end when a user said,
    /// whatever the clock.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn forget(&mut self, now_ms: u64, keep: Keep) -> rusqlite::Result<bool> {
        let mut more = raw_rows::forget(&self.connection, now_ms)?;
        if self.doubt(now_ms, keep)?.is_some() {
            return Ok(more);
        }
        let (count, line) = (still_holds("count", "zone"), still_holds("line_state", "line"));
        let (count, line, none) = (count.as_str(), line.as_str(), "FALSE");
        for (table, column, key, days, kept) in [
            ("path", "begun_ms", "run, track, part", keep.days, none),
            ("count", "at_ms", "zone, at_ms", keep.days, count),
            ("crossing", "at_ms", "crossing", keep.days, none),
            ("line_state", "at_ms", "line, at_ms", keep.days, line),
            ("event", "at_ms", "event", keep.days, none),
            ("passage", "begun_ms", "passage", keep.days, none),
            ("alarm", "until_ms", "alarm", keep.days, none),
            ("health", "at_ms", "module, at_ms", keep.days, none),
            ("run", "COALESCE(ended_ms, begun_ms)", "run", keep.days, none),
            ("card", "at_ms", "card", keep.card_days, none),
            ("name", "at_ms", "name", keep.card_days, none),
        ] {
            let before_ms = integer(now_ms.saturating_sub(u64::from(days) * DAY_MS));
            let statement = format!(
                "DELETE FROM {table} WHERE ({key}) IN
                 (SELECT {key} FROM {table} WHERE {column} < ?1 AND NOT ({kept}) LIMIT {DELETE_AT_ONCE})"
            );
            let deleted = self.connection.prepare_cached(&statement)?.execute(params![before_ms])?;
            more |= deleted == DELETE_AT_ONCE as usize;
        }
        self.give_back()?;
        Ok(more)
    }

    /// Gives free pages at the end of the file back to the file system, as many as in one go.
    fn give_back(&self) -> rusqlite::Result<()> {
        let statement = format!("PRAGMA incremental_vacuum({PAGES_AT_ONCE})");
        let mut asked = self.connection.prepare_cached(&statement)?;
        let mut pages = asked.query([])?;
        // Each step gives one back.
        while pages.next()?.is_some() {}
        Ok(())
    }

    /// The number of the run.
    #[must_use]
    pub const fn run(&self) -> i64 {
        self.run
    }

    /// Raw scans that a user asked to be kept.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn raw(&self, now_ms: u64) -> rusqlite::Result<Vec<RawKept>> {
        raw_rows::kept(&self.connection, now_ms)
    }
}

fn write_row(transaction: &Transaction<'_>, row: &Row, run: i64) -> rusqlite::Result<()> {
    match row {
        Row::Count { zone, at_ms, count, state } => {
            named(transaction, "zone", zone)?;
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO count (zone, at_ms, count, state)
                     VALUES ((SELECT zone FROM zone WHERE name = ?1), ?2, ?3, ?4)",
                )?
                .execute(params![zone, integer(*at_ms), count, state.name()])?;
        }
        Row::Total { at_ms, zones } => {
            // Each run says it, though it be as before: the clock may be set back later, and another run say otherwise in between.
            transaction
                .prepare_cached("INSERT OR REPLACE INTO total (at_ms, zones) VALUES (?1, ?2)")?
                .execute(params![integer(*at_ms), serde_json::to_string(zones).unwrap_or_default()])?;
        }
        Row::Crossing { line, at_ms, direction } => {
            named(transaction, "line", line)?;
            transaction
                .prepare_cached(
                    "INSERT INTO crossing (line, at_ms, direction)
                     VALUES ((SELECT line FROM line WHERE name = ?1), ?2, ?3)",
                )?
                .execute(params![line, integer(*at_ms), direction.name()])?;
        }
        Row::Line { name, at_ms, totals, state } => {
            named(transaction, "line", name)?;
            transaction
                .prepare_cached("UPDATE line SET inward = ?2, outward = ?3 WHERE name = ?1")?
                .execute(params![name, integer(totals.inward), integer(totals.outward)])?;
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO line_state (line, at_ms, state)
                     VALUES ((SELECT line FROM line WHERE name = ?1), ?2, ?3)",
                )?
                .execute(params![name, integer(*at_ms), state.name()])?;
        }
        Row::Event(event) => {
            transaction
                .prepare_cached(
                    "INSERT INTO event (at_ms, kind, subject, track, text) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![
                    integer(event.at_ms),
                    event.kind.name(),
                    event.subject,
                    event.track.map(integer),
                    event.text
                ])?;
        }
        Row::Passage(passed) => {
            let passage = &passed.passage;
            transaction
                .prepare_cached(
                    "INSERT INTO passage (door, begun_ms, ended_ms, outcome, alarm, record)
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                )?
                .execute(params![
                    passage.door,
                    integer(passed.begun_ms),
                    integer(passed.ended_ms),
                    passage.outcome.to_string(),
                    passage.alarm.map(|alarm| alarm.to_string()),
                    serde_json::to_string(passed).unwrap_or_default()
                ])?;
        }
        Row::Alarm(alarm) => alarm_rows::write(transaction, alarm)?,
        Row::Pose(row) => {
            pose::write(transaction, row)?;
        }
        Row::Card { at_ms, place, hash } => {
            transaction
                .prepare_cached("INSERT INTO card (at_ms, place, hash) VALUES (?1, ?2, ?3)")?
                .execute(params![integer(*at_ms), place, hash.bytes()])?;
        }
        Row::Name { at_ms, track, hash, probability } => {
            transaction
                .prepare_cached(
                    "INSERT INTO name (at_ms, run, track, hash, probability) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![integer(*at_ms), run, integer(*track), hash.bytes(), probability])?;
        }
        Row::Health { at_ms, module } => {
            named(transaction, "module", &module.name)?;
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO health
                     VALUES ((SELECT module FROM module WHERE name = ?1), ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
                )?
                .execute(params![
                    module.name,
                    integer(*at_ms),
                    module.state.name(),
                    module.scans_hz,
                    module.lost_share,
                    integer(module.checksum_errors),
                    module.unknown_share,
                    module.clock_offset_ms,
                    module.clock_jitter_ms
                ])?;
        }
    }
    Ok(())
}

/// Whether a row of `table` still holds at ?1: it is the last of its `subject` by then, and the run that told it went on. A change
/// alone is a row, so a home that has been empty for longer than rows are kept has no newer one.
fn still_holds(table: &str, subject: &str) -> String {
    format!(
        "at_ms = (SELECT MAX(at_ms) FROM {table} AS newest
             WHERE newest.{subject} = {table}.{subject} AND newest.at_ms <= ?1)
         AND EXISTS (SELECT 1 FROM run
             WHERE begun_ms <= {table}.at_ms AND COALESCE(ended_ms, begun_ms) >= ?1)"
    )
}

/// Gives a name its number.
fn named(transaction: &Transaction<'_>, table: &str, name: &str) -> rusqlite::Result<usize> {
    transaction
        .prepare_cached(&format!("INSERT OR IGNORE INTO {table} (name) VALUES (?1)"))?
        .execute(params![name])
}

#[cfg(test)]
mod tests {
    use super::super::event::{Event, EventKind};
    use super::super::reader::Reader;
    use super::*;
    use kehai_tracking::lines::Totals;
    use kehai_tracking::occupancy::ZoneKnown;

    #[test]
    fn the_pages_of_what_is_deleted_are_given_back_to_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let begun_ms = 2000 * DAY_MS;
        let mut writer = Writer::open(&file, begun_ms, None).unwrap();
        // About a page each.
        let event = || Row::Event(Event::new(begun_ms, EventKind::Raw, "hall", "x".repeat(3800)));
        let rows: Vec<Row> = std::iter::repeat_with(event).take(100).collect();
        writer.write(&rows, &BTreeMap::new(), None).unwrap();
        let pages = |writer: &Writer| {
            writer.connection.pragma_query_value(None, "page_count", |row| row.get::<_, i64>(0))
        };
        let before = pages(&writer).unwrap();
        writer.forget(begun_ms + 31 * DAY_MS, Keep { days: 30, card_days: 30 }).unwrap();
        let after = pages(&writer).unwrap();
        assert!(before - after > 90, "{before} pages, then {after}");
    }

    #[test]
    fn the_row_that_still_holds_is_kept_though_it_is_older_than_rows_are() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let (begun_ms, keep) = (2000 * DAY_MS, Keep { days: 30, card_days: 30 });
        let day = |day: u64| begun_ms + day * DAY_MS;
        let mut writer = Writer::open(&file, begun_ms, None).unwrap();
        let count = |at_ms: u64, count: u32| Row::Count {
            zone: "hall".into(),
            at_ms,
            count: Some(count),
            state: ZoneKnown::Known,
        };
        let totals = Totals { inward: 0, outward: 0 };
        let line = |at_ms: u64| Row::Line { name: "gate".into(), at_ms, totals, state: ZoneKnown::Known };
        // Since the first day the home is empty, and its door seen.
        let rows = [count(day(0), 1), count(day(1), 0), line(day(1))];
        let now_ms = day(100);
        let newest = Snapshot { unix_ms: now_ms, ..Snapshot::default() };
        writer.write(&rows, &BTreeMap::new(), Some(&newest)).unwrap();
        writer.forget(now_ms, keep).unwrap();
        let reader = Reader::open(&file).unwrap();
        let counts = || -> Vec<(u64, Option<u32>)> {
            let counts = reader.counts(day(80), now_ms).unwrap();
            counts.into_iter().map(|row| (row.at_ms, row.count)).collect()
        };
        assert_eq!(counts(), [(day(1), Some(0))], "what was before it is deleted");
        assert_eq!(reader.line_states(day(80), now_ms).unwrap().len(), 1);
        // Another has come since; and what a run told that is over holds no longer.
        writer.write(&[count(day(60), 2)], &BTreeMap::new(), Some(&newest)).unwrap();
        writer.forget(now_ms, keep).unwrap();
        assert_eq!(counts(), [(day(60), Some(2))]);
        writer.begin_run(day(101)).unwrap();
        let newest = Snapshot { unix_ms: day(180), ..Snapshot::default() };
        writer.write(&[], &BTreeMap::new(), Some(&newest)).unwrap();
        writer.forget(day(180), keep).unwrap();
        assert_eq!(counts(), []);
    }
}
