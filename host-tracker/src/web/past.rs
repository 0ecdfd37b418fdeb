//! What the database holds of the past, for the time line.
//!
//! ```text
//!   GET /api/overview?from=MS&to=MS&bins=240 ─▶ {"kept": true, "from_ms": …, "bins": [2, 3, null, …], "events": […]}
//!   GET /api/past?from=MS&to=MS              ─▶ {"paths": [{"run": 4, "track": 7, "places": [[MS, x mm, y mm, hidden], …]}],
//!                                                "counts": […], "events": […]}
//!   GET /api/figures?from=MS&to=MS&bin=3600  ─▶ {"kept": true, "bins": [{"from_ms": …, "lines": {…}, "zones": {…}}, …]}    bin in s
//!                edges=MS,MS,MS                 the same, in bins between them: days have 23 to 25 hours
//!   without a database                       ─▶ {"kept": false}
//! ```
//!
//! Times are ms since 1970. Each question opens the file anew, reads by way of an index, and does not block.

use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::{RawQuery, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use super::answers::refuse;
use super::bodies::{Kept, KeptPart, NotKept, PathWalked, Paths};
use super::shared::Shared;
use crate::store::StoreError;
use crate::store::answers::Walked;
use crate::store::figures::{BINS_MAX as FIGURES_MAX, edges, figures};
use crate::store::reader::Reader;
use crate::store::timeline::{BINS_MAX, overview};
use kehai_tracking::snapshot::unix_ms;

/// Longest time of which paths are given at once, ms: an hour of a busy entrance is about 2 MB.
const PATHS_MS: u64 = 3_600_000;

/// Longest time of an overview, ms: a month of 31 days in which summer time ends, as October in Berlin.
pub(super) const OVERVIEW_MS: u64 = (31 * 24 + 1) * 3_600_000;

/// Bins if nothing is said.
const BINS: u64 = 240;

/// Length of a bin of figures if nothing is said, s.
const BIN_S: u64 = 3600;

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Asked {
    pub(super) from_ms: u64,
    pub(super) to_ms: u64,
    bins: u64,
    bin_s: u64,
    /// Where bins begin and end that are not alike, as days.
    edges_ms: Vec<u64>,
}

impl Asked {
    /// From a request's query; what is wrong with which field, if something is.
    fn read(query: &str, most_ms: u64) -> Result<Self, String> {
        let (mut from_ms, mut to_ms, mut bins, mut bin_s) = (None, None, BINS, BIN_S);
        let mut edges_ms: Vec<u64> = Vec::new();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let number =
                || value.parse::<u64>().map_err(|_| format!("{key}: \"{value}\" is no whole number"));
            match key {
                "from" => from_ms = Some(number()?),
                "to" => to_ms = Some(number()?),
                "bins" => bins = number()?,
                "bin" => bin_s = number()?,
                "edges" => {
                    let edges = value.split(',').map(str::parse).collect::<Result<_, _>>();
                    edges_ms = edges.map_err(|_| "edges: times in ms since 1970, between commas")?;
                    if edges_ms.len() < 2 || !edges_ms.is_sorted_by(|one, next| one < next) {
                        return Err("edges: two and more, each after the one before".into());
                    }
                    (from_ms, to_ms) = (edges_ms.first().copied(), edges_ms.last().copied());
                }
                _ => return Err(format!("{key}: unknown; understood: from, to, bins, bin, edges")),
            }
        }
        let needed = |key: &str, value: Option<u64>| {
            value.ok_or_else(|| format!("{key}: missing; a time in ms since 1970"))
        };
        let (from_ms, to_ms) = (needed("from", from_ms)?, needed("to", to_ms)?);
        if to_ms <= from_ms {
            return Err(format!("to: {to_ms} is not after from"));
        }
        if to_ms - from_ms > most_ms {
            return Err(format!("to: more than {} h after from", most_ms / 3_600_000));
        }
        if bins == 0 || bins > BINS_MAX as u64 {
            return Err(format!("bins: 1 to {BINS_MAX}"));
        }
        if edges_ms.len() as u64 > FIGURES_MAX {
            return Err(format!("edges: at most {FIGURES_MAX}"));
        }
        if bin_s == 0
            || edges_ms.is_empty() && (to_ms - from_ms).div_ceil(bin_s.saturating_mul(1000)) > FIGURES_MAX
        {
            return Err(format!("bin: so many seconds that there are 1 to {FIGURES_MAX} bins"));
        }
        Ok(Self { from_ms, to_ms, bins, bin_s, edges_ms })
    }
}

/// A long time at a glance.
pub async fn glance(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    answer(&shared, query, OVERVIEW_MS, |reader, asked| {
        overview(reader, (asked.from_ms, asked.to_ms), asked.bins as usize)
    })
    .await
}

