//! Walkers whose feet are patches: one body each, under one number.

use super::*;

/// The feet of a walker at 1 m/s along x, a step every 0.55 m, 8 cm to the left and to the right of `y`.
fn feet(walked_m: f64, y: f64) -> Vec<Patch> {
    const STEP_M: f64 = 0.55;
    let step = (walked_m / STEP_M).round() as i64;
    let down = |step: i64| {
        let at_m = step as f64 * STEP_M;
        let side = if step % 2 == 0 { 0.08 } else { -0.08 };
        ((walked_m - at_m).abs() < 0.6 * STEP_M)
            .then(|| Patch { middle: Point::new(at_m, y + side), panels: 4 })
    };
    [step - 1, step, step + 1].into_iter().filter_map(down).collect()
}

fn walked(bodies: &mut Bodies, ways: &[(f64, f64)], seconds: f64) -> Vec<TrackState> {
    let readings = (seconds * 9.0) as u32;
    for reading in 0..readings {
        let at_s = f64::from(reading) / 9.0;
        let patches: Vec<Patch> = ways
            .iter()
            .flat_map(|(sense, y)| {
                feet(at_s, *y).into_iter().map(|patch| Patch {
                    middle: Point::new(patch.middle.x * *sense, patch.middle.y),
                    ..patch
                })
            })
            .collect();
        bodies.observe(&patches, at_s);
    }
    bodies.tracks(f64::from(readings - 1) / 9.0)
}

#[test]
fn a_walker_is_one_body_between_the_feet() {
    let tracks = walked(&mut Bodies::default(), &[(1.0, 0.0)], 4.0);
    assert_eq!(tracks.len(), 1, "{tracks:?}");
    let off = tracks[0].at - Point::new(3.889, 0.0);
    assert!(off.x.abs() < 0.15 && off.y.abs() < 0.05, "{off:?}");
    assert_eq!((tracks[0].id, tracks[0].state), (1, LifeCycle::Confirmed));
}

#[test]
fn two_who_pass_at_arms_length_keep_their_numbers() {
    let mut bodies = Bodies::default();
    let shift = |ways: &[(f64, f64)]| walked(&mut bodies.clone(), ways, 3.0);
    let tracks = shift(&[(1.0, 0.0), (-1.0, 0.7)]);
    assert_eq!(tracks.len(), 2, "{tracks:?}");
    bodies.observe(&[], 0.0);
}

#[test]
fn who_leaves_the_floor_is_gone_and_a_flight_is_not() {
    let mut bodies = Bodies::default();
    walked(&mut bodies, &[(1.0, 0.0)], 2.0);
    bodies.observe(&[], 2.3);
    assert_eq!(bodies.tracks(2.3).len(), 1);
    bodies.observe(&[], 2.6);
    assert_eq!(bodies.tracks(2.6).len(), 0);
}

#[test]
fn a_body_whose_feet_are_in_anothers_patch_stays() {
    let mut bodies = Bodies::default();
    let stand = |x: f64| Patch { middle: Point::new(x, 0.0), panels: 6 };
    for reading in 0..9 {
        bodies.observe(&[stand(0.0), stand(1.0)], f64::from(reading) / 9.0);
    }
    assert_eq!(bodies.tracks(0.9).len(), 2);
    for reading in 9..27 {
        let near = 1.0 - 0.03 * f64::from(reading - 9);
        bodies.observe(&[stand(0.0), stand(near)], f64::from(reading) / 9.0);
    }
    for reading in 27..45 {
        bodies.observe(&[stand(0.1)], f64::from(reading) / 9.0);
    }
    assert_eq!(bodies.tracks(5.0).len(), 2);
}
