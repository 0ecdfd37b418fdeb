//! Areas over Zenoh on this machine: two trackers, a router or none, and the service that puts them together.
//!
//! ```text
//!   Area east ──╮                 ╭──▶ frames, /api/state
//!   Area west ──┴─ (router) ──────┴─ Together
//!   a process of its own: killed, stopped
//! ```
#![cfg(feature = "zenoh")]

use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_tracker::access::Access;
use host_tracker::areas::{Area, AreaSettings, CampusSettings, Network, Together, TogetherSettings};
use host_tracker::firmware::folder::FirmwareFolder;
use host_tracker::map::Map;
use host_tracker::tracker_alarms::TrackerAlarms;
use host_tracker::web::Bind;
use kehai_emulator::ports::free_tcp;
use kehai_tracking::jsonl::{TrackLine, TracksLine, ZoneLine};
use kehai_tracking::occupancy::{Found, ZoneKnown};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot, unix_ms};
use serde_json::{Value, json};
use tokio::sync::watch;
use zenoh::{Config, Wait};

const SITE: &str = "
[[module]]
name = \"left\"
x = 0
y = 0
[[zone]]
name = \"hall\"
polygon = [[-9, -9], [9, -9], [9, 9], [-9, 9]]
count = true
";

/// A moment of the frames.
const EVERY: Duration = Duration::from_millis(100);

/// An area is unknown within this of its loss.
const LOST: Duration = Duration::from_secs(3);

/// Anything else happens within this, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// What Zenoh says, which is shown when a test has failed.
fn say(text: &str) {
    println!("{text}");
}

