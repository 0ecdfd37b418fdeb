//! All areas of a site together: what is heard over Zenoh, and ten times a second the picture of it.
//!
//! ```text
//!   Zenoh's threads ─ Heard ─▶ queue of 1024 ─▶ thread "campus" ─ every 0.1 s ─▶ Snapshot ─▶ map, MQTT
//!                              full: counted      asks for each site that has changed
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use tokio::sync::watch;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use super::heard::{Heard, ask, frame, pass, say_lost};
use super::keys::{What, all, area_of};
use super::link::{one_line, open};
use super::shown::Out;
use super::{AreaPlace, LinkError, Network};
use crate::alarm_handle::{AlarmHandle, new_list};
use crate::area_losses::AreaLosses;
use crate::clock::HostClock;
use crate::log_limit::CountLog;
use crate::site_file::SiteFile;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::areas::{self, AreaName, Taken};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Between two pictures: as often as a tracker makes frames.
const EVERY: Duration = Duration::from_millis(100);

/// Between two questions for the same site.
const ASK_AGAIN: Duration = Duration::from_secs(1);

/// News that wait: a second of a hundred areas.
const QUEUE: usize = 1024;

/// Pictures that wait for MQTT: six seconds.
const PICTURES: usize = 60;

/// Areas are found within this: until then the broker is not told what there is, as it would forget all that is not.
const FOUND: Duration = Duration::from_secs(5);

/// Most areas of a site.
const AREAS_MAX: usize = 100;

/// Which site, over what.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CampusSettings {
    /// The site.
    pub site: AreaName,
    /// Areas that are missed from the start if they are not heard.
    pub expected: Vec<AreaName>,
    /// How Zenoh is reached.
    pub network: Network,
}

/// Puts areas together until it is dropped.
#[derive(Debug)]
pub struct Campus {
    _thread: Worker,
    frames: watch::Receiver<Arc<Snapshot>>,
    site: watch::Receiver<Arc<Site>>,
    lost: AreaLosses,
}

/// What there is of a site that is asked for.
#[derive(Default)]
struct Known {
    revision: Option<u64>,
    asked: Option<Instant>,
}

impl Campus {
    /// Begins to listen; `file` shows the site of all areas, `listed` their alarms. The receiver has every picture, as long as no more
    /// than six seconds of them wait.
    ///
    /// # Errors
    /// The configuration of Zenoh is wrong, or there is no thread.
    pub fn start(
        settings: CampusSettings,
        (file, listed): (SiteFile, AlarmHandle),
        alarms: TrackerAlarms,
        say: fn(&str),
    ) -> Result<(Self, Receiver<Arc<Snapshot>>), LinkError> {
        let config = settings.network.config()?;
        let (frames_in, frames) = watch::channel(Arc::default());
        let (site_in, site) = watch::channel(Arc::default());
        let (queue, pictures) = sync_channel(PICTURES);
        let (own, lost) = (new_list(), AreaLosses::default());
        let counted = lost.clone();
        let mut out = Out {
            frames: frames_in,
            site: site_in,
            queue,
            is_begun: false,
            missed: 0,
            file,
            listed,
            alarms: alarms.clone(),
            own,
        };
        let work = move |stop: &AtomicBool| {
            let Some(session) = open(&config, stop, say) else { return Ok(()) };
            say(&format!("the areas of {} are heard over Zenoh", settings.site));
            follow(&session, &settings, (&mut out, &counted), stop).map_err(|error| one_line(&error))
        };
        let thread = Worker::start("campus", alarms, work);
        let thread = thread.map_err(|error| LinkError::Open(error.to_string()))?;
        Ok((Self { _thread: thread, frames, site, lost }, pictures))
    }

    /// The newest picture.
    #[must_use]
    pub fn frames(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.frames.clone()
    }

    /// Messages of areas that were not used, for the metrics.
    #[must_use]
    pub fn lost(&self) -> AreaLosses {
        self.lost.clone()
    }

    /// The site of all areas.
    #[must_use]
    pub fn site(&self) -> watch::Receiver<Arc<Site>> {
        self.site.clone()
    }
}

