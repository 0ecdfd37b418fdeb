//! Counting lines by themselves.

use super::*;
use crate::geometry::Point;
use crate::tracker::{LifeCycle, Origin};

/// From left to right: *in* is up.
const SITE: &str = "[[line]]\nname = \"front\"\nfrom = [0, 0]\nto = [1, 0]\n";

fn site(text: &str) -> Site {
    Site::parse("home.toml", text).unwrap()
}

fn person(id: TrackId, x: f64, y: f64) -> TrackState {
    TrackState {
        id,
        at: Point::new(x, y),
        velocity: Point::default(),
        covariance_m2: [0.01, 0.0, 0.01],
        state: LifeCycle::Confirmed,
        existence: 1.0,
        reason: "",
        origin: Origin::Entered,
    }
}

/// A line, and the time.
struct Walk {
    lines: Lines,
    at_s: f64,
}

impl Walk {
    fn new() -> Self {
        Self { lines: Lines::new(&site(SITE)), at_s: 0.0 }
    }

    fn look(&mut self, tracks: &[TrackState]) -> Vec<Crossing> {
        self.at_s += 0.1;
        self.lines.observe(tracks, [ZoneKnown::Known], self.at_s)
    }

    /// A person walks over these places; which way the line was crossed.
    fn way(&mut self, id: TrackId, places: &[(f64, f64)]) -> Vec<Direction> {
        let mut look = |&(x, y): &(f64, f64)| self.look(&[person(id, x, y)]);
        places.iter().flat_map(&mut look).map(|crossing| crossing.direction).collect()
    }

    /// No track is there for so long.
    fn without_people(&mut self, seconds: f64) -> Vec<Direction> {
        let looks = (seconds * 10.0) as usize;
        (0..looks).flat_map(|_| self.look(&[])).map(|crossing| crossing.direction).collect()
    }
}

use Direction::{In, Out};

#[test]
fn to_the_left_of_the_line_is_in_and_back_is_out() {
    let mut walk = Walk::new();
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, -0.1), (0.5, 0.1), (0.5, 0.5), (0.5, 1.0)]), [In]);
    assert_eq!(walk.way(1, &[(0.5, 0.1), (0.5, -0.1), (0.5, -0.5)]), [Out]);
    let counted = &walk.lines.counted()[0];
    assert_eq!((counted.inward, counted.outward), (Some(1), Some(1)));
}

#[test]
fn the_time_is_that_of_the_pass_and_not_of_the_decision() {
    let mut walk = Walk::new();
    walk.look(&[person(1, 0.5, -0.3)]);
    walk.look(&[person(1, 0.5, -0.1)]);
    walk.look(&[person(1, 0.5, 0.1)]);
    let crossings = walk.look(&[person(1, 0.5, 0.3)]);
    assert!((crossings[0].at_s - 0.25).abs() < 1e-9, "{crossings:?}");
}

#[test]
fn who_sways_on_the_line_is_not_counted_until_they_go() {
    let mut walk = Walk::new();
    let sway: Vec<(f64, f64)> =
        (0..100).map(|step| (0.5, if step % 2 == 0 { -0.15 } else { 0.15 })).collect();
    assert_eq!(walk.way(1, &[(0.5, -0.5)]), []);
    assert_eq!(walk.way(1, &sway), []);
    assert_eq!(walk.way(1, &[(0.5, 0.5)]), [In]);
    assert_eq!(walk.way(1, &sway), []);
    assert_eq!(walk.way(1, &[(0.5, 0.5)]), [], "came back");
}

#[test]
fn beside_the_ends_no_track_crosses() {
    let mut walk = Walk::new();
    assert_eq!(walk.way(1, &[(1.5, -0.5), (1.5, 0.5), (0.5, 0.5)]), []);
    assert_eq!(walk.way(1, &[(0.5, -0.5)]), [Out], "round the end and back through the line");
    assert_eq!(walk.way(2, &[(1.2, -0.5), (1.2, 0.5)]), [In], "half a body beside the end");
}

