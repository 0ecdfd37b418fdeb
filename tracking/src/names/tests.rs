//! Names follow signs and tracks, fade, mix where tracks touch, and stay within their bounds.

use proptest::prelude::*;

use std::slice;

use super::*;
use crate::card::Card;
use crate::explanation::Explanation;
use crate::geometry::Point;
use crate::site::Site;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

const ALICE: Card = Card(0xa11c_e000_0000_0000_0000_0000_0000_0000);
const BOB: Card = Card(0xb0b0_0000_0000_0000_0000_0000_0000_0000);

/// Spread of a measured track's place, m.
const SIGMA_M: f64 = 0.05;

fn track(id: TrackId, x: f64, y: f64) -> TrackState {
    TrackState {
        id,
        at: Point::new(x, y),
        velocity: Point::default(),
        covariance_m2: [SIGMA_M * SIGMA_M, 0.0, SIGMA_M * SIGMA_M],
        state: LifeCycle::Confirmed,
        existence: 1.0,
        reason: "",
        origin: Origin::Entered,
    }
}

fn sign(card: Card, at_s: f64, x: f64, y: f64) -> Sign {
    Sign { card, at_s, read: Read::Place { at: Point::new(x, y), covariance_m2: [0.04, 0.0, 0.04] } }
}

fn known(names: &Names, card: Card, track: TrackId) -> f64 {
    let line = names.lines(&Site::default()).into_iter().find(|line| line.card == Some(card));
    let tracks = line.map(|line| line.tracks).unwrap_or_default();
    tracks
        .iter()
        .find(|likelihood| likelihood.track == track)
        .map_or(0.0, |likelihood| likelihood.probability)
}

/// Frame by frame from `from_s` for `seconds`.
fn pass(names: &mut Names, tracks: &[TrackState], from_s: f64, seconds: f64) {
    for frame in 1..=(seconds * 10.0).round() as u32 {
        names.follow(tracks, from_s + f64::from(frame) * 0.1);
    }
}

/// Two people 2 m apart, each read once.
fn two() -> (Names, [TrackState; 2]) {
    let tracks = [track(1, 0.0, 0.0), track(2, 2.0, 0.0)];
    let mut names = Names::default();
    names.follow(&tracks, 0.0);
    names.sign(&sign(ALICE, 0.0, 0.1, 0.0)).unwrap();
    names.sign(&sign(BOB, 0.0, 1.9, 0.1)).unwrap();
    (names, tracks)
}

#[test]
fn a_sign_names_the_track_at_its_place_and_says_where_that_is() {
    let (names, _) = two();
    assert!(
        known(&names, ALICE, 1) > 0.9 && known(&names, BOB, 2) > 0.9,
        "{:?}",
        names.lines(&Site::default())
    );
    assert_eq!((known(&names, ALICE, 2), known(&names, BOB, 1)), (0.0, 0.0));
    let site = "[[zone]]\nname = \"hall\"\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]";
    let site = Site::parse("x.toml", site).unwrap();
    let alice = names.where_is(ALICE, &site).unwrap();
    assert_eq!((alice.at, alice.name.zones), (Some([0.0, 0.0]), vec!["hall".to_owned()]));
    assert_eq!((alice.read, alice.name.read_s), (Some([0.1, 0.0]), Some(0.0)));
    assert_eq!(alice.name.label, "a11ce000");
    assert_eq!(names.where_is(BOB, &site).unwrap().name.zones, Vec::<String>::new());
    assert_eq!(names.where_is(Card(7), &site), None);
}

#[test]
fn two_signs_overturn_a_certainty_and_one_does_not() {
    let (mut names, tracks) = two();
    for tenth in 1..20 {
        names.follow(&tracks, f64::from(tenth) * 0.1);
        names.sign(&sign(ALICE, f64::from(tenth) * 0.1, 0.0, 0.0)).unwrap();
    }
    assert!(known(&names, ALICE, 1) > 0.99);
    names.sign(&sign(ALICE, 1.9, 2.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 1) > 0.5, "{:?}", names.lines(&Site::default()));
    names.sign(&sign(ALICE, 1.9, 2.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 2) > 0.9, "{:?}", names.lines(&Site::default()));
    assert!(known(&names, BOB, 2) > 0.9, "an ID knows nothing of another");
}

