//! `kehai-sim floor` as people meet it: a host counts who walks on it; and its refusals.

#[path = "support/program.rs"]
mod program;

use std::net::{SocketAddr, UdpSocket};
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use kehai::wire::DATAGRAM_MAX;
use kehai_tracking::occupancy::ZoneLine;
use kehai_tracking::registry::Registry;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::snapshot::DeviceState;
use kehai_tracking::tracker::Selected;
use program::{Program, word};

const SITE: &str = "[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 24\nrows = 24\n
    [[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1.92, 0], [1.92, 1.92], [0, 1.92]]\ncount = true\n";

/// Longest wait, a hundred times what it needs.
const PATIENCE: Duration = Duration::from_secs(120);

/// Follows the floor at `address` until `is_enough` of what is known of the hall, and the floor is watching, without an
/// alarm.
fn follow(address: SocketAddr, mut is_enough: impl FnMut(&ZoneLine) -> bool) -> ZoneLine {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.set_read_timeout(Some(Duration::from_millis(20))).expect("a time");
    let site = Arc::new(Site::parse("test.toml", SITE).expect("a site"));
    let mut registry = Registry::new(Arc::clone(&site), &[address]);
    let mut site_tracker = SiteTracker::new(&site, Selected::default());
    let begin = Instant::now();
    let mut buffer = [0; DATAGRAM_MAX];
    loop {
        assert!(begin.elapsed() < PATIENCE, "not yet");
        let now_us = begin.elapsed().as_micros() as u64 + 1;
        let send = |bytes: &[u8], to: SocketAddr| _ = socket.send_to(bytes, to);
        registry.poll(site_tracker.sessions_mut(), now_us, send);
        let Ok((length, from)) = socket.recv_from(&mut buffer) else { continue };
        let now_us = begin.elapsed().as_micros() as u64 + 1;
        let sessions = site_tracker.sessions_mut();
        let Some(datagram) = sessions.decode(&buffer[..length]) else { continue };
        if !registry.admit(from, &datagram, sessions, now_us).is_used {
            continue;
        }
        let observation = site_tracker.follow(&datagram, now_us);
        registry.heard(from, &datagram, observation, site_tracker.sessions_mut(), now_us, send);
        let hall = site_tracker.estimate(now_us as f64 * 1e-6).zones["hall"].clone();
        let lines = registry.update_lines(site_tracker.sessions_mut(), now_us);
        let watches = lines.iter().all(|line| line.state == DeviceState::Watching && line.alarms.is_empty());
        if is_enough(&hall) && watches {
            return hall;
        }
    }
}

#[test]
fn a_host_counts_the_people_on_a_floor_and_does_not_call_it_empty() {
    let floor = ["floor", "--name", "mat", "--people", "2", "--listen", "127.0.0.1:0"];
    let (floor, line) = Program::start(&floor, " at ");
    let address = word(&line, " at ").parse().expect("an address");
    let mut seen = Vec::new();
    let hall = follow(address, |hall| {
        seen.push(hall.count());
        seen.len() > 40 && hall.count() == Some(2)
    });
    assert!(hall.seen_share() > 0.99, "{hall:?}");
    assert!(!seen.contains(&Some(0)), "{seen:?}");
    floor.interrupt();
}

#[test]
fn a_floor_without_people_is_known_to_be_empty() {
    let (floor, line) =
        Program::start(&["floor", "--name", "mat", "--people", "0", "--listen", "127.0.0.1:0"], " at ");
    let hall = follow(word(&line, " at ").parse().expect("an address"), |hall| hall.count().is_some());
    assert_eq!(hall.count(), Some(0));
    floor.interrupt();
}

#[test]
fn what_no_floor_can_have_is_refused_in_one_line() {
    for (arguments, wanted) in [
        (["--columns", "40", "--rows", "40"], "a floor has 1 to 1024 panels"),
        (["--stuck", "576", "--rows", "24"], "panel 576: the last one is 575"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_kehai-sim"))
            .arg("floor")
            .args(arguments)
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(wanted) && said.lines().count() == 1, "{said}");
    }
}
