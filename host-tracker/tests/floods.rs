//! What floods of the map's listener cost the tracker: memory, descriptors and threads, which may not grow from wave to
//! wave.
//!
//! ```text
//!   flood ─▶ 100 connections at once ─▶ 64 places ─▶ figures while they are held ─▶ all closed ─▶ figures ─▶ next wave
//!                                                    └ the first waves: the plateau; no later wave is above it
//! ```
//!
//! Meanwhile the way out is asked for at the doors' own listener, each 50 ms.
//!
//! Some seconds; `KEHAI_FLOOD_SECONDS=600` for as long as that. The figures are printed: `-- --nocapture`.
#![cfg(target_os = "linux")]

mod described;
mod flood;
mod hall;

use std::io::{ErrorKind, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::Command;
use std::time::{Duration, Instant};

use flood::{Exits, Figures, ask};
use hall::Tracker;

/// More than there are places for this machine, so that some of each wave are turned away.
const CONNECTIONS: usize = 100;

/// Places that they have.
const PLACES: usize = 64;

/// Waves until memory is as high as it goes: what is freed is kept for the next, and where it lies varies a little.
const PLATEAU: usize = 4;

/// Waves of a flood in a short run.
const WAVES: usize = 12;

/// Growth of memory that is none, kB: a tenth of what one wave of unfinished bodies brings along, shared by all later
/// waves. What each wave left behind of even one connection's buffers would be more.
const NOISE_KB: u64 = 6400;

/// A hundred times what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

/// A flood: what each of its connections sends.
struct Flood {
    name: &'static str,
    sent: Vec<u8>,
    /// Whether the server takes all of it.
    is_taken: bool,
}

fn floods() -> Vec<Flood> {
    let head = "Host: localhost\r\n";
    let header = format!("GET / HTTP/1.1\r\n{head}X-a: {}", "x".repeat(60_000));
    let site = "PUT /api/site HTTP/1.1\r\nContent-Type: application/json\r\nContent-Length: 1000000";
    let body = format!("{site}\r\n{head}\r\n{}", " ".repeat(999_999));
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    let browser = format!("GET /ws HTTP/1.1\r\n{head}{upgrade}\r\n\r\n");
    let unread = format!("GET /main.js HTTP/1.1\r\n{head}\r\n").repeat(600);
    let whole = format!("GET /api/state HTTP/1.1\r\n{head}Connection: close\r\n\r\n");
    [
        ("idle connections", String::new(), true),
        ("unfinished headers", header, true),
        ("unfinished bodies", body, true),
        ("browsers that read nothing", browser, true),
        ("answers that are not read", unread, false),
        ("whole requests", whole, true),
    ]
    .map(|(name, sent, is_taken)| Flood { name, sent: sent.into_bytes(), is_taken })
    .into()
}

/// A connection of a flood.
struct Client {
    stream: TcpStream,
    /// Bytes that are sent.
    done: usize,
    /// Whether the server has closed it.
    is_over: bool,
}

impl Client {
    fn new(map: SocketAddr) -> Self {
        let stream = TcpStream::connect(map).unwrap();
        stream.set_nonblocking(true).unwrap();
        Self { stream, done: 0, is_over: false }
    }

    /// Sends what the system takes at once. Whether all is sent that ever will be.
    fn send(&mut self, bytes: &[u8]) -> bool {
        while !self.is_over && self.done < bytes.len() {
            match self.stream.write(&bytes[self.done..]) {
                Ok(taken) => self.done += taken,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return false,
                Err(_) => self.is_over = true,
            }
        }
        true
    }
}

/// Bytes that have come for connections of this port and that no program has taken yet.
fn waiting(port: u16) -> u64 {
    let port = format!(":{port:04X}");
    let table = std::fs::read_to_string("/proc/net/tcp").unwrap();
    let of_line = |line: &str| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let (_, received) = fields[4].split_once(':').unwrap();
        fields[1].ends_with(&port).then(|| u64::from_str_radix(received, 16).unwrap())
    };
    // A listening socket counts connections there that wait to be accepted.
    table.lines().skip(1).filter_map(of_line).sum()
}

