//! The picture under the map.
//!
//! ```text
//!   GET    /api/picture       ─▶ the picture; 404 without one
//!   PUT    /api/picture       ◀─ image/png or image/svg+xml, 8 MiB at most   ─▶ {}
//!   DELETE /api/picture                                                      ─▶ {}
//!   GET    /api/picture/place ─▶ {"picture": true, "place": {"x": …, "y": …, "turn_deg": …, "m_per_px": …, "width": …, "height": …}}
//!   PUT    /api/picture/place ◀─ such a place                                ─▶ {}
//! ```
//!
//! An SVG may hold scripts. The map shows it as an image, in which browsers run none; opened by itself it is in a sandbox that runs
//! none and loads nothing.

use std::sync::Arc;

use axum::Json;
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::rejection::{BytesRejection, JsonRejection};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;

use super::answers::{refuse, text};
use super::blocking::{self, in_turn};
use super::bodies::Done;
use super::shared::Shared;
use crate::picture::{LONGEST, PictureError, PictureFile, Place};

/// What a picture that is opened by itself may do.
const SANDBOX: &str =
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'";

fn file(shared: &Shared) -> PictureFile {
    PictureFile::beside(shared.context.site.path())
}

/// The picture.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    blocking::answer(move || match file(&shared).load() {
        Ok(Some((kind, bytes))) => {
            ([(header::CONTENT_TYPE, kind.media_type()), (header::CONTENT_SECURITY_POLICY, SANDBOX)], bytes)
                .into_response()
        }
        Ok(None) => refuse(StatusCode::NOT_FOUND, "there is no picture"),
        Err(error) => refused(&error),
    })
    .await
}

/// Another picture.
pub async fn change(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    let Ok(body) = body else {
        let why = format!("a picture has {} MiB at most", LONGEST >> 20);
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, &why);
    };
    let said = text(&headers, header::CONTENT_TYPE).unwrap_or_default();
    match crate::picture::Kind::of(&body) {
        Some(kind) if kind.media_type() == said => {
            answer(&shared, move |file| file.save(&body).map(drop)).await
        }
        Some(_) | None => {
            let why = format!("\"{said}\" it is not: send a PNG as image/png, or an SVG as image/svg+xml");
            refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, &why)
        }
    }
}

/// No picture any more.
pub async fn remove(State(shared): State<Arc<Shared>>) -> Response {
    answer(&shared, PictureFile::remove).await
}

/// Whether there is one, and where it lies.
#[derive(Debug, Serialize, JsonSchema)]
pub(in crate::web) struct PictureLaid {
    /// Whether there is one.
    picture: bool,
    /// Where it lies; null: nowhere yet.
    place: Option<Place>,
}

/// Whether there is one, and where it lies.
pub async fn place(State(shared): State<Arc<Shared>>) -> Response {
    blocking::answer(move || {
        let file = file(&shared);
        let there = file.load().is_ok_and(|picture| picture.is_some());
        Json(PictureLaid { picture: there, place: file.place() }).into_response()
    })
    .await
}

/// Lays it elsewhere.
pub async fn lay(State(shared): State<Arc<Shared>>, place: Result<Json<Place>, JsonRejection>) -> Response {
    match place {
        Ok(Json(place)) => answer(&shared, move |file| file.lay(&place)).await,
        Err(error) => refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    }
}

/// Changes the picture, one request at a time: all of them write beside the same file.
async fn answer(
    shared: &Shared,
    change: impl FnOnce(&PictureFile) -> Result<(), PictureError> + Send + 'static,
) -> Response {
    let file = file(shared);
    match in_turn(&shared.drawing, move |()| change(&file)).await {
        Ok(Ok(())) => Json(Done {}).into_response(),
        Ok(Err(error)) => refused(&error),
        Err(error) => blocking::broken(&error),
    }
}

fn refused(error: &PictureError) -> Response {
    let status = match error {
        PictureError::Unknown | PictureError::Place(_) => StatusCode::BAD_REQUEST,
        PictureError::Missing => StatusCode::NOT_FOUND,
        PictureError::File { .. } => StatusCode::INTERNAL_SERVER_ERROR,
    };
    refuse(status, &error.to_string())
}
