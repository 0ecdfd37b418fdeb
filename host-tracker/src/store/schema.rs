//! The tables, and how the file is opened.
//!
//! ```text
//!   run ─ 1:n ─ path (track, part) ── begun_ms ◀─ index ── "what happened between a and b"
//!   zone ─ 1:n ─ count (zone, at_ms)        event (at_ms)        health (module, at_ms)
//!   total (at_ms): from then on these zones make the total
//!   alarm: since when, until when, who has acknowledged it       until_ms ◀─ index
//!   passage: one group through a door, its record as JSON, without its card       begun_ms ◀─ index
//!   pose (module, at_ms): where modules were said to be, and the source   snapshot: one row, what was known last
//!   name (at_ms, run, track, hash, probability): from then on that track is probably this ID; at most 0.5: none is
//!       any more. The last row (by `name`) of a hash and a run holds, until the end of the run
//!   line ─ 1:n ─ crossing (line, at_ms, direction)      line_state (line, at_ms): from then on the line is seen, or not
//!   crossing_hour: a view, crossings of each hour
//!   card (at_ms, place, hash): of a passage the door and when it began   raw_request ─ 1:n ─ raw: each with an end of its own
//! ```
//!
//! Write-ahead log with `synchronous = NORMAL`: a transaction that was committed survives the death of the
//! process; a power cut may take the last ones with it, never the file.

use rusqlite::Connection;

use super::alarm_rows::ALARMS;

/// Written into the file; a newer one is refused rather than damaged.
pub const VERSION: i64 = 8;

/// The first layout with all tables of which a command asks, those of lines included.
pub(super) const READABLE: i64 = 6;

/// To so much the write-ahead log is cut once it is begun anew: it would stay as long as a backup or a new layout made it. As much
/// as SQLite lets it become by itself, 1000 pages.
const LOG_BYTES: u32 = 1000 * 4096;

const TABLES: &str = "
CREATE TABLE run (
    run INTEGER PRIMARY KEY,
    begun_ms INTEGER NOT NULL
);
CREATE TABLE path (
    run INTEGER NOT NULL,
    track INTEGER NOT NULL,
    part INTEGER NOT NULL,
    begun_ms INTEGER NOT NULL,
    ended_ms INTEGER NOT NULL,
    points BLOB NOT NULL,
    PRIMARY KEY (run, track, part)
) WITHOUT ROWID;
CREATE INDEX path_begun ON path (begun_ms);
CREATE TABLE zone (
    zone INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE
);
CREATE TABLE count (
    zone INTEGER NOT NULL REFERENCES zone,
    at_ms INTEGER NOT NULL,
    count INTEGER NOT NULL,
    state TEXT NOT NULL,
    PRIMARY KEY (zone, at_ms)
) WITHOUT ROWID;
CREATE INDEX count_at ON count (at_ms);
CREATE TABLE event (
    event INTEGER PRIMARY KEY,
    at_ms INTEGER NOT NULL,
    kind TEXT NOT NULL,
    subject TEXT NOT NULL,
    track INTEGER,
    text TEXT NOT NULL
);
CREATE INDEX event_at ON event (at_ms);
CREATE TABLE module (
    module INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE
);
CREATE TABLE health (
    module INTEGER NOT NULL REFERENCES module,
    at_ms INTEGER NOT NULL,
    state TEXT NOT NULL,
    scans_hz REAL NOT NULL,
    lost_share REAL NOT NULL,
    checksum_errors INTEGER NOT NULL,
    unknown_share REAL NOT NULL,
    clock_offset_ms REAL,
    clock_jitter_ms REAL NOT NULL,
    PRIMARY KEY (module, at_ms)
) WITHOUT ROWID;
CREATE INDEX health_at ON health (at_ms);
CREATE TABLE pose (
    at_ms INTEGER NOT NULL,
    module TEXT NOT NULL,
    x_m REAL NOT NULL,
    y_m REAL NOT NULL,
    yaw_deg REAL NOT NULL,
    source TEXT NOT NULL,
    PRIMARY KEY (module, at_ms)
) WITHOUT ROWID;
CREATE TABLE snapshot (
    only INTEGER PRIMARY KEY CHECK (only = 1),
    at_ms INTEGER NOT NULL,
    frame TEXT NOT NULL
);
";

