//! What was sent to the tracker with intent and did it no harm, in short: wrong frames of WebSockets, wrong requests, names
//! that are programs, and a broker that is none.
#![cfg(unix)]

mod chromium;
mod described;
mod door_fixture;
mod flood;
mod hall;
mod http_client;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use door_fixture::DoorServer;
use flood::Figures;
use hall::Tracker;

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// All that comes for `bytes` until the server closes.
fn answer(server: SocketAddr, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(server).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    // A server that refuses early may have closed already.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

#[test]
fn a_websocket_that_breaks_the_rules_is_closed() {
    const HELLO: &str = "GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    let door = DoorServer::new();
    let server = door.server.address();
    // After the second byte: the mask, which is 0, and the content.
    let cases: [(&str, &[u8]); 12] = [
        ("not masked", b"\x81\x01x"),
        ("a reserved bit", b"\xc1\x81\0\0\0\0x"),
        ("a reserved kind", b"\x83\x81\0\0\0\0x"),
        ("a reserved kind of control", b"\x8b\x80\0\0\0\0"),
        ("a ping in pieces", b"\x09\x80\0\0\0\0"),
        ("a ping that is too long", b"\x89\xfe\x00\x7e\0\0\0\0"),
        ("no UTF-8", b"\x81\x81\0\0\0\0\xff"),
        ("a piece of nothing", b"\x80\x80\0\0\0\0"),
        ("a message in the midst of another", b"\x01\x81\0\0\0\0x\x81\x81\0\0\0\0x"),
        ("a reason to close of one byte", b"\x88\x81\0\0\0\0x"),
        ("longer than a message may be", b"\x81\xfe\xff\xff\0\0\0\0"),
        ("longer than memory", b"\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0"),
    ];
    for (what, frame) in cases {
        let mut stream = TcpStream::connect(server).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(&[HELLO.as_bytes(), frame].concat()).unwrap();
        let (mut buffer, begun, mut heard) = ([0; 4096], Instant::now(), Vec::new());
        // Closed: nothing more comes, though there is a frame each 50 ms.
        while let Ok(len @ 1..) = stream.read(&mut buffer) {
            heard.extend(&buffer[..len.min(200)]);
            assert!(begun.elapsed() < PATIENCE, "{what}: it goes on");
        }
        assert!(heard.starts_with(b"HTTP/1.1 101 "), "{what}: {}", String::from_utf8_lossy(&heard));
        assert_eq!(door.ask("GET /api/state", &[], "").0, 200, "{what}");
    }
}

#[test]
fn no_path_leads_to_a_file_and_no_request_hides_another() {
    let door = DoorServer::new();
    let server = door.server.address();
    for path in [
        "/../../../../etc/passwd",
        "/..%2f..%2f..%2fetc%2fpasswd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/....//....//etc/passwd",
        "//etc/passwd",
        "/..\\..\\etc\\passwd",
        "/index.html/../../etc/passwd",
        "/api/door/..%2f..%2f..%2fetc%2fpasswd",
    ] {
        let text = answer(
            server,
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").as_bytes(),
        );
        assert!(text.starts_with("HTTP/1.1 4") && !text.contains("root:"), "{path}: {text}");
    }
    let hidden = "GET /api/site HTTP/1.1\r\nHost: localhost\r\n\r\n";
    for head in [
        "Content-Length: 5\r\nTransfer-Encoding: chunked",
        "Content-Length: 5\r\nContent-Length: 6",
        "Content-Length: +5",
        "Content-Length: 5, 6",
        "Transfer-Encoding: chunked, identity",
        "Content-Length : 5",
        " X: folded",
    ] {
        let request = format!("PUT /api/site HTTP/1.1\r\nHost: localhost\r\n{head}\r\n\r\n0\r\n\r\n{hidden}");
        let text = answer(server, request.as_bytes());
        assert!(text.starts_with("HTTP/1.1 4"), "{head}: {text}");
        assert_eq!(text.matches("HTTP/1.1 ").count(), 1, "{head}: the hidden one is answered, too: {text}");
    }
}

#[test]
fn names_that_are_programs_are_shown_and_not_run() {
    const EVIL: &str = "<img src=x onerror=window.ran=1>";
    let Some(mut page) = chromium::start() else { return };
    let site = door_fixture::SITE.replace("\"area\"", &format!("\"{EVIL}\""));
    let more = format!(
        "[[module]]\nname = \"{EVIL}\"\nx = 0.0\ny = 3.0\n[[entry]]\nname = \"{EVIL}\"\nline = [[-4, -4], [-4, -2]]\nzone = \"{EVIL}\"\n"
    );
    let door = DoorServer::of(&format!("{site}{more}"));
    door.people(&[[0.0, 0.4]]);
    page.size(1280, 800, 1);
    page.open(&format!("http://{}/", door.server.address()));
    page.wait("its name is shown", &format!("document.body.textContent.includes({EVIL:?})"));
    page.click("#modules .module-row");
    page.wait("the details are open", "!document.querySelector('#detail').hidden");
    page.open(&format!("http://{}/door/front", door.server.address()));
    page.wait("the door is shown", "document.querySelector('#name').textContent === 'front'");
    for expression in ["window.ran", "document.querySelector('img[src=x]')"] {
        assert!(page.value(expression).is_null(), "{expression}");
    }
}

/// What a broker does with a connection.
type Behaviour = fn(&mut TcpStream);

/// That it is connected.
const CONNACK: &[u8] = b"\x20\x02\x00\x00";

const BEHAVIOURS: [(&str, Behaviour); 9] = [
    ("hangs up", |_| {}),
    ("any bytes", |stream| drop(stream.write_all(&[0x5a; 4096]))),
    ("refuses", |stream| drop(stream.write_all(b"\x20\x02\x00\x05"))),
    ("half an answer", |stream| drop(stream.write_all(b"\x20\x02"))),
    ("any bytes after a good answer", |stream| drop(stream.write_all(&[CONNACK, &[0xff; 4096]].concat()))),
    ("a message of 256 MB", |stream| {
        let _ = stream.write_all(&[CONNACK, b"\x30\xff\xff\xff\x7f\x00\x01a"].concat());
        // As much of it as the other end takes.
        for _ in 0..64 {
            let _ = stream.write_all(&[0; 1 << 16]);
        }
    }),
    ("a length without end", |stream| {
        drop(stream.write_all(&[CONNACK, b"\x30\xff\xff\xff\xff\xff"].concat()))
    }),
    ("acknowledges what was never sent", |stream| {
        drop(stream.write_all(&[CONNACK, b"\x40\x02\x12\x34\x90\x03\x43\x21\x00\x70\x02\x12\x34"].concat()));
    }),
    ("answers twice", |stream| drop(stream.write_all(&[CONNACK, CONNACK].concat()))),
];

/// So long a broker waits after what it does before it hangs up: it has been read by then.
const READ: Duration = Duration::from_millis(300);

/// Growth of memory that is none, kB: a tenth of what the broker claims to send once.
const NOISE_KB: u64 = 25_600;

#[test]
fn a_broker_that_is_none_ends_nothing() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = broker.local_addr().unwrap().port();
    let done = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&done);
    std::thread::spawn(move || {
        for (number, stream) in broker.incoming().enumerate() {
            let Ok(mut stream) = stream else { return };
            BEHAVIOURS[number % BEHAVIOURS.len()].1(&mut stream);
            std::thread::sleep(READ);
            counted.fetch_add(1, Ordering::Relaxed);
        }
    });
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, flood::SITE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args([
        "run",
        "--no-mdns",
        "--module",
        "127.0.0.1:9",
        "--http",
        "0",
        "--tracks-out",
        "-",
        "--site",
    ]);
    command.arg(&site).args(["--mqtt", &format!("mqtt://127.0.0.1:{port}")]);
    let tracker = Tracker::start(command);
    let map: SocketAddr = tracker.says("live map at http://").trim_end_matches('/').parse().unwrap();
    tracker.line();
    let before = Figures::of(tracker.process.id());
    let begun = Instant::now();
    while done.load(Ordering::Relaxed) <= BEHAVIOURS.len() {
        let reached = BEHAVIOURS[done.load(Ordering::Relaxed) % BEHAVIOURS.len()].0;
        assert!(
            begun.elapsed() < PATIENCE,
            "it never comes again after \"{reached}\": {:#?}",
            tracker.said()
        );
        // It goes on.
        tracker.line();
    }
    let after = Figures::of(tracker.process.id());
    println!("before {before}; after {} connections {after}", done.load(Ordering::Relaxed));
    assert!(
        after.rss_kb < before.rss_kb + NOISE_KB && after.threads <= before.threads + 1,
        "{before}; {after}"
    );
    let exit = flood::ask(map, "POST /api/door/front/exit").unwrap();
    assert!(exit.starts_with("HTTP/1.1 200 "), "{exit}");
}
