//! Doors over HTTP: how they are, and messages to them.
//!
//! ```text
//!   GET  /api/door             every door
//!   GET  /api/door/NAME        one; its unix_ms is this machine's time, for the stamps of messages
//!   POST /api/door/NAME/INPUT  card │ number │ contact │ exit │ reset │ lock/ready │ lock/taken │ alarm/taken
//!        ◀─ {"id": 17, "at_ms": …, "number": 3}      as `door::inbox` says
//!        ─▶ {}, after lock/ready the lock's order, or 400 (malformed), 401 and 403 (not by this token), 404 (no such door or input), 409 (late, repeated, out of order, not now)
//!   GET  /door/NAME            the screen for the entrant
//! ```
//!
//! Whose card was shown is told to clients alone that may look at the map: the token of a device at the door sees
//! neither names nor cards.
//!
//! As everything that writes: refused to pages of others (`guard`), and to whom `access::roles` does not let; but for `exit`,
//! which is taken from everybody, and said in the log if it came without a token.

use std::sync::Arc;
use std::time::Instant;

use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};

use super::answers::refuse;
use super::bodies::Done;
use super::listener::Ends;
use super::page;
use super::shared::Shared;
use crate::access::Who;
use crate::access::roles::Action;
use crate::doors::DoorHandle;
use kehai_tracking::door::doors::{DoorState, Why};
use kehai_tracking::door::inbox::{Input, NotTaken};

const NO_DOORS: &str = "the site has no doors";

/// Every door.
pub async fn all(State(shared): State<Arc<Shared>>, Extension(who): Extension<Who>) -> Response {
    Json(states(&shared, &who)).into_response()
}

/// One door.
pub async fn one(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    Path(name): Path<String>,
) -> Response {
    match states(&shared, &who).iter().find(|state| state.line.name == name) {
        Some(state) => Json(state).into_response(),
        None => refuse(StatusCode::NOT_FOUND, &Why::NoDoor(name).to_string()),
    }
}

/// The doors, without cards for a client that may not look at the map.
fn states(shared: &Shared, who: &Who) -> Vec<DoorState> {
    let mut states = shared.context.doors.as_ref().map(DoorHandle::states).unwrap_or_default();
    for state in &mut states {
        if who.may(Action::Look, Some(&state.line.name)) {
            continue;
        }
        state.line.names.clear();
        state.passages.iter_mut().for_each(|passed| passed.passage.card = None);
    }
    states
}

/// A message to a door.
pub async fn tell(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    Extension(ends): Extension<Ends>,
    Path((name, input)): Path<(String, String)>,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    // The operator who looks after an alarm resets it on the map. No device at a door sends a reset.
    let known = Input::named(&input);
    if let Some(at) = shared.doors_at.as_ref().filter(|_| known != Some(Input::Reset)) {
        return misdirected(at);
    }
    let Some(doors) = &shared.context.doors else { return refuse(StatusCode::NOT_FOUND, NO_DOORS) };
    let Some(input) = known else {
        let names = Input::NAMED.map(|(_, name)| name).join(", ");
        return refuse(StatusCode::NOT_FOUND, &format!("a door takes {names}"));
    };
    let body = match body {
        Ok(body) => body,
        // The way out needs none.
        Err(_) if input == Input::Exit => Bytes::new(),
        Err(_) => return refuse(StatusCode::BAD_REQUEST, "the message was cut off or is too long"),
    };
    let told = doors.tell(&name, input, &body);
    if input == Input::Exit && told.is_ok() && who == Who::Nobody {
        let unsaid = shared.exits.lock().note(Instant::now());
        if let Some(times) = unsaid {
            tracing::warn!(
                "door {name}: exit without a token, from {}; {times} since the last line",
                ends.peer
            );
        }
    }
    match told {
        // A lock that says it is ready is answered with its order.
        Ok(Some(order)) if input == Input::LockReady => Json(order).into_response(),
        Ok(_) => Json(Done {}).into_response(),
        Err(why) => {
            let status = match why {
                Why::NoDoor(_) => StatusCode::NOT_FOUND,
                Why::NotTaken(NotTaken::Malformed(_)) => StatusCode::BAD_REQUEST,
                Why::NotTaken(_) | Why::Refused(_) => StatusCode::CONFLICT,
            };
            refuse(status, &why.to_string())
        }
    }
}

/// The screen for the entrant; which door it is for, the page reads from its own address.
pub async fn screen(State(shared): State<Arc<Shared>>, headers: HeaderMap) -> Response {
    match &shared.doors_at {
        Some(at) => misdirected(at),
        None => page::file("/door.html", &headers),
    }
}

fn misdirected(at: &str) -> Response {
    let why = format!("this door takes messages at --door-http alone: {at}");
    refuse(StatusCode::MISDIRECTED_REQUEST, &why)
}
