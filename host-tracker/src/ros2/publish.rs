//! The thread that publishes.
//!
//! ```text
//!   snapshot, ten times a second ─▶ people · markers · each second: diagnostics · who subscribes to which scan?
//!   site has changed             ─▶ transforms · topics of scans
//!   scans, while wanted          ─▶ the topic of its module
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use tokio::sync::watch;
use zenoh::{Session, Wait};

use super::Ros2Settings;
use super::diagnostics::diagnostics;
use super::markers::markers;
use super::messages::{DiagnosticArray, LaserScan, MarkerArray, People, TfMessage};
use super::names::{Node, parts, scan_topic};
use super::people::people;
use super::publisher::Topic;
use super::qos::{Durability, Qos};
use super::scan::laser_scan;
use super::transforms::transforms;
use crate::areas::{LinkError, newest, one_line, open};
use crate::scans::{Scans, WantedScans};
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Wait for a snapshot; and while scans are wanted, which come in between.
const WAIT: Duration = Duration::from_millis(200);
const TICK: Duration = Duration::from_millis(5);

/// Between two diagnostics, s: what ROS's own aggregator expects.
const DIAGNOSTICS_S: f64 = 1.0;

/// A second of snapshots.
const USUAL: Qos = Qos { durability: Durability::Volatile, depth: 10 };
/// The newest says all.
const KEPT: Qos = Qos { durability: Durability::TransientLocal, depth: 1 };

/// What there is to publish.
#[derive(Debug)]
pub struct Inputs {
    /// Each snapshot.
    pub snapshots: Receiver<Arc<Snapshot>>,
    /// The site.
    pub site: watch::Receiver<Arc<Site>>,
    /// Where scans are to be had.
    pub scans: Scans,
    /// Where it is told that the thread has ended.
    pub alarms: TrackerAlarms,
}

/// Publishes until it is dropped; then its tokens are gone.
#[derive(Debug)]
pub struct Ros2 {
    _thread: Worker,
}

impl Ros2 {
    /// Begins to publish. `say` is told why Zenoh cannot be reached, and that it is.
    ///
    /// # Errors
    /// The configuration of Zenoh is wrong, or there is no thread.
    pub fn start(settings: &Ros2Settings, inputs: Inputs, say: fn(&str)) -> Result<Self, LinkError> {
        let (config, domain) = (settings.config()?, settings.domain);
        let alarms = inputs.alarms.clone();
        let work = move |stop: &AtomicBool| {
            let Some(session) = open(&config, stop, say) else { return Ok(()) };
            say(&format!("people are published to ROS 2, domain {domain}"));
            publish(&session, domain, &inputs, stop).map_err(|error| one_line(&error))
        };
        let thread = Worker::start("ros2", alarms, work);
        Ok(Self { _thread: thread.map_err(|error| LinkError::Open(error.to_string()))? })
    }
}

