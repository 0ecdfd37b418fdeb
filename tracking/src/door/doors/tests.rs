//! Tests of all doors of a site.

use super::*;
use crate::door::terms::Lock;
use crate::tracker::PERSON;

const SITE: &str = r#"
    [[module]]
    name = "left"
    x = 0.0
    y = 0.0
    [[zone]]
    name = "area"
    polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    [[door]]
    name = "front"
    zone = "area"
    line = [[-0.5, 1], [0.5, 1]]
    fail = "secure"
"#;

fn now(steady_s: f64) -> Now {
    Now { steady_s, unix_ms: 1_700_000_000_000 + (steady_s * 1e3) as u64 }
}

fn well() -> Estimate {
    let zone = r#"{"count":0,"p":[1.0],"seen_share":1.0,"state":"known"}"#;
    let zones = [("area".to_owned(), serde_json::from_str(zone).unwrap())].into();
    Estimate { zones, ..Estimate::default() }
}

const SEALED: Watcher = Watcher { unused_s: 0.0, has_key: true };

fn says_shut(doors: &mut Doors, now: Now) {
    let shut = format!(r#"{{"id": 1, "at_ms": {}, "contact": "shut"}}"#, now.unix_ms);
    doors.tell("front", Input::Contact, shut.as_bytes(), |_| Card(1), now, &mut Vec::new()).unwrap();
}

fn phase(doors: &Doors) -> Phase {
    doors.lines().next().unwrap().phase
}

#[test]
fn the_line_of_an_observation_is_that_after_it() {
    let mut doors = Doors::new(&toml::from_str(SITE).unwrap(), 1);
    let mut outputs = Vec::new();
    for tenth in 0..=20 {
        assert_eq!(phase(&doors), Phase::Failed, "{tenth}");
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut outputs);
    }
    assert_eq!(phase(&doors), Phase::Idle, "well for 2 s: said with the very observation that makes it so");
    doors.observe(&well(), |_| Some(Watcher { unused_s: 1.1, ..SEALED }), now(2.1), &mut outputs);
    assert_eq!(phase(&doors), Phase::Failed, "the device that watches it is silent");
}

#[test]
fn a_door_believes_modules_without_keys_only_if_its_site_says_so() {
    let clear = Watcher { has_key: false, ..SEALED };
    for (site, end) in [
        (SITE.to_owned(), (Phase::Failed, Some(Trouble::NoKey))),
        (SITE.replace("fail = ", "without_keys = true\nfail = "), (Phase::Idle, None)),
    ] {
        let mut doors = Doors::new(&toml::from_str(&site).unwrap(), 1);
        let mut outputs = Vec::new();
        for tenth in 0..=30 {
            doors.observe(&well(), |_| Some(clear), now(f64::from(tenth) * 0.1), &mut outputs);
        }
        let line = doors.lines().next().unwrap();
        assert_eq!((line.phase, line.trouble), end);
        says_shut(&mut doors, now(3.1));
        let card = br#"{"id": 1, "at_ms": 1700000003100, "card": "1"}"#;
        let _ = doors.tell("front", Input::Card, card, |_| Card(1), now(3.1), &mut outputs);
        let asks = phase(&doors) == Phase::Asked;
        assert_eq!(asks, end.1.is_none());
    }
}

#[test]
fn a_door_is_watched_by_what_is_near_its_zone_or_under_it_and_else_by_all_of_the_site() {
    let watched_by = |text: &str| {
        let site: Site = toml::from_str(text).unwrap();
        watching(&site.doors[0], &site)
    };
    let floor = |x: f64| format!("[[floor]]\nname = \"mat\"\nx = {x}\ny = 0\ncolumns = 24\nrows = 24\n");
    assert_eq!(watched_by(SITE), ["left"]);
    assert_eq!(watched_by(&SITE.replace("y = 0.0", "y = -8.5")), ["left"], "near the zone, not the line");
    assert_eq!(watched_by(&format!("{SITE}{}", floor(0.0))), ["left", "mat"]);
    assert_eq!(watched_by(&format!("{SITE}{}", floor(3.0))), ["left"], "beside the zone");
    let far = SITE.replace("y = 0.0", "y = -20.0");
    assert_eq!(watched_by(&far), ["left"], "it may see that far");
    assert_eq!(watched_by(&format!("{far}{}", floor(0.0))), ["mat"]);
    let unplaced = SITE.replace("y = 0.0", "y = 0.0\nplaced = false");
    assert_eq!(watched_by(&unplaced), [""; 0]);
    let mut doors = Doors::new(&toml::from_str(&unplaced).unwrap(), 1);
    for tenth in 0..=30 {
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut Vec::new());
    }
    let line = doors.lines().next().unwrap();
    assert_eq!((line.phase, line.trouble), (Phase::Failed, Some(Trouble::ModuleLost)), "watched by none");
}

