//! What happened: questions to the file, each answered by way of an index.
//!
//! ```text
//!   between a and b ─▶ paths that touch it · counts, with the one before a · events · health
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::Path as File;

use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use rusqlite::Error::FromSqlConversionFailure;
use rusqlite::types::Type;
use rusqlite::{Connection, OpenFlags, Row, params};
use serde::de::DeserializeOwned;
use serde::de::value::{Error as ValueError, StrDeserializer};

use super::alarm_rows;
use super::answers::{CardSeen, Count, CrossedAt, LineSeen, Posed, TotalOf, Walked, Was};
use super::error::StoreError;
use super::event::{Event, EventKind};
use super::lives::told_within;
use super::lock::beside;
use super::numbers::integer;
use super::path::{Place, decode};
use super::questions::{
    CARDS, COUNTS, COUNTS_BEFORE, CROSSINGS, EVENTS, HEALTH, LINE_STATES, LINE_STATES_BEFORE, LIVES,
    PASSAGES, PATHS, POINTS, TOTALS, WATCHED,
};
use super::raw_rows::{self, RawKept};
use super::recorder::HEALTH_MS;
use super::schema::{self, Unfit};
use super::walks::PART_MS;
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::door::Card;
use kehai_tracking::door::doors::Passed;
use kehai_tracking::lines::Totals;
use kehai_tracking::snapshot::{DeviceState, STALE_MS, Snapshot};

/// A read-only connection. It never waits for the writer.
#[derive(Debug)]
pub struct Reader(Connection);

impl Reader {
    /// Opens the file for reading.
    ///
    /// # Errors
    /// It is not there, or no database.
    pub fn open(file: &File) -> Result<Self, StoreError> {
        let failed = |error| StoreError::Sqlite { file: file.to_path_buf(), error };
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        // What the system says of a file that is not there, SQLite does not pass on. Asked without opening it: to close it would
        // end the locks of this process's own writer.
        let missing = |error| match fs::metadata(file) {
            Err(error) => StoreError::File { file: file.to_path_buf(), error },
            Ok(_) => failed(error),
        };
        Ok(Self(Connection::open_with_flags(file, flags).map_err(missing)?))
    }

    /// Opens the file for a command that reads what a tracker has kept there.
    ///
    /// # Errors
    /// As [`open`](Self::open); there is nothing in it, or it is of another program, of a newer version, or of one so old that
    /// tables are missing.
    pub fn open_kept(file: &File) -> Result<Self, StoreError> {
        let reader = Self::open(file)?;
        let layout = schema::layout(&reader.0)
            .map_err(|error| StoreError::Sqlite { file: file.to_path_buf(), error })?
            .and_then(|layout| match layout {
                0 => Err(Unfit::Empty),
                // Read-only, it gets no tables that it lacks.
                older if older < schema::READABLE => Err(Unfit::Older(older)),
                layout => Ok(layout),
            });
        layout.map_err(|error| StoreError::Unfit { file: file.to_path_buf(), error })?;
        Ok(reader)
    }

