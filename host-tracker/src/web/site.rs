//! The site, read and written by the map.
//!
//! ```text
//!   GET  ─▶ {"revision": 3, "file": "home.toml", "site": {…}, "toml": "…"}
//!   PUT  ◀─ {"revision": 3, "site": {…}}     application/json; revision: what was read, so that no edit is lost
//!        ◀─ a site file                      application/toml; If-Match: 3
//!        ─▶ {"revision": 4}                  or 400 (line or field), 403 (not by this role), 409 (changed meanwhile), 500 (not saved)
//! ```

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::State;
use axum::extract::rejection::BytesRejection;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde::Deserialize;
use serde_json::json;

use super::answers::{BODY_MAX, refuse, text};
use super::shared::Shared;
use crate::access::Who;
use crate::site_file::SaveError;
use kehai_tracking::site::Site;

/// What errors call a site that came as a request.
const REQUEST: &str = "request";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    revision: Option<u64>,
    site: Site,
}

/// The site in use.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    let kept = shared.context.site.current();
    Json(json!({ "revision": kept.revision, "file": &*kept.name, "site": &*kept.site, "toml": &*kept.text }))
        .into_response()
}

/// Another site: checked, saved, and in use from then on.
pub async fn change(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    let Ok(body) = body else {
        let why = format!("the site is longer than {BODY_MAX} bytes, or was cut off");
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, &why);
    };
    let change = match read(&headers, &body) {
        Ok(change) => change,
        Err((status, why)) => return refuse(status, &why),
    };
    let context = &shared.context;
    if let Some(refusal) = shared.refuse_change(&who, Some(&change.site)) {
        return refusal;
    }
    match context.site.save(change.site, change.revision, &*context.changed) {
        Ok(revision) => Json(json!({ "revision": revision })).into_response(),
        Err(error) => save_refused(&error),
    }
}

/// An answer that says why nothing was saved.
pub(super) fn save_refused(error: &SaveError) -> Response {
    let status = match error {
        SaveError::Wrong(_) => StatusCode::BAD_REQUEST,
        SaveError::Changed { .. } | SaveError::ChangedOnDisk(_) => StatusCode::CONFLICT,
        SaveError::Failed { .. } => StatusCode::INTERNAL_SERVER_ERROR,
    };
    refuse(status, &error.to_string())
}

fn read(headers: &HeaderMap, body: &[u8]) -> Result<Change, (StatusCode, String)> {
    let wrong = |why: String| (StatusCode::BAD_REQUEST, why);
    let kind = text(headers, header::CONTENT_TYPE).unwrap_or_default();
    match kind.split(';').next().unwrap_or_default().trim() {
        "application/json" => {
            let mut json = serde_json::Deserializer::from_slice(body);
            let change: Change = serde_path_to_error::deserialize(&mut json).map_err(|error| {
                let path = error.path().to_string();
                let what = error.into_inner();
                wrong(if path == "." { what.to_string() } else { format!("{path}: {what}") })
            })?;
            json.end().map_err(|error| wrong(error.to_string()))?;
            Ok(change)
        }
        "application/toml" => {
            let text = std::str::from_utf8(body).map_err(|error| wrong(format!("not text: {error}")))?;
            let site = Site::parse(REQUEST, text).map_err(|error| wrong(error.to_string()))?;
            let revision = match self::text(headers, header::IF_MATCH) {
                None => None,
                Some(number) => Some(
                    number
                        .trim_matches('"')
                        .parse()
                        .map_err(|_| wrong(format!("If-Match: {number} is no revision")))?,
                ),
            };
            Ok(Change { revision, site })
        }
        other => Err((
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            format!("\"{other}\" is not understood: send application/json or application/toml"),
        )),
    }
}
