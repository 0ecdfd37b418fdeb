//! What goes out to a broker that is new, that kept something, that is told of a part of the site.

use super::*;
use crate::mqtt::messages::tests::{frame, site, topics, zone};
use kehai_tracking::door::{Contact, DoorLine, Phase, Trouble};
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::site::Site;
use serde_json::{Value, json};

/// Of the site to which the frame's module belongs.
fn outbox() -> Outbox {
    let mut outbox = Outbox::new(topics());
    outbox.set_about(About { site: site().into(), ..About::default() });
    outbox
}

fn topics_of(publications: &[Publication]) -> Vec<&str> {
    publications.iter().map(|publication| publication.topic.as_str()).collect()
}

#[test]
fn a_new_broker_is_told_everything_and_then_only_what_changes() {
    let mut outbox = outbox();
    let first = outbox.due(Some(&frame()), 0);
    assert_eq!(first.len(), 6 + 3 + 1 + 2 + 1);
    assert_eq!(first.last(), Some(&Publication { topic: topics().status(), payload: "online".into() }));
    assert_eq!(outbox.due(Some(&frame()), 100), []);
    let mut changed = frame();
    changed.line.zones.insert("hall".into(), zone(3, ZoneKnown::Known));
    assert_eq!(topics_of(&outbox.due(Some(&changed), 200)), ["kehai/front-door/zone/hall"]);
    outbox.connected();
    let again = outbox.due(Some(&changed), 300);
    assert_eq!(again.len(), first.len());
    assert!(again.iter().any(|told| told.payload.contains("\"count\":3")));
}

#[test]
fn figures_wait_but_a_state_or_an_alarm_does_not() {
    let mut outbox = outbox();
    let mut frame = frame();
    outbox.due(Some(&frame), 0);
    frame.modules[0].scans_hz = 9.7;
    for now_ms in (100..FIGURES_MS).step_by(100) {
        assert_eq!(outbox.due(Some(&frame), now_ms), []);
    }
    assert_eq!(topics_of(&outbox.due(Some(&frame), FIGURES_MS)), ["kehai/front-door/module/left"]);
    frame.modules[0].state = kehai_tracking::snapshot::DeviceState::Learning;
    assert_eq!(topics_of(&outbox.due(Some(&frame), FIGURES_MS + 100)), ["kehai/front-door/module/left"]);
}

#[test]
fn what_is_gone_from_the_site_or_was_left_by_an_earlier_one_is_forgotten() {
    let mut outbox = outbox();
    outbox.retained("kehai/front-door/zone/cellar", b"");
    outbox.retained("kehai/front-door/zone/hall", b"");
    outbox.retained("kehai/front-door/status", b"");
    outbox.retained("homeassistant/device/kehai_front-door_right/config", b"");
    outbox.retained("homeassistant/device/another/config", b"");
    let first = outbox.due(Some(&frame()), 0);
    let empty: Vec<&Publication> = first.iter().filter(|told| told.payload.is_empty()).collect();
    let forgotten: Vec<&str> = empty.iter().map(|told| told.topic.as_str()).collect();
    assert_eq!(
        forgotten,
        ["homeassistant/device/kehai_front-door_right/config", "kehai/front-door/zone/cellar"]
    );
    let mut smaller = frame();
    smaller.line.zones.remove("hall");
    let told = outbox.due(Some(&smaller), 100);
    let empty: Vec<&Publication> = told.iter().filter(|told| told.payload.is_empty()).collect();
    let forgotten: Vec<&str> = empty.iter().map(|told| told.topic.as_str()).collect();
    assert_eq!(forgotten, ["kehai/front-door/zone/hall", "kehai/front-door/zone/hall/availability"]);
    assert!(
        told.iter()
            .any(|told| told.topic.ends_with("kehai_front-door/config") && !told.payload.contains("hall"))
    );
}

/// The site's device, as it is told in one message after the other: of each component of a zone its platform, if that is all.
fn zones_told(publications: &[Publication]) -> Vec<BTreeMap<String, Option<String>>> {
    let of_site = publications.iter().filter(|told| told.topic.ends_with("kehai_front-door/config"));
    let components = |told: &Publication| -> BTreeMap<String, Option<String>> {
        let config: Value = serde_json::from_str(&told.payload).unwrap();
        let all = config["components"].as_object().unwrap().iter();
        let is_of_zone = |name: &str| ["zone_hall", "zone_cellar"].iter().any(|zone| name.starts_with(zone));
        let zones = all.filter(|(name, _)| is_of_zone(name));
        let platform = |entity: &Value| entity["platform"].as_str().unwrap().to_owned();
        let gone = |entity: &Value| (entity.as_object().unwrap().len() == 1).then(|| platform(entity));
        zones.map(|(name, entity)| (name.clone(), gone(entity))).collect()
    };
    of_site.map(components).collect()
}