    /// Opens the file for a look that leaves nothing beside it, not even while no tracker has it open: a reader of a write-ahead log
    /// makes one, which would belong to the user who looks.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn look(file: &File) -> Result<Self, StoreError> {
        if beside(file, "-wal").exists() {
            return Self::open(file);
        }
        let failed = |error| StoreError::Sqlite { file: file.to_path_buf(), error };
        let path: String = utf8_percent_encode(&file.to_string_lossy(), NON_ALPHANUMERIC).collect();
        let flags =
            OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
        let connection = Connection::open_with_flags(format!("file:{path}?immutable=1"), flags);
        Ok(Self(connection.map_err(failed)?))
    }

    /// The number of the file's layout, 0 of an empty one; or why it is none of this version.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn layout(&self) -> rusqlite::Result<Result<i64, Unfit>> {
        schema::layout(&self.0)
    }

    /// Paths that touch the time from `from_ms` to `to_ms`, the parts of each joined.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn paths(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<Walked>> {
        let mut statement = self.0.prepare_cached(PATHS)?;
        let earliest_ms = from_ms.saturating_sub(PART_MS);
        let mut rows = statement.query(params![integer(earliest_ms), integer(to_ms), integer(from_ms)])?;
        let mut paths: Vec<Walked> = Vec::new();
        while let Some(row) = rows.next()? {
            let (run, track, points): (i64, i64, Vec<u8>) = (row.get(0)?, row.get(1)?, row.get(2)?);
            let track = track.unsigned_abs();
            match paths.last_mut().filter(|last| (last.run, last.track) == (run, track)) {
                Some(last) => last.places.extend(decode(&points)),
                None => paths.push(Walked { run, track, places: decode(&points) }),
            }
        }
        Ok(paths)
    }

    /// Calls `each` with the places of every part of a path that touches the time from `from_ms` to `to_ms`, one after the other.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn each_path(
        &self,
        from_ms: u64,
        to_ms: u64,
        mut each: impl FnMut(&[Place]),
    ) -> rusqlite::Result<()> {
        let mut statement = self.0.prepare_cached(POINTS)?;
        let earliest_ms = from_ms.saturating_sub(PART_MS);
        let mut rows = statement.query(params![integer(earliest_ms), integer(to_ms), integer(from_ms)])?;
        while let Some(row) = rows.next()? {
            each(&decode(row.get_ref(0)?.as_blob()?));
        }
        Ok(())
    }

    /// For about how long each module was watching from `from_ms` to `to_ms`, s: to the minute.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn watched(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<BTreeMap<String, u64>> {
        let mut asked = self.0.prepare_cached(WATCHED)?;
        let watching = DeviceState::Watching.name();
        let watched = |row: &Row<'_>| Ok((row.get(0)?, time(row, 1)? * HEALTH_MS / 1000));
        asked.query_map(params![integer(from_ms), integer(to_ms), watching], watched)?.collect()
    }

    /// Counts from `from_ms` to `to_ms`, and the last of each zone before that.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn counts(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<Count>> {
        let count = |row: &Row<'_>| {
            Ok(Count { zone: row.get(0)?, at_ms: time(row, 1)?, count: row.get(2)?, state: named(row, 3)? })
        };
        let mut before = self.0.prepare_cached(COUNTS_BEFORE)?;
        let mut during = self.0.prepare_cached(COUNTS)?;
        before
            .query_map(params![integer(from_ms)], count)?
            .chain(during.query_map(params![integer(from_ms), integer(to_ms)], count)?)
            .collect()
    }

    /// Of which zones the total was made, of all time: a row for each change of the site that changed it.
    ///
    /// # Errors
    /// What SQLite says; also of a file of a version without them.
    pub fn totals(&self) -> rusqlite::Result<Vec<TotalOf>> {
        let total = |row: &Row<'_>| {
            let zones: String = row.get(1)?;
            let zones = serde_json::from_str(&zones)
                .map_err(|error| FromSqlConversionFailure(1, Type::Text, Box::new(error)))?;
            Ok(TotalOf { at_ms: time(row, 0)?, zones })
        };
        self.0.prepare_cached(TOTALS)?.query_map([], total)?.collect()
    }

    /// Crossings of lines from `from_ms` to `to_ms`.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn crossings(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<CrossedAt>> {
        let crossing = |row: &Row<'_>| {
            Ok(CrossedAt { line: row.get(0)?, at_ms: time(row, 1)?, direction: named(row, 2)? })
        };
        let mut asked = self.0.prepare_cached(CROSSINGS)?;
        asked.query_map(params![integer(from_ms), integer(to_ms)], crossing)?.collect()
    }

    /// Whether lines were seen from `from_ms` to `to_ms`, and the last of each line before that.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn line_states(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<LineSeen>> {
        let seen =
            |row: &Row<'_>| Ok(LineSeen { line: row.get(0)?, at_ms: time(row, 1)?, state: named(row, 2)? });
        let mut before = self.0.prepare_cached(LINE_STATES_BEFORE)?;
        let mut during = self.0.prepare_cached(LINE_STATES)?;
        before
            .query_map(params![integer(from_ms)], seen)?
            .chain(during.query_map(params![integer(from_ms), integer(to_ms)], seen)?)
            .collect()
    }

    /// How often each line has been crossed, of all time, by its name.
    ///
    /// # Errors
    /// What SQLite says; also of a file of a version without lines.
    pub fn line_totals(&self) -> rusqlite::Result<BTreeMap<String, Totals>> {
        let mut asked = self.0.prepare("SELECT name, inward, outward FROM line")?;
        let total =
            |row: &Row<'_>| Ok((row.get(0)?, Totals { inward: time(row, 1)?, outward: time(row, 2)? }));
        asked.query_map([], total)?.collect()
    }

    /// Events from `from_ms` to `to_ms`.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn events(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<Event>> {
        let event = |row: &Row<'_>| {
            let track: Option<i64> = row.get(3)?;
            let kind = EventKind::named(&row.get::<_, String>(1)?);
            let event =
                Event::stored(time(row, 0)?, kind, row.get::<_, String>(2)?, row.get::<_, String>(4)?);
            Ok(event.of(track.map(i64::unsigned_abs)))
        };
        self.0.prepare_cached(EVENTS)?.query_map(params![integer(from_ms), integer(to_ms)], event)?.collect()
    }

    /// Passages through doors that began from `from_ms` to `to_ms`, with their cards as long as those are kept. A record
    /// that cannot be understood is left out.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn passages(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<Passed>> {
        let mut statement = self.0.prepare_cached(PASSAGES)?;
        let both = |row: &Row<'_>| Ok((row.get(0)?, row.get(1)?));
        let records = statement.query_map(params![integer(from_ms), integer(to_ms)], both)?;
        let records: Vec<(String, Option<[u8; 16]>)> = records.collect::<rusqlite::Result<_>>()?;
        let passed = |(text, hash): &(String, Option<[u8; 16]>)| {
            let mut passed: Passed = serde_json::from_str(text).ok()?;
            passed.passage.card = hash.map(|bytes| Card(u128::from_be_bytes(bytes)));
            Some(passed)
        };
        Ok(records.iter().filter_map(passed).collect())
    }

    /// From when to when trackers ran, as far as that touches the time from `from_ms` to `to_ms`; without times of which two runs
    /// tell, as the clock was set back: nothing is known of those.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn lives(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<(u64, u64)>> {
        Ok(told_within(&self.runs()?, (from_ms, to_ms)))
    }

    /// From when to when each tracker ran, ms since 1970, also of times that two tell of.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn runs(&self) -> rusqlite::Result<Vec<(u64, u64)>> {
        let mut asked = self.0.prepare_cached(LIVES)?;
        asked.query_map([], |row| Ok((time(row, 0)?, time(row, 1)?)))?.collect()
    }

    /// The end of a time that is asked for: where a tracker that runs has written to, if that is only a moment before `to_ms`. What
    /// it has not written yet is not unknown, and not 0.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn until_ms(&self, to_ms: u64) -> rusqlite::Result<u64> {
        let written_ms = self.span_ms()?.map(|(_, last_ms)| last_ms);
        let moment = to_ms.saturating_sub(STALE_MS)..to_ms;
        Ok(written_ms.filter(|written_ms| moment.contains(written_ms)).unwrap_or(to_ms))
    }

    /// Where modules were, every change of it.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn poses(&self) -> rusqlite::Result<Vec<Posed>> {
        let pose = |row: &Row<'_>| {
            Ok(Posed {
                at_ms: time(row, 0)?,
                module: row.get(1)?,
                x_m: row.get(2)?,
                y_m: row.get(3)?,
                yaw_deg: row.get(4)?,
                source: named(row, 5)?,
            })
        };
        let asked = "SELECT at_ms, module, x_m, y_m, yaw_deg, source FROM pose ORDER BY at_ms, module";
        self.0.prepare_cached(asked)?.query_map([], pose)?.collect()
    }

    /// How modules were from `from_ms` to `to_ms`.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn health(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<Was>> {
        let was = |row: &Row<'_>| {
            Ok(Was {
                at_ms: time(row, 0)?,
                module: row.get(1)?,
                state: named(row, 2)?,
                scans_hz: row.get(3)?,
                lost_share: row.get(4)?,
                checksum_errors: time(row, 5)?,
                unknown_share: row.get(6)?,
                clock_offset_ms: row.get(7)?,
                clock_jitter_ms: row.get(8)?,
            })
        };
        self.0.prepare_cached(HEALTH)?.query_map(params![integer(from_ms), integer(to_ms)], was)?.collect()
    }

    /// Cards held to readers from `from_ms` to `to_ms`.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn cards(&self, from_ms: u64, to_ms: u64) -> rusqlite::Result<Vec<CardSeen>> {
        let card =
            |row: &Row<'_>| Ok(CardSeen { at_ms: time(row, 0)?, place: row.get(1)?, hash: row.get(2)? });
        self.0.prepare_cached(CARDS)?.query_map(params![integer(from_ms), integer(to_ms)], card)?.collect()
    }

    /// Raw scans that are kept at `now_ms`, by request.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn raw(&self, now_ms: u64) -> rusqlite::Result<Vec<RawKept>> {
        raw_rows::kept(&self.0, now_ms)
    }

    /// What SQLite finds wrong with the file as a whole; `ok` if nothing is. Reads all of it.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn check(&self) -> rusqlite::Result<String> {
        self.0.query_row("PRAGMA integrity_check", [], |row| row.get(0))
    }

    /// The first and the last time there is something of, ms since 1970.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn span_ms(&self) -> rusqlite::Result<Option<(u64, u64)>> {
        let asked = "SELECT (SELECT MIN(begun_ms) FROM run), (SELECT at_ms FROM snapshot)";
        self.0.query_row(asked, [], |row| {
            let (first, last): (Option<i64>, Option<i64>) = (row.get(0)?, row.get(1)?);
            Ok(first.zip(last).map(|(first, last)| (first.unsigned_abs(), last.unsigned_abs())))
        })
    }

    /// Alarms that stood when the file was written last, and those that ended at `from_ms` or later.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn alarms(&self, from_ms: u64) -> rusqlite::Result<Vec<ListedAlarm>> {
        alarm_rows::read(&self.0, from_ms)
    }

    /// What was known last.
    ///
    /// # Errors
    /// What SQLite says. A frame that cannot be understood counts as none.
    pub fn snapshot(&self) -> rusqlite::Result<Option<Snapshot>> {
        let mut statement = self.0.prepare_cached("SELECT frame FROM snapshot")?;
        let mut rows = statement.query([])?;
        let Some(row) = rows.next()? else { return Ok(None) };
        let text: String = row.get(0)?;
        Ok(serde_json::from_str(&text).ok())
    }

    /// How SQLite finds the answers of each question, in its own words: for tests.
    ///
    /// # Errors
    /// What SQLite says.
    pub fn plans(&self) -> rusqlite::Result<Vec<String>> {
        let mut plans = Vec::new();
        for asked in [
            PATHS,
            POINTS,
            WATCHED,
            COUNTS,
            COUNTS_BEFORE,
            CROSSINGS,
            LINE_STATES,
            LINE_STATES_BEFORE,
            EVENTS,
            HEALTH,
            PASSAGES,
            CARDS,
            alarm_rows::ASKED,
        ] {
            let mut statement = self.0.prepare(&format!("EXPLAIN QUERY PLAN {asked}"))?;
            let blanks = vec![0_i64; statement.parameter_count()];
            let lines = statement.query_map(rusqlite::params_from_iter(blanks), |row| row.get(3))?;
            plans.push(lines.collect::<rusqlite::Result<Vec<String>>>()?.join("\n"));
        }
        Ok(plans)
    }
}

fn time(row: &Row<'_>, column: usize) -> rusqlite::Result<u64> {
    row.get::<_, i64>(column).map(i64::unsigned_abs)
}

/// What a name stands for, as it is written in JSON, too.
fn named<T: DeserializeOwned>(row: &Row<'_>, column: usize) -> rusqlite::Result<T> {
    let name: String = row.get(column)?;
    let text = StrDeserializer::<ValueError>::new(&name);
    T::deserialize(text).map_err(|error| FromSqlConversionFailure(column, Type::Text, Box::new(error)))
}
