//! Floors that are placed by steps.

use kehai::floor::Bits;

use super::*;
use crate::floor::{Plan, Reading};

/// A floor below the walk.
const MAT: Plan = Plan {
    corner: Pose { at: Point { x: 1.33, y: 0.22 }, yaw_rad: 0.4 },
    columns: 30,
    rows: 30,
    pitch_m: 0.08,
};

/// The walk with feet on the floor, which does not know where it is.
fn walk_on_floor(seconds: u32, from_s: f64) -> Walk {
    let (glimpses, mut walk) = (walk(seconds, 0.02, 0.05, 1).glimpses(), Walk::new(POSES.len() + 1));
    glimpses.into_iter().for_each(|glimpse| walk.add(glimpse));
    for number in 0..seconds * 9 {
        let at_s = f64::from(number) / 9.0;
        let mut down = Bits::default();
        let near = (at_s / 0.5).round() as i64;
        for step in (near - 1..=near + 1).filter(|step| (at_s - *step as f64 * 0.5).abs() < 0.3) {
            let (body, velocity) = walker(step as f64 * 0.5);
            let ahead = velocity * (1.0 / velocity.length());
            let foot = body + ahead.left() * if step % 2 == 0 { 0.08 } else { -0.08 };
            for panel in 0..MAT.panels() {
                let off = MAT.middle(panel) - foot;
                if off.dot(ahead).abs() < 0.13 && off.dot(ahead.left()).abs() < 0.05 {
                    down.set(panel, true);
                }
            }
        }
        let plan = Plan { corner: Pose { at: Point::default(), yaw_rad: 0.0 }, ..MAT };
        let reading = Reading { floor: 0, plan, at_s: at_s + 1.0 / 9.0, down, faulty: Vec::new() };
        if at_s >= from_s {
            walk.read(POSES.len(), &reading);
        }
    }
    walk
}

#[test]
fn a_floor_is_placed_by_steps_and_the_modules_stay_where_they_were() {
    let found = calibrate(&walk_on_floor(60, 0.0), poses()[0], &[]).unwrap();
    let placed = &found.modules[POSES.len()];
    let off_m = (placed.pose.at - MAT.corner.at).length();
    let off_rad = wrapped(placed.pose.yaw_rad - MAT.corner.yaw_rad).abs();
    let (within_m, within_rad) = placed.bounds();
    assert!(
        off_m < within_m.min(0.06) && off_rad < within_rad.min(0.03),
        "{off_m} m, {off_rad} rad, {placed:?}"
    );
    let alone = calibrate(&walk(60, 0.02, 0.05, 1), poses()[0], &[]).unwrap();
    for (with, without) in found.modules.iter().zip(&alone.modules) {
        assert!((with.pose.at - without.pose.at).length() < 0.03, "{with:?} {without:?}");
    }
}

#[test]
fn a_walk_that_misses_a_floor_or_leaves_it_early_is_refused_and_the_floor_is_named() {
    let all = ["hall", "kitchen", "study", "mat"].map(str::to_owned).into();
    let names = Names { all, modules: 3 };
    let said = |from_s: f64| {
        let refusal = calibrate(&walk_on_floor(60, from_s), poses()[0], &[]).unwrap_err();
        words::refusal(&refusal, &names)
    };
    let missed = said(60.0);
    assert!(missed.starts_with("no module has seen you walk on the floor mat"), "{missed}");
    let early = said(52.0);
    assert!(early.contains("has seen you walk on the floor mat for ") && early.contains("s only"), "{early}");
    assert!([missed, early].iter().all(|text| !text.contains('\n')));
}
