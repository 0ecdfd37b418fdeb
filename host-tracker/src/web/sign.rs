//! Signs over HTTP, and the question where an ID is.
//!
//! ```text
//!   POST /api/sign         ◀─ {"id": "04A22B…", "reader": "hall"}     as `names::message` says
//!                          ─▶ {}, or 400 (malformed, no place), 404 (no such reader), 409 (late, nothing tracked), 503 (too many IDs)
//!   GET  /api/where?id=…   ─▶ {"label": "a11ce000", "heard_s": 0.3, "tracks": […], "at": [1.2, 3.4], "zones": ["hall"], …}
//!                             or 404: it was not read within the last hour
//! ```
//!
//! As everything that writes: refused to pages of others (`guard`).

use std::sync::Arc;

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{RawQuery, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use percent_encoding::percent_decode_str;

use super::answers::refuse;
use super::bodies::Done;
use super::shared::Shared;
use kehai_tracking::names::NotTaken;

const NO_SIGNS: &str = "this tracker follows no IDs";

/// A sign.
pub async fn tell(State(shared): State<Arc<Shared>>, body: Result<Bytes, BytesRejection>) -> Response {
    let Some(signs) = &shared.context.signs else { return refuse(StatusCode::NOT_FOUND, NO_SIGNS) };
    let Ok(body) = body else {
        return refuse(StatusCode::BAD_REQUEST, "the message was cut off or is too long");
    };
    match signs.tell(&body) {
        Ok(()) => Json(Done {}).into_response(),
        Err(why) => refuse(status(&why), &why.to_string()),
    }
}

/// Where an ID is.
pub async fn ask(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    let Some(signs) = &shared.context.signs else { return refuse(StatusCode::NOT_FOUND, NO_SIGNS) };
    let query = query.unwrap_or_default();
    let asked = query.strip_prefix("id=").filter(|rest| !rest.contains('&'));
    let id = asked.and_then(|asked| percent_decode_str(asked).decode_utf8().ok());
    let Some(id) = id else {
        return refuse(StatusCode::BAD_REQUEST, "ask for /api/where?id=…, and nothing else");
    };
    match signs.where_is(&id) {
        Ok(Some(there)) => Json(there).into_response(),
        Ok(None) => refuse(StatusCode::NOT_FOUND, "this ID was not read within the last hour"),
        Err(why) => refuse(status(&why), &why.to_string()),
    }
}

const fn status(why: &NotTaken) -> StatusCode {
    match why {
        NotTaken::Malformed(_) | NotTaken::NoPlace(_) => StatusCode::BAD_REQUEST,
        NotTaken::NoReader(_) => StatusCode::NOT_FOUND,
        NotTaken::Late(_) | NotTaken::Ahead(_) | NotTaken::Untracked => StatusCode::CONFLICT,
        NotTaken::Full => StatusCode::SERVICE_UNAVAILABLE,
    }
}
