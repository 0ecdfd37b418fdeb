//! Figures 6 and 7 of the paper, case by case.

use kehai_depth::foreground::Point;
use kehai_depth::segment::Segment;

use super::{Ukyo, UkyoSettings};

/// A segment from 1 m up: a box around this place.
fn segment(x: f32, y: f32, half_m: f32) -> Segment {
    let corners = [-1.0, 1.0].into_iter().flat_map(|u| [-1.0, 1.0].map(|v| (u, v)));
    let points = corners.flat_map(|(u, v)| {
        [1.0, 1.7].map(|z| Point { column: 0, place: [x + u * half_m, y + v * half_m, z] })
    });
    Segment::of(&points.collect::<Vec<_>>())
}

fn person(y: f32) -> Segment {
    segment(2.0, y, 0.15)
}

fn tracker() -> Ukyo {
    Ukyo::new(UkyoSettings { has_size: true, has_gain: true }, 0.2, 1.0)
}

/// Identities after a frame, with the segment of each.
fn after(ukyo: &mut Ukyo, segments: &[Segment]) -> Vec<(u64, Option<usize>)> {
    ukyo.observe(segments).iter().map(|track| (track.id, track.segment)).collect()
}

#[test]
fn who_enters_is_new_and_who_is_unseen_for_two_frames_has_left() {
    let mut ukyo = tracker();
    assert_eq!(after(&mut ukyo, &[person(0.0)]), [(1, Some(0))]);
    assert_eq!(after(&mut ukyo, &[person(0.2), person(-2.0)]), [(1, Some(0)), (2, Some(1))]);
    assert_eq!(after(&mut ukyo, &[person(-1.8)]), [(1, None), (2, Some(0))]);
    assert_eq!(after(&mut ukyo, &[person(-1.6)]), [(2, Some(0))]);
}

#[test]
fn two_who_merge_are_carried_along_and_are_the_same_two_afterwards() {
    let mut ukyo = tracker();
    for y in [0.6, 0.5, 0.4, 0.3] {
        after(&mut ukyo, &[person(y), person(-y)]);
    }
    let merged = segment(2.0, 0.0, 0.4);
    assert_eq!(after(&mut ukyo, std::slice::from_ref(&merged)), [(1, None), (2, None), (3, Some(0))]);
    assert_eq!(after(&mut ukyo, &[merged]), [(1, None), (2, None), (3, Some(0))]);
    after(&mut ukyo, &[person(0.3), person(-0.3)]);
    let two = after(&mut ukyo, &[person(0.4), person(-0.4)]);
    assert_eq!(two, [(1, Some(0)), (2, Some(1))], "the derived track has ended");
}

#[test]
fn one_who_splits_is_followed_by_both_parts_and_by_the_box_around_them() {
    let mut ukyo = tracker();
    after(&mut ukyo, &[segment(2.0, 0.0, 0.25)]);
    after(&mut ukyo, &[segment(2.0, 0.0, 0.25)]);
    let parts = [segment(2.0, 0.2, 0.1), segment(2.0, -0.2, 0.1)];
    let split = after(&mut ukyo, &parts);
    assert_eq!(split[0], (1, None));
    assert_eq!(
        split[1..].iter().map(|(id, segment)| (*id, segment.is_some())).collect::<Vec<_>>(),
        [(2, true), (3, true)]
    );
    let carried = ukyo.observe(&parts).into_iter().find(|track| track.id == 1).unwrap();
    assert!(carried.segment.is_none() && carried.at.y.abs() < 0.05, "{carried:?}");
}
