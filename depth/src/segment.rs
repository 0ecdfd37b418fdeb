//! A cluster as a body: where, how large, how high.
//!
//! ```text
//!    from above        from the side
//!     ╭●●●╮            ┌───┐ top         volume = area of the outline × (top − lowest point): of the part that is
//!     ● + ●            │   │             seen, which is its front; it shrinks when another body hides some of it
//!     ╰●──╯ outline    └───┘ lowest
//! ```

use serde::Serialize;

use crate::camera::Camera;
use crate::cluster::{Density, clusters};
use crate::foreground::Point;

/// A body as far as it is seen.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Segment {
    /// Mean of its points, x forward and y left of the camera, m.
    pub centre_m: [f32; 2],
    /// Volume, litres.
    pub volume_l: f32,
    /// Its highest point above the floor, cm.
    pub top_cm: f32,
    /// Points it is made of.
    pub points: usize,
    /// Convex outline from above, counter-clockwise, m.
    pub outline_m: Vec<[f32; 2]>,
}

/// The bodies among the points above the camera's plane, the one of most points first.
#[must_use]
pub fn segments(points: &[Point], camera: &Camera, density: &Density) -> Vec<Segment> {
    let plane_m = camera.plane_m();
    let upper: Vec<Point> = points.iter().copied().filter(|point| point.place[2] >= plane_m).collect();
    clusters(&upper, density)
        .iter()
        .map(|cluster| {
            Segment::of(&cluster.iter().filter_map(|&index| upper.get(index).copied()).collect::<Vec<_>>())
        })
        .collect()
}

impl Segment {
    /// The body of these points.
    #[must_use]
    pub fn of(points: &[Point]) -> Self {
        let count = points.len().max(1) as f32;
        let mean = |axis: usize| points.iter().map(|point| point.place[axis]).sum::<f32>() / count;
        let heights = || points.iter().map(|point| point.place[2]);
        let (lowest_m, top_m) = (heights().fold(f32::MAX, f32::min), heights().fold(0.0, f32::max));
        let outline_m = hull(points.iter().map(|point| [point.place[0], point.place[1]]).collect());
        Self {
            centre_m: [mean(0), mean(1)],
            volume_l: area_m2(&outline_m) * (top_m - lowest_m).max(0.0) * 1000.0,
            top_cm: top_m * 100.0,
            points: points.len(),
            outline_m,
        }
    }
}

/// Convex hull, counter-clockwise (Andrew's monotone chain, 1979).
fn hull(mut points: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    points.sort_by(|one, two| one[0].total_cmp(&two[0]).then(one[1].total_cmp(&two[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let mut chain: Vec<[f32; 2]> = Vec::new();
        for point in points {
            while let [.., one, two] = chain[..]
                && turn(one, two, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut outline = half(&mut points.iter().copied());
    outline.extend(half(&mut points.iter().rev().copied()));
    outline
}

/// Positive when `one` → `two` → `three` turns left.
fn turn(one: [f32; 2], two: [f32; 2], three: [f32; 2]) -> f32 {
    (two[0] - one[0]) * (three[1] - one[1]) - (two[1] - one[1]) * (three[0] - one[0])
}

fn area_m2(outline: &[[f32; 2]]) -> f32 {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(one, two)| one[0] * two[1] - one[1] * two[0]).sum::<f32>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::SMALL;

    /// The surface of a box 0.2 × 0.4 m from the floor up to `top_m`, every 2 cm.
    fn body(x_m: f32, y_m: f32, top_m: f32) -> Vec<Point> {
        let mut points = Vec::new();
        for level in 0..=(top_m / 0.02).round() as usize {
            for (x, y) in (0..=10).flat_map(|x| (0..=20).map(move |y| (x, y))) {
                let place = [x_m + x as f32 * 0.02, y_m + y as f32 * 0.02, level as f32 * 0.02];
                points.push(Point { column: y, place });
            }
        }
        points
    }

    #[test]
    fn a_body_has_the_place_volume_and_top_of_what_is_above_the_plane() {
        let found = segments(&body(2.0, -0.2, 1.7), &SMALL, &Density::USUAL);
        let [segment] = &found[..] else { panic!("{found:?}") };
        assert!((segment.centre_m[0] - 2.1).abs() < 1e-3 && segment.centre_m[1].abs() < 1e-3);
        // 0.2 × 0.4 m, from 1 m to 1.7 m.
        assert!((segment.volume_l - 56.0).abs() < 0.1, "{}", segment.volume_l);
        assert!((segment.top_cm - 170.0).abs() < 0.01);
        assert_eq!(segment.outline_m.len(), 4);
    }

    #[test]
    fn a_child_below_the_plane_is_seen_when_the_plane_is_set_lower() {
        let points = body(2.0, 0.0, 0.95);
        assert_eq!(segments(&points, &SMALL, &Density::USUAL).len(), 0);
        let low = Camera { above_m: Some(0.6), ..SMALL };
        assert_eq!(segments(&points, &low, &Density::USUAL).len(), 1);
    }

    #[test]
    fn points_on_a_line_have_no_volume() {
        assert_eq!(hull(vec![[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]]).len(), 2);
        assert_eq!(area_m2(&hull(vec![[0.0, 0.0], [1.0, 1.0]])), 0.0);
        assert_eq!(area_m2(&[]), 0.0);
    }
}
