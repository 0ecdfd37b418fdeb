//! Log-in and log-out, and who a request is from.
//!
//! ```text
//!   GET    /api/session ─▶ {"needed": true, "name": "anna", "role": "edit", "may": ["look", "edit"], "version": "0.1.0"}
//!   POST   /api/session ◀─ {"name": "anna", "password": "…"}
//!                       ─▶ the same, and a cookie; 401 (wrong), 409 (no user can log in), 429 (too often: Retry-After)
//!   DELETE /api/session ─▶ {}: logged out
//!
//!   Cookie: kehai-session=…              browsers: HttpOnly, SameSite=Strict, 12 h
//!   Authorization: Bearer kehai_…        programs and devices
//! ```

use std::sync::Arc;

use axum::extract::State;
use axum::extract::rejection::JsonRejection;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::Deserialize;

use super::answers::refuse;
use super::blocking::in_turn;
use super::bodies::{Done, Session};
use super::listener::{Ends, Line};
use super::shared::Shared;
use crate::access::directory::NAME_MAX;
use crate::access::roles::Action;
use crate::access::{Credential, LASTS_S, LogInError, Who};
use crate::connections::Cause;
use kehai_tracking::door::inbox::Input;
use kehai_tracking::text::printable;

/// Name of the cookie. Over TLS a browser takes one of that name over TLS alone (RFC 6265bis, 4.1.3.2), so that a server that
/// answers in clear for this host cannot set another.
const fn cookie_name(line: Line) -> &'static str {
    match line {
        Line::Tls => "__Host-kehai-session",
        Line::Clear | Line::Missed => "kehai-session",
    }
}

/// What the page hides from whom may not do it, by its name there.
const SHOWN: [(&str, Action); 6] = [
    ("look", Action::Look),
    ("edit", Action::ChangeSite),
    ("edit-doors", Action::ChangeGuardedSite),
    ("modules", Action::AskModule),
    ("acknowledge", Action::Acknowledge),
    ("reset", Action::Tell(Input::Reset)),
];

/// What a user sends to log in.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogIn {
    /// Their name.
    name: String,
    /// Their password.
    password: String,
}

/// What a request shows of who it is from: a token before a session.
pub fn credential(headers: &HeaderMap, line: Line) -> Credential {
    let authorization = headers.get(header::AUTHORIZATION).map(|shown| shown.to_str().unwrap_or_default());
    Credential::of(authorization, cookies(headers), cookie_name(line))
}

fn cookies(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    headers.get_all(header::COOKIE).into_iter().filter_map(|value| value.to_str().ok())
}

/// Who asks.
pub async fn show(State(shared): State<Arc<Shared>>, Extension(who): Extension<Who>) -> Response {
    Json(as_json(&shared, &who)).into_response()
}

/// Logs a user in.
pub async fn begin(
    State(shared): State<Arc<Shared>>,
    Extension(ends): Extension<Ends>,
    wish: Result<Json<LogIn>, JsonRejection>,
) -> Response {
    let LogIn { name, password } = match wish {
        Ok(Json(wish)) => wish,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.body_text()),
    };
    // One at a time, also of clients that have left: each comparison takes 19 MB and some hundredths of a second.
    let (access, asked) = (shared.context.access.clone(), name.clone());
    let compared = in_turn(&shared.comparing, move |()| access.log_in(ends.peer, &asked, &password)).await;
    let session = compared.unwrap_or(Err(LogInError::Wrong));
    let error = match session {
        Ok(session) => {
            let who = shared.context.access.who(&Credential::Session(session.clone()));
            let cookie = cookie(ends.line, &session, LASTS_S);
            tracing::info!("{who} has logged in from {}", ends.peer);
            return ([(header::SET_COOKIE, cookie)], Json(as_json(&shared, &who))).into_response();
        }
        Err(error) => error,
    };
    let (status, cause) = match error {
        LogInError::Wrong => (StatusCode::UNAUTHORIZED, Some(Cause::Unknown)),
        LogInError::Often(_) => (StatusCode::TOO_MANY_REQUESTS, Some(Cause::Often)),
        LogInError::Open => (StatusCode::CONFLICT, None),
        LogInError::Random => (StatusCode::INTERNAL_SERVER_ERROR, None),
    };
    if let Some(cause) = cause {
        shared.context.connections.count(cause);
    }
    // No more than passwords are compared: a flood of tries does not fill the log.
    if error == LogInError::Wrong {
        tracing::warn!("a wrong password for {}, from {}", as_logged(&name), ends.peer);
    }
    let mut refused = refuse(status, &error.to_string());
    if let LogInError::Often(seconds) = error {
        refused.headers_mut().insert(header::RETRY_AFTER, seconds.into());
    }
    refused
}

