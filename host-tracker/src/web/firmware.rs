//! Firmware for new boards: the files that lie on the tracker's machine.
//!
//! ```text
//!   GET /api/firmware        ─▶ {"files": [{"board": …, "purpose": "drive", "name": …, "bytes": …}], …}
//!   GET /api/firmware/{name} ─▶ the file, for the browser to save
//! ```

use std::io;
use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::answers::refuse;
use super::shared::Shared;
use crate::firmware::folder::FirmwareFolder;

/// Which files there are.
pub async fn list(State(shared): State<Arc<Shared>>) -> Response {
    read(&shared, FirmwareFolder::list)
        .await
        .map_or_else(|refusal| refusal, |files| Json(files).into_response())
}

/// One of them.
pub async fn file(State(shared): State<Arc<Shared>>, Path(name): Path<String>) -> Response {
    let asked = name.clone();
    match read(&shared, move |folder| folder.read(&asked)).await {
        Ok(Some(bytes)) => {
            let save = format!("attachment; filename=\"{name}\"");
            let kind = "application/octet-stream".to_owned();
            ([(header::CONTENT_TYPE, kind), (header::CONTENT_DISPOSITION, save)], bytes).into_response()
        }
        Ok(None) => refuse(StatusCode::NOT_FOUND, &format!("there is no firmware file {name}")),
        Err(refusal) => refusal,
    }
}

/// Reads from the folder, on a thread of its own: a disk may be slow.
async fn read<T: Send + 'static>(
    shared: &Shared,
    what: impl FnOnce(&FirmwareFolder) -> io::Result<T> + Send + 'static,
) -> Result<T, Response> {
    let folder = shared.context.firmware.clone();
    let place = folder.path().display().to_string();
    let found =
        tokio::task::spawn_blocking(move || what(&folder)).await.unwrap_or_else(|error| Err(error.into()));
    found.map_err(|error| refuse(StatusCode::INTERNAL_SERVER_ERROR, &format!("{place}: {error}")))
}
