//! The figures of small runs that can be judged by hand, and properties of all runs.

use proptest::collection::vec;
use proptest::prelude::*;

use kehai_tracking::geometry::Point;
use kehai_tracking::tracker::LifeCycle;

use super::frame::Judged;
use super::*;
use crate::run::SeenPerson;

/// People and tracks of one frame: number, x, y.
type Places = Vec<(u64, f64, f64)>;

fn tally(frames: &[(Places, Places)], settings: Settings) -> Tally {
    let mut scorer = Scorer::new(settings);
    for (index, (people, tracks)) in frames.iter().enumerate() {
        let truth: Vec<Target> = people
            .iter()
            .map(|&(id, x, y)| Target { id, at: Point::new(x, y), beams: Some((id * 6) as u32) })
            .collect();
        let tracks: Vec<Estimate> = tracks
            .iter()
            .map(|&(id, x, y)| Estimate {
                id,
                at: Point::new(x, y),
                covariance_m2: Some([0.01, 0.0, 0.01]),
                state: LifeCycle::Confirmed,
            })
            .collect();
        scorer.frame(&Frame { t_s: index as f64 * 0.1, truth: &truth, tracks: &tracks });
    }
    scorer.finish().0
}

fn figures(frames: &[(Places, Places)]) -> Figures {
    tally(frames, Settings::default()).figures()
}

fn close(value: Option<f64>, expected: f64) -> bool {
    value.is_some_and(|value| (value - expected).abs() < 1e-9)
}

#[test]
fn two_who_swap_their_tracks_cost_two_switches() {
    let straight = (vec![(1, 0.0, 0.0), (2, 1.0, 0.0)], vec![(5, 0.0, 0.0), (6, 1.0, 0.0)]);
    let swapped = (vec![(1, 0.0, 0.0), (2, 1.0, 0.0)], vec![(6, 0.0, 0.0), (5, 1.0, 0.0)]);
    let figures = figures(&[straight.clone(), straight.clone(), straight, swapped]);
    assert_eq!((figures.id_switches, figures.misses, figures.false_tracks), (2, 0, 0));
    assert!(close(figures.mota, 1.0 - 2.0 / 8.0) && close(figures.idf1, 0.75) && close(figures.motp_m, 0.0));
    assert!(close(figures.trajectory_precision, 0.75) && close(figures.trajectory_recall, 0.75));
    assert!(close(figures.det_a, 1.0) && close(figures.exact_count_rate, 1.0));
    // 6 pairs of frames with 3 of 4 + 4 − 3 together, 2 with 1 of 4 + 4 − 1.
    assert!(close(figures.ass_a, (6.0 * 3.0 / 5.0 + 2.0 / 7.0) / 8.0), "{:?}", figures.ass_a);
}

#[test]
fn a_track_is_kept_within_the_gate_though_another_is_nearer() {
    let one = (vec![(1, 0.0, 0.0)], vec![(5, 0.0, 0.0)]);
    let gap = (vec![(1, 0.0, 0.0)], vec![]);
    let two = (vec![(1, 0.0, 0.0)], vec![(5, 0.4, 0.0), (6, 0.0, 0.0)]);
    let figures = figures(&[one, gap, two]);
    assert_eq!((figures.id_switches, figures.misses, figures.false_tracks, figures.lost), (0, 1, 1, 1));
    assert!(close(figures.motp_m, 0.2));
    assert!(close(figures.over_count, 1.0 / 3.0) && close(figures.under_count, 1.0 / 3.0));
}

#[test]
fn gospa_is_position_missed_and_false() {
    let figures = figures(&[(vec![(1, 0.0, 0.0), (2, 5.0, 0.0)], vec![(5, 0.6, 0.0), (6, -4.0, 0.0)])]);
    assert!(close(figures.gospa_m, (0.36_f64 + 0.5 + 0.5).sqrt()), "{:?}", figures.gospa_m);
    assert!(close(figures.gospa_localisation_m2, 0.36) && close(figures.gospa_missed_m2, 0.5));
    assert!(close(figures.mota, -1.0), "0.6 m is beyond the gate: two misses and two false");
}

