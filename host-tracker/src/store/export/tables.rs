//! What each table has in its columns.

use super::super::answers::{Count, CrossedAt, LineSeen, Posed, Walked, Was, WasDoing};
use super::super::event::Event;
use super::super::figures::Stay;
use super::super::numbers::integer;
use super::super::path::Place;
use super::table::{Column, Table};
use kehai_tracking::snapshot::DeviceState;

fn texts<T>(rows: &[T], text: impl Fn(&T) -> &str) -> Column {
    Column::Text(rows.iter().map(|row| text(row).to_owned()).collect())
}

fn times<T>(rows: &[T], at_ms: impl Fn(&T) -> u64) -> Column {
    Column::Time(rows.iter().map(at_ms).collect())
}

fn reals<T>(rows: &[T], real: impl Fn(&T) -> f64) -> Column {
    Column::Real(rows.iter().map(real).collect())
}

/// The points of paths that are wanted.
pub fn paths(paths: &[Walked], is_wanted: impl Fn(&Place) -> bool) -> Table {
    let points = paths.iter().flat_map(|path| path.places.iter().map(move |place| (path, place)));
    let points: Vec<(&Walked, &Place)> = points.filter(|(_, place)| is_wanted(place)).collect();
    let metres = |mm: i32| f64::from(mm) * 1e-3;
    Table {
        name: "paths",
        columns: vec![
            ("run", Column::Number(points.iter().map(|(path, _)| path.run).collect())),
            ("track", Column::Number(points.iter().map(|(path, _)| integer(path.track)).collect())),
            ("time", times(&points, |(_, at)| at.at_ms)),
            ("x_m", reals(&points, |(_, at)| metres(at.x_mm))),
            ("y_m", reals(&points, |(_, at)| metres(at.y_mm))),
            ("hidden", Column::YesNo(points.iter().map(|(_, at)| at.hidden).collect())),
        ],
    }
}

pub fn counts(rows: &[Count]) -> Table {
    Table {
        name: "counts",
        columns: vec![
            ("zone", texts(rows, |row| &row.zone)),
            ("time", times(rows, |row| row.at_ms)),
            ("count", Column::MaybeNumber(rows.iter().map(|row| row.count.map(i64::from)).collect())),
            ("state", texts(rows, |row| row.state.name())),
        ],
    }
}

pub fn crossings(rows: &[CrossedAt]) -> Table {
    Table {
        name: "crossings",
        columns: vec![
            ("line", texts(rows, |row| &row.line)),
            ("time", times(rows, |row| row.at_ms)),
            ("direction", texts(rows, |row| row.direction.name())),
        ],
    }
}

pub fn lines(rows: &[LineSeen]) -> Table {
    Table {
        name: "lines",
        columns: vec![
            ("line", texts(rows, |row| &row.line)),
            ("time", times(rows, |row| row.at_ms)),
            ("state", texts(rows, |row| row.state.name())),
        ],
    }
}

pub fn stays(rows: &[Stay]) -> Table {
    Table {
        name: "stays",
        columns: vec![
            ("zone", texts(rows, |stay| &stay.zone)),
            ("track", Column::Number(rows.iter().map(|stay| integer(stay.track)).collect())),
            ("entered", times(rows, |stay| stay.begun_ms)),
            ("left", times(rows, |stay| stay.ended_ms)),
            ("stay_s", reals(rows, |stay| stay.ended_ms.saturating_sub(stay.begun_ms) as f64 * 1e-3)),
        ],
    }
}

pub fn events(rows: &[Event]) -> Table {
    Table {
        name: "events",
        columns: vec![
            ("time", times(rows, |row| row.at_ms)),
            ("kind", texts(rows, |row| row.kind.name())),
            ("subject", texts(rows, |row| &row.subject)),
            ("track", Column::MaybeNumber(rows.iter().map(|row| row.track.map(integer)).collect())),
            ("text", texts(rows, |row| &row.text)),
        ],
    }
}

pub fn poses(rows: &[Posed]) -> Table {
    Table {
        name: "poses",
        columns: vec![
            ("time", times(rows, |row| row.at_ms)),
            ("module", texts(rows, |row| &row.module)),
            ("x_m", reals(rows, |row| row.x_m)),
            ("y_m", reals(rows, |row| row.y_m)),
            ("yaw_deg", reals(rows, |row| row.yaw_deg)),
            ("source", texts(rows, |row| row.source.name())),
        ],
    }
}

/// What is not known of a module has no value: the shares of its scans if none came, its counters if it was not there, how its
/// clock scattered if that was not compared. In a file of an older layout, which is read as it is, these are 0.
pub fn health(rows: &[Was]) -> Table {
    let percent = |share: fn(&Was) -> Option<f64>| {
        let is_measured = |row: &Was, share: f64| row.scans_hz > 0.0 || share > 0.0;
        let of = |row: &Was| share(row).filter(|share| is_measured(row, *share)).map(|share| 100.0 * share);
        Column::MaybeReal(rows.iter().map(of).collect())
    };
    let is_there = |row: &&Was| row.state != WasDoing::Known(DeviceState::Missing);
    let errors = |row: &Was| Some(row).filter(is_there).map(|row| integer(row.checksum_errors));
    let jitter_ms = |row: &Was| row.clock_offset_ms.and(row.clock_jitter_ms);
    Table {
        name: "health",
        columns: vec![
            ("time", times(rows, |row| row.at_ms)),
            ("module", texts(rows, |row| &row.module)),
            ("state", texts(rows, |row| row.state.name())),
            ("scans_hz", reals(rows, |row| row.scans_hz)),
            ("lost_percent", percent(|row| row.lost_share)),
            ("checksum_errors", Column::MaybeNumber(rows.iter().map(errors).collect())),
            ("unknown_percent", percent(|row| (row.scans_hz > 0.0).then_some(row.unknown_share))),
            ("clock_offset_ms", Column::MaybeReal(rows.iter().map(|row| row.clock_offset_ms).collect())),
            ("clock_jitter_ms", Column::MaybeReal(rows.iter().map(jitter_ms).collect())),
        ],
    }
}