#[test]
fn f8_a_zone_edited_under_a_door_is_the_doors_zone_at_once() {
    let mut doors = Doors::new(&toml::from_str(SITE).unwrap(), 1);
    let mut outputs = Vec::new();
    for tenth in 0..=20 {
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut outputs);
    }
    assert_eq!(doors.may_change_site(), Ok(()));
    let wider: Site = toml::from_str(&SITE.replace("[-1, 1]]", "[-1, 1], [-3, 1], [-3, -1]]")).unwrap();
    doors.change_site(&wider, now(2.1), &mut outputs);
    let unit = &doors.units[0];
    assert_eq!(
        format!("{:?}", unit.machine).matches("x: -3.0").count(),
        2,
        "the doorway has the new polygon"
    );
    says_shut(&mut doors, now(2.2));
    let card = br#"{"id": 1, "at_ms": 1700000002100, "card": "1"}"#;
    doors.tell("front", Input::Card, card, |_| Card(1), now(2.2), &mut outputs).unwrap();
    let in_use = doors.may_change_site().unwrap_err().to_string();
    assert!(in_use.starts_with("door \"front\" is asked: "), "{in_use}");
    outputs.clear();
    doors.change_site(&Site::default(), now(2.3), &mut outputs);
    assert!(doors.lines().next().is_none());
    let locked = |output: &Output| matches!(output, Output::Lock { order, .. } if order.lock == Lock::Locked);
    assert!(outputs.iter().any(locked), "a door that goes says so: {outputs:?}");
}

#[test]
fn a_card_that_is_shown_names_the_track_at_the_reader_in_the_lines_from_then_on() {
    let mut doors = Doors::new(&toml::from_str(SITE).unwrap(), 1);
    let mut outputs = Vec::new();
    let track = |id, y| TrackState { id, at: Point::new(0.0, y), ..PERSON };
    // The reader is at the middle of the line, 1 m along y: the track inside is nearest to it, and has not shown the card.
    let estimate = Estimate { tracks: vec![track(4, 0.7), track(5, -0.9), track(6, 1.2)], ..well() };
    for tenth in 0..=20 {
        doors.observe(&estimate, |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut outputs);
    }
    says_shut(&mut doors, now(2.1));
    let card = br#"{"id": 1, "at_ms": 1700000002100, "card": "1"}"#;
    doors.tell("front", Input::Card, card, |_| Card(0xa11c << 112), now(2.1), &mut outputs).unwrap();
    let names = |doors: &Doors| doors.lines().next().unwrap().names;
    let [name] = &names(&doors)[..] else { panic!("{:?}", names(&doors)) };
    assert_eq!((name.track, name.label.as_str()), (4, "a11c0000"));
    assert!(name.likelihood > 0.9, "{name:?}");
    // The track is gone with the next observation, and with it the name.
    doors.observe(&well(), |_| Some(SEALED), now(2.2), &mut outputs);
    assert_eq!(names(&doors), []);
}

#[test]
fn alarms_of_before_are_those_of_the_doors_of_their_names() {
    let mut doors = Doors::new(&toml::from_str(SITE).unwrap(), 1);
    doors.resume([("back", Alarm::Followed)]);
    assert_eq!(doors.lines().next().unwrap().standing, None);
    doors.resume([("back", Alarm::Followed), ("front", Alarm::WentIn)]);
    assert_eq!(doors.lines().next().unwrap().standing, Some(Alarm::WentIn));
}

