//! Which request goes where, and what all of them go through.
//!
//! ```text
//!   request ─▶ guard: from here? ─▶ who? ─▶ may it? ─▶ body in time? ─▶ route ─▶ answer ─▶ headers that make browsers careful
//!                 └─ 400, 403         └─ 401    └─ 403
//! ```

use std::sync::Arc;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, MatchedPath, Path, RawPathParams, Request, State};
use axum::http::request::Parts;
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, get, post, put};
use axum::{Extension, Json, RequestPartsExt, Router};
use kehai_tracking::door::inbox::{self, Input};
use kehai_tracking::names::message;

use super::answers::{BODY_MAX, refuse, text};
use super::listener::{Ends, Line};
use super::rights::{Needed, is_taken_in_clear, needed};
use super::shared::Shared;
use super::{
    alarms, calibration, coverage, documents, door, explain, firmware, guard, heat, module, page, past,
    picture, session, sign, site, socket, survey,
};
use crate::access::Who;
use crate::connections::Cause;
use crate::picture::LONGEST;

/// What the page may load and which server it may ask: this one alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// A tracker that makes no frame for so long does not go on.
const HEALTHY: Duration = Duration::from_secs(1);

/// The map; messages to doors, too, unless they are taken at another address.
pub fn map(doors_at: Option<String>) -> Router<Arc<Shared>> {
    let map = Router::new()
        .route("/ws", get(socket::open))
        .route("/api/site", get(site::show).put(site::change))
        .route("/api/site/try", post(site::attempt))
        .route("/api/alarms", get(alarms::list))
        .route("/api/alarms/acknowledge", post(alarms::acknowledge))
        .route("/api/state", get(state))
        .route("/api/history", get(history))
        .route("/api/overview", get(past::glance))
        .route("/api/past", get(past::paths))
        .route("/api/figures", get(past::binned))
        .route("/api/openapi.json", get(documents::openapi))
        .route("/api/asyncapi.json", get(documents::asyncapi))
        .route("/api/where", get(sign::ask))
        .route("/api/explain", get(explain::why))
        .route("/api/heat", get(heat::map))
        .route("/api/coverage", get(coverage::show))
        .route("/api/calibration", get(calibration::show).post(calibration::change))
        .route("/api/picture/place", get(picture::place).put(picture::lay))
        .route("/api/picture", kept_picture())
        .route("/api/firmware", get(firmware::list))
        .route("/api/firmware/{name}", get(firmware::file))
        .route("/api/survey", get(survey::show))
        .route("/api/module/{name}", get(module::show))
        .route("/api/module/{name}/things", get(module::seen))
        .route("/api/module/{name}/{action}", post(module::act))
        .route("/api/session", get(session::show).post(session::begin).delete(session::end))
        .route("/metrics", get(metrics))
        .route("/healthz", get(healthz));
    let Some(at) = doors_at else { return map.merge(doors()) };
    let map = map.merge(signs());
    let why = format!("this door takes messages at --door-http alone: {at}");
    let screen_why = why.clone();
    // The operator who looks after an alarm resets it on the map. No device at a door sends a reset.
    let tell =
        async move |state, who, ends, Path((name, input)): Path<(String, String)>, body| match Input::named(
            &input,
        ) {
            Some(Input::Reset) => door::tell(state, who, ends, Path((name, input)), body).await,
            _ => refuse(StatusCode::MISDIRECTED_REQUEST, &why),
        };
    map.route("/api/door", get(door::all))
        .route("/api/door/{name}", get(door::one))
        .route("/api/door/{name}/{*input}", post(tell).layer(DefaultBodyLimit::max(inbox::LONGEST)))
        .route("/door/{name}", get(async move || refuse(StatusCode::MISDIRECTED_REQUEST, &screen_why)))
}

/// The picture under the map, which may be longer than all else that is sent.
fn kept_picture() -> MethodRouter<Arc<Shared>> {
    let change = put(picture::change).layer(DefaultBodyLimit::max(LONGEST));
    change.get(picture::show).delete(picture::remove)
}

/// Where readers of cards and tags tell what they have read: at each listener.
fn signs() -> Router<Arc<Shared>> {
    let tell = post(sign::tell).layer(DefaultBodyLimit::max(message::LONGEST));
    Router::new().route("/api/sign", tell)
}

/// What devices at a door, and the screen beside it, ask for.
pub fn doors() -> Router<Arc<Shared>> {
    let tell = post(door::tell).layer(DefaultBodyLimit::max(inbox::LONGEST));
    Router::new()
        .route("/api/door", get(door::all))
        .route("/api/door/{name}", get(door::one))
        .route("/api/door/{name}/{*input}", tell)
        .route("/door/{name}", get(door::screen))
        .merge(signs())
}

/// With what every request goes through.
pub fn finished(router: Router<Arc<Shared>>, shared: &Arc<Shared>) -> Router {
    router
        .fallback(page::asset)
        .method_not_allowed_fallback(not_so)
        .layer(DefaultBodyLimit::max(BODY_MAX))
        .layer(middleware::from_fn_with_state(Arc::clone(shared), guarded))
        .with_state(Arc::clone(shared))
}

