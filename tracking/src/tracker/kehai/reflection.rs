//! Reflections: a detection behind a wall that no beam passes is shown as a tentative track and never confirmed.
//!
//! ```text
//!   module ●━━━━━━━━━━┓ mirror
//!          ╭──╮       ┃ ━ ━ ━ ━ ━ ╭┄┄╮     tentative, with its reason; deleted when it is not detected
//!          ╰──╯◀━━━━━━┛           ╰┄┄╯
//! ```

use super::associate::GATE_M;
use super::birth::PATIENCE_S;
use super::{Kehai, PROCESS_NOISE};
use crate::geometry::Point;
use crate::observation::Detection;
use crate::tracker::kalman::Kinematics;
use crate::tracker::{LifeCycle, Origin, TrackState};

/// Why the track of a reflection is shown with an existence of 0.
const REASON: &str = "a reflection: behind a wall";

/// What is seen behind a wall.
#[derive(Clone, Debug)]
pub struct Reflection {
    id: u32,
    motion: Kinematics,
    last_hit_s: f64,
}

impl Reflection {
    /// Whether it was seen not long ago.
    #[must_use]
    pub fn lasts(&self, now_s: f64) -> bool {
        now_s - self.last_hit_s < PATIENCE_S
    }

    /// As published: a track with an existence of 0.
    #[must_use]
    pub fn state(&self, at_s: f64) -> TrackState {
        let spread = self.motion.spread(at_s);
        TrackState {
            id: self.id.into(),
            at: self.motion.place(at_s),
            velocity: self.motion.velocity(),
            covariance_m2: [spread[(0, 0)], spread[(0, 1)], spread[(1, 1)]],
            state: LifeCycle::Tentative,
            existence: 0.0,
            reason: REASON,
            origin: Origin::Entered,
        }
    }
}

impl Kehai {
    /// Whether a module at `from` sees this behind a wall.
    pub(super) fn is_reflection(&self, from: Point, seen: &Detection) -> bool {
        self.grounds.walls.is_reflection(from, seen.outline[1])
    }

    /// Follows what is seen behind walls: each by the nearest that was there before.
    pub(super) fn reflect<'a>(&mut self, seen: impl Iterator<Item = &'a Detection>) {
        let now_s = self.now_s;
        self.reflections.retain(|reflection| reflection.lasts(now_s));
        for seen in seen {
            let far_m = |reflection: &Reflection| {
                let place = reflection.motion.place(seen.at_s);
                (place - Point::new(seen.centre.x, seen.centre.y)).length()
            };
            let near = self.reflections.iter_mut().map(|reflection| (far_m(reflection), reflection));
            let nearest = near.min_by(|one, two| one.0.total_cmp(&two.0));
            if let Some((_, reflection)) = nearest.filter(|(far_m, _)| *far_m < GATE_M) {
                reflection.motion.update(seen.at_s, seen.centre, &seen.covariance);
                reflection.last_hit_s = reflection.last_hit_s.max(seen.at_s);
                continue;
            }
            let motion = Kinematics::new(seen.at_s, seen.centre, &seen.covariance, 1.0, PROCESS_NOISE);
            self.reflections.push(Reflection { id: self.next_id, motion, last_hit_s: seen.at_s });
            self.next_id += 1;
        }
    }
}