fn follow(
    session: &Session,
    settings: &CampusSettings,
    (out, lost): (&mut Out, &AreaLosses),
    stop: &AtomicBool,
) -> Result<(), zenoh::Error> {
    let (news_in, news) = sync_channel(QUEUE);
    let sender = || (news_in.clone(), lost.clone());
    let (to_frames, lost_frames) = sender();
    let _frames = session
        .declare_subscriber(all(&settings.site, What::Frame))
        .callback(move |sample| pass(&to_frames, &lost_frames, frame(&sample)))
        .wait()?;
    let (to_tokens, lost_tokens) = sender();
    let _tokens = session
        .liveliness()
        .declare_subscriber(all(&settings.site, What::Alive))
        .history(true)
        .callback(move |sample| {
            if sample.kind() == SampleKind::Delete {
                pass(&to_tokens, &lost_tokens, area_of(sample.key_expr().as_str()).map(Heard::Gone));
            }
        })
        .wait()?;
    let clock = HostClock::start();
    let mut campus = areas::Campus::new(&settings.expected, AREAS_MAX);
    // Only of areas that the campus keeps, which forgets none.
    let mut known: BTreeMap<AreaName, Known> = BTreeMap::new();
    let mut site = Arc::new(Site::default());
    let begun = Instant::now();
    let mut next = begun;
    let mut log = CountLog::default();
    out.is_begun = false;
    while !stop.load(Ordering::Relaxed) {
        // Also while so many news come that some always wait.
        let now = Instant::now();
        if now >= next {
            // After a sleep of the machine there is one picture, not all that were missed.
            next = (next + EVERY).max(now);
            let now_us = clock.now_us();
            let picture = campus.picture(&site, now_us, unix_ms());
            out.is_begun |= is_found(&campus, &settings.expected, now_us, begun.elapsed());
            out.show(picture);
            say_lost(lost, &mut log);
        }
        match news.recv_timeout(next.saturating_duration_since(now)) {
            Ok(Heard::Frame(area, revision, said)) => {
                // A frame that is left out says nothing of the site in use, either.
                match campus.hear(&area, *said, clock.now_us()) {
                    Taken::News => {}
                    Taken::Late => {
                        lost.late.add(1);
                        continue;
                    }
                    Taken::Crowded => {
                        lost.crowded.add(1);
                        continue;
                    }
                }
                let known = known.entry(area.clone()).or_default();
                let is_old = known.revision != Some(revision);
                campus.note_site(&area, is_old);
                let is_due = known.asked.is_none_or(|asked| asked.elapsed() >= ASK_AGAIN);
                if is_old && is_due {
                    known.asked = Some(Instant::now());
                    let (to_sites, lost_sites) = sender();
                    let place = AreaPlace { site: settings.site.clone(), area };
                    ask(session, &place, move |heard| pass(&to_sites, &lost_sites, heard))?;
                }
            }
            Ok(Heard::Site(area, said)) => {
                if let Some(known) = known.get_mut(&area) {
                    known.revision = Some(said.revision);
                }
                if campus.set_site(&area, said.site.into_owned()) {
                    site = Arc::new(campus.site());
                    out.file.show((*site).clone());
                    out.site.send_replace(Arc::clone(&site));
                }
            }
            Ok(Heard::Gone(area)) => campus.leave(&area),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
    Ok(())
}

/// Whether what is heard so long after the start is all that there is: all areas that are expected, or after a while those that were
/// heard by then. Of one that is expected and silent it is known that something is missing.
fn is_found(campus: &areas::Campus, expected: &[AreaName], now_us: u64, after: Duration) -> bool {
    let has_areas = campus.names().next().is_some();
    has_areas && after >= FOUND || !expected.is_empty() && campus.is_known(now_us)
}

#[cfg(test)]
mod tests {
    use kehai_tracking::areas::AreaFrame;

    use super::*;

    #[test]
    fn a_broker_is_told_once_all_areas_are_found_or_were_waited_for() {
        let heard = |campus: &mut areas::Campus, area: &AreaName| {
            let said = AreaFrame { epoch: 1, number: 1, frame: Snapshot::default() };
            assert_eq!(campus.hear(area, said, 0), Taken::News);
            campus.set_site(area, Site::default());
        };
        let expected: [AreaName; 2] = ["east", "west"].map(|name| name.parse().unwrap());
        let mut campus = areas::Campus::new(&expected, 10);
        heard(&mut campus, &expected[0]);
        assert!(!is_found(&campus, &expected, 0, Duration::from_secs(4)), "the west is missed");
        assert!(is_found(&campus, &expected, 0, FOUND), "and is an alarm");
        heard(&mut campus, &expected[1]);
        assert!(is_found(&campus, &expected, 0, Duration::ZERO));
        // Without names it is not known how many there are.
        let mut campus = areas::Campus::new(&[], 10);
        assert!(!is_found(&campus, &[], 0, Duration::from_secs(3600)), "none was heard: nothing is known");
        heard(&mut campus, &expected[0]);
        assert!(!is_found(&campus, &[], 0, Duration::from_secs(4)) && is_found(&campus, &[], 0, FOUND));
    }
}
