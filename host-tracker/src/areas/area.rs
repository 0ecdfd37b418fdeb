//! What the tracker of an area says to all: each frame, its site to who asks, and that it is there.
//!
//! ```text
//!   frames ─▶ thread "area" ─▶ publisher, congestion: drop      never waits for a slow listener
//!   site  ──▶ queryable                                         answered by Zenoh's own thread
//!   process ends, however ──▶ the token is gone
//! ```

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use tokio::sync::watch;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::keys::What;
use super::link::{newest, one_line, open};
use super::{AreaPlace, AreaSettings, LinkError, Said, SiteSaid};
use crate::site_file;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::areas::packed;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Wait for a frame.
const WAIT: Duration = Duration::from_millis(200);

/// Publishes until it is dropped; then its token is gone.
#[derive(Debug)]
pub struct Area {
    _thread: Worker,
}

impl Area {
    /// Begins to publish `frames`. `say` is told why Zenoh cannot be reached, and that it is.
    ///
    /// # Errors
    /// The configuration of Zenoh is wrong, or there is no thread.
    pub fn start(
        settings: AreaSettings,
        frames: Receiver<Arc<Snapshot>>,
        site: watch::Receiver<Arc<Site>>,
        alarms: TrackerAlarms,
        say: fn(&str),
    ) -> Result<Self, LinkError> {
        let config = settings.network.config()?;
        let work = move |stop: &AtomicBool| {
            let Some(session) = open(&config, stop, say) else { return Ok(()) };
            say(&format!("area {} is published to Zenoh", settings.place));
            publish(&session, &settings.place, &frames, &site, stop).map_err(|error| one_line(&error))
        };
        let thread = Worker::start("area", alarms, work);
        Ok(Self { _thread: thread.map_err(|error| LinkError::Open(error.to_string()))? })
    }
}

fn publish(
    session: &Session,
    place: &AreaPlace,
    frames: &Receiver<Arc<Snapshot>>,
    site: &watch::Receiver<Arc<Site>>,
    stop: &AtomicBool,
) -> Result<(), zenoh::Error> {
    let (site_key, asked) = (place.key(What::Site), site.clone());
    let answer_key = site_key.clone();
    let _queryable = session
        .declare_queryable(site_key)
        .callback(move |query| {
            let site = Arc::clone(&asked.borrow());
            let said = SiteSaid { revision: revision(&site), site: Cow::Borrowed(&site) };
            // An answer that cannot be sent is asked for again.
            if let Ok(text) = serde_json::to_vec(&said) {
                let _ = query.reply(answer_key.clone(), text).wait();
            }
        })
        .wait()?;
    let publisher = session
        .declare_publisher(place.key(What::Frame))
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::RealTime)
        .wait()?;
    let _token = session.liveliness().declare_token(place.key(What::Alive)).wait()?;
    let epoch = unix_ms();
    let (mut number, mut changed, mut site_revision) = (0, site.clone(), revision(&site.borrow()));
    while !stop.load(Ordering::Relaxed) {
        let frame = match frames.recv_timeout(WAIT) {
            Ok(frame) => newest(frame, frames),
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        if changed.has_changed().unwrap_or(false) {
            site_revision = revision(&changed.borrow_and_update());
        }
        number += 1;
        let frame = packed(&frame, number);
        let said = serde_json::to_vec(&Said { site_revision, epoch, number, frame });
        publisher.put(said.map_err(|error| error.to_string())?).wait()?;
    }
    Ok(())
}

/// The revision of a site by what it says.
fn revision(site: &Site) -> u64 {
    site_file::revision(&serde_json::to_string(site).unwrap_or_default())
}
