//! What the walls add to a walk.

use super::*;

/// The walls of a room with a niche, as a module sees them.
fn outline(pose: &Pose, scale: f64) -> Outline {
    let corners = [(-1.0, -1.0), (5.5, -1.0), (5.5, 3.0), (4.8, 3.0), (4.8, 5.0), (-1.0, 5.0)]
        .map(|(x, y)| Point::new(x, y));
    let beam = |index: i32| {
        let bearing_rad = f64::from(index) * 0.006;
        let ray = Point::towards(pose.yaw_rad + bearing_rad);
        let meet = |side: usize| {
            let (from, to) = (corners[side], corners[(side + 1) % corners.len()]);
            let along = to - from;
            let share = (from - pose.at).cross(ray) / ray.cross(along);
            let range_m = (from - pose.at).cross(along) / ray.cross(along);
            ((0.0..=1.0).contains(&share) && range_m > 0.0).then_some(range_m)
        };
        let range_m = (0..corners.len()).filter_map(meet).fold(f64::INFINITY, f64::min);
        (bearing_rad, if range_m < 5.6 { range_m * scale } else { 0.0 })
    };
    Outline::of((-340..=340).map(beam))
}

#[test]
fn walls_that_two_see_make_it_finer() {
    let rooms: Vec<_> =
        poses().iter().zip([1.0, 1.003, 0.997]).map(|(pose, scale)| Some(outline(pose, scale))).collect();
    let walk = walk(20, 0.04, 0.06, 5);
    let by_walk = calibrate(&walk, poses()[0], &[]).unwrap();
    let by_both = calibrate(&walk, poses()[0], &rooms).unwrap();
    let worst = |found: &Calibration| errors(found).iter().map(|error| error.0).fold(0.0, f64::max);
    assert!(
        worst(&by_both) < 0.02 && worst(&by_both) < worst(&by_walk),
        "{} {}",
        worst(&by_walk),
        worst(&by_both)
    );
    assert!(by_both.shared_wall_m > 5.0, "{}", by_both.shared_wall_m);
    assert!(words::quality(&by_both).contains("m of wall"), "{}", words::quality(&by_both));
}

#[test]
fn a_room_that_stands_askew_says_how_much() {
    for askew_deg in [-40.0_f64, -10.0, 0.0, 20.0, 44.0] {
        // A square of 4 m about the module, turned.
        let beams = (0..720).map(|beam| {
            let bearing_rad = f64::from(beam) * std::f64::consts::TAU / 720.0 - std::f64::consts::PI;
            let (sine, cosine) = libm::sincos(bearing_rad - askew_deg.to_radians());
            (bearing_rad, 2.0 / sine.abs().max(cosine.abs()))
        });
        let found_deg = Outline::of(beams).direction_rad().to_degrees();
        assert!((found_deg - askew_deg).abs() < 0.5, "{found_deg} for {askew_deg}");
    }
    assert_eq!(Outline::default().direction_rad(), 0.0);
}
