//! The tracks right after each report, for listeners that cannot wait for the next snapshot.
//!
//! ```text
//!   report ─▶ site tracker ─┬─ every 0.1 s ─▶ Snapshot
//!                       └─ at once, if there is a listener ─▶ ReportLine ─▶ each listener, as fast as it takes them
//! ```
//!
//! Looking changes nothing: snapshots and recordings are the same with and without listeners.

use std::sync::Arc;
use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::broadcast::{self, Receiver, Sender};

use crate::log_limit::CountLog;
use crate::shared_count::SharedCount;
use kehai_tracking::jsonl::TrackLine;

/// Reports that wait for a listener, a second of sixteen modules; a slower one misses the oldest.
const WAITING: usize = 256;

/// All tracks, right after a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReportLine {
    /// When the report had arrived and was used, s on the tracker's clock: that of frames.
    pub t: f64,
    /// The module of the report, as the site names it.
    pub module: String,
    /// The report's number.
    pub sequence: u32,
    /// All tracks, as in a snapshot.
    pub tracks: Vec<TrackLine>,
}

/// Where they are published. Clones are the same place.
#[derive(Clone, Debug)]
pub struct Reports {
    listeners: Sender<Arc<ReportLine>>,
    missed: SharedCount,
}

impl Default for Reports {
    fn default() -> Self {
        Self { listeners: broadcast::channel(WAITING).0, missed: SharedCount::default() }
    }
}

impl Reports {
    /// Whether there is a listener.
    #[must_use]
    pub fn are_wanted(&self) -> bool {
        self.listeners.receiver_count() > 0
    }

    /// Publishes to all listeners.
    pub fn publish(&self, line: ReportLine) {
        // A listener that has just left hears nothing.
        let _ = self.listeners.send(Arc::new(line));
    }

    /// Every report from now on.
    #[must_use]
    pub fn listen(&self) -> Listener {
        let (reports, of_all) = (self.listeners.subscribe(), self.missed.clone());
        Listener { reports, missed: 0, of_all, log: CountLog::default() }
    }

    /// How many listeners were too slow for, those that have left included.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.get()
    }
}

/// A listener.
#[derive(Debug)]
pub struct Listener {
    reports: Receiver<Arc<ReportLine>>,
    missed: u64,
    /// The same of all listeners.
    of_all: SharedCount,
    log: CountLog<1>,
}

impl Listener {
    /// The next one that was not missed; none when no more will come.
    ///
    /// # Cancellation
    /// Nothing is lost.
    pub async fn next(&mut self) -> Option<Arc<ReportLine>> {
        loop {
            match self.reports.recv().await {
                Ok(line) => return Some(line),
                Err(RecvError::Lagged(missed)) => {
                    self.missed += missed;
                    self.of_all.add(missed);
                    if self.log.is_due([self.missed], Instant::now()) {
                        tracing::warn!("a client has missed {} reports, which came too fast", self.missed);
                    }
                }
                Err(RecvError::Closed) => return None,
            }
        }
    }

    /// How many it was too slow for.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listener_that_is_too_slow_misses_the_oldest_and_knows_how_many() {
        let reports = Reports::default();
        let mut listener = reports.listen();
        for sequence in 0..WAITING as u32 + 10 {
            reports.publish(ReportLine { t: 0.0, module: "left".into(), sequence, tracks: Vec::new() });
        }
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let first = runtime.block_on(listener.next()).unwrap();
        assert_eq!((first.sequence, listener.missed()), (10, 10));
        drop(listener);
        assert_eq!(reports.missed(), 10, "also of one that has left");
    }
}
