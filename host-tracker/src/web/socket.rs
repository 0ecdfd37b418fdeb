//! A browser's connection: the newest frame whenever there is one and the browser has taken the one before.
//!
//! ```text
//!   ─▶ {"frame": …}   {"fields": …}   {"site": 4}   {"error": "…"}
//!   ─▶ {"alarms": […]}      those that stand, once and whenever they are others: also to a hidden page
//!   ─▶ ping, each 20 s      ◀─ pong: a client that reads nothing does not answer, and is gone
//!   ◀─ {"frames": false}    a hidden page asks for nothing, and for a frame now and then as a sign of life
//!   ◀─ {"frames": false, "reports": true}    ─▶ {"report": {"t": 12.34, "module": "left", "sequence": 7, "tracks": […]}}
//! ```
//!   ◀─ {"frames": true, "editing": true}     ─▶ {"editors": [{"name": "anna"}, {"name": null}]}    who else has the editor open
//!
//! It ends with the session or the token by which it was opened. The map asks for no reports: ten frames a second are what eyes can follow.

use std::sync::Arc;

use axum::Extension;
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use tokio::time::{Instant, MissedTickBehavior, interval_at};

use super::answers::refuse;
use super::bodies::{ToClient, Wish};
use super::editors::{Editing, OtherEditor};
use super::listener::{Ends, is_unread};
use super::session;
use super::shared::Shared;
use crate::access::Credential;
use crate::access::roles::Action;
use crate::connections::Cause;
use crate::reports::{Listener, ReportLine};

/// Longest message from a browser.
const MESSAGE_MAX: usize = 4096;

/// Opens it.
pub async fn open(
    State(shared): State<Arc<Shared>>,
    Extension(ends): Extension<Ends>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    };
    let place = match shared.browsers.reserve(ends.peer) {
        Ok(place) => place,
        Err(why) => {
            shared.context.connections.count(why.into());
            return refuse(StatusCode::SERVICE_UNAVAILABLE, &why.to_string());
        }
    };
    let credential = session::credential(&headers, ends.line);
    upgrade.max_message_size(MESSAGE_MAX).max_frame_size(MESSAGE_MAX).on_upgrade(async move |mut socket| {
        let gone = talk(&mut socket, &shared, &credential).await;
        // Its places are free before it is counted.
        drop((socket, place, ends));
        if matches!(gone, Err(Gone::Silent)) {
            shared.context.connections.count(Cause::Unread);
        }
    })
}

/// The browser is gone.
enum Gone {
    /// It has left.
    Left,
    /// It does not take what it is sent, or answers no ping.
    Silent,
}

async fn talk(socket: &mut WebSocket, shared: &Shared, credential: &Credential) -> Result<(), Gone> {
    let mut packets = shared.packets.clone();
    let mut site = shared.context.site.revisions();
    let mut alarms = shared.alarms.clone();
    packets.mark_changed();
    alarms.mark_changed();
    site.mark_changed();
    let (mut wanted, mut fields_number) = (true, 0);
    let mut reports = None;
    let mut editing = None;
    let every = shared.limits.ping;
    let mut pings = interval_at(Instant::now() + every, every);
    // After a sleep of the host a client gets a whole interval again.
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut answered = true;
    // A session that is over, and a token that was taken back, end here, too.
    while shared.context.access.who(credential).may(Action::Look, None) {
        tokio::select! {
            changed = packets.changed(), if wanted => {
                changed.map_err(|_| Gone::Left)?;
                let newest = packets.borrow_and_update().clone();
                if newest.fields_number != fields_number {
                    fields_number = newest.fields_number;
                    send(socket, newest.fields).await?;
                }
                send(socket, newest.frame).await?;
            }
            report = next(&mut reports) => {
                send(socket, text(&ToClient::Report(&report))).await?;
            }
            others = others(&mut editing) => {
                send(socket, text(&ToClient::Editors(others))).await?;
            }
            changed = site.changed() => {
                changed.map_err(|_| Gone::Left)?;
                let revision = *site.borrow_and_update();
                send(socket, text(&ToClient::Site(revision))).await?;
            }
            changed = alarms.changed() => {
                changed.map_err(|_| Gone::Left)?;
                let standing = alarms.borrow_and_update().clone();
                send(socket, standing).await?;
            }
            _ = pings.tick() => {
                if !std::mem::take(&mut answered) {
                    return Err(Gone::Silent);
                }
                sent(socket.send(Message::Ping(Bytes::new())).await)?;
            }
            message = socket.recv() => {
                answered = true;
                match message {
                Some(Ok(Message::Text(text))) => match serde_json::from_str::<Wish>(&text) {
                    Ok(wish) => {
                        wanted = wish.frames;
                        reports = wish.reports.then(|| reports.unwrap_or_else(|| shared.context.reports.listen()));
                        // A client that may only look is not told who works here.
                        let who = shared.context.access.who(credential);
                        let edits = wish.editing && who.may(Action::ChangeSite, None);
                        editing = edits.then(|| editing.unwrap_or_else(|| shared.editors.open(&who)));
                    }
                    Err(error) => complain(socket, &error.to_string()).await?,
                },
                Some(Ok(Message::Binary(_))) => complain(socket, "binary messages mean nothing here").await?,
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Gone::Left),
                }
            }
        }
    }
    Err(Gone::Left)
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

/// Which other users have the editor open, each time that changes; waits for ever if it is not open here.
async fn others(editing: &mut Option<Editing>) -> Vec<OtherEditor> {
    match editing {
        Some(editing) => editing.others().await,
        None => std::future::pending().await,
    }
}

async fn complain(socket: &mut WebSocket, what: &str) -> Result<(), Gone> {
    let understood = r#"understood: {"frames": true} or false, and "reports", "editing" likewise"#;
    send(socket, text(&ToClient::Error(format!("{what}; {understood}")))).await
}

/// A message as it is sent. Nothing in one can fail to be written.
pub(super) fn text(message: &ToClient<'_>) -> Utf8Bytes {
    serde_json::to_string(message).unwrap_or_default().into()
}

async fn send(socket: &mut WebSocket, text: Utf8Bytes) -> Result<(), Gone> {
    if text.is_empty() {
        return Ok(());
    }
    sent(socket.send(Message::Text(text)).await)
}

fn sent(result: Result<(), axum::Error>) -> Result<(), Gone> {
    result.map_err(|error| if is_unread(&error) { Gone::Silent } else { Gone::Left })
}
