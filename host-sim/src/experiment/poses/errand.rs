//! The route of a person from one place to another: around walls and furniture, at walking speed.
//!
//! ```text
//!   ░●··   ░░   the shortest way over the walkable ground, walked at 0.9 m/s, its corners rounded over half a second
//!   ░░░ ·····▶
//! ```

use crate::world::geometry::Point;
use crate::world::motion::LED_STEP_S;
use crate::world::scene::Scene;
use crate::world::walkable::Walkable;

/// Walking speed, m/s.
const SPEED_M_S: f64 = 0.9;
/// Half the time over which corners are rounded, in steps.
const ROUNDED: usize = 6;

/// Where one can walk.
pub struct Floor(Walkable);

impl Floor {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        Self(Walkable::of(scene, &[]))
    }

    /// Where one can stand that is nearest to `at`.
    pub fn near(&self, at: Point) -> Point {
        self.0.near(at)
    }

    /// The way from `from` to about `to`: a place every [`LED_STEP_S`]. At least a few steps, on the spot if need be.
    pub fn way(&self, from: Point, to: Point) -> Vec<Point> {
        let corners = self.0.steps(from, to);
        let corners: Vec<Point> = [from].into_iter().chain(corners.into_iter().skip(1)).collect();
        let mut places = Vec::new();
        let step_m = SPEED_M_S * LED_STEP_S;
        let mut ahead_m = step_m;
        for side in corners.windows(2) {
            let length = (side[1] - side[0]).length();
            while ahead_m < length {
                places.push(side[0] + (side[1] - side[0]) * (ahead_m / length));
                ahead_m += step_m;
            }
            ahead_m -= length;
        }
        let last = places.last().copied().unwrap_or(from);
        places.extend([last; 2 * ROUNDED]);
        let rounded = |index: usize| {
            let part = (index as i64 - ROUNDED as i64)..=(index as i64 + ROUNDED as i64);
            let at = |index: i64| match usize::try_from(index) {
                Ok(index) => places.get(index).copied().unwrap_or(last),
                Err(_) => from,
            };
            let count = part.clone().count() as f64;
            part.fold(Point::default(), |sum, index| sum + at(index)) * (1.0 / count)
        };
        (0..places.len()).map(rounded).collect()
    }
}