#[test]
fn errors_are_told_apart_by_who_is_seen() {
    // Person 1: 6 beams, person 2: 12.
    let figures = figures(&[(vec![(1, 0.0, 0.0), (2, 3.0, 0.0)], vec![(5, 0.3, 0.0), (6, 3.1, 0.0)])]);
    assert!(close(figures.rms_hidden_m, 0.3) && close(figures.rms_visible_m, 0.1));
    // 0.3 m at a standard deviation of 0.1 m is 9, 0.1 m is 1: one of two inside 5.99.
    assert!(close(figures.nees_coverage, 0.5) && close(figures.nees_mean, 5.0));
}

#[test]
fn a_covariance_that_is_none_is_outside_and_counted() {
    let mut nees = clear::Clear::default();
    let person = Target { id: 1, at: Point::new(0.0, 0.0), beams: None };
    let track = Estimate {
        id: 1,
        at: Point::new(0.0, 0.0),
        covariance_m2: Some([1.0, 2.0, 1.0]),
        state: LifeCycle::Occluded,
    };
    let judged = Judged { people: vec![0], tracks: vec![0], distances_m: vec![0.0] };
    nees.frame(&judged, &[person], &[track], 0.5);
    assert_eq!(nees.tally().nees, clear::Nees { pairs: 1, inside: 0, improper: 1, sum: 0.0 });
}

#[test]
fn no_people_and_no_tracks_are_no_figure_but_a_right_count() {
    let figures = figures(&[(vec![], vec![]), (vec![], vec![])]);
    assert_eq!((figures.mota, figures.idf1, figures.hota), (None, None, None));
    assert!(close(figures.exact_count_rate, 1.0) && close(figures.gospa_m, 0.0));
    assert_eq!(Scorer::new(Settings::default()).finish().0.figures().exact_count_rate, None);
}

/// A run in which all people walk at random and tracks follow some of them.
fn run() -> impl Strategy<Value = Vec<(Places, Places)>> {
    let places = || vec((0_u64..5, -2.0..2.0, -2.0..2.0), 0..5).prop_map(unique);
    let near = vec((0_u64..5, -0.6..0.6, -0.6..0.6), 0..5).prop_map(unique);
    vec((places(), near, places()), 1..12).prop_map(|frames| {
        frames
            .into_iter()
            .map(|(people, near, mut tracks)| {
                tracks.truncate(1);
                for (id, dx, dy) in near {
                    if let Some(person) = people.get(id as usize) {
                        tracks.push((id + 10, person.1 + dx, person.2 + dy));
                    }
                }
                (people, tracks)
            })
            .collect()
    })
}

fn unique(mut places: Places) -> Places {
    places.sort_by_key(|place| place.0);
    places.dedup_by_key(|place| place.0);
    places
}

fn same(one: &Figures, other: &Figures) -> bool {
    let json = |figures| serde_json::to_value::<&Figures>(figures).unwrap();
    let (one, other) = (json(one), json(other));
    one.as_object().unwrap().iter().all(|(name, value)| match (value.as_f64(), other[name].as_f64()) {
        (Some(value), Some(other)) => (value - other).abs() < 1e-9,
        (value, other) => value == other,
    })
}

