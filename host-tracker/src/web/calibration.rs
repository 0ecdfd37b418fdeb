//! Calibration by walking, for the map.
//!
//! ```text
//!   GET  /api/calibration ─▶ how far it is, where to walk next, what was found
//!   POST /api/calibration ◀─ {"do": "begin" | "finish" | "go-on" | "accept" | "stop"}
//!                         ─▶ the same; accept: {"revision": 4} once the site's file has the poses
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
    Json(shared.context.calibration.status()).into_response()
}

/// Does what is wished.
pub async fn change(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    wish: Result<Json<Wish>, JsonRejection>,
) -> Response {
    let wish = match wish {
        Ok(Json(wish)) => wish,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    };
    let calibration = shared.context.calibration.clone();
    match wish.r#do {
        Do::Begin => calibration.begin(),
        Do::GoOn => calibration.go_on(),
        Do::Stop => calibration.stop(),
        Do::Finish => {
            // Some tenths of a second of equations: on a thread of its own.
            let solving = calibration.clone();
            if tokio::task::spawn_blocking(move || solving.finish()).await.is_err() {
                return refuse(StatusCode::INTERNAL_SERVER_ERROR, "the equations could not be solved");
            }
        }
        Do::Accept => {
            let Some(poses) = calibration.mountings() else {
                return refuse(StatusCode::CONFLICT, "there are no poses to accept: walk and finish first");
            };
            if let Some(refusal) = shared.refuse_change(&who, None) {
                return refusal;
            }
            let (site, changed) = (&shared.context.site, &*shared.context.changed);
            // The tracker notes the poses of a site that it is given as a user's: the calibration's are noted before.
            let noted = |saved| {
                (shared.context.accepted)(&poses);
                changed(saved)
            };
            let saved = site.look(changed).and_then(|()| site.save_poses(&poses, noted));
            return match saved {
                Ok(revision) => {
                    calibration.stop();
                    Json(Revised { revision, merged: Vec::new() }).into_response()
                }
                Err(error) => save_refused(&error),
            };
        }
    }
    Json(calibration.status()).into_response()
}
