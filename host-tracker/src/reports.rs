//! The tracks right after each report, for listeners that cannot wait for the next snapshot.
//!
//! ```text
//!   report ─▶ site tracker ─┬─ every 0.1 s ─▶ Snapshot
//!                       └─ at once, if there is a listener ─▶ ReportLine ─▶ each listener, as fast as it takes them
//! ```
//!
//! Looking changes nothing: snapshots and recordings are the same with and without listeners.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::broadcast::{self, Receiver, Sender};

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
pub struct Reports(Sender<Arc<ReportLine>>);

impl Default for Reports {
    fn default() -> Self {
        Self(broadcast::channel(WAITING).0)
    }
}

impl Reports {
    /// Whether there is a listener.
    #[must_use]
    pub fn are_wanted(&self) -> bool {
        self.0.receiver_count() > 0
    }

    /// Publishes to all listeners.
    pub fn publish(&self, line: ReportLine) {
        // A listener that has just left hears nothing.
        let _ = self.0.send(Arc::new(line));
    }

    /// Every report from now on.
    #[must_use]
    pub fn listen(&self) -> Listener {
        Listener(self.0.subscribe())
    }
}

/// A listener.
#[derive(Debug)]
pub struct Listener(Receiver<Arc<ReportLine>>);

impl Listener {
    /// The next one that was not missed; none when no more will come.
    ///
    /// # Cancellation
    /// Nothing is lost.
    pub async fn next(&mut self) -> Option<Arc<ReportLine>> {
        loop {
            match self.0.recv().await {
                Ok(line) => return Some(line),
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return None,
            }
        }
    }
}
