//! What is no person and is not counted: door leaves, parts of a person, legs of chairs, reflections. Candidates are
//! made by hand, each with a place, a width and for how long it has been still.

use std::sync::Arc;

use ::kehai::candidate::Candidate;
use ::kehai::scan::{Geometry, URG_04LX};

use super::ablation::Ideas;
use super::*;
use crate::geometry::Pose;
use crate::observation::View;
use crate::tracker::LifeCycle;

/// A torso, and the leg of a chair, m.
const TORSO_M: f64 = 0.4;
const LEG_M: f64 = 0.02;

/// Time between two scans, s.
const SCAN_S: f64 = 0.05;

/// A person or a thing: where; how wide across the view in m, or, negative, how long along it; still for how long in s.
type Thing = (f64, f64, f64, f64);

struct Bench {
    tracker: RuleTracker,
    view: Arc<View>,
    now_s: f64,
}

impl Bench {
    /// A module at (0, −4) that looks along y, in a site; it has been running for a while.
    fn new(site: &str) -> Self {
        let module = "\n[[module]]\nname = 'm'\nx = 0\ny = -4\nyaw_deg = 90";
        let site: Site = toml::from_str(&(site.to_owned() + module)).unwrap();
        let pose = Pose { at: Point::new(0.0, -4.0), yaw_rad: core::f64::consts::FRAC_PI_2 };
        let geometry = Geometry::new(URG_04LX).unwrap();
        let view = Arc::new(View { module: 0, pose, height_m: 0.6, geometry, upside_down: false });
        let mut bench = Self { tracker: RuleTracker::new(&site, Ideas::default()), view, now_s: 0.0 };
        bench.watch(11.0, |_| Vec::new());
        bench
    }

    /// Shows what is there at each time since the beginning, for `for_s`; returns the non-tentative tracks.
    fn watch(&mut self, for_s: f64, things: impl Fn(f64) -> Vec<Thing>) -> Vec<TrackState> {
        let began_s = self.now_s;
        while self.now_s < began_s + for_s {
            let detections = things(self.now_s - began_s).into_iter().map(|thing| self.seen(thing)).collect();
            let background_mm = vec![9000; usize::from(self.view.geometry.beams())];
            let observation = Observation {
                view: Arc::clone(&self.view),
                start_s: self.now_s,
                detections,
                empty_mm: Vec::new(),
                background_mm: background_mm.into(),
            };
            self.tracker.observe(&observation);
            self.now_s += SCAN_S;
        }
        let mut tracks = self.tracker.tracks(self.now_s);
        tracks.retain(|track| track.state != LifeCycle::Tentative);
        tracks
    }

    fn seen(&self, (x, y, chord_m, still_s): Thing) -> Detection {
        let width_m = chord_m.abs();
        let candidate = Candidate {
            near_mm: 1000,
            narrow: width_m < 0.2,
            static_ds: (still_s * 10.0) as u16,
            ..Candidate::default()
        };
        let half = Point::new(chord_m.max(0.0), (-chord_m).max(0.0)) * 0.5;
        let (first, last) = ((x - half.x, y - half.y), (x + half.x, y + half.y));
        Detection { candidate, at_s: self.now_s, ..Detection::chord(first, last) }
    }
}

/// A room of 4 m by 4 m that is entered from below.
const ROOM: &str = "
    [[zone]]
    name = 'room'
    polygon = [[-2, -2], [2, -2], [2, 2], [-2, 2]]
    count = true
    enclosed = true
    [[entry]]
    name = 'street'
    line = [[-2, -2], [2, -2]]";

#[test]
fn a_leaf_that_opens_is_no_person_and_one_who_comes_from_behind_it_is() {
    let leaf = "[[mover]]\npolygon = [[-0.5, 0], [0.5, 0], [0.5, 1], [-0.5, 1]]";
    let mut bench = Bench::new(leaf);
    // The face of a leaf, which reaches out of where it moves at one end.
    let opening = |at_s: f64| vec![(0.3 - 0.2 * at_s, 0.8 - 0.2 * at_s, 0.9, 0.0)];
    assert!(bench.watch(1.5, opening).is_empty());
    let mut bench = Bench::new(leaf);
    let comes = |at_s: f64| vec![(0.0, 0.5 - at_s, TORSO_M + 0.7, 0.0)];
    assert!(bench.watch(0.4, comes).is_empty());
    assert_eq!(bench.watch(0.8, |at_s| comes(at_s + 0.4)).len(), 1, "a pace behind the leaf");
}

