//! The site, read and written by the map.
//!
//! ```text
//!   GET  ─▶ {"revision": 3, "file": "home.toml", "site": {…}, "toml": "…"}
//!   PUT  ◀─ {"revision": 3, "base": {…}, "site": {…}}     application/json; revision and base: what was read, so that no edit is lost
//!        ◀─ a site file                                   application/toml; If-Match: 3
//!        ─▶ {"revision": 4}                               or 400 (line or field), 403 (not by this role), 500 (not saved)
//!           {"revision": 4, "merged": ["wall 2 added"]}   what was changed meanwhile, and is kept
//!           409 {"error": "…", "revision": 4, "site": theirs, "merged": both in one, "conflicts": […], "changes": […], "wrong": […]}
//!   POST …/try ◀─ {"base": {…}, "site": {…}}              the same without an error, and what is wrong with `site`; nothing is saved
//! ```
//!
//! Revisions have no order: a site has the same one whenever its file has the same text. Without `base` a change from another
//! revision is refused.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::State;
use axum::extract::rejection::BytesRejection;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::Deserialize;

use super::answers::{BODY_MAX, refuse, text};
use super::blocking;
use super::bodies::{Revised, SiteShown, SiteTogether};
use super::shared::Shared;
use crate::access::Who;
use crate::site_file::{Edit, Kept, SaveError, Saved};
use kehai_tracking::site::Site;
use kehai_tracking::site::merge::Merged;

/// What errors call a site that came as a request.
const REQUEST: &str = "request";

/// Another site.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "SiteChange")]
pub(super) struct Change {
    /// The revision that was read before, so that no edit is lost; without it, whatever is there is replaced.
    revision: Option<u64>,
    /// The site of that revision: with it, what was changed meanwhile is kept.
    base: Option<Site>,
    /// The whole site.
    site: Site,
}

/// The site in use.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    let kept = shared.context.site.current();
    let (file, site, toml) = (&*kept.name, &*kept.site, &*kept.text);
    Json(SiteShown { revision: kept.revision, file, site, toml }).into_response()
}

/// Another site: checked, saved, and in use from then on.
pub async fn change(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    let Ok(body) = body else { return too_long() };
    blocking::answer(move || save(&shared, &who, &headers, &body)).await
}

fn save(shared: &Shared, who: &Who, headers: &HeaderMap, body: &[u8]) -> Response {
    let change = match read(headers, body) {
        Ok(change) => change,
        Err((status, why)) => return refuse(status, &why),
    };
    let context = &shared.context;
    if let Some(refusal) = shared.refuse_change(who, Some(&change.site)) {
        return refusal;
    }
    if let Err(error) = context.site.look(&*context.changed) {
        return save_refused(&error);
    }
    // By hand it may have got doors.
    if let Some(refusal) = shared.refuse_change(who, Some(&change.site)) {
        return refusal;
    }
    let Change { revision, base, site } = change;
    match context.site.save(Edit { revision, base, site }, &*context.changed) {
        Ok(Saved { revision, theirs }) => Json(Revised { revision, merged: theirs }).into_response(),
        Err(error) => save_refused(&error),
    }
}

/// What would become of a change. Nothing is saved.
pub async fn attempt(State(shared): State<Arc<Shared>>, body: Result<Bytes, BytesRejection>) -> Response {
    let Ok(body) = body else { return too_long() };
    blocking::answer(move || match json_of(&body) {
        Ok(Change { base, site, .. }) => {
            let (kept, merged, theirs) = shared.context.site.compare(base.as_ref().unwrap_or(&site), &site);
            let wrong = site.wrong();
            Json(SiteTogether { wrong, ..together(&kept, &merged, &theirs) }).into_response()
        }
        Err((status, why)) => refuse(status, &why),
    })
    .await
}

/// A change beside what was changed meanwhile.
fn together<'a>(kept: &'a Kept, merged: &'a Merged, theirs: &'a [String]) -> SiteTogether<'a> {
    SiteTogether {
        error: None,
        revision: kept.revision,
        site: &kept.site,
        merged: &merged.site,
        conflicts: &merged.conflicts,
        changes: theirs,
        wrong: merged.site.wrong(),
    }
}

fn too_long() -> Response {
    refuse(
        StatusCode::PAYLOAD_TOO_LARGE,
        &format!("the site is longer than {BODY_MAX} bytes, or was cut off"),
    )
}

/// An answer that says why nothing was saved.
pub(super) fn save_refused(error: &SaveError) -> Response {
    let (status, why) = (save_status(error), error.to_string());
    let SaveError::Conflict { now, merged, theirs, .. } = error else { return refuse(status, &why) };
    (status, Json(SiteTogether { error: Some(why), ..together(now, merged, theirs) })).into_response()
}

/// The status of an answer that says why nothing was saved.
pub(super) const fn save_status(error: &SaveError) -> StatusCode {
    match error {
        SaveError::Wrong(_) => StatusCode::BAD_REQUEST,
        SaveError::Together => StatusCode::FORBIDDEN,
        SaveError::Changed { .. }
        | SaveError::Conflict { .. }
        | SaveError::ChangedOnDisk(_)
        | SaveError::InUse(_) => StatusCode::CONFLICT,
        SaveError::Failed { .. } => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

fn read(headers: &HeaderMap, body: &[u8]) -> Result<Change, (StatusCode, String)> {
    let wrong = |why: String| (StatusCode::BAD_REQUEST, why);
    let kind = text(headers, header::CONTENT_TYPE).unwrap_or_default();
    match kind.split(';').next().unwrap_or_default().trim() {
        "application/json" => json_of(body),
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
            Ok(Change { revision, base: None, site })
        }
        other => Err((
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            format!("\"{other}\" is not understood: send application/json or application/toml"),
        )),
    }
}

fn json_of(body: &[u8]) -> Result<Change, (StatusCode, String)> {
    let wrong = |why: String| (StatusCode::BAD_REQUEST, why);
    let mut json = serde_json::Deserializer::from_slice(body);
    let change: Change = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let path = error.path().to_string();
        let what = error.into_inner();
        wrong(if path == "." { what.to_string() } else { format!("{path}: {what}") })
    })?;
    json.end().map_err(|error| wrong(error.to_string()))?;
    // Before it is compared with anything, which takes as long as the square of that.
    let sites = change.base.iter().chain([&change.site]);
    let too_many = sites.flat_map(Site::too_many_corners).next();
    match too_many {
        Some(too_many) => Err(wrong(too_many.text)),
        None => Ok(change),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_with_too_many_corners_is_refused_before_it_is_compared() {
        let zone = |count: usize| {
            let polygon: Vec<[usize; 2]> = (0..count).map(|corner| [corner, corner * corner % 97]).collect();
            serde_json::json!({ "zone": [{ "name": "park", "polygon": polygon }] })
        };
        let read = |change: &serde_json::Value| json_of(change.to_string().as_bytes()).err();
        for long in [
            serde_json::json!({ "site": zone(100_000) }),
            serde_json::json!({ "base": zone(100_000), "site": {} }),
        ] {
            let (status, why) = read(&long).unwrap();
            assert_eq!(status, StatusCode::BAD_REQUEST);
            assert_eq!(why, "zone \"park\": polygon: has 100000 corners: draw it with 256 at most");
        }
        assert!(read(&serde_json::json!({ "site": zone(256) })).is_none());
    }
}
