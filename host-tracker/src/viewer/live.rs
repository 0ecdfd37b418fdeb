//! Viewers that are open now: a server for Foxglove's WebSocket, on this machine alone.
//!
//! ```text
//!   snapshot, ten times a second ─▶ /people · each second: /tf, /map, for viewers that come later
//!   alarm begins, ends           ─▶ /log                                                    ╲
//!   scans, while wanted          ─▶ /scan/NAME                        ws://127.0.0.1:8765 ──▶ viewer
//! ```
//!
//! The protocol knows no log-in, so others than this machine are not served. A viewer that is too slow misses the oldest
//! messages. Protocol: <https://github.com/foxglove/foxglove-sdk>, `foxglove.sdk.v1`; the crate speaks it.

use std::collections::BTreeMap;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use ::foxglove::{Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServerHandle};
use serde::Serialize;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;

use super::{SCAN, Topic, log, map, people, scan, scan_descriptor, scan_topic, transforms};
use crate::alarm_handle::AlarmChange;
use crate::scans::{Scans, WantedScans};
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Wait for a snapshot; and while scans are wanted, which come in between.
const WAIT: Duration = Duration::from_millis(200);
const TICK: Duration = Duration::from_millis(5);

/// Between two times that the site is told, s.
const SITE_S: f64 = 1.0;

const NS_PER_MS: u64 = 1_000_000;

/// What there is to show.
#[derive(Debug)]
pub struct Inputs {
    /// Each snapshot.
    pub snapshots: Receiver<Arc<Snapshot>>,
    /// The site.
    pub site: watch::Receiver<Arc<Site>>,
    /// Where scans are to be had.
    pub scans: Scans,
    /// What becomes of alarms.
    pub changes: Receiver<AlarmChange>,
    /// Where it is told that the thread has ended.
    pub alarms: TrackerAlarms,
}

/// Why viewers are not served.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// There is no thread.
    #[error("no thread for viewers: {0}")]
    Thread(#[from] io::Error),
    /// The port.
    #[error("viewers cannot be served at 127.0.0.1:{port}: {error}")]
    Port {
        /// The port.
        port: u16,
        /// Why.
        error: FoxgloveError,
    },
}

/// Serves viewers until it is dropped.
#[derive(Debug)]
pub struct Live {
    // In the order in which they end.
    _thread: Worker,
    server: Option<WebSocketServerHandle>,
    port: u16,
    _runtime: Runtime,
}

impl Live {
    /// Serves them at a port of this machine; 0: at any that is free.
    ///
    /// # Errors
    /// [`LiveError`].
    pub fn start(port: u16, inputs: Inputs) -> Result<Self, LiveError> {
        let runtime =
            Builder::new_multi_thread().worker_threads(1).thread_name("viewers").enable_all().build()?;
        let context = Context::new();
        let server = context
            .websocket_server()
            .name("kehai-tracker")
            .bind(Ipv4Addr::LOCALHOST.to_string(), port)
            .tokio_runtime(runtime.handle());
        let server = runtime.block_on(server.start()).map_err(|error| LiveError::Port { port, error })?;
        let port = server.port();
        let alarms = inputs.alarms.clone();
        let work = move |stop: &AtomicBool| show(&context, &inputs, stop).map_err(|error| error.to_string());
        let thread = Worker::start("viewers", alarms, work)?;
        Ok(Self { _thread: thread, server: Some(server), port, _runtime: runtime })
    }

    /// Where it serves.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        SocketAddr::from((Ipv4Addr::LOCALHOST, self.port))
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        // Connections end with it.
        drop(self.server.take().map(WebSocketServerHandle::stop));
    }
}

