//! Raw scans: kept only when somebody asks for it, for as long as they say, and said while there are any.
//!
//! ```text
//!   kehai-tracker module raw hall --db door.db ─▶ raw_request (module, until_ms) ─ 1:n ─▶ raw (a scan each)
//!   a tracker with that database ─▶ deletes what has expired, says what has not: an alarm "raw-scans"
//!   every command that opens it  ─▶ deletes what has expired
//! ```
//!
//! They show more of people than anything else that is kept, so nothing else ever writes them.

use std::path::Path as File;

use rusqlite::{Connection, OpenFlags, params};

use super::StoreError;
use super::writer::{Writer, integer};

/// Scans of a request deleted in one go.
const DELETE_AT_ONCE: u32 = 500;

/// An hour, ms.
const HOUR_MS: u64 = 3_600_000;

/// A request that is being fulfilled.
#[derive(Debug)]
pub struct RawKeeper {
    file: std::path::PathBuf,
    connection: Connection,
    request: i64,
    waiting: Vec<(u64, String)>,
    last_ms: u64,
}

/// Raw scans that are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawKept {
    /// Whose.
    pub module: String,
    /// Until when, ms since 1970.
    pub until_ms: u64,
    /// How many.
    pub scans: u64,
}

impl RawKeeper {
    /// Begins to keep `module`'s scans in `database`, made if missing, from `now_ms` until `until_ms`; what has
    /// expired is deleted.
    ///
    /// # Errors
    /// The database cannot be opened or written.
    pub fn begin(database: &File, module: &str, now_ms: u64, until_ms: u64) -> Result<Self, StoreError> {
        let file = database.to_path_buf();
        let connection = Writer::connect(database, now_ms)?;
        let begun = || -> rusqlite::Result<i64> {
            connection.execute(
                "INSERT INTO raw_request (module, begun_ms, until_ms) VALUES (?1, ?2, ?3)",
                params![module, integer(now_ms), integer(until_ms)],
            )?;
            let request = connection.last_insert_rowid();
            let text = format!("raw scans are kept for {}", time(until_ms.saturating_sub(now_ms)));
            connection.execute(
                "INSERT INTO event (at_ms, kind, subject, text) VALUES (?1, 'raw', ?2, ?3)",
                params![integer(now_ms), module, text],
            )?;
            Ok(request)
        };
        match begun() {
            Ok(request) => Ok(Self { file, connection, request, waiting: Vec::new(), last_ms: 0 }),
            Err(error) => Err(StoreError::Sqlite { file, error }),
        }
    }

    /// Keeps a scan: written with the others of its second.
    ///
    /// # Errors
    /// The database cannot be written.
    pub fn scan(&mut self, at_ms: u64, json: String) -> Result<(), StoreError> {
        // Two that arrive together are two.
        self.last_ms = at_ms.max(self.last_ms + 1);
        self.waiting.push((self.last_ms, json));
        let first_ms = self.waiting.first().map_or(at_ms, |(at_ms, _)| *at_ms);
        if at_ms.saturating_sub(first_ms) >= 1000 { self.flush() } else { Ok(()) }
    }

    /// Writes what waits.
    ///
    /// # Errors
    /// The database cannot be written.
    pub fn flush(&mut self) -> Result<(), StoreError> {
        let request = self.request;
        let mut write = || -> rusqlite::Result<()> {
            let transaction = self.connection.transaction()?;
            for (at_ms, json) in &self.waiting {
                transaction
                    .prepare_cached("INSERT OR REPLACE INTO raw (request, at_ms, scan) VALUES (?1, ?2, ?3)")?
                    .execute(params![request, integer(*at_ms), json])?;
            }
            transaction.commit()
        };
        write().map_err(|error| StoreError::Sqlite { file: self.file.clone(), error })?;
        self.waiting.clear();
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
    if any { Writer::connect(database, now_ms).map(drop) } else { Ok(()) }
}

/// Deletes some of what has expired; true if there may be more.
pub(super) fn forget(connection: &Connection, now_ms: u64) -> rusqlite::Result<bool> {
    let expired = "SELECT request FROM raw_request WHERE until_ms <= ?1";
    let deleted = connection
        .prepare_cached(&format!(
            "DELETE FROM raw WHERE (request, at_ms) IN
             (SELECT request, at_ms FROM raw WHERE request IN ({expired}) LIMIT {DELETE_AT_ONCE})"
        ))?
        .execute(params![integer(now_ms)])?;
    if deleted > 0 {
        return Ok(true);
    }
    connection
        .prepare_cached("DELETE FROM raw_request WHERE until_ms <= ?1")?
        .execute(params![integer(now_ms)])?;
    Ok(false)
}

/// What is kept at `now_ms`, of each request.
pub(super) fn kept(connection: &Connection, now_ms: u64) -> rusqlite::Result<Vec<RawKept>> {
    connection
        .prepare_cached(
            "SELECT module, until_ms, (SELECT COUNT(*) FROM raw WHERE raw.request = raw_request.request)
             FROM raw_request WHERE until_ms > ?1 ORDER BY until_ms",
        )?
        .query_map(params![integer(now_ms)], |row| {
            Ok(RawKept {
                module: row.get(0)?,
                until_ms: row.get::<_, i64>(1)?.unsigned_abs(),
                scans: row.get::<_, i64>(2)?.unsigned_abs(),
            })
        })?
        .collect()
}

/// That in words; empty if there is nothing.
#[must_use]
pub fn in_words(kept: &[RawKept], now_ms: u64) -> String {
    let one = |kept: &RawKept| {
        let left = time(kept.until_ms.saturating_sub(now_ms));
        format!("{} raw scans of {} are kept for another {left}", kept.scans, kept.module)
    };
    kept.iter().map(one).collect::<Vec<_>>().join("; ")
}

fn time(ms: u64) -> String {
    match ms {
        0..HOUR_MS => format!("{} min", ms.div_ceil(60_000)),
        _ => format!("{} h", ms.div_ceil(HOUR_MS)),
    }
}
