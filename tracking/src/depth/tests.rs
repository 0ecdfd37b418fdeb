//! Short walks before a camera, from segments made by hand.

use super::{Bodies, Followed, Ideas, Seen, Sight, Where};
use crate::geometry::Point;

const IDEAS: Ideas = Ideas { has_size: true, has_gain: true };
const SIGHT: Sight = Sight { aside: 0.57, lens_m: 1.0, up: 0.42 };

/// A segment half as deep as wide.
fn segment(x: f64, y: f64, half_width_m: f64, top_m: f64, volume_l: f64) -> Seen {
    let corner = |u: f64, v: f64| Point::new(x + 0.5 * u * half_width_m, y + v * half_width_m);
    let outline = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Seen { at: Point::new(x, y), outline, top_m, volume_l }
}

fn adult(x: f64, y: f64, top_m: f64) -> Seen {
    segment(x, y, 0.2, top_m, 50.0)
}

/// The tracks after each of these frames, 0.2 s apart.
fn follow(ideas: Ideas, frames: &[Vec<Seen>]) -> Vec<Vec<Followed>> {
    let mut bodies = Bodies::new(ideas, SIGHT);
    let one = |(number, seen): (usize, &Vec<Seen>)| {
        bodies.observe(seen, number as f64 * 0.2);
        bodies.followed()
    };
    frames.iter().enumerate().map(one).collect()
}

fn ids(tracks: &[Followed]) -> Vec<u64> {
    tracks.iter().map(|track| track.id).collect()
}

#[test]
fn who_is_hidden_behind_another_keeps_the_identity() {
    // One crosses at 3 m behind one who stands at 2 m, and is not seen for four frames.
    let frames: Vec<Vec<Seen>> = (0..14)
        .map(|number| {
            let y = -1.3 + 0.2 * f64::from(number);
            let behind = (y.abs() > 0.35).then(|| adult(3.0, y, 1.6));
            [adult(2.0, 0.0, 1.8)].into_iter().chain(behind).collect()
        })
        .collect();
    let tracks = follow(IDEAS, &frames);
    assert_eq!(ids(&tracks[3]).len(), 2);
    assert!(tracks[6].iter().any(|track| track.is == Where::Unseen), "{:?}", tracks[6]);
    assert_eq!(ids(&tracks[13]), ids(&tracks[3]));
    // With no body before it, it is gone.
    let alone: Vec<Vec<Seen>> = frames.iter().map(|seen| seen[1..].to_vec()).collect();
    assert_ne!(ids(&follow(IDEAS, &alone)[13]), ids(&follow(IDEAS, &alone)[3]));
}

#[test]
fn two_in_one_segment_are_two_and_come_out_of_it_as_they_went_in() {
    // They walk towards each other at a hand's breadth, and are one segment in between.
    let frames: Vec<Vec<Seen>> = (0..12)
        .map(|number| {
            let y = -1.1 + 0.2 * f64::from(number);
            if y.abs() < 0.25 {
                vec![segment(2.15, 0.0, 0.2 + y.abs(), 1.8, 120.0)]
            } else {
                vec![adult(2.0, y, 1.8), adult(2.3, -y, 1.5)]
            }
        })
        .collect();
    let tracks = follow(IDEAS, &frames);
    assert!(tracks[5].iter().all(|track| matches!(track.is, Where::Shared(0))), "{:?}", tracks[5]);
    let before = tracks[1].iter().map(|track| (track.id, track.at.y < 0.0)).collect::<Vec<_>>();
    let after = tracks[11].iter().map(|track| (track.id, track.at.y > 0.0)).collect::<Vec<_>>();
    assert_eq!(before, after);
}

#[test]
fn a_hand_seen_apart_from_its_body_is_no_person() {
    let hand = || segment(2.4, 0.2, 0.05, 1.1, 2.0);
    let frames: Vec<Vec<Seen>> = (0..4).map(|_| vec![adult(2.0, 0.0, 1.7), hand()]).collect();
    assert_eq!(follow(IDEAS, &frames)[3].len(), 1);
    // Without a body near it, it is a track of its own.
    assert_eq!(follow(IDEAS, &[vec![hand()]])[0].len(), 1);
}

#[test]
fn sizes_tell_two_apart_who_change_places_between_two_frames() {
    let frames = [
        vec![adult(2.0, -0.2, 1.8), adult(2.0, 0.2, 1.2)],
        vec![adult(2.0, -0.2, 1.8), adult(2.0, 0.2, 1.2)],
        vec![adult(2.0, 0.05, 1.8), adult(2.0, -0.05, 1.2)],
    ];
    let tall = |ideas: Ideas| {
        let tracks = follow(ideas, &frames);
        tracks[2].iter().find(|track| track.id == tracks[0][0].id).map(|track| track.is)
    };
    assert_eq!(tall(IDEAS), Some(Where::Own(0)));
    assert_eq!(tall(Ideas { has_size: false, ..IDEAS }), Some(Where::Own(1)));
}

#[test]
fn nothing_seen_and_nonsense_are_taken_calmly() {
    let mut bodies = Bodies::new(IDEAS, SIGHT);
    bodies.observe(&[], 0.0);
    let outline = vec![Point::new(f64::NAN, 0.0)];
    bodies.observe(
        &[Seen { at: Point::new(f64::NAN, 0.0), outline, top_m: f64::NAN, volume_l: f64::NAN }],
        0.2,
    );
    bodies.observe(&[adult(2.0, 0.0, 1.7)], 0.1);
    assert!(bodies.followed().len() <= 2);
}
