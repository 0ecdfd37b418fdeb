//! The documents that describe this server: `schema` makes them.
//!
//! ```text
//!   GET /api/openapi.json    every request
//!   GET /api/asyncapi.json   the WebSocket, and every topic of MQTT
//! ```

use std::sync::LazyLock;

use axum::Extension;
use axum::http::header;
use axum::response::{IntoResponse, Response};

/// Both documents. They are the same for all sites, and made once, at the first request.
///
/// The router hands them over: the first is made of the table of operations, which names the handlers below.
#[derive(Debug)]
pub struct Documents {
    /// Of every request.
    pub openapi: LazyLock<String>,
    /// Of the WebSocket and MQTT.
    pub asyncapi: LazyLock<String>,
}

/// Of every request.
pub async fn openapi(Extension(documents): Extension<&'static Documents>) -> Response {
    json(&documents.openapi)
}

/// Of the WebSocket and MQTT.
pub async fn asyncapi(Extension(documents): Extension<&'static Documents>) -> Response {
    json(&documents.asyncapi)
}

fn json(text: &'static str) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}
