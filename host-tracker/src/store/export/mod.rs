//! What happened, as tables for other programs: CSV, or Parquet.
//!
//! ```text
//!   paths    run,track,time,x_m,y_m,hidden     the stored points; between two, people went straight
//!   counts   zone,time,count,state             from then on; where a tracker ended, that nothing is known
//!   crossings   line,time,direction
//!   lines    line,time,state      from then on a line was seen, or not
//!   stays    zone,track,entered,left,stay_s
//!   events   time,kind,subject,track,text
//!   poses    time,module,x_m,y_m,yaw_deg,source
//!   health   time,module,state,scans_hz,lost_percent,checksum_errors,unknown_percent,clock_offset_ms,clock_jitter_ms
//!
//!   time     CSV: seconds since 1970        Parquet: a timestamp in ms, UTC
//! ```
//!
//! The same by site, area and day: [`partitioned`].
//!
//! Sources: RFC 4180 (CSV); <https://parquet.apache.org/docs/file-format/>.

pub mod partitioned;
mod table;
mod tables;
mod whole;

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path as File, PathBuf};
use std::str::FromStr;

use super::answers::{Count, LineSeen};
use super::error::StoreError;
use super::figures::{STAY_MS, stays};
use super::reader::Reader;
use kehai_tracking::occupancy::ZoneKnown;
use table::Table;

/// What a file looks like.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Format {
    /// Text, a line a row.
    #[default]
    Csv,
    /// Columns, compressed with Snappy.
    Parquet,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        })
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        [Self::Csv, Self::Parquet]
            .into_iter()
            .find(|format| format.to_string() == name)
            .ok_or_else(|| format!("there is no format \"{name}\": csv or parquet"))
    }
}

/// Writes what happened between `from_ms` and `to_ms` into files of `folder`, which is made if missing.
///
/// # Errors
/// A file cannot be written, and is as it was, or the database not be read.
pub fn export(
    database: &File,
    folder: &File,
    (from_ms, to_ms): (u64, u64),
    format: Format,
) -> Result<Vec<PathBuf>, StoreError> {
    let reader = Reader::open_kept(database)?;
    let tables = tables_of(&reader, from_ms, to_ms)
        .map_err(|error| StoreError::Sqlite { file: database.to_path_buf(), error })?;
    std::fs::create_dir_all(folder)
        .map_err(|error| StoreError::File { file: folder.to_path_buf(), error })?;
    let write = |table: &Table| {
        let file = folder.join(format!("{}.{format}", table.name));
        let written = whole::put(&file, |file| match format {
            Format::Csv => table.csv(file),
            Format::Parquet => table.parquet(file),
        });
        match written {
            Ok(()) => Ok(file),
            Err(error) => Err(StoreError::File { file, error }),
        }
    };
    tables.iter().map(write).collect()
}

fn tables_of(reader: &Reader, from_ms: u64, to_ms: u64) -> rusqlite::Result<[Table; 8]> {
    let lives = reader.lives(from_ms, to_ms)?;
    // A stay is of the time in which it ended, and began before, perhaps.
    let before_ms = from_ms.saturating_sub(STAY_MS);
    let mut events = reader.events(before_ms, to_ms)?;
    let mut stays = stays(&events, &reader.lives(before_ms, to_ms)?);
    stays.retain(|stay| stay.ended_ms >= from_ms);
    events.retain(|event| event.at_ms >= from_ms);
    Ok([
        tables::paths(&reader.paths(from_ms, to_ms)?, |_| true),
        tables::counts(&counts(reader, &lives, (from_ms, to_ms))?),
        tables::crossings(&reader.crossings(from_ms, to_ms)?),
        tables::lines(&lines(reader, &lives, (from_ms, to_ms))?),
        tables::stays(&stays),
        tables::events(&events),
        tables::poses(&reader.poses()?),
        tables::health(&reader.health(from_ms, to_ms)?),
    ])
}

/// How many were in each zone from when on.
fn counts(
    reader: &Reader,
    lives: &[(u64, u64)],
    (from_ms, to_ms): (u64, u64),
) -> rusqlite::Result<Vec<Count>> {
    let mut counts = reader.counts(from_ms, to_ms)?;
    end(
        &mut counts,
        (lives, to_ms),
        |row| (&row.zone, row.at_ms, row.state == ZoneKnown::Unknown),
        |row, at_ms| Count { zone: row.zone.clone(), at_ms, count: None, state: ZoneKnown::Unknown },
    );
    Ok(counts)
}

