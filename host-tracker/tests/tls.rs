//! TLS: the map over it, what is answered in clear where it is spoken, and its bounds.
#![cfg(target_os = "linux")]

mod described;
mod hall;
mod house;
mod http_client;
mod tls_client;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use hall::Tracker;
use host_tracker::access::roles::Role;
use host_tracker::web::{Limits, Shares};
use house::{DOORS, House, PASSWORD, ZONE};
use kehai_emulator::pc::image::{Fault, Image};
use kehai_tracking::snapshot::{HttpRefused, ModuleLine, Snapshot};
use serde_json::{Value, json};
use tls_client::{Stream, ask, connect, trusting};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Longer than any test.
const NEVER: Duration = Duration::from_secs(3600);

/// A time limit that runs out at once.
const SHORT: Duration = Duration::from_millis(100);

const SHARES: Shares = Shares { all: 12, of_address: 2, of_loopback: 8 };

const PATIENT: Limits = Limits { connections: SHARES, header: NEVER, body: NEVER, write: NEVER, ping: NEVER };

fn secured(site: &str, limits: Limits) -> House {
    House::bound(site, limits, true)
}

impl House {
    fn secure(&self) -> Stream {
        let certificate = self.folder.path().join("house.cert.pem");
        connect(&trusting(&certificate), self.server.address(), "localhost").unwrap()
    }

    fn clear(&self) -> TcpStream {
        TcpStream::connect(self.server.address()).unwrap()
    }

