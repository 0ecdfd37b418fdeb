//! The page's files, part of the program.

use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};

use super::answers::refuse;

macro_rules! files {
    ($($file:literal)*) => {
        &[$(($file, include_bytes!(concat!("page/", $file)).as_slice())),*]
    };
}

/// Name and bytes; `/` is `index.html`.
const FILES: &[(&str, &[u8])] = files! {
    "index.html" "style.css" "map.css" "lines.css" "overlay.css" "panel.css" "timeline.css" "edit.css" "calibrate.css" "tray.css"
    "main.js" "alarms.css" "alarms.js" "bell.js" "doors.css" "doors.js" "module-actions.css" "module-actions.js" "motion.js" "names.js" "net.js" "view.js" "draw.js" "panel.js" "details.js" "timeline.js" "past.js" "shapes.js" "site-file.js" "words.js" "words-en.js" "words-de.js" "words-ja.js" "alarm-words.js" "why-words.js" "lines.js"
    "where.js" "why.css" "why.js" "more.js" "heat.css" "heat.js" "charts.js" "plan-picture.js" "paper.js" "report.html" "report.css" "report.js" "handover.html" "handover.js" "acceptance.js"
    "edit.js" "edit-check.js" "edit-draft.js" "edit-form.js" "edit-keys.js" "edit-lengths.js" "edit-merge.js" "edit-pointer.js" "edit-shapes.js" "edit-together.js" "calibrate.js"
    "next.js" "tray.js" "survey.js" "picture.js" "picture-place.js"
    "who.js" "login.html" "login.css" "login.js" "door.html" "door.css" "door.js" "icon.svg"
};

/// Media type of a file, by its ending.
fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "html")) => "text/html; charset=utf-8",
        Some((_, "css")) => "text/css; charset=utf-8",
        Some((_, "js")) => "text/javascript; charset=utf-8",
        Some((_, "svg")) => "image/svg+xml",
        _ => "application/octet-stream",
    }
}

/// A file of the page.
pub async fn asset(uri: Uri) -> Response {
    file(uri.path())
}

/// A file of the page, by its path.
pub fn file(asked: &str) -> Response {
    let name = match asked.strip_prefix('/') {
        Some("") => "index.html",
        Some("report") => "report.html",
        Some("handover") => "handover.html",
        Some(name) => name,
        None => asked,
    };
    match FILES.iter().find(|(file, _)| *file == name) {
        Some((_, bytes)) => ([(header::CONTENT_TYPE, media_type(name))], *bytes).into_response(),
        None => refuse(StatusCode::NOT_FOUND, &format!("there is nothing at {asked}")),
    }
}
