//! Walks made up here: a walker whose centre is off by a body's shape, seen by modules at known places.

use std::sync::Arc;

use super::advice::{Advice, Guide};
use super::result::radius_95;
use super::walk::{By, Glimpse, Walk};
use super::*;
use crate::floor::{Plan, Reading};
use crate::geometry::{Point, wrapped};
use crate::site::{Module, Site};
use kehai::floor::Bits;

const POSES: [(f64, f64, f64); 3] = [(0.0, 0.0, 0.3), (4.0, 1.0, 2.8), (2.0, 4.0, -1.5)];

fn poses() -> Vec<Pose> {
    POSES.iter().map(|&(x, y, yaw_rad)| Pose { at: Point::new(x, y), yaw_rad }).collect()
}

/// Numbers that look random: 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal, one σ.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// Where the walker is: a wide figure of eight.
fn walker(at_s: f64) -> (Point, Point) {
    let place =
        |at_s: f64| Point::new(2.0 + 1.3 * libm::sin(0.7 * at_s), 1.8 + 1.1 * libm::sin(0.43 * at_s + 0.5));
    let velocity = (place(at_s + 0.01) - place(at_s - 0.01)) * 50.0;
    (place(at_s), velocity)
}

/// A walk of so long, seen with this noise; clocks are late by a few milliseconds; `off_m` is what a body does.
fn walk(seconds: u32, noise_m: f64, off_m: f64, seed: u64) -> Walk {
    let mut numbers = Numbers(seed);
    let mut walk = Walk::new(POSES.len());
    for scan in 0..seconds * 10 {
        for (module, pose) in poses().iter().enumerate() {
            let true_s = f64::from(scan) * 0.1 + 0.03 * module as f64;
            let (at, velocity) = walker(true_s);
            let local = pose.to_sensor(at);
            let along = Point::towards(pose.yaw_rad + local.angle_rad());
            let heading = velocity * (1.0 / velocity.length().max(1e-9));
            let cosine = -heading.dot(along);
            let range_m = local.length() + off_m * cosine * cosine + noise_m * numbers.normal();
            let bearing_rad = local.angle_rad() + noise_m * numbers.normal() / local.length();
            let at_s = true_s + 0.005 * module as f64;
            walk.add(Glimpse {
                module,
                by: By::Beams,
                at_s,
                range_m,
                bearing_rad,
                radial_m: 0.04,
                tangential_m: 0.03,
            });
        }
    }
    walk
}

fn errors(calibration: &Calibration) -> Vec<(f64, f64)> {
    let error = |(placed, truth): (&Placed, Pose)| {
        ((placed.pose.at - truth.at).length(), wrapped(placed.pose.yaw_rad - truth.yaw_rad).abs())
    };
    calibration.modules.iter().zip(poses()).map(error).collect()
}

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
            let (range_m, bearing_rad) = (place.length(), place.angle_rad());
            walk.add(Glimpse {
                module,
                by: By::Beams,
                at_s,
                range_m,
                bearing_rad,
                radial_m: 0.04,
                tangential_m: 0.03,
            });
        }
    }
    assert!(matches!(calibrate(&walk, poses()[0], &[]), Err(Refusal::Narrow { modules: (0, 1), .. })));
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
            let (range_m, bearing_rad) = (place.length(), place.angle_rad());
            walk.add(Glimpse {
                module,
                by: By::Beams,
                at_s,
                range_m,
                bearing_rad,
                radial_m: 0.04,
                tangential_m: 0.03,
            });
        }
    }
    let refusal = calibrate(&walk, poses()[0], &[]).unwrap_err();
    assert!(matches!(refusal, Refusal::Contradiction { modules: (0, 1), .. }), "{refusal:?}");
}

#[test]
fn the_guide_asks_for_what_is_missing_and_ends() {
    let mut guide = Guide::default();
    assert_eq!(guide.advise(&Walk::new(3), 0.0), Advice::Begin);
    let nothing = guide.progress(&Walk::new(3));
    assert!(nothing == 0.0 && nothing.is_sign_positive(), "{nothing}");
    let mut two = Walk::new(3);
    walk(12, 0.0, 0.0, 1)
        .glimpses()
        .into_iter()
        .filter(|seen| seen.module < 2)
        .for_each(|seen| two.add(seen));
    assert_eq!(guide.advise(&two, 12.0), Advice::Reach { module: 2 });
    assert!(guide.progress(&two) > 0.2 && guide.progress(&two) < 0.6, "{}", guide.progress(&two));
    let short = walk(12, 0.0, 0.0, 1);
    let Advice::Together { place: Some(place), .. } = guide.advise(&short, 13.0) else { panic!("a pair") };
    assert!(place.length() > 0.5);
    let long = walk(25, 0.0, 0.0, 1);
    assert_eq!(guide.advise(&long, 25.0), Advice::Enough);
    assert!(guide.progress(&long) > 0.99);
}

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

