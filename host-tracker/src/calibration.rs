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

use kehai_tracking::calibration::session::Session;
use kehai_tracking::calibration::status::{Mounting, Status};
use kehai_tracking::floor::Reading;
use kehai_tracking::observation::Observation;
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;
use kehai_tracking::survey::{self, Background};
use parking_lot::Mutex;

/// A handle: clones are the same calibration.
#[derive(Clone, Debug, Default)]
pub struct Calibration {
    session: Arc<Mutex<Session>>,
    backgrounds: Arc<Mutex<Vec<(String, Background)>>>,
}

impl Calibration {
    /// The site in use.
    pub fn set_site(&self, site: &Arc<Site>) {
        self.session.lock().set_site(site);
    }

    /// Adds an observation; without a calibration under way it costs a lock.
    pub fn observe(&self, observation: &Observation) {
        self.session.lock().observe(observation);
    }

    /// The same with a reading of a floor.
    pub fn read(&self, reading: &Reading) {
        self.session.lock().read(reading);
    }

    /// Looks at backgrounds, and where to walk next.
    pub fn tick(&self, sessions: &Sessions, now_s: f64) {
        let mut session = self.session.lock();
        session.tick(sessions, now_s);
        *self.backgrounds.lock() = survey::backgrounds(sessions, session.site());
    }

    /// What modules have learned of the empty place, by their names.
    #[must_use]
    pub fn backgrounds(&self) -> Vec<(String, Background)> {
        self.backgrounds.lock().clone()
    }

    /// Begins a new one, whatever was.
    pub fn begin(&self) {
        self.session.lock().begin();
    }

    /// Ends it; nothing has changed.
    pub fn stop(&self) {
        self.session.lock().stop();
    }

    /// Works out the poses from what was walked so far; [`go_on`](Self::go_on) walks on. It takes some tenths of a
    /// second. What another client begins meanwhile keeps its own walk.
    pub fn finish(&self) {
        let walked = self.session.lock().clone();
        if let Some(solved) = walked.solve() {
            self.session.lock().conclude(solved);
        }
    }

    /// Goes on walking after a result.
    pub fn go_on(&self) {
        self.session.lock().go_on();
    }

    /// Where the site's modules and floors were found.
    #[must_use]
    pub fn mountings(&self) -> Option<Vec<Mounting>> {
        self.session.lock().mountings()
    }

    /// How far it is.
    #[must_use]
    pub fn status(&self) -> Status {
        let session = self.session.lock().clone();
        session.status()
    }
}