#[test]
fn time_alone_makes_a_door_fail() {
    let mut doors = Doors::new(&toml::from_str(SITE).unwrap(), 1);
    let mut outputs = Vec::new();
    for tenth in 0..=20 {
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut outputs);
    }
    doors.pass_time(now(2.9), &mut outputs);
    assert_eq!(phase(&doors), Phase::Idle);
    outputs.clear();
    doors.pass_time(now(3.1), &mut outputs);
    assert_eq!(phase(&doors), Phase::Failed);
    assert!(outputs.iter().any(|output| matches!(output, Output::Alarm { alarm: Some(Alarm::Trouble), .. })));
}

#[test]
fn the_people_of_a_zone_open_one_of_its_doors_at_a_time() {
    let side = r#"
        [[door]]
        name = "side"
        zone = "area"
        line = [[1, -0.5], [1, 0.5]]
        fail = "secure"
    "#;
    let mut doors = Doors::new(&toml::from_str(&format!("{SITE}{side}")).unwrap(), 1);
    for tenth in 0..=20 {
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut Vec::new());
    }
    let mut id = 0;
    let mut tell = |doors: &mut Doors, door: &str, input, field: &str| {
        id += 1;
        let text = format!(r#"{{"id": {id}, "at_ms": {}, {field}}}"#, now(2.1).unix_ms);
        let hash = |card: &str| Card(card.len() as u128);
        doors.tell(door, input, text.as_bytes(), hash, now(2.1), &mut Vec::new())
    };
    for door in ["front", "side"] {
        assert_eq!(tell(&mut doors, door, Input::Contact, r#""contact": "shut""#), Ok(()));
    }
    assert_eq!(tell(&mut doors, "front", Input::Card, r#""card": "a""#), Ok(()));
    let busy = Err(Why::Refused(Refusal::Busy));
    assert_eq!(tell(&mut doors, "side", Input::Card, r#""card": "bb""#), busy);
    assert_eq!(tell(&mut doors, "front", Input::Card, r#""card": "bb""#), busy, "as ever");
    assert_eq!(tell(&mut doors, "side", Input::Exit, ""), Ok(()));
    // Nobody enters a number: the group is over, and the other door takes its card.
    for tenth in 21..=330 {
        doors.observe(&well(), |_| Some(SEALED), now(f64::from(tenth) * 0.1), &mut Vec::new());
    }
    let card = format!(r#"{{"id": 99, "at_ms": {}, "card": "bb"}}"#, now(33.0).unix_ms);
    let told = doors.tell("side", Input::Card, card.as_bytes(), |_| Card(2), now(33.0), &mut Vec::new());
    assert_eq!(told, Ok(()));
}

#[test]
fn a_door_that_a_change_brings_is_locked_and_opens_in_trouble_that_outlasts_it_only() {
    let safe: Site = toml::from_str(&SITE.replace("\"secure\"", "\"safe\"")).unwrap();
    let lock = |doors: &Doors| doors.lines().next().unwrap().lock;
    let mut outputs = Vec::new();
    let mut doors = Doors::new(&safe, 1);
    doors.pass_time(now(0.0), &mut outputs);
    assert_eq!(lock(&doors), Lock::Unlocked, "at the start nothing is known, and it fails safe");
    let change = |site: &Site, outputs: &mut Vec<Output>| {
        let mut doors = Doors::new(&Site::default(), 1);
        doors.change_site(site, now(100.0), outputs);
        assert_eq!(lock(&doors), Lock::Locked);
        doors
    };
    let mut doors = change(&safe, &mut outputs);
    for tenth in 1..=30 {
        doors.observe(&well(), |_| Some(SEALED), now(100.0 + f64::from(tenth) * 0.1), &mut outputs);
        assert_eq!(lock(&doors), Lock::Locked, "{tenth}");
    }
    assert_eq!(phase(&doors), Phase::Idle);
    let mut doors = change(&safe, &mut outputs);
    doors.pass_time(now(101.9), &mut outputs);
    assert_eq!(lock(&doors), Lock::Locked);
    doors.pass_time(now(102.1), &mut outputs);
    assert_eq!(lock(&doors), Lock::Unlocked, "the tracker says nothing");
}
