//! A listener: takes connections within its bounds, and hands their requests to a router.
//!
//! ```text
//!   accept ─┬─ no place ─▶ 503, one line, closed, counted
//!           └─ Place ─▶ hyper: header in time? ─▶ router ─▶ answer, taken in time? ─▶ next request
//!                        └─ no: closed, counted               └─ no: closed, counted
//! ```

use std::error::Error;
use std::io::{self, Write};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use tokio::net::{TcpListener, TcpStream};
use tokio_io_timeout::TimeoutStream;
use tower::ServiceExt;

use super::limits::{HEADER_MAX, Limits};
use super::places::{Place, Places, Taken};
use crate::connections::{Cause, Connections};

/// Before connections are accepted again when the system has none to give: no descriptor is free.
const NO_DESCRIPTOR: Duration = Duration::from_millis(100);

/// The two ends of the connection by which a request came, among its extensions.
#[derive(Clone, Debug)]
pub struct Ends {
    /// The client's address.
    pub peer: IpAddr,
    /// The address that the client reached.
    pub own: IpAddr,
    /// The connection's place: a browser that takes over the connection keeps it.
    _place: Arc<Place>,
}

/// Serves until its future is dropped. Connections go on as long as their runtime does.
pub async fn serve(listener: TcpListener, limits: Limits, counts: Connections, router: Router) -> ! {
    let places = Places::new(limits.connections);
    loop {
        match listener.accept().await {
            Ok((stream, from)) => connected(stream, from, &places, limits, &counts, &router),
            // The client went before it was accepted.
            Err(error) if is_of_one(&error) => {}
            Err(_) => tokio::time::sleep(NO_DESCRIPTOR).await,
        }
    }
}

fn is_of_one(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset)
}

fn connected(
    stream: TcpStream,
    from: SocketAddr,
    places: &Places,
    limits: Limits,
    counts: &Connections,
    router: &Router,
) {
    // A connection that has no address any more is closed already.
    let Ok(own) = stream.local_addr() else { return };
    let peer = from.ip().to_canonical();
    let place = match places.reserve(peer) {
        Ok(place) => place,
        Err(why) => {
            counts.count(why.into());
            turn_away(stream, why);
            return;
        }
    };
    // Small messages are sent at once, not with the answer to the one before.
    drop(stream.set_nodelay(true));
    let ends = Ends { peer, own: own.ip().to_canonical(), _place: Arc::new(place) };
    let (counts, router) = (counts.clone(), router.clone());
    tokio::spawn(async move {
        let mut stream = Box::pin(TimeoutStream::new(stream));
        stream.as_mut().set_write_timeout_pinned(Some(limits.write));
        let service = router.map_request(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(ends.clone());
            request
        });
        let talk = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(limits.header)
            .max_buf_size(HEADER_MAX)
            .serve_connection(TokioIo::new(stream), TowerToHyperService::new(service))
            .with_upgrades();
        if let Err(error) = talk.await {
            if error.is_timeout() {
                counts.count(Cause::Header);
            } else if is_unread(&error) {
                counts.count(Cause::Unread);
            }
        }
    });
}

/// Says why, if the line takes it at once: whom nothing is kept for is not waited for.
fn turn_away(stream: TcpStream, why: Taken) {
    let body = json!({ "error": why.to_string() }).to_string();
    let answer = format!(
        "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        body.len()
    );
    if let Ok(mut stream) = stream.into_std() {
        let _ = stream.write_all(answer.as_bytes());
    }
}

/// Whether a client did not take what it was sent in time.
pub fn is_unread(error: &(dyn Error + 'static)) -> bool {
    let timed_out = |error: &(dyn Error + 'static)| {
        error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::TimedOut)
    };
    std::iter::successors(Some(error), |error: &&(dyn Error + 'static)| (**error).source()).any(timed_out)
}