#[test]
fn a_part_and_what_is_no_person_yet_are_not_counted() {
    let mut walk = Walk::new();
    let part = |y| TrackState { origin: Origin::PartOf(1), state: LifeCycle::Tentative, ..person(2, 0.5, y) };
    let thing =
        |y| TrackState { origin: Origin::Unexplained, state: LifeCycle::Tentative, ..person(3, 0.5, y) };
    for y in [-0.5, -0.1, 0.1, 0.5, 1.0] {
        assert_eq!(walk.look(&[part(y), thing(y)]), []);
    }
    // The thing turns out to have been a person all the time.
    assert_eq!(walk.look(&[person(3, 0.5, 1.1)]).len(), 1);
}

#[test]
fn a_track_that_changes_its_number_at_the_line_goes_on_with_its_way() {
    let mut walk = Walk::new();
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, -0.3), (0.5, -0.1)]), []);
    assert_eq!(walk.without_people(0.3), []);
    assert_eq!(walk.way(2, &[(0.5, 0.2), (0.5, 0.5)]), [In]);
    assert_eq!(walk.without_people(5.0), []);
}

#[test]
fn who_is_lost_just_past_the_line_has_crossed_it() {
    let mut walk = Walk::new();
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, -0.1), (0.5, 0.1)]), []);
    assert_eq!(walk.without_people(3.0), [In]);
    assert_eq!(walk.way(2, &[(0.5, -0.5), (0.5, -0.1)]), []);
    assert_eq!(walk.without_people(3.0), [], "and a track lost before it has not");
}

#[test]
fn an_occluded_track_crosses_when_it_is_seen_again() {
    let mut walk = Walk::new();
    let hidden = |y| TrackState { state: LifeCycle::Occluded, ..person(1, 0.5, y) };
    walk.look(&[person(1, 0.5, -0.5)]);
    for step in 0..60 {
        let y = if step % 10 == 0 { -0.5 } else { 0.5 };
        assert_eq!(walk.look(&[hidden(y)]), [], "what is believed jumps to and fro");
    }
    assert_eq!(walk.way(1, &[(0.5, 0.5)]), [In]);
}

#[test]
fn a_track_that_was_hidden_before_the_line_and_ends_beyond_it_has_crossed() {
    let hidden = |y| TrackState { state: LifeCycle::Occluded, ..person(1, 0.5, y) };
    let lost_at = |y| {
        let mut walk = Walk::new();
        walk.way(1, &[(0.5, -0.6), (0.5, -0.3)]);
        assert_eq!(walk.look(&[hidden(-0.1)]), []);
        assert_eq!(walk.look(&[hidden(y)]), []);
        walk.without_people(2.0)
    };
    assert_eq!(lost_at(0.4), [In]);
    assert_eq!(lost_at(0.1), [], "not all of the body is beyond");
    assert_eq!(lost_at(-0.4), []);
}

#[test]
fn who_is_believed_beyond_the_line_for_long_has_crossed_it_unseen() {
    let mut walk = Walk::new();
    let hidden = |y| TrackState { state: LifeCycle::Occluded, ..person(1, 0.5, y) };
    walk.look(&[person(1, 0.5, -0.5)]);
    let crossings: Vec<Crossing> = (0..40).flat_map(|_| walk.look(&[hidden(0.5)])).collect();
    let [crossing] = crossings[..] else { panic!("{crossings:?}") };
    assert!((crossing.since_s - 0.1).abs() < 1e-9 && (crossing.at_s - 2.2).abs() < 0.11, "{crossing:?}");
    assert_eq!(walk.without_people(5.0), []);
    // Seen to pass, then lost from sight on its way: at once.
    let mut walk = Walk::new();
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, 0.1)]), []);
    assert_eq!(walk.look(&[hidden(0.3)]).len(), 1);
}

/// A room below the line, with an entry at it.
const ROOM: &str =
    "[[zone]]\nname = \"room\"\npolygon = [[-1, -3], [2, -3], [2, 0], [-1, 0]]\nenclosed = true
    [[entry]]\nname = \"door\"\nline = [[0, 0], [1, 0]]\nzone = \"room\"\n";

