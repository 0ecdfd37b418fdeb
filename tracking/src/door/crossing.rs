//! Line crossing: the line of a door, and which tracks have crossed it in which direction.
//!
//! ```text
//!            inside                     inward crossing: before ─▶ beyond
//!   ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─  + 0.10 m     outward: beyond ─▶ before
//!   ════╡  door line  ╞════             between the two dashed lines a track keeps its side:
//!   ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─  − 0.10 m     noise is no crossing
//!             zone
//! ```
//!
//! Before the line is the side that the zone lies beside; in the edge of a zone with a niche that need not be the side of its middle.

use std::collections::BTreeMap;

use super::event::{Body, Presence};
use crate::doorway::{BESIDE_M, DOORWAY_M};
use crate::geometry::{Point, centroid, distance_to_segment, inside};
use crate::site::door::OFF_ZONE_M;

/// A track so far beyond the line has crossed it, m: twice the noise of a walker's position.
pub const CROSSED_M: f64 = 0.10;

/// A person faster than this walks, m/s; a person who comes from inside walks the other way.
const WALKING_M_S: f64 = 0.2;

/// From the middle of the line its zone is looked for in such steps, m, and one more than to the farthest that a line may be from it.
const STEP_M: f64 = 0.1;
const STEPS: u32 = (OFF_ZONE_M / STEP_M) as u32 + 1;

/// What a track did at the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Crossing {
    /// Went in.
    Inward(u64),
    /// Came out.
    Outward(u64),
    /// Went in, but perhaps is no person: a person who touches the one before is such a doubtful track.
    Shade(u64),
    /// Was part of a track, and has parted from it beyond the doorway.
    Parted {
        /// Its number.
        id: u64,
        /// The track it was part of.
        owner: u64,
    },
    /// Was lost in the doorway before the line.
    Lost(u64),
    /// Was found in the doorway beyond the line, walking in; how it came there is unknown.
    Found(u64),
}

/// A doubtful track must have been there for so long, s, have come so far, m, and be so far from every certain track,
/// m: else it is an arm, or a bag.
const SHADE_S: f64 = 0.3;
const SHADE_WAY_M: f64 = 0.25;
const SHADE_APART_M: f64 = 0.22;

/// In the zone a shade must have been there longer, s, and have come farther, m: there are more arms and bags there.
const WALKING_SHADE_S: f64 = 0.6;
const WALKING_SHADE_M: f64 = 0.3;

#[derive(Clone, Copy, Debug)]
struct Known {
    first_at: Point,
    first_s: f64,
    presence: Presence,
    is_beyond: bool,
    in_doorway: bool,
    in_zone: bool,
}

impl Known {
    const fn is_sure(&self) -> bool {
        matches!(self.presence, Presence::Person | Presence::Unexplained)
    }
}

/// The line, the zone before it, and which track is on which side.
#[derive(Clone, Debug)]
pub struct Doorway {
    middle: Point,
    along: Point,
    half_m: f64,
    inward: Point,
    zone: Vec<Point>,
    /// From the line to the zone, m; 0 where the line is in the zone or its edge.
    gap_m: f64,
    known: BTreeMap<u64, Known>,
}

impl Doorway {
    /// The line between `ends`, and the zone before it. The far side of the zone is inside.
    #[must_use]
    pub fn new(ends: (Point, Point), zone: Vec<Point>) -> Self {
        let side = ends.1 - ends.0;
        let length_m = side.length().max(1e-6);
        let along = side * (1.0 / length_m);
        let middle = (ends.0 + ends.1) * 0.5;
        let left = along.left();
        let outward = outward(middle, left, &zone);
        let gap_m = gap_m(middle, outward, &zone);
        let (half_m, inward) = (0.5 * length_m, outward * -1.0);
        Self { middle, along, half_m, inward, zone, gap_m, known: BTreeMap::new() }
    }

    /// The middle of the line.
    #[must_use]
    pub const fn middle(&self) -> Point {
        self.middle
    }

    /// How far beyond the line a place is, m.
    #[must_use]
    pub fn beyond_m(&self, at: Point) -> f64 {
        (at - self.middle).dot(self.inward)
    }

