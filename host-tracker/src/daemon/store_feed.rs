//! What the daemon hands to its database: snapshots, passages, alarms and changes of the site.
//!
//! ```text
//!   snapshot ─▶ changes of the site ─▶ snapshot ─▶ Store ─▶ what is wrong with it ─▶ alarms
//!                └ no room: again with the next snapshot
//! ```

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use crate::alarm_handle::AlarmChange;
use crate::site_file::SiteChange;
use crate::store::{Store, StoreState};
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::door::doors::Output;
use kehai_tracking::snapshot::Snapshot;

/// A database, and what it is told of.
#[derive(Debug)]
pub(super) struct StoreFeed {
    store: Store,
    changes: Receiver<SiteChange>,
    /// A change for which there was no room.
    waiting: Option<SiteChange>,
    alarms: TrackerAlarms,
}

impl StoreFeed {
    /// Feeds `store`, which has the site of before these changes.
    pub(super) const fn new(store: Store, changes: Receiver<SiteChange>, alarms: TrackerAlarms) -> Self {
        Self { store, changes, waiting: None, alarms }
    }

    /// Hands over a snapshot, and before it the site if that has changed; raises what is wrong with the database.
    pub(super) fn snapshot(&mut self, snapshot: &Arc<Snapshot>) {
        self.pass_changes();
        self.store.record(Arc::clone(snapshot));
        let state = self.store.state();
        let trouble = state.trouble.as_deref().or(state.doubt.as_deref());
        self.alarms.set(AlarmKind::Database, trouble);
        self.alarms.set(AlarmKind::RawScans, state.raw.as_deref());
    }

    fn pass_changes(&mut self) {
        let Self { store, changes, waiting, .. } = self;
        pass(changes, waiting, |change| store.set_site(&change.site, change.source));
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
        self.pass_changes();
        self.news(outputs, changes);
        // Nothing is live any more: a snapshot for which there is no room yet can wait.
        snapshots.for_each(|snapshot| self.store.see_waiting(snapshot));
        self.store.close()
    }
}

/// Passes changes on, in their order. One that is not taken is passed on again the next time.
fn pass(
    changes: &Receiver<SiteChange>,
    waiting: &mut Option<SiteChange>,
    mut take: impl FnMut(&SiteChange) -> bool,
) {
    while let Some(change) = waiting.take().or_else(|| changes.try_recv().ok()) {
        if !take(&change) {
            *waiting = Some(change);
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::store::pose::Source;

    #[test]
    fn a_change_that_is_not_taken_is_passed_on_again_and_none_before_it() {
        let (sites, changes) = mpsc::channel();
        let mut waiting = None;
        pass(&changes, &mut waiting, |_| panic!("nothing has changed"));
        for source in [Source::File, Source::Map] {
            sites.send(SiteChange { site: Arc::default(), source }).unwrap();
        }
        let mut told = Vec::new();
        for is_taken in [false, false, true, true] {
            pass(&changes, &mut waiting, |change| {
                told.push(change.source);
                is_taken
            });
        }
        assert_eq!(told, [Source::File, Source::File, Source::File, Source::Map], "until it is taken");
    }
}
