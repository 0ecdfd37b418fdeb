//! A zone by itself.

use super::*;
use crate::count::distribution;
use crate::tracker::{PERSON, TrackState};

#[test]
fn an_unexplained_track_counts_only_where_it_is_secure_and_a_part_nowhere() {
    let unexplained = TrackState {
        state: LifeCycle::Tentative,
        reason: "unexplained",
        origin: Origin::Unexplained,
        ..PERSON
    };
    let part = TrackState { origin: Origin::PartOf(1), ..unexplained };
    let line = |track: &TrackState, secure: bool| {
        let text = format!("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]\nsecure = {secure}");
        let zone: site::Zone = toml::from_str(&text).unwrap();
        let mut zone = Zone::new(&zone);
        zone.cells.iter_mut().for_each(|cell| cell.seen_s = 10.0);
        zone.line(&[Presence { track, is_inside: true, parts: WHOLE }], 10.0)
    };
    let counted = |track, secure| {
        let line = line(track, secure);
        (line.count(), line.p().to_vec())
    };
    let half = [0.51, 0.485, 0.005];
    assert_eq!(counted(&unexplained, false), (Some(0), half.to_vec()));
    assert_eq!(counted(&unexplained, true), (Some(1), distribution([1.0])));
    assert_eq!(counted(&part, false), (Some(0), vec![1.0]));
    assert_eq!(counted(&part, true), (Some(0), vec![1.0]));
}

#[test]
fn a_zone_that_no_module_looks_at_is_unknown() {
    let zone: site::Zone =
        toml::from_str("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]").unwrap();
    let mut zone = Zone::new(&zone);
    assert_eq!(zone.cells.len(), 25);
    assert_eq!(zone.line(&[], 10.0).state(), ZoneKnown::Unknown);
}

#[test]
fn what_is_excluded_needs_not_be_seen_and_who_is_there_is_not_counted() {
    let zone = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]\n";
    let shelf = "[[exclude]]\npolygon = [[0.4, 0], [1, 0], [1, 1], [0.4, 1]]\n";
    let known = |text: &str| {
        let mut zones = crate::zones::Zones::new(&toml::from_str(text).unwrap());
        let left = zones.zones[0].cells.iter_mut().filter(|cell| cell.middle.x < 0.4);
        left.for_each(|cell| cell.seen_s = 10.0);
        let line = zones.lines(&[PERSON], 10.0).remove("hall").unwrap();
        (line.state(), line.count(), line.p().to_vec())
    };
    assert_eq!(known(zone), (ZoneKnown::Partly, Some(1), distribution([1.0])));
    assert_eq!(known(&format!("{zone}{shelf}")), (ZoneKnown::Known, Some(0), vec![1.0]));
    let all = known(&format!("{zone}{}", shelf.replace("0.4", "-1")));
    assert_eq!(all, (ZoneKnown::Unknown, None, vec![]), "nothing of it is left to be known");
}

fn seen_square(at_s: f64) -> Zone {
    let zone = toml::from_str("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]").unwrap();
    let mut zone = Zone::new(&zone);
    zone.cells.iter_mut().for_each(|cell| cell.seen_s = at_s);
    zone
}

#[test]
fn no_person_leaves_a_zone_that_is_not_looked_at() {
    let person = Presence { track: &PERSON, is_inside: true, parts: WHOLE };
    let mut zone = seen_square(10.0);
    assert_eq!(zone.line(&[person], 10.1).count(), Some(1));
    // The track was predicted out of it: at once, as long as the newest report may be on its way; not later.
    assert_eq!(zone.line(&[], 10.2).count(), Some(0));
    assert_eq!(zone.line(&[], 10.4).state(), ZoneKnown::Partly);
    assert_eq!(zone.verdict(&[], 10.4), Verdict::LeftUnseen);
    assert_eq!(zone.line(&[person], 10.5).count(), Some(1));
    zone.cells.iter_mut().for_each(|cell| cell.seen_s = 10.6);
    assert_eq!(zone.line(&[], 11.5).count(), Some(0), "seen since");
}