/// Passages through doors: beside the others, so that a file of before has them, too.
const PASSAGES: &str = "
CREATE TABLE IF NOT EXISTS passage (
    passage INTEGER PRIMARY KEY,
    door TEXT NOT NULL,
    begun_ms INTEGER NOT NULL,
    ended_ms INTEGER NOT NULL,
    outcome TEXT NOT NULL,
    alarm TEXT,
    record TEXT NOT NULL
);
CREATE INDEX IF NOT EXISTS passage_begun ON passage (begun_ms);
";

/// What version 2 has more.
const TABLES_2: &str = "
ALTER TABLE run ADD COLUMN ended_ms INTEGER;
CREATE TABLE card (
    card INTEGER PRIMARY KEY,
    at_ms INTEGER NOT NULL,
    place TEXT NOT NULL,
    hash BLOB NOT NULL
);
CREATE INDEX card_at ON card (at_ms);
CREATE TABLE raw_request (
    request INTEGER PRIMARY KEY,
    module TEXT NOT NULL,
    begun_ms INTEGER NOT NULL,
    until_ms INTEGER NOT NULL
);
CREATE TABLE raw (
    request INTEGER NOT NULL,
    at_ms INTEGER NOT NULL,
    scan TEXT NOT NULL,
    PRIMARY KEY (request, at_ms)
) WITHOUT ROWID;
";

/// What version 3 changes: a passage's card is in the table of cards alone, for as long as those are kept.
const TABLES_3: &str = "
INSERT INTO card (at_ms, place, hash)
    SELECT begun_ms, door, unhex(record ->> '$.passage.card') FROM passage
    WHERE unhex(record ->> '$.passage.card') IS NOT NULL;
UPDATE passage SET record = json_set(record, '$.passage.card', NULL)
    WHERE record ->> '$.passage.card' IS NOT NULL;
";

/// What version 4 has more: which track an ID was, kept for as long as cards are. A row holds until the next one of its
/// hash, or the end of its run; one of at most 0.5 says that from then on no track is known to be the ID.
const TABLES_4: &str = "
CREATE TABLE name (
    name INTEGER PRIMARY KEY,
    at_ms INTEGER NOT NULL,
    run INTEGER NOT NULL,
    track INTEGER NOT NULL,
    hash BLOB NOT NULL,
    probability REAL NOT NULL
);
CREATE INDEX name_at ON name (at_ms);
";

/// What version 5 changes: a count that is not known is NULL, never 0.
const TABLES_5: &str = "
CREATE TABLE count_5 (
    zone INTEGER NOT NULL REFERENCES zone,
    at_ms INTEGER NOT NULL,
    count INTEGER,
    state TEXT NOT NULL,
    PRIMARY KEY (zone, at_ms)
) WITHOUT ROWID;
INSERT INTO count_5 SELECT zone, at_ms,
    iif(state = 'known' OR state = 'partly' AND count > 0, count, NULL), state FROM count;
DROP TABLE count;
ALTER TABLE count_5 RENAME TO count;
CREATE INDEX count_at ON count (at_ms);
";

