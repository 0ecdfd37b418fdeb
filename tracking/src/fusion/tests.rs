use super::*;

fn track(id: TrackId, x: f64, state: LifeCycle) -> TrackState {
    let sigma_m = if state == LifeCycle::Occluded { 0.2 } else { 0.05 };
    TrackState {
        id,
        at: Point::new(x, 0.0),
        velocity: Point::default(),
        covariance_m2: [sigma_m * sigma_m, 0.0, sigma_m * sigma_m],
        state,
        existence: 1.0,
        reason: "",
        origin: Origin::Entered,
    }
}

fn seen(id: TrackId, x: f64) -> TrackState {
    track(id, x, LifeCycle::Confirmed)
}

/// The floor is where x is positive. No module looks before 5 m, and beyond all is seen to be empty.
const GROUND: Ground<'static> =
    Ground { is_floor: &|at| at.x > 0.0, sight: &|at| if at.x > 5.0 { Sight::Empty } else { Sight::None } };

fn people(fusion: &mut Fusion, tracks: &[TrackState], bodies: &[TrackState], at_s: f64) -> Vec<TrackState> {
    fusion.fuse(tracks, &[floors(bodies)], GROUND, at_s)
}

fn numbers(people: &[TrackState]) -> Vec<TrackId> {
    people.iter().map(|person| person.id).collect()
}

#[test]
fn a_person_keeps_the_number_onto_the_floor_behind_a_pillar_and_off_the_floor() {
    let mut fusion = Fusion::default();
    let mut steps = vec![(vec![seen(7, -0.5)], vec![])];
    steps.push((vec![seen(7, 0.2)], vec![seen(3, 0.3)]));
    steps.push((vec![track(7, 0.5, LifeCycle::Occluded)], vec![seen(3, 0.6)]));
    steps.push((vec![], vec![seen(3, 1.0)]));
    steps.push((vec![seen(9, 1.5)], vec![seen(3, 1.4)]));
    steps.push((vec![seen(9, 1.9)], vec![]));
    for (number, (tracks, bodies)) in (0..).zip(steps) {
        let found = people(&mut fusion, &tracks, &bodies, f64::from(number) * 0.1);
        assert_eq!(numbers(&found), [1], "step {number}");
    }
}

#[test]
fn two_who_are_far_apart_are_two_and_no_number_is_used_twice() {
    let mut fusion = Fusion::default();
    let both = people(&mut fusion, &[seen(1, 0.5)], &[seen(1, 0.55)], 0.0);
    assert_eq!(numbers(&both), [1]);
    // The body stays, and the track goes on: the number goes with the track.
    let apart = people(&mut fusion, &[seen(1, 2.5)], &[seen(1, 0.55)], 0.1);
    assert_eq!(numbers(&apart), [1, 2]);
    let others = people(&mut fusion, &[seen(1, 2.5), seen(2, 3.5)], &[seen(1, 0.55), seen(2, 4.9)], 0.2);
    assert_eq!(numbers(&others), [1, 3, 2, 4]);
}

#[test]
fn a_pair_stays_though_another_is_a_little_nearer() {
    let mut fusion = Fusion::default();
    let tracks = |x: f64| [seen(1, x), seen(2, x + 0.4)];
    people(&mut fusion, &tracks(0.5), &[seen(5, 0.5), seen(6, 0.9)], 0.0);
    people(&mut fusion, &tracks(0.5), &[seen(5, 0.72), seen(6, 0.68)], 0.1);
    assert_eq!(fusion.tracks[&1].body, Some(5));
    people(&mut fusion, &tracks(0.5), &[seen(5, 0.9), seen(6, 0.5)], 0.2);
    assert_eq!(fusion.tracks[&1].body, Some(6), "but not for ever");
}

#[test]
fn a_module_that_sees_a_person_knows_the_place_and_of_a_hidden_one_the_floor_has_a_say() {
    let mut fusion = Fusion::default();
    let one = |fusion: &mut Fusion, track, body| people(fusion, &[track], &[body], 0.0)[0];
    let in_view = one(&mut fusion, seen(1, 1.0), seen(1, 1.2));
    assert_eq!((in_view.at.x, in_view.state), (1.0, LifeCycle::Confirmed));
    let hidden = one(&mut fusion, track(1, 1.0, LifeCycle::Occluded), seen(1, 1.2));
    assert_eq!((hidden.state, hidden.reason), (LifeCycle::Confirmed, "hidden, on the floor"));
    // 0.2² against 0.05² + 0.4².
    let gain = 0.04 / (0.04 + 0.0025 + 0.16);
    assert!((hidden.at.x - (1.0 + 0.2 * gain)).abs() < 1e-9, "{hidden:?}");
    // What weighing leaves, and that the person may be over the feet instead.
    let off_m = 0.2 * (1.0 - gain);
    assert!((hidden.covariance_m2[0] - 0.04 * (1.0 - gain) - 0.5 * off_m * off_m).abs() < 1e-9, "{hidden:?}");
    let doubtful = one(&mut fusion, track(1, 1.0, LifeCycle::Tentative), seen(1, 1.1));
    assert_eq!((doubtful.at.x, doubtful.state), (1.0, LifeCycle::Confirmed));
}

