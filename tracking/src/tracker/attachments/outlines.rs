//! Outlines of boxes: what is bounded by straight faces at right angles is a thing.
//!
//! ```text
//!    ·───────·            torso 0.45 × 0.28 m: no two lines at a right angle come nearer to its outline
//!            │  box       than 11 mm on average, whichever way it is turned
//!            ·
//! ```
//!
//! An outline is the contour of one candidate with both its ends: the nearer face of a box may show one point of seven beside the corner,
//! and two with the end. A body shows a straight one now and then, so most of many must be.

use crate::geometry::Point;
use crate::observation::{Detection, View};
use kehai::candidate::{CONTOUR_POINTS, EndKind};

/// An outline this near to two lines at a right angle is straight, m: above the 6 mm that a module's noise leaves of nine suitcases in ten,
/// below the 8.5 mm of which nine outlines of people in coats in ten are farther off. Of people in plain clothes nineteen in twenty are 11 mm off
/// and more, and the median of four recorded people is 14 mm and more.
const STRAIGHT_M: f64 = 0.0075;

/// Share of straight outlines of a thing: about midway between the 0.89 of things, the mean of those below, and the 0.27 of a body that shows most.
const MOSTLY: f64 = 0.57;

/// Outlines that are enough to judge by: a second of one module's, since neighbouring ones are alike as long as a body does not turn.
const OUTLINES: u32 = 10;

/// Narrower outlines are not judged, m: they show one face of a box, and of a body so little that it is straight, too.
const WIDE_M: f64 = 0.3;

/// While a body is slower, its outlines are one and the same, m/s: half a slow walk.
pub const WALKING_MPS: f64 = 0.35;

/// Shares of straight outlines of a thing, and of a body: suitcases, pushchairs and wheelchairs showed 0.95, 0.9 and 0.81 on the mean of
/// 400 passages; of people in coats, nearly boxes with round corners some of them, one in 48 showed 0.27, in plain clothes none 0.05.
const OF_BOX: f64 = 0.8;
const OF_COAT: f64 = 0.27;

/// What the outlines of a body look like.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outlines {
    wide: u32,
    straight: u32,
}

impl Outlines {
    /// So many, of which so many are straight.
    #[cfg(test)]
    pub const fn of(wide: u32, straight: u32) -> Self {
        Self { wide, straight }
    }

    /// Whether enough of them have been seen, and most are straight.
    #[must_use]
    pub fn are_of_thing(self) -> bool {
        self.wide >= OUTLINES && f64::from(self.straight) >= MOSTLY * f64::from(self.wide)
    }

    /// Log odds that they are of a box and not of a body in a wide coat, from even ones: of a body in ordinary clothes they
    /// are far below.
    #[must_use]
    pub fn log_odds(self) -> f64 {
        let round = f64::from(self.wide - self.straight);
        f64::from(self.straight) * libm::log(OF_BOX / OF_COAT)
            + round * libm::log((1.0 - OF_BOX) / (1.0 - OF_COAT))
    }

    /// Takes one more, of a body that walks. One that another body cuts, or that has few points, says nothing.
    pub fn push(&mut self, seen: &Detection, view: &View) {
        let is_cut =
            [seen.candidate.first_end, seen.candidate.last_end].iter().any(|end| end.kind == EndKind::Neck);
        let has_points = seen.candidate.contour.len() >= CONTOUR_POINTS;
        if !is_cut && has_points && seen.width_m > WIDE_M {
            self.wide += 1;
            self.straight += u32::from(off_m(&outline(seen, view)) < STRAIGHT_M);
        }
    }
}

