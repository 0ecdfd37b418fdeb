//! The live map: a page, the frames it shows, and the site it edits, over HTTP.
//!
//! ```text
//!   frames ─▶ feed ─▶ one text for all ─▶ /ws            every 0.1 s; a slow client misses some
//!   reports ────────────────────────────▶ /ws            tracks after each report, for clients that ask
//!               └───▶ ten minutes      ─▶ /api/history   two lines a second
//!   alarms, acknowledged ◀───────────────▶ /api/alarms, /ws
//!   database ────────────────────────▶ /api/overview, /api/past
//!                                         /api/state     the newest frame
//!                                         /metrics       the same for Prometheus
//!   poses by walking ◀──────────────────▶ /api/calibration
//!   firmware files ─────────────────────▶ /api/firmware, /api/firmware/NAME
//!   picture ◀───────────────────────────▶ /api/picture, /api/picture/place
//!   measured walls, rooms ──────────────▶ /api/survey
//!   site file ◀─ checked, saved ◀──────── /api/site      GET, PUT
//!   doors ◀─ messages, as `door` says ───▶ /api/door/NAME/INPUT, /door/NAME
//!   modules ◀─ learn, absorb, settings … ──▶ /api/module/NAME/ACTION
//!   log-in, log-out ◀───────────────────── /api/session
//!   why a figure is what it is ──────────▶ /api/explain
//!   names ◀─ cards, tags ────────────────▶ /api/sign, /api/where
//!   page/ ──────────────────────────────▶ /              embedded: no other server is ever asked
//!
//!   --http ──────▶ listener, places, thread: the map, and doors if they have no listener of their own
//!   --door-http ─▶ listener, places, thread: doors alone, which nothing that happens to the map reaches
//! ```
//!
//! | file | what |
//! |---|---|
//! | `guard` | which clients may ask, and from which page |
//! | `operations` | every request: its route, its right, its handler, what it is for programs |
//! | `rights` | which right a route may need |
//! | `schema`, `documents` | all of it described for programs; the same as answers |
//! | `session` | log-in, and which client a request is from |
//! | `router` | what all requests go through, on their way to where the table of operations sends them |
//! | `listener` | connections, within their bounds |
//! | `blocking` | work that takes long, on threads of its own |
//! | `limits`, `places` | the bounds; how many connections, and of which address |
//! | `feed` | snapshots to text, once for all clients |
//! | `history` | the last ten minutes |
//! | `newest` | what is known now |
//! | `past` | what was before, from the database |
//! | `socket` | a browser's connection |
//! | `editors` | who has the editor open |
//! | `alarms` | alarms, listed and acknowledged |
//! | `site` | the site, read and written |
//! | `door` | doors, and messages to them |
//! | `module` | modules, looked after |
//! | `coverage` | what modules see, for the handover page |
//! | `heat` | how long people were where |
//! | `explain` | why a figure is what it is |
//! | `sign` | cards and tags that were read, and where an ID is |
//! | `calibration` | poses found by walking |
//! | `firmware` | firmware for new boards, handed out |
//! | `picture` | a picture of the place under the map |
//! | `survey` | the plan that modules have measured |
//! | `page/` | the page itself |
//!
//! Each listener has a thread of its own; the tracker never waits for it. Every answer that is no success says
//! why in one line: `{"error": "…"}`.

mod alarms;
mod answers;
mod blocking;
pub(crate) mod bodies;
mod calibration;
mod coverage;
mod documents;
mod door;
mod editors;
mod explain;
mod feed;
mod firmware;
pub mod guard;
mod heat;
mod limits;
mod listener;
mod module;
mod newest;
pub(crate) mod operations;
mod page;
mod past;
mod picture;
mod places;
pub mod recent;
pub(crate) mod rights;
mod router;
pub mod schema;
mod session;
mod shared;
mod sign;
mod site;
mod socket;
mod survey;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;

use axum::extract::ws::Utf8Bytes;
use parking_lot::Mutex;
use tokio::sync::{oneshot, watch};
use tokio_rustls::TlsAcceptor;

use crate::certificate::Certificate;
use crate::supervise;
use editors::Editors;
pub use limits::Limits;
use places::Places;
pub use places::Shares;
use recent::History;
pub use shared::{Accepted, ServerContext};
use shared::{Packets, Shared};

