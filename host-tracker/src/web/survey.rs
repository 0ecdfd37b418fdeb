//! The plan that modules have measured, for the map to show and accept.
//!
//! ```text
//!   GET /api/survey ─▶ {"wall": […], "zone": […], "entry": […]}: parts that the site lacks, as its file has them
//! ```
//!
//! Nothing is saved by it: the map puts what is accepted into the site.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use kehai_tracking::survey::{placed, propose};

use super::answers::refuse;
use super::shared::Shared;

/// What the backgrounds of the placed modules say of the place.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    let backgrounds = shared.context.calibration.backgrounds();
    let site = shared.context.site.current().site;
    // Some tenths of a second for a large place: on a thread of its own.
    match tokio::task::spawn_blocking(move || propose(&placed(backgrounds, &site), &site)).await {
        Ok(proposal) => Json(proposal).into_response(),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the plan could not be worked out"),
    }
}