#[test]
fn feet_beside_a_person_are_no_second_one_but_who_was_hidden_there_is() {
    let mut fusion = Fusion::default();
    let crowd = [seen(1, 0.5), seen(2, 0.9)];
    let third = people(&mut fusion, &crowd, &[seen(5, 0.5), seen(6, 0.9), seen(7, 1.3)], 0.0);
    assert_eq!(numbers(&third), [1, 2], "a foot of the second");
    let hidden = track(3, 1.3, LifeCycle::Occluded);
    let all =
        people(&mut fusion, &[crowd[0], crowd[1], hidden], &[seen(5, 0.5), seen(6, 0.9), seen(7, 1.3)], 0.1);
    assert_eq!(numbers(&all), [1, 2, 3]);
    // The tracker gives the hidden one up, where no module could have found it again.
    let kept = people(&mut fusion, &crowd, &[seen(5, 0.5), seen(6, 0.9), seen(7, 1.3)], 0.2);
    assert_eq!(numbers(&kept), [1, 2, 3]);
    // Where one looks, it knows better.
    let mut fusion = Fusion::default();
    let looked = Ground { sight: &|_| Sight::InView, ..GROUND };
    let bodies = floors(&[seen(5, 0.5), seen(6, 0.9), seen(7, 1.3)]);
    fusion.fuse(&[crowd[0], crowd[1], hidden], std::slice::from_ref(&bodies), looked, 0.0);
    assert_eq!(numbers(&fusion.fuse(&crowd, &[bodies], looked, 0.1)), [1, 2]);
}

#[test]
fn feet_of_a_person_who_has_left_are_those_of_the_person_beside_them() {
    let mut fusion = Fusion::default();
    let bodies = [seen(5, 0.5), seen(6, 1.3)];
    assert_eq!(numbers(&people(&mut fusion, &[seen(1, 0.5), seen(2, 1.3)], &bodies, 0.0)), [1, 2]);
    assert_eq!(numbers(&people(&mut fusion, &[seen(1, 0.5)], &bodies, 0.1)), [1]);
    // And those of the second, if nobody else is near.
    assert_eq!(numbers(&people(&mut fusion, &[seen(1, 0.3)], &bodies, 0.2)), [1, 2]);
}

#[test]
fn a_person_known_by_the_feet_alone_stays_while_another_passes_close_by() {
    let mut fusion = Fusion::default();
    assert_eq!(numbers(&people(&mut fusion, &[], &[seen(5, 2.0)], 0.0)), [1]);
    let close = people(&mut fusion, &[seen(7, 1.5)], &[seen(5, 2.0), seen(6, 1.5)], 0.1);
    assert_eq!(numbers(&close), [2, 1]);
}

#[test]
fn feet_where_a_module_sees_nothing_are_a_person_if_they_stay_for_a_second() {
    let mut fusion = Fusion::default();
    for tenth in 0..10 {
        assert_eq!(people(&mut fusion, &[], &[seen(5, 6.0)], f64::from(tenth) * 0.1).len(), 0);
    }
    assert_eq!(numbers(&people(&mut fusion, &[], &[seen(5, 6.0)], 1.0)), [1]);
    assert_eq!(numbers(&people(&mut fusion, &[], &[seen(5, 6.0)], 1.1)), [1], "and remain one");
    assert_eq!(
        numbers(&people(&mut fusion, &[], &[seen(5, 4.0), seen(8, 4.5)], 1.2)),
        [1, 2],
        "at once elsewhere"
    );
}

#[test]
fn a_track_keeps_its_number_on_the_feet_of_an_older_one() {
    let mut fusion = Fusion::default();
    people(&mut fusion, &[seen(1, 0.5), seen(2, 2.0)], &[seen(5, 0.5), seen(6, 2.0)], 0.0);
    people(&mut fusion, &[seen(2, 2.0)], &[seen(5, 0.5), seen(6, 2.0)], 0.1);
    let found = people(&mut fusion, &[seen(2, 0.5)], &[seen(5, 0.5)], 0.2);
    assert_eq!(numbers(&found), [2]);
}

#[test]
fn a_hidden_track_on_which_nothing_is_pressed_has_gone_after_a_second() {
    let mut fusion = Fusion::default();
    let on =
        |fusion: &mut Fusion, x: f64, state, at_s| people(fusion, &[track(1, x, state)], &[], at_s).len();
    for tenth in 0..10 {
        assert_eq!(on(&mut fusion, 1.0, LifeCycle::Occluded, f64::from(tenth) * 0.1), 1);
    }
    assert_eq!(on(&mut fusion, 1.0, LifeCycle::Occluded, 1.0), 0);
    // What a module sees is there, and so is what may stand beside the floor.
    assert_eq!(on(&mut fusion, 1.0, LifeCycle::Confirmed, 1.1), 1);
    for tenth in 12..40 {
        assert_eq!(on(&mut fusion, 0.3, LifeCycle::Occluded, f64::from(tenth) * 0.1), 1);
    }
}