/// Whether each line was seen from when on.
fn lines(
    reader: &Reader,
    lives: &[(u64, u64)],
    (from_ms, to_ms): (u64, u64),
) -> rusqlite::Result<Vec<LineSeen>> {
    let mut lines = reader.line_states(from_ms, to_ms)?;
    end(
        &mut lines,
        (lives, to_ms),
        |row| (&row.line, row.at_ms, row.state == ZoneKnown::Unknown),
        |row, at_ms| LineSeen { line: row.line.clone(), at_ms, state: ZoneKnown::Unknown },
    );
    Ok(lines)
}

/// What a tracker said last holds no longer than it ran: adds that nothing is known from then on. A reader of the table alone knows
/// nothing of when trackers ran. `of`: the name of a row, its time and whether it says that already; `unknown`: the same name at another time.
fn end<T>(
    rows: &mut Vec<T>,
    (lives, to_ms): (&[(u64, u64)], u64),
    of: impl Fn(&T) -> (&str, u64, bool),
    unknown: impl Fn(&T, u64) -> T,
) {
    // A row from before the time asked for may be of a life that was over by then, one within it of a time that two runs tell of.
    let is_alive = |at_ms| lives.iter().any(|(begun_ms, ended_ms)| (*begun_ms..=*ended_ms).contains(&at_ms));
    rows.retain(|row| is_alive(of(row).1));
    let mut ends = Vec::new();
    for &(begun_ms, ended_ms) in lives.iter().filter(|(_, ended_ms)| *ended_ms < to_ms) {
        let mut last: BTreeMap<&str, &T> = BTreeMap::new();
        let own = rows.iter().filter(|row| (begun_ms..=ended_ms).contains(&of(row).1));
        last.extend(own.map(|row| (of(row).0, row)));
        ends.extend(last.into_values().filter(|row| !of(row).2).map(|row| unknown(row, ended_ms + 1)));
    }
    rows.extend(ends);
    rows.sort_by_key(|row| of(row).1);
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parquet::file::reader::{FileReader, SerializedFileReader};

    use super::super::answers::Was;
    use super::super::event::{Event, EventKind};
    use super::super::figures::figures;
    use super::super::{Keep, Store, counted_before};
    use super::*;
    use kehai_tracking::lines::{CrossedLine, Totals};
    use kehai_tracking::site::Site;
    use kehai_tracking::snapshot::{DeviceEvent, DeviceState, EventLine, ModuleLine, Snapshot, unix_ms};

    #[test]
    fn how_modules_were_and_what_they_learned_is_kept_and_exported() {
        let folder = tempfile::tempdir().unwrap();
        let (database, out) = (folder.path().join("kehai.db"), folder.path().join("out"));
        let now_ms = unix_ms();
        let learned =
            EventLine { boot: 1, number: 4, kind: DeviceEvent::Learned, text: "new".into(), ago_s: 2.0 };
        let module = ModuleLine {
            name: "left".into(),
            state: DeviceState::Watching,
            scans_hz: 9.9,
            lost_share: Some(0.0125),
            checksum_errors: 3,
            clock_offset_ms: Some(-4.5),
            clock_jitter_ms: Some(0.25),
            events: vec![learned],
            ..ModuleLine::default()
        };
        let other = ModuleLine { name: "right".into(), state: DeviceState::Missing, ..ModuleLine::default() };
        let frame = Snapshot { unix_ms: now_ms, modules: vec![module, other], ..Snapshot::default() };
        let store = Store::open(&database, &Arc::new(Site::default()), Keep::USUAL).unwrap();
        store.record(Arc::new(frame));
        drop(store);
        let reader = Reader::open(&database).unwrap();
        let events = reader.events(0, now_ms).unwrap();
        let learned = events.iter().find(|event| event.kind.name() == "learned").unwrap();
        assert_eq!((learned.at_ms, learned.subject.as_str()), (now_ms - 2000, "left"));
        let health = reader.health(0, now_ms).unwrap();
        assert_eq!(health.len(), 2);
        let measured = |of: &Was| (of.lost_share, of.clock_offset_ms, of.clock_jitter_ms);
        assert_eq!(measured(&health[0]), (Some(0.0125), Some(-4.5), Some(0.25)));
        assert_eq!(measured(&health[1]), (None, None, None), "never measured, not 0");
        for format in [Format::Csv, Format::Parquet] {
            export(&database, &out, (0, now_ms), format).unwrap();
        }
        let text = std::fs::read_to_string(out.join("health.csv")).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        assert!(rows[1].ends_with(",left,watching,9.900,1.250,3,0.000,-4.500,0.250"), "{text}");
        assert!(rows[2].ends_with(",right,missing,0.000,,,,,"), "{text}");
        let file = std::fs::File::open(out.join("health.parquet")).unwrap();
        let rows = SerializedFileReader::new(file).unwrap();
        let rows: Vec<String> =
            rows.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
        assert!(
            rows[0].contains("clock_offset_ms: -4.5") && rows[1].contains("clock_offset_ms: null"),
            "{rows:?}"
        );
    }

    #[test]
    fn a_module_s_state_of_another_version_is_exported_by_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let (database, out) = (folder.path().join("kehai.db"), folder.path().join("out"));
        let rows = "INSERT INTO module VALUES (1, 'left');
            INSERT INTO health VALUES (1, 1000, 'resting', 9.9, 0, 3, 0.1, NULL, NULL);
            INSERT INTO health VALUES (1, 2000, 'missing', 0, NULL, 0, 0, NULL, NULL);";
        super::super::connection::open(&database).unwrap().execute_batch(rows).unwrap();
        export(&database, &out, (0, 3000), Format::Csv).unwrap();
        let text = std::fs::read_to_string(out.join("health.csv")).unwrap();
        let rows: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(rows, ["1.000,left,resting,9.900,0.000,3,10.000,,", "2.000,left,missing,0.000,,,,,"]);
    }

    #[test]
    fn a_stay_that_began_before_the_time_asked_for_and_ended_in_it_is_exported() {
        let folder = tempfile::tempdir().unwrap();
        let (database, out) = (folder.path().join("kehai.db"), folder.path().join("out"));
        let store = Store::open(&database, &Arc::new(Site::default()), Keep::USUAL).unwrap();
        let now_ms = unix_ms();
        for (later_ms, kind, track) in [
            (0, EventKind::Enter, 3),
            (1000, EventKind::Enter, 4),
            (1500, EventKind::Leave, 3),
            (5000, EventKind::Leave, 4),
        ] {
            store.happened(Event::new(now_ms + later_ms, kind, "hall", "").of(Some(track)));
        }
        store.see_waiting(Arc::new(Snapshot { unix_ms: now_ms + 6000, ..Snapshot::default() }));
        drop(store);
        export(&database, &out, (now_ms + 3000, now_ms + 6000), Format::Csv).unwrap();
        let read = |file: &str| std::fs::read_to_string(out.join(file)).unwrap();
        let stays = read("stays.csv");
        assert_eq!(stays.lines().count(), 2, "{stays}");
        assert!(stays.trim_end().ends_with(",4.000") && stays.contains("hall,4,"), "{stays}");
        assert_eq!(read("events.csv").lines().count(), 2, "what happened before is not of this time");
    }

    #[test]
    fn crossings_survive_a_restart_and_are_exported() {
        let folder = tempfile::tempdir().unwrap();
        let (database, out) = (folder.path().join("kehai.db"), folder.path().join("out"));
        let now_ms = unix_ms();
        assert!(counted_before(&database).is_empty());
        let store = Store::open(&database, &Arc::new(Site::default()), Keep::USUAL).unwrap();
        for (later_ms, inward) in [(500, 7), (1500, 8), (2000, 8)] {
            let line = CrossedLine {
                name: "front".into(),
                inward: Some(inward),
                outward: Some(3),
                state: ZoneKnown::Known,
                unknown_s: 0.0,
                unfollowed: 0,
            };
            let frame = Snapshot { unix_ms: now_ms + later_ms, lines: vec![line], ..Snapshot::default() };
            store.record(Arc::new(frame));
        }
        drop(store);
        let totals = Totals { inward: 8, outward: 3 };
        assert_eq!(counted_before(&database), [("front".to_owned(), totals)].into());
        export(&database, &out, (0, now_ms + 3000), Format::Csv).unwrap();
        let read = |file: &str| std::fs::read_to_string(out.join(file)).unwrap();
        let crossings = read("crossings.csv");
        assert_eq!(crossings.lines().count(), 2, "{crossings}");
        assert!(
            crossings.lines().nth(1).unwrap().starts_with("front,") && crossings.trim_end().ends_with(",in")
        );
        let lines = read("lines.csv");
        assert!(lines.lines().count() == 4 && lines.trim_end().ends_with("unknown"), "{lines}");
        let reader = Reader::open(&database).unwrap();
        let found = figures(&reader, &[now_ms, now_ms + 3000]).unwrap();
        let line = found.bins[0].lines["front"];
        assert_eq!((line.inward, line.outward), (Some(1), None), "half a second is not known");
        assert_eq!((found.bins[0].to_ms, line.unknown_s), (now_ms + 2000, 0.5), "to the newest frame");
    }
}