fn show(context: &Arc<Context>, inputs: &Inputs, stop: &AtomicBool) -> Result<(), FoxgloveError> {
    let mut channels = Channels::open(context)?;
    let mut site = inputs.site.clone();
    let (mut scans, mut missed, mut begun_ns, mut site_s) = (WantedScans::default(), 0, 0, 0.0);
    while !stop.load(Ordering::Relaxed) {
        let is_other = site.has_changed().unwrap_or(false);
        match inputs.snapshots.recv_timeout(if scans.are_wanted() { TICK } else { WAIT }) {
            Ok(snapshot) => {
                let (at_ns, at_s) = (snapshot.stamp_ns(), snapshot.line.t);
                begun_ns = snapshot.begun_ns();
                if is_other || at_s >= site_s {
                    site_s = at_s + SITE_S;
                    channels.show_site(&site.borrow_and_update(), at_ns)?;
                }
                show_json(&channels.people, at_ns, || people(&snapshot.line, at_ns));
                scans.want(channels.wants_scans(), &inputs.scans);
                if !scans.are_wanted() && scans.missed() > missed {
                    tracing::warn!("viewers missed {} scans, which came too fast", scans.missed() - missed);
                    missed = scans.missed();
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        for change in inputs.changes.try_iter() {
            let at_ns = unix_ms().saturating_mul(NS_PER_MS);
            show_json(&channels.log, at_ns, || log(&change, at_ns));
        }
        channels.show_scans(&mut scans, begun_ns);
    }
    Ok(())
}

struct Channels {
    context: Arc<Context>,
    transforms: Arc<RawChannel>,
    map: Arc<RawChannel>,
    people: Arc<RawChannel>,
    log: Arc<RawChannel>,
    /// By the module's name.
    scans: BTreeMap<String, Arc<RawChannel>>,
}

impl Channels {
    fn open(context: &Arc<Context>) -> Result<Self, FoxgloveError> {
        let json = |topic: Topic| {
            let schema = Schema::new(topic.schema_name(), "jsonschema", topic.schema());
            context.channel_builder(topic.name()).message_encoding("json").schema(schema).build_raw()
        };
        Ok(Self {
            context: Arc::clone(context),
            transforms: json(Topic::Transforms)?,
            map: json(Topic::Map)?,
            people: json(Topic::People)?,
            log: json(Topic::Log)?,
            scans: BTreeMap::new(),
        })
    }

    /// Shows the site as it is now, and has a topic for the scans of each of its modules that is placed.
    fn show_site(&mut self, site: &Site, at_ns: u64) -> Result<(), FoxgloveError> {
        show_json(&self.transforms, at_ns, || transforms(site, at_ns));
        show_json(&self.map, at_ns, || map(site, at_ns));
        let is_placed = |name: &str| site.modules.iter().any(|module| module.placed && module.name == name);
        self.scans.retain(|name, channel| {
            let stays = is_placed(name);
            if !stays {
                channel.close();
            }
            stays
        });
        for module in site.modules.iter().filter(|module| module.placed) {
            if !self.scans.contains_key(&module.name) {
                let schema = Schema::new(SCAN, "protobuf", scan_descriptor());
                let channel = self.context.channel_builder(scan_topic(&module.name));
                let channel = channel.message_encoding("protobuf").schema(schema).build_raw()?;
                self.scans.insert(module.name.clone(), channel);
            }
        }
        Ok(())
    }

    fn wants_scans(&self) -> bool {
        self.scans.values().any(|channel| channel.has_sinks())
    }

    fn show_scans(&self, scans: &mut WantedScans, begun_ns: u64) {
        while let Some(seen) = scans.waiting() {
            if let Some(channel) = self.scans.get(&seen.module).filter(|channel| channel.has_sinks()) {
                let at_ns = begun_ns.saturating_add((seen.start_s * 1e9) as u64);
                channel.log_with_meta(&scan(&seen, begun_ns), PartialMetadata::with_log_time(at_ns));
            }
        }
    }
}

/// Makes a message and shows it, if a viewer wants it.
fn show_json<Message: Serialize>(channel: &RawChannel, at_ns: u64, message: impl FnOnce() -> Message) {
    if channel.has_sinks()
        && let Ok(bytes) = serde_json::to_vec(&message())
    {
        channel.log_with_meta(&bytes, PartialMetadata::with_log_time(at_ns));
    }
}
