//! Raw scans: kept only when a user asks for it, for as long as the user says, and said while there are any.
//!
//! ```text
//!   kehai-tracker module raw hall --db door.db ─▶ raw_request (module, until_ms) ─ 1:n ─▶ raw (a scan each)
//!   a tracker with that database ─▶ deletes what has expired, says what has not: an alarm "raw-scans"
//!   every command that opens it  ─▶ deletes what has expired
//! ```
//!
//! They show more of people than anything else that is kept, so nothing else ever writes them.

use std::path::Path as File;
use std::time::{Duration, Instant};

use rusqlite::{Connection, OpenFlags, params};

use super::connection::open_and_expire;
use super::error::StoreError;
use super::event::EventKind;
use super::numbers::integer;
use super::raw_rows::time;
pub use super::raw_rows::{RawKept, in_words};
use super::{raw_rows, schema};

/// Scans of so long are written together.
const TOGETHER: Duration = Duration::from_secs(1);

/// A request that is being fulfilled.
#[derive(Debug)]
pub struct RawScanWriter {
    file: std::path::PathBuf,
    connection: Connection,
    request: i64,
    until_ms: u64,
    waiting: Vec<(u64, String)>,
    /// When the first of those came, by a clock that is never set back.
    since: Option<Instant>,
    last_ms: u64,
}

impl RawScanWriter {
    /// Begins to keep `module`'s scans in `database`, made if missing, from `now_ms` until `until_ms`; what has
    /// expired is deleted.
    ///
    /// # Errors
    /// The database cannot be opened or written.
    pub fn begin(database: &File, module: &str, now_ms: u64, until_ms: u64) -> Result<Self, StoreError> {
        let file = database.to_path_buf();
        let connection = open_and_expire(database, now_ms)?;
        let begun = || -> rusqlite::Result<i64> {
            connection.execute(
                "INSERT INTO raw_request (module, begun_ms, until_ms) VALUES (?1, ?2, ?3)",
                params![module, integer(now_ms), integer(until_ms)],
            )?;
            let request = connection.last_insert_rowid();
            let text = format!("raw scans are kept for {}", time(until_ms.saturating_sub(now_ms)));
            connection.execute(
                "INSERT INTO event (at_ms, kind, subject, text) VALUES (?1, ?2, ?3, ?4)",
                params![integer(now_ms), EventKind::Raw.name(), module, text],
            )?;
            Ok(request)
        };
        match begun() {
            Ok(request) => {
                let waiting = Vec::new();
                Ok(Self { file, connection, request, until_ms, waiting, since: None, last_ms: 0 })
            }
            Err(error) => Err(StoreError::Sqlite { file, error }),
        }
    }

    /// Keeps a scan of `at_ms`, since 1970: written with the others of its second.
    ///
    /// # Errors
    /// The database cannot be written.
    pub fn scan(&mut self, at_ms: u64, json: String) -> Result<(), StoreError> {
        self.scan_at(Instant::now(), at_ms, json)
    }

    fn scan_at(&mut self, now: Instant, at_ms: u64, json: String) -> Result<(), StoreError> {
        // Two that arrive together are two.
        self.last_ms = at_ms.max(self.last_ms + 1);
        self.waiting.push((self.last_ms, json));
        let since = *self.since.get_or_insert(now);
        if now.duration_since(since) >= TOGETHER { self.flush() } else { Ok(()) }
    }

    /// Writes what waits. Once the request is over, and deleted by the tracker, nothing more is kept: it would have no end. Its number
    /// may be that of another request by then.
    ///
    /// # Errors
    /// The database cannot be written.
    pub fn flush(&mut self) -> Result<(), StoreError> {
        let (request, until_ms) = (self.request, integer(self.until_ms));
        let mut write = || -> rusqlite::Result<()> {
            let transaction = self.connection.transaction()?;
            for (at_ms, json) in &self.waiting {
                transaction
                    .prepare_cached(
                        "INSERT OR REPLACE INTO raw (request, at_ms, scan) SELECT ?1, ?2, ?3
                         WHERE EXISTS (SELECT 1 FROM raw_request WHERE request = ?1 AND until_ms = ?4)",
                    )?
                    .execute(params![request, integer(*at_ms), json, until_ms])?;
            }
            transaction.commit()
        };
        write().map_err(|error| StoreError::Sqlite { file: self.file.clone(), error })?;
        self.waiting.clear();
        self.since = None;
        Ok(())
    }
}

/// Deletes all that has expired in `database` by `now_ms`: for commands that would only read it. One that has nothing of
/// that kind is not touched.
///
/// # Errors
/// It cannot be read, or there is something and it cannot be written.
pub fn forget_expired(database: &File, now_ms: u64) -> Result<(), StoreError> {
    let file = database.to_path_buf();
    let asked = "SELECT EXISTS (SELECT 1 FROM raw_request WHERE until_ms <= ?1)";
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let reader = Connection::open_with_flags(database, flags)
        .map_err(|error| StoreError::Sqlite { file: file.clone(), error })?;
    // A database of before there were raw scans has none.
    let any = reader.query_row(asked, params![integer(now_ms)], |row| row.get(0)).unwrap_or(false);
    if any { expire(database, now_ms) } else { Ok(()) }
}