#[test]
fn what_is_known_halves_in_ten_minutes_and_is_read_again() {
    let (mut names, tracks) = two();
    let before = known(&names, ALICE, 1);
    pass(&mut names, &tracks, 0.0, 600.0);
    let after = known(&names, ALICE, 1);
    assert!((after - 0.5 * before).abs() < 0.01, "{before} {after}");
    names.sign(&sign(ALICE, 600.0, 0.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 1) > 0.95);
}

#[test]
fn tracks_that_touch_become_alike_and_nothing_is_lost() {
    let (mut names, _) = two();
    let near = |apart_m| [track(1, 0.0, 0.0), track(2, apart_m, 0.0)];
    pass(&mut names, &near(0.6), 0.0, 10.0);
    assert!(
        known(&names, ALICE, 1) > 0.85,
        "0.6 m apart they are told apart: {:?}",
        names.lines(&Site::default())
    );
    pass(&mut names, &near(0.2), 10.0, 0.3);
    assert!(
        known(&names, ALICE, 1) > 0.75,
        "in passing hardly anything is lost: {:?}",
        names.lines(&Site::default())
    );
    pass(&mut names, &near(0.2), 10.3, 10.0);
    let (one, other) = (known(&names, ALICE, 1), known(&names, ALICE, 2));
    assert!((one - other).abs() < 0.02 && one + other > 0.9, "{one} {other}");
    pass(&mut names, &near(2.0), 20.3, 2.0);
    assert!(known(&names, ALICE, 1) < 0.6, "apart again they stay alike");
    names.sign(&sign(ALICE, 22.3, 2.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 2) > 0.9);
}

#[test]
fn hidden_tracks_mix_by_what_is_known_of_their_places() {
    let hidden = |id, x, sigma_m: f64| TrackState {
        covariance_m2: [sigma_m * sigma_m, 0.0, sigma_m * sigma_m],
        state: LifeCycle::Occluded,
        ..track(id, x, 0.0)
    };
    let alike = |apart_m, sigma_m| {
        let (mut names, _) = two();
        pass(&mut names, &[hidden(1, 0.0, sigma_m), hidden(2, apart_m, sigma_m)], 0.0, 5.0);
        known(&names, ALICE, 2)
    };
    assert!(alike(0.8, 0.3) > 0.1, "behind the same pillar");
    assert!(alike(3.0, 0.3) < 0.01, "behind two pillars");
    assert!(alike(2.0, 3.0) < 0.05, "anywhere in a room they are hardly ever at one place");
}

#[test]
fn two_side_by_side_keep_their_names_while_both_are_seen() {
    let alike = |state: LifeCycle| {
        let (mut names, _) = two();
        let person = |id, x| TrackState { state, ..track(id, x, 0.0) };
        pass(&mut names, &[person(1, 0.0), person(2, 0.6)], 0.0, 5.0);
        known(&names, ALICE, 2)
    };
    let (seen, hidden) = (alike(LifeCycle::Confirmed), alike(LifeCycle::Occluded));
    assert!(seen < 0.05 && hidden > 0.1, "{seen} {hidden}");
    // By their feet two are not told apart so near, in any explanation.
    let (mut names, _) = two();
    let people = vec![track(1, 0.0, 0.0), track(2, 0.6, 0.0)];
    let explanation = Explanation { line: vec![1], surprise: 0.0, people: people.clone() };
    for step in 1..=50 {
        names.follow_explained(&people, slice::from_ref(&explanation), f64::from(step) * 0.1);
    }
    let by_feet = known(&names, ALICE, 2);
    assert!(by_feet > 0.1, "{by_feet}");
}

#[test]
fn a_track_that_is_gone_takes_its_name_with_it_and_a_new_one_gets_it_by_a_sign() {
    let (mut names, tracks) = two();
    pass(&mut names, &tracks[1..], 0.0, 1.0);
    let site = Site::default();
    let alice = names.where_is(ALICE, &site).unwrap();
    assert_eq!((alice.name.tracks, alice.at, alice.read), (vec![], None, Some([0.1, 0.0])));
    let new = [track(3, 0.0, 0.0), tracks[1]];
    pass(&mut names, &new, 1.0, 0.1);
    names.sign(&sign(ALICE, 1.1, 0.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 3) > 0.9);
    pass(&mut names, &[], 1.1, 1.0);
    names.follow(&[], 3000.0);
    assert!(names.where_is(ALICE, &site).is_some(), "it was read within the hour");
    names.follow(&[], 3700.0);
    assert_eq!(names.where_is(ALICE, &site), None);
}

