//! Which tracks of two and three areas are one person, and which of them keeps the number.
//!
//! ```text
//!   west  ●────●┄┄┄┄┄○       ●     its track is hidden, and then another person's
//!   east       ●────────●───────▶  the number goes with the person who is seen
//! ```

use super::Campus;
use super::tests::{SITE, area, both, frame, track};
use crate::jsonl::TrackLine;
use crate::site::Site;
use crate::tracker::LifeCycle;

#[test]
fn two_who_stand_together_at_a_border_are_two() {
    let (mut campus, site) = both();
    campus.hear(&area("west"), frame(2, vec![track(7, 0.0, 0.0), track(8, 0.0, 0.6)]), 100_000);
    campus.hear(&area("east"), frame(2, vec![track(7, 0.05, 0.03), track(8, 0.06, 0.66)]), 100_000);
    let picture = campus.picture(&site, 100_000, 1);
    assert_eq!(picture.line.tracks.len(), 2);
    assert_eq!(picture.total.count, Some(2));
}

/// The numbers that are shown when these areas have one track each, at these places along x; without a place none.
fn shown(campus: &mut Campus, step: u64, places: [(&str, Option<f64>); 3]) -> Vec<u64> {
    for (name, x) in places {
        let tracks = x.map(|x| track(1, x, 0.0)).into_iter().collect();
        campus.hear(&area(name), frame(step, tracks), step * 100_000);
    }
    let picture = campus.picture(&Site::default(), step * 100_000, 1);
    picture.line.tracks.iter().map(|track| track.id).collect()
}

#[test]
fn where_three_areas_meet_a_person_is_one_though_two_of_them_differ() {
    let mut campus = Campus::new(&[], 10);
    let a = Some(0.0);
    assert_eq!(shown(&mut campus, 1, [("a", a), ("b", a), ("c", a)]), [1]);
    // What c says is between the two others, which are as far apart as two who walk side by side.
    let apart = [("a", Some(-0.35)), ("b", Some(0.35)), ("c", Some(0.0))];
    assert_eq!(shown(&mut campus, 2, apart).len(), 1);
    assert_eq!(shown(&mut campus, 3, [("a", None), ("b", a), ("c", a)]), [1], "the number stays");
}

#[test]
fn who_is_at_the_place_of_another_for_a_moment_keeps_the_number() {
    let mut campus = Campus::new(&[], 10);
    let say = |campus: &mut Campus, step, east: f64| {
        shown(campus, step, [("east", Some(east)), ("west", Some(-0.5)), ("south", None)])
    };
    assert_eq!(say(&mut campus, 1, 5.0), [1, 2]);
    for step in 2..6 {
        assert_eq!(say(&mut campus, step, -0.4), [1, 2], "{step}: they are at one place");
    }
    assert_eq!(say(&mut campus, 6, 5.0), [1, 2]);
}

#[test]
fn two_whom_two_areas_see_at_one_place_for_longer_are_one() {
    let mut campus = Campus::new(&[], 10);
    let say = |campus: &mut Campus, step, east: f64| {
        shown(campus, step, [("east", Some(east)), ("west", Some(-0.5)), ("south", None)])
    };
    assert_eq!(say(&mut campus, 1, 5.0), [1, 2]);
    let numbers: Vec<Vec<u64>> = (2..10).map(|step| say(&mut campus, step, -0.4)).collect();
    assert_eq!(numbers.last(), Some(&vec![1]), "{numbers:?}");
    assert_eq!(say(&mut campus, 10, 5.0).len(), 2, "they are two after all");
}

/// West's track is hidden at `west`, east's seen at `east`, in halls that meet at 0.
fn hidden(campus: &mut Campus, number: u64, state: LifeCycle, west: f64, east: Option<f64>) -> Vec<u64> {
    let tracks = vec![TrackLine { state, ..track(7, west, 0.0) }];
    campus.hear(&area("west"), frame(number, tracks), number * 100_000);
    let tracks = east.map(|x| track(8, x, 0.0)).into_iter().collect();
    campus.hear(&area("east"), frame(number, tracks), number * 100_000);
    let picture = campus.picture(&campus.site(), number * 100_000, 1);
    picture.line.tracks.iter().map(|track| track.id).collect()
}

/// Two halls that meet at 0.
fn halves() -> Campus {
    let mut campus = Campus::new(&[], 10);
    for (name, from, to) in [("west", "-9", "0"), ("east", "0", "9")] {
        let polygon = format!("[[{from}, -9], [{to}, -9], [{to}, 9], [{from}, 9]]");
        let text = SITE.replace("[[-9, -9], [9, -9], [9, 9], [-9, 9]]", &polygon);
        campus.set_site(&area(name), Site::parse("half", &text).unwrap());
    }
    campus
}

