//! The running tracker: a thread that receives and tracks, and its snapshots for all sinks.
//!
//! ```text
//!   UDP ─▶ tracking loop ────▶ Arc<Snapshot> ─┬─▶ watch     the newest: live map, MQTT, metrics
//!            ▲        every 0.1 s          └─▶ queues    each one: files, the database
//!            └── a changed site
//! ```
//!
//! The thread knows nothing of async. A slow sink misses snapshots and holds up no other; what a queue has no
//! room for is counted in the snapshots that follow (`missed`).

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender, TrySendError};
use std::thread::JoinHandle;

use parking_lot::Mutex;
use tokio::sync::watch;

use crate::alarm_handle::AlarmHandle;
use crate::calibration::Calibration;
use crate::connections::Connections;
use crate::doors::{DoorHandle, Hash, Watchdog};
use crate::key_file::{self, Watched};
use crate::net::discovery::Search;
use crate::net::tracking::{Parts, TrackingLoop};
use crate::questions::{ANSWERED, Asked, Questions};
use crate::record::Recorder;
use crate::reports::Reports;
use crate::scans::Scans;
use crate::signs::SignHandle;
use crate::store::card::CardKey;
use crate::tracker_alarms::TrackerAlarms;
use kehai::seal::Role;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::keys::{Clear, Keys, Links};
use kehai_tracking::lines::Totals;
use kehai_tracking::registry::Registry;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use kehai_tracking::tracker::Selected;

/// Frames a queue holds: six seconds.
const QUEUE: usize = 64;

/// The configuration of the service at its start.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Where everything is.
    pub site: Site,
    /// Modules at known addresses.
    pub modules: Vec<SocketAddr>,
    /// Whether modules are looked for on the network, too.
    pub discover: bool,
    /// The tracker.
    pub tracker: Selected,
    /// Everything that comes in is recorded in this file.
    pub record: Option<PathBuf>,
    /// What was known last, and how long before the start, s, by a process that has ended.
    pub restore: Option<(TracksLine, f64)>,
    /// What an earlier process has counted at lines, by their names.
    pub lines: BTreeMap<String, Totals>,
    /// Makes of a card what may be kept of it; without it a key that is lost with the process does.
    pub card_key: Option<CardKey>,
    /// The file of the keys of the site's devices; it may not be there yet.
    pub keys: Option<PathBuf>,
    /// What becomes of devices without a key once others have one.
    pub clear: Clear,
    /// The list of alarms, which may hold those of before.
    pub listed: AlarmHandle,
}

/// The running tracker. It ends when it is dropped.
#[derive(Debug)]
pub struct Service {
    frames: watch::Receiver<Arc<Snapshot>>,
    sites: Sites,
    shared: Arc<Shared>,
    alarms: TrackerAlarms,
    listed: AlarmHandle,
    connections: Connections,
    doors: DoorHandle,
    calibration: Calibration,
    reports: Reports,
    scans: Scans,
    signs: SignHandle,
    questions: Questions,
    thread: Option<JoinHandle<io::Result<()>>>,
    _watchdog: Watchdog,
}

/// Where the site is changed. Clones are the same place.
#[derive(Clone, Debug)]
pub struct Sites {
    site: watch::Sender<Arc<Site>>,
    changes: Sender<Arc<Site>>,
}

impl Sites {
    /// Goes on with another site: devices elsewhere, other walls, zones or entries. Tracks stay.
    ///
    /// # Errors
    /// What is wrong with the site, as [`Site::check`] says; nothing has changed then.
    pub fn change(&self, site: Site) -> Result<(), String> {
        site.check()?;
        let site = Arc::new(site);
        self.site.send_replace(Arc::clone(&site));
        // A tracker that has ended accepts no changes.
        let _ = self.changes.send(site);
        Ok(())
    }
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    queues: Mutex<Vec<SyncSender<Arc<Snapshot>>>>,
    missed: AtomicU64,
}

