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
mod tests {
    use super::super::reader::Reader;
    use super::super::retention::{DAY_MS, Keep};
    use super::super::writer::Writer;
    use super::*;

    fn version(connection: &Connection) -> i64 {
        connection.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap()
    }

    #[test]
    fn a_database_of_the_first_version_gets_what_is_missing_and_keeps_what_it_has() {
        let mut connection = Connection::open_in_memory().unwrap();
        connection.execute_batch(TABLES).unwrap();
        connection.pragma_update(None, "user_version", 1).unwrap();
        connection.execute("INSERT INTO run (begun_ms) VALUES (7)", []).unwrap();
        prepare(&mut connection).unwrap().unwrap();
        assert_eq!(version(&connection), VERSION);
        let run = connection.query_row("SELECT begun_ms, ended_ms FROM run", [], |row| {
            Ok((row.get::<_, i64>(0)?, row.get::<_, Option<i64>>(1)?))
        });
        assert_eq!(run.unwrap(), (7, None));
        connection.execute("INSERT INTO card (at_ms, place, hash) VALUES (1, 'door', x'00')", []).unwrap();
        prepare(&mut connection).unwrap().unwrap();
        assert_eq!(connection.query_row("SELECT COUNT(*) FROM name", [], |row| row.get::<_, i64>(0)), Ok(0));
    }

