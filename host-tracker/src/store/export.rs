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
//! Sources: RFC 4180 (CSV); <https://parquet.apache.org/docs/file-format/>.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File as Output;
use std::io;
use std::path::{Path as File, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

use super::error::StoreError;
use super::figures::{Stay, stays};
use super::numbers::integer;
use super::reader::{Count, LineSeen, Reader};
use kehai_tracking::occupancy::ZoneKnown;

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

/// Values of a column, all of one kind.
enum Column {
    Number(Vec<i64>),
    MaybeNumber(Vec<Option<i64>>),
    /// ms since 1970.
    Time(Vec<u64>),
    /// Of metres, degrees and the like, to a thousandth.
    Real(Vec<f64>),
    MaybeReal(Vec<Option<f64>>),
    YesNo(Vec<bool>),
    Text(Vec<String>),
}

/// A table: a file's worth.
struct Table {
    name: &'static str,
    columns: Vec<(&'static str, Column)>,
}

/// Writes what happened between `from_ms` and `to_ms` into files of `folder`, which is made if missing.
///
/// # Errors
/// A file cannot be written, or the database not be read.
pub fn export(
    database: &File,
    folder: &File,
    (from_ms, to_ms): (u64, u64),
    format: Format,
) -> Result<Vec<PathBuf>, StoreError> {
    let reader = Reader::open(database)?;
    let tables = tables(&reader, from_ms, to_ms)
        .map_err(|error| StoreError::Sqlite { file: database.to_path_buf(), error })?;
    std::fs::create_dir_all(folder)
        .map_err(|error| StoreError::File { file: folder.to_path_buf(), error })?;
    let write = |table: &Table| {
        let file = folder.join(format!("{}.{format}", table.name));
        let written = match format {
            Format::Csv => table.csv(&file),
            Format::Parquet => table.parquet(&file),
        };
        match written {
            Ok(()) => Ok(file),
            Err(error) => Err(StoreError::File { file, error }),
        }
    };
    tables.iter().map(write).collect()
}

fn tables(reader: &Reader, from_ms: u64, to_ms: u64) -> rusqlite::Result<[Table; 8]> {
    let paths = reader.paths(from_ms, to_ms)?;
    let points = || paths.iter().flat_map(|path| path.places.iter().map(move |place| (path, place)));
    let lives = reader.lives(from_ms, to_ms)?;
    let mut counts = reader.counts(from_ms, to_ms)?;
    end(
        &mut counts,
        (&lives, from_ms, to_ms),
        |row| (&row.zone, row.at_ms, row.state == ZoneKnown::Unknown.name()),
        |row, at_ms| Count {
            zone: row.zone.clone(),
            at_ms,
            count: None,
            state: ZoneKnown::Unknown.name().to_owned(),
        },
    );
    let crossings = reader.crossings(from_ms, to_ms)?;
    let mut lines = reader.line_states(from_ms, to_ms)?;
    end(
        &mut lines,
        (&lives, from_ms, to_ms),
        |row| (&row.line, row.at_ms, row.state == ZoneKnown::Unknown),
        |row, at_ms| LineSeen { line: row.line.clone(), at_ms, state: ZoneKnown::Unknown },
    );
    let events = reader.events(from_ms, to_ms)?;
    let stays = stays(&events, &lives);
    let poses = reader.poses()?;
    let health = reader.health(from_ms, to_ms)?;
    let metres = |mm: i32| f64::from(mm) * 1e-3;
    let number = integer;
    let stay_s = |stay: &Stay| stay.ended_ms.saturating_sub(stay.begun_ms) as f64 * 1e-3;
    Ok([
        Table {
            name: "paths",
            columns: vec![
                ("run", Column::Number(points().map(|(path, _)| path.run).collect())),
                ("track", Column::Number(points().map(|(path, _)| number(path.track)).collect())),
                ("time", Column::Time(points().map(|(_, at)| at.at_ms).collect())),
                ("x_m", Column::Real(points().map(|(_, at)| metres(at.x_mm)).collect())),
                ("y_m", Column::Real(points().map(|(_, at)| metres(at.y_mm)).collect())),
                ("hidden", Column::YesNo(points().map(|(_, at)| at.hidden).collect())),
            ],
        },
        Table {
            name: "counts",
            columns: vec![
                ("zone", Column::Text(counts.iter().map(|row| row.zone.clone()).collect())),
                ("time", Column::Time(counts.iter().map(|row| row.at_ms).collect())),
                ("count", Column::MaybeNumber(counts.iter().map(|row| row.count.map(i64::from)).collect())),
                ("state", Column::Text(counts.iter().map(|row| row.state.clone()).collect())),
            ],
        },
        Table {
            name: "crossings",
            columns: vec![
                ("line", Column::Text(crossings.iter().map(|row| row.line.clone()).collect())),
                ("time", Column::Time(crossings.iter().map(|row| row.at_ms).collect())),
                (
                    "direction",
                    Column::Text(crossings.iter().map(|row| row.direction.name().to_owned()).collect()),
                ),
            ],
        },
        Table {
            name: "lines",
            columns: vec![
                ("line", Column::Text(lines.iter().map(|row| row.line.clone()).collect())),
                ("time", Column::Time(lines.iter().map(|row| row.at_ms).collect())),
                ("state", Column::Text(lines.iter().map(|row| row.state.name().to_owned()).collect())),
            ],
        },
        Table {
            name: "stays",
            columns: vec![
                ("zone", Column::Text(stays.iter().map(|stay| stay.zone.clone()).collect())),
                ("track", Column::Number(stays.iter().map(|stay| number(stay.track)).collect())),
                ("entered", Column::Time(stays.iter().map(|stay| stay.begun_ms).collect())),
                ("left", Column::Time(stays.iter().map(|stay| stay.ended_ms).collect())),
                ("stay_s", Column::Real(stays.iter().map(stay_s).collect())),
            ],
        },
        Table {
            name: "events",
            columns: vec![
                ("time", Column::Time(events.iter().map(|row| row.at_ms).collect())),
                ("kind", Column::Text(events.iter().map(|row| row.kind.clone()).collect())),
                ("subject", Column::Text(events.iter().map(|row| row.subject.clone()).collect())),
                ("track", Column::MaybeNumber(events.iter().map(|row| row.track.map(number)).collect())),
                ("text", Column::Text(events.iter().map(|row| row.text.clone()).collect())),
            ],
        },
        Table {
            name: "poses",
            columns: vec![
                ("time", Column::Time(poses.iter().map(|row| row.at_ms).collect())),
                ("module", Column::Text(poses.iter().map(|row| row.module.clone()).collect())),
                ("x_m", Column::Real(poses.iter().map(|row| row.x_m).collect())),
                ("y_m", Column::Real(poses.iter().map(|row| row.y_m).collect())),
                ("yaw_deg", Column::Real(poses.iter().map(|row| row.yaw_deg).collect())),
                ("source", Column::Text(poses.iter().map(|row| row.source.clone()).collect())),
            ],
        },
        Table {
            name: "health",
            columns: vec![
                ("time", Column::Time(health.iter().map(|row| row.at_ms).collect())),
                ("module", Column::Text(health.iter().map(|row| row.module.clone()).collect())),
                ("state", Column::Text(health.iter().map(|row| row.state.clone()).collect())),
                ("scans_hz", Column::Real(health.iter().map(|row| row.scans_hz).collect())),
                ("lost_percent", Column::Real(health.iter().map(|row| 100.0 * row.lost_share).collect())),
                (
                    "checksum_errors",
                    Column::Number(health.iter().map(|row| number(row.checksum_errors)).collect()),
                ),
                (
                    "unknown_percent",
                    Column::Real(health.iter().map(|row| 100.0 * row.unknown_share).collect()),
                ),
                (
                    "clock_offset_ms",
                    Column::MaybeReal(health.iter().map(|row| row.clock_offset_ms).collect()),
                ),
                ("clock_jitter_ms", Column::Real(health.iter().map(|row| row.clock_jitter_ms).collect())),
            ],
        },
    ])
}

/// What a tracker said last holds no longer than it ran: adds that nothing is known from then on. Who reads a table alone knows
/// of no lives. `of`: the name of a row, its time and whether it says that already; `unknown`: the same name at another time.
fn end<T>(
    rows: &mut Vec<T>,
    (lives, from_ms, to_ms): (&[(u64, u64)], u64, u64),
    of: impl Fn(&T) -> (&str, u64, bool),
    unknown: impl Fn(&T, u64) -> T,
) {
    // A row from before the time asked for may be of a life that was over by then.
    let is_alive = |at_ms| lives.iter().any(|(begun_ms, ended_ms)| (*begun_ms..=*ended_ms).contains(&at_ms));
    rows.retain(|row| of(row).1 >= from_ms || is_alive(of(row).1));
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

impl Table {
    fn csv(&self, file: &File) -> io::Result<()> {
        let mut out = csv::Writer::from_path(file)?;
        out.write_record(self.columns.iter().map(|(name, _)| *name))?;
        let rows = self.columns.first().map_or(0, |(_, column)| column.len());
        for row in 0..rows {
            out.write_record(self.columns.iter().map(|(_, column)| column.text(row)))?;
        }
        out.flush()
    }

    fn parquet(&self, file: &File) -> io::Result<()> {
        let fields: String =
            self.columns.iter().map(|(name, column)| format!("{};", column.field(name))).collect();
        let write = || -> Result<(), ParquetError> {
            let schema = Arc::new(parse_message_type(&format!("message {} {{{fields}}}", self.name))?);
            let settings = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
            let mut out = SerializedFileWriter::new(Output::create(file)?, schema, Arc::new(settings))?;
            let mut group = out.next_row_group()?;
            for (_, column) in &self.columns {
                if let Some(mut to) = group.next_column()? {
                    column.write(&mut to)?;
                    to.close()?;
                }
            }
            group.close()?;
            out.close()?;
            Ok(())
        };
        write().map_err(io::Error::other)
    }
}

impl Column {
    const fn len(&self) -> usize {
        match self {
            Self::Number(values) => values.len(),
            Self::MaybeNumber(values) => values.len(),
            Self::Time(values) => values.len(),
            Self::Real(values) => values.len(),
            Self::MaybeReal(values) => values.len(),
            Self::YesNo(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// A value for people, and for programs that read text; empty if there is none.
    fn text(&self, row: usize) -> String {
        let text = match self {
            Self::Number(values) => values.get(row).map(ToString::to_string),
            Self::MaybeNumber(values) => values.get(row).copied().flatten().map(|value| value.to_string()),
            Self::Time(values) => values.get(row).map(|at_ms| format!("{:.3}", *at_ms as f64 * 1e-3)),
            Self::Real(values) => values.get(row).map(|value| format!("{value:.3}")),
            Self::MaybeReal(values) => values.get(row).copied().flatten().map(|value| format!("{value:.3}")),
            Self::YesNo(values) => values.get(row).map(|value| u8::from(*value).to_string()),
            Self::Text(values) => values.get(row).cloned(),
        };
        text.unwrap_or_default()
    }

    /// As a Parquet schema declares it.
    fn field(&self, name: &str) -> String {
        match self {
            Self::Number(_) => format!("required int64 {name}"),
            Self::MaybeNumber(_) => format!("optional int64 {name}"),
            Self::Time(_) => format!("required int64 {name} (TIMESTAMP(MILLIS,true))"),
            Self::Real(_) => format!("required double {name}"),
            Self::MaybeReal(_) => format!("optional double {name}"),
            Self::YesNo(_) => format!("required boolean {name}"),
            Self::Text(_) => format!("required binary {name} (STRING)"),
        }
    }

    fn write(&self, to: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        match self {
            Self::Number(values) => to.typed::<Int64Type>().write_batch(values, None, None)?,
            Self::MaybeNumber(values) => {
                let (there, values) = there(values);
                to.typed::<Int64Type>().write_batch(&values, Some(&there), None)?
            }
            Self::MaybeReal(values) => {
                let (there, values) = there(values);
                to.typed::<DoubleType>().write_batch(&values, Some(&there), None)?
            }
            Self::Time(values) => {
                let values: Vec<i64> = values.iter().map(|&at_ms| integer(at_ms)).collect();
                to.typed::<Int64Type>().write_batch(&values, None, None)?
            }
            Self::Real(values) => to.typed::<DoubleType>().write_batch(values, None, None)?,
            Self::YesNo(values) => to.typed::<BoolType>().write_batch(values, None, None)?,
            Self::Text(values) => {
                let values: Vec<ByteArray> = values.iter().map(|text| text.as_str().into()).collect();
                to.typed::<ByteArrayType>().write_batch(&values, None, None)?
            }
        };
        Ok(())
    }
}

/// Which there are, as Parquet's definition levels, and those.
fn there<T: Copy>(values: &[Option<T>]) -> (Vec<i16>, Vec<T>) {
    let levels = values.iter().map(|value| i16::from(value.is_some())).collect();
    (levels, values.iter().copied().flatten().collect())
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};

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
            lost_share: 0.0125,
            checksum_errors: 3,
            clock_offset_ms: Some(-4.5),
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
        let learned = events.iter().find(|event| event.kind == "learned").unwrap();
        assert_eq!((learned.at_ms, learned.subject.as_str()), (now_ms - 2000, "left"));
        let health = reader.health(0, now_ms).unwrap();
        assert_eq!(health.len(), 2);
        assert_eq!((health[0].clock_offset_ms, health[1].clock_offset_ms), (Some(-4.5), None));
        for format in [Format::Csv, Format::Parquet] {
            export(&database, &out, (0, now_ms), format).unwrap();
        }
        let text = std::fs::read_to_string(out.join("health.csv")).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        assert!(rows[1].ends_with(",left,watching,9.900,1.250,3,0.000,-4.500,0.000"), "{text}");
        assert!(rows[2].ends_with(",right,missing,0.000,0.000,0,0.000,,0.000"), "{text}");
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
    fn crossings_survive_a_restart_and_are_exported() {
        let folder = tempfile::tempdir().unwrap();
        let (database, out) = (folder.path().join("kehai.db"), folder.path().join("out"));
        let now_ms = unix_ms();
        assert!(counted_before(&database).is_empty());
        let store = Store::open(&database, &Arc::new(Site::default()), Keep::USUAL).unwrap();
        for (later_ms, inward) in [(500, 7), (1500, 8)] {
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
        assert_eq!((line.inward, line.outward), (Some(1), Some(0)));
        assert!((1.9..2.1).contains(&line.unknown_s), "{line:?}");
    }
}
