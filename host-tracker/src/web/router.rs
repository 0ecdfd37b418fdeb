//! Which request goes where, as the table of operations says, and what all of them go through.
//!
//! ```text
//!   request ─▶ guard: from here? ─▶ who? ─▶ may it? ─▶ body in time? ─▶ route ─▶ answer ─▶ headers that make browsers careful
//!                 └─ 400, 403         └─ 401    └─ 403
//! ```

use std::convert::Infallible;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use axum::body::Body;
use axum::extract::{DefaultBodyLimit, MatchedPath, RawPathParams, Request, State};
use axum::http::request::Parts;
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::{Extension, RequestPartsExt, Router};
use http_body_util::BodyExt;
use kehai_tracking::door::inbox::Input;
use tokio::sync::oneshot;

use super::answers::{BODY_MAX, refuse, text};
use super::documents::Documents;
use super::listener::{Ends, Line};
use super::operations::{self, Route};
use super::schema;
use super::shared::Shared;
use super::{guard, page, session};
use crate::access::Who;
use crate::connections::Cause;

/// What the page may load and which server it may ask: this one alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// Both documents of this server.
static DOCUMENTS: Documents = Documents {
    openapi: LazyLock::new(|| schema::openapi().to_string()),
    asyncapi: LazyLock::new(|| schema::asyncapi().to_string()),
};

/// The map, and everything else.
pub fn map() -> Router<Arc<Shared>> {
    served(operations::routes())
}

/// What devices at a door, and the screen beside it, ask for.
pub fn doors() -> Router<Arc<Shared>> {
    served(operations::routes().filter(|route| route.is_for_doors))
}

fn served(routes: impl Iterator<Item = &'static Route>) -> Router<Arc<Shared>> {
    routes.fold(Router::new(), |router, route| router.route(route.path, route.served.clone()))
}

/// With what every request goes through.
pub fn finished(router: Router<Arc<Shared>>, shared: &Arc<Shared>) -> Router {
    router
        .fallback(page::asset)
        .method_not_allowed_fallback(not_so)
        .layer(DefaultBodyLimit::max(BODY_MAX))
        .layer(Extension(&DOCUMENTS))
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
    if line == Line::Missed && !operations::is_taken_in_clear(route, input) {
        counts.count(Cause::Tls);
        return by_tls(&parts);
    }
    let Some(right) = operations::right(&parts.method, route) else { return not_so().await };
    match right.action(input) {
        None => {}
        Some(action) if who.may(action, door_of(route, param("name"))) => {}
        Some(_) if who == Who::Nobody => {
            counts.count(Cause::Unknown);
            let why = "log in at /login.html, or send a token: Authorization: Bearer …";
            let mut response = refuse(StatusCode::UNAUTHORIZED, why);
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            return response;
        }
        Some(_) => {
            counts.count(Cause::Role);
            return refuse(StatusCode::FORBIDDEN, &format!("{who} may not do this"));
        }
    }
    parts.extensions.insert(who);
    if !writes {
        // A body that nothing asked for is not read: hyper closes the connection after the answer.
        return next.run(Request::from_parts(parts, body)).await;
    }
    let (body, read) = told_when_read(body);
    tokio::select! {
        response = next.run(Request::from_parts(parts, body)) => response,
        () = is_late(read, shared.limits.body) => {
            counts.count(Cause::Body);
            let mut response = refuse(StatusCode::REQUEST_TIMEOUT, "the request did not come in time");
            response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
            response
        }
    }
}

/// The body, and a receiver that ends as soon as the handler has read it.
fn told_when_read(body: Body) -> (Body, oneshot::Receiver<Infallible>) {
    let (reading, read) = oneshot::channel();
    let body = body.map_frame(move |frame| {
        // It is dropped with the body, which handlers give up once they have all of it.
        let _reading = &reading;
        frame
    });
    (Body::new(body), read)
}

/// Ends if the body has not been read within the limit. How long the handler takes afterwards is its own affair.
async fn is_late(read: oneshot::Receiver<Infallible>, limit: Duration) {
    if tokio::time::timeout(limit, read).await.is_ok() {
        std::future::pending().await
    }
}

/// The door that a request is about. Other routes have names, too, of modules and of images.
fn door_of<'a>(route: Option<&str>, name: Option<&'a str>) -> Option<&'a str> {
    name.filter(|_| route.is_some_and(|route| route.starts_with("/api/door/")))
}

/// Sends a browser to the same page over TLS; a program is told: it may have sent a token in clear, which is to be replaced. One that
/// was redirected would never know.
fn by_tls(asked: &Parts) -> Response {
    if asked.headers.contains_key(header::AUTHORIZATION) {
        let why = "here it is https:// alone: this token was sent in clear, and is to be replaced";
        return refuse(StatusCode::UPGRADE_REQUIRED, why);
    }
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
