//! Reflections: a detection behind a wall that no beam passes is shown as a tentative track and never confirmed.
//!
//! ```text
//!   module ●━━━━━━━━━━┓ mirror
//!          ╭──╮       ┃ ━ ━ ━ ━ ━ ╭┄┄╮     tentative, with its reason; deleted when it is not detected
//!          ╰──╯◀━━━━━━┛           ╰┄┄╯
//! ```
//!
//! Which detections these are, the walls say: [`super::walls::Walls::is_reflection`].

use super::kalman::{Kinematics, PROCESS_NOISE};
use super::{LifeCycle, Origin, TrackId, TrackState};
use crate::geometry::Point;
use crate::observation::Detection;

/// A detection farther from a reflection than this is of another one, m: the gate of a person who walks.
const GATE_M: f64 = 0.8;

/// It is deleted after so long without a detection, s.
const PATIENCE_S: f64 = 0.6;

/// Why the track of a reflection is shown with an existence of 0.
const REASON: &str = "a reflection: behind a wall";

/// All that are seen behind walls.
#[derive(Clone, Debug, Default)]
pub struct Reflections(Vec<Reflection>);

impl Reflections {
    /// Takes what is seen behind walls by one module: each is of the nearest that was there before. `next_id` gives a new number.
    pub fn follow<'a>(
        &mut self,
        seen: impl Iterator<Item = &'a Detection>,
        now_s: f64,
        mut next_id: impl FnMut() -> TrackId,
    ) {
        self.0.retain(|reflection| reflection.lasts(now_s));
        for seen in seen {
            let far_m = |reflection: &Reflection| {
                let place = reflection.motion.place(seen.at_s);
                (place - Point::new(seen.centre.x, seen.centre.y)).length()
            };
            let near = self.0.iter_mut().map(|reflection| (far_m(reflection), reflection));
            let nearest = near.min_by(|one, two| one.0.total_cmp(&two.0));
            if let Some((_, reflection)) = nearest.filter(|(far_m, _)| *far_m < GATE_M) {
                reflection.motion.update(seen.at_s, seen.centre, &seen.covariance);
                reflection.last_hit_s = reflection.last_hit_s.max(seen.at_s);
                continue;
            }
            let motion = Kinematics::new(seen.at_s, seen.centre, &seen.covariance, 1.0, PROCESS_NOISE);
            self.0.push(Reflection { id: next_id(), motion, last_hit_s: seen.at_s });
        }
    }

    /// Those that were seen not long before `at_s`, as they are published: tracks with an existence of 0.
    pub fn states(&self, at_s: f64) -> impl Iterator<Item = TrackState> {
        self.0
            .iter()
            .filter(move |reflection| reflection.lasts(at_s))
            .map(move |reflection| reflection.state(at_s))
    }
}

/// What is seen behind a wall.
#[derive(Clone, Debug)]
struct Reflection {
    id: TrackId,
    motion: Kinematics,
    last_hit_s: f64,
}

impl Reflection {
    fn lasts(&self, now_s: f64) -> bool {
        now_s - self.last_hit_s < PATIENCE_S
    }

    fn state(&self, at_s: f64) -> TrackState {
        let spread = self.motion.spread(at_s);
        TrackState {
            id: self.id,
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
