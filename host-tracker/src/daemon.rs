//! The whole daemon: the tracker and every consumer of its snapshots, wired in one place.
//!
//! ```text
//!   service ─┬─▶ database ◀─ passages, changes of the site
//!            ├─▶ MQTT     ◀─ door outputs
//!            ├─▶ live map ─▶ changes of the site, accepted poses ─▶ service, database
//!            └─▶ next()   ─▶ the program: the newest snapshot and door outputs
//! ```

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use rustls::ClientConfig;
use tokio::sync::watch;

use crate::access::Access;
use crate::mqtt::{self, Broker, Publisher, Topics};
use crate::service::{Options, Service};
use crate::site_file::SiteFile;
use crate::store::card::CardKey;
use crate::store::pose::{self, Source};
use crate::store::{Keep, Store, StoreError, StoreState, known_before};
use crate::tracker_alarms::TrackerAlarms;
use crate::web::{Bind, Limits, Listen, Server, ServerContext};
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::door::doors::Output;
use kehai_tracking::geometry::Pose;
use kehai_tracking::keys::Clear;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use kehai_tracking::tracker::Selected;

/// What runs beside the tracker.
#[derive(Debug)]
pub struct Settings {
    /// The site's file.
    pub site: SiteFile,
    /// Devices at known addresses.
    pub modules: Vec<SocketAddr>,
    /// Whether devices are looked for on the network, too.
    pub discover: bool,
    /// The tracker.
    pub tracker: Selected,
    /// Everything that comes in is recorded in this file.
    pub record: Option<PathBuf>,
    /// The database.
    pub database: Option<Database>,
    /// The live map.
    pub map: Option<Map>,
    /// The broker.
    pub mqtt: Option<Mqtt>,
    /// The key by which cards are hashed.
    pub card_key: Option<CardKey>,
    /// The file of the keys of the site's devices; it may not be there yet.
    pub keys: Option<PathBuf>,
    /// What becomes of devices without a key once others have one.
    pub clear: Clear,
}

/// Where what happens is kept.
#[derive(Debug)]
pub struct Database {
    /// Its file.
    pub file: PathBuf,
    /// For how long.
    pub keep: Keep,
    /// Whether tracks that it knows from a moment ago are taken back.
    pub restore: bool,
}

/// The broker to which everything is published.
#[derive(Debug)]
pub struct Mqtt {
    /// The broker.
    pub broker: Broker,
    /// Whom an encrypted connection to it trusts, if it is one.
    pub trust: Option<Arc<ClientConfig>>,
    /// Where everything goes there.
    pub topics: Topics,
}

/// Where the live map is served.
#[derive(Debug)]
pub struct Map {
    /// The address.
    pub listen: Bind,
    /// Where messages to doors are taken, if not there.
    pub doors: Option<Bind>,
    /// Names under which browsers may open it, beside this machine's addresses and own name.
    pub names: Vec<String>,
    /// Who may do what there.
    pub access: Access,
    /// Whether others than this machine are served though everybody may do everything.
    pub insecure: bool,
}

/// Why the daemon does not start.
#[derive(Debug, thiserror::Error)]
pub enum DaemonError {
    /// No socket or thread, or the recording cannot be begun.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The database.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Everybody on the network could do everything.
    #[error("{0} is for the whole network, and nobody has been added who may log in")]
    Open(SocketAddr),
    /// The live map.
    #[error("the live map cannot be at {places}: {error}")]
    Map {
        /// Where it was to be, and the doors.
        places: String,
        /// What the system says.
        error: io::Error,
    },
}

/// What [`Daemon::next`] brings.
#[derive(Debug)]
pub enum Next {
    /// A snapshot.
    Snapshot(Arc<Snapshot>),
    /// None within the time.
    Waiting,
    /// The tracker has ended.
    Ended,
}

/// The running daemon. It ends when it is dropped.
#[derive(Debug)]
pub struct Daemon {
    // In the order in which they end.
    map: Option<Server>,
    publisher: Option<Publisher>,
    snapshots: Receiver<Arc<Snapshot>>,
    outputs: Receiver<Output>,
    site: watch::Receiver<Arc<Site>>,
    service: Service,
    store: Option<Store>,
}

impl Daemon {
    /// Starts it. `say` is told in words what became of an earlier run's tracks, and when the broker comes and goes.
    ///
    /// # Errors
    /// [`DaemonError`].
    pub fn start(settings: Settings, say: fn(&str)) -> Result<Self, DaemonError> {
        let Settings {
            site: file,
            modules,
            discover,
            tracker,
            record,
            database,
            map,
            mqtt,
            card_key,
            keys,
            clear,
        } = settings;
        if let Some(open) = map.as_ref().and_then(open_to_all) {
            return Err(DaemonError::Open(open));
        }
        let site = file.current().site;
        let now_ms = unix_ms();
        let taken_back = database.as_ref().filter(|database| database.restore);
        let (known, event) = taken_back.map_or((None, None), |database| known_before(&database.file, now_ms));
        let restore = known.map(|known| (known.line, now_ms.saturating_sub(known.unix_ms) as f64 * 1e-3));
        let open = |database: &Database| Store::open(&database.file, &site, database.keep);
        let store = database.as_ref().map(open).transpose()?;
        if let Some((store, event)) = store.as_ref().zip(event) {
            say(&format!("{}: {}", event.kind, event.text));
            store.happened(event);
        }
        let site = (*site).clone();
        let options = Options { restore, site, modules, discover, tracker, record, card_key, keys, clear };
        let service = Service::start(options)?;
        let doors = service.doors();
        let publisher = mqtt.map(|Mqtt { broker, trust, topics }| {
            let settings = mqtt::Settings {
                broker,
                trust,
                topics,
                doors: Some(doors.clone()),
                signs: Some(service.signs()),
                alarms: service.alarms(),
            };
            Publisher::start(settings, service.queue(), Some(doors.listen()), say)
        });
        let file_of_store = database.map(|database| database.file);
        let (publisher, snapshots, outputs) = (publisher.transpose()?, service.queue(), doors.listen());
        let site = service.site();
        let map = map.map(|map| serve(map, file, file_of_store, &service)).transpose()?;
        Ok(Self { map, publisher, snapshots, outputs, site, service, store })
    }

