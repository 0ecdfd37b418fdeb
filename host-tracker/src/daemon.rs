//! The whole daemon: the tracker and every consumer of its snapshots, wired in one place.
//!
//! ```text
//!   service ─┬─▶ database ◀─ passages, changes of the site
//!            ├─▶ MQTT     ◀─ door outputs
//!            ├─▶ webhook  ◀─ what becomes of alarms
//!            ├─▶ Zenoh: areas, ROS 2
//!            ├─▶ live map ─▶ changes of the site, accepted poses ─▶ service, database
//!            └─▶ next()   ─▶ the program: the newest snapshot, and what came with it: outputs(), alarm_changes()
//! ```

mod store_feed;

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use store_feed::StoreFeed;

use crate::alarm_handle::{AlarmChange, AlarmHandle};
use crate::links::{LinkSettings, Links, LinksError};
use crate::map::{Map, MapError};
use crate::mqtt::{self, BrokerLink, Publisher};
use crate::service::{Options, Service};
use crate::shared_count::SharedCount;
use crate::site_file::{SaveError, SiteFile};
use crate::store::card::CardKey;
use crate::store::pose::{self, Source};
use crate::store::{
    Keep, Store, StoreError, StoreState, StoreWatch, alarms_before, counted_before, known_before,
};
use crate::tracker_alarms::TrackerAlarms;
use crate::web::{Server, ServerContext};
use crate::webhook::{Target, Webhook};
use kehai_tracking::calibration::status::Mounting;
use kehai_tracking::door::doors::Output;
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
    pub mqtt: Option<BrokerLink>,
    /// Where alarms are told.
    pub webhook: Option<Target>,
    /// The key by which cards are hashed.
    pub card_key: Option<CardKey>,
    /// The file of the keys of the site's devices; it may not be there yet.
    pub keys: Option<PathBuf>,
    /// What becomes of devices without a key once others have one.
    pub clear: Clear,
    /// Who else is told.
    pub links: LinkSettings,
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

