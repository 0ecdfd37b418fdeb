//! The calibration under way, shared by the thread that tracks and the terminal or the map.
//!
//! ```text
//!   tracking thread ─ observations, backgrounds ─▶ Calibration ◀─ begin · finish · stop ─ terminal or browser
//!                                                    └─────── Status ───────────────▶
//! ```
//!
//! The tracking thread only adds observations; the equations are solved on the thread that asks, on a clone, so that
//! tracking never waits for them.

use std::sync::Arc;

use kehai_tracking::calibration::session::{Session, Status};
use kehai_tracking::floor::Reading;
use kehai_tracking::geometry::Pose;
use kehai_tracking::observation::Observation;
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;
use parking_lot::Mutex;

/// A handle: clones are the same calibration.
#[derive(Clone, Debug, Default)]
pub struct Calibration(Arc<Mutex<Session>>);

impl Calibration {
    /// The site in use.
    pub fn set_site(&self, site: &Arc<Site>) {
        self.0.lock().set_site(site);
    }

    /// Adds an observation; without a calibration under way it costs a lock.
    pub fn observe(&self, observation: &Observation) {
        self.0.lock().observe(observation);
    }

    /// The same with a reading of a floor.
    pub fn read(&self, reading: &Reading) {
        self.0.lock().read(reading);
    }

    /// Looks at backgrounds, and where to walk next.
    pub fn tick(&self, sessions: &Sessions, now_s: f64) {
        self.0.lock().tick(sessions, now_s);
    }

    /// Begins a new one, whatever was.
    pub fn begin(&self) {
        self.0.lock().begin();
    }

    /// Ends it; nothing has changed.
    pub fn stop(&self) {
        self.0.lock().stop();
    }

    /// Works out the poses from what was walked so far; [`go_on`](Self::go_on) walks on. It takes some tenths of a
    /// second.
    pub fn finish(&self) {
        let walked = self.0.lock().clone();
        if let Some(result) = walked.solve() {
            self.0.lock().conclude(result);
        }
    }

    /// Goes on walking after a result.
    pub fn go_on(&self) {
        self.0.lock().go_on();
    }

    /// The poses found, by the names of the site's modules and floors.
    #[must_use]
    pub fn poses(&self) -> Option<Vec<(String, Pose)>> {
        self.0.lock().poses()
    }

    /// How far it is.
    #[must_use]
    pub fn status(&self) -> Status {
        let session = self.0.lock().clone();
        session.status()
    }
}