/// Lets requests pass that may ask, and tells browsers to be as careful.
async fn guarded(
    State(shared): State<Arc<Shared>>,
    Extension(ends): Extension<Ends>,
    request: Request,
    next: Next,
) -> Response {
    let counts = &shared.context.connections;
    let asks = guard::Asks {
        own: ends.own,
        host: match request.headers().get_all(header::HOST).iter().count() {
            0 | 1 => text(request.headers(), header::HOST).map_or(guard::Host::None, guard::Host::One),
            _ => guard::Host::Several,
        },
        origin: text(request.headers(), header::ORIGIN),
        fetch_site: text(request.headers(), header::HeaderName::from_static("sec-fetch-site")),
        writes: !matches!(*request.method(), Method::GET | Method::HEAD),
        opens_socket: request.uri().path() == "/ws",
    };
    let writes = asks.writes;
    let mut response = match guard::check(&asks, &shared.names) {
        Ok(()) => admitted(&shared, ends.line, request, next, writes).await,
        Err(why) => {
            counts.count(Cause::Foreign);
            let status = match why {
                guard::Refusal::SeveralHosts => StatusCode::BAD_REQUEST,
                guard::Refusal::NoHost
                | guard::Refusal::ForeignName(..)
                | guard::Refusal::ForeignPage { .. } => StatusCode::FORBIDDEN,
            };
            refuse(status, &why.to_string())
        }
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-cache"),
    ] {
        // What is stricter stays.
        headers.entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Hands on what its sender may ask for.
async fn admitted(shared: &Shared, line: Line, request: Request, next: Next, writes: bool) -> Response {
    let counts = &shared.context.connections;
    let (mut parts, body) = request.into_parts();
    let who = shared.context.access.who(&session::credential(&parts.headers, line));
    let route = parts.extensions.get::<MatchedPath>().cloned();
    let params = parts.extract::<RawPathParams>().await.ok();
    let param = |wanted| params.iter().flatten().find(|(name, _)| *name == wanted).map(|(_, value)| value);
    let input = param("input").and_then(Input::named);
    let route = route.as_ref().map(MatchedPath::as_str);
    if line == Line::Missed && !is_taken_in_clear(route, input) {
        counts.count(Cause::Tls);
        return by_tls(&parts);
    }
    match needed(&parts.method, route, input) {
        Some(Needed::Free) => {}
        Some(Needed::Needs(action)) if who.may(action, door_of(route, param("name"))) => {}
        Some(Needed::Needs(_)) if who == Who::Nobody => {
            counts.count(Cause::Unknown);
            let why = "log in at /login.html, or send a token: Authorization: Bearer …";
            let mut response = refuse(StatusCode::UNAUTHORIZED, why);
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            return response;
        }
        Some(Needed::Needs(_)) => {
            counts.count(Cause::Role);
            return refuse(StatusCode::FORBIDDEN, &format!("{who} may not do this"));
        }
        None => return not_so().await,
    }
    parts.extensions.insert(who);
    let answer = next.run(Request::from_parts(parts, body));
    if !writes {
        // A body that nothing asked for is not read: hyper closes the connection after the answer.
        return answer.await;
    }
    match tokio::time::timeout(shared.limits.body, answer).await {
        Ok(response) => response,
        Err(_) => {
            counts.count(Cause::Body);
            let mut response = refuse(StatusCode::REQUEST_TIMEOUT, "the request did not come in time");
            response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
            response
        }
    }
}

/// The door that a request is about. Other routes have names, too, of modules and of images.
fn door_of<'a>(route: Option<&str>, name: Option<&'a str>) -> Option<&'a str> {
    name.filter(|_| route.is_some_and(|route| route.starts_with("/api/door/")))
}

/// Sends a browser to the same page over TLS; a program is told: it may have sent a token in clear, which is to be replaced.
fn by_tls(asked: &Parts) -> Response {
    let host = text(&asked.headers, header::HOST).unwrap_or_default();
    let page = asked.uri.path_and_query().map_or("/", PathAndQuery::as_str);
    match HeaderValue::try_from(format!("https://{host}{page}")) {
        Ok(there) if asked.method == Method::GET => {
            (StatusCode::TEMPORARY_REDIRECT, [(header::LOCATION, there)]).into_response()
        }
        _ => refuse(StatusCode::UPGRADE_REQUIRED, "here it is https:// alone, but for the way out of a door"),
    }
}

async fn not_so() -> Response {
    refuse(StatusCode::METHOD_NOT_ALLOWED, "not with this method")
}

async fn state(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.context.frames.borrow());
    Json(&*frame).into_response()
}

async fn history(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.history.lock().to_json();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// For supervisors: whether the tracker goes on. Frames come every 0.1 s.
async fn healthz(State(shared): State<Arc<Shared>>) -> Response {
    let mut frames = shared.context.frames.clone();
    frames.mark_unchanged();
    match tokio::time::timeout(HEALTHY, frames.changed()).await {
        Ok(Ok(())) => "ok\n".into_response(),
        Ok(Err(_)) | Err(_) => {
            refuse(StatusCode::SERVICE_UNAVAILABLE, "the tracker has made no frame for a second")
        }
    }
}

async fn metrics(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.context.frames.borrow());
    ([(header::CONTENT_TYPE, crate::metrics::CONTENT_TYPE)], crate::metrics::text(&frame)).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_routes_of_doors_name_a_door() {
        for route in ["/api/door/{name}", "/api/door/{name}/{*input}"] {
            assert_eq!(door_of(Some(route), Some("front")), Some("front"));
        }
        for route in ["/api/module/{name}", "/api/module/{name}/{action}", "/api/firmware/{name}"] {
            assert_eq!(door_of(Some(route), Some("front")), None, "{route}");
        }
        assert_eq!((door_of(None, Some("front")), door_of(Some("/api/door/{name}"), None)), (None, None));
    }
}