#[test]
fn a_zone_that_is_gone_is_removed_from_home_assistant_once_also_if_no_tracker_ran_meanwhile() {
    let there = |name: &str| (name.to_owned(), None);
    let gone = |name: &str, platform: &str| (name.to_owned(), Some(platform.to_owned()));
    let hall = || [there("zone_hall_count"), there("zone_hall_occupancy")];
    let mut outbox = outbox();
    let first = outbox.due(Some(&frame()), 0);
    assert_eq!(zones_told(&first), [BTreeMap::from(hall())]);
    // The broker's answer may come after what was published over the same connection.
    let cellar = json!({ "platform": "sensor", "unique_id": "kehai_front-door_zone_cellar_count" });
    let kept = json!({ "components": { "zone_cellar_count": cellar }, "device": {} }).to_string();
    outbox.retained("homeassistant/device/kehai_front-door/config", kept.as_bytes());
    let told = outbox.due(Some(&frame()), 100);
    let parting: BTreeMap<String, Option<String>> =
        hall().into_iter().chain([gone("zone_cellar_count", "sensor")]).collect();
    assert_eq!(zones_told(&told), [parting, BTreeMap::from(hall())]);
    assert_eq!(outbox.due(Some(&frame()), 200), []);
    let mut smaller = frame();
    smaller.line.zones.remove("hall");
    let told = outbox.due(Some(&smaller), 300);
    let parting = [gone("zone_hall_count", "sensor"), gone("zone_hall_occupancy", "binary_sensor")];
    assert_eq!(zones_told(&told), [BTreeMap::from(parting), BTreeMap::new()]);
    assert_eq!(outbox.due(Some(&smaller), 400), []);
}

#[test]
fn while_an_area_is_not_heard_nothing_of_the_site_is_forgotten() {
    let mut outbox = outbox();
    let (cellar, device) =
        ("kehai/front-door/zone/cellar", "homeassistant/device/kehai_front-door_right/config");
    let (over, open) = ("kehai/front-door/alarm/zone/hall/crowded", format!("{cellar}/availability"));
    [cellar, &open, device, over].iter().for_each(|topic| outbox.retained(topic, b""));
    let silent = json!({ "source": "area", "of": "west", "name": "silent", "text": "…" });
    let mut part = frame();
    part.alarms = vec![serde_json::from_value(silent).unwrap()];
    let forgotten = |told: &[Publication]| -> Vec<String> {
        told.iter().filter(|told| told.payload.is_empty()).map(|told| told.topic.clone()).collect()
    };
    let offline =
        |topic: &str| Publication { topic: format!("{topic}/availability"), payload: "offline".into() };
    let first = outbox.due(Some(&part), 0);
    assert_eq!(forgotten(&first), [over], "an alarm that is over is");
    assert!(first.contains(&offline(cellar)), "nothing is known of it: {first:?}");
    part.line.zones.remove("hall");
    let later = outbox.due(Some(&part), 100);
    assert_eq!(forgotten(&later), [""; 0]);
    assert!(later.contains(&offline("kehai/front-door/zone/hall")), "{later:?}");
    assert!(later.iter().all(|told| !told.topic.starts_with("homeassistant/")), "{later:?}");
    assert!(!outbox.due(Some(&part), 200).iter().any(|told| told.payload == "offline"), "said once");
    // All of it is heard.
    let whole = outbox.due(Some(&frame()), 300);
    let silent = "kehai/front-door/alarm/area/west/silent";
    assert_eq!(forgotten(&whole), [device, silent, cellar, &open]);
    let online = "kehai/front-door/zone/hall/availability";
    assert!(whole.iter().any(|told| told.topic == online && told.payload == "online"), "{whole:?}");
}

const DOOR: &str = "[[module]]\nname = \"left\"\nx = 0\ny = 0.5\n\
    [[zone]]\nname = \"hall\"\nsecure = true\npeople_max = 4\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\n\
    [[door]]\nname = \"front\"\nzone = \"hall\"\nline = [[-0.45, 1.0], [0.45, 1.0]]\nfail = \"secure\"\n";