/// Zenoh's configuration: an end that listens at a port, or connects to it, and to no other.
fn config(mode: &str, end: &str, port: u16) -> String {
    json!({
        "mode": mode,
        end: { "endpoints": [format!("tcp/127.0.0.1:{port}")] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
    })
    .to_string()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn network(&self, name: &str, mode: &str, end: &str, port: u16) -> (Network, PathBuf) {
        let file = self.0.path().join(format!("{name}.json5"));
        fs::write(&file, config(mode, end, port)).unwrap();
        (Network::File(file.clone()), file)
    }

    fn together(&self, network: Network, http: bool) -> Together {
        let map = http.then(|| Map {
            listen: Bind { address: SocketAddr::from(([127, 0, 0, 1], 0)), certificate: None },
            doors: None,
            names: Vec::new(),
            firmware: FirmwareFolder::default(),
            access: Access::open(),
            insecure: false,
        });
        let campus = CampusSettings {
            site: "campus".parse().unwrap(),
            expected: vec!["east".parse().unwrap(), "west".parse().unwrap()],
            network,
        };
        let path = self.0.path().join("campus.toml");
        Together::start(TogetherSettings { campus, path, map, mqtt: None }, say).unwrap()
    }
}

/// An area with one person in its hall, whose clock is `off_ms` from this machine's.
struct Tracker {
    _area: Area,
    stop: Sender<()>,
    frames: Option<JoinHandle<()>>,
}

impl Tracker {
    fn start(area: &str, network: Network, x: f64, off_ms: u64) -> Self {
        let (frames_in, frames) = channel();
        let (stop, stopped) = channel::<()>();
        let (site, _) = watch::channel(Arc::new(Site::parse("hall.toml", SITE).unwrap()));
        let settings = AreaSettings { place: format!("campus/{area}").parse().unwrap(), network };
        let site_of = site.subscribe();
        let area = Area::start(settings, frames, site_of, TrackerAlarms::default(), say).unwrap();
        let frames = std::thread::spawn(move || {
            let _site = site;
            while stopped.recv_timeout(EVERY).is_err_and(|error| !error.to_string().contains("disconnected"))
            {
                let _ = frames_in.send(Arc::new(frame(x, unix_ms() - off_ms)));
            }
        });
        Self { _area: area, stop, frames: Some(frames) }
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        let _ = self.stop.send(());
        let _ = self.frames.take().unwrap().join();
    }
}

fn frame(x: f64, unix_ms: u64) -> Snapshot {
    let track = json!({ "id": 7, "x": x, "y": 0.0, "state": "confirmed", "cov": [0.002, 0.0, 0.002] });
    let track: TrackLine = serde_json::from_value(track).unwrap();
    let zone = ZoneLine::new(Found::inside(1, vec![0.0, 1.0]), 1.0, ZoneKnown::Known);
    let line = TracksLine { t: 0.0, tracks: vec![track], zones: [("hall".to_owned(), zone)].into() };
    let module = ModuleLine { name: "left".into(), state: DeviceState::Watching, ..ModuleLine::default() };
    Snapshot { modules: vec![module], ..Snapshot::of(unix_ms, line) }
}

/// Waits until a picture is as wanted; how long that took.
fn wait(together: &Together, what: &str, at_most: Duration, is: impl Fn(&Snapshot) -> bool) -> Duration {
    let begun = Instant::now();
    let frames = together.frames();
    loop {
        let picture = Arc::clone(&frames.borrow());
        if is(&picture) {
            return begun.elapsed();
        }
        assert!(
            begun.elapsed() < at_most,
            "{what}: not within {at_most:?}: {:?}, {:?}",
            picture.total,
            picture.line.zones
        );
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn counts(picture: &Snapshot) -> [Option<u32>; 2] {
    ["east/hall", "west/hall"].map(|zone| picture.line.zones.get(zone).and_then(ZoneLine::count))
}

/// Both are heard, with one person each.
fn is_whole(picture: &Snapshot) -> bool {
    picture.total.count == Some(2)
        && picture.total.state == ZoneKnown::Known
        && counts(picture) == [Some(1); 2]
}

/// The east is unknown, and so is the total; the west is unharmed.
fn has_lost_east(picture: &Snapshot) -> bool {
    counts(picture) == [None, Some(1)]
        && picture.total.state == ZoneKnown::Partly
        && picture.alarms.iter().any(|alarm| alarm.text.contains("area east"))
}

#[test]
fn two_areas_are_one_site_and_one_that_ends_is_unknown_at_once() {
    let (folder, port) = (Folder::new(), free_tcp().unwrap());
    let together = folder.together(folder.network("site", "peer", "listen", port).0, true);
    let network = || folder.network("area", "peer", "connect", port).0;
    let east = Tracker::start("east", network(), 5.0, 0);
    // The clock of its machine is two seconds behind.
    let _west = Tracker::start("west", network(), -5.0, 2000);
    wait(&together, "both are heard", PATIENCE, is_whole);
    let address = together.map_address().unwrap();
    let agent = ureq::Agent::new_with_defaults();
    let get = |path: &str| -> Value {
        let text =
            agent.get(format!("http://{address}{path}")).call().unwrap().body_mut().read_to_string().unwrap();
        serde_json::from_str(&text).unwrap()
    };
    // The total is known once both have said their sites.
    let site = get("/api/site");
    assert_eq!(site["site"]["zone"][1]["name"], "west/hall", "{site}");
    let state = get("/api/state");
    assert_eq!((&state["total"]["count"], &state["tracks"][1]["id"]), (&json!(2), &json!(2)));
    assert!(state["modules"].as_array().unwrap().iter().any(|module| module["name"] == "east/left"));
    // It is changed on the map of the area.
    let edit =
        json!({ "site": site["site"], "revision": site["revision"], "base": site["site"] }).to_string();
    let refused = agent
        .put(format!("http://{address}/api/site"))
        .header("Content-Type", "application/json")
        .send(&edit);
    assert!(matches!(refused, Err(ureq::Error::StatusCode(403))), "{refused:?}");
    drop(east);
    let took = wait(&together, "the east has ended", LOST, has_lost_east);
    println!("an area that ended was unknown after {} ms", took.as_millis());
    // The list of alarms has what the picture has, and they are acknowledged elsewhere.
    let listed = get("/api/alarms")["standing"].clone();
    let silent = listed.as_array().unwrap().iter().find(|alarm| alarm["of"] == "east").unwrap();
    assert_eq!((&silent["source"], &silent["name"]), (&json!("area"), &json!("silent")), "{listed}");
    let acknowledged = agent
        .post(format!("http://{address}/api/alarms/acknowledge"))
        .header("Content-Type", "application/json")
        .send(json!({ "ids": [silent["id"]] }).to_string());
    assert!(matches!(acknowledged, Err(ureq::Error::StatusCode(403))), "{acknowledged:?}");
    let _east = Tracker::start("east", network(), 5.0, 0);
    wait(&together, "it is back", PATIENCE, is_whole);
}

#[test]
fn the_router_is_gone_and_comes_back_and_all_join_again() {
    let (folder, port) = (Folder::new(), free_tcp().unwrap());
    let router =
        || zenoh::open(Config::from_json5(&config("router", "listen", port)).unwrap()).wait().unwrap();
    let first = router();
    let network = || folder.network("client", "client", "connect", port).0;
    let together = folder.together(network(), false);
    let _trackers = [("east", 5.0), ("west", -5.0)].map(|(area, x)| Tracker::start(area, network(), x, 0));
    wait(&together, "both are heard", PATIENCE, is_whole);
    first.close().wait().unwrap();
    wait(&together, "nothing is known", LOST, |picture| {
        counts(picture) == [None; 2] && picture.total.count.is_none()
    });
    let _again = router();
    let took = wait(&together, "all are back", PATIENCE, is_whole);
    println!("a router that came back was joined after {} ms", took.as_millis());
}

/// The east as a process of its own: this program, told by its environment to be that and nothing else.
const ALONE: &str = "KEHAI_TEST_AREA";

#[test]
fn an_area_in_a_process_of_its_own() {
    let Ok(file) = std::env::var(ALONE) else { return };
    let _tracker = Tracker::start("east", Network::File(file.into()), 5.0, 0);
    std::thread::sleep(Duration::from_secs(600));
}

struct Process(Child);

impl Process {
    fn start(file: &PathBuf) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "an_area_in_a_process_of_its_own"]).env(ALONE, file).stdout(Stdio::null());
        Self(command.spawn().unwrap())
    }

    fn signal(&self, name: &str) {
        let status = Command::new("kill").args(["-s", name, &self.0.id().to_string()]).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn an_area_that_is_killed_or_hangs_is_unknown_within_three_seconds_and_the_other_unharmed() {
    let (folder, port) = (Folder::new(), free_tcp().unwrap());
    let together = folder.together(folder.network("site", "peer", "listen", port).0, false);
    let (network, file) = folder.network("area", "peer", "connect", port);
    let _west = Tracker::start("west", network, -5.0, 0);
    let east = Process::start(&file);
    wait(&together, "both are heard", PATIENCE, is_whole);
    // It hangs, and its connection stays.
    east.signal("STOP");
    let hung = wait(&together, "the east hangs", LOST, has_lost_east);
    east.signal("CONT");
    wait(&together, "it goes on", PATIENCE, is_whole);
    east.signal("KILL");
    let killed = wait(&together, "the east is killed", LOST, has_lost_east);
    let _again = Process::start(&file);
    wait(&together, "it is back", PATIENCE, is_whole);
    println!("unknown {} ms after SIGSTOP, {} ms after SIGKILL", hung.as_millis(), killed.as_millis());
}