/// A name that was tried, as the log says it: no longer than names are. A body may hold one of a megabyte.
fn as_logged(name: &str) -> String {
    let begin: String = name.chars().take(NAME_MAX).collect();
    let cut = if begin.len() < name.len() { "…" } else { "" };
    format!("{}{cut}", printable(&begin))
}

/// Ends the session.
pub async fn end(
    State(shared): State<Arc<Shared>>,
    Extension(ends): Extension<Ends>,
    headers: HeaderMap,
) -> Response {
    let shown = Credential::of(None, cookies(&headers), cookie_name(ends.line));
    if let Credential::Session(session) = shown {
        shared.context.access.log_out(&session);
    }
    ([(header::SET_COOKIE, cookie(ends.line, "", 0))], Json(Done {})).into_response()
}

fn cookie(line: Line, session: &str, lasts_s: u32) -> String {
    let name = cookie_name(line);
    let secure = if line == Line::Tls { "; Secure" } else { "" };
    format!("{name}={session}; Path=/; HttpOnly; SameSite=Strict; Max-Age={lasts_s}{secure}")
}

fn as_json(shared: &Shared, who: &Who) -> Session {
    let (name, role) = match who {
        Who::Anybody | Who::Nobody => (None, None),
        Who::Person { name, role } => (Some(name.clone()), Some(role.name())),
        Who::Program { name, .. } => (Some(name.clone()), None),
    };
    let may = SHOWN.iter().filter(|(_, action)| who.may(*action, None)).map(|(name, _)| *name).collect();
    let version = who.may(Action::Look, None).then_some(env!("CARGO_PKG_VERSION"));
    Session { needed: !shared.context.access.is_open(), name, role, may, version }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(pairs: &[(header::HeaderName, &str)]) -> Credential {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.append(name.clone(), value.parse().unwrap());
        }
        credential(&headers, Line::Clear)
    }

    #[test]
    fn a_token_comes_before_a_session_and_neither_is_taken_for_the_other() {
        let session = |text: &str| Credential::Session(text.into());
        let token = |text: &str| Credential::Token(text.into());
        assert_eq!(shown(&[]), Credential::None);
        assert_eq!(shown(&[(header::COOKIE, "a=b; kehai-session=xyz; c=d")]), session("xyz"));
        assert_eq!(shown(&[(header::COOKIE, "a=b"), (header::COOKIE, "kehai-session=xyz")]), session("xyz"));
        assert_eq!(shown(&[(header::COOKIE, "not-kehai-session=xyz; kehai-session")]), Credential::None);
        let cookie = (header::COOKIE, "kehai-session=xyz");
        assert_eq!(shown(&[cookie.clone(), (header::AUTHORIZATION, "bearer kehai_a")]), token("kehai_a"));
        assert_eq!(shown(&[cookie, (header::AUTHORIZATION, "Basic kehai_a")]), token(""));
    }

    #[test]
    fn a_name_of_a_megabyte_is_a_short_line_of_the_log() {
        assert_eq!(as_logged("anna"), "anna");
        let longest = "ü".repeat(NAME_MAX);
        assert_eq!(as_logged(&longest), longest);
        assert_eq!(as_logged(&"ü".repeat(1 << 20)), format!("{longest}…"));
        assert_eq!(as_logged("a\nb"), "a\u{fffd}b");
    }
}
