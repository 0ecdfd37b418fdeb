//! Alarms about the places of devices: one that was turned, moved or covered is named while people walk.
//!
//! ```text
//!   observations ─▶ PoseWatch ─▶ finding ─▶ alarm on the device's line
//!   backgrounds ────▶┘
//! ```

use kehai_tracking::alarm::{AlarmKind, AlarmLine};
use kehai_tracking::calibration::watch::PoseWatch;
use kehai_tracking::calibration::words;
use kehai_tracking::observation::Observation;
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::ModuleLine;

/// Watches over the places of a site's devices.
#[derive(Debug)]
pub struct Poses(PoseWatch);

impl Poses {
    /// Of the devices of this site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        Self(PoseWatch::new(site))
    }

    /// Uses what a device saw.
    pub fn observe(&mut self, observation: &Observation) {
        self.0.observe(observation);
    }

    /// Adds what is wrong to `lines`, which begin with the site's devices in its order. Of a device that is silent, or
    /// covered, nothing more is said.
    pub fn raise(&mut self, sessions: &Sessions, lines: &mut [ModuleLine], now_us: u64) {
        for session in sessions.in_place() {
            if let Some(place) = session.place_in_site() {
                self.0.know_walls(place, session.walls_mm());
            }
        }
        for (place, finding) in self.0.findings(now_us as f64 * 1e-6) {
            let Some(line) = lines.get_mut(place) else { continue };
            let (kind, text) = words::finding(&finding);
            if !line.alarms.iter().any(|alarm| matches!(alarm.kind, AlarmKind::Silent | AlarmKind::Covered)) {
                line.alarms.push(AlarmLine::new(kind, text));
                line.alarms.sort_by_key(|alarm| std::cmp::Reverse(alarm.severity));
            }
        }
    }
}
