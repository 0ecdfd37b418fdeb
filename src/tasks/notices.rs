//! What the module's tasks and the rest of the image tell each other, without waiting for each other.
//!
//! ```text
//!   operation ──▶ status ────────────▶ LED, service discovery
//!   operation ◀── what was dropped ◀── service discovery
//! ```

use core::cell::Cell;

use crate::device::Status;

/// The newest word from either side. For one executor: nothing here is shared with interrupts.
#[derive(Debug)]
pub struct Notices {
    status: Cell<Status>,
    discovery_dropped: Cell<u32>,
}

impl Notices {
    /// The status of a module that has just been switched on.
    #[must_use]
    pub const fn new() -> Self {
        Self { status: Cell::new(Status::NEW), discovery_dropped: Cell::new(0) }
    }

    /// How the module is.
    #[must_use]
    pub fn status(&self) -> Status {
        self.status.get()
    }

    pub(super) fn publish(&self, status: Status) {
        self.status.set(status);
    }

    /// So many more datagrams of the service discovery were dropped, in either direction.
    pub fn discovery_dropped(&self, datagrams: u32) {
        self.discovery_dropped.set(self.discovery_dropped.get().saturating_add(datagrams));
    }

    /// How many were, since the start.
    #[must_use]
    pub fn discovery_drops(&self) -> u32 {
        self.discovery_dropped.get()
    }
}

impl Default for Notices {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_reads_what_the_other_told_last() {
        let notices = Notices::new();
        assert_eq!(notices.status(), Status::NEW);
        notices.publish(Status { learning: true, ..Status::NEW });
        assert!(notices.status().learning);
        notices.discovery_dropped(1);
        notices.discovery_dropped(2);
        assert_eq!(notices.discovery_drops(), 3);
    }
}
