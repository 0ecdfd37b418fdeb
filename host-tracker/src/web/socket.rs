//! A browser's connection: the newest frame whenever there is one and the browser has taken the one before.
//!
//! ```text
//!   ─▶ {"frame": …}   {"fields": …}   {"site": 4}   {"error": "…"}
//!   ◀─ {"frames": false}    a hidden page asks for nothing
//!   ◀─ {"frames": false, "reports": true}    ─▶ {"report": {"t": 12.34, "module": "left", "sequence": 7, "tracks": […]}}
//! ```
//!
//! The map asks for no reports: ten frames a second are what eyes can follow.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;
use serde_json::json;

use super::answers::refuse;
use super::shared::Shared;
use crate::reports::{Listener, ReportLine};

/// Browsers at once: each costs a task and its buffers.
const SOCKETS_MAX: usize = 64;

/// Longest message from a browser.
const MESSAGE_MAX: usize = 4096;

/// A client that reads nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(20);

/// What a browser may ask for.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    /// Whether frames are wanted.
    frames: bool,
    /// Whether tracks are wanted after each report.
    #[serde(default)]
    reports: bool,
}

/// Opens it.
pub async fn open(
    State(shared): State<Arc<Shared>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    };
    if shared.sockets.fetch_add(1, Ordering::Relaxed) >= SOCKETS_MAX {
        shared.sockets.fetch_sub(1, Ordering::Relaxed);
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "too many browsers look at the map: close one");
    }
    let place = Place(shared);
    upgrade.max_message_size(MESSAGE_MAX).max_frame_size(MESSAGE_MAX).on_upgrade(async move |mut socket| {
        // An error is the browser's leaving.
        let _ = talk(&mut socket, &place.0).await;
    })
}

/// A place among the browsers, given back however the connection ends.
struct Place(Arc<Shared>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.sockets.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The browser is gone.
struct Gone;

async fn talk(socket: &mut WebSocket, shared: &Shared) -> Result<(), Gone> {
    let mut packets = shared.packets.clone();
    let mut site = shared.desk.site.revisions();
    packets.mark_changed();
    site.mark_changed();
    let (mut wanted, mut fields_number) = (true, 0);
    let mut reports = None;
    loop {
        tokio::select! {
            changed = packets.changed(), if wanted => {
                changed.map_err(|_| Gone)?;
                let newest = packets.borrow_and_update().clone();
                if newest.fields_number != fields_number {
                    fields_number = newest.fields_number;
                    send(socket, newest.fields).await?;
                }
                send(socket, newest.frame).await?;
            }
            report = next(&mut reports) => {
                send(socket, json!({ "report": *report }).to_string().into()).await?;
            }
            changed = site.changed() => {
                changed.map_err(|_| Gone)?;
                let revision = *site.borrow_and_update();
                send(socket, json!({ "site": revision }).to_string().into()).await?;
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => match serde_json::from_str::<Wish>(&text) {
                    Ok(wish) => {
                        wanted = wish.frames;
                        reports = wish.reports.then(|| reports.unwrap_or_else(|| shared.desk.reports.listen()));
                    }
                    Err(error) => complain(socket, &error.to_string()).await?,
                },
                Some(Ok(Message::Binary(_))) => complain(socket, "binary messages mean nothing here").await?,
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Gone),
            },
        }
    }
}

/// The next report; for ever none, if none are wanted or there are no more.
async fn next(reports: &mut Option<Listener>) -> Arc<ReportLine> {
    if let Some(listener) = reports
        && let Some(report) = listener.next().await
    {
        return report;
    }
    std::future::pending().await
}

async fn complain(socket: &mut WebSocket, what: &str) -> Result<(), Gone> {
    let understood = r#"understood: {"frames": true} or false, and "reports" likewise"#;
    let text = json!({ "error": format!("{what}; {understood}") });
    send(socket, text.to_string().into()).await
}

async fn send(socket: &mut WebSocket, text: Utf8Bytes) -> Result<(), Gone> {
    if text.is_empty() {
        return Ok(());
    }
    match tokio::time::timeout(PATIENCE, socket.send(Message::Text(text))).await {
        Ok(Ok(())) => Ok(()),
        _ => Err(Gone),
    }
}
