//! From the last byte of a scan to the track on a WebSocket: how long that takes, eight modules at once.
//!
//! ```text
//!   this process                                                  another
//!   sensor ──TCP──▶ driver ─▶ pipeline ─▶ report ──UDP──▶ kehai-tracker run --http --db
//!     │ last byte written: t₀                                          │
//!     └──────────── latency = t₁ − t₀ ──────── WebSocket message ◀─────┘  arrived: t₁
//! ```
//!
//! `cargo bench -p host-tracker --bench latency` prints the table; `-- --seconds N` measures longer. Nothing is asserted:
//! another program on this machine is in it as well. The clock begins when the emulated sensor has written the last
//! byte of a scan to its socket, so the driver's reading, the pipeline, both networks (loopback), the tracker and
//! the WebSocket are all in it. Scans are paired with messages by the number of their report.

#[path = "../tests/described/mod.rs"]
mod described;
#[path = "../tests/hall/mod.rs"]
mod hall;

use std::collections::BTreeMap;
use std::net::TcpStream;
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use hall::{Hall, Tracker};
use host_sim::building::{Building, Watch};
use host_sim::world::scene::Scene;
use kehai_emulator::serve::Status;
use serde_json::Value;
use tungstenite::{Message, WebSocket};

/// Modules of the hall; each has a URG-04LX: ten scans a second.
const MODULES: usize = 8;

/// People who walk there.
const PEOPLE: usize = 6;

/// How long is measured when nothing else is said, s.
const SECONDS: u64 = 20;

/// The aim: the 99th percentile on an idle machine with two cores, ms.
const AIM_MS: f64 = 20.0;

/// When each scan was written, by module.
type Scans = Arc<Vec<Mutex<Vec<Instant>>>>;

/// When the message of each report arrived, by module.
type Messages = BTreeMap<String, Vec<(u32, Instant)>>;

