//! That a database of each layout is brought up to date with what it has, and any other is left alone.

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
    for (at_ms, count, state) in [(1, 0, "known"), (2, 0, "partly"), (3, 2, "partly"), (4, 0, "unknown")] {
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
        connection.execute("INSERT INTO crossing (line, at_ms, direction) VALUES (1, ?1, ?2)", row).unwrap();
    }
    let mut hours = connection.prepare("SELECT inward, outward FROM crossing_hour ORDER BY hour_ms").unwrap();
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

#[test]
fn a_log_that_has_become_long_is_cut_once_it_is_begun_anew() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kehai.db");
    let mut connection = Connection::open(&file).unwrap();
    prepare(&mut connection).unwrap().unwrap();
    let log = || std::fs::metadata(folder.path().join("kehai.db-wal")).unwrap().len();
    let long = "INSERT INTO total (at_ms, zones) VALUES (1, hex(zeroblob(4000000)))";
    connection.execute(long, []).unwrap();
    assert!(log() > u64::from(LOG_BYTES));
    connection.execute("INSERT INTO run (begun_ms) VALUES (7)", []).unwrap();
    assert!(log() <= u64::from(LOG_BYTES), "{}", log());
}