/// The names and addresses of this machine, and these: what its own certificate is for.
#[must_use]
pub fn names_of_this_machine(others: &[String]) -> Vec<String> {
    let mut names = guard::Names::of_this_machine(others).all().to_vec();
    names.extend(if_addrs::get_if_addrs().unwrap_or_default().iter().map(|own| own.ip().to_string()));
    names.sort_unstable();
    names.dedup();
    names
}

/// Where the server listens, and within which bounds.
#[derive(Clone, Debug)]
pub struct Listen {
    /// The map.
    pub map: Bind,
    /// The doors, if not with the map.
    pub doors: Option<Bind>,
    /// The bounds of each listener.
    pub limits: Limits,
}

/// An address, and what is spoken there.
#[derive(Clone, Debug)]
pub struct Bind {
    /// The address; port 0 takes a free one.
    pub address: SocketAddr,
    /// What TLS shows there; without it everything goes in clear.
    pub certificate: Option<Certificate>,
}

impl From<SocketAddr> for Bind {
    fn from(address: SocketAddr) -> Self {
        Self { address, certificate: None }
    }
}

impl From<SocketAddr> for Listen {
    fn from(map: SocketAddr) -> Self {
        Self { map: map.into(), doors: None, limits: Limits::default() }
    }
}

impl Bind {
    /// What its addresses begin with.
    #[must_use]
    pub const fn scheme(&self) -> &'static str {
        if self.certificate.is_some() { "https" } else { "http" }
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
    pub fn start(listen: impl Into<Listen>, context: ServerContext) -> io::Result<Self> {
        let Listen { map, doors, limits } = listen.into();
        let context = Arc::new(context);
        let doors =
            doors.map(|at| Thread::start("door-http", at, limits, &context, Serves::Doors)).transpose()?;
        let beside = doors.as_ref().map(|doors| format!("{}://{}/", doors.scheme, doors.address));
        let map = Thread::start("http", map, limits, &context, Serves::Map { doors_at: beside })?;
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
#[derive(Clone, Debug)]
enum Serves {
    /// The map; messages to doors, too, unless they are taken at another address.
    Map { doors_at: Option<String> },
    /// Doors alone.
    Doors,
}

/// A listener's thread, which ends when this is dropped.
#[derive(Debug)]
struct Thread {
    address: SocketAddr,
    scheme: &'static str,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Thread {
    fn start(
        name: &'static str,
        listen: Bind,
        limits: Limits,
        context: &Arc<ServerContext>,
        serves: Serves,
    ) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(listen.address)?;
        let scheme = listen.scheme();
        let tls = listen.certificate.map(|certificate| TlsAcceptor::from(certificate.config()));
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let (stop, mut stopped) = oneshot::channel();
        let context = Arc::clone(context);
        let thread = std::thread::Builder::new().name(name.into()).spawn(move || {
            supervise::run(name, &context.alarms, || {
                let listener = listener.try_clone().map_err(|error| error.to_string())?;
                runtime.block_on(async {
                    tokio::select! {
                        why = serve(listener, tls.clone(), limits, &context, serves.clone()) => Err(why),
                        _ = &mut stopped => Ok(()),
                    }
                })
            });
        })?;
        Ok(Self { address, scheme, stop: Some(stop), thread: Some(thread) })
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
async fn serve(
    listener: std::net::TcpListener,
    tls: Option<TlsAcceptor>,
    limits: Limits,
    context: &Arc<ServerContext>,
    serves: Serves,
) -> String {
    let (packets_in, packets) = watch::channel(Packets::default());
    let (alarms_in, alarms) = watch::channel(Utf8Bytes::default());
    let (router, doors_at) = match &serves {
        Serves::Map { doors_at } => (router::map(), doors_at.clone()),
        Serves::Doors => (router::doors(), None),
    };
    let shared = Arc::new(Shared {
        context: Arc::clone(context),
        doors_at,
        names: guard::Names::of_this_machine(&context.names),
        limits,
        packets,
        alarms,
        history: Mutex::new(History::default()),
        browsers: Places::new(limits.connections.half()),
        comparing: Arc::default(),
        drawing: Arc::default(),
        asking: Arc::default(),
        exits: Mutex::default(),
        editors: Editors::default(),
    });
    let listener = match tokio::net::TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return format!("HTTP cannot be served: {error}"),
    };
    let serving = listener::serve(
        listener,
        tls,
        limits,
        context.connections.clone(),
        router::finished(router, &shared),
    );
    match serves {
        Serves::Doors => serving.await,
        Serves::Map { .. } => tokio::join!(serving, feed::run(shared, packets_in, alarms_in)).0,
    }
}
