//! What the daemon hands to its database: snapshots, passages, alarms and changes of the site.
//!
//! ```text
//!   snapshot ─▶ the site, if it has changed ─▶ snapshot ─▶ Store ─▶ what is wrong with it ─▶ alarms
//!                └ no room: again with the next snapshot
//! ```

use std::sync::Arc;

use tokio::sync::watch;

use crate::alarm_handle::AlarmChange;
use crate::store::pose::Source;
use crate::store::{Store, StoreState};
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::door::doors::Output;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// A database, and what it is told of.
#[derive(Debug)]
pub(super) struct StoreFeed {
    store: Store,
    site: watch::Receiver<Arc<Site>>,
    alarms: TrackerAlarms,
}

impl StoreFeed {
    /// Feeds `store`, which has the site that `site` has now.
    pub(super) const fn new(store: Store, site: watch::Receiver<Arc<Site>>, alarms: TrackerAlarms) -> Self {
        Self { store, site, alarms }
    }

    /// Hands over a snapshot, and before it the site if that has changed; raises what is wrong with the database.
    pub(super) fn snapshot(&mut self, snapshot: &Arc<Snapshot>) {
        pass_change(&mut self.site, |site| self.store.set_site(site, Source::Map));
        self.store.record(Arc::clone(snapshot));
        let state = self.store.state();
        let trouble = state.trouble.as_deref().or(state.doubt.as_deref());
        self.alarms.set(AlarmKind::Database, trouble);
        self.alarms.set(AlarmKind::RawScans, state.raw.as_deref());
    }

    /// Hands over passages and alarms.
    pub(super) fn news(&self, outputs: &[Output], changes: &[AlarmChange]) {
        for output in outputs {
            if let Output::Passage(passed) = output {
                self.store.passed(passed.clone());
            }
        }
        changes.iter().for_each(|change| self.store.alarm(change.alarm.clone()));
    }

    /// Hands over what had come by the end of the tracker, waits until all of it is written, and says how the database was last.
    pub(super) fn close(
        mut self,
        snapshots: impl Iterator<Item = Arc<Snapshot>>,
        outputs: &[Output],
        changes: &[AlarmChange],
    ) -> StoreState {
        pass_change(&mut self.site, |site| self.store.set_site(site, Source::Map));
        self.news(outputs, changes);
        // Nothing is live any more: a snapshot for which there is no room yet can wait.
        snapshots.for_each(|snapshot| self.store.see_waiting(snapshot));
        self.store.close()
    }
}

/// Passes a site on that has changed. One that is not taken is passed on again the next time.
fn pass_change(site: &mut watch::Receiver<Arc<Site>>, take: impl FnOnce(&Arc<Site>) -> bool) {
    if site.has_changed().unwrap_or(false) {
        let changed = Arc::clone(&site.borrow_and_update());
        if !take(&changed) {
            site.mark_changed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_that_is_not_taken_is_passed_on_again() {
        let (sites, mut site) = watch::channel(Arc::<Site>::default());
        pass_change(&mut site, |_| panic!("nothing has changed"));
        sites.send_replace(Arc::default());
        let mut times = 0;
        for is_taken in [false, false, true, true] {
            pass_change(&mut site, |_| {
                times += 1;
                is_taken
            });
        }
        assert_eq!(times, 3, "until it is taken");
    }
}
