//! A real broker, a client that hears everything, and a tracker that makes frames.

use std::collections::BTreeMap;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, LazyLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_tracker::mqtt::{Settings, Topics};
use host_tracker::tracker_alarms::TrackerAlarms;
use kehai_emulator::ports::free_tcp;
use kehai_tracking::jsonl::{ZoneKnown, ZoneLine};
use kehai_tracking::occupancy::Found;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use tokio::sync::watch;

/// A hundred times what a loaded machine needs.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Where mosquitto is; None: it is not installed, which fails in CI only.
pub fn mosquitto() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let places = std::env::split_paths(&path).chain([PathBuf::from("/usr/sbin")]);
    let found = places.map(|place| place.join("mosquitto")).find(|file| file.is_file());
    if found.is_none() {
        test_support::fail_in_ci_else_skip("no mosquitto (Debian: apt-get install mosquitto)");
    }
    found
}

/// A broker that keeps nothing when it goes away.
pub struct Broker {
    program: PathBuf,
    pub port: u16,
    file: PathBuf,
    child: Option<Child>,
}

impl Broker {
    pub fn start(program: &Path) -> Self {
        Self::with(program, "allow_anonymous true\n")
    }

    /// With further lines in its file.
    pub fn with(program: &Path, more: &str) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let port = free_tcp().unwrap();
        let name =
            format!("mosquitto-{}-{}.conf", std::process::id(), NUMBER.fetch_add(1, Ordering::Relaxed));
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let text = format!("listener {port} 127.0.0.1\n{more}persistence false\nset_tcp_nodelay true\n");
        std::fs::write(&file, text).unwrap();
        let mut broker = Self { program: program.to_owned(), port, file, child: None };
        broker.come();
        broker
    }

    pub fn come(&mut self) {
        let mut command = Command::new(&self.program);
        command.arg("-c").arg(&self.file).stdout(Stdio::null()).stderr(Stdio::null());
        self.child = Some(command.spawn().unwrap());
        let begin = Instant::now();
        while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            assert!(begin.elapsed() < PATIENCE, "the broker comes up");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    pub fn go(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.go();
        let _ = std::fs::remove_file(&self.file);
    }
}

/// A client that listens to everything, and what it knows: the newest payload of each topic.
pub struct Listener {
    pub client: Client,
    messages: Receiver<(String, String)>,
    pub known: BTreeMap<String, String>,
    /// Everything that came, in order.
    pub all: Vec<(String, String)>,
}

/// What a test leaves at the broker as if an earlier tracker had.
pub const OLD: &str = "old";

#[track_caller]
fn is_described(topic: &str, payload: &str) {
    if payload != OLD {
        crate::described::published(topic, payload);
    }
}

impl Listener {
    pub fn new(port: u16) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let id = format!("listener-{}", NUMBER.fetch_add(1, Ordering::Relaxed));
        let mut options = MqttOptions::new(id, "127.0.0.1", port);
        options.set_max_packet_size(1 << 20, 1 << 20);
        let (client, mut connection) = Client::new(options, 16);
        let (tell, messages) = mpsc::channel();
        let subscriber = client.clone();
        std::thread::spawn(move || {
            for event in connection.iter() {
                match event {
                    // A broker without a core for some seconds answers late: it is asked again.
                    Err(_) => std::thread::sleep(Duration::from_millis(50)),
                    Ok(Event::Incoming(Packet::ConnAck(_))) => {
                        subscriber.try_subscribe("#", QoS::AtLeastOnce).unwrap();
                    }
                    Ok(Event::Incoming(Packet::Publish(publish))) => {
                        let payload = String::from_utf8(publish.payload.to_vec()).unwrap();
                        if tell.send((publish.topic, payload)).is_err() {
                            return;
                        }
                    }
                    Ok(_) => {}
                }
            }
        });
        Self { client, messages, known: BTreeMap::new(), all: Vec::new() }
    }

    /// Until it knows that.
    #[track_caller]
    pub fn hears(&mut self, topic: &str, wanted: impl Fn(&str) -> bool) {
        let begin = Instant::now();
        while !self.known.get(topic).is_some_and(|payload| wanted(payload)) {
            self.take(topic, begin);
        }
    }

    /// The next payload of this topic.
    #[track_caller]
    pub fn next(&mut self, wanted: &str) -> String {
        let begin = Instant::now();
        loop {
            let (topic, payload) = self.take(wanted, begin);
            if topic == wanted {
                return payload;
            }
        }
    }

    /// The next message, while one of a topic is waited for since `begin`.
    #[track_caller]
    fn take(&mut self, wanted: &str, begin: Instant) -> (String, String) {
        let left = PATIENCE.saturating_sub(begin.elapsed());
        let Ok((topic, payload)) = self.messages.recv_timeout(left) else {
            panic!("{wanted} does not come; known: {:#?}", self.known);
        };
        is_described(&topic, &payload);
        self.all.push((topic.clone(), payload.clone()));
        self.known.insert(topic.clone(), payload.clone());
        (topic, payload)
    }
}

/// A tracker that makes a frame every 0.1 s.
pub struct Frames {
    pub frame: Arc<std::sync::Mutex<Snapshot>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Frames {
    pub fn new(frame: Snapshot) -> (Self, Receiver<Arc<Snapshot>>) {
        let (tell, frames) = mpsc::sync_channel(64);
        let frame = Arc::new(std::sync::Mutex::new(frame));
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&frame), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                let _ = tell.try_send(Arc::new(shared.lock().unwrap().clone()));
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        (Self { frame, stop, thread: Some(thread) }, frames)
    }

    pub fn zone(&self, count: u32, state: ZoneKnown) {
        let zone = ZoneLine::new(Found::inside(count, vec![1.0]), 1.0, state);
        self.frame.lock().unwrap().line.zones.insert("hall".into(), zone);
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// With the module of [`frame`].
pub const SITE: &str = "[[module]]\nname = \"left\"\nx = 0\ny = 0\n";

/// The site of trackers that are given no other. It never changes, and its end is not told.
static KEPT_SITE: LazyLock<watch::Sender<Arc<Site>>> =
    LazyLock::new(|| watch::Sender::new(Arc::new(Site::parse("site", SITE).unwrap())));

pub fn settings(port: u16) -> Settings {
    let home_assistant = Some("homeassistant".to_owned());
    let topics = Topics { title: "door".into(), prefix: "kehai".into(), home_assistant };
    Settings {
        broker: format!("mqtt://127.0.0.1:{port}").parse().unwrap(),
        trust: None,
        topics,
        site: KEPT_SITE.subscribe(),
        map_url: None,
        doors: None,
        signs: None,
        buttons: None,
        alarms: TrackerAlarms::default(),
    }
}

pub fn frame() -> Snapshot {
    let module = ModuleLine { name: "left".into(), state: DeviceState::Watching, ..ModuleLine::default() };
    Snapshot { unix_ms: 1, modules: vec![module], ..Snapshot::default() }
}
