//! A door with everything around it but sensors: frames made by the test, the doors with their watchdog, and the server.
//!
//! The doors' time goes on with the frames: a machine that stands still for a while makes no trouble, and no time limit
//! at the door runs out while a browser starts.
#![allow(dead_code, reason = "each test uses its own part of it")]

pub mod wrong;

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_tracker::access::Access;
use host_tracker::alarm_handle::AlarmHandle;
use host_tracker::doors::{DoorHandle, Watchdog};
use host_tracker::signs::SignHandle;
use host_tracker::site_file::SiteFile;
use host_tracker::tracker_alarms::TrackerAlarms;
use host_tracker::web::{Server, ServerContext};
use kehai_tracking::estimate::Estimate;
use kehai_tracking::jsonl::{TracksLine, ZoneKnown, ZoneLine};
use kehai_tracking::now::Now;
use kehai_tracking::occupancy::{Found, Total};
use kehai_tracking::site::Module;
use kehai_tracking::snapshot::{ModuleLine, Snapshot, active_alarms, unix_ms};
use serde_json::{Value, json};
use tokio::sync::watch;

pub const SITE: &str = "
[[module]]
name = \"left\"
x = -0.9
y = 0.85
yaw_deg = 0.0

[[zone]]
name = \"area\"
polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
secure = true

[[door]]
without_keys = true
name = \"front\"
zone = \"area\"
line = [[-0.45, 1.0], [0.45, 1.0]]
fail = \"secure\"
ask_s = 600
pass_s = 120
close_s = 120
exit_s = 1
";

/// Between two frames, if the machine is in time.
const STEP: Duration = Duration::from_millis(50);

/// A machine that is late by more makes no more of the doors' time: half of what they would call trouble.
const LATE: Duration = Duration::from_millis(500);

/// A hundred times what a loaded machine needs.
pub const PATIENCE: Duration = Duration::from_secs(60);

pub struct DoorServer {
    pub doors: DoorHandle,
    pub signs: SignHandle,
    watchdog: Option<Watchdog>,
    pub server: Server,
    /// The people's positions, m.
    people: Arc<Mutex<Vec<[f64; 2]>>>,
    ids: Mutex<u64>,
    more: Arc<Mutex<Vec<mpsc::SyncSender<Arc<Snapshot>>>>>,
    stop: Arc<AtomicBool>,
    /// Whether the tracker is dead: time goes on, and no frames come.
    dead: Arc<AtomicBool>,
    feeding: Option<JoinHandle<()>>,
    folder: tempfile::TempDir,
}

impl DoorServer {
    pub fn new() -> Self {
        Self::of(SITE)
    }

    /// A site with more in it than [`SITE`].
    pub fn of(site: &str) -> Self {
        Self::with_access(site, Access::open())
    }

