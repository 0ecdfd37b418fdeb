//! The tracking loop: each datagram is decoded once, and doors have seen what their snapshot shows.

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use host_tracker::doors::DoorHandle;
use host_tracker::net::tracking::{Parts, TrackingLoop};
use host_tracker::reports::Reports;
use kehai::scan::{Geometry, URG_04LX};
use kehai::seal::{Nonces, Role};
use kehai::wire::{
    Cookie, DATAGRAM_MAX, Identity, Incoming, Info, List, Message, ModuleId, Report, ReportHead, Request,
    SensorInfo, Subscribed,
};
use kehai_tracking::door::{Phase, Trouble};
use kehai_tracking::keys::{Clear, Keys, Links};
use kehai_tracking::registry::Registry;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;

const SITE: &str = r#"
    [[module]]
    name = "left"
    x = 0.0
    y = 0.0
    [[zone]]
    name = "area"
    polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    [[door]]
    without_keys = true
    name = "front"
    zone = "area"
    line = [[-0.5, 1], [0.5, 1]]
    fail = "secure"
"#;

const DEVICE: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);

fn tracking(devices: &[SocketAddr], parts: Parts) -> TrackingLoop {
    let site: Arc<Site> = Arc::new(toml::from_str(SITE).unwrap());
    let registry = Registry::new(Arc::clone(&site), devices);
    let site_tracker = SiteTracker::new(&site, Selected::default());
    let links = Links::new(Arc::new(Keys::none()), Role::Read, Nonces::new([0; 16]), Clear::Believed);
    TrackingLoop::new(TrackingLoop::bind().unwrap(), (registry, links), None, site_tracker, parts).unwrap()
}

/// What a device answers to a host's request, and then its reports.
fn answers(request: &[u8]) -> Vec<Message<'static>> {
    let incoming = Incoming::open(request).unwrap();
    let (request_id, device) = (incoming.request_id, Identity { module: DEVICE, boot: 1 });
    let geometry = Geometry::new(URG_04LX).unwrap();
    let info = Info {
        request_id,
        version_min: 1,
        version_max: 1,
        firmware: "",
        build: "",
        board: "",
        name: "left",
        uptime_us: 0,
        setup: 1,
        background_version: 0,
        sensor: Some(SensorInfo::new(["URG-04LX", "H1", "1"], &geometry, 0, 2000)),
    };
    let subscribed = |t1| Subscribed {
        request_id,
        t1,
        t2_us: 1_000_000,
        t3_us: 1_000_000,
        lease_ms: 5000,
        subscribers: 1,
        may_control: true,
    };
    let report = |sequence| {
        let head = ReportHead { sequence, setup: 1, stamp_us: 900_000, ..ReportHead::default() };
        Message::Report(Report {
            head,
            candidates: List::default(),
            unseen: List::default(),
            sizes: List::default(),
        })
    };
    match incoming.request(device) {
        Ok(Request::Subscribe { t1 }) if incoming.cookie == Cookie::NONE => {
            vec![Message::Cookie { request_id, t1, cookie: Cookie([7; 8]) }]
        }
        Ok(Request::Subscribe { t1 }) => vec![Message::Subscribed(subscribed(t1))],
        Ok(Request::Info) => [Message::Info(info)].into_iter().chain((1..=20).map(report)).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn a_datagram_is_decoded_once_whatever_listens() {
    let device = UdpSocket::bind("127.0.0.1:0").unwrap();
    device.set_nonblocking(true).unwrap();
    let reports = Reports::default();
    let _listener = reports.listen();
    let mut tracking = tracking(&[device.local_addr().unwrap()], Parts { reports, ..Parts::default() });
    let host = SocketAddr::from(([127, 0, 0, 1], tracking.local_address().unwrap().port()));
    let (mut sent, mut request) = (0, [0; DATAGRAM_MAX]);
    // The loopback loses nothing; the last one has arrived once it is counted as unreadable.
    while tracking.sessions().drops().unreadable == 0 {
        tracking.snapshot().unwrap();
        while let Ok((length, _)) = device.recv_from(&mut request) {
            for message in answers(&request[..length]) {
                let mut datagram = [0; DATAGRAM_MAX];
                let length = message.encode(Identity { module: DEVICE, boot: 1 }, &mut datagram).unwrap();
                device.send_to(&datagram[..length], host).unwrap();
                sent += 1;
            }
            if sent > 20 {
                device.send_to(b"no message of a device", host).unwrap();
                break;
            }
        }
    }
    let used: u64 = tracking.sessions().iter().map(|session| session.reports()).sum();
    assert_eq!((tracking.sessions().decoded(), used), (sent + 1, 20));
}

#[test]
fn there_is_one_place_that_decodes() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut decoding: Vec<PathBuf> = Vec::new();
    for folder in ["tracking/src", "host-tracker/src"] {
        sources(&crates.join(folder), &mut |file, text| {
            let production = text.split("#[cfg(test)]").next().unwrap_or_default();
            if !file.ends_with("tests.rs") && production.contains("Message::decode(") {
                decoding.push(file.strip_prefix(crates).unwrap().to_path_buf());
            }
        });
    }
    decoding.sort();
    // The client is the commands', which ask one device one thing; the daemon has the other.
    let expected = ["host-tracker/src/net/client.rs", "tracking/src/session/datagram.rs"];
    assert_eq!(decoding, expected.map(PathBuf::from));
}

fn sources(folder: &Path, look: &mut impl FnMut(&Path, &str)) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, look);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            look(&path, &std::fs::read_to_string(&path).unwrap());
        }
    }
}

#[test]
fn the_very_first_snapshot_shows_doors_that_have_seen_it() {
    let site: Site = toml::from_str(SITE).unwrap();
    let doors = DoorHandle::new(&site, None);
    let mut tracking = tracking(&[], Parts { doors: Some(doors), ..Parts::default() });
    let snapshot = tracking.snapshot().unwrap();
    let [door] = snapshot.doors.as_slice() else { panic!("{:?}", snapshot.doors) };
    // Starting is what a door is that has seen nothing; the device that is missing in this snapshot is known to it.
    assert_eq!((door.phase, door.trouble), (Phase::Failed, Some(Trouble::ModuleLost)));
}
