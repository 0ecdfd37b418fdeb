//! The page's files, part of the program.
//!
//! ```text
//!   first asked for ─▶ each file compressed once, at most once in the life of the program
//!
//!   Accept-Encoding: gzip   ─▶ Content-Encoding: gzip, a third of the bytes     ETag: what its SHA-256 begins with
//!   If-None-Match: the tag  ─▶ 304, without the bytes                          Cache-Control: no-cache, ask each time
//! ```
//!
//! A browser keeps what it has and asks each time whether that is still it: another version of the tracker is seen at once.
//! Only these files are compressed. They are the same for all clients and repeat nothing that was asked, so their length
//! reveals nothing (BREACH: Gluck, Harris and Prado, 2013); answers of the API may hold what is not for all.

use std::io::Write;
use std::sync::LazyLock;

use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use data_encoding::HEXLOWER;
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};

use super::answers::{refuse, text};

macro_rules! files {
    ($($file:literal)*) => {
        &[$(($file, include_bytes!(concat!("page/", $file)).as_slice())),*]
    };
}

/// Name and bytes; `/` is `index.html`.
const FILES: &[(&str, &[u8])] = files! {
    "index.html" "style.css" "map.css" "lines.css" "overlay.css" "panel.css" "timeline.css" "edit.css" "calibrate.css" "tray.css"
    "main.js" "alarms.css" "alarms.js" "bell.js" "doors.css" "doors.js" "module-actions.css" "module-actions.js" "motion.js" "names.js" "net.js" "view.js" "draw.js" "panel.js" "details.js" "timeline.js" "past.js" "look-back.js" "shapes.js" "site-file.js" "words.js" "words-en.js" "words-de.js" "words-ja.js" "alarm-words.js" "why-words.js" "lines.js" "labels.js"
    "where.js" "why.css" "why.js" "more.js" "heat.css" "heat.js" "charts.js" "plan-picture.js" "paper.js" "firmware.html" "firmware.js" "report.html" "report.css" "report.js" "handover.html" "handover.js" "acceptance.js"
    "edit.js" "edit-check.js" "edit-door.js" "edit-draft.js" "edit-fields.js" "edit-form.js" "edit-keys.js" "edit-lengths.js" "edit-merge.js" "edit-pointer.js" "edit-shapes.js" "edit-together.js" "edit-typing.js" "calibrate.js"
    "clock.js" "focus.js" "next.js" "notice.js" "showing.js" "spoken.js" "tray.js" "survey.js" "picture.js" "picture-place.js"
    "who.js" "login.html" "login.css" "login.js" "door.html" "door.css" "door.js" "door-part.js" "icon.svg"
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

/// A file as it is sent.
struct Asset {
    name: &'static str,
    plain: &'static [u8],
    /// Shorter, if it can be.
    gzip: Option<Vec<u8>>,
    /// Names these bytes: `W/"…"`, of both of their forms.
    tag: HeaderValue,
}

static ASSETS: LazyLock<Vec<Asset>> = LazyLock::new(|| FILES.iter().map(asset_of).collect());

/// So many of the 32 bytes of a sum name the file: by chance two files never have the same.
const TAG_BYTES: usize = 12;

fn asset_of(&(name, plain): &(&'static str, &'static [u8])) -> Asset {
    let sum = HEXLOWER.encode(Sha256::digest(plain).get(..TAG_BYTES).unwrap_or_default());
    let tag = HeaderValue::try_from(format!("W/\"{sum}\"")).unwrap_or(HeaderValue::from_static(""));
    let gzip = compressed(plain).filter(|gzip| gzip.len() < plain.len());
    Asset { name, plain, gzip, tag }
}

fn compressed(plain: &[u8]) -> Option<Vec<u8>> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(plain).ok()?;
    gzip.finish().ok()
}

/// A file of the page.
pub async fn asset(uri: Uri, headers: HeaderMap) -> Response {
    file(uri.path(), &headers)
}

/// A file of the page, by its path, as a request with these headers takes it.
pub fn file(asked: &str, headers: &HeaderMap) -> Response {
    let name = match asked.strip_prefix('/') {
        Some("") => "index.html",
        Some("report") => "report.html",
        Some("firmware") => "firmware.html",
        Some("handover") => "handover.html",
        Some(name) => name,
        None => asked,
    };
    let Some(asset) = ASSETS.iter().find(|asset| asset.name == name) else {
        return refuse(StatusCode::NOT_FOUND, &format!("there is nothing at {asked}"));
    };
    let kept =
        [(header::ETAG, asset.tag.clone()), (header::VARY, HeaderValue::from_static("Accept-Encoding"))];
    if text(headers, header::IF_NONE_MATCH).is_some_and(|known| names(known, &asset.tag)) {
        return (StatusCode::NOT_MODIFIED, kept).into_response();
    }
    let kind = [(header::CONTENT_TYPE, media_type(name))];
    match &asset.gzip {
        Some(gzip) if text(headers, header::ACCEPT_ENCODING).is_some_and(takes_gzip) => {
            (kept, kind, [(header::CONTENT_ENCODING, "gzip")], gzip.as_slice()).into_response()
        }
        _ => (kept, kind, asset.plain).into_response(),
    }
}

/// Whether `If-None-Match` names this tag, as RFC 9110, 13.1.2 has it: weak or not.
fn names(known: &str, tag: &HeaderValue) -> bool {
    let opaque = |tag: &str| tag.trim().trim_start_matches("W/").to_owned();
    let own = opaque(tag.to_str().unwrap_or_default());
    known.trim() == "*" || known.split(',').any(|one| opaque(one) == own)
}

/// Whether `Accept-Encoding` takes gzip: RFC 9110, 12.5.3. A weight of 0 is a no.
fn takes_gzip(accepted: &str) -> bool {
    let weight = |one: &str| {
        let (coding, parameters) = one.split_once(';').unwrap_or((one, ""));
        let weight =
            parameters.trim().strip_prefix("q=").map_or(Some(1.0), |weight| weight.trim().parse().ok());
        (coding.trim().to_ascii_lowercase(), weight.unwrap_or(0.0_f64))
    };
    let all: Vec<(String, f64)> = accepted.split(',').map(weight).collect();
    let of = |wanted: &str| all.iter().find(|(coding, _)| coding == wanted).map(|(_, weight)| *weight);
    of("gzip").or_else(|| of("*")).is_some_and(|weight| weight > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_is_sent_only_to_clients_that_accept_it() {
        for yes in ["gzip", "deflate, gzip, br", "GZIP;q=0.5", "br;q=1, *;q=0.1", "gzip; q=1.0", "*"] {
            assert!(takes_gzip(yes), "{yes}");
        }
        for no in ["", "br", "gzip;q=0", "gzip; q=0.000", "*;q=0", "gzip;q=0, *", "gzip;q=x", "xgzip", "?"] {
            assert!(!takes_gzip(no), "{no}");
        }
    }

    #[test]
    fn a_tag_is_known_weak_or_not_among_others() {
        let tag = HeaderValue::from_static("W/\"ab12\"");
        for yes in ["W/\"ab12\"", "\"ab12\"", "\"x\", W/\"ab12\"", "*"] {
            assert!(names(yes, &tag), "{yes}");
        }
        for no in ["", "ab12", "W/\"ab1\"", "\"x\"", "?"] {
            assert!(!names(no, &tag), "{no}");
        }
    }
}
