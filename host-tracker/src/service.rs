//! The running tracker: a thread that listens and follows, and frames for everybody who wants them.
//!
//! ```text
//!   UDP ─▶ tracking thread ──▶ Arc<Frame> ─┬─▶ watch     the newest: live map, MQTT, metrics
//!            ▲        every 0.1 s          └─▶ queues    each one: files, the database
//!            └── a changed site
//! ```
//!
//! The thread knows nothing of async. Whoever is slow misses frames and holds up nobody; what a queue has no
//! room for is counted.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use tokio::sync::watch;

use crate::calibrate::session::Session;
use crate::discovery::Search;
use crate::door::Shown;
use crate::follower::Follower;
use crate::frame::{Frame, unix_ms};
use crate::jsonl::TracksLine;
use crate::live::Live;
use crate::peers::Peers;
use crate::record::Recorder;
use crate::reports::Reports;
use crate::site::Site;
use crate::trackers::Choice;
use crate::trouble::Trouble;

/// Frames a queue holds: six seconds.
const QUEUE: usize = 64;

/// What the service is told at its start.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Where everything is.
    pub site: Site,
    /// Modules at known addresses.
    pub modules: Vec<SocketAddr>,
    /// Whether modules are looked for on the network, too.
    pub discover: bool,
    /// The tracker.
    pub tracker: Choice,
    /// Everything that comes in is recorded in this file.
    pub record: Option<PathBuf>,
    /// What was known last, and how long before the start, s, by a process that has ended.
    pub restore: Option<(TracksLine, f64)>,
}

/// The running tracker. It ends when it is dropped.
#[derive(Debug)]
pub struct Service {
    frames: watch::Receiver<Arc<Frame>>,
    site: watch::Sender<Arc<Site>>,
    changes: Sender<Arc<Site>>,
    shared: Arc<Shared>,
    trouble: Trouble,
    doors: Shown,
    calibration: Session,
    reports: Reports,
    thread: Option<JoinHandle<io::Result<()>>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    queues: Mutex<Vec<SyncSender<Arc<Frame>>>>,
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
        let shared = Arc::new(Shared::default());
        let socket = Live::bind()?;
        let search = options.discover.then(Search::start).transpose().map_err(io::Error::other)?;
        let trouble = Trouble::default();
        let begin = |file: &PathBuf| {
            let (begun_ns, restored) = (unix_ms() * 1_000_000, options.restore.clone());
            Recorder::create(file, begun_ns, options.tracker, &site, restored)
        };
        let recorder = options.record.as_ref().map(begin).transpose().map_err(io::Error::other)?;
        let doors = Shown::default();
        let calibration = Session::default();
        calibration.set_site(&site);
        let reports = Reports::default();
        let reporting = reports.clone();
        let (telling, showing, calibrating) = (trouble.clone(), doors.clone(), calibration.clone());
        let (the_site, sharing) = (Arc::clone(&site), Arc::clone(&shared));
        let thread = std::thread::Builder::new().name("tracking".into()).spawn(move || {
            let peers = Peers::new(Arc::clone(&the_site), &options.modules);
            let mut follower = Follower::new(&the_site, options.tracker);
            if let Some((line, age_s)) = &options.restore {
                follower.restore(line, *age_s);
            }
            let live = Live::new(socket, peers, search, follower);
            let live = live.recording(recorder).telling(telling);
            let mut live = live.showing(showing).calibrated_by(calibrating).reporting(reporting);
            track(&mut live, &changed, &frames_in, &sharing)
        })?;
        let (site, thread) = (watch::Sender::new(site), Some(thread));
        Ok(Self { frames, site, changes, shared, trouble, doors, calibration, reports, thread })
    }

    /// The newest frame, from now on. Closed once the tracker has ended. Before the first line it is empty.
    #[must_use]
    pub fn frames(&self) -> watch::Receiver<Arc<Frame>> {
        self.frames.clone()
    }

    /// Every frame from now on, as long as no more than six seconds of them wait.
    #[must_use]
    pub fn queue(&self) -> Receiver<Arc<Frame>> {
        let (sender, receiver) = mpsc::sync_channel(QUEUE);
        self.shared.queues.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }

    /// What is wrong with the tracker itself: for whoever finds out.
    #[must_use]
    pub fn trouble(&self) -> Trouble {
        self.trouble.clone()
    }

    /// How the doors are: for whoever runs them.
    #[must_use]
    pub fn doors(&self) -> Shown {
        self.doors.clone()
    }

    /// The calibration under way, if there is one: to begin, follow and end it.
    #[must_use]
    pub fn calibration(&self) -> Session {
        self.calibration.clone()
    }

    /// Who is known to be where after each report: for whoever cannot wait for a frame.
    #[must_use]
    pub fn reports(&self) -> Reports {
        self.reports.clone()
    }

    /// Frames that a queue had no room for.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.shared.missed.load(Ordering::Relaxed)
    }

    /// The site in use, and every change of it.
    #[must_use]
    pub fn site(&self) -> watch::Receiver<Arc<Site>> {
        self.site.subscribe()
    }

    /// Goes on with another site: modules elsewhere, other walls, zones or entries. The people are found anew.
    ///
    /// # Errors
    /// What is wrong with the site, as [`Site::check`] says; nothing has changed then.
    pub fn change_site(&self, site: Site) -> Result<(), String> {
        site.check()?;
        let site = Arc::new(site);
        self.site.send_replace(Arc::clone(&site));
        // Who has ended takes no changes.
        let _ = self.changes.send(site);
        Ok(())
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
    live: &mut Live,
    changed: &Receiver<Arc<Site>>,
    frames: &watch::Sender<Arc<Frame>>,
    shared: &Shared,
) -> io::Result<()> {
    while !shared.stop.load(Ordering::Relaxed) {
        if let Some(site) = changed.try_iter().last() {
            live.change_site(&site);
        }
        let frame = Arc::new(live.frame()?);
        frames.send_replace(Arc::clone(&frame));
        let mut queues = shared.queues.lock().unwrap_or_else(PoisonError::into_inner);
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