    #[test]
    fn a_run_of_the_first_version_is_read_though_it_has_no_end_and_expires() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let connection = Connection::open(&file).unwrap();
        connection.execute_batch(TABLES).unwrap();
        connection.pragma_update(None, "user_version", 1).unwrap();
        connection.execute("INSERT INTO run (begun_ms) VALUES (7)", []).unwrap();
        drop(connection);
        let mut writer = Writer::open(&file, DAY_MS, None).unwrap();
        let runs = || Reader::open(&file).unwrap().runs().unwrap();
        assert_eq!(runs(), [(7, 7), (DAY_MS, DAY_MS)]);
        writer.forget(DAY_MS + 8, Keep { days: 1, card_days: 1 }).unwrap();
        assert_eq!(runs(), [(DAY_MS, DAY_MS)]);
    }

    #[test]
    fn a_card_in_a_passage_of_before_goes_where_it_expires() {
        let mut connection = Connection::open_in_memory().unwrap();
        for tables in [PASSAGES, TABLES, TABLES_2] {
            connection.execute_batch(tables).unwrap();
        }
        connection.pragma_update(None, "user_version", 2).unwrap();
        for card in ["\"00000000000000000000000000a11ce0\"", "null"] {
            let record = format!("{{\"begun_ms\":5,\"passage\":{{\"card\":{card},\"entered\":2}}}}");
            connection
                .execute(
                    "INSERT INTO passage (door, begun_ms, ended_ms, outcome, record) VALUES ('front', 5, 9, 'complete', ?1)",
                    [record],
                )
                .unwrap();
        }
        prepare(&mut connection).unwrap().unwrap();
        let without = |row: &rusqlite::Row<'_>| row.get::<_, String>(0);
        let records: Vec<String> = connection
            .prepare("SELECT record FROM passage")
            .unwrap()
            .query_map([], without)
            .unwrap()
            .map(Result::unwrap)
            .collect();
        let expected = r#"{"begun_ms":5,"passage":{"card":null,"entered":2}}"#;
        assert_eq!(records, [expected, expected]);
        let card = connection.query_row("SELECT at_ms, place, hex(hash) FROM card", [], |row| {
            Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?))
        });
        assert_eq!(card.unwrap(), (5, "front".to_owned(), "00000000000000000000000000A11CE0".to_owned()));
    }

    #[test]
    fn a_count_of_before_that_was_not_known_is_none() {
        let mut connection = Connection::open_in_memory().unwrap();
        for tables in [PASSAGES, TABLES, TABLES_2, TABLES_3, TABLES_4] {
            connection.execute_batch(tables).unwrap();
        }
        connection.pragma_update(None, "user_version", 4).unwrap();
        connection.execute("INSERT INTO zone (zone, name) VALUES (1, 'hall')", []).unwrap();
        for (at_ms, count, state) in [(1, 0, "known"), (2, 0, "partly"), (3, 2, "partly"), (4, 0, "unknown")]
        {
            let row = rusqlite::params![at_ms, count, state];
            connection.execute("INSERT INTO count VALUES (1, ?1, ?2, ?3)", row).unwrap();
        }
        prepare(&mut connection).unwrap().unwrap();
        let mut counts = connection.prepare("SELECT count FROM count ORDER BY at_ms").unwrap();
        let counts = counts.query_map([], |row| row.get::<_, Option<i64>>(0)).unwrap();
        assert_eq!(counts.map(Result::unwrap).collect::<Vec<_>>(), [Some(0), None, Some(2), None]);
    }

    #[test]
    fn what_was_not_measured_of_a_module_before_is_none() {
        let mut connection = Connection::open_in_memory().unwrap();
        for tables in [PASSAGES, TABLES, TABLES_2, TABLES_3, TABLES_4, TABLES_5, TABLES_6, TABLES_7] {
            connection.execute_batch(tables).unwrap();
        }
        connection.pragma_update(None, "user_version", 7).unwrap();
        connection.execute("INSERT INTO module (module, name) VALUES (1, 'left')", []).unwrap();
        // Scans with a loss and without one, the end of scans within the minute, and nothing at all.
        for (at_ms, scans_hz, lost_share, offset_ms, jitter_ms) in [
            (1, 10.0, 0.25, Some(-4.5), 0.2),
            (2, 10.0, 0.0, Some(-4.5), 0.0),
            (3, 0.0, 0.5, None, 0.0),
            (4, 0.0, 0.0, None, 0.0),
        ] {
            let row = rusqlite::params![at_ms, scans_hz, lost_share, offset_ms, jitter_ms];
            let asked = "INSERT INTO health VALUES (1, ?1, 'watching', ?2, ?3, 7, 0.1, ?4, ?5)";
            connection.execute(asked, row).unwrap();
        }
        prepare(&mut connection).unwrap().unwrap();
        let asked = "SELECT lost_share, clock_jitter_ms FROM health WHERE checksum_errors = 7 ORDER BY at_ms";
        let mut rows = connection.prepare(asked).unwrap();
        let rows = rows.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
        let rows: Vec<(Option<f64>, Option<f64>)> = rows.map(Result::unwrap).collect();
        assert_eq!(rows, [(Some(0.25), Some(0.2)), (Some(0.0), Some(0.0)), (Some(0.5), None), (None, None)]);
    }

    #[test]
    fn an_hour_says_no_0_of_a_direction_in_which_nobody_was_counted() {
        let mut connection = Connection::open_in_memory().unwrap();
        prepare(&mut connection).unwrap().unwrap();
        connection.execute_batch("INSERT INTO line (line, name) VALUES (1, 'gate')").unwrap();
        for (at_ms, direction) in [(1, "in"), (2, "in"), (3_600_000, "out")] {
            let row = rusqlite::params![at_ms, direction];
            connection
                .execute("INSERT INTO crossing (line, at_ms, direction) VALUES (1, ?1, ?2)", row)
                .unwrap();
        }
        let mut hours =
            connection.prepare("SELECT inward, outward FROM crossing_hour ORDER BY hour_ms").unwrap();
        let hours = hours.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
        let hours: Vec<(Option<i64>, Option<i64>)> = hours.map(Result::unwrap).collect();
        assert_eq!(hours, [(Some(2), None), (None, Some(1))]);
    }

    #[test]
    fn a_database_of_before_lines_is_read_once_a_tracker_has_brought_it_up_to_date() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let mut connection = Connection::open(&file).unwrap();
        for tables in [PASSAGES, TABLES, TABLES_2, TABLES_3, TABLES_4, TABLES_5] {
            connection.execute_batch(tables).unwrap();
        }
        connection.pragma_update(None, "user_version", 5).unwrap();
        let error = Reader::open_kept(&file).unwrap_err().to_string();
        assert!(error.contains("kehai.db: it was written by an older version (layout 5): "), "{error}");
        assert!(error.contains("kehai-tracker run --db") && error.lines().count() == 1, "{error}");
        prepare(&mut connection).unwrap().unwrap();
        assert!(Reader::open_kept(&file).unwrap().line_states(0, 1).unwrap().is_empty());
    }

    #[test]
    fn a_database_of_the_first_version_with_lines_is_read_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("kehai.db");
        let connection = Connection::open(&file).unwrap();
        for tables in [PASSAGES, TABLES, TABLES_2, TABLES_3, TABLES_4, TABLES_5, TABLES_6] {
            connection.execute_batch(tables).unwrap();
        }
        connection.pragma_update(None, "user_version", READABLE).unwrap();
        assert!(Reader::open_kept(&file).unwrap().line_states(0, 1).unwrap().is_empty());
    }

    #[test]
    fn a_database_of_another_program_is_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("other.db");
        for version in [0, 3, VERSION, VERSION + 1] {
            let mut connection = Connection::open(&file).unwrap();
            connection.execute_batch("CREATE TABLE IF NOT EXISTS run (distance_km REAL)").unwrap();
            connection.pragma_update(None, "user_version", version).unwrap();
            let before = std::fs::read(&file).unwrap();
            assert_eq!(prepare(&mut connection).unwrap(), Err(Unfit::Foreign), "{version}");
            drop(connection);
            assert!(std::fs::read(&file).unwrap() == before, "{version}");
        }
        let mut without_number = Connection::open_in_memory().unwrap();
        without_number.execute_batch(TABLES).unwrap();
        assert_eq!(prepare(&mut without_number).unwrap(), Err(Unfit::Foreign), "a tracker's has a number");
    }

    #[test]
    fn a_new_database_gives_back_its_pages_and_may_have_tables_of_a_user() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = Connection::open(folder.path().join("new.db")).unwrap();
        assert_eq!(layout(&connection).unwrap(), Ok(0));
        prepare(&mut connection).unwrap().unwrap();
        let vacuum: i64 = connection.pragma_query_value(None, "auto_vacuum", |row| row.get(0)).unwrap();
        assert_eq!(vacuum, 2, "incremental");
        connection.execute_batch("CREATE TABLE notes (text TEXT)").unwrap();
        prepare(&mut connection).unwrap().unwrap();
        assert_eq!(layout(&connection).unwrap(), Ok(VERSION));
    }

    #[test]
    fn a_database_of_a_newer_version_is_left_alone() {
        let mut connection = Connection::open_in_memory().unwrap();
        connection.pragma_update(None, "user_version", VERSION + 1).unwrap();
        let newer = prepare(&mut connection).unwrap().unwrap_err();
        assert!(newer.to_string().contains("newer version"), "{newer}");
        assert_eq!(version(&connection), VERSION + 1);
    }
}