/// Deletes what has expired; the layout stays, which an older tracker may be using.
fn expire(database: &File, now_ms: u64) -> Result<(), StoreError> {
    let failed = |error| StoreError::Sqlite { file: database.to_path_buf(), error };
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(database, flags).map_err(failed)?;
    connection.pragma_update(None, "busy_timeout", 2000).map_err(failed)?;
    schema::layout(&connection)
        .map_err(failed)?
        .map_err(|error| StoreError::Unfit { file: database.to_path_buf(), error })?;
    connection.pragma_update(None, "secure_delete", "ON").map_err(failed)?;
    raw_rows::forget_all(&connection, now_ms).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR_MS: u64 = 3_600_000;

    /// Whether a file holds the scan of [`written`].
    fn holds(file: &File) -> bool {
        let bytes = std::fs::read(file).unwrap();
        bytes.windows(8).any(|window| window == b"a person")
    }

    /// A request of one hour with a scan, whose database stays open; the database, and the log beside it.
    fn written(folder: &File) -> (RawScanWriter, [std::path::PathBuf; 2]) {
        let [file, log] = ["kehai.db", "kehai.db-wal"].map(|name| folder.join(name));
        let mut raw = RawScanWriter::begin(&file, "hall", HOUR_MS, 2 * HOUR_MS).unwrap();
        raw.scan(HOUR_MS, "{\"a person\": 7}".to_owned()).unwrap();
        raw.flush().unwrap();
        (raw, [file, log])
    }

    #[test]
    fn scans_are_written_each_second_though_the_clock_is_set_back() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let (now, hour_ms) = (Instant::now(), 3_600_000);
        let mut raw = RawScanWriter::begin(&file, "hall", hour_ms, 3 * hour_ms).unwrap();
        let mut scan = |after: Duration, at_ms| raw.scan_at(now + after, at_ms, "{}".to_owned()).unwrap();
        let written = || {
            let reader = Connection::open(&file).unwrap();
            reader.query_row("SELECT COUNT(*) FROM raw", [], |row| row.get::<_, i64>(0)).unwrap()
        };
        scan(Duration::ZERO, 2 * hour_ms);
        scan(TOGETHER / 2, hour_ms);
        assert_eq!(written(), 0);
        scan(TOGETHER, hour_ms + 500);
        assert_eq!(written(), 3);
    }

    #[test]
    fn a_scan_that_comes_after_its_request_was_deleted_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let hour_ms = 3_600_000;
        let mut raw = RawScanWriter::begin(&file, "hall", hour_ms, 2 * hour_ms).unwrap();
        let mut scan = |at_ms| {
            raw.scan(at_ms, "{}".to_owned()).unwrap();
            raw.flush().unwrap();
            let reader = Connection::open(&file).unwrap();
            reader.query_row("SELECT COUNT(*) FROM raw", [], |row| row.get::<_, i64>(0)).unwrap()
        };
        assert_eq!(scan(hour_ms), 1);
        forget_expired(&file, 2 * hour_ms).unwrap();
        assert_eq!(scan(2 * hour_ms), 0);
        let other = RawScanWriter::begin(&file, "left", 2 * hour_ms, 3 * hour_ms).unwrap();
        assert_eq!(other.request, 1, "its number");
        assert_eq!(scan(2 * hour_ms + 1), 0);
    }

    #[test]
    fn what_has_expired_is_not_in_the_log_beside_an_open_database() {
        let folder = tempfile::tempdir().unwrap();
        let (_raw, [file, log]) = written(folder.path());
        assert!(holds(&log));
        forget_expired(&file, 2 * HOUR_MS).unwrap();
        assert!(!holds(&log) && !holds(&file));
    }

    #[test]
    fn a_log_that_cannot_be_cut_while_another_program_reads_is_cut_later() {
        let folder = tempfile::tempdir().unwrap();
        let (_raw, [file, log]) = written(folder.path());
        let reader = Connection::open(&file).unwrap();
        reader.execute_batch("BEGIN; SELECT COUNT(*) FROM raw;").unwrap();
        forget_expired(&file, 2 * HOUR_MS).unwrap();
        assert!(holds(&log));
        reader.execute_batch("COMMIT").unwrap();
        forget_expired(&file, 2 * HOUR_MS).unwrap();
        assert!(!holds(&log) && !holds(&file));
    }

    #[test]
    fn what_has_expired_is_deleted_from_a_database_whose_layout_stays() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let mut raw = RawScanWriter::begin(&file, "hall", 1000, 2000).unwrap();
        raw.scan(1500, "{}".to_owned()).unwrap();
        raw.flush().unwrap();
        let older = Connection::open(&file).unwrap();
        older.pragma_update(None, "user_version", schema::VERSION - 1).unwrap();
        forget_expired(&file, 2000).unwrap();
        let version: i64 = older.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap();
        let scans: i64 = older.query_row("SELECT COUNT(*) FROM raw", [], |row| row.get(0)).unwrap();
        assert_eq!((version, scans), (schema::VERSION - 1, 0));
    }
}
