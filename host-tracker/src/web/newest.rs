//! What is known now: the newest frame for programs and for Prometheus, the last ten minutes, and whether the tracker goes on.
//!
//! ```text
//!   GET /api/state     the newest frame
//!   GET /api/history   two lines a second
//!   GET /metrics       the newest frame for Prometheus
//!   GET /healthz       200 while frames come, 503 when they do not
//! ```

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::answers::refuse;
use super::shared::Shared;
use crate::area_losses::AreaLosses;
use crate::metrics::{self, Losses};
use crate::shared_count::SharedCount;
use crate::store::StoreWatch;

/// A tracker that makes no frame for so long does not go on.
const HEALTHY: Duration = Duration::from_secs(1);

/// The newest frame.
pub async fn state(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.context.frames.borrow());
    Json(&*frame).into_response()
}

/// The last ten minutes.
pub async fn history(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.history.lock().to_json();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// For supervisors: whether the tracker goes on. Frames come every 0.1 s.
pub async fn healthz(State(shared): State<Arc<Shared>>) -> Response {
    let mut frames = shared.context.frames.clone();
    frames.mark_unchanged();
    match tokio::time::timeout(HEALTHY, frames.changed()).await {
        Ok(Ok(())) => "ok\n".into_response(),
        Ok(Err(_)) | Err(_) => {
            refuse(StatusCode::SERVICE_UNAVAILABLE, "the tracker has made no frame for a second")
        }
    }
}

/// The newest frame for Prometheus.
pub async fn metrics(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.context.frames.borrow());
    let context = &shared.context;
    let losses = Losses {
        database: context.kept.as_ref().map(StoreWatch::dropped),
        mqtt: context.mqtt_dropped.as_ref().map(SharedCount::get),
        areas: context.areas_lost.as_ref().map(AreaLosses::counts),
        reports: context.reports.missed(),
        scans: context.scans.missed(),
        is_together: context.site.is_together(),
    };
    let site = context.site.current().site;
    ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], metrics::text(&frame, &site, losses)).into_response()
}