#[test]
fn in_an_enclosed_zone_a_track_begins_or_ends_at_a_line_by_an_entry_only_by_crossing_it() {
    let mut walk = Walk { lines: Lines::new(&site(&format!("{SITE}{ROOM}"))), at_s: 0.0 };
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, -1.0), (0.5, -0.6)]), [Out], "came in unseen");
    assert_eq!(walk.without_people(3.0), [In], "left unseen");
    assert_eq!(walk.way(2, &[(0.5, -2.0), (0.5, -1.5)]), [], "too far to have just come");
    assert_eq!(walk.without_people(3.0), []);
    assert_eq!(
        walk.way(3, &[(0.5, 0.5), (0.5, 1.0), (0.5, 0.5)]),
        [],
        "outside people come and go as they like"
    );
    assert_eq!(walk.without_people(3.0), []);
    // A line half a metre inside: a track lost between it and the entry has crossed it before.
    let inner = SITE.replace("[0, 0]", "[0, -0.5]").replace("[1, 0]", "[1, -0.5]");
    let mut walk = Walk { lines: Lines::new(&site(&format!("{inner}{ROOM}"))), at_s: 0.0 };
    assert_eq!(walk.way(1, &[(0.5, -0.1), (0.5, -0.4)]), []);
    assert_eq!(walk.without_people(3.0), []);
    assert_eq!(walk.way(2, &[(0.5, -0.9), (0.5, -1.5)]), [Out]);
}

#[test]
fn who_was_occluded_at_a_restart_has_not_just_come() {
    let mut walk = Walk { lines: Lines::new(&site(&format!("{SITE}{ROOM}"))), at_s: 0.0 };
    walk.look(&[TrackState { state: LifeCycle::Occluded, ..person(1, 0.5, -0.5) }]);
    assert_eq!(walk.way(1, &[(0.5, -0.5), (0.5, -1.0)]), []);
}

#[test]
fn time_in_which_the_line_is_not_seen_is_unknown_and_no_count_is_0_then() {
    let mut lines = Lines::new(&site(SITE));
    lines.observe(&[], [ZoneKnown::Unknown], 10.0);
    lines.observe(&[], [ZoneKnown::Unknown], 11.0);
    let counted = &lines.counted()[0];
    assert_eq!((counted.inward, counted.outward, counted.unknown_s), (None, None, 1.0));
    assert_eq!(
        serde_json::to_string(counted).unwrap(),
        r#"{"name":"front","in":null,"out":null,"state":"unknown","unknown_s":1.0}"#
    );
    lines.observe(&[], [ZoneKnown::Known], 12.0);
    lines.observe(&[], [ZoneKnown::Partly], 12.5);
    lines.observe(&[], [ZoneKnown::Known], 13.0);
    lines.observe(&[], [ZoneKnown::Known], 3613.0);
    let counted = &lines.counted()[0];
    assert_eq!((counted.inward, counted.outward), (Some(0), Some(0)));
    assert_eq!(counted.unknown_s, 3601.5, "and the hour in which the machine slept");
}

#[test]
fn counts_go_on_under_the_name_of_the_line_and_from_an_earlier_process() {
    let mut walk = Walk::new();
    walk.lines.restore(&[("front".to_owned(), Totals { inward: 7, outward: 3 })].into());
    let counted = |lines: &Lines| lines.counted().iter().map(|line| line.totals()).collect::<Vec<_>>();
    walk.way(1, &[(0.5, -0.5), (0.5, 0.5)]);
    assert_eq!(counted(&walk.lines), [Some(Totals { inward: 8, outward: 3 })]);
    walk.lines.change_site(&site(&format!(
        "{}{}",
        SITE.replace("front", "back"),
        SITE.replace("[1, 0]", "[2, 0]")
    )));
    assert_eq!(counted(&walk.lines), [None, Some(Totals { inward: 8, outward: 3 })]);
}

#[test]
fn a_crowd_takes_no_more_than_the_memory_there_is() {
    let mut walk = Walk::new();
    let crowd: Vec<TrackState> = (0..2000).map(|id| person(id, 0.5, 1.0)).collect();
    assert_eq!(walk.look(&crowd), []);
    assert_eq!(walk.lines.counted()[0].unfollowed, 2000 - 512);
}