#[test]
fn no_track_begins_in_an_excluded_area_and_one_that_comes_in_goes_on() {
    let shelf = "[[exclude]]\npolygon = [[-0.5, 0], [0.5, 0], [0.5, 1], [-0.5, 1]]";
    let stands = |_: f64| vec![(0.0, 0.5, TORSO_M, 0.0)];
    assert_eq!(Bench::new("").watch(3.0, stands).len(), 1);
    let mut bench = Bench::new(shelf);
    assert!(bench.watch(3.0, stands).is_empty());
    assert!(bench.tracker.tracks(bench.now_s).is_empty(), "not even a tentative one");
    let walks = |at_s: f64| vec![(0.0, -1.0 + 0.8 * at_s.min(2.0), TORSO_M, 0.0)];
    assert_eq!(Bench::new(shelf).watch(3.0, walks).len(), 1);
}

#[test]
fn wheels_are_a_part_of_who_sits_between_them_and_people_are_not() {
    let driver = |at_s: f64| (0.0, -3.5 + 0.8 * at_s, TORSO_M, 0.0);
    let with = |things: &[(f64, f64, f64)], at_s: f64| {
        let (x, y, ..) = driver(at_s);
        let others =
            things.iter().map(|(aside_m, behind_m, width_m)| (x + aside_m, y - behind_m, *width_m, 0.0));
        let others = others.take(if at_s > 1.0 { things.len() } else { 0 });
        std::iter::once(driver(at_s)).chain(others).collect::<Vec<Thing>>()
    };
    // Their chords lie along the way.
    let wheels = [(-0.24, 0.45, -0.56), (0.24, 0.45, -0.56)];
    let mut bench = Bench::new(ROOM);
    assert_eq!(bench.watch(3.0, |at_s| with(&wheels, at_s)).len(), 1);
    assert_eq!(bench.tracker.tracks(bench.now_s).len(), 3, "they are shown");
    // A person who gets up and leaves the chair standing leaves one track behind.
    let leaves = |at_s: f64| {
        let mut all = with(&wheels, 3.0);
        all[0].1 += 0.8 * at_s;
        all
    };
    assert_eq!(bench.watch(1.5, leaves).len(), 3, "both have parted from him");
    for other in [(0.0, 0.5, -0.35), (0.5, 0.0, -0.35), (0.5, 0.0, TORSO_M)] {
        let tracks = Bench::new(ROOM).watch(3.0, |at_s| with(&[other], at_s));
        assert_eq!(tracks.len(), 2, "behind him, beside him, beside him as seen from before: {other:?}");
    }
    // As long as a wheel, but not always at the same place.
    let site_tracker = |at_s: f64| with(&[(0.0, 0.55 + 0.25 * libm::sin(3.0 * at_s), -0.56)], at_s);
    assert_eq!(Bench::new(ROOM).watch(3.0, site_tracker).len(), 2);
}

#[test]
fn a_piece_within_a_vehicle_is_no_track_and_a_person_behind_it_is() {
    let vehicle = |others: &[(f64, f64, f64)], at_s: f64| {
        let y = -3.5 + 0.8 * at_s;
        let wheels: &[(f64, f64, f64)] = &[(-0.24, 0.45, -0.56), (0.24, 0.45, -0.56)];
        let wheels = wheels.iter().filter(|_| at_s > 1.0);
        let all = wheels.chain(others.iter().filter(|_| at_s > 3.0));
        let all = all.map(|(aside_m, behind_m, wide_m)| (*aside_m, y - behind_m, *wide_m, 0.0));
        std::iter::once((0.0, y, TORSO_M, 0.0)).chain(all).collect::<Vec<Thing>>()
    };
    let shown = |others: &[(f64, f64, f64)]| {
        let mut bench = Bench::new(ROOM);
        let confirmed = bench.watch(5.5, |at_s| vehicle(others, at_s)).len();
        (confirmed, bench.tracker.tracks(bench.now_s).len())
    };
    assert_eq!(shown(&[]), (1, 3), "the owner and the wheels");
    assert_eq!(shown(&[(0.3, 0.0, -0.2)]), (1, 3), "a hand ahead of a wheel");
    assert_eq!(shown(&[(0.0, 1.0, TORSO_M)]), (2, 4), "a person who touches it from behind");
    assert_eq!(shown(&[(0.85, 0.3, TORSO_M)]), (2, 4), "a person beside it");
}

