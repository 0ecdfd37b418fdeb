//! Where the pictures of all areas go: to the map at once, to MQTT as long as there is room.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use tokio::sync::watch;

use crate::alarm_handle::AlarmHandle;
use crate::site_file::SiteFile;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::alarm_list::AlarmList;
use kehai_tracking::now::Now;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, active_alarms};

/// Where pictures go.
pub(super) struct Out {
    pub frames: watch::Sender<Arc<Snapshot>>,
    pub site: watch::Sender<Arc<Site>>,
    pub queue: SyncSender<Arc<Snapshot>>,
    /// Whether they go there, too.
    pub is_begun: bool,
    /// Pictures that found no room there.
    pub missed: u64,
    pub file: SiteFile,
    pub listed: AlarmHandle,
    /// What is wrong with this service itself.
    pub alarms: TrackerAlarms,
    pub own: AlarmList,
}

impl Out {
    /// Shows a picture to all, with how many of those before found a sink too slow.
    pub fn show(&mut self, mut picture: Snapshot) {
        picture.missed = self.missed;
        let now = Now { steady_s: picture.line.t, unix_ms: picture.unix_ms };
        // Its list alone says what became of them: listeners are told by the trackers.
        let _ = self.own.observe(now, active_alarms(&self.alarms.lines(), &[], &[]));
        picture.alarms.extend_from_slice(self.own.standing());
        picture.alarms.sort_by_key(|alarm| alarm.since_ms);
        let picture = Arc::new(picture);
        self.listed.show(picture.unix_ms, picture.alarms.clone());
        self.frames.send_replace(Arc::clone(&picture));
        if self.is_begun
            && let Err(TrySendError::Full(_)) = self.queue.try_send(picture)
        {
            self.missed += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use super::*;

    #[test]
    fn pictures_that_a_slow_sink_does_not_get_are_counted() {
        let (queue, pictures) = sync_channel(1);
        let file = SiteFile::together(std::path::Path::new("campus"));
        let (frames, newest) = watch::channel(Arc::default());
        let (site, _) = watch::channel(Arc::default());
        let (listed, alarms, own) =
            (AlarmHandle::default(), TrackerAlarms::default(), AlarmList::new(1 << 40));
        let (is_begun, missed, kept) = (false, 0, alarms.clone());
        let mut out = Out { frames, site, queue, is_begun, missed, file, listed, alarms: kept, own };
        out.show(Snapshot::default());
        assert!(pictures.try_recv().is_err() && out.missed == 0, "nothing is found yet");
        out.is_begun = true;
        for _ in 0..4 {
            out.show(Snapshot::default());
        }
        assert_eq!((out.missed, newest.borrow().missed), (3, 2), "each says what those before it found");
        alarms.thread_ended("mqtt", "the broker is odd");
        out.show(Snapshot::default());
        assert_eq!(
            newest.borrow().alarms[0].cause.name(),
            "thread",
            "what is wrong with the service is shown"
        );
        drop(pictures);
        out.show(Snapshot::default());
        assert_eq!(out.missed, 4, "a sink that is not there misses nothing");
    }
}
