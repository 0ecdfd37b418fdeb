//! The live map: a page, the frames it shows, and the site it edits, over HTTP.
//!
//! ```text
//!   frames ─▶ feed ─▶ one text for all ─▶ /ws            every 0.1 s; a slow client misses some
//!   reports ────────────────────────────▶ /ws            tracks after each report, for clients that ask
//!               └───▶ ten minutes      ─▶ /api/history   two lines a second
//!   database ────────────────────────▶ /api/overview, /api/past
//!                                         /api/state     the newest frame
//!                                         /metrics       the same for Prometheus
//!   poses by walking ◀──────────────────▶ /api/calibration
//!   site file ◀─ checked, saved ◀──────── /api/site      GET, PUT
//!   doors ◀─ messages, as `door` says ───▶ /api/door/NAME/INPUT, /door/NAME
//!   page/ ──────────────────────────────▶ /              embedded: no other server is ever asked
//!
//!   --http ──────▶ listener, places, thread: the map, and doors if they have no listener of their own
//!   --door-http ─▶ listener, places, thread: doors alone, which nothing that happens to the map reaches
//! ```
//!
//! | file | what |
//! |---|---|
//! | `guard` | which clients may ask, and from which page |
//! | `listener` | connections, within their bounds |
//! | `limits`, `places` | the bounds; how many connections, and of which address |
//! | `feed` | snapshots to text, once for all clients |
//! | `history` | the last ten minutes |
//! | `past` | what was before, from the database |
//! | `socket` | a browser's connection |
//! | `site` | the site, read and written |
//! | `door` | doors, and messages to them |
//! | `calibration` | poses found by walking |
//! | `page/` | the page itself |
//!
//! Each listener has a thread of its own; the tracker never waits for it. Every answer that is no success says
//! why in one line: `{"error": "…"}`.

mod answers;
mod calibration;
mod door;
mod feed;
pub mod guard;
pub mod history;
mod limits;
mod listener;
mod page;
mod past;
mod places;
mod shared;
mod site;
mod socket;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use parking_lot::Mutex;
use tokio::sync::{oneshot, watch};

use crate::connections::Cause;
use crate::supervise;
use answers::{BODY_MAX, refuse, text};
use history::History;
use kehai_tracking::door::inbox;
pub use limits::Limits;
use listener::Ends;
use places::Places;
pub use places::Shares;
pub use shared::{Accepted, Desk};
use shared::{Packets, Shared};

/// What the page may load and which server it may ask: this one alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// Where the server listens, and within which bounds.
#[derive(Clone, Copy, Debug)]
pub struct Listen {
    /// The map.
    pub map: SocketAddr,
    /// The doors, if not with the map.
    pub doors: Option<SocketAddr>,
    /// The bounds of each listener.
    pub limits: Limits,
}

impl From<SocketAddr> for Listen {
    fn from(map: SocketAddr) -> Self {
        Self { map, doors: None, limits: Limits::default() }
    }
}

/// The running server. It ends when it is dropped; open connections with it.
#[derive(Debug)]
pub struct Server {
    map: Thread,
    doors: Option<Thread>,
}

impl Server {
    /// Listens; port 0 takes a free one.
    ///
    /// # Errors
    /// An address cannot be had, or no thread.
    pub fn start(listen: impl Into<Listen>, desk: Desk) -> io::Result<Self> {
        let Listen { map, doors, limits } = listen.into();
        let desk = Arc::new(desk);
        let doors =
            doors.map(|at| Thread::start("door-http", at, limits, &desk, Serves::Doors)).transpose()?;
        let beside = doors.as_ref().map(|doors| doors.address);
        let map = Thread::start("http", map, limits, &desk, Serves::Map { doors_at: beside })?;
        Ok(Self { map, doors })
    }

    /// Where the map is.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.map.address
    }

    /// Where messages to doors are taken.
    #[must_use]
    pub fn door_address(&self) -> SocketAddr {
        self.doors.as_ref().unwrap_or(&self.map).address
    }
}

/// What a listener is for.
#[derive(Clone, Copy, Debug)]
enum Serves {
    /// The map; messages to doors, too, unless they are taken at another address.
    Map { doors_at: Option<SocketAddr> },
    /// Doors alone.
    Doors,
}

