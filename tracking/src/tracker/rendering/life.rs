//! The life of a body: confirmed, taken for one that was hidden, deleted.
//!
//! ```text
//!   begun ─▶ confirmed ─▶ unseen ─▶ deleted
//!      └──── in an enclosed zone: the unseen body that is most likely there comes into view
//! ```

use super::body::{Body, Sample};
use super::scan::Scan;
use super::{Part, Rendering};
use crate::geometry::Point;

/// Existence from which a body is confirmed, and below which it is deleted: log odds of 0.9 and 0.3.
const CONFIRMED: f64 = 2.197;
const DELETED: f64 = -0.847;

/// A tentative body is deleted below the log odds it began with, less this.
const TENTATIVE: f64 = 1.5;

/// Outside enclosed zones an unseen body's log odds fall by so much a second: it may have left.
const LEAVES: f64 = 0.5;

/// The same where no module would see it if it stood alone: it has left. Forgotten within a second.
const GONE: f64 = 10.0;

/// A newborn inside an enclosed zone waits so long for an unseen body to be it, s.
const WAITS_S: f64 = 2.0;

impl Rendering {
    /// Deletes what is not believed any more.
    pub(super) fn forget(&mut self, newest: &Scan, start_s: f64) {
        let enclosed = &self.enclosed;
        self.bodies.retain_mut(|body| {
            let step_s = (start_s - body.supported_s).clamp(0.0, 0.05);
            if body.is_unseen(start_s) && !enclosed.hold(body.moments().0) {
                let mean = body.moments().0;
                let is_covered =
                    newest.covers(mean) || self.scans.iter().flatten().any(|scan| scan.covers(mean));
                body.log_odds -= if is_covered { LEAVES } else { GONE } * step_s;
            }
            let least = if body.confirmed { DELETED } else { body.prior - TENTATIVE };
            body.log_odds > least && (body.confirmed || !body.is_unseen(start_s))
        });
        self.fields.clear();
    }

    /// Confirms bodies. Inside an enclosed zone a new one is an unseen one that comes into view, or waits.
    pub(super) fn confirm(&mut self, start_s: f64) {
        for index in 0..self.bodies.len() {
            let body = &self.bodies[index];
            if body.confirmed || body.log_odds < CONFIRMED {
                continue;
            }
            let at = body.moments().0;
            if !self.enclosed.hold(at) || !self.model.has(Part::Conservation) {
                self.bodies[index].confirmed = true;
                continue;
            }
            let ghosts = self.bodies.iter().enumerate();
            let ghosts = ghosts
                .filter(|(other, ghost)| *other != index && ghost.confirmed && ghost.is_unseen(start_s));
            let best = ghosts
                .map(|(other, ghost)| (other, density(ghost, at, start_s)))
                .max_by(|one, other| one.1.total_cmp(&other.1));
            match best {
                Some((ghost, density)) if density > 0.0 => {
                    let id = self.bodies[ghost].id;
                    let body = &mut self.bodies[index];
                    body.confirmed = true;
                    body.id = id;
                    self.bodies.remove(ghost);
                    return;
                }
                _ if start_s - self.bodies[index].begun_s > WAITS_S => self.bodies[index].confirmed = true,
                _ => {}
            }
        }
    }
}

/// How likely it is that an unseen body comes into view at a place: the kernel density of its cloud there.
fn density(ghost: &Body, at: Point, at_s: f64) -> f64 {
    let kernel_m = 0.15 + 0.25 * (at_s - ghost.supported_s).clamp(0.0, 2.0);
    let kernel = |(sample, weight): (&Sample, &f64)| {
        let off_m = (sample.at - at).length() / kernel_m;
        weight * libm::exp(-0.5 * off_m * off_m)
    };
    ghost.samples.iter().zip(&ghost.weights).map(kernel).sum::<f64>() / (kernel_m * kernel_m)
}
