//! Two halls as one site: the names of their parts, what is said of an area that is lost, whose name goes over the border.

use super::{AreaFrame, AreaName, Campus, Taken};
use crate::alarm_list::{About, ListedAlarm};
use crate::door::{Phase, Trouble};
use crate::floor::FloorLine;
use crate::jsonl::{TrackLine, TracksLine, ZoneLine};
use crate::occupancy::{Found, Total, ZoneKnown};
use crate::site::Site;
use crate::snapshot::{DeviceState, ModuleLine, Snapshot};
use crate::tracker::{LifeCycle, Origin};

pub(super) const SITE: &str = "
[[module]]
name = \"left\"
x = 0
y = 0
[[zone]]
name = \"hall\"
polygon = [[-9, -9], [9, -9], [9, 9], [-9, 9]]
count = true
[[entry]]
name = \"gate\"
line = [[-9, -9], [9, -9]]
";

pub(super) fn area(name: &str) -> AreaName {
    name.parse().unwrap()
}

pub(super) fn site() -> Site {
    Site::parse("hall.toml", SITE).unwrap()
}

pub(super) fn track(id: u64, x: f64, y: f64) -> TrackLine {
    serde_json::from_value(serde_json::json!({
        "id": id, "x": x, "y": y, "state": "confirmed", "cov": [0.002, 0.0, 0.002]
    }))
    .unwrap()
}

/// A frame in which the hall is known, with those tracks in it.
pub(super) fn frame(number: u64, tracks: Vec<TrackLine>) -> AreaFrame {
    let count = u32::try_from(tracks.len()).unwrap();
    let zone = ZoneLine::new(Found::inside(count, vec![1.0]), 1.0, ZoneKnown::Known);
    let line = TracksLine { t: 0.0, tracks, zones: [("hall".to_owned(), zone)].into() };
    let module = ModuleLine { name: "left".into(), state: DeviceState::Watching, ..ModuleLine::default() };
    AreaFrame { epoch: 1, number, frame: Snapshot { modules: vec![module], ..Snapshot::of(0, line) } }
}

/// Both halls, each with one person, heard at the start.
pub(super) fn both() -> (Campus, Site) {
    let mut campus = Campus::new(&[area("west")], 10);
    for (name, x) in [("west", -5.0), ("east", 5.0)] {
        assert!(campus.set_site(&area(name), site()));
        campus.hear(&area(name), frame(1, vec![track(7, x, 0.0)]), 0);
    }
    let site = campus.site();
    (campus, site)
}

#[test]
fn the_parts_of_all_areas_have_their_names_before_their_own() {
    let (mut campus, site) = both();
    site.check().unwrap();
    let zones: Vec<&str> = site.zones.iter().map(|zone| zone.name.as_str()).collect();
    assert_eq!(zones, ["east/hall", "west/hall"]);
    assert_eq!(site.entries[1].zone.as_deref(), Some("west/hall"), "the only one that counted");
    let picture = campus.picture(&site, 0, 1000);
    assert_eq!(picture.total, Total { count: Some(2), state: ZoneKnown::Known });
    let ids: Vec<u64> = picture.line.tracks.iter().map(|track| track.id).collect();
    assert_eq!(ids, [1, 2], "both are 7 in their own area");
    assert_eq!(picture.line.zones["east/hall"].count(), Some(1));
    assert!(!campus.set_site(&area("west"), self::site()), "the same again");
}

#[test]
fn of_an_area_that_is_not_heard_nothing_is_known_and_the_total_is_not_less() {
    let (mut campus, site) = both();
    campus.hear(&area("east"), frame(2, vec![track(7, 5.0, 0.0)]), 1_900_000);
    let picture = campus.picture(&site, 2_000_000, 3000);
    assert_eq!(picture.total.count, Some(2), "two seconds are no silence yet");
    let picture = campus.picture(&site, 2_100_000, 3100);
    assert_eq!(picture.line.zones["west/hall"].state(), ZoneKnown::Unknown);
    assert_eq!(picture.line.zones["west/hall"].count(), None);
    assert_eq!(picture.line.zones["east/hall"].count(), Some(1), "the other is unharmed");
    assert_eq!(picture.total, Total { count: Some(1), state: ZoneKnown::Partly });
    let missing = picture.modules.iter().find(|module| module.name == "west/left").unwrap();
    assert_eq!(missing.state, DeviceState::Missing);
    let [alarm] = &picture.alarms[..] else { panic!("{:?}", picture.alarms) };
    assert!(alarm.about == About::Area && alarm.text.contains("area west") && alarm.since_ms == 3100);
    // The total is 0 only if all areas are heard and none has a person.
    campus.hear(&area("east"), frame(3, Vec::new()), 2_200_000);
    assert_eq!(campus.picture(&site, 2_200_000, 3200).total.count, None);
    // It is back by itself, as another start.
    campus.hear(&area("west"), AreaFrame { epoch: 2, ..frame(1, Vec::new()) }, 2_300_000);
    let picture = campus.picture(&site, 2_300_000, 3300);
    assert_eq!((picture.total.count, picture.alarms.len()), (Some(0), 0));
}