#[test]
fn what_jumps_between_legs_that_stand_still_has_not_moved() {
    let pairs = |at_s: f64, still: bool| {
        // Of four legs now the front ones are seen, now the rear ones.
        let rear = libm::fmod(at_s, 4.0) > 2.0;
        let (y, still_s) = (if rear { 0.4 } else { 0.0 }, if still { 1.0 + at_s } else { 0.0 });
        vec![(-0.2, y, LEG_M, still_s), (0.2, y, LEG_M, still_s)]
    };
    assert!(Bench::new(ROOM).watch(10.0, |at_s| pairs(at_s, true)).is_empty());
    assert_eq!(Bench::new(ROOM).watch(10.0, |at_s| pairs(at_s, false)).len(), 1, "of a person who walks");
}

#[test]
fn legs_that_come_in_move() {
    // Just inside the entry.
    let legs = |at_s: f64, y: f64| vec![(-0.2, y, LEG_M, at_s), (0.2, y, LEG_M, at_s)];
    assert!(Bench::new(ROOM).watch(3.0, |at_s| legs(at_s + 5.0, -1.8)).is_empty());
    assert_eq!(Bench::new(ROOM).watch(3.0, |at_s| legs(0.0, -2.2 + 0.2 * at_s)).len(), 1);
}

#[test]
fn what_stirs_where_no_person_came_in_is_a_person_and_a_chair_is_not() {
    let chair = |at_s: f64| vec![(0.0, 0.5, TORSO_M, at_s)];
    assert!(Bench::new(ROOM).watch(12.0, chair).is_empty());
    let person = |at_s: f64| vec![(0.0, 0.5, TORSO_M, libm::fmod(at_s, 1.5))];
    assert_eq!(Bench::new(ROOM).watch(12.0, person).len(), 1);
    // A person passes before the chair, and the chair is detected anew.
    let passed = |at_s: f64| {
        let shown_s = libm::fmod(at_s, 1.5);
        if shown_s < 1.2 { vec![(0.0, 0.5, TORSO_M, shown_s)] } else { Vec::new() }
    };
    assert!(Bench::new(ROOM).watch(12.0, passed).is_empty());
}

#[test]
fn a_reflection_is_shown_and_never_anybody() {
    let mut bench = Bench::new("[[wall]]\npoints = [[-2, 0], [2, 0]]\nmirror = true");
    assert!(bench.watch(5.0, |at_s| vec![(0.0, 0.5 + 0.1 * at_s, TORSO_M, 0.0)]).is_empty());
    let [shown] = bench.tracker.tracks(bench.now_s)[..] else { panic!("one reflection") };
    assert_eq!((shown.state, shown.existence), (LifeCycle::Tentative, 0.0));
    assert!(shown.reason.contains("reflection") && (shown.at - Point::new(0.0, 1.0)).length() < 0.05);
    assert!(bench.watch(1.0, |_| Vec::new()).is_empty() && bench.tracker.tracks(bench.now_s).is_empty());
}

#[test]
fn after_an_edit_a_module_goes_on_under_its_new_number_and_one_that_was_moved_begins_anew() {
    let mut bench = Bench::new(ROOM);
    let walks_in = |at_s: f64| vec![(0.0, -3.0 + at_s, TORSO_M, 0.0)];
    let before = bench.watch(3.0, walks_in);
    assert_eq!(before.len(), 1);
    let at = |y: f64| format!("\n[[module]]\nname = 'm'\nx = 0\ny = {y:?}\nyaw_deg = 90");
    let site = |text: &str| -> Site { toml::from_str(&(ROOM.to_owned() + text)).unwrap() };
    let was = site(&at(-4.0));
    let now = site(&format!("\n[[module]]\nname = 'new'\nx = 3\ny = 0{}", at(-4.0)));
    assert!(bench.tracker.change_site(&SiteChange { before: &was, now: &now }));
    bench.view = Arc::new(View { module: 1, ..(*bench.view).clone() });
    assert!(bench.tracker.tracks[0].known_to(1) && !bench.tracker.tracks[0].known_to(0));
    let after = bench.watch(0.5, |at_s| walks_in(3.0 + at_s));
    assert_eq!((after.len(), after[0].id), (1, before[0].id));
    assert!(BEGINNING_S < bench.now_s - bench.tracker.modules[1].since_s, "it was heard all the time");
    let moved = site(&format!("\n[[module]]\nname = 'new'\nx = 3\ny = 0{}", at(-3.5)));
    assert!(bench.tracker.change_site(&SiteChange { before: &now, now: &moved }));
    assert!(!bench.tracker.modules[1].since_s.is_finite() && !bench.tracker.tracks[0].known_to(1));
}
