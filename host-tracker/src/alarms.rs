//! The tracker's own alarms, kept where each part of the daemon can raise them and every snapshot shows them.
//!
//! ```text
//!   database, recording ── set(Database, "disk is full") ──▶ TrackerAlarms ──▶ Snapshot.alarms
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};

use kehai_tracking::alarm::{AlarmKind, AlarmLine};

/// The alarms that are on. Clones are the same set.
#[derive(Clone, Debug, Default)]
pub struct TrackerAlarms(Arc<Mutex<BTreeMap<AlarmKind, String>>>);

impl TrackerAlarms {
    /// Raises an alarm with this text, or goes on with it; an empty text clears it.
    pub fn set(&self, kind: AlarmKind, text: &str) {
        let mut alarms = self.lock();
        if text.is_empty() {
            alarms.remove(&kind);
        } else if alarms.get(&kind).is_none_or(|known| known != text) {
            alarms.insert(kind, text.to_owned());
        }
    }

    /// All that are on.
    #[must_use]
    pub fn lines(&self) -> Vec<AlarmLine> {
        self.lock().iter().map(|(&kind, text)| AlarmLine::new(kind, text.clone())).collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<AlarmKind, String>> {
        self.0.lock()
    }
}