    /// How fast a person walks towards the inside, m/s.
    #[must_use]
    pub fn inward_m_s(&self, velocity: Point) -> f64 {
        velocity.dot(self.inward)
    }

    /// How far past the ends of the line a place is, along it, m; negative between them.
    fn aside_m(&self, at: Point) -> f64 {
        (at - self.middle).dot(self.along).abs() - self.half_m
    }

    /// Whether a place is in the zone before the line, or between both.
    #[must_use]
    pub fn in_zone(&self, at: Point) -> bool {
        self.beyond_m(at) <= 0.0 && (inside(at, &self.zone) || self.in_gap(at))
    }

    /// Whether a place is in the zone, and beyond the line: a person there is counted, and cannot go in.
    #[must_use]
    pub fn in_zone_inside(&self, at: Point) -> bool {
        self.beyond_m(at) > CROSSED_M && inside(at, &self.zone)
    }

    /// Whether a place is on the way from a zone to a line that is off it, as in the thickness of a wall.
    fn in_gap(&self, at: Point) -> bool {
        (-self.gap_m..0.0).contains(&self.beyond_m(at)) && self.aside_m(at) < BESIDE_M
    }

    /// Whether a place is in the zone, less than `margin_m` from it, or on the way from it to the line.
    #[must_use]
    pub fn is_near_zone(&self, at: Point, margin_m: f64) -> bool {
        let sides = self.zone.iter().zip(self.zone.iter().cycle().skip(1));
        inside(at, &self.zone)
            || self.in_gap(at)
            || sides.into_iter().any(|(&from, &to)| distance_to_segment(at, from, to) < margin_m)
    }

    /// How many doubtful tracks walk in the zone: apart from every certain track, and on their way for a while.
    #[must_use]
    pub fn shades(&self, bodies: &[Body], now_s: f64) -> usize {
        let walks = |body: &&Body| {
            self.known.get(&body.id).is_some_and(|known| {
                let way_m = (body.at - known.first_at).length();
                now_s - known.first_s >= WALKING_SHADE_S && way_m >= WALKING_SHADE_M
            })
        };
        let unsure = bodies.iter().filter(|body| body.is_doubtful() && self.in_zone(body.at));
        unsure.filter(walks).filter(|body| is_apart(body, bodies)).count()
    }

    /// Notes where all tracks are; returns what they did at the line since the last time.
    pub fn observe(&mut self, bodies: &[Body], now_s: f64) -> Vec<Crossing> {
        let mut crossings = Vec::new();
        let mut now = BTreeMap::new();
        for body in bodies {
            let beyond_m = self.beyond_m(body.at);
            let aside_m = self.aside_m(body.at);
            let before = self.known.get(&body.id);
            let was_beyond = before.map(|known| known.is_beyond);
            let is_beyond = match was_beyond {
                _ if beyond_m > CROSSED_M => true,
                _ if beyond_m < -CROSSED_M => false,
                Some(was) => was,
                None => beyond_m > 0.0,
            };
            let in_doorway = aside_m < BESIDE_M && beyond_m.abs() < DOORWAY_M;
            let (first_at, first_s) =
                before.map_or((body.at, now_s), |known| (known.first_at, known.first_s));
            // What was a part of a track that is still there, and is a person now, went in beside it unnoticed.
            let parted_from = before.and_then(|known| match known.presence {
                Presence::PartOf(owner) => bodies.iter().map(|other| other.id).find(|id| *id == owner),
                _ => None,
            });
            if matches!(body.presence, Presence::PartOf(_)) {
                // The track it belongs to crosses for both.
            } else if let Some(owner) = parted_from.filter(|_| is_beyond && body.is_sure()) {
                let id = body.id;
                // Farther in it may be what a person left who was inside all the time.
                crossings.push(if in_doorway {
                    Crossing::Inward(id)
                } else {
                    Crossing::Parted { id, owner }
                });
            } else if aside_m < BESIDE_M && body.is_doubtful() {
                let alone = is_apart(body, bodies);
                let has_come = now_s - first_s >= SHADE_S && (body.at - first_at).length() >= SHADE_WAY_M;
                if was_beyond == Some(false) && is_beyond && alone && has_come {
                    crossings.push(Crossing::Shade(body.id));
                }
            } else if aside_m < BESIDE_M {
                match (was_beyond, is_beyond) {
                    (Some(false), true) => crossings.push(Crossing::Inward(body.id)),
                    (Some(true), false) => crossings.push(Crossing::Outward(body.id)),
                    (None, true) if in_doorway && body.velocity.dot(self.inward) > WALKING_M_S => {
                        crossings.push(Crossing::Found(body.id))
                    }
                    _ => {}
                }
            }
            let in_zone = self.in_zone(body.at);
            let presence = body.presence;
            now.insert(body.id, Known { first_at, first_s, presence, is_beyond, in_doorway, in_zone });
        }
        let gone = self.known.iter().filter(|(id, _)| !now.contains_key(id));
        let lost = gone
            .filter(|(_, known)| known.is_sure() && known.in_doorway && known.in_zone && !known.is_beyond);
        crossings.extend(lost.map(|(&id, _)| Crossing::Lost(id)));
        self.known = now;
        crossings
    }
}