    fn until(&self, what: &str, is: impl Fn(&HttpRefused) -> bool) {
        let begun = Instant::now();
        while !is(&self.refused.refused()) {
            assert!(begun.elapsed() < PATIENCE, "never {what}: {:?}", self.refused.refused());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn people_log_in_over_tls_and_their_cookie_stays_there() {
    let house = secured(ZONE, Limits::default());
    let body = json!({ "name": "anna", "password": PASSWORD }).to_string();
    let json = [("Content-Type", "application/json"), ("Origin", "https://localhost")];
    let answer = ask(house.secure(), "POST /api/session", &json, &body);
    assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    let cookie = answer.lines().find_map(|line| line.strip_prefix("set-cookie: ")).unwrap();
    assert!(cookie.starts_with("__Host-kehai-session=") && cookie.ends_with("; Secure"), "{cookie}");
    let cookie = cookie.split(';').next().unwrap();
    let answer = ask(house.secure(), "GET /api/state", &[("Cookie", cookie)], "");
    assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    let plain = cookie.trim_start_matches("__Host-");
    let answer = ask(house.secure(), "GET /api/state", &[("Cookie", plain)], "");
    assert!(answer.starts_with("HTTP/1.1 401 "), "a cookie that others could have set: {answer}");
}

#[test]
fn frames_come_over_tls() {
    let house = secured(ZONE, Limits::default());
    let token = house.token("screen", &[Role::View], None);
    let mut request = "wss://localhost/ws".into_client_request().unwrap();
    request.headers_mut().insert("Authorization", token.parse().unwrap());
    let (mut map, _) = tungstenite::client(request, house.secure()).unwrap();
    for unix_ms in 1..=20 {
        // Longer than a record of TLS.
        let module = ModuleLine { name: "x".repeat(100_000), ..ModuleLine::default() };
        house.frames.send_replace(Arc::new(Snapshot {
            unix_ms,
            modules: vec![module],
            ..Snapshot::default()
        }));
        until_frame(&mut map, unix_ms);
    }
}

fn until_frame(map: &mut WebSocket<Stream>, unix_ms: u64) {
    loop {
        let Message::Text(text) = map.read().unwrap() else { continue };
        described::message(&text);
        let value: Value = serde_json::from_str(&text).unwrap();
        if value["frame"]["unix_ms"] == json!(unix_ms) {
            return;
        }
    }
}

#[test]
fn in_clear_there_is_the_way_out_and_nothing_else() {
    let house = secured(&format!("{ZONE}{DOORS}"), Limits::default());
    let admin = house.token("admin", &[Role::Admin], None);
    let shown = [("Authorization", admin.as_str())];
    let answer = ask(house.clear(), "POST /api/door/front/exit", &[], "");
    assert!(answer.starts_with("HTTP/1.1 200 ") && answer.ends_with("{}"), "{answer}");
    let door = ask(house.secure(), "GET /api/door/front", &shown, "");
    assert!(door.contains("\"lock\":\"exit\""), "{door}");
    house.frames.send_replace(Arc::new(Snapshot { unix_ms: 1, ..Snapshot::default() }));
    for (line, status) in [
        ("GET /?a=b", "307"),
        ("GET /api/state", "307"),
        ("GET /api/door/front", "307"),
        ("POST /api/session", "426"),
        ("PUT /api/site", "426"),
        ("POST /api/door/front/number", "426"),
        ("POST /api/door/front/reset", "426"),
        ("DELETE /api/door/front/exit", "405"),
    ] {
        let answer = ask(house.clear(), line, &[], "{}");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{line}: {answer}");
        if status == "307" {
            let page = line.split_once(' ').unwrap().1;
            assert!(answer.contains(&format!("location: https://localhost{page}\r\n")), "{answer}");
        }
        if status != "405" {
            let answer = ask(house.clear(), line, &shown, "{}");
            assert!(answer.starts_with("HTTP/1.1 426 "), "a token in clear, {line}: {answer}");
            assert!(answer.contains("sent in clear, and is to be replaced"), "{answer}");
        }
    }
    assert_eq!(house.refused.refused().tls, 14);
    let health = ask(house.clear(), "GET /healthz", &[], "");
    // No frame comes in this test, so it is not well; what counts is that it says so.
    assert!(health.starts_with("HTTP/1.1 503 ") && health.contains("no frame"), "{health}");
}

#[test]
fn a_client_that_begins_no_tls_gives_its_place_back_and_is_counted() {
    // Long enough for a handshake on a loaded machine.
    let house = secured(ZONE, Limits { header: Duration::from_secs(2), ..PATIENT });
    // Nothing; the beginning of a handshake; and one that goes on for ever.
    for begun in [&b""[..], &[22], &[22, 3, 1, 64, 0, 1]] {
        let before = house.refused.refused().header;
        let mut stream = house.clear();
        stream.write_all(begun).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let _ = stream.read(&mut [0; 64]);
        house.until("counted", |refused| refused.header > before);
    }
    let mut nonsense = house.clear();
    nonsense.write_all(&[22, 3, 1, 0, 4, 9, 0, 0, 0]).unwrap();
    house.until("counted as no TLS", |refused| refused.tls == 1);
    let mut quiet = house.secure();
    house.until("a client that asks for nothing", |refused| refused.header == 4);
    let _ = quiet.read(&mut [0; 64]);
}

#[test]
fn places_are_taken_by_handshakes_and_given_back() {
    let house = secured(ZONE, PATIENT);
    let held: Vec<TcpStream> = (0..SHARES.of_loopback).map(|_| house.clear()).collect();
    house.until("turned away", |refused| {
        let mut more = house.clear();
        more.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut said = Vec::new();
        let _ = more.read_to_end(&mut said);
        assert!(said.is_empty(), "clear text for a client that waits for TLS: {said:?}");
        refused.address > 0
    });
    drop(held);
    let begun = Instant::now();
    let certificate = trusting(&house.folder.path().join("house.cert.pem"));
    while connect(&certificate, house.server.address(), "localhost").is_err() {
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn an_answer_that_no_client_takes_is_ended() {
    let house = secured(ZONE, Limits { write: SHORT, ..PATIENT });
    let token = house.token("screen", &[Role::View], None);
    let name = "x".repeat(8 << 20);
    let module = ModuleLine { name, ..ModuleLine::default() };
    house.frames.send_replace(Arc::new(Snapshot {
        unix_ms: 1,
        modules: vec![module],
        ..Snapshot::default()
    }));
    let mut stream = house.secure();
    write!(stream, "GET /api/state HTTP/1.1\r\nHost: localhost\r\nAuthorization: {token}\r\n\r\n").unwrap();
    stream.flush().unwrap();
    house.until("counted as unread", |refused| refused.unread == 1);
}

/// What a command says and whether it succeeded.
fn command(arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(arguments).output().unwrap();
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    (output.status.success(), said)
}

#[test]
fn an_update_asks_a_tracker_over_tls_by_the_certificate_that_is_named() {
    let house = secured(ZONE, Limits::default());
    house.frames.send_replace(Arc::new(Snapshot { unix_ms: 1, ..Snapshot::default() }));
    let token = house.token("update", &[Role::View], None);
    let path = |name: &str| house.folder.path().join(name).to_str().unwrap().to_owned();
    let (maker, image, signed, keys) =
        (path("maker.key"), path("image.bin"), path("image.kehai"), path("house.keys"));
    std::fs::write(&image, Image { version: "0.2.0".into(), fault: Fault::None }.bytes(5000)).unwrap();
    std::fs::write(&keys, format!("secret = \"{}\"\n", "ab".repeat(32))).unwrap();
    let (done, said) = command(&["firmware", "key", "--make", &maker]);
    assert!(done, "{said}");
    let by = ["--key", &maker, "--program", "pc", "--image-version", "0.2.0"];
    let (done, said) = command(&[&["firmware", "sign"][..], &by, &[image.as_str(), "-o", &signed]].concat());
    assert!(done, "{said}");

    // No module is there: what is said of it comes after the tracker was asked.
    let update = |asked: &[&str]| {
        let token = token.trim_start_matches("Bearer ");
        let arguments = ["module", "update", "127.0.0.1:9", &signed, "--keys", &keys, "--token", token];
        let (done, said) = command(&[&arguments[..], asked].concat());
        assert!(!done, "{said}");
        said
    };
    let port = house.server.address().port();
    let (secure, clear) = (format!("https://localhost:{port}"), format!("http://localhost:{port}"));
    let said = update(&["--tracker", &secure, "--ca", &path("house.cert.pem")]);
    assert!(said.contains("0 of 1 modules are done"), "{said}");
    let said = update(&["--tracker", &secure]);
    assert!(said.contains("name its certificate with --ca") && !said.contains("modules are done"), "{said}");
    let said = update(&["--tracker", &clear, "--ca", &path("house.cert.pem")]);
    assert!(said.contains("https:// alone"), "{said}");
    let said = update(&["--tracker", &secure, "--ca", &path("none.pem")]);
    assert!(said.contains("none.pem: "), "{said}");
}

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("home.toml"), ZONE).unwrap();
        Self { folder }
    }

    fn run(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(["run", "--no-mdns", "--module", "127.0.0.1:9", "--site"]);
        command.arg(self.folder.path().join("home.toml")).args(arguments);
        command
    }

    fn answers(&self, tracker: &Tracker, marker: &str) -> String {
        let port = tracker.says(marker).trim_end_matches('/').rsplit(':').next().unwrap().to_owned();
        let server = SocketAddr::from(([127, 0, 0, 1], port.parse().unwrap()));
        let certificate = trusting(&self.folder.path().join("home.cert.pem"));
        ask(connect(&certificate, server, "127.0.0.1").unwrap(), "GET /healthz", &[], "")
    }
}

#[test]
fn others_are_served_over_tls_by_a_certificate_that_stays() {
    let place = Place::new();
    let first = Tracker::start(place.run(&["--http", "0.0.0.0:0", "--first-admin"]));
    assert!(place.answers(&first, "live map at https://").starts_with("HTTP/1.1 200 "));
    let fingerprint = first.says("home.cert.pem has the SHA-256 fingerprint ");
    drop(first);
    let second = Tracker::start(place.run(&["--http", "0", "--tls"]));
    assert!(place.answers(&second, "live map at https://127.0.0.1").starts_with("HTTP/1.1 200 "));
    assert_eq!(second.says("fingerprint "), fingerprint);
    drop(second);
    let third = Tracker::start(place.run(&["--http", "0", "--door-http", "0.0.0.0:0"]));
    third.says("live map at http://127.0.0.1");
    third.says("messages to doors at https://0.0.0.0");
    drop(third);
    let [certificate, key] = ["home.cert.pem", "home.key.pem"].map(|name| place.folder.path().join(name));
    let files = ["--tls-cert", certificate.to_str().unwrap(), "--tls-key", key.to_str().unwrap()];
    let fourth = Tracker::start(place.run(&[&["--http", "0"][..], &files].concat()));
    assert!(place.answers(&fourth, "live map at https://127.0.0.1").starts_with("HTTP/1.1 200 "));
    drop(fourth);
    std::fs::write(&key, "damaged").unwrap();
    let output = place.run(&["--http", "0", "--tls"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(1) && said.contains("home.key.pem: this is no key in PEM"),
        "{said}"
    );
    let mut insecure = place.run(&["--http", "0.0.0.0:0", "--insecure", "--seconds", "1"]);
    let said = String::from_utf8(insecure.output().unwrap().stderr).unwrap();
    assert!(
        said.contains("live map at http://0.0.0.0") && said.contains("go in clear over the network"),
        "{said}"
    );
}
