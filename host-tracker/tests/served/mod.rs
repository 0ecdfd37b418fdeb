//! What a server needs of a tracker, where a test has no tracker: all of it that is off.

use std::sync::Arc;

use host_tracker::access::Access;
use host_tracker::alarm_handle::AlarmHandle;
use host_tracker::calibration::Calibration;
use host_tracker::connections::Connections;
use host_tracker::reports::Reports;
use host_tracker::site_file::SiteFile;
use host_tracker::tracker_alarms::TrackerAlarms;
use host_tracker::web::ServerContext;
use kehai_tracking::snapshot::Snapshot;
use tokio::sync::watch;

/// Frames and a site, open to all; nothing is kept, and there are no doors, signs or questions.
pub fn alone(frames: watch::Receiver<Arc<Snapshot>>, site: SiteFile) -> ServerContext {
    ServerContext {
        frames,
        reports: Reports::default(),
        site,
        changed: Box::new(|_| Ok(())),
        calibration: Calibration::default(),
        accepted: Box::new(|_| {}),
        database: None,
        keys: None,
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