#[test]
fn a_single_module_without_a_place_needs_no_walk_and_no_module_is_refused() {
    use crate::session::Sessions;
    let session = |modules: Vec<Module>| {
        let site = Arc::new(Site { modules, ..Site::default() });
        let mut session = session::Session::default();
        session.set_site(&site);
        session.begin();
        session.tick(&Sessions::new(site, kehai::centre::Estimator::default()), 1.0);
        let solved = session.solve().unwrap();
        session.conclude(solved);
        session
    };
    let alone = session(vec![Module::unplaced("hall".into())]);
    let origin = Pose { at: Point::default(), yaw_rad: 0.0 };
    let found = status::Mounting { name: "hall".to_owned(), pose: origin, upside_down: false };
    assert_eq!(alone.mountings(), Some(vec![found]));
    assert_eq!(alone.status().found.unwrap().modules[0].moved_m, None);
    for modules in [vec![], vec![Module { placed: true, ..Module::unplaced("hall".into()) }]] {
        assert!(session(modules).status().refused.is_some(), "it says why");
    }
}

/// A calibration in a site of these modules, begun at 1 s.
fn begun(names: &[&str]) -> (session::Session, crate::session::Sessions) {
    let site = site_of(names);
    let sessions = crate::session::Sessions::new(Arc::clone(&site), kehai::centre::Estimator::default());
    let mut session = session::Session::default();
    session.set_site(&site);
    session.begin();
    session.tick(&sessions, 1.0);
    (session, sessions)
}

fn site_of(names: &[&str]) -> Arc<Site> {
    let modules = names.iter().map(|name| Module::unplaced((*name).to_owned())).collect();
    Arc::new(Site { modules, ..Site::default() })
}

#[test]
fn a_walk_ends_with_a_reason_where_the_site_has_other_modules_or_another_order() {
    for names in [&["kitchen", "hall"][..], &["hall"], &["hall", "kitchen", "study"], &["hall", "bath"]] {
        let (mut session, sessions) = begun(&["hall", "kitchen"]);
        session.tick(&sessions, 2.0);
        session.set_site(&site_of(names));
        assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "{names:?}");
        session.go_on();
        assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "{names:?}");
        let solved = session.solve().unwrap();
        assert_eq!(solved.result, Err(Refusal::SiteChanged), "{names:?}");
    }
}

#[test]
fn what_a_walk_came_to_is_not_the_result_of_one_that_began_while_it_was_solved() {
    let (mut session, sessions) = begun(&["hall"]);
    let solved = session.solve().unwrap();
    session.begin();
    session.tick(&sessions, 3.0);
    session.conclude(solved);
    assert_eq!(session.mountings(), None);
    let solved = session.solve().unwrap();
    session.conclude(solved);
    assert!(session.mountings().is_some(), "its own");
}

#[test]
fn a_walk_that_another_site_has_ended_while_it_was_solved_stays_ended() {
    let (mut session, sessions) = begun(&["hall"]);
    session.tick(&sessions, 2.0);
    let solved = session.solve().unwrap();
    session.set_site(&site_of(&["bath"]));
    session.conclude(solved);
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged));
    assert_eq!(session.mountings(), None);
}

#[test]
fn a_walk_goes_on_where_only_places_have_changed_and_one_that_has_just_begun_begins_anew() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    session.tick(&sessions, 2.0);
    let mut site = (*site_of(&["hall", "kitchen"])).clone();
    site.modules[1].x = 3.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused, None);
    let (mut session, sessions) = begun(&["hall"]);
    session.set_site(&site_of(&["hall", "kitchen"]));
    session.tick(&sessions, 2.0);
    let status = session.status();
    assert_eq!((status.refused, status.since_s), (None, 1.0));
    assert!(status.advice.contains("hall"), "of two modules: {}", status.advice);
}

#[test]
fn a_walk_ends_where_a_module_hangs_the_other_way_up_or_the_first_one_is_moved() {
    let begun = || {
        let (mut session, sessions) = begun(&["hall", "kitchen"]);
        let mut site = (*site_of(&["hall", "kitchen"])).clone();
        site.modules[0].placed = true;
        session.set_site(&Arc::new(site.clone()));
        session.tick(&sessions, 2.0);
        (session, site)
    };
    let (mut session, mut site) = begun();
    site.modules[1].upside_down = true;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "turned over");
    let (mut session, mut site) = begun();
    site.modules[0].x = 1.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "moved");
}

#[test]
fn the_first_module_that_is_placed_is_held() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    let mut site = (*site_of(&["hall", "kitchen"])).clone();
    (site.modules[1].placed, site.modules[1].x) = (true, 3.0);
    session.set_site(&Arc::new(site.clone()));
    session.tick(&sessions, 2.0);
    site.modules[0].x = 1.0;
    session.set_site(&Arc::new(site.clone()));
    assert_eq!(session.status().refused_is, None, "the first one has no place");
    site.modules[1].x = 4.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged));
}

#[test]
fn no_progress_is_nought() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    session.tick(&sessions, 2.0);
    assert_eq!(serde_json::to_value(session.status()).unwrap()["progress"].to_string(), "0.0");
}

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
            walk.add(Glimpse {
                module,
                by: By::Beams,
                at_s: f64::from(scan) * 0.1,
                range_m: local.length(),
                bearing_rad: if module == 1 { -local.angle_rad() } else { local.angle_rad() },
                radial_m: 0.04,
                tangential_m: 0.03,
            });
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
