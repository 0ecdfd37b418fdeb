//! Calibration by walking, for the map.
//!
//! ```text
//!   GET  /api/calibration ─▶ how far it is, where to walk next, what was found
//!   POST /api/calibration ◀─ {"do": "begin" | "finish" | "go-on" | "accept" | "stop"}
//!                         ─▶ the same; accept: {"revision": 4} once the site's file has the poses; 403 (not by this role)
//! ```

use std::sync::Arc;

use axum::extract::State;
use axum::extract::rejection::JsonRejection;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::Deserialize;

use super::answers::refuse;
use super::blocking;
use super::bodies::Revised;
use super::shared::Shared;
use super::site::save_refused;
use crate::access::Who;

/// What the browser wants.
#[derive(Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "CalibrationDo")]
enum Do {
    /// Begin to walk.
    Begin,
    /// It is enough: find the poses.
    Finish,
    /// Walk on.
    GoOn,
    /// Save the poses that were found.
    Accept,
    /// Leave everything as it was.
    Stop,
}

/// A step of a calibration.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "CalibrationStep")]
pub struct Wish {
    /// Which.
    r#do: Do,
}

/// How far it is.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    blocking::answer(move || Json(shared.context.calibration.status()).into_response()).await
}

/// Does what is wished.
pub async fn change(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    wish: Result<Json<Wish>, JsonRejection>,
) -> Response {
    match wish {
        // Equations of some tenths of a second, and files.
        Ok(Json(wish)) => blocking::answer(move || done(&shared, &who, wish.r#do)).await,
        Err(error) => refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    }
}

fn done(shared: &Shared, who: &Who, wish: Do) -> Response {
    // While a door is in use a walk goes on: nothing changes before its poses are accepted.
    if let Err((status, why)) = shared.may_by_role(who, None) {
        return refuse(status, &why);
    }
    let calibration = &shared.context.calibration;
    match wish {
        Do::Begin => calibration.begin(),
        Do::GoOn => calibration.go_on(),
        Do::Stop => calibration.stop(),
        Do::Finish => calibration.finish(),
        Do::Accept => return accept(shared, who),
    }
    Json(calibration.status()).into_response()
}

/// Saves the poses that were found.
fn accept(shared: &Shared, who: &Who) -> Response {
    let calibration = &shared.context.calibration;
    let Some(poses) = calibration.mountings() else {
        return refuse(StatusCode::CONFLICT, "there are no poses to accept: walk and finish first");
    };
    if let Some(refusal) = shared.refuse_change(who, None) {
        return refusal;
    }
    let (site, changed) = (&shared.context.site, &*shared.context.changed);
    if let Err(error) = site.look(changed) {
        return save_refused(&error);
    }
    // By hand it may have got doors.
    if let Some(refusal) = shared.refuse_change(who, None) {
        return refusal;
    }
    // The tracker notes the poses of a site that it is given as a user's: the calibration's are noted before.
    let noted = |saved| {
        (shared.context.accepted)(&poses);
        changed(saved)
    };
    match site.save_poses(&poses, noted) {
        Ok(revision) => {
            calibration.stop();
            Json(Revised { revision, merged: Vec::new() }).into_response()
        }
        Err(error) => save_refused(&error),
    }
}
