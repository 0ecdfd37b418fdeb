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
//! ```
//!
//! | file | what |
//! |---|---|
//! | `guard` | which clients may ask, and from which page |
//! | `feed` | snapshots to text, once for all clients |
//! | `history` | the last ten minutes |
//! | `past` | what was before, from the database |
//! | `socket` | a browser's connection |
//! | `site` | the site, read and written |
//! | `door` | doors, and messages to them |
//! | `calibration` | poses found by walking |
//! | `page/` | the page itself |
//!
//! The server has a thread of its own; the tracker never waits for it. Every answer that is no success says
//! why in one line: `{"error": "…"}`.

mod answers;
mod calibration;
mod door;
mod feed;
pub mod guard;
pub mod history;
mod page;
mod past;
mod shared;
mod site;
mod socket;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::thread::JoinHandle;

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::serve::ListenerExt;
use axum::{Json, Router};
use parking_lot::Mutex;
use tokio::sync::{oneshot, watch};

use crate::supervise;
use answers::{BODY_MAX, refuse, text};
use history::History;
pub use shared::{Accepted, Desk};
use shared::{Packets, Shared};

/// What the page may load and which server it may ask: this one alone.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// The running server. It ends when it is dropped; open connections with it.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Listens at `listen`; port 0 takes a free one.
    ///
    /// # Errors
    /// The address cannot be had, or no thread.
    pub fn start(listen: SocketAddr, desk: Desk) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(listen)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new().name("http".into()).spawn(move || {
            let desk = Arc::new(desk);
            let mut stopped = stopped;
            supervise::run("http", &desk.alarms, || {
                let listener = listener.try_clone().map_err(|error| error.to_string())?;
                runtime.block_on(async {
                    tokio::select! {
                        why = serve(listener, Arc::clone(&desk)) => Err(why),
                        _ = &mut stopped => Ok(()),
                    }
                })
            });
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A thread that has failed has said so.
            let _ = thread.join();
        }
    }
}

/// Why it is no longer served.
async fn serve(listener: std::net::TcpListener, desk: Arc<Desk>) -> String {
    let (packets_in, packets) = watch::channel(Packets::default());
    let shared = Arc::new(Shared {
        desk,
        packets,
        history: Mutex::new(History::default()),
        sockets: AtomicUsize::new(0),
    });
    let listener = match tokio::net::TcpListener::from_std(listener) {
        // Small messages are sent at once, not with the answer to the one before.
        Ok(listener) => listener.tap_io(|stream| drop(stream.set_nodelay(true))),
        Err(error) => return format!("the live map cannot be served: {error}"),
    };
    let feeding = feed::run(Arc::clone(&shared), packets_in);
    let (served, ()) = tokio::join!(async { axum::serve(listener, router(shared)).await }, feeding);
    match served {
        Ok(()) => "the live map is no longer served".to_owned(),
        Err(error) => format!("the live map is no longer served: {error}"),
    }
}

fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/ws", get(socket::open))
        .route("/api/site", get(site::show).put(site::change))
        .route("/api/state", get(state))
        .route("/api/history", get(history))
        .route("/api/overview", get(past::glance))
        .route("/api/past", get(past::paths))
        .route("/api/calibration", get(calibration::show).post(calibration::change))
        .route("/metrics", get(metrics))
        .route("/api/door", get(door::all))
        .route("/api/door/{name}", get(door::one))
        .route("/api/door/{name}/{*input}", post(door::tell))
        .route("/door/{name}", get(door::screen))
        .fallback(page::asset)
        .method_not_allowed_fallback(async || refuse(StatusCode::METHOD_NOT_ALLOWED, "not with this method"))
        .layer(DefaultBodyLimit::max(BODY_MAX))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guarded))
        .with_state(shared)
}

/// Lets requests pass that may ask, and tells browsers to be as careful.
async fn guarded(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let asks = guard::Asks {
        host: text(request.headers(), header::HOST),
        origin: text(request.headers(), header::ORIGIN),
        fetch_site: text(request.headers(), header::HeaderName::from_static("sec-fetch-site")),
        writes: !matches!(*request.method(), Method::GET | Method::HEAD),
        opens_socket: request.uri().path() == "/ws",
    };
    let mut response = match guard::check(&asks, &shared.desk.names) {
        Ok(()) => next.run(request).await,
        Err(why) => refuse(StatusCode::FORBIDDEN, &why.to_string()),
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