#[test]
fn a_late_sign_is_compared_with_where_the_tracks_were() {
    let mut names = Names::default();
    // One walks to the right at 1.5 m/s, and another follows, 1.5 m behind.
    let at = |at_s: f64| {
        let walker = |id, x| TrackState { velocity: Point::new(1.5, 0.0), ..track(id, x, 0.0) };
        [walker(1, 1.5 * at_s), walker(2, 1.5 * at_s - 1.5)]
    };
    for tenth in 0..=30 {
        names.follow(&at(f64::from(tenth) * 0.1), f64::from(tenth) * 0.1);
    }
    names.sign(&sign(ALICE, 1.95, 2.92, 0.0)).unwrap();
    assert!(known(&names, ALICE, 1) > 0.9, "{:?}", names.lines(&Site::default()));
    assert_eq!(names.sign(&sign(ALICE, 0.0, 0.0, 0.0)), Err(NotTaken::Untracked));
    assert_eq!(names.sign(&sign(ALICE, 9.0, 0.0, 0.0)), Err(NotTaken::Untracked));
    assert_eq!(names.sign(&sign(ALICE, f64::NAN, 0.0, 0.0)), Err(NotTaken::Untracked));
    assert_eq!(Names::default().sign(&sign(ALICE, 0.0, 0.0, 0.0)), Err(NotTaken::Untracked));
}

#[test]
fn a_tag_that_lies_on_a_table_is_no_track() {
    let (mut names, tracks) = two();
    pass(&mut names, &tracks, 0.0, 1.0);
    for _ in 0..5 {
        names.sign(&sign(ALICE, 1.0, 0.0, 4.0)).unwrap();
    }
    let alice = names.where_is(ALICE, &Site::default()).unwrap();
    assert_eq!(alice.name.tracks, [], "{alice:?}");
    assert_eq!(alice.read, Some([0.0, 4.0]));
    // Taken up again, it is known after three readings.
    for _ in 0..3 {
        names.sign(&sign(ALICE, 1.0, 2.0, 0.0)).unwrap();
    }
    assert!(known(&names, ALICE, 2) > 0.9, "{:?}", names.lines(&Site::default()));
}

#[test]
fn a_sign_that_was_overtaken_is_not_where_an_id_was_read_last() {
    let (mut names, tracks) = two();
    pass(&mut names, &tracks, 0.0, 1.0);
    names.sign(&sign(ALICE, 1.0, 0.2, 0.0)).unwrap();
    names.sign(&sign(ALICE, 0.5, -0.4, 0.0)).unwrap();
    let alice = names.where_is(ALICE, &Site::default()).unwrap();
    assert_eq!((alice.read, alice.name.read_s), (Some([0.2, 0.0]), Some(0.0)));
}

#[test]
fn what_was_read_somewhere_is_here_and_no_track() {
    let (mut names, _) = two();
    let before = known(&names, ALICE, 1);
    let somewhere = |card| Sign { card, at_s: 0.0, read: Read::Somewhere };
    names.sign(&somewhere(Card(5))).unwrap();
    names.sign(&somewhere(ALICE)).unwrap();
    assert_eq!(known(&names, ALICE, 1), before);
    let never = names.where_is(Card(5), &Site::default()).unwrap().name;
    assert_eq!((never.read_s, never.tracks), (None, vec![]), "nothing weighed so far");
}

#[test]
fn wheels_have_no_name_and_what_hardly_exists_hardly_any() {
    let wheels = TrackState { origin: Origin::PartOf(1), ..track(2, 0.1, 0.0) };
    let reflection = TrackState { existence: 0.0, ..track(3, 0.0, 0.1) };
    let mut names = Names::default();
    names.follow(&[track(1, 0.3, 0.0), wheels, reflection], 0.0);
    names.sign(&sign(ALICE, 0.0, 0.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 1) > 0.8, "{:?}", names.lines(&Site::default()));
    assert_eq!((known(&names, ALICE, 2), known(&names, ALICE, 3)), (0.0, 0.0));
}

