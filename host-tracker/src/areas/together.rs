//! The service of a whole site: the picture of all areas, served as that of one tracker.
//!
//! ```text
//!   Campus ─┬─▶ live map, HTTP API, metrics     the site is shown, and changed on the maps of the areas
//!           ╰─▶ MQTT                            the one publisher of all areas
//! ```

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use tokio::sync::watch;

use super::{Campus, CampusSettings, LinkError};
use crate::alarm_handle::AlarmHandle;
use crate::map::{Map, MapError};
use crate::mqtt::{self, BrokerLink, Publisher};
use crate::site_file::SiteFile;
use crate::tracker_alarms::TrackerAlarms;
use crate::web::{Server, ServerContext};
use kehai_tracking::snapshot::Snapshot;

/// What is put together, and where it is served.
#[derive(Debug)]
pub struct TogetherSettings {
    /// The areas.
    pub campus: CampusSettings,
    /// What belongs to the whole site lies beside this path: users, a certificate, a picture. There is no such file.
    pub path: PathBuf,
    /// The live map.
    pub map: Option<Map>,
    /// The broker.
    pub mqtt: Option<BrokerLink>,
}

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum TogetherError {
    /// No thread.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Zenoh.
    #[error(transparent)]
    Zenoh(#[from] LinkError),
    /// The live map.
    #[error(transparent)]
    Map(#[from] MapError),
}

/// The running service. It ends when it is dropped.
#[derive(Debug)]
pub struct Together {
    // In the order in which they end.
    map: Option<Server>,
    _publisher: Option<Publisher>,
    campus: Campus,
}

impl Together {
    /// Starts it. `say` is told when Zenoh and the broker come and go.
    ///
    /// # Errors
    /// [`TogetherError`].
    pub fn start(settings: TogetherSettings, say: fn(&str)) -> Result<Self, TogetherError> {
        let TogetherSettings { campus, path, map, mqtt } = settings;
        map.as_ref().map_or(Ok(()), Map::refuse_open)?;
        let (file, alarms) = (SiteFile::together(&path), TrackerAlarms::default());
        let listed = AlarmHandle::default();
        let campus = Campus::start(campus, (file.clone(), listed.clone()), alarms.clone(), say);
        let (campus, pictures) = campus?;
        let publish = |BrokerLink { broker, trust, topics, commands: _ }| {
            let settings = mqtt::Settings {
                broker,
                trust,
                topics,
                site: campus.site(),
                map_url: map.as_ref().and_then(Map::url),
                doors: None,
                signs: None,
                // Modules belong to the trackers of their areas.
                buttons: None,
                alarms: alarms.clone(),
            };
            Publisher::start(settings, pictures, None, mqtt::warn_or(say))
        };
        let publisher = mqtt.map(publish).transpose()?;
        let serve = |map: Map| {
            let context = ServerContext {
                mqtt_dropped: publisher.as_ref().map(Publisher::dropped),
                areas_lost: Some(campus.lost()),
                firmware: map.firmware.clone(),
                access: map.access.clone(),
                names: map.names.clone(),
                alarms,
                listed,
                ..ServerContext::alone(campus.frames(), file)
            };
            map.serve(context)
        };
        let map = map.map(serve).transpose()?;
        Ok(Self { map, _publisher: publisher, campus })
    }

    /// Where the live map is, if it is served.
    #[must_use]
    pub fn map_address(&self) -> Option<SocketAddr> {
        self.map.as_ref().map(Server::address)
    }

    /// The newest picture.
    #[must_use]
    pub fn frames(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.campus.frames()
    }
}
