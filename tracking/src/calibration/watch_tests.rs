//! Two and three modules that see a person walk: as the site says, and otherwise.

use std::sync::Arc;

use kehai::candidate::Candidate;
use kehai::scan::{Geometry, URG_04LX};
use nalgebra::{Matrix2, Vector2};

use super::*;
use crate::observation::Detection;

const POSES: [(f64, f64, f64); 3] = [(0.0, 0.0, 0.8), (4.0, 0.5, 2.4), (2.0, 4.0, -1.57)];

fn pose(module: usize) -> Pose {
    let (x, y, yaw_rad) = POSES[module];
    Pose { at: Point::new(x, y), yaw_rad }
}

fn site(modules: usize) -> Site {
    let module = |number: usize| {
        let (x, y, yaw_rad) = POSES[number];
        crate::site::Module {
            name: number.to_string(),
            x,
            y,
            yaw_deg: yaw_rad.to_degrees(),
            height_m: 0.6,
            upside_down: false,
            placed: true,
            furniture: Vec::new(),
        }
    };
    Site { modules: (0..modules).map(module).collect(), ..Site::default() }
}

fn view(module: usize) -> Arc<View> {
    Arc::new(View {
        module,
        pose: pose(module),
        height_m: 0.6,
        geometry: Geometry::new(URG_04LX).unwrap(),
        upside_down: false,
    })
}

/// A person at `place` as the site has it, seen at `at_s`; every module sees 4 m far where no person stands.
fn observation(view: &Arc<View>, at_s: f64, place: Option<Point>) -> Observation {
    let beams = usize::from(view.geometry.beams());
    let person = |at: Point| Detection {
        candidate: Candidate::default(),
        at_s: at_s + 0.05,
        centre: Vector2::new(at.x, at.y),
        covariance: Matrix2::identity() * 0.002,
        outline: [at; 3],
        width_m: 0.4,
        size: None,
    };
    let background_mm: Arc<[u16]> = vec![4000; beams].into();
    Observation {
        view: Arc::clone(view),
        start_s: at_s,
        detections: place.map(person).into_iter().collect(),
        empty_mm: background_mm.to_vec(),
        background_mm,
    }
}

fn walker(at_s: f64) -> Point {
    Point::new(2.0 + libm::sin(0.8 * at_s), 1.7 + 0.8 * libm::sin(0.5 * at_s))
}

/// What the watch says after so long, if module 1 is elsewhere than the site says: it sees what `seen` makes of a place.
fn after(seconds: u32, modules: usize, seen: impl Fn(Point) -> Option<Point>) -> Vec<(usize, Finding)> {
    let mut watch = PoseWatch::new(&site(modules));
    let views: Vec<_> = (0..modules).map(view).collect();
    let mut found = Vec::new();
    for scan in 0..seconds * 10 {
        let at_s = f64::from(scan) * 0.1;
        for view in &views {
            let place = walker(at_s + 0.05);
            let place = if view.module == 1 { seen(place) } else { Some(place) };
            watch.observe(&observation(view, at_s, place));
        }
        found = watch.findings(at_s);
    }
    found
}

/// Where a place seems to be to module 1 that has been turned, and moved.
fn from_elsewhere(place: Point, turn_rad: f64, shift: Point) -> Point {
    let site = pose(1);
    let truth = Pose { at: site.at + shift, yaw_rad: site.yaw_rad + turn_rad };
    site.to_site(truth.to_sensor(place))
}

#[test]
fn modules_that_are_where_the_site_says_are_left_in_peace() {
    assert_eq!(after(60, 3, Some), []);
    assert_eq!(after(60, 2, Some), []);
}

#[test]
fn a_module_is_well_once_a_walk_has_shown_it_and_not_before() {
    let mut watch = PoseWatch::new(&site(2));
    let views = [view(0), view(1)];
    let mut walk = |scans: std::ops::Range<u32>, turn_rad: f64| {
        for scan in scans {
            let at_s = f64::from(scan) * 0.1;
            let place = walker(at_s + 0.05);
            let seen = from_elsewhere(place, turn_rad, Point::default());
            watch.observe(&observation(&views[0], at_s, Some(place)));
            watch.observe(&observation(&views[1], at_s, Some(seen)));
            watch.findings(at_s);
        }
        [0, 1, 2].map(|module| watch.is_well(module))
    };
    assert_eq!(walk(0..10, 0.0), [false; 3], "a step or two show nothing");
    assert_eq!(walk(10..300, 0.0), [true, true, false]);
    assert!(!walk(300..900, 0.17)[1]);
}