    /// The next snapshot, which the database has then, too.
    pub fn next(&mut self, wait: Duration) -> Next {
        let snapshot = match self.snapshots.recv_timeout(wait) {
            Ok(snapshot) => snapshot,
            Err(RecvTimeoutError::Timeout) => return Next::Waiting,
            Err(RecvTimeoutError::Disconnected) => return Next::Ended,
        };
        if let Some(store) = &self.store {
            if self.site.has_changed().unwrap_or(false) {
                store.set_site(&self.site.borrow_and_update(), Source::Map);
            }
            store.record(Arc::clone(&snapshot));
            let state = store.state();
            self.service.alarms().set(
                AlarmKind::Database,
                if state.trouble.is_empty() { &state.doubt } else { &state.trouble },
            );
            self.service.alarms().set(AlarmKind::RawScans, &state.raw);
        }
        Next::Snapshot(snapshot)
    }

    /// The door outputs since the last call. The database has their passages then.
    pub fn outputs(&self) -> Vec<Output> {
        let outputs: Vec<Output> = self.outputs.try_iter().collect();
        for output in &outputs {
            if let (Output::Passage(passed), Some(store)) = (output, &self.store) {
                store.passed(passed.clone());
            }
        }
        outputs
    }

    /// The tracker's own alarms: for the parts of the program that raise them.
    #[must_use]
    pub fn alarms(&self) -> TrackerAlarms {
        self.service.alarms()
    }

    /// Where the live map is, if it is served.
    #[must_use]
    pub fn map_address(&self) -> Option<SocketAddr> {
        self.map.as_ref().map(Server::address)
    }

    /// Where messages to doors are taken, if anywhere.
    #[must_use]
    pub fn door_address(&self) -> Option<SocketAddr> {
        self.map.as_ref().map(Server::door_address)
    }

    /// Ends it, and says how the database was last.
    ///
    /// # Errors
    /// The tracker's socket has failed.
    pub fn stop(self) -> io::Result<Option<StoreState>> {
        let Self { map, publisher, service, store, .. } = self;
        drop(map);
        drop(publisher);
        service.stop()?;
        Ok(store.map(|store| store.state()))
    }
}

/// The key of a site's cards, in a file beside the site's own. Without a door or a reader none is made.
///
/// # Errors
/// Why there is none.
pub fn card_key(site_file: &Path, site: &Site) -> Result<Option<CardKey>, crate::store::card::CardKeyError> {
    if site.doors.is_empty() && site.readers.is_empty() {
        return Ok(None);
    }
    CardKey::load(&CardKey::beside(site_file)).map(Some)
}

/// Whether others than this machine reach this address.
#[must_use]
pub fn is_reached(address: &SocketAddr) -> bool {
    !address.ip().to_canonical().is_loopback()
}

/// The address at which others than this machine could do everything.
fn open_to_all(map: &Map) -> Option<SocketAddr> {
    let mut listens = [Some(&map.listen), map.doors.as_ref()].into_iter().flatten().map(|bind| bind.address);
    listens.find(is_reached).filter(|_| map.access.is_open() && !map.insecure)
}

fn serve(
    map: Map,
    site: SiteFile,
    database: Option<PathBuf>,
    service: &Service,
) -> Result<Server, DaemonError> {
    let Map { listen, doors, names, access, insecure: _ } = map;
    let sites = service.sites();
    let noting = database.clone();
    let accepted = Box::new(move |poses: &[(String, Pose)]| {
        let note = |database: &PathBuf| pose::note(database, poses, unix_ms(), Source::Calibration);
        if let Some(Err(error)) = noting.as_ref().map(note) {
            tracing::error!("accepted poses are not in the database: {error}");
        }
    });
    let context = ServerContext {
        frames: service.frames(),
        reports: service.reports(),
        site,
        changed: Box::new(move |site| sites.change(site)),
        calibration: service.calibration(),
        accepted,
        database,
        access,
        names,
        doors: Some(service.doors()),
        signs: Some(service.signs()),
        alarms: service.alarms(),
        connections: service.connections(),
    };
    let places = match &doors {
        Some(doors) => format!("{}, or the doors at {}", listen.address, doors.address),
        None => listen.address.to_string(),
    };
    let at = Listen { map: listen, doors, limits: Limits::default() };
    Server::start(at, context).map_err(|error| DaemonError::Map { places, error })
}
