//! Collision avoidance between people by velocity obstacles: another model of crowds than the social force.
//!
//! ```text
//!           ╲      ╱   velocities that lead to a collision within 2 s
//!            ╲ ×  ╱
//!     wanted ──▶ ╳ ○ the other's, half taken over
//!            ● ─▶      chosen: the least  |v − wanted| + weight / time to collision
//! ```
//!
//! Source: Fiorini and Shiller 1998; that each of two takes half of the way over, van den Berg, Lin and Manocha 2008
//! (reciprocal velocity obstacles). People choose out of a fixed set of velocities, so nothing here is random.

use super::crowd::{STEP_S, Walker, nearest};
use super::geometry::{Outline, Point};

/// A collision later than this does not matter, s.
const HORIZON_S: f64 = 2.0;

/// What a collision in a second costs, as a deviation from the wanted velocity, m/s.
const COLLISION_M_S: f64 = 0.5;

/// Time in which a walker reaches the chosen velocity, s.
const RELAXATION_S: f64 = 0.3;

/// Within this time of the goal a walker slows down, s.
const ARRIVAL_S: f64 = 0.5;

/// Share of an overlap that is undone in a step: bodies do not pass through each other.
const PART: f64 = 0.2;

/// Directions and speeds to choose from.
const DIRECTIONS: u32 = 16;
const SPEEDS: [f64; 3] = [0.35, 0.7, 1.0];

/// Moves all people by one step of [`STEP_S`] among `obstacles`.
pub fn step(walkers: &mut [Walker], obstacles: &[Outline]) {
    let chosen: Vec<Point> = (0..walkers.len()).map(|index| choose(walkers, index, obstacles)).collect();
    let apart: Vec<Point> = (0..walkers.len()).map(|index| part(walkers, index, obstacles)).collect();
    for ((walker, chosen), apart) in walkers.iter_mut().zip(chosen).zip(apart) {
        walker.velocity = walker.velocity + (chosen - walker.velocity) * (STEP_S / RELAXATION_S).min(1.0);
        walker.at = walker.at + walker.velocity * STEP_S + apart;
    }
}

/// The velocity that walker `index` chooses, m/s.
fn choose(walkers: &[Walker], index: usize, obstacles: &[Outline]) -> Point {
    let Some(walker) = walkers.get(index) else { return Point::default() };
    let way = walker.goal - walker.at;
    let distance_m = way.length();
    let speed_m_s = walker.speed_m_s.min(distance_m / ARRIVAL_S);
    let wanted = if distance_m > 0.0 { way * (speed_m_s / distance_m) } else { Point::default() };
    let near = |other: &&Walker| (other.at - walker.at).length() < 2.0 * HORIZON_S;
    let others = walkers.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| other);
    let others: Vec<&Walker> = others.filter(near).collect();
    let cost = |velocity: Point| {
        let deviation_m_s = (velocity - wanted).length();
        let soonest_s = others
            .iter()
            .filter_map(|other| {
                // Half of the evasion is the other's.
                let relative = velocity * 2.0 - walker.velocity - other.velocity;
                collision_s(other.at - walker.at, relative, walker.radius_m + other.radius_m)
            })
            .chain(obstacles.iter().filter_map(|obstacle| {
                collision_s(nearest(obstacle, walker.at) - walker.at, velocity, walker.radius_m)
            }))
            .fold(HORIZON_S, f64::min);
        let collision_m_s =
            if soonest_s < HORIZON_S { COLLISION_M_S * (1.0 / soonest_s.max(0.1) - 0.5) } else { 0.0 };
        deviation_m_s + collision_m_s
    };
    let fan = (0..DIRECTIONS).flat_map(|direction| {
        let towards = Point::towards(f64::from(direction) * std::f64::consts::TAU / f64::from(DIRECTIONS));
        SPEEDS.map(|share| towards * (share * walker.speed_m_s))
    });
    let all = [wanted, Point::default()].into_iter().chain(fan);
    all.min_by(|one, other| cost(*one).total_cmp(&cost(*other))).unwrap_or(wanted)
}

/// When two discs touch first, s, the one `offset` away, both radii together `touch_m`; none: never.
fn collision_s(offset: Point, relative: Point, touch_m: f64) -> Option<f64> {
    let (a, b, c) = (relative.dot(relative), offset.dot(relative), offset.dot(offset) - touch_m * touch_m);
    if c <= 0.0 {
        // They touch: only what goes nearer collides.
        return (b > 0.0).then_some(0.0);
    }
    let root = b * b - a * c;
    (b > 0.0 && root > 0.0).then(|| (b - root.sqrt()) / a)
}

/// What undoes an overlap of walker `index` with others and obstacles in this step, m.
fn part(walkers: &[Walker], index: usize, obstacles: &[Outline]) -> Point {
    let Some(walker) = walkers.get(index) else { return Point::default() };
    let away = |place: Point, touch_m: f64, share: f64| {
        let offset = walker.at - place;
        let (distance_m, overlap_m) = (offset.length(), touch_m - offset.length());
        if overlap_m > 0.0 && distance_m > 1e-9 {
            offset * (share * overlap_m / distance_m)
        } else {
            Point::default()
        }
    };
    let others = walkers.iter().enumerate().filter(|(other, _)| *other != index);
    let from_people = others.fold(Point::default(), |sum, (_, other)| {
        sum + away(other.at, walker.radius_m + other.radius_m, 0.5 * PART)
    });
    obstacles
        .iter()
        .fold(from_people, |sum, obstacle| sum + away(nearest(obstacle, walker.at), walker.radius_m, PART))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker(x: f64, y: f64, goal: [f64; 2]) -> Walker {
        let at = Point::new(x, y);
        Walker { at, velocity: Point::default(), radius_m: 0.22, speed_m_s: 1.0, goal: goal.into() }
    }

    fn closest_m(walkers: &mut [Walker], obstacles: &[Outline], seconds: f64) -> f64 {
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
    fn a_lone_walker_arrives() {
        let mut walkers = [walker(0.0, 0.0, [3.0, 1.0])];
        closest_m(&mut walkers, &[], 8.0);
        assert!((walkers[0].at - Point::new(3.0, 1.0)).length() < 0.05);
    }

    #[test]
    fn two_who_meet_head_on_pass_each_other() {
        let mut walkers = [walker(-2.0, 0.02, [2.0, 0.0]), walker(2.0, -0.02, [-2.0, 0.0])];
        let closest_m = closest_m(&mut walkers, &[], 10.0);
        assert!(closest_m > -0.05, "{closest_m}");
        assert!(walkers[0].at.x > 1.8 && walkers[1].at.x < -1.8, "{walkers:?}");
    }

    #[test]
    fn no_person_walks_through_a_wall() {
        let wall = Outline::Segment(Point::new(1.0, -3.0), Point::new(1.0, 3.0));
        let mut walkers = [walker(0.0, 0.0, [2.0, 0.0])];
        closest_m(&mut walkers, &[wall], 6.0);
        assert!(walkers[0].at.x < 0.85, "{}", walkers[0].at.x);
    }
}