#[test]
fn a_number_goes_from_body_to_body_and_not_to_both() {
    let mut fusion = Fusion::default();
    people(&mut fusion, &[seen(1, 0.5)], &[seen(1, 0.5)], 0.0);
    people(&mut fusion, &[seen(1, 2.5)], &[seen(1, 0.5), seen(5, 2.5)], 0.1);
    let found = people(&mut fusion, &[], &[seen(1, 0.5), seen(5, 2.5)], 0.2);
    assert_eq!(numbers(&found), [2, 1]);
}

/// The bodies of an explanation of the floors.
fn floors(bodies: &[TrackState]) -> Explanation {
    Explanation { people: bodies.to_vec(), ..Explanation::default() }
}

#[test]
fn explanations_have_the_numbers_of_people_and_only_those_whom_no_module_shows() {
    let mut fusion = Fusion::default();
    let tracks = [seen(7, 0.5)];
    let all = [
        floors(&[seen(3, 0.55), seen(5, 2.0), seen(6, 3.0)]),
        floors(&[seen(3, 3.0), seen(5, 0.55), seen(9, 2.0)]),
    ];
    let people = fusion.fuse(&tracks, &all, GROUND, 0.0);
    assert_eq!(numbers(&people), [1, 2, 3]);
    let of = |explanation: &Explanation| -> Vec<(TrackId, f64)> {
        explanation.people.iter().map(|person| (person.id, person.at.x)).collect()
    };
    let explained = fusion.explained(all.to_vec());
    assert_eq!(of(&explained[0]), [(2, 2.0), (3, 3.0)], "the first of three is the track's");
    assert_eq!(of(&explained[1]), [(2, 0.55)], "body 9 has no track yet");
}

#[test]
fn a_body_that_another_explanation_has_meanwhile_comes_back_under_its_number() {
    let mut fusion = Fusion::default();
    let (one, other) = (floors(&[seen(3, 0.5), seen(5, 2.0)]), floors(&[seen(3, 0.5), seen(8, 2.0)]));
    let mut fuse = |all: &[Explanation], at_s| numbers(&fusion.fuse(&[], all, GROUND, at_s));
    assert_eq!(fuse(&[one.clone(), other.clone()], 0.0), [1, 2]);
    assert_eq!(fuse(&[other.clone(), one.clone()], 0.1), [1, 3]);
    assert_eq!(fuse(&[one.clone(), other], 0.2), [1, 2]);
    assert_eq!(fuse(&[floors(&[])], 0.3), [0_u64; 0]);
    assert_eq!(fuse(&[one], 0.4), [4, 5], "no body was on the floor meanwhile");
}

#[test]
fn parts_belong_to_the_number_of_their_owner() {
    let mut fusion = Fusion::default();
    people(&mut fusion, &[], &[seen(1, 4.0)], 0.0);
    let wheel = TrackState { origin: Origin::PartOf(4), ..seen(6, 1.2) };
    let found = people(&mut fusion, &[wheel, seen(4, 1.0)], &[seen(1, 4.0), seen(2, 1.1)], 0.1);
    let owner = found.iter().find(|person| person.origin == Origin::Entered && person.at.x < 2.0).unwrap();
    let wheel = found.iter().find(|person| person.origin != Origin::Entered).unwrap();
    assert_eq!(wheel.origin, Origin::PartOf(owner.id));
    assert_eq!(found.len(), 3, "a part takes no body: {found:?}");
}

#[test]
fn restored_tracks_keep_their_numbers() {
    let mut fusion = Fusion::default();
    fusion.restore([4, 9].into_iter());
    let found = people(&mut fusion, &[seen(4, 1.0), seen(10, 3.0)], &[], 0.0);
    assert_eq!(numbers(&found), [4, 10]);
}

mod any {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever both sides say: one person for each pair and each one alone, and no number twice.
        #[test]
        fn no_number_is_given_twice_and_no_person_who_is_seen_is_lost(
            steps in prop::collection::vec(
                (
                    prop::collection::btree_map(0_u64..6, (-2.0..2.0_f64, any::<bool>()), 0..5),
                    prop::collection::btree_map(0_u64..6, 0.0..2.0_f64, 0..5),
                ),
                1..20,
            ),
        ) {
            let mut fusion = Fusion::default();
            for (number, (tracks, bodies)) in (0..).zip(steps) {
                let state = |hidden| if hidden { LifeCycle::Occluded } else { LifeCycle::Confirmed };
                let tracks: Vec<_> = tracks.iter().map(|(id, (x, hidden))| track(*id, *x, state(*hidden))).collect();
                let bodies: Vec<_> = bodies.iter().map(|(id, x)| seen(*id, *x)).collect();
                let found = people(&mut fusion, &tracks, &bodies, f64::from(number) * 0.1);
                let mut all = numbers(&found);
                all.sort_unstable();
                all.dedup();
                prop_assert_eq!(all.len(), found.len(), "a number twice");
                let in_view = tracks.iter().filter(|track| track.state == LifeCycle::Confirmed).count();
                prop_assert!(found.len() >= in_view, "lost");
                prop_assert!(found.len() <= tracks.len() + bodies.len());
            }
        }
    }
}