#[test]
fn who_is_hidden_from_one_area_is_where_the_other_sees_them() {
    use LifeCycle::{Confirmed, Occluded};
    let mut campus = halves();
    assert_eq!(hidden(&mut campus, 1, Confirmed, 0.0, Some(0.05)), [1]);
    // West supposes its own still at the border, while east sees them walk on.
    for step in 2..40 {
        let east = 0.1 * step as f64;
        assert_eq!(hidden(&mut campus, step, Occluded, 0.3, Some(east)), [1], "{step}");
    }
    // Another person comes to the border, and west takes them for the one that it had lost: 1 is the person east has seen all along.
    assert_eq!(hidden(&mut campus, 40, Confirmed, -0.2, Some(4.0)).len(), 2);
    let picture = campus.picture(&campus.site(), 4_000_000, 1);
    let first = picture.line.tracks.iter().find(|track| track.id == 1).unwrap();
    assert!(first.x > 3.5, "{first:?}");
}

#[test]
fn who_is_hidden_takes_no_number_from_one_who_passes() {
    use LifeCycle::{Confirmed, Occluded};
    let mut campus = halves();
    assert_eq!(hidden(&mut campus, 1, Confirmed, -0.5, None), [1]);
    for step in 2..40 {
        assert_eq!(hidden(&mut campus, step, Confirmed, -0.5, Some(4.0)), [1, 2], "{step}");
    }
    // The first is hidden from then on, and the second comes by and goes away again.
    for step in 40..80 {
        let east = 0.1 + 0.2 * (step as f64 - 60.0).abs();
        let shown = hidden(&mut campus, step, Occluded, -0.2, Some(east));
        assert!(shown.contains(&2), "{step}: {shown:?}");
    }
    assert_eq!(hidden(&mut campus, 80, Confirmed, -0.5, Some(4.1)), [1, 2]);
}

#[test]
fn what_an_area_supposes_in_another_that_sees_the_place_is_no_person() {
    let mut campus = halves();
    assert_eq!(hidden(&mut campus, 1, LifeCycle::Occluded, 2.0, None).len(), 0);
    assert_eq!(hidden(&mut campus, 2, LifeCycle::Occluded, -2.0, None).len(), 1, "its own ground");
    assert_eq!(hidden(&mut campus, 3, LifeCycle::Confirmed, 2.0, None).len(), 1, "it sees them there");
    campus.leave(&area("east"));
    campus.hear(
        &area("west"),
        frame(9, vec![TrackLine { state: LifeCycle::Occluded, ..track(7, 2.0, 0.0) }]),
        400_000,
    );
    assert_eq!(campus.picture(&campus.site(), 400_000, 1).line.tracks.len(), 1, "no other area knows");
}

#[test]
fn a_person_never_has_two_tracks_of_one_area() {
    let mut campus = Campus::new(&[], 10);
    // South's is between two of north's: one of these is the person, by whichever way round.
    campus.hear(&area("north"), frame(1, vec![track(1, -0.3, 0.0), track(2, 0.3, 0.0)]), 0);
    campus.hear(&area("south"), frame(1, vec![track(1, -0.28, 0.0)]), 0);
    campus.hear(&area("west"), frame(1, vec![track(1, 0.02, 0.0)]), 0);
    assert_eq!(campus.picture(&Site::default(), 0, 1).line.tracks.len(), 2);
}

/// The numbers that are shown, each with its place along x, when west and east have these tracks, all on one line.
fn places(
    campus: &mut Campus,
    number: u64,
    west: &[(u64, f64, LifeCycle)],
    east: &[(u64, f64, LifeCycle)],
) -> Vec<(u64, f64)> {
    for (name, tracks) in [("west", west), ("east", east)] {
        let line = |&(id, x, state): &(u64, f64, LifeCycle)| TrackLine { state, ..track(id, x, 0.0) };
        let tracks = tracks.iter().map(line).collect();
        campus.hear(&area(name), frame(number, tracks), number * 100_000);
    }
    let picture = campus.picture(&campus.site(), number * 100_000, 1);
    picture.line.tracks.iter().map(|track| (track.id, track.x)).collect()
}

#[test]
fn a_track_that_is_taken_for_another_person_brings_no_number_along() {
    use LifeCycle::{Confirmed, Occluded};
    let mut campus = halves();
    let (one, other) = ((70, 0.5, Confirmed), (71, 3.0, Confirmed));
    places(&mut campus, 1, &[], &[one]);
    places(&mut campus, 2, &[(7, -3.0, Confirmed)], &[one]);
    // West's track was one person, and is then the one whom east sees.
    for number in 3..20 {
        places(&mut campus, number, &[(7, 0.5, Confirmed)], &[one, other]);
    }
    for number in 20..50 {
        places(&mut campus, number, &[(7, 0.5, Occluded)], &[one, other]);
    }
    // West's tracker finds its own again on the way to where the other one is.
    for number in 50..80 {
        let west = if number < 55 { 1.9 } else { 3.0 };
        let shown = places(&mut campus, number, &[(7, west, Confirmed)], &[one, other]);
        assert_eq!(shown, [(1, 0.5), (3, 3.0)], "{number}");
    }
}