#[test]
fn a_turned_module_is_named_among_two_and_among_three() {
    for modules in [2, 3] {
        for degrees in [10.0_f64, -10.0] {
            let turned = |place| Some(from_elsewhere(place, degrees.to_radians(), Point::default()));
            let found = after(20, modules, turned);
            let [(1, Finding::Moved { turn_rad, shift_m })] = found[..] else { panic!("{found:?}") };
            assert!((turn_rad.to_degrees() - degrees).abs() < 1.0 && shift_m < 0.1, "{found:?}");
        }
    }
}

#[test]
fn a_module_that_was_moved_is_named_among_three() {
    let found = after(20, 3, |place| Some(from_elsewhere(place, 0.0, Point::new(0.4, 0.0))));
    let [(1, Finding::Moved { turn_rad, shift_m })] = found[..] else { panic!("{found:?}") };
    assert!((shift_m - 0.4).abs() < 0.05 && turn_rad.abs() < 0.02, "{found:?}");
}

#[test]
fn what_was_seen_in_passing_proves_no_more_when_no_person_walks() {
    // Two modules see two people who pass, and take them for one.
    let mut watch = PoseWatch::new(&site(2));
    let views = [view(0), view(1)];
    for scan in 0..200 {
        let at_s = f64::from(scan) * 0.1;
        let walks = scan < 75;
        let one = walks.then(|| walker(at_s + 0.05));
        let other = one.map(|place| from_elsewhere(place, 0.2, Point::new(0.5, 0.0)));
        watch.observe(&observation(&views[0], at_s, one));
        watch.observe(&observation(&views[1], at_s, other));
        assert_eq!(watch.findings(at_s), [], "{at_s} s");
    }
}

#[test]
fn a_module_that_sees_no_people_where_others_do_looks_past_them() {
    assert_eq!(after(8, 2, |_| None), [], "not after some seconds");
    assert_eq!(after(25, 2, |_| None), [(1, Finding::Past)]);
}

#[test]
fn a_covered_module_is_named() {
    let mut watch = PoseWatch::new(&site(2));
    let mut found = Vec::new();
    for scan in 0..120 {
        let at_s = f64::from(scan) * 0.1;
        watch.observe(&observation(&view(0), at_s, Some(walker(at_s + 0.05))));
        let mut covered = observation(&view(1), at_s, None);
        covered.empty_mm.fill(100);
        watch.observe(&covered);
        found = watch.findings(at_s);
    }
    assert_eq!(found, [(1, Finding::Covered)]);
}

/// What the watch says of two modules, of which the second was turned by 10°, while a third sees two people, `aside_m` east of
/// the first.
fn beside_a_crowd(aside_m: f64) -> Vec<(usize, Finding)> {
    let mut three = site(3);
    three.modules[2].x = aside_m;
    let mut watch = PoseWatch::new(&three);
    let crowded =
        Arc::new(View { pose: Pose { at: Point::new(aside_m, 4.0), yaw_rad: -1.57 }, ..(*view(2)).clone() });
    let views = [view(0), view(1)];
    let mut found = Vec::new();
    for scan in 0..200 {
        let at_s = f64::from(scan) * 0.1;
        let place = walker(at_s + 0.05);
        let turned = from_elsewhere(place, 0.17, Point::default());
        watch.observe(&observation(&views[0], at_s, Some(place)));
        watch.observe(&observation(&views[1], at_s, Some(turned)));
        let mut several = observation(&crowded, at_s, Some(Point::new(aside_m, 2.0)));
        several
            .detections
            .extend(observation(&crowded, at_s, Some(Point::new(aside_m + 1.0, 2.0))).detections);
        watch.observe(&several);
        found = watch.findings(at_s);
    }
    found
}

#[test]
fn a_crowd_silences_the_watch_where_its_place_may_be_seen_and_nowhere_else() {
    assert_eq!(beside_a_crowd(2.0), [], "the crowd may be what both see");
    let found = beside_a_crowd(30.0);
    assert!(matches!(found[..], [(1, Finding::Moved { .. })]), "{found:?}");
}
