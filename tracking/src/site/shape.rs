//! Whether a polygon is an area: it has corners enough, does not cross itself, and is not a line.
//!
//! ```text
//!   ┌──────┐        ╲    ╱         ────────
//!   │      │         ╲  ╱
//!   │      │          ╳            a line there and back
//!   └──────┘         ╱  ╲
//!    an area        ╱────╲ crosses itself
//! ```

use crate::geometry::{Point, inside, segments_apart_m};

/// Smallest area, m²: a door leaf, the least that moves, is 0.7 m wide and 3 cm thick; a click and a slip of the mouse are less.
const LEAST_M2: f64 = 0.01;

/// How far two polygons may overlap and are still said to touch, m: site files have millimetres.
const DRAWN_IN_M: f64 = 0.001;

/// What is wrong with a polygon, as a sentence without its name; none if it is an area.
pub fn fault(polygon: &[[f64; 2]]) -> Option<String> {
    if polygon.len() < 3 {
        return Some("polygon needs at least three corners".to_owned());
    }
    if polygon.iter().flatten().any(|metres| !metres.is_finite()) {
        // Its places are said to be none.
        return None;
    }
    if let Some((one, other)) = crossing(polygon) {
        return Some(format!(
            "polygon crosses itself: the sides after corners {} and {} meet; move one of them",
            one + 1,
            other + 1
        ));
    }
    let area_m2 = area_m2(polygon);
    (area_m2 < LEAST_M2)
        .then(|| format!("polygon has an area of {area_m2:.3} m²: make it {LEAST_M2} m² or larger"))
}

/// m², whichever way round it is drawn.
fn area_m2(polygon: &[[f64; 2]]) -> f64 {
    let Some(&[left, low]) = polygon.first() else { return 0.0 };
    // From its first corner, so that one far from the origin loses no digits.
    let places = polygon.iter().map(|[x, y]| (x - left, y - low));
    let next = places.clone().cycle().skip(1);
    places.zip(next).map(|((ax, ay), (bx, by))| ax * by - bx * ay).sum::<f64>().abs() / 2.0
}

/// Two sides that cross, by the corners where they begin. Sides that only touch do not.
fn crossing(polygon: &[[f64; 2]]) -> Option<(usize, usize)> {
    let corners: Vec<Point> = polygon.iter().map(|&corner| corner.into()).collect();
    let sides: Vec<(Point, Point)> =
        corners.iter().copied().zip(corners.iter().copied().cycle().skip(1)).collect();
    let meets = |(index, one): (usize, &(Point, Point))| {
        let later = sides.iter().enumerate().skip(index + 1);
        later.filter(|(_, other)| cross(*one, **other)).map(|(other, _)| (index, other)).next()
    };
    sides.iter().enumerate().find_map(meets)
}

/// Whether two polygons have a place in common; those that only touch have none. One of them is drawn in by a millimetre, as site files
/// have them: of the sides of a polygon that is as it is, [`inside`] takes some for inside and some not.
pub fn meet(one: &[[f64; 2]], other: &[[f64; 2]]) -> bool {
    let places = |polygon: &[[f64; 2]]| polygon.iter().map(|&corner| corner.into()).collect::<Vec<Point>>();
    let (one, other) = (places(one), drawn_in(&places(other)));
    let holds = |area: &[Point], of: &[Point]| of.iter().any(|corner| inside(*corner, area));
    let sides = |polygon: &[Point]| {
        polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1)).collect::<Vec<_>>()
    };
    let others = sides(&other);
    holds(&one, &other)
        || holds(&other, &one)
        || sides(&one).into_iter().any(|side| others.iter().any(|other| cross(side, *other)))
}

/// A polygon whose sides are moved inward by [`DRAWN_IN_M`].
fn drawn_in(polygon: &[Point]) -> Vec<Point> {
    let mut corners = polygon.to_vec();
    corners.dedup();
    // Some programs write the first corner once more at the end.
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let next = corners.iter().copied().cycle().skip(1);
    let doubled_m2: f64 = corners.iter().zip(next).map(|(a, b)| a.x * b.y - b.x * a.y).sum();
    let turn = doubled_m2.signum();
    // Of a side, the direction that leads in.
    let inward = |from: Point, to: Point| {
        let side = to - from;
        Point::new(-side.y, side.x) * (turn / side.x.hypot(side.y).max(f64::MIN_POSITIVE))
    };
    let before = corners.iter().copied().cycle().skip(corners.len().saturating_sub(1));
    let after = corners.iter().copied().cycle().skip(1);
    let moved = |((at, before), after): ((Point, Point), Point)| {
        let (a, b) = (inward(before, at), inward(at, after));
        // Both sides move as far; the tip of a spike would move out of it, and moves less.
        at + (a + b) * (DRAWN_IN_M / (1.0 + a.x * b.x + a.y * b.y).max(0.1))
    };
    corners.iter().copied().zip(before).zip(after).map(moved).collect()
}

