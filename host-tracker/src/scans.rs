//! What a module saw empty in each scan, for listeners that want the free space itself.
//!
//! ```text
//!   report ─▶ observation ─┬─ tracker
//!                          ├─ once a second ─▶ recording, if there is one
//!                          └─ each, if there is a listener ─▶ Scan ─▶ each listener, as fast as it takes them
//! ```

use std::sync::Arc;

use tokio::sync::broadcast::error::TryRecvError;
use tokio::sync::broadcast::{self, Receiver, Sender};

use crate::shared_count::SharedCount;
use kehai_tracking::observation::{Observation, View};

/// Scans that wait for a listener, a second of sixteen modules; a slower one misses the oldest.
const WAITING: usize = 256;

/// What is shown of an observation.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The module's name.
    pub module: String,
    /// When step 0 passed, s on the tracker's clock.
    pub start_s: f64,
    /// Where it is, and where its beams point.
    pub view: Arc<View>,
    /// Beam by beam, up to which range nothing was, mm; 0: not known.
    pub empty_mm: Vec<u16>,
}

impl Scan {
    /// What `module` saw.
    #[must_use]
    pub fn of(module: &str, observation: &Observation) -> Self {
        let &Observation { start_s, ref view, ref empty_mm, .. } = observation;
        Self { module: module.to_owned(), start_s, view: Arc::clone(view), empty_mm: empty_mm.clone() }
    }
}

/// Where they are published. Clones are the same place.
#[derive(Clone, Debug)]
pub struct Scans {
    listeners: Sender<Arc<Scan>>,
    missed: SharedCount,
}

impl Default for Scans {
    fn default() -> Self {
        Self { listeners: broadcast::channel(WAITING).0, missed: SharedCount::default() }
    }
}

impl Scans {
    /// Whether there is a listener.
    #[must_use]
    pub fn are_wanted(&self) -> bool {
        self.listeners.receiver_count() > 0
    }

    /// Publishes to all listeners.
    pub fn publish(&self, scan: Scan) {
        // A listener that has just left hears nothing.
        let _ = self.listeners.send(Arc::new(scan));
    }

    /// Every scan from now on.
    #[must_use]
    pub fn listen(&self) -> ScanListener {
        ScanListener { scans: self.listeners.subscribe(), missed: 0, of_all: self.missed.clone() }
    }

    /// How many listeners were too slow for, those that have left included.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.get()
    }
}

/// A listener.
#[derive(Debug)]
pub struct ScanListener {
    scans: Receiver<Arc<Scan>>,
    missed: u64,
    /// The same of all listeners.
    of_all: SharedCount,
}

impl ScanListener {
    /// The next one, if one waits.
    pub fn waiting(&mut self) -> Option<Arc<Scan>> {
        loop {
            match self.scans.try_recv() {
                Ok(scan) => return Some(scan),
                Err(TryRecvError::Lagged(missed)) => {
                    self.missed += missed;
                    self.of_all.add(missed);
                }
                Err(TryRecvError::Empty | TryRecvError::Closed) => return None,
            }
        }
    }

    /// How many it was too slow for.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.missed
    }
}

/// Scans that are listened to only while a client wants them.
#[derive(Debug, Default)]
pub struct WantedScans {
    listener: Option<ScanListener>,
    /// Those that listeners of before were too slow for.
    missed: u64,
}

impl WantedScans {
    /// Listens from now on, or no more.
    pub fn want(&mut self, are_wanted: bool, scans: &Scans) {
        if are_wanted {
            self.listener.get_or_insert_with(|| scans.listen());
        } else if let Some(listener) = self.listener.take() {
            self.missed += listener.missed();
        }
    }

    /// Whether they are listened to.
    #[must_use]
    pub const fn are_wanted(&self) -> bool {
        self.listener.is_some()
    }

    /// The next one, if one waits.
    pub fn waiting(&mut self) -> Option<Arc<Scan>> {
        self.listener.as_mut()?.waiting()
    }

    /// How many came too fast, of all that were ever wanted.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed + self.listener.as_ref().map_or(0, ScanListener::missed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::scan::{Geometry, GeometryParts};
    use kehai_tracking::geometry::{Point, Pose};

    fn scan(number: usize) -> Scan {
        let geometry = Geometry::new(GeometryParts {
            first_step: 44,
            last_step: 725,
            cluster: 1,
            front_step: 384,
            steps_per_turn: 1024,
            period_us: 100_000,
            range_min_mm: 20,
            range_max_mm: 5600,
        });
        let pose = Pose { at: Point::new(0.0, 0.0), yaw_rad: 0.0 };
        let geometry = geometry.unwrap();
        let view = View { module: 0, pose, height_m: 1.0, geometry, upside_down: false };
        Scan { module: "left".into(), start_s: number as f64, view: Arc::new(view), empty_mm: Vec::new() }
    }

    #[test]
    fn a_listener_that_is_too_slow_misses_the_oldest_and_knows_how_many() {
        let scans = Scans::default();
        assert!(!scans.are_wanted());
        scans.publish(scan(0));
        let mut listener = scans.listen();
        assert!(scans.are_wanted());
        for number in 0..WAITING + 10 {
            scans.publish(scan(number));
        }
        let first = listener.waiting().unwrap();
        assert_eq!((first.start_s, listener.missed()), (10.0, 10));
        drop(listener);
        assert_eq!((scans.are_wanted(), scans.missed()), (false, 10));
    }
}
