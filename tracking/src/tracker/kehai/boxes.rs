//! Boxes: what is bounded by straight faces at right angles is a thing; within arm's reach of a person it is theirs.
//!
//! ```text
//!    ·───────·            torso 0.45 × 0.28 m: no two lines at a right angle come nearer to its outline
//!            │  box       than 10 mm on average, whichever way it is turned
//!            ·
//! ```
//!
//! A suitcase in tow and a pushchair are boxes. Outlines are the contour of one candidate; a body shows a straight one
//! now and then, so most of many must be. A thing that has parts of its own is a vehicle with a driver, and no part.

use super::Kehai;
use super::ablation::Idea;
use super::parts::Tie;
use crate::geometry::Point;
use crate::observation::{Detection, View};
use kehai::candidate::EndKind;

/// An outline this near to two lines at a right angle is straight, m: above the 6 mm that a module's noise leaves of a
/// box, below the 10 mm and more of an ellipse as large as a torso.
const STRAIGHT_M: f64 = 0.0085;

/// Share of straight outlines of a thing: midway between the eight in ten or more of a box and the one in three at most
/// of a walking body.
const MOSTLY: f64 = 0.57;

/// Outlines that are enough to judge by: one body in a hundred shows six straight ones of ten if it shows three of ten
/// on average.
const OUTLINES: u32 = 10;

/// Narrower outlines are not judged, m: they show one face of a box, and of a body so little that it is straight, too.
const WIDE_M: f64 = 0.3;

/// While a track is slower, its outlines are one and the same, m/s: half a slow walk.
const WALKING_MPS: f64 = 0.35;

/// An arm and the handle at its end, m: an outline nearer to a person may be that person's.
const REACH_M: f64 = 0.6;

/// How far the place of a thing beside its owner changes at most on the way, m: half of a thing's length, as it swings.
/// A change beyond it begins the way anew: first places are guesses, and a thing in tow swings as its owner turns.
const RIGID_M: f64 = 0.36;

/// How far a thing in tow has gone with its owner when it is judged, m.
const TOWED_M: f64 = 0.7;

/// The same of a thing beside or before its owner, m: at the end of that way a vehicle is seen from its sides, and has
/// shown its wheels.
const PUSHED_M: f64 = 1.8;

/// So far behind its owner, along the way, a thing is in tow, m: half the depth of a body.
const BEHIND_M: f64 = 0.14;

/// After this time an appearance is not judged any more, s: the way from the edge of a module's range to its middle.
const JUDGED_S: f64 = 8.0;

/// A thing has parted from its owner when it is so much farther away than when it was judged, m: two thirds of a stride.
const SLACK_M: f64 = 0.4;

/// What an appearance looks like, and which tracks have been within reach of it.
#[derive(Clone, Debug, Default)]
pub struct Faces {
    wide: u32,
    straight: u32,
    reach: Vec<Reach>,
}

/// Another track within reach.
#[derive(Clone, Debug)]
struct Reach {
    other: u32,
    /// Where the way of both began: they came within reach, or their places beside each other had changed.
    from: Point,
    /// Bounds of the appearance's offset from the other since.
    low: Point,
    high: Point,
}

impl Faces {
    fn is_thing(&self) -> bool {
        self.wide >= OUTLINES && f64::from(self.straight) >= MOSTLY * f64::from(self.wide)
    }

    /// Takes one more outline.
    fn push(&mut self, seen: &Detection, view: &View) {
        let is_cut =
            [seen.candidate.first_end, seen.candidate.last_end].iter().any(|end| end.kind == EndKind::Neck);
        if !is_cut && seen.width_m > WIDE_M {
            self.wide += 1;
            self.straight += u32::from(off_m(&contour(seen, view)) < STRAIGHT_M);
        }
    }

    /// Takes where another track is, `offset` before the appearance, which is at `at`.
    fn accompany(&mut self, other: u32, at: Point, offset: Point, is_near: bool) {
        if let Some(reach) = self.reach.iter_mut().find(|reach| reach.other == other) {
            reach.note(at, offset);
        } else if is_near {
            self.reach.push(Reach { other, from: at, low: offset, high: offset });
        }
    }
}

impl Kehai {
    /// Takes one more candidate of an appearance; ties it to its owner once it is a thing and has gone far enough.
    pub(super) fn face(&mut self, index: usize, seen: &Detection, view: &View) {
        let Some(track) = self.tracks.get_mut(index) else { return };
        let Some(mut faces) = track.faces.take() else { return };
        let (id, at_s) = (track.id, track.last_hit_s);
        let at = track.motion.place(at_s);
        let is_old = at_s - track.first_s > JUDGED_S;
        if track.motion.velocity().length() > WALKING_MPS {
            faces.push(seen, view);
        }
        let near = self.near.now.iter().filter_map(|&index| self.tracks.get(index));
        for other in near.filter(|other| other.id != id && other.near_in == self.scan && !other.is_occluded())
        {
            let place = other.motion.place(at_s);
            let is_near = seen.outline.iter().any(|point| (*point - place).length() < REACH_M);
            faces.accompany(other.id, at, at - place, is_near);
        }
        let owner = if faces.is_thing() && self.ideas.has(Idea::Parts) {
            self.owner_of_thing(index, &faces, at, at_s)
        } else {
            None
        };
        let Some(track) = self.tracks.get_mut(index) else { return };
        if let Some((owner, apart_m)) = owner {
            track.part_of = Some(Tie::at(owner, apart_m + SLACK_M));
        } else if !is_old {
            track.faces = Some(faces);
        }
    }