/// A listener's thread, which ends when this is dropped.
#[derive(Debug)]
struct Thread {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Thread {
    fn start(
        name: &'static str,
        listen: SocketAddr,
        limits: Limits,
        desk: &Arc<Desk>,
        serves: Serves,
    ) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(listen)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let (stop, mut stopped) = oneshot::channel();
        let desk = Arc::clone(desk);
        let thread = std::thread::Builder::new().name(name.into()).spawn(move || {
            supervise::run(name, &desk.alarms, || {
                let listener = listener.try_clone().map_err(|error| error.to_string())?;
                runtime.block_on(async {
                    tokio::select! {
                        why = serve(listener, limits, &desk, serves) => Err(why),
                        _ = &mut stopped => Ok(()),
                    }
                })
            });
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A thread that has failed has said so.
            let _ = thread.join();
        }
    }
}

/// Why it is no longer served.
async fn serve(listener: std::net::TcpListener, limits: Limits, desk: &Arc<Desk>, serves: Serves) -> String {
    let (packets_in, packets) = watch::channel(Packets::default());
    let shared = Arc::new(Shared {
        desk: Arc::clone(desk),
        names: guard::Names::of_this_machine(&desk.names),
        limits,
        packets,
        history: Mutex::new(History::default()),
        browsers: Places::new(limits.connections.half()),
    });
    let listener = match tokio::net::TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return format!("HTTP cannot be served: {error}"),
    };
    let router = match serves {
        Serves::Map { doors_at } => map(doors_at),
        Serves::Doors => doors(),
    };
    let serving = listener::serve(listener, limits, desk.connections.clone(), finished(router, &shared));
    match serves {
        Serves::Doors => serving.await,
        Serves::Map { .. } => tokio::join!(serving, feed::run(shared, packets_in)).0,
    }
}

fn map(doors_at: Option<SocketAddr>) -> Router<Arc<Shared>> {
    let map = Router::new()
        .route("/ws", get(socket::open))
        .route("/api/site", get(site::show).put(site::change))
        .route("/api/state", get(state))
        .route("/api/history", get(history))
        .route("/api/overview", get(past::glance))
        .route("/api/past", get(past::paths))
        .route("/api/calibration", get(calibration::show).post(calibration::change))
        .route("/metrics", get(metrics));
    let Some(at) = doors_at else { return map.merge(doors()) };
    let elsewhere = move || async move {
        let why = format!("this door takes messages at --door-http alone: http://{at}/");
        refuse(StatusCode::MISDIRECTED_REQUEST, &why)
    };
    map.route("/api/door", get(door::all))
        .route("/api/door/{name}", get(door::one))
        .route("/api/door/{name}/{*input}", post(elsewhere))
        .route("/door/{name}", get(elsewhere))
}

/// What devices at a door, and the screen beside it, ask for.
fn doors() -> Router<Arc<Shared>> {
    let tell = post(door::tell).layer(DefaultBodyLimit::max(inbox::LONGEST));
    Router::new()
        .route("/api/door", get(door::all))
        .route("/api/door/{name}", get(door::one))
        .route("/api/door/{name}/{*input}", tell)
        .route("/door/{name}", get(door::screen))
}

/// With what every request goes through.
fn finished(router: Router<Arc<Shared>>, shared: &Arc<Shared>) -> Router {
    router
        .fallback(page::asset)
        .method_not_allowed_fallback(async || refuse(StatusCode::METHOD_NOT_ALLOWED, "not with this method"))
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
    let counts = &shared.desk.connections;
    let asks = guard::Asks {
        own: ends.own,
        host: text(request.headers(), header::HOST),
        origin: text(request.headers(), header::ORIGIN),
        fetch_site: text(request.headers(), header::HeaderName::from_static("sec-fetch-site")),
        writes: !matches!(*request.method(), Method::GET | Method::HEAD),
        opens_socket: request.uri().path() == "/ws",
    };
    let mut response = match guard::check(&asks, &shared.names) {
        Ok(()) if asks.writes => match tokio::time::timeout(shared.limits.body, next.run(request)).await {
            Ok(response) => response,
            Err(_) => {
                counts.count(Cause::Body);
                let mut response = refuse(StatusCode::REQUEST_TIMEOUT, "the request did not come in time");
                response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
                response
            }
        },
        // A body that nothing asked for is not read: hyper closes the connection after the answer.
        Ok(()) => next.run(request).await,
        Err(why) => {
            counts.count(Cause::Foreign);
            refuse(StatusCode::FORBIDDEN, &why.to_string())
        }
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-cache"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn state(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.desk.frames.borrow());
    Json(&*frame).into_response()
}

async fn history(State(shared): State<Arc<Shared>>) -> Response {
    let text = shared.history.lock().to_json();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

async fn metrics(State(shared): State<Arc<Shared>>) -> Response {
    let frame = Arc::clone(&shared.desk.frames.borrow());
    ([(header::CONTENT_TYPE, crate::metrics::CONTENT_TYPE)], crate::metrics::text(&frame)).into_response()
}
