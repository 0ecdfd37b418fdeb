//! Alarms as topics: one each while it stands, and how many there are.
//!
//! ```text
//!   kehai/SITE/alarms                     {"standing":2,"unacknowledged":1,"severity":"failed"}
//!   kehai/SITE/alarm/module/MODULE/NAME   {"severity":"degraded","text":"…","since_ms":…,"acknowledged":null}
//!   kehai/SITE/alarm/door/DOOR/NAME       the same; taken away from the broker when it is over
//!   kehai/SITE/alarm/zone/ZONE/NAME
//!   kehai/SITE/alarm/area/AREA/NAME       by `kehai-tracker site`
//!   kehai/SITE/alarm/tracker/NAME
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::messages::{doors, modules, zones};
use super::payloads::{Alarm, Alarms, written};
use super::topics::{State, Topics, slugs};
use kehai_tracking::alarm_list::{About, ListedAlarm};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// Every state about alarms, by its topic. Those of modules without a place in the site are not this site's.
pub fn states(frame: &Snapshot, site: &Site, topics: &Topics) -> BTreeMap<String, State> {
    let modules: BTreeMap<&str, String> =
        modules(frame, site).into_iter().map(|(slug, line)| (line.name.as_str(), slug)).collect();
    let doors: BTreeMap<&str, String> = doors(frame).into_iter().collect();
    let zones: BTreeMap<&str, String> = zones(frame, site).into_iter().collect();
    let areas: BTreeMap<&str, String> = areas(frame).into_iter().collect();
    let place = |alarm: &ListedAlarm| match alarm.about {
        About::Tracker => Some("tracker".to_owned()),
        About::Module => Some(format!("module/{}", modules.get(alarm.of.as_str())?)),
        About::Door => Some(format!("door/{}", doors.get(alarm.of.as_str())?)),
        About::Zone => Some(format!("zone/{}", zones.get(alarm.of.as_str())?)),
        About::Area => Some(format!("area/{}", areas.get(alarm.of.as_str())?)),
    };
    let listed: Vec<(String, &ListedAlarm)> =
        frame.alarms.iter().filter_map(|alarm| Some((place(alarm)?, alarm))).collect();
    let unacknowledged = listed.iter().filter(|(_, alarm)| alarm.acknowledged.is_none()).count();
    let worst = listed.iter().map(|(_, alarm)| alarm.severity).max();
    let all = Alarms { severity: worst, standing: listed.len(), unacknowledged };
    let mut states = BTreeMap::from([(format!("{}/alarms", topics.site()), State::at_once(written(&all)))]);
    for (place, alarm) in listed {
        let payload = Alarm {
            acknowledged: alarm.acknowledged.clone(),
            severity: alarm.severity,
            since_ms: alarm.since_ms,
            text: alarm.text.clone(),
        };
        // Other words for the same wait, as figures do.
        let urgent = format!("{} {:?}", alarm.id, alarm.acknowledged);
        let topic = format!("{}/alarm/{place}/{}", topics.site(), alarm.cause.name());
        states.insert(topic, State { payload: written(&payload), urgent });
    }
    states
}

/// The areas that alarms are about, with their slugs. A frame names no other areas: of two that are alike, the first by its name of
/// those with an alarm has the plain word.
fn areas(frame: &Snapshot) -> Vec<(&str, String)> {
    let about = frame.alarms.iter().filter(|alarm| alarm.about == About::Area);
    let names: BTreeSet<&str> = about.map(|alarm| alarm.of.as_str()).collect();
    slugs(names.into_iter())
}

#[cfg(test)]
mod tests {
    use super::super::messages::tests::{frame, site, topics};
    use super::*;
    use kehai_tracking::alarm::{Active, AlarmKind, AlarmLine, Cause, Source};
    use kehai_tracking::alarm_list::AlarmList;
    use kehai_tracking::now::Now;
    use kehai_tracking::snapshot::active_alarms;
    use serde_json::json;

    #[test]
    fn an_alarm_has_a_topic_while_it_stands_and_one_of_another_site_has_none() {
        let (mut frame, mut list) = (frame(), AlarmList::new(1));
        for module in &mut frame.modules {
            module.alarms = vec![AlarmLine::new(AlarmKind::Dirty, "clean it")];
        }
        let own = [AlarmLine::new(AlarmKind::Database, "disk full")];
        let mut listed = |frame: &mut Snapshot| {
            let crowded = |zone: &str| Active {
                source: Source::Zone(zone.into()),
                cause: Cause::Fault(AlarmKind::Crowded),
                text: "let some leave".into(),
            };
            let zones = [crowded("玄関"), crowded("gone")];
            list.observe(
                Now { steady_s: 0.1, unix_ms: 100 },
                active_alarms(&own, &frame.modules, &frame.doors).chain(zones),
            );
            list.acknowledge(&[1], "anna", 200).unwrap();
            frame.alarms = list.standing().to_vec();
            states(frame, &site(), &topics())
        };
        let now = listed(&mut frame);
        let topics_of: Vec<&str> = now.keys().map(String::as_str).collect();
        let dirty = "kehai/front-door/alarm/module/left/dirty";
        let database = "kehai/front-door/alarm/tracker/database";
        let crowded = "kehai/front-door/alarm/zone/u7384u95a2/crowded";
        assert_eq!(topics_of, [dirty, database, crowded, "kehai/front-door/alarms"]);
        let payload: serde_json::Value = serde_json::from_str(&now[database].payload).unwrap();
        let expected = json!({
            "severity": "failed", "text": "disk full", "since_ms": 100, "acknowledged": { "by": "anna", "at_ms": 200 }
        });
        assert_eq!(payload, expected);
        let all = r#"{"severity":"failed","standing":3,"unacknowledged":2}"#;
        assert_eq!(now["kehai/front-door/alarms"].payload, all);
        frame.modules.clear();
        let none = r#"{"severity":"failed","standing":2,"unacknowledged":1}"#;
        assert_eq!(listed(&mut frame)["kehai/front-door/alarms"].payload, none);
    }

    #[test]
    fn areas_have_topics_like_zones_and_two_that_are_alike_have_two() {
        let (mut frame, mut list) = (frame(), AlarmList::new(1));
        let lost = |area: &str| Active {
            source: Source::Area(area.into()),
            cause: Cause::Fault(AlarmKind::Silent),
            text: format!("nothing is heard of {area}"),
        };
        list.observe(Now { steady_s: 0.1, unix_ms: 100 }, ["hall", "玄関", "Hall"].map(lost));
        frame.alarms = list.standing().to_vec();
        let states = states(&frame, &Site::default(), &topics());
        for (slug, area) in [("hall", "Hall"), ("hall-2", "hall"), ("u7384u95a2", "玄関")] {
            let state = &states[&format!("kehai/front-door/alarm/area/{slug}/silent")];
            assert!(state.payload.contains(&lost(area).text), "{slug}: {}", state.payload);
        }
        assert_eq!(states.len(), 4, "{states:?}");
    }
}
