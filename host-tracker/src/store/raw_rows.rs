//! The rows of raw scans: what is kept until when, and its deletion.

use rusqlite::{Connection, params};

use super::numbers::integer;

/// Scans of a request deleted in one go.
const DELETE_AT_ONCE: u32 = 500;

/// An hour, ms.
const HOUR_MS: u64 = 3_600_000;

/// Raw scans that are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawKept {
    /// Name of their module.
    pub module: String,
    /// Until when, ms since 1970.
    pub until_ms: u64,
    /// How many.
    pub scans: u64,
}

/// Deletes all that has expired by `now_ms`.
pub(super) fn forget_all(connection: &Connection, now_ms: u64) -> rusqlite::Result<()> {
    while forget(connection, now_ms)? {}
    Ok(())
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
    let is_over: bool = connection
        .prepare_cached("SELECT EXISTS (SELECT 1 FROM raw_request WHERE until_ms <= ?1)")?
        .query_row(params![integer(now_ms)], |row| row.get(0))?;
    if is_over {
        // The log beside the file holds them still. While another program reads it cannot be cut: the request stays, and it is tried again.
        let is_busy: bool = connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |row| row.get(0))?;
        if !is_busy {
            connection
                .prepare_cached("DELETE FROM raw_request WHERE until_ms <= ?1")?
                .execute(params![integer(now_ms)])?;
        }
    }
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

/// That in words; none if there is nothing.
#[must_use]
pub fn in_words(kept: &[RawKept], now_ms: u64) -> Option<String> {
    let one = |kept: &RawKept| {
        let left = time(kept.until_ms.saturating_sub(now_ms));
        format!("{} raw scans of {} are kept for another {left}", kept.scans, kept.module)
    };
    (!kept.is_empty()).then(|| kept.iter().map(one).collect::<Vec<_>>().join("; "))
}

/// A duration in words.
pub(super) fn time(ms: u64) -> String {
    match ms {
        0..HOUR_MS => format!("{} min", ms.div_ceil(60_000)),
        _ => format!("{} h", ms.div_ceil(HOUR_MS)),
    }
}