fn publish(session: &Session, domain: u32, inputs: &Inputs, stop: &AtomicBool) -> Result<(), zenoh::Error> {
    let node = Node { domain, session: session.zid().to_string() };
    let _token = session.liveliness().declare_token(node.token()).wait()?;
    let mut site_changes = inputs.site.clone();
    let mut site = Arc::clone(&site_changes.borrow_and_update());
    let mut topics = Topics::declare(session, node)?;
    topics.place(session, &site)?;
    let mut listening = Listening::default();
    while !stop.load(Ordering::Relaxed) {
        if site_changes.has_changed().unwrap_or(false) {
            site = Arc::clone(&site_changes.borrow_and_update());
            topics.place(session, &site)?;
        }
        let wait = if listening.scans.are_wanted() { TICK } else { WAIT };
        match inputs.snapshots.recv_timeout(wait) {
            Ok(snapshot) => {
                let snapshot = newest(snapshot, &inputs.snapshots);
                topics.put(&snapshot, &site, listening.scans.missed())?;
                listening.begun_ns = snapshot.begun_ns();
                listening.choose(&mut topics.scans, &inputs.scans)?;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        listening.put(&mut topics.scans)?;
    }
    Ok(())
}

/// The topics of scans, by the module's name.
type ScanTopics = BTreeMap<String, ScanTopic>;

#[derive(Debug)]
struct ScanTopic {
    /// The module's part of names.
    part: String,
    topic: Topic<LaserScan>,
    is_heard: bool,
}

struct Topics {
    node: Node,
    /// Publishers so far.
    number: u32,
    people: Topic<People>,
    markers: Topic<MarkerArray>,
    diagnostics: Topic<DiagnosticArray>,
    transforms: Topic<TfMessage>,
    scans: ScanTopics,
    /// When diagnostics are due, s on the tracker's clock.
    diagnostics_s: f64,
}

impl Topics {
    fn declare(session: &Session, node: Node) -> Result<Self, zenoh::Error> {
        Ok(Self {
            people: Topic::declare(session, &node, 1, "/people", USUAL)?,
            markers: Topic::declare(session, &node, 2, "/kehai/markers", USUAL)?,
            diagnostics: Topic::declare(session, &node, 3, "/diagnostics", USUAL)?,
            transforms: Topic::declare(session, &node, 4, "/tf_static", KEPT)?,
            node,
            number: 4,
            scans: ScanTopics::new(),
            diagnostics_s: 0.0,
        })
    }

    /// Goes on with this site: says where its modules are, and has a topic for the scans of each that is placed.
    fn place(&mut self, session: &Session, site: &Site) -> Result<(), zenoh::Error> {
        let parts = parts(site.modules.iter().map(|module| module.name.as_str()));
        self.transforms.put(&transforms(site, &parts, unix_ms().saturating_mul(1_000_000)))?;
        let is_placed = |name: &str| site.modules.iter().any(|module| module.placed && module.name == name);
        self.scans.retain(|name, scans| is_placed(name) && parts.get(name) == Some(&scans.part));
        for (name, part) in parts {
            if is_placed(&name) && !self.scans.contains_key(&name) {
                self.number += 1;
                let topic = Topic::declare(session, &self.node, self.number, &scan_topic(&part), USUAL)?;
                self.scans.insert(name, ScanTopic { part, topic, is_heard: false });
            }
        }
        Ok(())
    }

    fn put(&mut self, snapshot: &Snapshot, site: &Site, missed_scans: u64) -> Result<(), zenoh::Error> {
        if let Some(people) = people(snapshot, site) {
            self.people.put(&people)?;
        }
        self.markers.put(&markers(snapshot, site))?;
        if snapshot.line.t >= self.diagnostics_s {
            self.diagnostics_s = snapshot.line.t + DIAGNOSTICS_S;
            self.diagnostics.put(&diagnostics(snapshot, site, missed_scans))?;
        }
        Ok(())
    }
}

/// The scans that subscribers have asked for.
#[derive(Default)]
struct Listening {
    scans: WantedScans,
    /// When the tracker's clock stood at 0, ns since 1970.
    begun_ns: u64,
}

impl Listening {
    /// Looks which topics are subscribed to.
    fn choose(&mut self, topics: &mut ScanTopics, scans: &Scans) -> Result<(), zenoh::Error> {
        let mut is_wanted = false;
        for scan in topics.values_mut() {
            scan.is_heard = scan.topic.is_heard()?;
            is_wanted |= scan.is_heard;
        }
        self.scans.want(is_wanted, scans);
        Ok(())
    }

    /// Sends what has come.
    fn put(&mut self, topics: &mut ScanTopics) -> Result<(), zenoh::Error> {
        while let Some(scan) = self.scans.waiting() {
            if let Some(to) = topics.get_mut(&scan.module).filter(|to| to.is_heard) {
                to.topic.put(&laser_scan(&scan, &to.part, self.begun_ns))?;
            }
        }
        Ok(())
    }
}
