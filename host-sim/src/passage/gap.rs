//! The gap between a follower and the person before it, whatever they have with them.
//!
//! ```text
//!        ╭───╮                  all look towards the door ▲
//!        ╰───╯ leader
//!          ╷╲ gap_m             middles are apart by the gap, and by how far each body reaches towards the other
//!        ╭───╮ follower
//!        ╰───╯
//! ```

use super::load::Loaded;
use crate::world::body::Body;
use crate::world::geometry::Point;

/// How far a person reaches with what is carried, from the middle, m. A torso is an ellipse, a load as square as its box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    is_square: bool,
    front_m: f64,
    pub(super) back_m: f64,
    /// To the farther side.
    pub(super) side_m: f64,
}

impl Reach {
    pub(super) fn of(body: &Body, loaded: Option<&Loaded>) -> Self {
        let with = |own_m: f64, of: fn(&Loaded) -> f64| loaded.map_or(own_m, of).max(own_m);
        Self {
            is_square: loaded.is_some(),
            front_m: with(body.half_depth_m, |loaded| loaded.front_m),
            back_m: with(body.half_depth_m, |loaded| loaded.back_m),
            side_m: with(body.half_width_m, |loaded| loaded.side_m),
        }
    }

    /// How far it reaches towards `way`.
    fn towards_m(self, way: Point) -> f64 {
        let along_m = if way.y > 0.0 { self.front_m } else { self.back_m };
        let (across, along) = (way.x.abs() / self.side_m, way.y.abs() / along_m);
        let share = if self.is_square { across.max(along) } else { across.hypot(along) };
        way.length() / share.max(1e-9)
    }
}

/// How far along the trail of a leader a follower may go that keeps its gap to it, in points of the trail: behind its last point
/// that is far enough from where the leader is. A leader that waits steps to and fro, so what is far back on its trail may be near.
pub(super) fn farthest(trail: &[Point], leader: (Point, Reach), own: Reach, gap_m: f64) -> f64 {
    let (at, reach) = leader;
    let spare_m = |point: &Point| {
        let way = *point - at;
        way.length() - reach.towards_m(way) - own.towards_m(at - *point) - gap_m
    };
    let Some(place) = trail.iter().rposition(|point| spare_m(point) >= 0.0) else { return 0.0 };
    let spare = |place: usize| trail.get(place).map_or(0.0, spare_m);
    place as f64 + (spare(place) / (spare(place) - spare(place + 1)).max(1e-9)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERSON: Reach = Reach { is_square: false, front_m: 0.13, back_m: 0.13, side_m: 0.23 };

    #[test]
    fn a_follower_stops_where_the_gap_is_as_wide_as_it_should_be() {
        let trail: Vec<Point> = (0..21).map(|point| Point::new(0.0, 0.05 * f64::from(point))).collect();
        let place = farthest(&trail, (Point::new(0.0, 1.0), PERSON), PERSON, 0.1);
        assert!((place * 0.05 - 0.64).abs() < 1e-9, "{place}");
        let pushed = Reach { front_m: 1.1, ..PERSON };
        let ahead = farthest(&trail, (Point::new(0.0, 0.0), pushed), PERSON, 0.0);
        assert!(ahead == 0.0, "no person stands in a pushchair: {ahead}");
    }

    #[test]
    fn a_leader_that_comes_back_along_its_trail_keeps_its_room() {
        let there = (0..11).map(|point| Point::new(0.0, 0.1 * f64::from(point)));
        let back = (0..8).map(|point| Point::new(0.1, 1.0 - 0.1 * f64::from(point)));
        let trail: Vec<Point> = there.chain(back).collect();
        let leader = (Point::new(0.1, 0.3), PERSON);
        let place = farthest(&trail, leader, PERSON, 0.0) as usize;
        let off = trail[place] - leader.0;
        assert!(off.length() >= 0.26, "{off:?}");
    }

    #[test]
    fn side_by_side_two_are_farther_apart_than_in_file() {
        let sum_m = |way| 2.0 * PERSON.towards_m(way);
        assert!((sum_m(Point::new(1.0, 0.0)) - 0.46).abs() < 1e-9);
        assert!((sum_m(Point::new(0.0, -0.4)) - 0.26).abs() < 1e-9);
    }
}