#[test]
fn people_whom_secure_zones_of_two_areas_count_are_two_in_the_total() {
    let mut campus = Campus::new(&[], 10);
    let secure =
        Site::parse("hall.toml", &SITE.replace("count = true", "count = true\nsecure = true")).unwrap();
    let unexplained =
        |x| TrackLine { state: LifeCycle::Tentative, origin: Origin::Unexplained, ..track(7, x, 0.0) };
    for (name, x) in [("west", -5.0), ("east", 5.0)] {
        campus.set_site(&area(name), secure.clone());
        campus.hear(&area(name), frame(1, vec![unexplained(x)]), 0);
    }
    let picture = campus.picture(&campus.site(), 0, 1);
    assert_eq!(picture.total, Total { count: Some(2), state: ZoneKnown::Known });
    assert_eq!(picture.line.tracks.len(), 2, "and the map shows them");
}

#[test]
fn an_area_that_marks_no_zone_counts_with_all_its_zones() {
    let (mut campus, _) = both();
    campus.set_site(&area("east"), Site::parse("hall.toml", &SITE.replace("count = true\n", "")).unwrap());
    let site = campus.site();
    campus.hear(&area("west"), frame(2, vec![track(7, -5.0, 0.0)]), 100_000);
    assert_eq!(campus.picture(&site, 100_000, 1).total, Total { count: Some(2), state: ZoneKnown::Known });
    campus.hear(&area("west"), frame(3, vec![track(7, -5.0, 0.0)]), 2_100_000);
    let picture = campus.picture(&site, 2_100_000, 2);
    assert_eq!(picture.total, Total { count: Some(1), state: ZoneKnown::Partly }, "east is silent");
}

#[test]
fn a_tracker_whose_token_is_gone_is_unknown_at_once() {
    let (mut campus, site) = both();
    campus.leave(&area("west"));
    let picture = campus.picture(&site, 1000, 1);
    assert_eq!((picture.line.zones["west/hall"].count(), picture.total.count), (None, Some(1)));
}

#[test]
fn an_area_that_was_never_heard_is_missed() {
    let mut campus = Campus::new(&[area("west")], 10);
    campus.set_site(&area("east"), site());
    campus.hear(&area("east"), frame(1, Vec::new()), 0);
    let site = campus.site();
    let picture = campus.picture(&site, 0, 5);
    assert_eq!(picture.total, Total { count: None, state: ZoneKnown::Partly });
    assert!(picture.alarms[0].text.contains("ever heard of area west"));
}

#[test]
fn an_area_that_has_not_said_its_site_yet_is_not_in_the_total() {
    let mut campus = Campus::new(&[], 10);
    let unknown = Total { count: None, state: ZoneKnown::Partly };
    campus.hear(&area("west"), frame(1, vec![track(7, 5.0, 0.0)]), 0);
    assert_eq!(campus.picture(&Site::default(), 0, 1).total, Total::default(), "its zones are not known yet");
    campus.hear(&area("west"), frame(2, Vec::new()), 0);
    campus.set_site(&area("east"), site());
    campus.hear(&area("east"), frame(1, Vec::new()), 100_000);
    assert_eq!(campus.picture(&campus.site(), 100_000, 2).total, unknown);
    campus.set_site(&area("west"), site());
    let known = Total { count: Some(0), state: ZoneKnown::Known };
    assert_eq!(campus.picture(&campus.site(), 100_000, 3).total, known);
}

#[test]
fn an_area_that_never_says_its_site_is_an_alarm_that_says_what_to_do() {
    let mut campus = Campus::new(&[area("west")], 10);
    let told = |campus: &mut Campus, now_us: u64, unix_ms: u64| {
        let alarms = campus.picture(&campus.site(), now_us, unix_ms).alarms;
        let told = |alarm: ListedAlarm| (alarm.id, alarm.cause.name(), alarm.since_ms, alarm.text);
        alarms.into_iter().map(told).collect::<Vec<_>>()
    };
    assert_eq!(told(&mut campus, 0, 1000).len(), 1, "it was never heard");
    campus.hear(&area("west"), frame(1, Vec::new()), 100_000);
    let alarms = told(&mut campus, 100_000, 1100);
    let [(1, "silent", 1000, text)] = &alarms[..] else { panic!("{alarms:?}") };
    assert!(text.contains("area west is heard, but has not said its site"), "{text}");
    campus.set_site(&area("west"), site());
    assert_eq!(told(&mut campus, 200_000, 1200), []);
}

