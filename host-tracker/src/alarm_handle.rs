//! The list of alarms of a running tracker, shared by the tracking loop, the requests that acknowledge, and the receivers.
//!
//! ```text
//!   tracking loop ─ observe, at each snapshot ─▶ ╭────────────╮ ─▶ Snapshot.alarms
//!   HTTP ────────── acknowledge ───────────────▶ │ alarm list │ ─▶ changes      database, log, webhook: a queue each
//!   database ────── resume, at the start ──────▶ ╰────────────╯
//! ```
//!
//! A receiver that is too slow misses changes, which are counted, and holds up nothing.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use parking_lot::Mutex;
use schemars::JsonSchema;
use serde::Serialize;

use kehai_tracking::alarm::Active;
use kehai_tracking::alarm_list::{AlarmList, Became, ListedAlarm, NotAcknowledged};
use kehai_tracking::now::Now;
use kehai_tracking::snapshot::unix_ms;

/// Changes that wait for a listener: all alarms of a hundred modules at once.
const QUEUE: usize = 1024;

/// What became of an alarm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlarmChange {
    /// What.
    pub became: Became,
    /// The alarm after that.
    pub alarm: ListedAlarm,
}

/// The list. Clones are the same.
#[derive(Clone, Debug)]
pub struct AlarmHandle(Arc<Mutex<Shared>>);

#[derive(Debug)]
struct Shared {
    list: AlarmList,
    listeners: Vec<SyncSender<AlarmChange>>,
    missed: u64,
    told: Told,
}

/// What has been told to the webhook, and what it did not take.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, JsonSchema)]
pub struct Told {
    /// Changes that it has taken.
    pub sent: u64,
    /// Changes that were given up.
    pub failed: u64,
}

/// A list whose numbers are not given again: seconds since 1970, and room for a thousand alarms each of them.
pub(crate) fn new_list() -> AlarmList {
    AlarmList::new((unix_ms() / 1000) << 10)
}

impl Default for AlarmHandle {
    fn default() -> Self {
        let list = new_list();
        Self(Arc::new(Mutex::new(Shared { list, listeners: Vec::new(), missed: 0, told: Told::default() })))
    }
}

impl AlarmHandle {
    /// Goes on with the alarms of a process that knew something at `known_ms` last.
    pub fn resume(&self, alarms: Vec<ListedAlarm>, known_ms: u64) {
        self.0.lock().list.resume(alarms, known_ms);
    }

    /// Those that stood when that process ended, and have not come up again.
    #[must_use]
    pub fn resumed(&self) -> Vec<ListedAlarm> {
        self.0.lock().list.resumed().to_vec()
    }

    /// Goes on to the alarms that are on now; those that stand.
    #[must_use]
    pub fn observe(&self, now: Now, active: impl IntoIterator<Item = Active>) -> Vec<ListedAlarm> {
        let mut shared = self.0.lock();
        let changes = shared.list.observe(now, active);
        shared.tell(changes.into_iter().map(|(became, alarm)| AlarmChange { became, alarm }));
        shared.list.standing().to_vec()
    }

    /// Shows the alarms that other trackers list, which stand at `now_ms`, since 1970. Listeners are not told: those of the trackers are.
    pub fn show(&self, now_ms: u64, standing: Vec<ListedAlarm>) {
        self.0.lock().list.show(now_ms, standing);
    }

    /// Acknowledges these; all of them or none.
    ///
    /// # Errors
    /// The first that does not stand, or that another tracker lists.
    pub fn acknowledge(&self, ids: &[u64], by: &str) -> Result<Vec<ListedAlarm>, NotAcknowledged> {
        let mut shared = self.0.lock();
        let acknowledged = shared.list.acknowledge(ids, by, unix_ms())?;
        let change = |alarm: &ListedAlarm| AlarmChange { became: Became::Acknowledged, alarm: alarm.clone() };
        shared.tell(acknowledged.iter().map(change));
        Ok(acknowledged)
    }

    /// Those that stand, the oldest first.
    #[must_use]
    pub fn standing(&self) -> Vec<ListedAlarm> {
        self.0.lock().list.standing().to_vec()
    }

    /// Those that ended within the last day, the newest first.
    #[must_use]
    pub fn ended(&self) -> Vec<ListedAlarm> {
        self.0.lock().list.ended().cloned().collect()
    }

    /// Every change from now on.
    #[must_use]
    pub fn listen(&self) -> Receiver<AlarmChange> {
        let (sender, receiver) = sync_channel(QUEUE);
        self.0.lock().listeners.push(sender);
        receiver
    }

    /// Counts a change that the webhook has taken or not; how many it has not, by now.
    pub fn count_told(&self, taken: bool) -> u64 {
        let told = &mut self.0.lock().told;
        if taken {
            told.sent += 1;
        } else {
            told.failed += 1;
        }
        told.failed
    }

    /// What has been told to the webhook.
    #[must_use]
    pub fn told(&self) -> Told {
        self.0.lock().told
    }

    /// Changes that a listener's queue had no room for.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.0.lock().missed
    }
}

impl Shared {
    fn tell(&mut self, changes: impl Iterator<Item = AlarmChange>) {
        for change in changes {
            let missed = &mut self.missed;
            self.listeners.retain(|listener| match listener.try_send(change.clone()) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => {
                    *missed += 1;
                    true
                }
                Err(TrySendError::Disconnected(_)) => false,
            });
        }
    }
}