fn main() {
    let seconds = seconds().unwrap_or(SECONDS);
    let scene = Scene::parse("latency", &scene()).expect("a scene");
    let scans: Scans = Arc::new((0..MODULES).map(|_| Mutex::default()).collect());
    let building = Building::watched(&scene, 1, &watch(&scans)).expect("ports and threads");
    let hall = Hall::of(&scene, building);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--http", "127.0.0.1:0"]);
    let tracker = Tracker::start(command);
    let mut socket = connect(&tracker.says("live map at "));
    tracker.until_a_person();
    socket.send(Message::text(r#"{"frames": false, "reports": true}"#)).expect("the tracker listens");
    let (messages, tracks) = listen(&mut socket, Duration::from_secs(seconds));
    let latencies = latencies(&scene, &scans, &messages);
    print(&latencies, seconds, tracks);
}

fn seconds() -> Option<u64> {
    let mut arguments = std::env::args().skip_while(|argument| argument != "--seconds");
    arguments.nth(1)?.parse().ok()
}

/// Eight modules along the walls of a hall of 8 m by 5 m.
fn scene() -> String {
    let mut text = "[[site.wall]]\npoints = [[0, 0], [8, 0], [8, 5], [0, 5], [0, 0]]\n\
                    [[site.zone]]\nname = \"hall\"\npolygon = [[0, 0], [8, 0], [8, 5], [0, 5]]\ncount = true\n"
        .to_owned();
    for module in 0..MODULES {
        let (x, far) = (1.0 + 2.0 * (module / 2) as f64, module % 2 == 1);
        let (y, yaw) = if far { (4.9, -90) } else { (0.1, 90) };
        text += &format!("[[site.module]]\nname = \"m{module}\"\nx = {x}\ny = {y}\nyaw_deg = {yaw}\n");
    }
    for person in 0..PEOPLE {
        let y = 1.0 + 0.6 * person as f64;
        let (from, to, speed) = (1.0 + 0.3 * person as f64, 7.0, 0.8 + 0.1 * person as f64);
        text += &format!(
            "[[person]]\nroute = [[{from}, {y}], [{to}, {y}]]\nrepeat = \"back-and-forth\"\nspeed_m_s = {speed}\nfrom_s = 8\n"
        );
    }
    text
}

fn watch(scans: &Scans) -> Watch {
    let scans = Arc::clone(scans);
    Arc::new(move |module: usize, status: &Status| {
        let now = Instant::now();
        if let Some(Ok(mut times)) = scans.get(module).map(Mutex::lock) {
            let sent = usize::try_from(status.counts.scans_sent).unwrap_or(0);
            let known = times.len();
            times.resize(sent.max(known), now);
        }
    })
}

fn connect(map: &str) -> WebSocket<TcpStream> {
    let host = map.trim_start_matches("http://").trim_end_matches('/');
    let stream = TcpStream::connect(host).expect("the map is there");
    stream.set_nodelay(true).expect("a socket");
    tungstenite::client(format!("ws://{host}/ws"), stream).expect("a WebSocket").0
}

/// Every message of so long, and how many tracks one had on average.
fn listen(socket: &mut WebSocket<TcpStream>, time: Duration) -> (Messages, f64) {
    let (begun, mut messages, mut tracks, mut count) = (Instant::now(), Messages::new(), 0, 0);
    while begun.elapsed() < time {
        let message = socket.read().expect("the tracker goes on");
        let now = Instant::now();
        let value: Value = serde_json::from_str(message.to_text().unwrap_or_default()).unwrap_or_default();
        let report = &value["report"];
        let (Some(module), Some(sequence)) = (report["module"].as_str(), report["sequence"].as_u64()) else {
            continue;
        };
        messages.entry(module.to_owned()).or_default().push((sequence as u32, now));
        tracks += report["tracks"].as_array().map_or(0, Vec::len);
        count += 1;
    }
    (messages, tracks as f64 / f64::from(count.max(1)))
}

/// ms, in order. A report's number and its scan's differ by the same for all of a module: by what they differ most often
/// when each message is compared with the last scan before it.
fn latencies(scene: &Scene, scans: &Scans, messages: &Messages) -> Vec<f64> {
    let mut all = Vec::new();
    for (module, times) in scene.site.modules.iter().zip(scans.iter()) {
        let times = times.lock().expect("no sensor has failed");
        let Some(messages) = messages.get(&module.name) else { continue };
        let before = |at: Instant| times.partition_point(|written| *written < at) as i64 - 1;
        let mut offsets: BTreeMap<i64, usize> = BTreeMap::new();
        for &(sequence, at) in messages {
            *offsets.entry(before(at) - i64::from(sequence)).or_default() += 1;
        }
        let Some((&offset, _)) = offsets.iter().max_by_key(|(_, count)| **count) else { continue };
        for &(sequence, at) in messages {
            let written = usize::try_from(i64::from(sequence) + offset).ok().and_then(|scan| times.get(scan));
            let Some(&written) = written else { continue };
            let (late, early) =
                (at.saturating_duration_since(written), written.saturating_duration_since(at));
            all.push((late.as_secs_f64() - early.as_secs_f64()) * 1e3);
        }
    }
    all.sort_by(f64::total_cmp);
    all
}

fn print(latencies: &[f64], seconds: u64, tracks: f64) {
    let at =
        |share: f64| latencies.get((latencies.len() as f64 * share) as usize).copied().unwrap_or(f64::NAN);
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("scan's last byte written → its track message on a WebSocket");
    println!("  modules               {MODULES} × URG-04LX, {tracks:.1} tracks, {seconds} s");
    println!(
        "  reports               {}, {} a second",
        latencies.len(),
        latencies.len() as u64 / seconds.max(1)
    );
    println!("  median                {:.1} ms", at(0.5));
    println!(
        "  p99                   {:.1} ms    aim: under {AIM_MS} ms on an idle machine of two cores",
        at(0.99)
    );
    println!("  worst                 {:.1} ms", at(1.0 - 1e-9));
    println!("  load of this machine  {}", load.trim());
}
