//! Track birth as in Noguchi et al. 2009: segments of points, and circles fitted through them.
//!
//! ```text
//!     · · ·                      points nearer to each other than a link, of whatever module, are a segment
//!    ·     ·     · ·             least squares: the circle x² + y² = 2ax + 2by + c,
//!     ╲ ○ ╱      a leaf             centre (a, b), radius √(c + a² + b²)
//! ```
//!
//! The paper says "least-squares circle" and no more; this is the linear one (Kåsa's), which needs no start and
//! cannot diverge. On short arcs it takes the radius too small, which still is in the range of a body's.

use nalgebra::{Matrix3, Vector3};

use kehai_tracking::geometry::Point;

/// A circle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Circle {
    /// Its centre.
    pub centre: Point,
    /// Its radius, m.
    pub radius_m: f64,
}

/// For each place the number of its segment, from 0: places joined by links up to `link_m` belong together.
#[must_use]
pub fn segments(places: &[Point], link_m: f64) -> Vec<usize> {
    let mut segment: Vec<Option<usize>> = vec![None; places.len()];
    let mut count = 0;
    for start in 0..places.len() {
        if segment[start].is_some() {
            continue;
        }
        segment[start] = Some(count);
        let mut edge = vec![start];
        while let Some(from) = edge.pop() {
            for to in 0..places.len() {
                if segment[to].is_none() && (places[to] - places[from]).length() <= link_m {
                    segment[to] = Some(count);
                    edge.push(to);
                }
            }
        }
        count += 1;
    }
    segment.into_iter().flatten().collect()
}

/// The least-squares circle through places; None if it does not exist, as for places on a line.
#[must_use]
pub fn fit(places: &[Point]) -> Option<Circle> {
    if places.len() < 3 {
        return None;
    }
    let middle =
        places.iter().fold(Point::default(), |sum, &place| sum + place) * (1.0 / places.len() as f64);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for &place in places {
        let off = place - middle;
        let row = Vector3::new(2.0 * off.x, 2.0 * off.y, 1.0);
        normal += row * row.transpose();
        right += row * off.dot(off);
    }
    let solved = normal.try_inverse()? * right;
    let centre = Point::new(solved.x, solved.y);
    let radius_m = (solved.z + centre.dot(centre)).sqrt();
    radius_m.is_finite().then_some(Circle { centre: middle + centre, radius_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(from_deg: i32, to_deg: i32) -> Vec<Point> {
        let place =
            |angle_deg: i32| Point::new(2.0, -1.0) + Point::towards(f64::from(angle_deg).to_radians()) * 0.2;
        (from_deg..=to_deg).step_by(10).map(place).collect()
    }

    #[test]
    fn a_circle_is_found_from_any_arc_of_it() {
        for (from_deg, to_deg) in [(0, 350), (0, 180), (30, 90)] {
            let circle = fit(&arc(from_deg, to_deg)).unwrap();
            assert!((circle.centre - Point::new(2.0, -1.0)).length() < 1e-6, "{circle:?}");
            assert!((circle.radius_m - 0.2).abs() < 1e-6, "{circle:?}");
        }
    }

    #[test]
    fn a_straight_edge_has_no_circle_of_a_bodys_size() {
        let edge: Vec<Point> = (0..8).map(|step| Point::new(0.05 * f64::from(step), 1.0)).collect();
        assert!(fit(&edge).is_none_or(|circle| circle.radius_m > 10.0));
        assert_eq!(fit(&edge[..2]), None);
    }

    #[test]
    fn places_are_joined_over_others_but_not_over_a_gap() {
        let places = [0.0, 1.0, 0.3, 0.15, 1.1].map(|x| Point::new(x, 0.0));
        assert_eq!(segments(&places, 0.2), [0, 1, 0, 0, 1]);
    }
}