/// How far a segment is from a polygon, m; 0 if any of it lies in the polygon.
pub fn apart_m((from, to): (Point, Point), polygon: &[[f64; 2]]) -> f64 {
    let corners: Vec<Point> = polygon.iter().map(|&corner| corner.into()).collect();
    if inside(from, &corners) || inside(to, &corners) {
        return 0.0;
    }
    let sides = corners.iter().copied().zip(corners.iter().copied().cycle().skip(1));
    sides.map(|side| segments_apart_m((from, to), side)).fold(f64::INFINITY, f64::min)
}

/// Whether two segments cross, each with an end on either side of the other.
pub fn cross((a, b): (Point, Point), (c, d): (Point, Point)) -> bool {
    let apart = |low: f64, high: f64, from: f64, to: f64| {
        low.max(high) < from.min(to) || from.max(to) < low.min(high)
    };
    if apart(a.x, b.x, c.x, d.x) || apart(a.y, b.y, c.y, d.y) {
        return false;
    }
    let side = |from: Point, to: Point, at: Point| {
        (to.x - from.x) * (at.y - from.y) - (to.y - from.y) * (at.x - from.x)
    };
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_is_one_whichever_way_it_is_drawn_and_wherever_it_is() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut turned = square;
        turned.reverse();
        for polygon in [square, turned, square.map(|[x, y]| [x + 9000.0, y - 9000.0])] {
            assert_eq!(fault(&polygon), None);
            assert!((area_m2(&polygon) - 1.0).abs() < 1e-6);
        }
        // A corner that lies on a side, as of a room around a pillar, is no crossing.
        assert_eq!(fault(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.0], [0.0, 2.0]]), None);
    }

    #[test]
    fn polygons_meet_if_one_holds_a_corner_of_the_other_or_they_cross() {
        let tall = [[1.0, -1.0], [2.0, -1.0], [2.0, 3.0], [1.0, 3.0]];
        let wide = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
        let [small, far] = [0.2, 20.0].map(|x| [[x, 0.2], [x + 0.2, 0.2], [x + 0.2, 0.4]]);
        for (other, is) in [(tall.as_slice(), true), (&small, true), (&far, false)] {
            assert_eq!((meet(&wide, other), meet(other, &wide)), (is, is), "{other:?}");
        }
    }

    #[test]
    fn polygons_that_touch_do_not_meet_on_whichever_side_and_those_that_share_sides_do() {
        let zone = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let beside = |x: f64, y: f64| [[x, y], [x + 4.0, y], [x + 4.0, y + 4.0], [x, y + 4.0]];
        for [x, y] in [[4.0, 0.0], [-4.0, 0.0], [0.0, 4.0], [0.0, -4.0], [4.0, 4.0], [-4.0, 2.0]] {
            let mut turned = beside(x, y);
            turned.reverse();
            for other in [beside(x, y), turned] {
                assert!(!meet(&zone, &other) && !meet(&other, &zone), "{other:?}");
                let closed = [other.as_slice(), &other[..1]].concat();
                assert!(!meet(&zone, &closed) && !meet(&closed, &zone), "{closed:?}");
            }
        }
        for [x, y] in [[0.0, 0.0], [0.0, 2.0], [2.0, 0.0], [3.99, 0.0], [-3.99, -3.99]] {
            let other = beside(x, y);
            assert!(meet(&zone, &other) && meet(&other, &zone), "{other:?}");
        }
        // A corner of a pillar that reaches in, and an area that leaves a way around.
        assert!(meet(&zone, &[[2.0, 1.0], [5.0, -3.0], [-1.0, -3.0]]));
        let around = [[-1.0, -1.0], [5.0, -1.0], [5.0, 5.0], [4.0, 5.0], [4.0, 0.0], [-1.0, 0.0]];
        assert!(!meet(&zone, &around) && !meet(&around, &zone));
    }

    #[test]
    fn a_segment_is_as_far_from_a_polygon_as_its_nearest_place() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        for (from, to, metres) in [
            ([0.5, 1.0], [1.5, 1.0], 0.0),
            ([-1.0, 1.0], [3.0, 1.0], 0.0),
            ([0.5, 2.0], [1.5, 2.0], 0.0),
            ([0.5, 5.0], [1.5, 5.0], 3.0),
            ([3.0, 1.0], [4.0, 1.0], 1.0),
            // A corner is nearest to its middle.
            ([2.0, 4.0], [4.0, 2.0], 2.0_f64.sqrt()),
        ] {
            let apart_m = apart_m((from.into(), to.into()), &square);
            assert!((apart_m - metres).abs() < 1e-12, "{from:?} {to:?}: {apart_m}");
        }
    }

    #[test]
    fn a_bow_tie_and_a_line_are_none() {
        let bow = fault(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]).unwrap();
        assert!(bow.starts_with("polygon crosses itself: the sides after corners 1 and 3 meet"), "{bow}");
        let line = fault(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]).unwrap();
        assert!(line.starts_with("polygon has an area of 0.000 m²"), "{line}");
        assert_eq!(fault(&[[0.0, 0.0], [1.0, 1.0]]).unwrap(), "polygon needs at least three corners");
    }
}
