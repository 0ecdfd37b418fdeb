//! A listener: takes connections within its bounds, and hands their requests to a router.
//!
//! ```text
//!   accept ─┬─ no place ─▶ 503, one line, closed, counted
//!           └─ Place ─▶ TLS agreed in time? ─▶ hyper: header in time? ─▶ router ─▶ answer, taken in time? ─▶ next request
//!                        └─ no: closed, counted └─ no: closed, counted               └─ no: closed, counted
//! ```
//!
//! A listener with a certificate looks at the first byte: 22 begins TLS (RFC 8446, 5.1: a handshake), and no word of HTTP. Who
//! comes without it gets through as far as the router, which knows what to say: the way out is taken from there, too.

use std::error::Error;
use std::io::{self, Write};
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::TlsAcceptor;
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
    /// How it came.
    pub line: Line,
    /// The connection's place: a browser that takes over the connection keeps it.
    _place: Arc<Place>,
}

/// How a request came.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Line {
    /// In clear, by a listener for that.
    Clear,
    /// Over TLS.
    Tls,
    /// In clear, where TLS is spoken.
    Missed,
}

/// The first byte of TLS: the record of a handshake.
const HANDSHAKE: u8 = 22;

/// Serves until its future is dropped. Connections go on as long as their runtime does.
pub async fn serve(
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
    limits: Limits,
    counts: Connections,
    router: Router,
) -> ! {
    let places = Places::new(limits.connections);
    let server = Served { tls, limits, counts, router };
    loop {
        match listener.accept().await {
            Ok((stream, from)) => connected(stream, from, &places, &server),
            // The client went before it was accepted.
            Err(error) if is_of_one(&error) => {}
            Err(_) => tokio::time::sleep(NO_DESCRIPTOR).await,
        }
    }
}

fn is_of_one(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset)
}

/// What each connection of a listener has.
#[derive(Clone)]
struct Served {
    tls: Option<TlsAcceptor>,
    limits: Limits,
    counts: Connections,
    router: Router,
}

fn connected(stream: TcpStream, from: SocketAddr, places: &Places, server: &Served) {
    // A connection that has no address any more is closed already.
    let Ok(own) = stream.local_addr() else { return };
    let peer = from.ip().to_canonical();
    let place = match places.reserve(peer) {
        Ok(place) => place,
        Err(why) => {
            server.counts.count(why.into());
            // A client that waits for TLS could not read it.
            if server.tls.is_none() {
                turn_away(stream, why);
            }
            return;
        }
    };
    // Small messages are sent at once, not with the answer to the one before.
    drop(stream.set_nodelay(true));
    let ends = Ends { peer, own: own.ip().to_canonical(), line: Line::Clear, _place: Arc::new(place) };
    tokio::spawn(server.clone().begin(stream, ends));
}

impl Served {
    /// Agrees on TLS, if that is spoken here, and answers requests.
    async fn begin(self, stream: TcpStream, ends: Ends) {
        let limits = self.limits;
        let Some(tls) = self.tls.clone() else { return self.talk(patient(stream, limits.write), ends).await };
        let mut first = [0];
        let agreed = tokio::time::timeout(limits.header, async {
            stream.peek(&mut first).await?;
            let stream = patient(stream, limits.write);
            match first {
                [HANDSHAKE] => tls.accept(stream).await.map(Ok),
                _ => Ok(Err(stream)),
            }
        });
        match agreed.await {
            Ok(Ok(Ok(secure))) => self.talk(secure, Ends { line: Line::Tls, ..ends }).await,
            Ok(Ok(Err(clear))) => self.talk(clear, Ends { line: Line::Missed, ..ends }).await,
            Ok(Err(error)) if is_unread(&error) => self.counts.count(Cause::Unread),
            Ok(Err(_)) => self.counts.count(Cause::Tls),
            Err(_) => self.counts.count(Cause::Header),
        }
    }

    async fn talk(self, stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static, ends: Ends) {
        let service = self.router.map_request(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(ends.clone());
            request
        });
        let talk = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(self.limits.header)
            .max_buf_size(HEADER_MAX)
            .serve_connection(TokioIo::new(stream), TowerToHyperService::new(service))
            .with_upgrades();
        if let Err(error) = talk.await {
            if error.is_timeout() {
                self.counts.count(Cause::Header);
            } else if is_unread(&error) {
                self.counts.count(Cause::Unread);
            }
        }
    }
}

/// A stream that fails when what it sends is not taken in time.
fn patient(stream: TcpStream, write: Duration) -> Pin<Box<TimeoutStream<TcpStream>>> {
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(write));
    stream
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