/// Of the two sides of a line that to which its zone is nearest. Where neither is beside the line, that of the zone's middle, which
/// in a corner may be the wrong one.
fn outward(middle: Point, left: Point, zone: &[Point]) -> Point {
    let far_m = (1..=STEPS).map(|step| f64::from(step) * STEP_M);
    let sides = far_m.map(|far_m| [1.0, -1.0].map(|side| inside(middle + left * (side * far_m), zone)));
    let is_left = sides.into_iter().find(|[left, right]| left != right).map(|[left, _]| left);
    if is_left.unwrap_or_else(|| left.dot(centroid(zone) - middle) > 0.0) { left } else { left * -1.0 }
}

/// How far the zone begins from the middle of the line, m; 0 if at the first step.
fn gap_m(middle: Point, outward: Point, zone: &[Point]) -> f64 {
    let far_m = (1..=STEPS).map(|step| f64::from(step) * STEP_M);
    let mut far_m = far_m.skip_while(|far_m| !inside(middle + outward * *far_m, zone));
    far_m.next().filter(|far_m| *far_m > STEP_M).unwrap_or(0.0)
}

/// Whether a doubtful track is apart from all that are certain: persons, and what they have along.
#[must_use]
pub fn is_apart(body: &Body, bodies: &[Body]) -> bool {
    let mut certain = bodies.iter().filter(|other| !other.is_doubtful());
    certain.all(|other| (other.at - body.at).length() >= SHADE_APART_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doorway() -> Doorway {
        let zone = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Point::from).to_vec();
        Doorway::new((Point::new(0.45, 1.0), Point::new(-0.45, 1.0)), zone)
    }

    fn at(id: u64, x: f64, y: f64) -> Body {
        Body {
            id,
            at: Point::new(x, y),
            velocity: Point::new(0.0, 1.0),
            is_seen: true,
            presence: Presence::Person,
        }
    }

    #[test]
    fn the_far_side_of_the_zone_is_inside() {
        let doorway = doorway();
        assert!(doorway.beyond_m(Point::new(0.0, 1.3)) > 0.29 && doorway.beyond_m(Point::default()) < -0.9);
        assert!(doorway.in_zone(Point::default()) && !doorway.in_zone(Point::new(0.0, 1.1)));
        assert!([0.9, 1.1].iter().all(|y| !doorway.in_zone_inside(Point::new(0.0, *y))));
    }

    #[test]
    fn in_the_corner_of_a_zone_the_zone_beside_the_line_is_before_it() {
        let polygon = [[0.0, 0.0], [6.0, 0.0], [6.0, 1.5], [1.5, 1.5], [1.5, 6.0], [0.0, 6.0]];
        let corner = |line: [[f64; 2]; 2]| {
            Doorway::new((line[0].into(), line[1].into()), polygon.map(Point::from).to_vec())
        };
        for line in [[[1.5, 4.0], [1.5, 4.9]], [[1.5, 4.9], [1.5, 4.0]], [[2.3, 4.0], [2.3, 4.9]]] {
            let doorway = corner(line);
            assert!(doorway.beyond_m(Point::new(3.2, 4.5)) > 0.0, "{line:?}");
            assert!(doorway.beyond_m(Point::new(1.0, 4.5)) < 0.0, "{line:?}");
        }
        // Past the end of the zone: its middle decides.
        assert!(corner([[-0.9, 6.0], [-0.1, 6.0]]).beyond_m(Point::new(-0.5, 6.5)) > 0.0);
    }

    #[test]
    fn between_a_zone_and_a_line_off_it_a_place_is_in_the_zone() {
        let zone =
            |high: f64| [[-1.0, -1.0], [1.0, -1.0], [1.0, high], [-1.0, high]].map(Point::from).to_vec();
        let off = |high: f64| Doorway::new((Point::new(-0.45, 1.0), Point::new(0.45, 1.0)), zone(high));
        let (near, far, beside) = (Point::new(0.6, 0.9), Point::new(0.0, 0.45), Point::new(0.8, 0.8));
        let doorway = off(0.4);
        assert!(doorway.in_zone(near) && doorway.in_zone(far) && !doorway.in_zone(beside));
        assert!(doorway.is_near_zone(near, 0.15) && !doorway.is_near_zone(beside, 0.15));
        assert!(!doorway.in_zone(Point::new(0.0, 1.05)), "beyond");
        // Before a line in its edge it ends with itself, and so does a shallow one on its far side.
        assert!(!off(1.0).in_zone(Point::new(1.1, 0.9)) && !doorway.in_zone(Point::new(0.0, -1.05)));
    }

    #[test]
    fn a_person_crosses_once_each_way_and_noise_never() {
        let mut doorway = doorway();
        let mut crossed = |y: f64| doorway.observe(&[at(1, 0.0, y)], 0.0);
        assert_eq!(crossed(0.5), []);
        assert_eq!(crossed(1.05), [], "not far enough yet");
        assert_eq!(crossed(1.12), [Crossing::Inward(1)]);
        assert_eq!(crossed(0.95), [], "noise");
        assert_eq!(crossed(1.3), []);
        assert_eq!(crossed(0.8), [Crossing::Outward(1)]);
    }

    #[test]
    fn a_shade_crosses_when_it_walks_and_is_apart() {
        let cross = |x: f64| {
            let mut doorway = doorway();
            let mut all = Vec::new();
            for step in 0..8 {
                let y = 0.5 + 0.1 * f64::from(step);
                let shade = Body { presence: Presence::Doubtful, is_seen: false, ..at(2, x, y) };
                all.extend(doorway.observe(&[at(1, 0.0, y + 0.1), shade], 0.1 * f64::from(step)));
            }
            all
        };
        assert_eq!(cross(0.3), [Crossing::Inward(1), Crossing::Shade(2)]);
        assert_eq!(cross(0.1), [Crossing::Inward(1)], "an arm");
    }

    #[test]
    fn a_part_crosses_with_its_owner_and_alone_once_it_has_parted() {
        let mut doorway = doorway();
        let part = |y: f64| Body { presence: Presence::PartOf(1), is_seen: false, ..at(2, 0.0, y) };
        doorway.observe(&[at(1, 0.0, 0.5), part(0.2)], 0.0);
        assert_eq!(doorway.observe(&[at(1, 0.0, 1.3), part(1.2)], 0.5), [Crossing::Inward(1)]);
        assert_eq!(doorway.observe(&[at(1, 0.0, 2.5), at(2, 0.0, 1.3)], 1.0), [Crossing::Inward(2)]);
        // Away from the doorway it is told with its owner: a person inside may have put it down.
        for [x, y] in [[0.0, 2.2], [6.0, 1.2]] {
            doorway.observe(&[at(1, x, y), part(y)], 2.0);
            let parted = Crossing::Parted { id: 2, owner: 1 };
            assert_eq!(doorway.observe(&[at(1, x, y), at(2, x, y)], 2.5), [parted], "{x} {y}");
        }
    }

    #[test]
    fn who_is_lost_or_found_in_the_doorway_is_told() {
        let mut doorway = doorway();
        doorway.observe(&[at(1, 0.0, 0.7), at(2, 0.0, -0.8)], 0.0);
        assert_eq!(doorway.observe(&[at(3, 0.0, 1.4)], 0.0), [Crossing::Found(3), Crossing::Lost(1)]);
        assert_eq!(doorway.observe(&[at(4, 1.4, 1.4)], 0.0), [], "beside the door no track comes through");
    }
}