/// The worst figures of one wave, after which all is closed again.
fn wave(flood: &Flood, map: SocketAddr, process: u32, calm: Figures) -> Figures {
    let mut worst = Figures::default();
    let mut clients: Vec<Client> = (0..CONNECTIONS).map(|_| Client::new(map)).collect();
    let begun = Instant::now();
    let (mut before, mut still) = (u64::MAX, 0);
    // Until the server has taken all; or, of what it does not take, no more for a while.
    while still < 5 {
        let mut is_sent = true;
        for client in &mut clients {
            is_sent &= client.send(&flood.sent);
        }
        worst = worst.worst(Figures::of(process));
        let left = waiting(map.port());
        let is_still = if flood.is_taken { is_sent && left == 0 } else { left == before };
        (before, still) = (left, if is_still { still + 1 } else { 0 });
        assert!(begun.elapsed() < PATIENCE, "{}: {left} bytes are never taken", flood.name);
        std::thread::sleep(Duration::from_millis(2));
    }
    drop(clients);
    let begun = Instant::now();
    // The one at the button may be there.
    while Figures::of(process).descriptors > calm.descriptors + 1 {
        assert!(begun.elapsed() < PATIENCE, "{}: never closed: {}", flood.name, Figures::of(process));
        std::thread::sleep(Duration::from_millis(2));
    }
    worst
}

#[test]
fn f11_no_flood_grows_beyond_its_first_waves() {
    let seconds = flood::seconds();
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
        "--door-http",
        "0",
        "--site",
    ]);
    command.arg(&site);
    let tracker = Tracker::start(command);
    let address = |text: String| text.split('/').next().unwrap().parse::<SocketAddr>().unwrap();
    let map = address(tracker.says("live map at http://"));
    let doors = address(tracker.says("messages to doors at http://"));
    let process = tracker.process.id();
    let state = || ask(map, "GET /api/state").unwrap();
    assert!(state().starts_with("HTTP/1.1 200 "));
    let calm = Figures::of(process);
    println!("{:28} {calm}", "before");
    let floods = floods();
    for flood in &floods {
        let begun = Instant::now();
        let share = seconds.map(|seconds| Duration::from_secs_f64(seconds / floods.len() as f64));
        let goes_on = |waves: usize| waves < WAVES || share.is_some_and(|share| begun.elapsed() < share);
        let mut plateau = Figures::default();
        let mut waves = 0;
        let mut last = Figures::default();
        let exits = Exits::begin(doors);
        while goes_on(waves) {
            last = wave(flood, map, process, calm);
            waves += 1;
            if waves <= PLATEAU {
                plateau = plateau.worst(last);
                continue;
            }
            let (flood, most) = (flood.name, plateau.rss_kb + NOISE_KB);
            assert!(last.rss_kb <= most, "{flood}, wave {waves}: {last}; the first: {plateau}");
            // The two more are the connection that is being turned away, and the one at the button.
            assert!(last.descriptors <= calm.descriptors + PLACES + 2, "{flood}, wave {waves}: {last}");
            assert!(last.threads <= plateau.threads, "{flood}, wave {waves}: {last}; {plateau}");
        }
        let taken = exits.end();
        println!(
            "{:28} {plateau}; wave {waves}: {last}; after: {}; {taken}",
            flood.name,
            Figures::of(process)
        );
    }
    let answer = state();
    assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    // 100 connections a wave, of which 64 at most have a place.
    let refused: u64 = answer
        .split_once("\"http\":")
        .unwrap()
        .1
        .split_once("\"address\":")
        .unwrap()
        .1
        .split(|letter: char| !letter.is_ascii_digit())
        .next()
        .unwrap()
        .parse()
        .unwrap();
    println!("turned away: {refused}");
    assert!(refused > 0);
}
