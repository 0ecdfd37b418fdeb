//! What a flood costs the tracker, and whether the way out stays open meanwhile.
//!
//! ```text
//!   /proc ─▶ memory, descriptors, threads        POST exit, each 50 ms ─▶ taken? how long it took
//! ```
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::fmt;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A module that sees a zone, and a door out of it.
pub const SITE: &str = r#"
    [[module]]
    name = "left"
    x = 0.0
    y = 0.0
    [[zone]]
    name = "area"
    polygon = [[1, -0.5], [2, -0.5], [2, 0.5], [1, 0.5]]
    secure = true
    [[door]]
    without_keys = true
    name = "front"
    zone = "area"
    line = [[2, -0.45], [2, 0.45]]
    fail = "secure"
"#;

/// Between two presses of the button.
const PRESSES: Duration = Duration::from_millis(50);

/// So long a flood lasts, if that is said; else some seconds.
pub fn seconds() -> Option<f64> {
    std::env::var("KEHAI_FLOOD_SECONDS").ok().map(|text| text.parse().expect("KEHAI_FLOOD_SECONDS: a number"))
}

/// What the tracker uses.
#[derive(Clone, Copy, Default, Debug)]
pub struct Figures {
    pub rss_kb: u64,
    pub descriptors: usize,
    pub threads: u64,
}

impl Figures {
    pub fn of(process: u32) -> Self {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
        let number = |key: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap();
            line.split_whitespace().next().unwrap().parse().unwrap()
        };
        let descriptors = std::fs::read_dir(format!("/proc/{process}/fd")).unwrap().count();
        Self { rss_kb: number("VmRSS:"), descriptors, threads: number("Threads:") }
    }

    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        Self {
            rss_kb: self.rss_kb.max(other.rss_kb),
            descriptors: self.descriptors.max(other.descriptors),
            threads: self.threads.max(other.threads),
        }
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rss_kb, descriptors, threads } = self;
        write!(f, "{:6.1} MB {descriptors:4} descriptors {threads:2} threads", *rss_kb as f64 / 1e3)
    }
}

/// One request, over a connection of its own: its answer.
pub fn ask(server: SocketAddr, line: &str) -> std::io::Result<String> {
    let mut stream = TcpStream::connect(server)?;
    let rest = "Host: localhost\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
    stream.write_all(format!("{line} HTTP/1.1\r\n{rest}").as_bytes())?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer)
}

/// A button for the way out that is pressed again and again.
pub struct Exits {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Taken>,
}

/// What came of it.
#[derive(Clone, Copy, Default, Debug)]
pub struct Taken {
    pub asked: u32,
    pub taken: u32,
    pub longest: Duration,
}

impl Exits {
    /// At a door whose messages are taken there.
    pub fn begin(doors: SocketAddr) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut all = Taken::default();
            while !stopped.load(Ordering::Relaxed) {
                let begun = Instant::now();
                let answer = ask(doors, "POST /api/door/front/exit");
                all.longest = all.longest.max(begun.elapsed());
                all.asked += 1;
                all.taken += u32::from(answer.is_ok_and(|answer| answer.starts_with("HTTP/1.1 200 ")));
                std::thread::sleep(PRESSES);
            }
            all
        });
        Self { stop, thread }
    }

    /// All of them were taken; how long the slowest took.
    #[track_caller]
    pub fn end(self) -> Taken {
        self.stop.store(true, Ordering::Relaxed);
        let all = self.thread.join().unwrap();
        assert!(all.asked > 0 && all.taken == all.asked, "the way out: {all:?}");
        all
    }
}

impl fmt::Display for Taken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { asked, taken, longest } = self;
        write!(f, "exit taken {taken} of {asked}, the slowest in {:.1} ms", longest.as_secs_f64() * 1e3)
    }
}
