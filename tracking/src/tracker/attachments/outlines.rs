//! Outlines of boxes: what is bounded by straight faces at right angles is a thing.
//!
//! ```text
//!    ·───────·            torso 0.45 × 0.28 m: no two lines at a right angle come nearer to its outline
//!            │  box       than 10 mm on average, whichever way it is turned
//!            ·
//! ```
//!
//! Outlines are the contour of one candidate; a body shows a straight one now and then, so most of many must be.

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

/// While a body is slower, its outlines are one and the same, m/s: half a slow walk.
pub const WALKING_MPS: f64 = 0.35;

/// Shares of straight outlines of a box, and of a body that shows many: suitcases, pushchairs, wheels and the back of a chair
/// showed 0.82 to 1 on 28 walks, a person in a wide coat six in ten while a third is usual.
const OF_BOX: f64 = 0.85;
const OF_COAT: f64 = 0.45;

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

    /// Takes one more, of a body that walks.
    pub fn push(&mut self, seen: &Detection, view: &View) {
        let is_cut =
            [seen.candidate.first_end, seen.candidate.last_end].iter().any(|end| end.kind == EndKind::Neck);
        if !is_cut && seen.width_m > WIDE_M {
            self.wide += 1;
            self.straight += u32::from(off_m(&contour(seen, view)) < STRAIGHT_M);
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
    fn straight_outlines_speak_for_a_box_and_round_ones_more_against_it() {
        assert!(Outlines::default().log_odds() == 0.0);
        assert!(Outlines::of(8, 8).log_odds() > libm::log(100.0), "eight straight ones");
        assert!(Outlines::of(26, 17).log_odds() < 0.0, "two in three: a coat");
        assert!(Outlines::of(26, 21).log_odds() > libm::log(100.0), "a suitcase");
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