    /// The nearest person that a thing has accompanied for long enough, and how far away, m.
    fn owner_of_thing(&self, index: usize, faces: &Faces, at: Point, at_s: f64) -> Option<(u32, f64)> {
        let thing = self.tracks.get(index)?;
        let has_parts =
            || self.tracks.iter().any(|other| other.part_of.is_some_and(|tie| tie.owner == thing.id));
        if !thing.confirmed || thing.part_of.is_some() || has_parts() {
            return None;
        }
        let owner = |reach: &Reach| {
            let other = self.tracks.get(self.index_of(reach.other)?)?;
            let way = at - reach.from;
            let offset = at - other.motion.place(at_s);
            let is_towed = offset.dot(way) < -BEHIND_M * way.length();
            let far_enough = way.length() > if is_towed { TOWED_M } else { PUSHED_M };
            let root = other.part_of.map_or(other.id, |tie| tie.owner);
            let is_person = other.confirmed && other.unexplained.is_none() && root != thing.id;
            (is_person && far_enough).then_some((root, offset.length()))
        };
        faces.reach.iter().filter_map(owner).min_by(|one, other| one.1.total_cmp(&other.1))
    }
}

impl Reach {
    /// Takes where the appearance is, and its offset from the other.
    fn note(&mut self, at: Point, offset: Point) {
        self.low = Point::new(self.low.x.min(offset.x), self.low.y.min(offset.y));
        self.high = Point::new(self.high.x.max(offset.x), self.high.y.max(offset.y));
        let size = self.high - self.low;
        if size.x.max(size.y) >= RIGID_M {
            *self = Self { other: self.other, from: at, low: offset, high: offset };
        }
    }
}

/// A candidate's contour in the site's frame, m.
fn contour(seen: &Detection, view: &View) -> Vec<Point> {
    let geometry = &view.geometry;
    let bearing = |step: u16| f64::from(geometry.bearing_rad(geometry.beam(step)));
    let (first, last) = (bearing(seen.candidate.first_step), bearing(seen.candidate.last_step));
    let points = seen.candidate.contour.len();
    let share = |point: usize| (point + 1) as f64 / (points + 1) as f64;
    let range_m = |point| f64::from(seen.candidate.contour_mm(point).unwrap_or(0)) * 0.001;
    (0..points).map(|point| view.place(first + (last - first) * share(point), range_m(point))).collect()
}

/// How far points are on average, as a root of squares, from the two lines at a right angle that fit them best, m.
fn off_m(points: &[Point]) -> f64 {
    let least = (2..=points.len()).filter(|&corner| points.len() - corner != 1).map(|corner| {
        let (one, other) = points.split_at(corner);
        let ([xx, yy, xy], [aa, bb, ab]) = (scatter(one), scatter(other));
        // The second line's normal is the first line's direction.
        let (xx, yy, xy) = (xx + bb, yy + aa, xy - ab);
        0.5 * (xx + yy) - libm::hypot(0.5 * (xx - yy), xy)
    });
    let least = least.fold(f64::INFINITY, f64::min);
    (least.max(0.0) / points.len().max(1) as f64).sqrt()
}

/// Sums of squares of points about their middle: xx, yy, xy, m².
fn scatter(points: &[Point]) -> [f64; 3] {
    let sum = points.iter().fold(Point::default(), |sum, point| sum + *point);
    let middle = sum * (1.0 / points.len().max(1) as f64);
    points
        .iter()
        .map(|point| *point - middle)
        .fold([0.0; 3], |[xx, yy, xy], way| [xx + way.x * way.x, yy + way.y * way.y, xy + way.x * way.y])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seven points of an outline at equal distances across, seen from afar along x; `near_m` is how near it is there.
    fn seen_across(half_m: f64, near_m: impl Fn(f64) -> f64) -> Vec<Point> {
        (1..8)
            .map(|point| half_m * (f64::from(point) / 4.0 - 1.0))
            .map(|y| Point::new(near_m(y), y))
            .collect()
    }

    #[test]
    fn a_box_is_straight_at_every_angle_and_a_torso_on_average_at_none() {
        let (mut sum_m, turns) = (0.0, [0.0_f64, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4]);
        for turn in turns {
            let (sine, cosine) = turn.sin_cos();
            // A suitcase, 0.44 × 0.26 m: two faces that meet in its nearest corner.
            let corner_y = 0.22 * cosine - 0.13 * sine;
            let faces = |y: f64| {
                if y < corner_y { (corner_y - y) * sine / cosine } else { (y - corner_y) * cosine / sine }
            };
            let case = seen_across(0.22 * cosine + 0.13 * sine, faces);
            assert!(off_m(&case) < STRAIGHT_M, "{turn}: {}", off_m(&case));
            // A torso, 0.45 × 0.28 m.
            let square = |x: f64, y: f64| x * x * cosine * cosine + y * y * sine * sine;
            let (xx, yy) = (square(0.14, 0.225), square(0.225, 0.14));
            let xy = (0.225 * 0.225 - 0.14 * 0.14) * sine * cosine;
            let round = |y: f64| -xy / yy * y - ((xx - xy * xy / yy) * (1.0 - y * y / yy)).sqrt();
            sum_m += off_m(&seen_across(yy.sqrt(), round));
        }
        assert!(sum_m / turns.len() as f64 > 0.010, "{}", sum_m / turns.len() as f64);
    }
}
