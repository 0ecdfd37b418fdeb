//! Modules that hang head down.

use super::*;

/// The walk as these modules see it that hang head down.
fn hung(walk: &Walk, down: [bool; 3]) -> Walk {
    walk.with_turned(&down)
}

#[test]
fn a_module_that_hangs_head_down_is_found_and_placed_as_well() {
    for down in [[false, true, false], [false, false, true], [false, true, true], [false; 3]] {
        let walk = hung(&walk(40, 0.03, 0.05, 7), down);
        let found = calibrate(&walk, poses()[0], &[]).unwrap();
        assert_eq!(found.modules.iter().map(|placed| placed.hang.turned).collect::<Vec<_>>(), down);
        for ((metres, radians), placed) in errors(&found).into_iter().zip(&found.modules).skip(1) {
            assert!(metres < 0.06 && radians < 0.02, "{down:?}: {metres} m, {radians} rad");
            let (right_m, wrong_m) = placed.hang.apart_m.unwrap();
            assert!(right_m < 0.1 && wrong_m > 0.4, "{down:?}: {right_m} m, {wrong_m} m");
        }
    }
}

#[test]
fn a_walk_along_a_line_does_not_say_which_way_up() {
    let mut walk = Walk::new(2);
    for scan in 0..300 {
        let at = Point::new(1.0 + 0.01 * f64::from(scan), 1.0);
        for (module, pose) in poses().into_iter().take(2).enumerate() {
            let local = pose.to_sensor(at);
            let bearing_rad = if module == 1 { -local.angle_rad() } else { local.angle_rad() };
            walk.add(seen(module, f64::from(scan) * 0.1, (local.length(), bearing_rad)));
        }
    }
    assert_eq!(upside_down::find(&walk), [Hang::default(); 2]);
}

#[test]
fn which_way_up_is_said_with_both_figures() {
    let found = calibrate(&hung(&walk(40, 0.03, 0.05, 7), [false, true, false]), poses()[0], &[]).unwrap();
    let names = Names { all: ["hall", "kitchen", "study"].map(str::to_owned).into(), modules: 3 };
    let text =
        |module: usize, upside_down| words::placed(&found.modules[module], (module, 0), upside_down, &names);
    assert!(
        text(1, false)
            .contains("; head down if hall hangs as the site has it, other than the site had it: so it fits")
    );
    assert!(text(1, true).contains("; upright if hall hangs as the site has it, other than the site had it"));
    assert!(text(2, false).contains("; upright if hall hangs as the site has it: so it fits within"));
    assert!(text(0, false).ends_with("held fixed"), "{}", text(0, false));
}