    /// The same where not all may do everything.
    pub fn with_access(site: &str, access: Access) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("server.toml");
        std::fs::write(&path, site).unwrap();
        let file = SiteFile::load(&path).unwrap();
        let (newest_in, newest) = watch::channel(Arc::default());
        let passed = Arc::new(Mutex::new(Duration::ZERO));
        let time = Arc::clone(&passed);
        let clock = Box::new(move || time.lock().unwrap().as_secs_f64());
        let doors = DoorHandle::timed(clock, &file.current().site, None);
        let watchdog = Some(Watchdog::start(doors.clone(), TrackerAlarms::default()).unwrap());
        let signs = SignHandle::new(&file.current().site, None);
        let (observed, named) = (doors.clone(), signs.clone());
        let watches = |module: &Module| ModuleLine {
            name: module.name.clone(),
            unused_s: Some(0.0),
            is_sealed: true,
            ..ModuleLine::default()
        };
        let watching: Vec<ModuleLine> = file.current().site.modules.iter().map(watches).collect();
        let people: Arc<Mutex<Vec<[f64; 2]>>> = Arc::default();
        let (stop, dead) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let is_dead = Arc::clone(&dead);
        let more: Arc<Mutex<Vec<mpsc::SyncSender<Arc<Snapshot>>>>> = Arc::default();
        let others = Arc::clone(&more);
        let listed = AlarmHandle::default();
        let lists = listed.clone();
        let (places, stopped) = (Arc::clone(&people), Arc::clone(&stop));
        let feeding = std::thread::spawn(move || {
            let mut last = Instant::now();
            while !stopped.load(Ordering::Relaxed) {
                let mut frame = frame(&places.lock().unwrap());
                if !is_dead.load(Ordering::SeqCst) {
                    frame.line.t = passed.lock().unwrap().as_secs_f64();
                    (frame.names, frame.signs) = named.observe(&estimate(&frame));
                    frame.doors = observed.observe(&estimate(&frame), &watching);
                    let active = active_alarms(&[], &frame.modules, &frame.doors);
                    frame.alarms =
                        lists.observe(Now { steady_s: frame.line.t, unix_ms: frame.unix_ms }, active);
                }
                let frame = Arc::new(frame);
                newest_in.send_replace(Arc::clone(&frame));
                for other in others.lock().unwrap().iter() {
                    let _ = other.try_send(Arc::clone(&frame));
                }
                *passed.lock().unwrap() += last.elapsed().min(LATE);
                last = Instant::now();
                std::thread::sleep(STEP);
            }
        });
        let edited = doors.clone();
        let changed = move |site| {
            edited.may_change_site().map_err(|in_use| in_use.to_string())?;
            edited.change_site(&site);
            Ok(())
        };
        let context = ServerContext {
            changed: Box::new(changed),
            doors: Some(doors.clone()),
            signs: Some(signs.clone()),
            access,
            listed,
            ..ServerContext::alone(newest, file)
        };
        let server = Server::start(SocketAddr::from(([127, 0, 0, 1], 0)), context).unwrap();
        let (ids, feeding) = (Mutex::new(0), Some(feeding));
        Self { doors, signs, watchdog, server, people, ids, more, stop, dead, feeding, folder }
    }

    /// The text of its site file.
    pub fn site(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("server.toml")).unwrap()
    }

    /// Every frame from now on.
    pub fn frames(&self) -> mpsc::Receiver<Arc<Snapshot>> {
        let (sender, frames) = mpsc::sync_channel(64);
        self.more.lock().unwrap().push(sender);
        frames
    }

    /// Sets where the people are from now on.
    pub fn people(&self, places: &[[f64; 2]]) {
        *self.people.lock().unwrap() = places.to_vec();
        std::thread::sleep(Duration::from_millis(200));
    }

    /// From now on there are no frames, or there are again.
    pub fn tracker_is_dead(&self, dead: bool) {
        self.dead.store(dead, Ordering::SeqCst);
    }

    /// Status and answer.
    pub fn ask(&self, line: &str, headers: &[(&str, &str)], body: &str) -> (u16, Value) {
        let (status, answer) = crate::http_client::ask(self.server.address(), line, headers, body.as_bytes());
        (status, serde_json::from_str(&answer).unwrap_or(Value::Null))
    }

    /// A message with a number and a stamp of its own.
    pub fn message(&self, mut body: Value) -> String {
        let mut id = self.ids.lock().unwrap();
        *id += 1;
        body["id"] = json!(*id);
        body["at_ms"] = json!(unix_ms());
        body.to_string()
    }

    /// Tells the door something new.
    pub fn tell(&self, input: &str, body: Value) -> (u16, Value) {
        let body = self.message(body);
        self.ask(&format!("POST /api/door/front/{input}"), &[], &body)
    }

    /// One person stands before the shut leaf, shows a card and is alone: the door unlocks.
    #[track_caller]
    pub fn lets_one_in(&self) {
        self.people(&[[0.0, 0.4]]);
        assert_eq!(self.tell("contact", json!({ "contact": "shut" })).0, 200);
        assert_eq!(self.tell("card", json!({ "card": "04:A2:2B:77" })).0, 200);
        self.waits_for("asked");
        assert_eq!(self.tell("number", json!({ "number": 1 })).0, 200);
        self.waits_for("unlocked");
    }

    /// That person opens the leaf and goes in.
    #[track_caller]
    pub fn goes_through(&self) {
        assert_eq!(self.tell("contact", json!({ "contact": "open" })).0, 200);
        self.people(&[[0.0, 0.95]]);
        self.people(&[[0.0, 1.4]]);
    }

    pub fn door(&self) -> Value {
        self.ask("GET /api/door/front", &[], "").1
    }

    /// The door, without what changes by itself.
    pub fn still(&self) -> Value {
        let mut door = self.door();
        for key in ["unix_ms", "names"] {
            door.as_object_mut().unwrap().remove(key);
        }
        door
    }

    /// Until the door is in this phase.
    #[track_caller]
    pub fn waits_for(&self, phase: &str) -> Value {
        self.waits_until(phase, |door| door["phase"] == phase)
    }

    /// Until the door is so.
    #[track_caller]
    pub fn waits_until(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let door = self.door();
            if is_so(&door) {
                return door;
            }
            assert!(begun.elapsed() < PATIENCE, "{what} does not come: {door:#}");
            std::thread::sleep(STEP);
        }
    }
}

impl Drop for DoorServer {
    fn drop(&mut self) {
        self.watchdog = None;
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.feeding.take().map(JoinHandle::join);
    }
}

/// What the tracker knows at the time of a snapshot.
fn estimate(snapshot: &Snapshot) -> Estimate {
    let (tracks, zones) = (snapshot.tracks.clone(), snapshot.line.zones.clone());
    Estimate { t_s: snapshot.line.t, tracks, zones, ..Estimate::default() }
}

fn frame(people: &[[f64; 2]]) -> Snapshot {
    let mut line = TracksLine::default();
    for (id, [x, y]) in (1..).zip(people) {
        let track = json!({ "id": id, "x": x, "y": y, "state": "confirmed" });
        line.tracks.push(serde_json::from_value(track).unwrap());
    }
    let inside = people.iter().filter(|[_, y]| y.abs() < 1.0).count();
    let mut p = vec![0.0; inside + 1];
    p[inside] = 1.0;
    let zone = ZoneLine::new(Found::inside(inside as u32, p), 1.0, ZoneKnown::Known);
    line.zones.insert("area".into(), zone);
    let total = Total { count: Some(inside as u32), state: ZoneKnown::Known };
    Snapshot { total, ..Snapshot::of(unix_ms(), line) }
}
