//! The list of alarms, and who has seen which.
//!
//! ```text
//!   GET  /api/alarms             ─▶ {"unix_ms": …, "standing": [{"id": 7, "source": "module", "of": "left", "name": "dirty",
//!                                    "severity": "degraded", "text": "…", "since_ms": …}], "ended": […, "until_ms": …], "missed": 0, "webhook": {"sent": 3, "failed": 0}}
//!   POST /api/alarms/acknowledge ◀─ {"ids": [7]}
//!                                ─▶ {"acknowledged": […]}: those that were not acknowledged before
//!                                   or 400 (malformed), 403 (on the map of its area), 404 (no such alarm), 409 (it is over): then none
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
use super::bodies::{AlarmsAcknowledged, AlarmsListed};
use super::shared::Shared;
use crate::access::Who;
use kehai_tracking::alarm_list::NotAcknowledged;
use kehai_tracking::snapshot::unix_ms;

/// Alarms that a user has seen.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "AlarmsSeen")]
pub struct Seen {
    /// Their numbers.
    ids: Vec<u64>,
}

/// Those that stand, and those that ended within the last day.
pub async fn list(State(shared): State<Arc<Shared>>) -> Response {
    let listed = &shared.context.listed;
    Json(AlarmsListed {
        unix_ms: unix_ms(),
        standing: listed.standing(),
        ended: listed.ended(),
        missed: listed.missed(),
        webhook: listed.told(),
    })
    .into_response()
}

/// Acknowledges some alarms.
pub async fn acknowledge(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    seen: Result<Json<Seen>, JsonRejection>,
) -> Response {
    let Seen { ids } = match seen {
        Ok(Json(seen)) => seen,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    };
    match shared.context.listed.acknowledge(&ids, &who.to_string()) {
        Ok(acknowledged) => Json(AlarmsAcknowledged { acknowledged }).into_response(),
        Err(why) => {
            let status = match why {
                NotAcknowledged::Unknown(_) => StatusCode::NOT_FOUND,
                NotAcknowledged::Over { .. } => StatusCode::CONFLICT,
                NotAcknowledged::Elsewhere { .. } => StatusCode::FORBIDDEN,
            };
            refuse(status, &why.to_string())
        }
    }
}