#[test]
fn who_is_found_near_one_whom_the_neighbour_sees_has_no_number_yet() {
    use LifeCycle::Confirmed;
    let mut campus = halves();
    assert_eq!(places(&mut campus, 1, &[(7, -0.5, Confirmed)], &[]).len(), 1);
    // East finds them a metre ahead at first, as trackers do whose beams hit another leg or another person.
    for number in 2..6 {
        let shown = places(&mut campus, number, &[(7, -0.4, Confirmed)], &[(70, 0.6, Confirmed)]);
        assert_eq!(shown.len(), 1, "{number}: {shown:?}");
    }
    let shown = places(&mut campus, 6, &[(7, 0.0, Confirmed)], &[(70, 0.1, Confirmed)]);
    assert_eq!(shown.len(), 1);
    let shown = places(&mut campus, 7, &[], &[(70, 0.2, Confirmed)]);
    assert_eq!(shown, [(1, 0.2)]);
    // A track that stays there for longer is a person.
    for number in 8..18 {
        places(&mut campus, number, &[(8, -0.7, Confirmed)], &[(70, 0.2, Confirmed)]);
    }
    assert_eq!(places(&mut campus, 18, &[(8, -0.7, Confirmed)], &[(70, 0.2, Confirmed)]).len(), 2);
}

#[test]
fn a_track_that_is_new_on_the_ground_of_another_area_is_a_person_after_a_second() {
    use LifeCycle::Confirmed;
    let mut campus = halves();
    for number in 1..11 {
        let shown = places(&mut campus, number, &[(7, 2.0, Confirmed)], &[]);
        assert_eq!(shown, [], "{number}: it is east's to say who is there");
    }
    let shown: Vec<usize> =
        (11..15).map(|number| places(&mut campus, number, &[(7, 2.0, Confirmed)], &[]).len()).collect();
    assert_eq!(shown.last(), Some(&1), "{shown:?}");
}

#[test]
fn a_track_whose_person_went_on_without_it_is_no_new_person_at_once() {
    use LifeCycle::{Confirmed, Occluded};
    let mut campus = halves();
    let (east, found) = ((70, 0.5, Confirmed), (8, 0.5, Confirmed));
    let lost = |x, state| (7, x, state);
    for number in 1..20 {
        places(&mut campus, number, &[lost(0.5, Confirmed)], &[east]);
    }
    // West has another track for them, and the one before wakes beside it.
    for number in 20..30 {
        places(&mut campus, number, &[lost(0.5, Occluded), found], &[east]);
    }
    for number in 30..40 {
        let shown = places(&mut campus, number, &[lost(-0.3, Confirmed), found], &[east]);
        assert_eq!(shown, [(1, 0.5)], "{number}");
    }
    let shown: Vec<usize> = (40..44)
        .map(|number| places(&mut campus, number, &[lost(-0.3, Confirmed), found], &[east]).len())
        .collect();
    assert_eq!(shown.last(), Some(&2), "{shown:?}");
}

#[test]
fn the_area_on_whose_ground_they_are_says_where() {
    use LifeCycle::Confirmed;
    let mut campus = halves();
    let both = |campus: &mut Campus, number: u64, x: f64| {
        places(campus, number, &[(7, x, Confirmed)], &[(70, x + 0.2, Confirmed)])
    };
    for number in 1..10 {
        assert_eq!(both(&mut campus, number, -0.5), [(1, -0.5)], "{number}");
    }
    // East knew them before the border.
    for number in 10..20 {
        assert_eq!(both(&mut campus, number, 0.5), [(1, 0.7)], "{number}");
    }
}

#[test]
fn who_was_hidden_in_one_area_and_left_by_the_other_is_gone() {
    use LifeCycle::{Confirmed, Occluded};
    let mut campus = halves();
    for number in 1..10 {
        places(&mut campus, number, &[(7, -0.2, Confirmed)], &[(70, -0.2, Confirmed)]);
    }
    // They walk through east and out of it, while west supposes them at the border.
    for number in 10..60 {
        let x = 0.1 * number as f64;
        let shown = places(&mut campus, number, &[(7, -0.2, Occluded)], &[(70, x, Confirmed)]);
        assert_eq!(shown.len(), 1, "{number}: {shown:?}");
    }
    for number in 60..120 {
        assert_eq!(places(&mut campus, number, &[(7, -0.2, Occluded)], &[]), [], "{number}");
    }
    assert_eq!(places(&mut campus, 120, &[(7, -0.2, Confirmed)], &[]).len(), 1, "a person is there again");
}
