//! Signs never move a track: whatever is read, whenever and wherever, the tracks are the same bit by bit.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/scene.rs"]
#[allow(dead_code, reason = "the people of other tests")]
mod scene;
#[path = "intake/tracker.rs"]
mod tracker;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai::floor::Bits;
use kehai::scan::Geometry;
use kehai_tracking::card::Card;
use kehai_tracking::estimate::Estimate;
use kehai_tracking::floor::{Plan, Reading};
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::names::{Names, Read, Sign, SignCounts};
use kehai_tracking::observation::{Detection, Observation, View};
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::TrackState;
use proptest::prelude::*;
use scene::{BEAMS, silhouettes};
use tracker::tracker;

const SCAN_S: f64 = 0.1;

/// One module at (0, −4) that looks along y.
fn site() -> Arc<Site> {
    let text = "[[module]]\nname = \"m\"\nx = 0.0\ny = -4.0\nyaw_deg = 90.0\n
        [[zone]]\nname = \"hall\"\npolygon = [[-2, -2], [2, -2], [2, 2], [-2, 2]]\n
        [[reader]]\nname = \"gate\"\nx = 0.0\ny = 0.0\nreach_m = 1.0\n";
    Arc::new(Site::parse("test.toml", text).unwrap())
}

fn observation(view: &Arc<View>, start_s: f64, places: &[(f64, f64)]) -> Observation {
    let bodies = places.iter().map(|&(x, y)| Point::new(x, y));
    let seen = silhouettes(bodies, view.pose, BEAMS);
    let detections =
        seen.into_iter().map(|seen| Detection::new(seen, view, start_s, Estimator::default())).collect();
    let background_mm = vec![9000; usize::from(view.geometry.beams())];
    Observation {
        view: Arc::clone(view),
        start_s,
        detections,
        empty_mm: background_mm.clone(),
        background_mm: background_mm.into(),
    }
}

/// Every number of a track, as bits.
fn bits(tracks: &[TrackState]) -> Vec<(u64, Vec<u64>, String)> {
    let of = |track: &TrackState| {
        let [xx, xy, yy] = track.covariance_m2;
        let TrackState { at, velocity, existence, .. } = *track;
        let numbers = [at.x, at.y, velocity.x, velocity.y, xx, xy, yy, existence].map(f64::to_bits);
        (track.id, numbers.to_vec(), format!("{:?} {:?} {}", track.state, track.origin, track.reason))
    };
    tracks.iter().map(of).collect()
}

/// A sign: a place, a spread or reach, m; how long ago it was read, s; and whose it is.
type Said = (f64, f64, f64, f64, u8);

/// What is known at each tenth of a second while two people walk about, with these signs or without any; and what became of the
/// signs.
fn tracked(walks: &[(f64, f64)], signs: Option<&[Said]>) -> (Vec<Estimate>, SignCounts) {
    let site = site();
    let geometry = Geometry::new(BEAMS).unwrap();
    let pose = Pose { at: Point::new(0.0, -4.0), yaw_rad: FRAC_PI_2 };
    let view = Arc::new(View { module: 0, pose, height_m: 0.6, geometry, upside_down: false });
    let mut site_tracker = SiteTracker::new(&site, tracker());
    let mut names = Names::default();
    let (mut known, mut counts) = (Vec::new(), SignCounts::default());
    for (tenth, &(x, y)) in (0..).zip(walks) {
        let now_s = 20.0 + SCAN_S * f64::from(tenth);
        site_tracker.observe(&observation(&view, now_s, &[(x, y), (-x, 0.5 - y)]));
        let estimate = site_tracker.estimate(now_s);
        if let Some(&(x, y, sigma_m, ago_s, id)) = signs.and_then(|signs| signs.get(tenth as usize)) {
            names.follow(&estimate.tracks, estimate.t_s);
            let read = match id % 3 {
                0 => Read::Somewhere,
                1 => Read::Near { at: Point::new(x, y), reach_m: sigma_m },
                _ => {
                    let variance_m2 = sigma_m * sigma_m;
                    Read::Place { at: Point::new(x, y), covariance_m2: [variance_m2, 0.0, variance_m2] }
                }
            };
            let taken = names.sign(&Sign { card: Card(u128::from(id)), at_s: now_s - ago_s, read });
            let can_be = |metres: f64| metres.abs() <= 10_000.0;
            let says_a_place = read != Read::Somewhere;
            assert!(taken.is_err() || !says_a_place || (can_be(x) && can_be(y)), "{read:?}");
            assert!(taken.is_err() || ago_s.abs() < 60.0, "{ago_s} s ago: {read:?}");
            counts.count(&taken);
        }
        known.push(estimate);
    }
    (known, counts)
}