/// Why the daemon does not start.
#[derive(Debug, thiserror::Error)]
pub enum DaemonError {
    /// No socket or thread, or the recording cannot be begun.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The database.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A link to another program.
    #[error(transparent)]
    Links(#[from] LinksError),
    /// The live map.
    #[error(transparent)]
    Map(#[from] MapError),
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

/// What has come beside snapshots.
#[derive(Debug, Default)]
struct News {
    outputs: Vec<Output>,
    changes: Vec<AlarmChange>,
}

/// The running daemon. It ends when it is dropped.
#[derive(Debug)]
pub struct Daemon {
    // In the order in which they end.
    map: Option<Server>,
    publisher: Option<Publisher>,
    links: Links,
    webhook: Option<Webhook>,
    snapshots: Receiver<Arc<Snapshot>>,
    outputs: Receiver<Output>,
    changes: Receiver<AlarmChange>,
    /// What came up to the last [`next`](Self::next).
    news: News,
    file: SiteFile,
    service: Service,
    feed: Option<StoreFeed>,
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
            webhook,
            card_key,
            keys,
            clear,
            links,
        } = settings;
        map.as_ref().map_or(Ok(()), Map::refuse_open)?;
        let site = file.current().site;
        let now_ms = unix_ms();
        let taken_back = database.as_ref().filter(|database| database.restore);
        let (known, event) = taken_back.map_or((None, None), |database| known_before(&database.file, now_ms));
        let restore = known.map(|known| (known.line, now_ms.saturating_sub(known.unix_ms) as f64 * 1e-3));
        let lines = database.as_ref().map(|database| counted_before(&database.file)).unwrap_or_default();
        let listed = AlarmHandle::default();
        if let Some(database) = &database {
            let (alarms, known_ms) = alarms_before(&database.file, now_ms);
            listed.resume(alarms, known_ms);
        }
        let changes = listed.listen();
        let open = |database: &Database| Store::open(&database.file, &site, database.keep);
        let store = database.as_ref().map(open).transpose()?;
        if let Some((store, event)) = store.as_ref().zip(event) {
            say(&format!("{}: {}", event.kind.name(), event.text));
            store.happened(event);
        }
        let site = (*site).clone();
        let options = Options {
            restore,
            lines,
            site,
            modules,
            discover,
            tracker,
            record,
            card_key,
            keys,
            clear,
            listed,
        };
        let keys_file = options.keys.clone();
        let service = Service::start(options)?;
        let doors = service.doors();
        let publisher = mqtt.map(|BrokerLink { broker, trust, topics, commands }| {
            let settings = mqtt::Settings {
                broker,
                trust,
                topics,
                site: service.site(),
                map_url: map.as_ref().and_then(Map::url),
                doors: Some(doors.clone()),
                signs: Some(service.signs()),
                buttons: commands.then(|| mqtt::Buttons { keys: keys_file.clone() }),
                alarms: service.alarms(),
            };
            Publisher::start(settings, service.queue(), Some(doors.listen()), mqtt::warn_or(say))
        });
        let file_of_store = database.map(|database| database.file);
        let (publisher, snapshots, outputs) = (publisher.transpose()?, service.queue(), doors.listen());
        let name = file.current().name.trim_end_matches(".toml").to_owned();
        let tell = |target| Webhook::start(target, name, service.listed(), service.alarms());
        let webhook = webhook.map(tell).transpose()?;
        let kept = file_of_store.zip(store.as_ref().map(Store::watch));
        let feed = store.map(|store| StoreFeed::new(store, file.listen(), service.alarms()));
        let links = Links::start(links, &service, say)?;
        let mqtt_dropped = publisher.as_ref().map(Publisher::dropped);
        let serve = |map| serve(map, file.clone(), kept, (keys_file, mqtt_dropped), &service);
        let map = map.map(serve).transpose()?;
        Ok(Self {
            map,
            publisher,
            links,
            webhook,
            snapshots,
            outputs,
            changes,
            news: News::default(),
            file,
            service,
            feed,
        })
    }

    /// Uses the site's file as it is now; true if it was changed by hand since it was last read or written.
    ///
    /// # Errors
    /// It is no site, or a door is in use; the site in use stays.
    pub fn read_site_anew(&self) -> Result<bool, SaveError> {
        self.service.doors().may_change_site()?;
        let before = self.file.current().revision;
        let sites = self.service.sites();
        self.file.look(|site| sites.change(site))?;
        Ok(self.file.current().revision != before)
    }

    /// Waits for the next snapshot, and takes it with what has come beside it: [`outputs`](Self::outputs) and
    /// [`alarm_changes`](Self::alarm_changes). All of it is handed to the database, too.
    pub fn next(&mut self, wait: Duration) -> Next {
        let next = match self.snapshots.recv_timeout(wait) {
            Ok(snapshot) => Next::Snapshot(snapshot),
            Err(RecvTimeoutError::Timeout) => Next::Waiting,
            Err(RecvTimeoutError::Disconnected) => Next::Ended,
        };
        self.news =
            News { outputs: self.outputs.try_iter().collect(), changes: self.changes.try_iter().collect() };
        if let Some(feed) = &mut self.feed {
            if let Next::Snapshot(snapshot) = &next {
                feed.snapshot(snapshot);
            }
            feed.news(&self.news.outputs, &self.news.changes);
        }
        next
    }

    /// The door outputs that the last [`next`](Self::next) has taken.
    #[must_use]
    pub fn outputs(&self) -> &[Output] {
        &self.news.outputs
    }

    /// What had become of alarms by the last [`next`](Self::next).
    #[must_use]
    pub fn alarm_changes(&self) -> &[AlarmChange] {
        &self.news.changes
    }

    /// The guarded doors.
    #[must_use]
    pub fn doors(&self) -> crate::doors::DoorHandle {
        self.service.doors()
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

    /// Where viewers such as Foxglove are served, if they are.
    #[must_use]
    pub fn viewers_address(&self) -> Option<SocketAddr> {
        self.links.viewers()
    }

    /// Ends it, writes what had come by then into the database, and says how that was last.
    ///
    /// # Errors
    /// The tracker's socket has failed. The database has all that had come before.
    pub fn stop(self) -> io::Result<Option<StoreState>> {
        let Self { map, publisher, links, webhook, snapshots, outputs, changes, service, feed, .. } = self;
        drop(map);
        drop((publisher, webhook, links));
        let ended = service.stop();
        let (outputs, changes): (Vec<_>, Vec<_>) =
            (outputs.try_iter().collect(), changes.try_iter().collect());
        let state = feed.map(|feed| feed.close(snapshots.try_iter(), &outputs, &changes));
        ended.map(|()| state)
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

fn serve(
    map: Map,
    site: SiteFile,
    database: Option<(PathBuf, StoreWatch)>,
    (keys, mqtt_dropped): (Option<PathBuf>, Option<SharedCount>),
    service: &Service,
) -> Result<Server, MapError> {
    let sites = service.sites();
    let (database, kept) = database.unzip();
    let noting = database.clone();
    let accepted = Box::new(move |poses: &[Mounting]| {
        let note = |database: &PathBuf| pose::note(database, poses, unix_ms(), Source::Calibration);
        if let Some(Err(error)) = noting.as_ref().map(note) {
            tracing::error!("accepted poses are not in the database: {error}");
        }
    });
    let context = ServerContext {
        keys,
        frames: service.frames(),
        reports: service.reports(),
        scans: service.scans(),
        mqtt_dropped,
        areas_lost: None,
        site,
        changed: Box::new(move |site| sites.change(site)),
        calibration: service.calibration(),
        accepted,
        database,
        kept,
        firmware: map.firmware.clone(),
        access: map.access.clone(),
        names: map.names.clone(),
        doors: Some(service.doors()),
        signs: Some(service.signs()),
        questions: Some(service.questions()),
        alarms: service.alarms(),
        listed: service.listed(),
        connections: service.connections(),
    };
    map.serve(context)
}

#[cfg(test)]
mod tests;
