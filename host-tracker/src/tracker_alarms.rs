//! The tracker's own alarms, kept where each part of the daemon can raise them and every snapshot shows them.
//!
//! ```text
//!   database, recording ── set(Database, Some("disk is full")) ──▶ TrackerAlarms ──▶ Snapshot.alarms
//!   supervise ──────────── thread_ended("mqtt", "…") ────────────▶
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};

use kehai_tracking::alarm::{AlarmKind, AlarmLine};

/// The alarms that are on. Clones are the same set.
#[derive(Clone, Debug, Default)]
pub struct TrackerAlarms(Arc<Mutex<On>>);

#[derive(Debug, Default)]
struct On {
    alarms: BTreeMap<AlarmKind, String>,
    /// Of each thread that ended by itself: how often, and why it did last.
    threads: BTreeMap<&'static str, (u32, String)>,
}

impl TrackerAlarms {
    /// Raises an alarm with this text, or goes on with it; without a text it is over.
    pub fn set(&self, kind: AlarmKind, text: Option<&str>) {
        let alarms = &mut self.lock().alarms;
        match text {
            None => drop(alarms.remove(&kind)),
            Some(text) if alarms.get(&kind).is_some_and(|known| known == text) => {}
            Some(text) => drop(alarms.insert(kind, text.to_owned())),
        }
    }

    /// A thread has ended by itself, and is started again; how often it has by now. The alarm stands until the process
    /// ends: it is a fault of the program, and nothing that happens later takes it back.
    pub fn thread_ended(&self, thread: &'static str, why: &str) -> u32 {
        let mut on = self.lock();
        let (times, last) = on.threads.entry(thread).or_default();
        *times = times.saturating_add(1);
        why.clone_into(last);
        let times = *times;
        let in_words = |(thread, (times, why)): (&&str, &(u32, String))| {
            format!("the thread {thread} ended {times} times and was started again: {why}")
        };
        let text = on.threads.iter().map(in_words).collect::<Vec<_>>().join("; ");
        on.alarms.insert(AlarmKind::Thread, text);
        times
    }

    /// All that are on.
    #[must_use]
    pub fn lines(&self) -> Vec<AlarmLine> {
        self.lock().alarms.iter().map(|(&kind, text)| AlarmLine::new(kind, text.clone())).collect()
    }

    fn lock(&self) -> MutexGuard<'_, On> {
        self.0.lock()
    }
}