/// Two at 0 and 2 m, by this explanation and those that it grew out of; or each at the other's place.
fn explained(line: &[u64], is_swapped: bool, surprise: f64) -> Explanation {
    let places = if is_swapped { [2.0, 0.0] } else { [0.0, 2.0] };
    let people = vec![track(1, places[0], 0.0), track(2, places[1], 0.0)];
    Explanation { line: line.to_vec(), surprise, people }
}

/// Names of [`two`], and at 0.1 s the explanation of before and one that grew out of it, with both at each other's places.
fn two_or_swapped() -> (Names, [Explanation; 2]) {
    let (mut names, tracks) = two();
    let both = [explained(&[4], false, 0.0), explained(&[7, 4], true, 1.0)];
    names.follow_explained(&tracks, &both[..1], 0.05);
    names.follow_explained(&tracks, &both, 0.1);
    (names, both)
}

#[test]
fn the_name_of_one_who_was_read_says_who_the_other_is() {
    let (mut names, both) = two_or_swapped();
    assert!(known(&names, ALICE, 1) > 0.9 && known(&names, BOB, 2) > 0.9, "the likeliest by what was seen");
    names.sign(&sign(ALICE, 0.1, 2.0, 0.0)).unwrap();
    assert!(known(&names, ALICE, 2) > 0.9, "{:?}", names.lines(&Site::default()));
    assert!(
        known(&names, BOB, 1) > 0.9,
        "where the swapped one has Bob: {:?}",
        names.lines(&Site::default())
    );
    // That one becomes the likeliest, and two tracks change places: their names stay where they are.
    let [_, swapped] = both;
    names.follow_explained(&swapped.people, &[Explanation { surprise: 0.0, ..swapped.clone() }], 0.2);
    assert!(known(&names, ALICE, 1) > 0.9 && known(&names, BOB, 2) > 0.9);
    assert_eq!(names.where_is(BOB, &Site::default()).unwrap().at, Some([0.0, 0.0]));
}

#[test]
fn what_was_seen_weighs_as_much_as_what_was_read() {
    let (mut names, _) = two();
    let tracks = explained(&[4], false, 0.0).people;
    let both = [explained(&[4], false, 0.0), explained(&[7, 4], true, 9.0)];
    names.follow_explained(&tracks, &both[..1], 0.05);
    names.follow_explained(&tracks, &both, 0.1);
    names.sign(&sign(ALICE, 0.1, 2.0, 0.0)).unwrap();
    assert!(known(&names, BOB, 2) > 0.9, "one sign in a hundred is wrong, and one step in 8000 is such");
}

#[test]
fn an_explanation_of_which_no_elder_is_known_has_the_names_of_the_likeliest() {
    let (mut names, _) = two_or_swapped();
    names.sign(&sign(ALICE, 0.1, 2.0, 0.0)).unwrap();
    let other = explained(&[30, 20], true, 0.0);
    names.follow_explained(&other.people, slice::from_ref(&other), 0.2);
    assert!(known(&names, ALICE, 1) > 0.9, "{:?}", names.lines(&Site::default()));
    // So have tracks of a site whose floors are gone.
    names.follow(&other.people, 0.3);
    assert!(known(&names, ALICE, 1) > 0.9 && known(&names, BOB, 2) > 0.9);
}

#[test]
fn a_late_sign_meets_the_people_of_the_explanation_that_it_grew_out_of() {
    let (mut names, tracks) = two();
    names.follow_explained(&tracks, &[explained(&[4], false, 0.0)], 0.1);
    // A second later both have changed places by explanation 7, which was 4 when the sign was read.
    let both = [explained(&[4], false, 0.0), explained(&[7, 4], true, 0.0)];
    for tenth in 2..=11 {
        names.follow_explained(&tracks, &both, 0.1 * f64::from(tenth));
    }
    names.sign(&sign(ALICE, 0.1, 0.0, 0.0)).unwrap();
    let swapped = explained(&[7, 4], true, 0.0);
    names.follow_explained(&swapped.people, slice::from_ref(&swapped), 1.2);
    assert!(
        known(&names, ALICE, 1) > 0.9 && known(&names, BOB, 2) > 0.9,
        "{:?}",
        names.lines(&Site::default())
    );
}

