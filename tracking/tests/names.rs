//! Signs never move a track: whatever is read, whenever and wherever, the tracks are the same bit by bit.
#![allow(missing_docs, reason = "a test program")]

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use kehai::candidate::Candidate;
use kehai::scan::{Geometry, URG_04LX};
use kehai_tracking::card::Card;
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::names::{Names, Read, Sign};
use kehai_tracking::observation::{Detection, Observation, View};
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::{Estimate, SiteTracker};
use kehai_tracking::tracker::{Ideas, TrackState};
use nalgebra::{Matrix2, Vector2};
use proptest::prelude::*;

const SCAN_S: f64 = 0.1;

/// One module at (0, −4) that looks along y.
fn site() -> Arc<Site> {
    let text = "[[module]]\nname = \"m\"\nx = 0.0\ny = -4.0\nyaw_deg = 90.0\n
        [[zone]]\nname = \"hall\"\npolygon = [[-2, -2], [2, -2], [2, 2], [-2, 2]]\n
        [[reader]]\nname = \"gate\"\nx = 0.0\ny = 0.0\nreach_m = 1.0\n";
    Arc::new(Site::parse("test.toml", text).unwrap())
}

fn observation(view: &Arc<View>, start_s: f64, places: &[(f64, f64)]) -> Observation {
    let seen = |&(x, y): &(f64, f64)| {
        let (at, half) = (Point::new(x, y), Point::new(0.2, 0.0));
        Detection {
            candidate: Candidate { near_mm: 1000, ..Candidate::default() },
            at_s: start_s,
            centre: Vector2::new(x, y),
            covariance: Matrix2::identity() * 0.0009,
            outline: [at - half, at, at + half],
            width_m: 0.4,
            size: None,
        }
    };
    let background_mm = vec![9000; usize::from(view.geometry.beams())];
    Observation {
        view: Arc::clone(view),
        start_s,
        detections: places.iter().map(seen).collect(),
        empty_mm: Vec::new(),
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

/// What is known at each tenth of a second while two people walk about, with these signs or without any.
fn tracked(walks: &[(f64, f64)], signs: Option<&[(f64, f64, f64, u8)]>) -> Vec<Estimate> {
    let site = site();
    let geometry = Geometry::new(URG_04LX).unwrap();
    let pose = Pose { at: Point::new(0.0, -4.0), yaw_rad: FRAC_PI_2 };
    let view = Arc::new(View { module: 0, pose, height_m: 0.6, geometry });
    let mut site_tracker = SiteTracker::new(&site, Ideas::default());
    let mut names = Names::default();
    let mut known = Vec::new();
    for (tenth, &(x, y)) in (0..).zip(walks) {
        let now_s = 20.0 + SCAN_S * f64::from(tenth);
        site_tracker.observe(&observation(&view, now_s, &[(x, y), (-x, 0.5 - y)]));
        let estimate = site_tracker.estimate(now_s);
        if let Some(&(x, y, sigma_m, id)) = signs.and_then(|signs| signs.get(tenth as usize)) {
            names.follow(&estimate.tracks, estimate.t_s);
            let read = match id % 3 {
                0 => Read::Somewhere,
                1 => Read::Near { at: Point::new(x, y), reach_m: sigma_m },
                _ => {
                    let variance_m2 = sigma_m * sigma_m;
                    Read::Place { at: Point::new(x, y), covariance_m2: [variance_m2, 0.0, variance_m2] }
                }
            };
            let _ = names.sign(&Sign { card: Card(u128::from(id)), at_s: now_s - sigma_m % 1.0, read });
        }
        known.push(estimate);
    }
    known
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]
    #[test]
    fn tracks_with_and_without_signs_are_the_same_bit_by_bit(
        start in (0.3..1.5_f64, -1.5..1.5_f64),
        signs in proptest::collection::vec((-2.0..2.0_f64, -2.0..2.0_f64, prop_oneof![0.01..2.0_f64, any::<f64>()], any::<u8>()), 60),
    ) {
        let walks: Vec<(f64, f64)> =
            (0..60).map(|tenth| (start.0 - 0.03 * f64::from(tenth), start.1 * (0.1 * f64::from(tenth)).cos())).collect();
        let (without, with) = (tracked(&walks, None), tracked(&walks, Some(&signs)));
        prop_assert!(without.iter().any(|estimate| !estimate.tracks.is_empty()));
        for (one, other) in without.iter().zip(&with) {
            prop_assert_eq!(bits(&one.tracks), bits(&other.tracks));
            prop_assert_eq!(&one.zones, &other.zones);
        }
    }
}