/// People's paths, counts and events of a short time.
pub async fn paths(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    answer(&shared, query, PATHS_MS, |reader, Asked { from_ms, to_ms, .. }| {
        let path = |Walked { run, track, places }: Walked| {
            let places = places.iter().map(|at| (at.at_ms, at.x_mm, at.y_mm, u8::from(at.hidden))).collect();
            PathWalked { run, track, places }
        };
        Ok(Paths {
            paths: reader.paths(from_ms, to_ms)?.into_iter().map(path).collect(),
            lives: reader.lives(from_ms, to_ms)?,
            counts: reader.counts(from_ms, to_ms)?,
            events: reader.events(from_ms, to_ms)?,
        })
    })
    .await
}

/// Crossings of lines, people and stays in zones, bin by bin, up to now.
pub async fn binned(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    answer(&shared, query, OVERVIEW_MS, |reader, Asked { from_ms, to_ms, bin_s, edges_ms, .. }| {
        let now_ms = unix_ms();
        let edges_ms = match edges_ms.is_empty() {
            true => edges((from_ms, to_ms.min(now_ms)), bin_s.saturating_mul(1000)),
            false => until(edges_ms, now_ms),
        };
        figures(reader, &edges_ms)
    })
    .await
}

/// Up to now: of the future nothing is unknown.
fn until(mut edges_ms: Vec<u64>, now_ms: u64) -> Vec<u64> {
    let past = edges_ms.partition_point(|edge_ms| *edge_ms < now_ms);
    if past > 0 && past < edges_ms.len() {
        edges_ms.truncate(past);
        edges_ms.push(now_ms);
    }
    if past == 0 { Vec::new() } else { edges_ms }
}

/// Reads in a thread that may wait for the disk.
pub(super) async fn answer<T: Serialize + Send + 'static>(
    shared: &Shared,
    query: Option<String>,
    most_ms: u64,
    read: impl FnOnce(&Reader, Asked) -> rusqlite::Result<T> + Send + 'static,
) -> Response {
    let asked = match Asked::read(&query.unwrap_or_default(), most_ms) {
        Ok(asked) => asked,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why),
    };
    let Some(file) = shared.context.database.clone() else {
        return Json(Kept::<T>::Nothing(NotKept { kept: false })).into_response();
    };
    let reading = tokio::task::spawn_blocking(move || with(&file, |reader| read(reader, asked)));
    match reading.await {
        Ok(Ok(found)) => Json(Kept::Kept(KeptPart { kept: true, found })).into_response(),
        Ok(Err(error)) => refuse(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the database could not be read"),
    }
}

fn with<T>(file: &Path, read: impl FnOnce(&Reader) -> rusqlite::Result<T>) -> Result<T, StoreError> {
    let reader = Reader::open(file)?;
    read(&reader).map_err(|error| StoreError::Sqlite { file: file.to_path_buf(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_month_in_which_summer_time_ends_is_given_whole() {
        // October 2026 in Berlin, from 00:00 +02:00 until 00:00 +01:00 of November: 745 h.
        let (first_ms, end_ms) = (1_790_805_600_000_u64, 1_793_487_600_000_u64);
        let range = |end_ms: u64| Asked::read(&format!("from={first_ms}&to={end_ms}"), OVERVIEW_MS);
        assert!(range(end_ms).is_ok(), "heat: {:?}", range(end_ms));
        let edges = Asked::read(&format!("edges={first_ms},{end_ms}"), OVERVIEW_MS);
        assert!(edges.is_ok(), "figures: {edges:?}");
        assert_eq!(range(end_ms + 1), Err("to: more than 745 h after from".to_owned()));
    }

    #[test]
    fn a_question_says_which_field_is_wrong() {
        let read = |query| Asked::read(query, 3_600_000);
        let asked = || Asked { from_ms: 5, to_ms: 9, bins: BINS, bin_s: BIN_S, edges_ms: Vec::new() };
        assert_eq!(read("from=5&to=9&bins=3"), Ok(Asked { bins: 3, ..asked() }));
        assert_eq!(read("to=9&from=5&bin=60"), Ok(Asked { bin_s: 60, ..asked() }));
        assert_eq!(read("edges=5,7,9"), Ok(Asked { edges_ms: vec![5, 7, 9], ..asked() }));
        assert_eq!(until(vec![5, 7, 9], 8), [5, 7, 8]);
        assert_eq!([until(vec![5, 7, 9], 3), until(vec![5, 7, 9], 20)], [vec![], vec![5, 7, 9]]);
        for (query, field) in [
            ("", "from:"),
            ("from=1", "to:"),
            ("from=x&to=2", "from:"),
            ("from=-1&to=2", "from:"),
            ("from=1&to=2.5", "to:"),
            ("from=2&to=2", "to:"),
            ("from=0&to=3600001", "to:"),
            ("from=1&to=2&bins=0", "bins:"),
            ("from=1&to=2&bins=1001", "bins:"),
            ("from=1&to=2&bin=0", "bin:"),
            ("from=0&to=3600000&bin=3", "bin:"),
            ("from=1&to=2&until=3", "until:"),
            ("from=1&to", "to:"),
            ("edges=1", "edges:"),
            ("edges=1,1", "edges:"),
            ("edges=a,2", "edges:"),
        ] {
            let why = read(query).unwrap_err();
            assert!(why.starts_with(field), "{query}: {why}");
        }
    }
}