#[test]
fn with_one_explanation_all_is_as_with_none() {
    let (mut plain, tracks) = two();
    let mut names = plain.clone();
    for tenth in 1..=20 {
        let at_s = 0.1 * f64::from(tenth);
        plain.follow(&tracks, at_s);
        names.follow_explained(&tracks, &[explained(&[4], false, 0.0)], at_s);
        for (card, x) in [(ALICE, 0.3), (BOB, 1.2)] {
            plain.sign(&sign(card, at_s, x, 0.1)).unwrap();
            names.sign(&sign(card, at_s, x, 0.1)).unwrap();
        }
        assert_eq!(names.lines(&Site::default()), plain.lines(&Site::default()));
    }
}

#[test]
fn however_many_ids_and_tracks_there_are_memory_is_bounded() {
    let mut names = Names::default();
    let crowd: Vec<TrackState> = (1..=1000).map(|id| track(id, 0.001 * id as f64, 0.0)).collect();
    names.follow(&crowd, 0.0);
    let taken = (0..1000_u128).filter(|id| names.sign(&sign(Card(*id), 0.0, 0.1, 0.0)).is_ok()).count();
    assert_eq!((taken, names.lines(&Site::default()).len()), (256, 256));
    assert_eq!(names.sign(&sign(Card(999), 0.0, 0.1, 0.0)), Err(NotTaken::Full));
    assert!(names.lines(&Site::default()).iter().all(|line| line.tracks.len() <= 16));
    // All with a share of a track, so that none is forgotten: the one that was read first gives way.
    let alone = [track(1, 0.0, 0.0)];
    let mut names = Names::default();
    names.follow(&alone, 0.0);
    (0..256_u128).for_each(|id| names.sign(&sign(Card(id), 0.0, 0.0, 0.0)).unwrap());
    names.follow(&alone, 3601.0);
    assert_eq!(names.lines(&Site::default()).len(), 256);
    assert_eq!(names.sign(&sign(Card(999), 3601.0, 0.0, 0.0)), Ok(()));
    assert_eq!(names.lines(&Site::default()).len(), 256);
}

proptest! {
    #[test]
    fn whatever_comes_likelihoods_are_likelihoods(
        steps in proptest::collection::vec(
            (any::<u8>(), any::<f64>(), any::<f64>(), any::<f64>(), any::<[f64; 3]>(), 0..6_u64), 1..60
        )
    ) {
        let mut names = Names::default();
        let mut now_s = 0.0;
        for (what, time, x, y, covariance_m2, id) in steps {
            let small = |value: f64| if what & 64 == 0 { value % 3.0 } else { value };
            let at = Point::new(small(x), small(y));
            match what % 3 {
                0 => {
                    now_s += if what & 128 == 0 { (time % 1.0).abs() } else { time };
                    let other = track(id + 1, y % 2.0, x % 2.0);
                    let tracks = [TrackState { at, covariance_m2, existence: time, ..track(id, 0.0, 0.0) }, other];
                    let of = |number: u64| Explanation {
                        line: vec![number, number / 2],
                        surprise: if number == id { 0.0 } else { covariance_m2[0] },
                        people: tracks[..usize::from(what % 3)].to_vec(),
                    };
                    let explanations: Vec<Explanation> = (id..id + u64::from(what % 4)).map(of).collect();
                    names.follow_explained(&tracks, &explanations, now_s);
                }
                1 => drop(names.sign(&Sign { card: Card(u128::from(id)), at_s: now_s, read: Read::Place { at, covariance_m2 } })),
                _ => drop(names.sign(&Sign { card: Card(1), at_s: now_s, read: Read::Near { at, reach_m: time } })),
            }
            for line in names.lines(&Site::default()) {
                let sum: f64 = line.tracks.iter().map(|likelihood| likelihood.probability).sum();
                prop_assert!((0.0..=1.002).contains(&sum) && line.heard_s >= 0.0, "{line:?}");
                prop_assert!(line.tracks.iter().all(|likelihood| (0.0..=1.0).contains(&likelihood.probability)));
            }
        }
    }
}