impl Service {
    /// Starts it.
    ///
    /// # Errors
    /// No socket or no thread is to be had, modules cannot be looked for, or the recording not be begun.
    pub fn start(options: Options) -> io::Result<Self> {
        let site = Arc::new(options.site);
        let (frames_in, frames) = watch::channel(Arc::default());
        let (changes, changed) = mpsc::channel();
        let (questions, asked) = Questions::new();
        let shared = Arc::new(Shared::default());
        let socket = TrackingLoop::bind()?;
        let nonces = key_file::nonces().map_err(io::Error::other)?;
        let search = options.discover.then(Search::start).transpose().map_err(io::Error::other)?;
        let alarms = TrackerAlarms::default();
        let listed = options.listed.clone();
        let connections = Connections::default();
        let begin = |file: &PathBuf| {
            let (begun_ns, restored) = (unix_ms() * 1_000_000, options.restore.clone());
            Recorder::create(file, begun_ns, options.tracker, &site, restored)
                .map(|recorder| recorder.with_alarms(listed.listen()))
        };
        let recorder = options.record.as_ref().map(begin).transpose().map_err(io::Error::other)?;
        let hash = |key: CardKey| -> Hash { Box::new(move |card| key.hash(card).into()) };
        let doors = DoorHandle::new(&site, options.card_key.clone().map(hash));
        doors.resume(&options.listed.resumed());
        let signs = SignHandle::new(&site, options.card_key.map(hash));
        let watchdog = Watchdog::start(doors.clone(), alarms.clone())?;
        let calibration = Calibration::default();
        calibration.set_site(&site);
        let (reports, scans) = (Reports::default(), Scans::default());
        let parts = Parts {
            recorder,
            alarms: alarms.clone(),
            listed: listed.clone(),
            connections: connections.clone(),
            doors: Some(doors.clone()),
            calibration: calibration.clone(),
            reports: reports.clone(),
            scans: scans.clone(),
            signs: Some(signs.clone()),
            keys: options.keys.clone().map(Watched::new),
        };
        let (the_site, sharing) = (Arc::clone(&site), Arc::clone(&shared));
        let thread = std::thread::Builder::new().name("tracking".into()).spawn(move || {
            let registry = Registry::new(Arc::clone(&the_site), &options.modules);
            let links = Links::new(Arc::new(Keys::none()), Role::Control, nonces, options.clear);
            let mut site_tracker = SiteTracker::new(&the_site, options.tracker);
            if let Some((line, age_s)) = &options.restore {
                site_tracker.restore(line, *age_s);
            }
            site_tracker.restore_lines(&options.lines);
            let mut tracking = TrackingLoop::new(socket, (registry, links), search, site_tracker, parts)?;
            track(&mut tracking, (&changed, &asked), &frames_in, &sharing)
        })?;
        let sites = Sites { site: watch::Sender::new(site), changes };
        let thread = Some(thread);
        Ok(Self {
            frames,
            sites,
            shared,
            alarms,
            listed,
            connections,
            doors,
            calibration,
            reports,
            scans,
            signs,
            questions,
            thread,
            _watchdog: watchdog,
        })
    }

    /// The newest frame, from now on. Closed once the tracker has ended. Before the first line it is empty.
    #[must_use]
    pub fn frames(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.frames.clone()
    }

    /// Every frame from now on, as long as no more than six seconds of them wait.
    #[must_use]
    pub fn queue(&self) -> Receiver<Arc<Snapshot>> {
        let (sender, receiver) = mpsc::sync_channel(QUEUE);
        self.shared.queues.lock().push(sender);
        receiver
    }

    /// The tracker's own alarms: for the parts that raise them.
    #[must_use]
    pub fn alarms(&self) -> TrackerAlarms {
        self.alarms.clone()
    }

    /// The list of all alarms.
    #[must_use]
    pub fn listed(&self) -> AlarmHandle {
        self.listed.clone()
    }

    /// Where HTTP connections that are refused are counted.
    #[must_use]
    pub fn connections(&self) -> Connections {
        self.connections.clone()
    }

    /// The doors of the site in use.
    #[must_use]
    pub fn doors(&self) -> DoorHandle {
        self.doors.clone()
    }

    /// The calibration under way, if there is one: to begin, follow and end it.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        self.calibration.clone()
    }

    /// The tracks after each report: for listeners that cannot wait for a snapshot.
    #[must_use]
    pub fn reports(&self) -> Reports {
        self.reports.clone()
    }

    /// What each scan saw empty: for listeners that want the free space itself.
    #[must_use]
    pub fn scans(&self) -> Scans {
        self.scans.clone()
    }

    /// Who is where: for signs and questions.
    #[must_use]
    pub fn signs(&self) -> SignHandle {
        self.signs.clone()
    }

    /// Where it is asked why a figure is what it is.
    #[must_use]
    pub fn questions(&self) -> Questions {
        self.questions.clone()
    }

    /// The site in use, and every change of it.
    #[must_use]
    pub fn site(&self) -> watch::Receiver<Arc<Site>> {
        self.sites.site.subscribe()
    }

    /// Where the site is changed.
    #[must_use]
    pub fn sites(&self) -> Sites {
        self.sites.clone()
    }

    /// Ends it, and says how it went.
    ///
    /// # Errors
    /// The socket has failed.
    pub fn stop(mut self) -> io::Result<()> {
        self.end()
    }

    fn end(&mut self) -> io::Result<()> {
        self.shared.stop.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(done)) => done,
            Some(Err(_)) => Err(io::Error::other("the tracking thread has failed")),
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.end();
    }
}

/// Until it is stopped, or the socket fails for good.
fn track(
    tracking: &mut TrackingLoop,
    (changed, asked): (&Receiver<Arc<Site>>, &Receiver<Asked>),
    frames: &watch::Sender<Arc<Snapshot>>,
    shared: &Shared,
) -> io::Result<()> {
    while !shared.stop.load(Ordering::Relaxed) {
        if let Some(site) = changed.try_iter().last() {
            tracking.change_site(&site);
        }
        let missed = shared.missed.load(Ordering::Relaxed);
        let frame = Arc::new(Snapshot { missed, ..tracking.snapshot()? });
        frames.send_replace(Arc::clone(&frame));
        for asked in asked.try_iter().take(ANSWERED) {
            let facts = tracking.facts(&asked.question, frame.line.t);
            asked.answer(facts);
        }
        let mut queues = shared.queues.lock();
        queues.retain(|queue| match queue.try_send(Arc::clone(&frame)) {
            Ok(()) => true,
            Err(TrySendError::Full(_)) => {
                shared.missed.fetch_add(1, Ordering::Relaxed);
                true
            }
            Err(TrySendError::Disconnected(_)) => false,
        });
    }
    Ok(())
}