/// A candidate's contour between its ends in the site's frame, m.
fn outline(seen: &Detection, view: &View) -> Vec<Point> {
    let bearing = |step: u16| f64::from(view.geometry.bearing_rad(view.geometry.beam(step)));
    let (first, last) = (bearing(seen.candidate.first_step), bearing(seen.candidate.last_step));
    let knots_m = seen.knots_m();
    let gaps = (knots_m.len() - 1) as f64;
    let at =
        |(knot, range_m): (usize, &f64)| view.place(first + (last - first) * (knot as f64 / gaps), *range_m);
    knots_m.iter().enumerate().map(at).collect()
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

    /// Seven points of an outline at equal distances across, and its ends, seen from afar along x; `near_m` is how near it is there.
    fn seen_across(half_m: f64, near_m: impl Fn(f64) -> f64) -> Vec<Point> {
        (0..=8)
            .map(|point| half_m * (f64::from(point) / 4.0 - 1.0))
            .map(|y| Point::new(near_m(y), y))
            .collect()
    }

    #[test]
    fn straight_outlines_speak_for_a_box_and_round_ones_more_against_it() {
        assert!(Outlines::default().log_odds() == 0.0);
        assert!(Outlines::of(5, 5).log_odds() > libm::log(100.0), "five straight ones");
        assert!(Outlines::of(26, 13).log_odds() < 0.0, "one in two: a coat");
        assert!(Outlines::of(26, 21).log_odds() > libm::log(100.0), "a suitcase");
    }

    fn pushed(seen: &Detection) -> Outlines {
        let mut outlines = Outlines::default();
        outlines.push(seen, &View::at_origin());
        outlines
    }

    #[test]
    fn a_narrow_outline_and_one_of_few_points_say_nothing() {
        let wide = |width_m: f64, points: usize| {
            let mut seen = Detection::chord((1.0, 0.0), (1.0, width_m));
            seen.candidate.contour = vec![0; points].into_iter().collect();
            pushed(&seen).wide
        };
        assert_eq!([wide(0.4, 7), wide(0.25, 7), wide(0.4, 2)], [1, 0, 0]);
    }

    /// ```text
    ///          · first, 0.2 m from the corner: one point of seven lies between them
    ///         ·
    ///   corner ╲
    ///           ╲ 0.36 m
    ///            · last
    /// ```
    #[test]
    fn a_suitcase_whose_nearer_face_shows_one_point_of_seven_is_straight() {
        let (corner, along) = (Point::new(1.4, -0.2), Point::new(0.5, 1.0) * (1.0 / 1.25_f64.sqrt()));
        let away = Point::new(along.y, -along.x);
        let (first, last) = (corner + away * 0.2, corner + along * 0.36);
        let cross = |one: Point, other: Point| one.x * other.y - one.y * other.x;
        let bearing_rad = |point: Point| libm::atan2(point.y, point.x);
        let range_m = |at_rad: f64| {
            let face = if at_rad > bearing_rad(corner) { along } else { away };
            cross(corner, face) / cross(Point::new(libm::cos(at_rad), libm::sin(at_rad)), face)
        };
        let view = View::at_origin();
        let step = |point| view.geometry.step(view.beam_towards(bearing_rad(point)).unwrap());
        let from_rad = |step: u16| f64::from(view.geometry.bearing_rad(view.geometry.beam(step)));
        let mut seen = Detection::chord((first.x, first.y), (last.x, last.y));
        (seen.candidate.first_step, seen.candidate.last_step) = (step(first), step(last));
        let [from, to] = [seen.candidate.first_step, seen.candidate.last_step].map(from_rad);
        let mut knots_mm = (0..=8).map(|knot| 1000.0 * range_m(from + (to - from) * f64::from(knot) / 8.0));
        let near_mm = (1000.0 * corner.length()) as u16;
        seen.candidate.near_mm = near_mm;
        seen.candidate.first_mm = knots_mm.next().unwrap() as u16;
        let offset = |mm: f64| (0.25 * (mm - f64::from(near_mm))).round() as u8;
        seen.candidate.contour = knots_mm.by_ref().take(7).map(offset).collect();
        seen.candidate.last_mm = knots_mm.next().unwrap() as u16;
        assert_eq!(pushed(&seen).straight, 1);
        assert!(off_m(&outline(&seen, &view)[1..8]) > STRAIGHT_M, "without its ends it is not");
    }

    #[test]
    fn a_box_is_straight_at_every_angle_and_a_torso_on_average_at_none() {
        let (mut sum_m, turns) = (0.0, [0.0_f64, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.4, 1.5]);
        for turn in turns {
            let (sine, cosine) = turn.sin_cos();
            // A suitcase, 0.44 × 0.26 m: two faces that meet in its nearest corner.
            let corner_y = 0.22 * cosine - 0.13 * sine;
            let faces = |y: f64| {
                if y <= corner_y { (corner_y - y) * sine / cosine } else { (y - corner_y) * cosine / sine }
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
        assert!(sum_m / turns.len() as f64 > 0.011, "{}", sum_m / turns.len() as f64);
    }
}