/// What version 6 has more: counting lines. A line's own counts are of all time, also of crossings that were too old to be kept.
const TABLES_6: &str = "
CREATE TABLE line (
    line INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    inward INTEGER NOT NULL DEFAULT 0,
    outward INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE crossing (
    crossing INTEGER PRIMARY KEY,
    line INTEGER NOT NULL REFERENCES line,
    at_ms INTEGER NOT NULL,
    direction TEXT NOT NULL
);
CREATE INDEX crossing_at ON crossing (at_ms);
CREATE TABLE line_state (
    line INTEGER NOT NULL REFERENCES line,
    at_ms INTEGER NOT NULL,
    state TEXT NOT NULL,
    PRIMARY KEY (line, at_ms)
) WITHOUT ROWID;
CREATE INDEX line_state_at ON line_state (at_ms);
CREATE VIEW crossing_hour AS
    SELECT line.name AS line, at_ms / 3600000 * 3600000 AS hour_ms,
        SUM(direction = 'in') AS inward, SUM(direction = 'out') AS outward
    FROM crossing JOIN line USING (line) GROUP BY crossing.line, hour_ms;
";

/// What version 7 has more: of which zones the total is made, from when on; a list of names as JSON.
const TABLES_7: &str = "
CREATE TABLE total (
    at_ms INTEGER PRIMARY KEY,
    zones TEXT NOT NULL
);
DROP VIEW crossing_hour;
CREATE VIEW crossing_hour AS
    SELECT line.name AS line, at_ms / 3600000 * 3600000 AS hour_ms,
        NULLIF(SUM(direction = 'in'), 0) AS inward, NULLIF(SUM(direction = 'out'), 0) AS outward
    FROM crossing JOIN line USING (line) GROUP BY crossing.line, hour_ms;
";

/// What version 8 changes: what was not measured of a module is NULL, never 0. Before, 0 stood for a share without a scan, and for the
/// jitter of a clock that was not compared.
const TABLES_8: &str = "
CREATE TABLE health_8 (
    module INTEGER NOT NULL REFERENCES module,
    at_ms INTEGER NOT NULL,
    state TEXT NOT NULL,
    scans_hz REAL NOT NULL,
    lost_share REAL,
    checksum_errors INTEGER NOT NULL,
    unknown_share REAL NOT NULL,
    clock_offset_ms REAL,
    clock_jitter_ms REAL,
    PRIMARY KEY (module, at_ms)
) WITHOUT ROWID;
INSERT INTO health_8 SELECT module, at_ms, state, scans_hz,
    iif(scans_hz > 0 OR lost_share > 0, lost_share, NULL), checksum_errors, unknown_share,
    clock_offset_ms, iif(clock_offset_ms IS NULL, NULL, clock_jitter_ms) FROM health;
DROP TABLE health;
ALTER TABLE health_8 RENAME TO health;
CREATE INDEX health_at ON health (at_ms);
";

/// Why a database is not touched.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Unfit {
    /// It was written by a newer version, with this layout.
    #[error(
        "it was written by a newer version (layout {0}, this one knows {VERSION}): use that one, or another file"
    )]
    Newer(i64),
    /// It was written by a version so old that tables are missing, with this layout.
    #[error(
        "it was written by an older version (layout {0}): kehai-tracker run --db with it once, and --keep-days \
         large enough, brings it up to date"
    )]
    Older(i64),
    /// It has the tables of another program.
    #[error("it is a database of another program, and is left alone: choose another file")]
    Foreign,
    /// It has no tables, so there is nothing to be read.
    #[error("it is empty: kehai-tracker run --db fills it")]
    Empty,
}

/// The number of a database's layout; 0 of one without tables, a new one.
///
/// # Errors
/// What SQLite says.
pub(super) fn layout(connection: &Connection) -> rusqlite::Result<Result<i64, Unfit>> {
    // One statement, so that a database that is being made is seen before or after that. These tables are in every layout.
    let asked = "SELECT (SELECT user_version FROM pragma_user_version), COUNT(*),
            COUNT(*) FILTER (WHERE name IN ('run', 'path', 'snapshot'))
        FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\'";
    let (version, tables, ours): (i64, i64, i64) =
        connection.query_row(asked, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
    // A tracker's has its number since its first table.
    let is_ours = version > 0 && ours == 3;
    Ok(match version {
        _ if tables > 0 && !is_ours => Err(Unfit::Foreign),
        _ if version > VERSION => Err(Unfit::Newer(version)),
        _ => Ok(version),
    })
}

/// Makes `connection` ready: settings, and the tables if there are none.
///
/// # Errors
/// What SQLite says.
pub fn prepare(connection: &mut Connection) -> rusqlite::Result<Result<(), Unfit>> {
    connection.pragma_update(None, "busy_timeout", 2000)?;
    // Before the settings, some of which stay in the file.
    if let Err(unfit) = layout(connection)? {
        return Ok(Err(unfit));
    }
    // Pages of deleted rows are given back bit by bit; to be said before the first table.
    connection.pragma_update(None, "auto_vacuum", "INCREMENTAL")?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "NORMAL")?;
    connection.pragma_update(None, "journal_size_limit", LOG_BYTES)?;
    // What has expired is overwritten, not only given up.
    connection.pragma_update(None, "secure_delete", "ON")?;
    let transaction = connection.transaction()?;
    let version = match layout(&transaction)? {
        Ok(version) => version,
        Err(unfit) => return Ok(Err(unfit)),
    };
    transaction.execute_batch(PASSAGES)?;
    transaction.execute_batch(ALARMS)?;
    for (older, tables) in [
        (1, TABLES),
        (2, TABLES_2),
        (3, TABLES_3),
        (4, TABLES_4),
        (5, TABLES_5),
        (6, TABLES_6),
        (7, TABLES_7),
        (8, TABLES_8),
    ] {
        if version < older {
            transaction.execute_batch(tables)?;
        }
    }
    transaction.pragma_update(None, "user_version", VERSION)?;
    transaction.commit()?;
    Ok(Ok(()))
}

#[cfg(test)]
mod tests;
