//! Walkers whose feet are patches: one body each, under one number.

use super::*;
use crate::geometry::Point;
use crate::tracker::{LifeCycle, TrackState};

impl Bodies {
    /// The bodies of the likeliest explanation.
    fn tracks(&self, at_s: f64) -> Vec<TrackState> {
        self.explanations(at_s).into_iter().next().unwrap_or_default().people
    }
}

/// The six panels of a sole along x.
fn sole(at: Point) -> Patch {
    let panels = [-0.08, 0.0, 0.08].into_iter().flat_map(|x| [-0.04, 0.04].map(|y| at + Point::new(x, y)));
    Patch::of(panels.collect()).unwrap()
}

/// The feet of a walker at 1 m/s along x, a step every 0.55 m, 8 cm to the left and to the right of `y`.
fn feet(walked_m: f64, y: f64) -> Vec<Patch> {
    const STEP_M: f64 = 0.55;
    let step = (walked_m / STEP_M).round() as i64;
    let down = |step: i64| {
        let at_m = step as f64 * STEP_M;
        let side = if step % 2 == 0 { 0.08 } else { -0.08 };
        ((walked_m - at_m).abs() < 0.6 * STEP_M).then(|| sole(Point::new(at_m, y + side)))
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
                let turned = |at: &Point| Point::new(at.x * *sense, at.y);
                feet(at_s, *y)
                    .into_iter()
                    .filter_map(move |patch| Patch::of(patch.panels.iter().map(turned).collect()))
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
fn a_body_that_leaves_is_gone_and_one_in_flight_is_not() {
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
    let stand = |x: f64| sole(Point::new(x, 0.0));
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

#[test]
fn the_next_step_tells_who_has_set_a_foot_between_two() {
    // Two stand half a metre and a little apart; a foot lands between them, and the one on the left goes on over it.
    let mut bodies = Bodies::default();
    let mut reading = 0;
    let mut observe = |bodies: &mut Bodies, feet: &[(f64, f64)], times: u32| {
        let patches: Vec<Patch> = feet.iter().map(|(x, y)| sole(Point::new(*x, *y))).collect();
        for _ in 0..times {
            bodies.observe(&patches, f64::from(reading) / 9.0);
            reading += 1;
        }
        bodies.tracks(f64::from(reading - 1) / 9.0)
    };
    let begun = observe(&mut bodies, &[(0.0, 0.0), (1.1, 0.0)], 9);
    let left = begun.iter().find(|track| track.at.x < 0.5).unwrap().id;
    observe(&mut bodies, &[(0.0, 0.0), (1.1, 0.0), (0.5, 0.2)], 2);
    assert!(bodies.hypotheses.len() > 1, "{:?}", bodies.hypotheses);
    observe(&mut bodies, &[(1.1, 0.0), (0.5, 0.2)], 4);
    observe(&mut bodies, &[(1.1, 0.0), (0.5, 0.2), (0.5, 0.8)], 2);
    let went = observe(&mut bodies, &[(1.1, 0.0), (0.5, 0.8)], 4);
    assert_eq!(went.len(), 2, "{went:?}");
    let track = went.iter().find(|track| track.id == left).unwrap();
    assert!((track.at - Point::new(0.5, 0.7)).length() < 0.4, "{went:?}");
}

#[test]
fn feet_of_one_body_that_touch_are_two_feet() {
    // Toe to heel along x, as in a narrow turn: one patch from the first foot's heel to the second one's toes.
    let mut bodies = Bodies::default();
    let (first, second) = (sole(Point::default()), sole(Point::new(0.28, 0.02)));
    let both = Patch::of([first.panels.clone(), second.panels.clone()].concat()).unwrap();
    (0..5).for_each(|reading| bodies.observe(std::slice::from_ref(&first), f64::from(reading) / 9.0));
    (5..8).for_each(|reading| bodies.observe(std::slice::from_ref(&both), f64::from(reading) / 9.0));
    (8..11).for_each(|reading| bodies.observe(std::slice::from_ref(&second), f64::from(reading) / 9.0));
    let tracks = bodies.tracks(10.0 / 9.0);
    assert_eq!(tracks.len(), 1, "{tracks:?}");
    assert!((tracks[0].at.x - 0.2).abs() < 0.12, "{tracks:?}");
}

#[test]
fn a_print_points_along_its_sole() {
    let axis = print::Print::of(&sole(Point::new(1.0, 2.0))).axis;
    assert!(axis.x > 0.4 && axis.y.abs() < 1e-9, "{axis:?}");
    let turned = Patch::of(sole(Point::default()).panels.iter().map(|at| at.left()).collect()).unwrap();
    assert!(print::Print::of(&turned).axis.x < -0.4);
    let one = Patch::of(vec![Point::default()]).unwrap();
    assert_eq!(print::Print::of(&one).axis, Point::default());
}

#[test]
fn a_step_ahead_is_likelier_than_one_back_and_too_long_a_one_is_none() {
    let motion = {
        let slack = nalgebra::Matrix2::identity() * 0.0025;
        let mut motion =
            crate::tracker::kalman::Kinematics::new(0.0, nalgebra::Vector2::zeros(), &slack, 0.5, 0.5);
        motion.mean[2] = 0.8;
        motion
    };
    let stance = |foot: Point| step::Stance {
        motion: &motion,
        foot: Point::new(-0.2, 0.0),
        on_both: false,
        lands: Point::new(-0.2, 0.0) + (foot - Point::new(-0.2, 0.0)) * 0.4,
        way: None,
    };
    let density = |x: f64, y: f64| {
        let foot = Point::new(x, y);
        stance(foot).density(&print::Print::of(&sole(foot)), 0.0)
    };
    let ahead = density(0.35, 0.05).unwrap();
    assert!(ahead > 5.0 * density(-0.35, 0.05).unwrap());
    assert!(ahead > 3.0 * density(0.0, 0.4).unwrap());
    assert_eq!(density(0.7, 0.0), None);
}

#[test]
fn explanations_say_what_they_grew_out_of_and_the_likeliest_comes_first() {
    let mut bodies = Bodies::default();
    let observe = |bodies: &mut Bodies, feet: &[(f64, f64)], at_s: f64| {
        let patches: Vec<Patch> = feet.iter().map(|(x, y)| sole(Point::new(*x, *y))).collect();
        bodies.observe(&patches, at_s);
        bodies.explanations(at_s)
    };
    let stand = [(0.0, 0.0), (1.1, 0.0)];
    for reading in 0..9 {
        observe(&mut bodies, &stand, f64::from(reading) / 9.0);
    }
    let before = bodies.explanations(1.0);
    let numbers = |all: &[Explanation]| all.iter().map(|one| one.line[0]).collect::<Vec<u64>>();
    let after = observe(&mut bodies, &[stand[0], stand[1], (0.5, 0.2)], 1.0);
    let new: Vec<&Explanation> =
        after.iter().filter(|one| !numbers(&before).contains(&one.line[0])).collect();
    assert!(!new.is_empty(), "either may have set the foot: {after:?}");
    assert!(new.iter().all(|one| numbers(&before).contains(&one.line[1])), "{new:?} of {before:?}");
    let mut all = numbers(&after);
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), after.len(), "a number twice: {after:?}");
    assert!(after[0].surprise == 0.0 && after.is_sorted_by(|one, other| one.surprise <= other.surprise));
}

#[test]
fn the_line_of_an_explanation_is_bounded_and_forgets_the_oldest() {
    let mut hypothesis = Hypothesis::default();
    (1..=100).for_each(|number| hypothesis.branch(number));
    let line = hypothesis.explanation(0.0).line;
    assert_eq!(line, (84..=100).rev().collect::<Vec<u64>>());
}
