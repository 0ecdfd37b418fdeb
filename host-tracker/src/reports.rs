//! Who is known to be where right after each report, for whoever cannot wait for the next frame.
//!
//! ```text
//!   report ─▶ follower ─┬─ every 0.1 s ─▶ Frame
//!                       └─ at once, only if somebody listens ─▶ ReportLine ─▶ each listener, as fast as it takes them
//! ```
//!
//! Looking changes nothing: frames and recordings are the same whether or not anybody listens.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::broadcast::{self, Receiver, Sender};

use crate::jsonl::TrackLine;

/// Reports that wait for a listener, a second of sixteen modules; whoever is slower misses the oldest.
const WAITING: usize = 256;

/// Everybody, right after a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportLine {
    /// When the report had arrived and was used, s on the tracker's clock: that of frames.
    pub t: f64,
    /// Whose report it was, as the site calls it.
    pub module: String,
    /// The report's number.
    pub sequence: u32,
    /// Everybody, as in a frame.
    pub tracks: Vec<TrackLine>,
}

/// Where they are told. Clones are the same place.
#[derive(Clone, Debug)]
pub struct Reports(Sender<Arc<ReportLine>>);

impl Default for Reports {
    fn default() -> Self {
        Self(broadcast::channel(WAITING).0)
    }
}

impl Reports {
    /// Whether anybody listens.
    #[must_use]
    pub fn are_wanted(&self) -> bool {
        self.0.receiver_count() > 0
    }

    /// Tells everybody who listens.
    pub fn tell(&self, line: ReportLine) {
        // Who has just left hears nothing.
        let _ = self.0.send(Arc::new(line));
    }

    /// Every report from now on.
    #[must_use]
    pub fn listen(&self) -> Listener {
        Listener(self.0.subscribe())
    }
}

/// Somebody who listens.
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
