//! The page's files, part of the program.

use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};

use super::refuse;

macro_rules! files {
    ($($path:literal => $file:literal, $kind:literal;)*) => {
        &[$(($path, $kind, include_bytes!(concat!("page/", $file)).as_slice())),*]
    };
}

/// Path, kind and bytes.
const FILES: &[(&str, &str, &[u8])] = files! {
    "/" => "index.html", "text/html; charset=utf-8";
    "/style.css" => "style.css", "text/css; charset=utf-8";
    "/main.js" => "main.js", "text/javascript; charset=utf-8";
    "/net.js" => "net.js", "text/javascript; charset=utf-8";
    "/view.js" => "view.js", "text/javascript; charset=utf-8";
    "/draw.js" => "draw.js", "text/javascript; charset=utf-8";
    "/panel.js" => "panel.js", "text/javascript; charset=utf-8";
    "/timeline.js" => "timeline.js", "text/javascript; charset=utf-8";
    "/calibrate.js" => "calibrate.js", "text/javascript; charset=utf-8";
    "/past.js" => "past.js", "text/javascript; charset=utf-8";
    "/edit.js" => "edit.js", "text/javascript; charset=utf-8";
    "/shapes.js" => "shapes.js", "text/javascript; charset=utf-8";
    "/door.html" => "door.html", "text/html; charset=utf-8";
    "/door.css" => "door.css", "text/css; charset=utf-8";
    "/door.js" => "door.js", "text/javascript; charset=utf-8";
    "/icon.svg" => "icon.svg", "image/svg+xml";
};

/// A file of the page.
pub async fn asset(uri: Uri) -> Response {
    file(uri.path())
}

/// A file of the page, by its path.
pub fn file(asked: &str) -> Response {
    match FILES.iter().find(|(path, ..)| *path == asked) {
        Some((_, kind, bytes)) => ([(header::CONTENT_TYPE, *kind)], *bytes).into_response(),
        None => refuse(StatusCode::NOT_FOUND, &format!("there is nothing at {asked}")),
    }
}
