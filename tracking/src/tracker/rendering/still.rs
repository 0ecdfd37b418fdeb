//! A person who stands still has a track that is still, and a track states how well its place is known.

use super::tests::Bench;
use super::{PLACED_M, SHAPE_M};
use crate::geometry::Point;

/// A body that stands 2 m before the module: tracks some scans after it came, read 0.2 s after each scan.
fn standing() -> Vec<(Point, [f64; 3])> {
    let mut bench = Bench::new();
    let mut places = Vec::new();
    for scan in 0..100 {
        bench.shows(&[(2.0, 0.0)]);
        if scan >= 40 {
            let read = bench.peek_after(0.2);
            assert_eq!(read.len(), 1, "scan {scan}");
            places.extend(read.iter().map(|track| (track.at, track.covariance_m2)));
        }
    }
    places
}

#[test]
fn who_stands_does_not_jitter() {
    let places = standing();
    let count = places.len() as f64;
    let mean = places.iter().fold(Point::default(), |sum, (at, _)| sum + *at) * (1.0 / count);
    let square_m2: f64 = places.iter().map(|(at, _)| (*at - mean).dot(*at - mean)).sum();
    let jitter_m = (square_m2 / count).sqrt();
    // With the noise of turning back for all samples it is 3.2 cm, with that of a walk 1.9.
    assert!(jitter_m < 0.025, "{jitter_m}");
}

#[test]
fn a_covariance_holds_the_error_of_the_shape_and_no_more_than_a_place_that_is_known() {
    for (at, [xx, xy, yy]) in standing() {
        assert!(xx > SHAPE_M * SHAPE_M && yy > SHAPE_M * SHAPE_M && xx * yy > xy * xy, "{xx} {xy} {yy}");
        assert!(xx + yy < PLACED_M * PLACED_M, "{xx} {yy}");
        assert!((at - Point::new(2.0, 0.0)).length() < 0.25, "{at:?}");
    }
}
