//! What the database holds of the past, for the time line.
//!
//! ```text
//!   GET /api/overview?from=MS&to=MS&bins=240 ─▶ {"kept": true, "from_ms": …, "bins": [2, 3, null, …], "events": […]}
//!   GET /api/past?from=MS&to=MS              ─▶ {"paths": [{"run": 4, "track": 7, "places": [[MS, x mm, y mm, hidden], …]}],
//!                                                "counts": […], "events": […]}
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
use serde_json::{Value, json};

use super::answers::refuse;
use super::shared::Shared;
use crate::store::StoreError;
use crate::store::reader::{Reader, Walked};
use crate::store::timeline::{BINS_MAX, overview};
use kehai_tracking::site::Site;

/// Longest time of which paths are given at once, ms: an hour of a busy entrance is about 2 MB.
const PATHS_MS: u64 = 3_600_000;

/// Longest time of an overview, ms: a month.
const OVERVIEW_MS: u64 = 31 * 86_400_000;

/// Bins if nothing is said.
const BINS: u64 = 240;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Asked {
    from_ms: u64,
    to_ms: u64,
    bins: u64,
}

impl Asked {
    /// From a request's query; what is wrong with which field, if something is.
    fn read(query: &str, most_ms: u64) -> Result<Self, String> {
        let (mut from_ms, mut to_ms, mut bins) = (None, None, BINS);
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let number =
                || value.parse::<u64>().map_err(|_| format!("{key}: \"{value}\" is no whole number"));
            match key {
                "from" => from_ms = Some(number()?),
                "to" => to_ms = Some(number()?),
                "bins" => bins = number()?,
                _ => return Err(format!("{key}: unknown; understood: from, to, bins")),
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
        Ok(Self { from_ms, to_ms, bins })
    }
}

/// A long time at a glance.
pub async fn glance(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    let site = shared.context.site.current().site;
    answer(&shared, query, OVERVIEW_MS, move |reader, asked| {
        let of = (asked.from_ms, asked.to_ms);
        let found = overview(reader, of, asked.bins as usize, |zone| counts(&site, zone))?;
        let mut value = json!(found);
        value["kept"] = json!(true);
        Ok(value)
    })
    .await
}

/// People's paths, counts and events of a short time.
pub async fn paths(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    answer(&shared, query, PATHS_MS, |reader, Asked { from_ms, to_ms, .. }| {
        let place = |walked: &Walked| -> Vec<Value> {
            let places = walked.places.iter();
            places.map(|at| json!([at.at_ms, at.x_mm, at.y_mm, u8::from(at.hidden)])).collect()
        };
        let paths = reader.paths(from_ms, to_ms)?;
        let paths: Vec<Value> = paths
            .iter()
            .map(|walked| json!({ "run": walked.run, "track": walked.track, "places": place(walked) }))
            .collect();
        Ok(json!({
            "kept": true,
            "paths": paths,
            "lives": reader.lives(from_ms, to_ms)?,
            "counts": reader.counts(from_ms, to_ms)?,
            "events": reader.events(from_ms, to_ms)?,
        }))
    })
    .await
}

/// Zones that are counted; all of them in a site that counts none.
fn counts(site: &Site, zone: &str) -> bool {
    let none = !site.zones.iter().any(|zone| zone.count);
    none || site.zones.iter().any(|known| known.count && known.name == zone)
}

/// Reads in a thread that may wait for the disk.
async fn answer(
    shared: &Shared,
    query: Option<String>,
    most_ms: u64,
    read: impl FnOnce(&Reader, Asked) -> rusqlite::Result<Value> + Send + 'static,
) -> Response {
    let asked = match Asked::read(&query.unwrap_or_default(), most_ms) {
        Ok(asked) => asked,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why),
    };
    let Some(file) = shared.context.database.clone() else {
        return Json(json!({ "kept": false })).into_response();
    };
    let reading = tokio::task::spawn_blocking(move || with(&file, |reader| read(reader, asked)));
    match reading.await {
        Ok(Ok(value)) => Json(value).into_response(),
        Ok(Err(error)) => refuse(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the database could not be read"),
    }
}

fn with(file: &Path, read: impl FnOnce(&Reader) -> rusqlite::Result<Value>) -> Result<Value, StoreError> {
    let reader = Reader::open(file)?;
    read(&reader).map_err(|error| StoreError::Sqlite { file: file.to_path_buf(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_says_which_field_is_wrong() {
        let read = |query| Asked::read(query, 3_600_000);
        assert_eq!(read("from=5&to=9&bins=3"), Ok(Asked { from_ms: 5, to_ms: 9, bins: 3 }));
        assert_eq!(read("to=9&from=5"), Ok(Asked { from_ms: 5, to_ms: 9, bins: BINS }));
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
            ("from=1&to=2&until=3", "until:"),
            ("from=1&to", "to:"),
        ] {
            let why = read(query).unwrap_err();
            assert!(why.starts_with(field), "{query}: {why}");
        }
    }
}
