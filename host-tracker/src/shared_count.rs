//! A count that only grows, which one thread adds to and others read: of what was lost, for the log and the metrics.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A count. Clones are the same one.
#[derive(Clone, Debug, Default)]
pub struct SharedCount(Arc<AtomicU64>);

impl SharedCount {
    /// So many more.
    pub fn add(&self, more: u64) {
        self.0.fetch_add(more, Ordering::Relaxed);
    }

    /// How many so far.
    #[must_use]
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