#[test]
fn an_area_that_has_just_joined_has_the_time_to_say_its_site() {
    let mut campus = Campus::new(&[], 10);
    let raised = [0, 1_900_000, 2_100_000].map(|now_us: u64| {
        campus.hear(&area("west"), frame(1 + now_us / 1000, Vec::new()), now_us);
        campus.picture(&campus.site(), now_us, 1000 + now_us / 1000).alarms.len()
    });
    assert_eq!(raised, [0, 0, 1]);
}

#[test]
fn an_area_without_zones_is_in_no_known_total_of_zones() {
    let (mut campus, _) = both();
    let bare = Site::parse("hall.toml", "[[module]]\nname = \"left\"\nx = 0\ny = 0\n").unwrap();
    campus.set_site(&area("east"), bare);
    let partly = |count| Total { count: Some(count), state: ZoneKnown::Partly };
    let picture = campus.picture(&campus.site(), 0, 1);
    assert_eq!((picture.total, picture.alarms.len()), (partly(2), 0), "beyond the hall nobody is counted");
    campus.hear(&area("west"), frame(2, vec![track(7, -5.0, 0.0)]), 2_100_000);
    assert_eq!(campus.picture(&campus.site(), 2_100_000, 2).total, partly(1), "the east is silent");
    campus.hear(&area("west"), frame(3, Vec::new()), 2_200_000);
    let unknown = Total { count: None, state: ZoneKnown::Partly };
    assert_eq!(campus.picture(&campus.site(), 2_200_000, 3).total, unknown, "unknown is never empty");
}

#[test]
fn a_total_by_a_site_that_an_area_uses_no_more_is_not_known() {
    let (mut campus, site) = both();
    let known = Total { count: Some(2), state: ZoneKnown::Known };
    assert_eq!((campus.picture(&site, 0, 1).total, campus.is_known(0)), (known, true));
    campus.note_site(&area("west"), true);
    campus.hear(&area("west"), frame(2, vec![track(7, -5.0, 0.0)]), 100_000);
    let partly = Total { state: ZoneKnown::Partly, ..known };
    assert_eq!((campus.picture(&site, 100_000, 2).total, campus.is_known(100_000)), (partly, false));
    campus.set_site(&area("west"), self::site());
    assert_eq!(campus.picture(&site, 100_000, 3).total, known, "it has said the site that it uses");
    assert!(!campus.is_known(2_100_000), "both are silent");
    assert!(!Campus::new(&[], 10).is_known(0), "there is no area");
}

#[test]
fn a_module_that_is_not_of_an_area_s_site_is_none_of_the_site_s() {
    let (mut campus, site) = both();
    let mut said = frame(2, Vec::new());
    let found = ModuleLine { name: "else".into(), state: DeviceState::Found, ..ModuleLine::default() };
    let off = ModuleLine { name: "switched-off".into(), state: DeviceState::Missing, ..found.clone() };
    said.frame.modules.extend([found, off]);
    campus.hear(&area("west"), said, 100_000);
    let mut modules = |now_us: u64| -> Vec<(String, DeviceState)> {
        let modules = campus.picture(&site, now_us, 1).modules.into_iter();
        modules.filter(|line| line.name.starts_with("west")).map(|line| (line.name, line.state)).collect()
    };
    assert_eq!(modules(100_000), [("west/left".to_owned(), DeviceState::Watching)]);
    assert_eq!(modules(2_200_000), [("west/left".to_owned(), DeviceState::Missing)], "west is silent");
}

#[test]
fn a_door_of_an_area_that_is_not_heard_has_failed_and_stays_in_the_picture() {
    let (mut campus, site) = both();
    let text = crate::site::door::tests::DOOR;
    let doors = crate::door::doors::Doors::new(&Site::parse("site", text).unwrap(), 1);
    let mut said = frame(2, Vec::new());
    said.frame.doors = doors.lines().collect();
    let name = format!("west/{}", said.frame.doors[0].name);
    campus.hear(&area("west"), said, 100_000);
    assert_eq!(campus.picture(&site, 100_000, 1).doors[0].trouble, Some(Trouble::Starting));
    let door = campus.picture(&site, 2_200_000, 2).doors.remove(0);
    assert_eq!((door.name, door.phase, door.trouble), (name, Phase::Failed, Some(Trouble::NoFrames)));
    assert_eq!((door.contact, door.lock_taken), (None, false), "nothing of it is known");
}

