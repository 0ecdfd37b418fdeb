//! What the tracker publishes to ROS 2, judged by others' programs: a router of Zenoh, and what subscribes as rmw_zenoh does.
//!
//! ```text
//!   hall ─▶ kehai-tracker run --ros2 ─▶ router ─▶ tests/ros2.py: zenoh-ros2-sdk, rosbags
//!                  ╰──────────── GET /api/state ───────▶╯ the same people at the same millisecond?
//! ```
#![allow(missing_docs, reason = "a test program")]
#![cfg(all(feature = "zenoh", unix))]

mod described;
mod hall;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use hall::{Hall, PATIENCE, Tracker};
use kehai_emulator::ports::free_tcp;
use serde_json::{Value, json};
use zenoh::{Config, Wait};

/// Apart from the usual one.
const DOMAIN: &str = "73";

/// Python with what subscribes and decodes: `./ci.sh test` gets it.
fn python() -> Option<Command> {
    let name = std::env::var("KEHAI_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_it = Command::new(&name).args(["-c", "import zenoh_ros2_sdk, rosbags, zenoh.ext"]).output();
    if has_it.is_ok_and(|output| output.status.success()) {
        return Some(Command::new(name));
    }
    test_support::fail_in_ci_else_skip("no python3 with zenoh-ros2-sdk, rosbags");
    None
}

/// The judge, which answers each line with one.
struct Judge {
    process: Child,
    ask: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Judge {
    fn start(mut python: Command, port: u16, tracker: &str) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/ros2.py");
        python.arg(script).args([&port.to_string(), DOMAIN, tracker]);
        let mut process = python.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let ask = process.stdin.take().unwrap();
        let answers = BufReader::new(process.stdout.take().unwrap());
        Self { process, ask, answers }
    }

    #[track_caller]
    fn answer(&mut self) -> Value {
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        assert!(!line.is_empty(), "the judge has ended: see above");
        serde_json::from_str(&line).unwrap()
    }

    #[track_caller]
    fn ask(&mut self, what: &str) -> Value {
        writeln!(self.ask, "{what}").unwrap();
        self.answer()
    }

    /// Asks until it is so.
    #[track_caller]
    fn until(&mut self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let said = self.ask("");
            if is(&said) {
                return said;
            }
            assert!(begun.elapsed() < PATIENCE, "{what}: {said}");
            std::thread::sleep(Duration::from_millis(500));
        }
    }
}

impl Drop for Judge {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn figure(said: &Value, topic: &str, what: &str) -> u64 {
    said[topic][what].as_u64().unwrap_or(0)
}

#[test]
fn a_node_of_rmw_zenoh_finds_people_modules_and_scans_and_no_false_empty() {
    let Some(python) = python() else { return };
    let hall = Hall::new(4);
    let port = free_tcp().unwrap();
    let quiet = json!({ "multicast": { "enabled": false } });
    let at = format!("tcp/127.0.0.1:{port}");
    let router = json!({ "mode": "router", "listen": { "endpoints": [at] }, "scouting": quiet });
    let _router = zenoh::open(Config::from_json5(&router.to_string()).unwrap()).wait().unwrap();
    let file = hall.folder.path().join("node.json5");
    let node = json!({
        "mode": "peer",
        "connect": { "endpoints": [at] },
        "listen": { "endpoints": ["tcp/127.0.0.1:0"] },
        "scouting": quiet,
    });
    fs::write(&file, node.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--http", "127.0.0.1:0"]);
    command.args(["--ros2", "--ros2-domain", DOMAIN, "--zenoh"]).arg(&file);
    let tracker = Tracker::start(command);
    let map = tracker.says("live map at ");
    tracker.says("people are published to ROS 2, domain 73");
    let mut judge = Judge::start(python, port, map.trim_end_matches('/'));
    let scans: Vec<String> = ["east", "north", "south"].map(|name| format!("/kehai/{name}/scan")).into();
    assert_eq!(judge.answer(), json!({ "scans": scans }));

    let said = judge.until("four people walk", |said| figure(said, "people", "persons seen") > 200);
    println!("{said}");
    assert!(figure(&said, "people", "matched") > 50 && figure(&said, "markers", "bodies") > 200, "{said}");
    assert!(figure(&said, "diagnostics", "watching") > 0, "{said}");
    // A subscriber that comes late hears where the modules are, whichever way it asks.
    judge.ask("scan");
    let said = judge.until("scans", |said| {
        figure(said, "scan", "scans") > 20 && said["late"] == json!(["zenoh-ros2-sdk", "zenoh.ext"])
    });
    println!("{said}");
    let height_m = kehai_tracking::site::Site::parse("hall.toml", &fs::read_to_string(&hall.site).unwrap())
        .unwrap()
        .modules[0]
        .height_m;
    let places = json!({
        "kehai/south": [0.1, 0.1, height_m, 45.0],
        "kehai/east": [4.9, 0.1, height_m, 135.0],
        "kehai/north": [2.5, 4.9, height_m, -90.0],
    });
    assert_eq!(said["transforms"], places);
    // Nothing was published while there was no subscriber.
    assert_eq!(said["first_scan"], 1);
    assert!(figure(&said, "scan", "known") > 5_000, "{said}");
    judge.ask("no scan");

    // No module is left.
    drop(hall.building);
    let said = judge.until("nothing is known", |said| {
        said["total"] == json!({ "count": null, "state": "unknown" })
            && figure(said, "people", "silent") > 10
            && figure(said, "diagnostics", "missing") >= 3
            && figure(said, "markers", "unknown zones") > 0
    });
    println!("{said}");
    drop(tracker);
    let gone = judge.ask("gone");
    println!("{gone}");
}