#[test]
fn after_a_short_gap_a_zone_is_not_empty_while_a_person_in_it_is_being_found() {
    let tentative = TrackState { state: LifeCycle::Tentative, ..PERSON };
    let new = Presence { track: &tentative, is_inside: true, parts: WHOLE };
    let mut zone = seen_square(10.0);
    assert_eq!(zone.line(&[new], 10.1).count(), Some(0), "one who comes in is not there before being found");
    zone.found_s = 11.0;
    assert_eq!(zone.line(&[new], 10.1).state(), ZoneKnown::Partly);
    assert!(
        matches!(zone.verdict(&[new], 10.1), Verdict::NotFoundAgain { for_s } if (for_s - 0.9).abs() < 1e-9)
    );
    assert_eq!(zone.line(&[], 10.1).count(), Some(0));
    assert_eq!(zone.line(&[new], 11.0).count(), Some(0));
}

#[test]
fn one_who_is_predicted_out_of_a_zone_after_a_gap_leaves_it_partly_known() {
    let person = Presence { track: &PERSON, is_inside: true, parts: WHOLE };
    let mut zone = seen_square(10.0);
    assert_eq!(zone.line(&[person], 10.1).count(), Some(1));
    zone.look_again(13.2);
    zone.cells.iter_mut().for_each(|cell| cell.seen_s = 11.2);
    assert_eq!(zone.line(&[], 11.3).state(), ZoneKnown::Partly);
    assert_eq!(zone.line(&[person], 11.5).count(), Some(1), "found again");
    zone.cells.iter_mut().for_each(|cell| cell.seen_s = 13.1);
    assert_eq!(zone.line(&[], 13.1).state(), ZoneKnown::Partly, "looked at, and not for long enough");
    assert_eq!(zone.line(&[], 13.2).count(), Some(0));
    // One that was empty before the gap is empty after it.
    zone.cells.iter_mut().for_each(|cell| cell.seen_s = 14.0);
    zone.look_again(16.0);
    assert_eq!(zone.line(&[], 14.1).count(), Some(0));
}

#[test]
fn after_a_gap_a_zone_is_known_only_where_it_was_seen_again() {
    let zone: site::Zone =
        toml::from_str("name = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1], [0, 1]]").unwrap();
    let mut zone = Zone::new(&zone);
    let look = |zone: &mut Zone, all_but: usize, at_s: f64| {
        zone.cells.iter_mut().skip(all_but).for_each(|cell| cell.seen_s = at_s);
        zone.line(&[], at_s).state()
    };
    assert_eq!(look(&mut zone, 4, 0.0), ZoneKnown::Known, "these four were never seen");
    assert_eq!(look(&mut zone, 0, 1.0), ZoneKnown::Known);
    assert_eq!(
        look(&mut zone, 4, 4.0),
        ZoneKnown::Known,
        "as long as no gap came, tracks explain what is hidden"
    );
    assert_eq!(zone.line(&[], 7.0).state(), ZoneKnown::Unknown);
    assert_eq!(look(&mut zone, 4, 8.0), ZoneKnown::Partly, "a body finds room where nothing was seen since");
    assert!(matches!(zone.verdict(&[], 8.0), Verdict::MayHide { m2 } if (m2 - 0.16).abs() < 1e-9));
    assert_eq!(look(&mut zone, 2, 9.0), ZoneKnown::Known, "none finds room in two cells");
    assert_eq!(zone.line(&[], 20.0).state(), ZoneKnown::Unknown);
    assert_eq!(look(&mut zone, 4, 21.0), ZoneKnown::Partly);
    assert_eq!(look(&mut zone, 4, 20.0 + HELD_S), ZoneKnown::Known, "by now it is a thing");
}
