//! What a walk gives: poses with bounds that hold, or why there are none.

use super::super::result::radius_95;
use super::*;

#[test]
fn a_walk_without_noise_gives_the_poses_and_the_clocks() {
    let found = calibrate(&walk(40, 0.0, 0.0, 1), poses()[0], &[]).unwrap();
    for (metres, radians) in errors(&found) {
        assert!(metres < 0.005 && radians < 0.002, "{metres} m, {radians} rad");
    }
    for (module, placed) in found.modules.iter().enumerate() {
        assert!((placed.clock_s - 0.005 * module as f64).abs() < 0.002, "{}", placed.clock_s);
    }
    assert!(found.pairs.iter().all(|pair| pair.common_s > 30.0));
}

#[test]
fn another_module_than_the_first_can_be_held_in_its_place() {
    let held = held::Held { module: 2, pose: poses()[2] };
    let found = held.calibrate(&walk(40, 0.0, 0.0, 1), &[]).unwrap();
    assert_eq!((found.modules[2].pose, found.modules[2].bounds()), (held.pose, (0.0, 0.0)));
    for (module, (metres, radians)) in errors(&found).into_iter().enumerate() {
        assert!(metres < 0.005 && radians < 0.002, "{module}: {metres} m, {radians} rad");
    }
    let pairs: Vec<_> = found.pairs.iter().map(|pair| pair.modules).collect();
    assert_eq!(pairs, [(0, 1), (0, 2), (1, 2)]);
    let mut apart = Walk::new(3);
    let glimpses = walk(30, 0.0, 0.0, 1).glimpses().into_iter();
    glimpses.filter(|glimpse| glimpse.module > 0).for_each(|glimpse| apart.add(glimpse));
    assert_eq!(held.calibrate(&apart, &[]), Err(Refusal::Apart { module: 0 }));
}

#[test]
fn noise_and_a_body_that_is_wider_than_deep_cost_little_and_the_bounds_hold() {
    let mut held = 0;
    for seed in 1..=20 {
        let found = calibrate(&walk(40, 0.03, 0.05, seed), poses()[0], &[]).unwrap();
        for ((metres, radians), placed) in errors(&found).into_iter().zip(&found.modules).skip(1) {
            assert!(metres < 0.06 && radians < 0.02, "seed {seed}: {metres} m, {radians} rad");
            held += u32::from(metres <= placed.bounds().0);
        }
    }
    assert!(held >= 36, "{held} of 40 within their bounds");
}

#[test]
fn the_same_walk_gives_the_same_bits() {
    let once = calibrate(&walk(30, 0.03, 0.05, 3), poses()[0], &[]).unwrap();
    let again = calibrate(&walk(30, 0.03, 0.05, 3), poses()[0], &[]).unwrap();
    assert_eq!(once, again);
}

#[test]
fn too_little_is_refused_and_the_pair_is_named() {
    let names = Names { all: ["hall", "kitchen", "study"].map(str::to_owned).into(), modules: 3 };
    let short = calibrate(&walk(5, 0.0, 0.0, 1), poses()[0], &[]).unwrap_err();
    let text = words::refusal(&short, &names);
    assert!(
        text.contains("hall") && text.contains("for 5 s only") && text.contains("walk where both"),
        "{text}"
    );
    let mut apart = Walk::new(3);
    walk(30, 0.0, 0.0, 1)
        .glimpses()
        .into_iter()
        .filter(|glimpse| glimpse.module < 2)
        .for_each(|glimpse| apart.add(glimpse));
    let apart = calibrate(&apart, poses()[0], &[]).unwrap_err();
    assert_eq!(apart, Refusal::Apart { module: 2 });
    assert!(words::refusal(&apart, &names).starts_with("study has not seen you"), "{apart:?}");
    assert_eq!(calibrate(&Walk::new(1), poses()[0], &[]), Err(Refusal::Alone));
}

#[test]
fn who_stands_still_has_not_walked() {
    let mut walk = Walk::new(2);
    for scan in 0..300 {
        for module in 0..2 {
            let at_s = f64::from(scan) * 0.1;
            let place = poses()[module].to_sensor(Point::new(2.0, 1.5));
            walk.add(seen(module, at_s, (place.length(), place.angle_rad())));
        }
    }
    assert!(matches!(calibrate(&walk, poses()[0], &[]), Err(Refusal::Narrow { modules: (0, 1), .. })));
}

#[test]
fn who_stands_for_long_before_two_modules_has_walked_at_one_place_only() {
    let mut walk = Walk::new(2);
    for scan in 0..400 {
        for (module, pose) in poses().iter().enumerate().take(2) {
            let at_s = f64::from(scan) * 0.1;
            // The first sees a walker who comes to stand after ten seconds, the other one another person, who stands all the time.
            let (at, _) = walker(if module == 0 { at_s.min(10.0) } else { 10.0 });
            let place = pose.to_sensor(at);
            walk.add(seen(module, at_s, (place.length(), place.angle_rad())));
        }
    }
    let refusal = calibrate(&walk, poses()[0], &[]).unwrap_err();
    assert!(matches!(refusal, Refusal::Narrow { modules: (0, 1), .. }), "{refusal:?}");
}

#[test]
fn two_who_walk_at_the_same_time_contradict() {
    let mut walk = Walk::new(2);
    for scan in 0..400 {
        for (module, pose) in poses().iter().enumerate().take(2) {
            let at_s = f64::from(scan) * 0.1;
            // Each sees another one.
            let (at, _) = walker(at_s * if module == 0 { 1.0 } else { -1.7 } + 3.0 * module as f64);
            let place = pose.to_sensor(at);
            walk.add(seen(module, at_s, (place.length(), place.angle_rad())));
        }
    }
    let refusal = calibrate(&walk, poses()[0], &[]).unwrap_err();
    assert!(matches!(refusal, Refusal::Contradiction { modules: (0, 1), .. }), "{refusal:?}");
}

#[test]
fn a_bound_holds_95_percent_whatever_the_ellipse() {
    let mut numbers = Numbers(3);
    for share in [0.0, 0.5, 0.8, 1.0] {
        let radius_m = radius_95(1.0, share * share);
        let within = (0..20_000).filter(|_| {
            let (x, y) = (numbers.normal(), share * numbers.normal());
            x * x + y * y <= radius_m * radius_m
        });
        let percent = within.count() as f64 / 200.0;
        assert!((percent - 95.0).abs() < 0.6, "{share}: {percent} %");
    }
}
