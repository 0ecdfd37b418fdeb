//! What the server has of the tracker, and what all its requests share.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use axum::extract::ws::Utf8Bytes;
use axum::http::StatusCode;
use axum::response::Response;
use parking_lot::Mutex;
use tokio::sync::watch;

use super::answers::refuse;
use super::editors::Editors;
use super::guard::Names;
use super::limits::Limits;
use super::places::Places;
use super::recent::History;
use crate::access::roles::Action;
use crate::access::{Access, Who};
use crate::alarm_handle::AlarmHandle;
use crate::area_losses::AreaLosses;
use crate::calibration::Calibration;
use crate::connections::{Cause, Connections};
use crate::doors::DoorHandle;
use crate::firmware::folder::FirmwareFolder;
use crate::log_limit::LogLimit;
use crate::module::kept::KeptClients;
use crate::questions::Questions;
use crate::reports::Reports;
use crate::scans::Scans;
use crate::shared_count::SharedCount;
use crate::signs::SignHandle;
use crate::site_file::SiteFile;
use crate::store::StoreWatch;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::calibration::status::Mounting;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// A function that is called with accepted poses.
pub type Accepted = Box<dyn Fn(&[Mounting]) + Send + Sync>;

/// What the map needs of the tracker.
pub struct ServerContext {
    /// The newest frame.
    pub frames: watch::Receiver<Arc<Snapshot>>,
    /// What is known after each report.
    pub reports: Reports,
    /// What each scan saw empty: how many of them were missed.
    pub scans: Scans,
    /// Messages of the MQTT broker that were dropped, if there is one.
    pub mqtt_dropped: Option<SharedCount>,
    /// Messages of areas that were not used, where several trackers are one site.
    pub areas_lost: Option<AreaLosses>,
    /// The site's file.
    pub site: SiteFile,
    /// Told of every site that was saved.
    pub changed: Box<dyn Fn(Site) -> Result<(), String> + Send + Sync>,
    /// The calibration under way.
    pub calibration: Calibration,
    /// Told of poses that were accepted, by module: once the site's file has them, and before `changed` is.
    pub accepted: Accepted,
    /// Where what happens is kept, if it is.
    pub database: Option<PathBuf>,
    /// How that is, if this tracker writes it.
    pub kept: Option<StoreWatch>,
    /// The file of the keys of the site's modules; it may not be there.
    pub keys: Option<PathBuf>,
    /// Where firmware for new boards lies.
    pub firmware: FirmwareFolder,
    /// Who may do what.
    pub access: Access,
    /// Names under which a browser may ask for this machine, beside its addresses and its own name.
    pub names: Vec<String>,
    /// The doors, if the tracker runs any.
    pub doors: Option<DoorHandle>,
    /// Who is where, if that is followed.
    pub signs: Option<SignHandle>,
    /// Where it is asked why a figure is what it is, if a tracker answers.
    pub questions: Option<Questions>,
    /// Told when the server's thread ends by itself.
    pub alarms: TrackerAlarms,
    /// The list of all alarms.
    pub listed: AlarmHandle,
    /// What is refused is counted here.
    pub connections: Connections,
}

impl ServerContext {
    /// Of frames and a site without a tracker of its own: nothing is kept, there are no doors, signs or questions, and it is open
    /// to all.
    #[must_use]
    pub fn alone(frames: watch::Receiver<Arc<Snapshot>>, site: SiteFile) -> Self {
        Self {
            frames,
            reports: Reports::default(),
            scans: Scans::default(),
            mqtt_dropped: None,
            areas_lost: None,
            site,
            changed: Box::new(|_| Ok(())),
            calibration: Calibration::default(),
            accepted: Box::new(|_| {}),
            database: None,
            kept: None,
            keys: None,
            firmware: FirmwareFolder::default(),
            access: Access::open(),
            names: Vec::new(),
            doors: None,
            signs: None,
            questions: None,
            alarms: TrackerAlarms::default(),
            listed: AlarmHandle::default(),
            connections: Connections::default(),
        }
    }
}

impl fmt::Debug for ServerContext {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServerContext")
            .field("site", &self.site)
            .field("names", &self.names)
            .finish_non_exhaustive()
    }
}

/// The newest texts.
#[derive(Clone, Debug, Default)]
pub struct Packets {
    /// The newest frame; empty before the first.
    pub frame: Utf8Bytes,
    /// What modules see.
    pub fields: Utf8Bytes,
    /// Counts the texts of fields.
    pub fields_number: u64,
}

impl Shared {
    /// The answer to a change of the site to `to` by a client that may not change it, or while a door is in use.
    pub(super) fn refuse_change(&self, who: &Who, to: Option<&Site>) -> Option<Response> {
        let (status, why) = self.may_change(who, to).err()?;
        Some(refuse(status, &why))
    }

    /// Whether a client may change the site to `to` now.
    ///
    /// # Errors
    /// Its role does not let it, or a door is in use: which status that is, and why.
    pub(super) fn may_change(&self, who: &Who, to: Option<&Site>) -> Result<(), (StatusCode, String)> {
        self.may_by_role(who, to)?;
        let in_use = self.context.doors.as_ref().and_then(|doors| doors.may_change_site().err());
        in_use.map_or(Ok(()), |in_use| Err((StatusCode::CONFLICT, in_use.to_string())))
    }

    /// Whether its role lets a client change the site to `to`, or begin to.
    ///
    /// # Errors
    /// The site has doors, or would have some.
    pub(super) fn may_by_role(&self, who: &Who, to: Option<&Site>) -> Result<(), (StatusCode, String)> {
        let is_guarded = |site: &Site| !site.doors.is_empty();
        let guarded = is_guarded(&self.context.site.current().site) || to.is_some_and(is_guarded);
        if guarded && !who.may(Action::ChangeGuardedSite, None) {
            self.context.connections.count(Cause::Role);
            let why = format!("{who} may not change a site with doors: an admin may");
            return Err((StatusCode::FORBIDDEN, why));
        }
        Ok(())
    }
}

/// What all requests share.
pub(super) struct Shared {
    pub(super) context: Arc<ServerContext>,
    pub(super) names: Names,
    /// Where messages to doors are taken, and the screens beside them shown, if not here.
    pub(super) doors_at: Option<String>,
    pub(super) limits: Limits,
    pub(super) packets: watch::Receiver<Packets>,
    /// The alarms that stand, whenever they are others.
    pub(super) alarms: watch::Receiver<Utf8Bytes>,
    pub(super) history: Mutex<History>,
    pub(super) browsers: Places,
    /// Held while a password is compared.
    pub(super) comparing: Arc<tokio::sync::Mutex<()>>,
    /// Held while the picture is changed.
    pub(super) drawing: Arc<tokio::sync::Mutex<()>>,
    /// Who asks modules, one request at a time.
    pub(super) asking: Arc<tokio::sync::Mutex<KeptClients>>,
    /// Ways out that were asked for without a token.
    pub(super) exits: Mutex<LogLimit>,
    /// Who has the editor open.
    pub(super) editors: Editors,
}