#[test]
fn a_door_that_the_broker_keeps_has_failed_while_its_area_is_not_heard() {
    let state = crate::doors::DoorHandle::new(&Site::parse("site", DOOR).unwrap(), None).states().remove(0);
    let kept = DoorLine { phase: Phase::Idle, trouble: None, contact: Some(Contact::Shut), ..state.line };
    let (front, other) = ("kehai/front-door/door/west-front", "kehai/front-door/door/of-another-version");
    let mut outbox = outbox();
    outbox.retained(front, serde_json::to_string(&kept).unwrap().as_bytes());
    outbox.retained(other, b"{}");
    let silent = json!({ "source": "area", "of": "west", "name": "silent", "text": "…" });
    let mut part = frame();
    part.alarms = vec![serde_json::from_value(silent).unwrap()];
    let of_doors = |told: Vec<Publication>| -> Vec<(String, String)> {
        let told = told.into_iter().filter(|told| told.topic.contains("/door/"));
        told.map(|told| (told.topic, told.payload)).collect()
    };
    let told = of_doors(outbox.due(Some(&part), 0));
    let [(topic, payload)] = &told[..] else { panic!("{told:?}") };
    let said: DoorLine = serde_json::from_str(payload).unwrap();
    assert_eq!((topic.as_str(), said.phase, said.trouble), (front, Phase::Failed, Some(Trouble::NoFrames)));
    assert_eq!(said, kept.unheard());
    assert_eq!(of_doors(outbox.due(Some(&part), 100)), [], "said once");
    let gone = |topic: &str| (topic.to_owned(), String::new());
    assert_eq!(of_doors(outbox.due(Some(&frame()), 200)), [gone(other), gone(front)], "no area has them");
}

#[test]
fn a_door_of_which_another_tracker_of_its_area_says_nothing_stays_as_it_was_told() {
    let state = crate::doors::DoorHandle::new(&Site::parse("site", DOOR).unwrap(), None).states().remove(0);
    let mut outbox = outbox();
    let mut told = |doors: &[DoorLine], now_ms| {
        let shared = json!({ "source": "area", "of": "west", "name": "same-name", "text": "…" });
        let mut part = frame();
        part.alarms = vec![serde_json::from_value(shared).unwrap()];
        part.doors = doors.to_vec();
        let told = outbox.due(Some(&part), now_ms);
        told.iter().filter(|told| told.topic.contains("/door/")).count()
    };
    let door = [state.line];
    assert_eq!([told(&door, 0), told(&[], 100), told(&door, 200)], [1, 0, 0]);
}

#[test]
fn an_input_that_the_broker_keeps_is_never_published_on() {
    let mut outbox = outbox();
    let inputs = ["door/front/exit", "door/gone/lock/ready", "module/left/restart", "sign"];
    let inputs = inputs.map(|input| format!("kehai/front-door/{input}"));
    inputs.iter().for_each(|input| outbox.retained(input, b""));
    outbox.retained("kehai/front-door/zone/cellar", b"");
    let published = outbox.due(Some(&frame()), 0);
    assert!(topics_of(&published).contains(&"kehai/front-door/zone/cellar"));
    assert!(published.iter().all(|publication| !inputs.contains(&publication.topic)), "{published:?}");
}

#[test]
fn a_last_will_that_comes_late_is_taken_back() {
    let mut outbox = outbox();
    let online = Publication { topic: topics().status(), payload: "online".into() };
    assert_eq!(outbox.due(Some(&frame()), 0).last(), Some(&online));
    outbox.said_offline();
    assert_eq!(outbox.due(Some(&frame()), 100), [online]);
    assert_eq!(outbox.due(None, 3_100), [outbox.farewell()]);
    outbox.said_offline();
    assert_eq!(outbox.due(None, 3_200), [], "so it is");
}

#[test]
fn without_frames_everything_is_offline_and_with_the_next_it_is_back() {
    let mut outbox = outbox();
    assert_eq!(outbox.due(None, 0), [outbox.farewell()]);
    assert_eq!(outbox.due(Some(&Snapshot::default()), 100), [], "nothing is known before the first line");
    outbox.due(Some(&frame()), 200);
    assert_eq!(outbox.due(None, 3_100), []);
    assert_eq!(outbox.due(None, 3_200), [outbox.farewell()]);
    let back = outbox.due(Some(&frame()), 9_000);
    assert_eq!(back, [Publication { topic: topics().status(), payload: "online".into() }]);
}
