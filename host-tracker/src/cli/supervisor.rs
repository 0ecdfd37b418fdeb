//! What systemd is told, where it is the supervisor: that the tracker is ready, goes on, and ends. Elsewhere nothing is.
//!
//! ```text
//!   sockets and files are open ─▶ READY=1      a snapshot, at most each second ─▶ WATCHDOG=1      the end ─▶ STOPPING=1
//! ```
//!
//! Source: sd_notify(3).

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// Between two signs of life.
const BETWEEN: Duration = Duration::from_secs(1);

/// The supervisor.
#[derive(Debug)]
pub struct Supervisor {
    told: Instant,
}

impl Supervisor {
    /// The tracker is ready.
    pub fn ready() -> Self {
        tell(&NotifyState::Ready);
        Self { told: Instant::now() }
    }

    /// The tracker goes on: it has made a snapshot.
    pub fn lives(&mut self) {
        if self.told.elapsed() >= BETWEEN {
            self.told = Instant::now();
            tell(&NotifyState::Watchdog);
        }
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        tell(&NotifyState::Stopping);
    }
}

fn tell(state: &NotifyState<'_>) {
    // Fails without a supervisor, which does not matter; one that cannot be told will restart the tracker.
    let _ = sd_notify::notify(std::slice::from_ref(state));
}
