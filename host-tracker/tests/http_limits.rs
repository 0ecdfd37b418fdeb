//! The bounds of the HTTP listeners: what a flood takes, that it is counted, and that the doors' own listener is not
//! reached by it.

mod described;
mod http_client;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use host_tracker::connections::Connections;
use host_tracker::doors::DoorHandle;
use host_tracker::site_file::SiteFile;
use host_tracker::web::{Limits, Listen, Server, ServerContext, Shares};
use kehai_tracking::snapshot::{HttpRefused, ModuleLine, Snapshot, unix_ms};
use serde_json::json;
use tokio::sync::watch;
use tungstenite::{HandshakeError, WebSocket};

const SITE: &str = "
[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true

[[door]]
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"
";

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Longer than any test.
const NEVER: Duration = Duration::from_secs(3600);

/// A time limit that runs out at once.
const SHORT: Duration = Duration::from_millis(100);

/// All of them are of this machine.
const SHARES: Shares = Shares { all: 12, of_address: 2, of_loopback: 8 };

const PATIENT: Limits = Limits { connections: SHARES, header: NEVER, body: NEVER, write: NEVER, ping: NEVER };

struct LimitedServer {
    server: Server,
    refused: Connections,
    frames: watch::Sender<Arc<Snapshot>>,
    _folder: tempfile::TempDir,
}

impl LimitedServer {
    fn new(limits: Limits) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("server.toml");
        std::fs::write(&path, SITE).unwrap();
        let site = SiteFile::load(&path).unwrap();
        let (frames, newest) = watch::channel(Arc::default());
        let refused = Connections::default();
        let context = ServerContext {
            doors: Some(DoorHandle::new(&site.current().site, None)),
            connections: refused.clone(),
            ..ServerContext::alone(newest, site)
        };
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let server =
            Server::start(Listen { map: any.into(), doors: Some(any.into()), limits }, context).unwrap();
        Self { server, refused, frames, _folder: folder }
    }

    /// A connection to the map that has sent this and nothing more.
    fn begin(&self, request: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.server.address()).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    /// As many connections as there are places for this machine, of three kinds: none of them ever asks to the end.
    fn flood(&self) -> Vec<TcpStream> {
        const BODY: &str = "PUT /api/site HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
                            Content-Length: 1000\r\n\r\n{";
        let kinds = ["", "GET / HTTP/1.1\r\nHost: localhost\r\nX-a: ", BODY];
        let held = (0..SHARES.of_loopback).map(|number| self.begin(kinds[number % kinds.len()])).collect();
        // The next is turned away, so all of these have their places.
        self.until("turned away", |refused| {
            let mut more = self.begin("");
            more.set_read_timeout(Some(PATIENCE)).unwrap();
            let _ = more.read_to_string(&mut String::new());
            refused.address > 0
        });
        held
    }

    fn door(&self, address: SocketAddr, input: &str, id: u64) -> (u16, String) {
        let body = json!({ "id": id, "at_ms": unix_ms() }).to_string();
        http_client::ask(address, &format!("POST /api/door/front/{input}"), &[], body.as_bytes())
    }

    #[track_caller]
    fn until(&self, what: &str, is_so: impl Fn(HttpRefused) -> bool) {
        let begun = Instant::now();
        while !is_so(self.refused.refused()) {
            assert!(begun.elapsed() < PATIENCE, "never {what}: {:?}", self.refused.refused());
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Whether the map is answered, by a connection of its own.
    fn map_answers(&self) -> bool {
        let mut stream =
            self.begin("GET /api/state HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        let mut answer = String::new();
        // A connection that was turned away is closed with the request unread.
        let _ = stream.read_to_string(&mut answer);
        answer.starts_with("HTTP/1.1 200 ")
    }

    fn browser(&self) -> Result<WebSocket<TcpStream>, u16> {
        let address = self.server.address();
        let stream = TcpStream::connect(address).unwrap();
        match tungstenite::client(format!("ws://{address}/ws"), stream) {
            Ok((socket, _)) => Ok(socket),
            Err(HandshakeError::Failure(tungstenite::Error::Http(answer))) => Err(answer.status().as_u16()),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn f11_a_flood_of_the_map_does_not_reach_the_doors_and_ends_with_the_flood() {
    let server = LimitedServer::new(PATIENT);
    let flood = server.flood();
    assert!(!server.map_answers(), "all places of this machine are taken");
    assert_eq!(server.door(server.server.door_address(), "exit", 1), (200, "{}".to_owned()));
    let screen = http_client::ask(server.server.door_address(), "GET /door/front", &[], b"");
    assert_eq!(screen.0, 200);
    drop(flood);
    server.until("back", |_| server.map_answers());
}

#[test]
fn f11_what_is_never_asked_to_the_end_is_ended() {
    let server = LimitedServer::new(Limits { header: SHORT, body: SHORT, ..PATIENT });
    // Held to the end: it is the server that ends them.
    let kinds = [
        "",
        "GET / HTTP/1.1\r\n",
        "POST /api/calibration HTTP/1.1\r\nHost: localhost\r\nContent-Type: \
                  application/json\r\nContent-Length: 9\r\n\r\n{",
    ];
    let mut held: Vec<TcpStream> = kinds.iter().map(|request| server.begin(request)).collect();
    let answers = held.iter_mut().map(|stream| {
        let mut answer = String::new();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.read_to_string(&mut answer).unwrap();
        answer
    });
    let answers: Vec<String> = answers.collect();
    assert!(answers[0].is_empty() && answers[1].is_empty(), "{answers:?}");
    assert!(answers[2].starts_with("HTTP/1.1 408 ") && answers[2].contains("in time"), "{answers:?}");
    server.until("counted", |refused| (refused.header, refused.body) == (2, 1));
    assert!(server.map_answers());
}

#[test]
fn the_limit_of_a_body_is_over_once_it_has_come() {
    let server = LimitedServer::new(Limits { body: SHORT, ..PATIENT });
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    let module = ModuleLine { name: "left".to_owned(), address, ..ModuleLine::default() };
    server.frames.send_replace(Arc::new(Snapshot { modules: vec![module], ..Snapshot::default() }));
    let asked = "POST /api/module/left/identify";
    let (status, why) = http_client::ask(server.server.address(), asked, &[], b"{}");
    assert!(status == 504 && why.contains("no module answers"), "{status} {why}");
    assert_eq!(server.refused.refused().body, 0);
}

#[test]
fn f11_browsers_that_read_nothing_give_their_places_back() {
    let server = LimitedServer::new(Limits { ping: SHORT, ..PATIENT });
    let share = SHARES.of_loopback / 2;
    let held: Vec<_> = (0..share).map(|_| server.browser().unwrap()).collect();
    server.until("gone", |refused| refused.unread == share as u64);
    let again: Vec<_> = (0..share).map(|_| server.browser().unwrap()).collect();
    drop((held, again));
    let server = LimitedServer::new(PATIENT);
    let _held: Vec<_> = (0..share).map(|_| server.browser().unwrap()).collect();
    assert_eq!(server.browser().err(), Some(503));
    assert_eq!(server.refused.refused().address, 1);
    assert!(server.map_answers(), "browsers have the half of the places");
}

#[test]
fn f11_an_answer_that_no_client_takes_is_ended() {
    let server = LimitedServer::new(Limits { write: SHORT, ..PATIENT });
    // Longer than all that the system keeps for a client.
    let module = ModuleLine { name: "x".repeat(64 << 20), ..ModuleLine::default() };
    server.frames.send_replace(Arc::new(Snapshot { modules: vec![module], ..Snapshot::default() }));
    let _held = server.begin("GET /api/state HTTP/1.1\r\nHost: localhost\r\n\r\n");
    server.until("ended", |refused| refused.unread == 1);
}

#[test]
fn f11_messages_to_doors_go_to_their_own_listener_alone() {
    let server = LimitedServer::new(PATIENT);
    let (status, why) = server.door(server.server.address(), "exit", 1);
    assert_eq!(status, 421, "{why}");
    assert!(why.contains(&server.server.door_address().to_string()), "{why}");
    let (status, why) = server.door(server.server.address(), "reset", 1);
    assert!(status == 409 && why.contains("no alarm to reset"), "the map resets: {status} {why}");
    for (address, line, expected) in [
        (server.server.address(), "GET /api/door/front", 200),
        (server.server.address(), "GET /door/front", 421),
        (server.server.door_address(), "GET /api/site", 404),
        (server.server.door_address(), "GET /metrics", 404),
        (server.server.door_address(), "GET /ws", 404),
    ] {
        assert_eq!(http_client::ask(address, line, &[], b"").0, expected, "{line}");
    }
    let evil = [("Host", "evil.local"), ("Origin", "http://evil.local")];
    for line in ["GET /api/door", "POST /api/door/front/exit"] {
        let (status, why) = http_client::ask(server.server.door_address(), line, &evil, b"{}");
        assert!(status == 403 && why.contains("--http-name evil.local"), "{line}: {status} {why}");
    }
    assert_eq!(server.refused.refused().foreign, 2);
}