proptest! {
    #[test]
    fn the_truth_itself_is_perfect(run in run()) {
        let run: Vec<_> = run.into_iter().map(|(people, _)| (people.clone(), people)).collect();
        let figures = figures(&run);
        let people = figures.people > 0;
        for value in [figures.mota, figures.idf1, figures.hota, figures.trajectory_precision, figures.trajectory_recall] {
            prop_assert!(close(value, 1.0) || !people && value.is_none(), "{value:?}");
        }
        prop_assert!(close(figures.gospa_m, 0.0) && figures.id_switches == 0);
    }

    #[test]
    fn figures_stay_in_their_ranges(run in run()) {
        let figures = figures(&run);
        for value in [
            figures.idf1, figures.hota, figures.det_a, figures.ass_a, figures.detection_f, figures.trajectory_precision,
            figures.trajectory_recall, figures.nees_coverage, figures.exact_count_rate,
        ].into_iter().flatten() {
            prop_assert!((0.0..=1.0 + 1e-12).contains(&value));
        }
        prop_assert!(figures.mota.is_none_or(|mota| mota <= 1.0));
        prop_assert!(figures.motp_m.is_none_or(|motp_m| motp_m <= 0.5));
        prop_assert!(figures.lost <= figures.misses);
    }

    #[test]
    fn names_and_place_do_not_matter(run in run(), x in -3.0..3.0) {
        let moved: Vec<_> = run.iter().map(|(people, tracks)| {
            let place = |names: u64| move |&(id, own, y): &(u64, f64, f64)| (id + names, own + x, y);
            // When two people claim one track, the first in the frame gets it: keep the order.
            (people.iter().map(place(100)).collect(), tracks.iter().map(place(77)).collect())
        }).collect();
        let (own, moved) = (figures(&run), figures(&moved));
        // Moving all people changes distances by rounding only; the beams come from the names.
        let plain = |figures: Figures| Figures {
            rms_visible_m: None, rms_hidden_m: None, visible_pairs: 0, hidden_pairs: 0, ..figures
        };
        prop_assert!(same(&plain(own), &plain(moved)));
    }

    #[test]
    fn one_false_track_more_is_never_better(run in run()) {
        let mut worse = run.clone();
        worse[0].1.push((99, 50.0, 50.0));
        let (own, worse) = (figures(&run), figures(&worse));
        prop_assert_eq!(worse.false_tracks, own.false_tracks + 1);
        for (own, worse) in [(own.mota, worse.mota), (own.idf1, worse.idf1), (own.hota, worse.hota)] {
            prop_assert!(worse.unwrap_or(0.0) <= own.unwrap_or(1.0) + 1e-12);
        }
        prop_assert!(worse.gospa_m > own.gospa_m);
    }

    #[test]
    fn a_region_that_holds_everything_changes_nothing(run in run()) {
        let region = Some("-9,-9,9,9".parse().unwrap());
        let all = tally(&run, Settings { region, ..Settings::default() });
        prop_assert_eq!(all, tally(&run, Settings::default()));
    }

    #[test]
    fn pooling_a_run_with_itself_leaves_the_means(run in run()) {
        let own = tally(&run, Settings::default());
        let mut pooled = own.clone();
        pooled += &own;
        let (own, pooled) = (own.figures(), pooled.figures());
        prop_assert_eq!(pooled.frames, 2 * own.frames);
        for (own, pooled) in [
            (own.mota, pooled.mota), (own.idf1, pooled.idf1), (own.hota, pooled.hota), (own.gospa_m, pooled.gospa_m),
            (own.trajectory_recall, pooled.trajectory_recall), (own.motp_m, pooled.motp_m),
        ] {
            prop_assert_eq!(own.is_some(), pooled.is_some());
            prop_assert!((own.unwrap_or(0.0) - pooled.unwrap_or(0.0)).abs() < 1e-12);
        }
    }
}

#[test]
fn truth_of_a_scene_is_the_truth_of_a_file() {
    let moment =
        crate::run::Moment { t: 1.5, people: vec![SeenPerson { id: 3, x: 1.0, y: -2.0, beams: 14 }] };
    let text = serde_json::to_string(&moment).unwrap();
    let line: kehai_tracking::jsonl::TruthLine = serde_json::from_str(&text).unwrap();
    assert_eq!(line.t, moment.t);
    assert_eq!(Target::from(&line.people[0]), Target::from(&moment.people[0]));
}
