//! The documents that describe this server: `schema` makes them.
//!
//! ```text
//!   GET /api/openapi.json    every request
//!   GET /api/asyncapi.json   the WebSocket, and every topic of MQTT
//! ```
//!
//! Both are the same for all sites; they are made once, at the first request.

use std::sync::LazyLock;

use axum::http::header;
use axum::response::{IntoResponse, Response};

use crate::schema;

static OPENAPI: LazyLock<String> = LazyLock::new(|| schema::openapi().to_string());
static ASYNCAPI: LazyLock<String> = LazyLock::new(|| schema::asyncapi().to_string());

/// Of every request.
pub async fn openapi() -> Response {
    json(&OPENAPI)
}

/// Of the WebSocket and MQTT.
pub async fn asyncapi() -> Response {
    json(&ASYNCAPI)
}

fn json(text: &'static str) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}