/// What is known at each reading of a floor on which two walk past each other, a step each four readings; with these signs
/// or without any.
fn on_a_floor(apart_m: f64, signs: Option<&[Said]>) -> Vec<Estimate> {
    let text = "[[floor]]\nname = \"mat\"\nx = -0.96\ny = -0.96\ncolumns = 24\nrows = 24\n";
    let site = Arc::new(Site::parse("test.toml", text).unwrap());
    let plan = Plan::from(&site.floors[0]);
    let mut site_tracker = SiteTracker::new(&site, tracker());
    let mut names = Names::default();
    let mut known = Vec::new();
    for tick in 0..60_u32 {
        let at_s = 20.0 + f64::from(tick) / 9.0;
        let mut down = Bits::default();
        let is_down = |at: Point, foot: Point| (at - foot).length() < 0.11;
        for (sense, y) in [(1.0, -0.5 * apart_m), (-1.0, 0.5 * apart_m)] {
            let step = |number: u32| {
                let side = if number.is_multiple_of(2) { 0.06 } else { -0.06 };
                // To and fro, half a metre a step.
                let along = (f64::from(number) * 0.5 - 0.75).rem_euclid(3.0);
                let x = if along < 1.5 { along - 0.75 } else { 2.25 - along };
                Point::new(sense * x, y + side)
            };
            let feet = [step(tick / 4), step((tick + 1) / 4)];
            for panel in
                (0..plan.panels()).filter(|panel| feet.iter().any(|foot| is_down(plan.middle(*panel), *foot)))
            {
                down.set(panel, true);
            }
        }
        site_tracker.read(&Reading { floor: 0, plan, at_s, down, faulty: Vec::new() });
        let estimate = site_tracker.estimate(at_s);
        if let Some(&(x, y, sigma_m, ago_s, id)) = signs.and_then(|signs| signs.get(tick as usize)) {
            names.follow_explained(&estimate.tracks, &estimate.explanations, at_s);
            let lines = names.lines(&site);
            for likelihood in lines.iter().flat_map(|line| &line.tracks) {
                let is_track = estimate.tracks.iter().any(|track| track.id == likelihood.track);
                assert!(is_track, "{likelihood:?} of {:?}", estimate.tracks);
            }
            let read = Read::Place {
                at: Point::new(x, y),
                covariance_m2: [sigma_m * sigma_m, 0.0, sigma_m * sigma_m],
            };
            let _ = names.sign(&Sign { card: Card(u128::from(id % 3)), at_s: at_s - ago_s, read });
        }
        known.push(estimate);
    }
    known
}

/// A number that may be absurd: none, infinite, enormous, or of another unit.
fn absurd() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>(),
        prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9, -1e9, 1200.0, f64::MAX])
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]
    #[test]
    fn tracks_with_and_without_signs_are_the_same_bit_by_bit(
        start in (0.3..1.5_f64, -1.5..1.5_f64),
        signs in proptest::collection::vec(
            (
                prop_oneof![2 => -2.0..2.0_f64, 1 => absurd()],
                prop_oneof![2 => -2.0..2.0_f64, 1 => absurd()],
                prop_oneof![2 => 0.01..2.0_f64, 1 => absurd()],
                prop_oneof![2 => 0.0..1.0_f64, 1 => absurd()],
                any::<u8>(),
            ),
            60,
        ),
    ) {
        let walks: Vec<(f64, f64)> =
            (0..60).map(|tenth| (start.0 - 0.03 * f64::from(tenth), start.1 * (0.1 * f64::from(tenth)).cos())).collect();
        let ((without, _), (with, counts)) = (tracked(&walks, None), tracked(&walks, Some(&signs)));
        let SignCounts { taken, no_place, untracked, .. } = counts;
        prop_assert_eq!(taken + no_place + untracked, signs.len() as u64, "{:?}", counts);
        prop_assert!(no_place > 0 && untracked > 0, "absurd places and times are refused: {:?}", counts);
        prop_assert!(without.iter().any(|estimate| !estimate.tracks.is_empty()));
        for (one, other) in without.iter().zip(&with) {
            prop_assert_eq!(bits(&one.tracks), bits(&other.tracks));
            prop_assert_eq!(&one.zones, &other.zones);
        }
    }

    #[test]
    fn explanations_of_a_floor_with_and_without_signs_are_the_same_bit_by_bit(
        apart_m in 0.3..0.8_f64,
        signs in proptest::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, 0.05..0.3_f64, 0.0..0.3_f64, any::<u8>()), 60),
    ) {
        let (without, with) = (on_a_floor(apart_m, None), on_a_floor(apart_m, Some(&signs)));
        prop_assert!(without.iter().any(|estimate| estimate.explanations.len() > 1), "two who pass");
        for (one, other) in without.iter().zip(&with) {
            prop_assert_eq!(bits(&one.tracks), bits(&other.tracks));
            let of = |estimate: &Estimate| estimate.explanations.iter().map(|one| {
                (one.line.clone(), one.surprise.to_bits(), bits(&one.people))
            }).collect::<Vec<_>>();
            prop_assert_eq!(of(one), of(other));
        }
    }
}
