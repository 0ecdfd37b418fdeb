//! What a flood of false announcements costs: memory, and datagrams to addresses that never answer.
//!
//! ```text
//!   namespace of its own:  v0 10.7.0.9 ─┬─ forger ── announcements, half of them of other networks ──▶ 224.0.0.251
//!                                          └─ tracker ── asks 256 of those at most, ever more seldom
//! ```
//!
//! Where the system makes no namespaces it is left out with a message; under CI it fails. `KEHAI_FLOOD_SECONDS=600` for as long
//! as that.
#![cfg(target_os = "linux")]

mod described;
mod flood;
mod hall;

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::process::Command;
use std::time::{Duration, Instant};

use flood::{Exits, Figures, ask};
use hall::Tracker;
use kehai_tracking::snapshot::Snapshot;

/// A network with one host.
const NETWORK: &str = "ip link set lo up && ip link add v0 type veth peer name v1 && ip link set v1 up && \
                       ip addr add 10.7.0.9/16 dev v0 && ip link set v0 up && \
                       ip route add 224.0.0.0/4 dev v0 && exec \"$0\" \"$@\"";

/// Set in that network.
const INSIDE: &str = "KEHAI_TEST_NETWORK";

/// Where modules announce themselves.
const GROUP: (Ipv4Addr, u16) = (Ipv4Addr::new(224, 0, 0, 251), 5353);

/// A flood, if nothing else is said.
const SHORT_S: f64 = 6.0;

/// Announcements at once, and the pause after them: 1000 a second.
const BATCH: u32 = 10;
const PAUSE: Duration = Duration::from_millis(10);

/// Devices that are looked for at most, and how often each is asked at most, with the questions of DNS-SD beside it.
const ASKED_MOST: u64 = 256;

/// Growth of memory after the first quarter that is none, kB: two searches that are full, 1024 instances of 3 kB.
const NOISE_KB: u64 = 6000;

/// Descriptors of a search that begins while the one before ends, which has a thread.
const SEARCH: usize = 8;

/// A name of DNS.
fn name(labels: &[&str]) -> Vec<u8> {
    let label = |label: &&str| [&[label.len() as u8], label.as_bytes()].concat();
    [labels.iter().flat_map(label).collect::<Vec<u8>>(), vec![0]].concat()
}

/// The announcement of a module with this number, at this address.
fn announcement(number: u32, address: Ipv4Addr) -> Vec<u8> {
    let (instance, host) = (format!("kehai-{number:06x}"), format!("evil-{number:06x}"));
    let service = ["_kehai", "_udp", "local"];
    let (service_name, full) = (name(&service), name(&[&[instance.as_str()], &service[..]].concat()));
    let host_name = name(&[&host, "local"]);
    let text = format!("id=0200{number:08x}");
    let text = [&[text.len() as u8], text.as_bytes()].concat();
    let place = [&[0, 0, 0, 0][..], &4040_u16.to_be_bytes(), &host_name].concat();
    let record = |name: &[u8], kind: u16, class: u16, data: &[u8]| {
        let numbers = [kind.to_be_bytes(), class.to_be_bytes(), [0, 0], 4500_u16.to_be_bytes()].concat();
        [name, &numbers, &(data.len() as u16).to_be_bytes(), data].concat()
    };
    // PTR, SRV, TXT and A.
    [
        vec![0, 0, 0x84, 0, 0, 0, 0, 4, 0, 0, 0, 0],
        record(&service_name, 12, 1, &full),
        record(&full, 33, 0x8001, &place),
        record(&full, 16, 0x8001, &text),
        record(&host_name, 1, 0x8001, &address.octets()),
    ]
    .concat()
}

/// Datagrams that all programs of this network have sent.
fn sent() -> u64 {
    let table = std::fs::read_to_string("/proc/net/snmp").unwrap();
    let mut lines = table.lines().filter_map(|line| line.strip_prefix("Udp: "));
    let column = lines.next().unwrap().split(' ').position(|name| name == "OutDatagrams").unwrap();
    lines.next().unwrap().split(' ').nth(column).unwrap().parse().unwrap()
}

fn snapshot(map: SocketAddr) -> Snapshot {
    let answer = ask(map, "GET /api/state").unwrap();
    serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap()
}

#[test]
fn f5_f7_a_flood_of_announcements_is_bounded() {
    if std::env::var_os(INSIDE).is_some() {
        return flooded();
    }
    let own = std::env::current_exe().unwrap();
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "--net", "sh", "-c"]).arg(NETWORK).arg(own);
    command.args(["--exact", "f5_f7_a_flood_of_announcements_is_bounded", "--nocapture"]).env(INSIDE, "1");
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if !text.contains("running 1 test") {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        return test_support::fail_in_ci_else_skip(format!("no network of its own: {why}"));
    }
    println!("{text}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn flooded() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    std::fs::write(&site, flood::SITE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(["run", "--http", "0", "--door-http", "0", "--site"]).arg(&site);
    let tracker = Tracker::start(command);
    let address = |text: String| text.split('/').next().unwrap().parse::<SocketAddr>().unwrap();
    let map = address(tracker.says("live map at http://"));
    let doors = address(tracker.says("messages to doors at http://"));
    let process = tracker.process.id();
    let forger = UdpSocket::bind("10.7.0.9:0").unwrap();
    let lasts = Duration::from_secs_f64(flood::seconds().unwrap_or(SHORT_S));
    let (exits, begun, before) = (Exits::begin(doors), Instant::now(), sent());
    let (mut first, mut later) = (Figures::default(), Figures::default());
    let mut number = 0;
    while begun.elapsed() < lasts {
        for _ in 0..BATCH {
            number += 1;
            let host = (number >> 1) as u8;
            let address = if number % 2 == 0 {
                Ipv4Addr::new(203, 0, 113, host)
            } else {
                Ipv4Addr::new(192, 168, 7, host)
            };
            forger.send_to(&announcement(number, address), GROUP).unwrap();
        }
        let figures = Figures::of(process);
        if begun.elapsed() < lasts / 4 {
            first = first.worst(figures)
        } else {
            later = later.worst(figures)
        }
        std::thread::sleep(PAUSE);
    }
    let (seconds, asked) = (begun.elapsed().as_secs_f64(), sent() - before - u64::from(number));
    let (taken, refused) = (exits.end(), snapshot(map).refused);
    println!(
        "{number} announcements: {first}; later {later}; {asked} datagrams of the tracker, {:.0} a second; {refused:?}; {taken}",
        asked as f64 / seconds
    );
    assert!(refused.outside > 100, "{refused:?}");
    assert!(asked as f64 <= ASKED_MOST as f64 * (seconds + 1.0), "{asked}");
    assert!(later.rss_kb <= first.rss_kb + NOISE_KB, "{later}; at first {first}");
    assert!(later.descriptors <= first.descriptors + SEARCH, "{later}; at first {first}");
    assert!(later.threads <= first.threads + 1, "{later}; at first {first}");
}