#[test]
fn no_panel_of_a_floor_is_known_while_its_area_is_not_heard() {
    let (mut campus, site) = both();
    let mut said = frame(2, Vec::new());
    let mat = FloorLine { name: "mat".into(), columns: 4, down: vec![5], ..FloorLine::default() };
    said.frame.floors = vec![FloorLine { stuck: vec![3], ..mat }];
    campus.hear(&area("west"), said, 100_000);
    assert_eq!(campus.picture(&site, 100_000, 1).floors[0].down, [5]);
    let unknown =
        FloorLine { name: "west/mat".into(), columns: 4, unknown_from: Some(0), ..FloorLine::default() };
    assert_eq!(campus.picture(&site, 2_200_000, 2).floors, [unknown]);
}

#[test]
fn a_frame_that_was_held_up_is_no_news() {
    let (mut campus, site) = both();
    campus.hear(&area("west"), frame(5, Vec::new()), 100_000);
    let late = campus.hear(&area("west"), frame(4, vec![track(7, -5.0, 0.0)]), 200_000);
    assert_eq!(late, Taken::Late);
    assert_eq!(campus.picture(&site, 200_000, 1).line.zones["west/hall"].count(), Some(0));
}

#[test]
fn an_alarm_of_an_area_may_have_any_number_there() {
    let (mut campus, site) = both();
    let alarm = |id: u64| -> ListedAlarm {
        serde_json::from_value(serde_json::json!({ "id": id, "name": "database", "text": "disk full" }))
            .unwrap()
    };
    let mut said = frame(2, Vec::new());
    said.frame.alarms = [0, 1, u64::MAX].map(alarm).to_vec();
    campus.hear(&area("west"), said, 100_000);
    let alarms = campus.picture(&site, 100_000, 1).alarms;
    let numbers: std::collections::BTreeSet<u64> = alarms.iter().map(|alarm| alarm.id).collect();
    assert_eq!((alarms.len(), numbers.len()), (3, 3));
}

#[test]
fn two_trackers_with_the_name_of_one_area_are_an_alarm_and_a_restart_is_none() {
    let (mut campus, site) = both();
    let of = |epoch, number| AreaFrame { epoch, ..frame(number, Vec::new()) };
    let mut told = |frames: &[(u64, u64)], now_us: u64| {
        frames.iter().for_each(|&(epoch, number)| _ = campus.hear(&area("west"), of(epoch, number), now_us));
        campus.hear(&area("east"), frame(now_us, Vec::new()), now_us);
        let alarms = campus.picture(&site, now_us, 1000 + now_us / 1000).alarms;
        alarms.into_iter().map(|alarm| (alarm.cause.name(), alarm.of, alarm.since_ms)).collect::<Vec<_>>()
    };
    // A restart, of which one frame of before was held up.
    assert_eq!(told(&[(1, 2), (2, 1), (1, 3), (2, 2)], 100_000), []);
    let shared = [("same-name", "west".to_owned(), 3100)];
    assert_eq!(told(&[(1, 4), (2, 3), (1, 5), (2, 4)], 2_100_000), shared);
    assert_eq!(told(&[(1, 6), (2, 5)], 3_000_000), shared);
    assert_eq!(told(&[(2, 6)], 5_100_000), [], "one of them has another name by now");
}

#[test]
fn more_areas_than_there_is_room_for_are_left_out_and_named() {
    let mut campus = Campus::new(&[area("a")], 2);
    let mut take = |name: &str| campus.hear(&area(name), frame(1, Vec::new()), 0);
    let (kept, left) = (Taken::News, Taken::Crowded);
    assert_eq!(["b", "c", "d", "a"].map(&mut take), [kept, left, left, kept]);
    let picture = campus.picture(&Site::default(), 0, 1);
    assert_eq!(campus.names().count(), 2);
    assert!(picture.alarms.iter().any(|alarm| alarm.text.contains("2 areas are too many, c among them")));
    let alarms = campus.picture(&Site::default(), 100_000, 101).alarms;
    assert!(alarms.iter().all(|alarm| alarm.since_ms == 1), "since they were heard first: {alarms:?}");
}

#[test]
fn an_area_that_is_left_out_is_not_in_the_total() {
    let mut campus = Campus::new(&[], 1);
    campus.set_site(&area("west"), site());
    campus.hear(&area("west"), frame(1, Vec::new()), 0);
    let known = Total { count: Some(0), state: ZoneKnown::Known };
    assert_eq!(campus.picture(&campus.site(), 0, 1).total, known);
    campus.hear(&area("east"), frame(1, Vec::new()), 0);
    let unknown = Total { count: None, state: ZoneKnown::Partly };
    assert_eq!(campus.picture(&campus.site(), 0, 2).total, unknown);
    campus.leave(&area("east"));
    assert_eq!(campus.picture(&campus.site(), 0, 3).total, known, "it is gone");
    campus.hear(&area("east"), frame(2, Vec::new()), 0);
    campus.hear(&area("west"), frame(2, Vec::new()), 2_100_000);
    assert_eq!(campus.picture(&campus.site(), 2_100_000, 4).total, known, "it is heard no more");
}
