//! Collision avoidance between people: the social-force model.
//!
//! ```text
//!   acceleration =  (wanted velocity − velocity) / τ           towards the goal, slower when near
//!                 + Σ other people   A·exp(−gap / B) + k·overlap      away from them
//!                 + Σ walls          A·exp(−gap / B) + k·overlap      away from the nearest point
//! ```
//!
//! Source: Helbing and Molnár 1995, with the body contact of Helbing, Farkas and Vicsek 2000. A and B are
//! chosen so that people with places close together end up about 5 cm apart.

use super::geometry::{Outline, Point};

/// A person in the crowd.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// Position.
    pub at: Point,
    /// Velocity.
    pub velocity: Point,
    /// Radius of the body, taken as round.
    pub radius_m: f64,
    /// Preferred speed.
    pub speed_m_s: f64,
    /// Goal.
    pub goal: Point,
}

/// Relaxation time: in which a walker reaches the wanted velocity.
const RELAXATION_S: f64 = 0.4;
/// Within this time of the goal a walker slows down.
const ARRIVAL_S: f64 = 0.5;
/// Repulsion where bodies would touch, and the gap over which it falls by e.
const REPULSION_M_S2: f64 = 4.0;
const REPULSION_GAP_M: f64 = 0.05;
/// Push back for each metre of overlap.
const CONTACT_S2: f64 = 300.0;
/// Upper bound of the speed: forces push no person faster.
const LARGEST_SPEED_M_S: f64 = 3.5;
/// Cut-off: a larger gap gives no force.
const FARTHEST_GAP_M: f64 = 0.5;
/// Passers-by keep to their right: the share of the repulsion that acts sideways.
const SIDESTEP: f64 = 0.3;
/// Time of one step of the simulation.
pub const STEP_S: f64 = 0.01;

/// Moves all people by one step of [`STEP_S`] among `obstacles`.
pub fn step(walkers: &mut [Walker], obstacles: &[Outline]) {
    let accelerations: Vec<Point> = walkers
        .iter()
        .enumerate()
        .map(|(index, walker)| {
            let others = walkers.iter().enumerate().filter(|(other, _)| *other != index);
            let from_people = others.fold(Point::default(), |sum, (_, other)| sum + evasion(walker, other));
            let from_walls = obstacles.iter().fold(Point::default(), |sum, obstacle| {
                sum + repulsion(walker.at - nearest(obstacle, walker.at), walker.radius_m)
            });
            drive(walker) + from_people + from_walls
        })
        .collect();
    for (walker, acceleration) in walkers.iter_mut().zip(accelerations) {
        walker.velocity = walker.velocity + acceleration * STEP_S;
        let speed_m_s = walker.velocity.length();
        if speed_m_s > LARGEST_SPEED_M_S {
            walker.velocity = walker.velocity * (LARGEST_SPEED_M_S / speed_m_s);
        }
        walker.at = walker.at + walker.velocity * STEP_S;
    }
}

fn drive(walker: &Walker) -> Point {
    let way = walker.goal - walker.at;
    let distance_m = way.length();
    let speed_m_s = walker.speed_m_s.min(distance_m / ARRIVAL_S);
    let wanted = if distance_m > 0.0 { way * (speed_m_s / distance_m) } else { Point::default() };
    (wanted - walker.velocity) * (1.0 / RELAXATION_S)
}

fn evasion(walker: &Walker, other: &Walker) -> Point {
    let push = repulsion(walker.at - other.at, walker.radius_m + other.radius_m);
    push + push.left() * SIDESTEP
}

/// Away along `offset`; bodies touch where it is `touch_m` long.
fn repulsion(offset: Point, touch_m: f64) -> Point {
    let distance_m = offset.length();
    let gap_m = distance_m - touch_m;
    if gap_m > FARTHEST_GAP_M || distance_m == 0.0 {
        return Point::default();
    }
    let strength =
        REPULSION_M_S2 * libm::exp(-gap_m.max(0.0) / REPULSION_GAP_M) + CONTACT_S2 * (-gap_m).max(0.0);
    offset * (strength / distance_m)
}

/// The point of an obstacle that is nearest to `at`; ellipses are taken as round.
pub(super) fn nearest(obstacle: &Outline, at: Point) -> Point {
    match *obstacle {
        Outline::Segment(from, to) => {
            let side = to - from;
            let share = ((at - from).dot(side) / side.dot(side).max(1e-12)).clamp(0.0, 1.0);
            from + side * share
        }
        Outline::Ellipse { centre, half_axes_m: (along, across), .. }
        | Outline::Superellipse { centre, half_axes_m: (along, across), .. } => {
            let offset = at - centre;
            centre + offset * (along.max(across) / offset.length().max(1e-9)).min(1.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker(x: f64, y: f64, goal: [f64; 2]) -> Walker {
        let at = Point::new(x, y);
        Walker { at, velocity: Point::default(), radius_m: 0.22, speed_m_s: 1.0, goal: goal.into() }
    }

    fn run(walkers: &mut [Walker], obstacles: &[Outline], seconds: f64) -> f64 {
        let mut closest_m = f64::INFINITY;
        for _ in 0..(seconds / STEP_S) as usize {
            step(walkers, obstacles);
            for (index, one) in walkers.iter().enumerate() {
                for other in &walkers[..index] {
                    closest_m = closest_m.min((one.at - other.at).length() - one.radius_m - other.radius_m);
                }
            }
        }
        closest_m
    }

    #[test]
    fn a_lone_walker_goes_straight_to_the_goal_and_stops_there() {
        let mut walkers = [walker(0.0, 0.0, [3.0, 1.0])];
        run(&mut walkers, &[], 2.0);
        assert!((walkers[0].velocity.length() - 1.0).abs() < 0.05);
        run(&mut walkers, &[], 6.0);
        assert!((walkers[0].at - Point::new(3.0, 1.0)).length() < 0.02);
    }

    #[test]
    fn two_people_who_meet_pass_beside_each_other() {
        let mut walkers = [walker(-2.0, 0.0, [2.0, 0.0]), walker(2.0, 0.0, [-2.0, 0.0])];
        let closest_m = run(&mut walkers, &[], 8.0);
        assert!(closest_m > -0.08, "they overlapped by {closest_m}");
        assert!(walkers.iter().all(|walker| (walker.at - walker.goal).length() < 0.1));
    }

    #[test]
    fn walls_stop_people() {
        let wall = Outline::Segment(Point::new(1.0, -2.0), Point::new(1.0, 2.0));
        let mut walkers = [walker(0.0, 0.0, [3.0, 0.0])];
        run(&mut walkers, &[wall], 10.0);
        assert!(walkers[0].at.x < 1.0 - 0.15, "{:?}", walkers[0].at);
    }
}
