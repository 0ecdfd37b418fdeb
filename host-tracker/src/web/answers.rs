//! Headers of requests, and answers that refuse them.

use axum::Json;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::bodies::Refusal;

/// Longest body of a request: a site of some ten thousand corners.
pub(super) const BODY_MAX: usize = 1 << 20;

pub(super) fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    // A value that is no text is no address.
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

/// An answer that says why not.
pub(super) fn refuse(status: StatusCode, why: &str) -> Response {
    (status, Json(Refusal { error: why.to_owned() })).into_response()
}
