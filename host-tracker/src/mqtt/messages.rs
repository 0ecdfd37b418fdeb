//! A frame as topics and payloads. Nothing here knows a broker or a time.

use std::collections::BTreeMap;

use super::holds::Holds;
use super::payloads::{Availability, Line, Module, Name, Total, Tracker, Zone, written};
use super::topics::{State, Topics, slugs};
use kehai_tracking::alarm::{AlarmKind, Cause};
use kehai_tracking::alarm_list::{About, ListedAlarm};
use kehai_tracking::door::{DoorLine, Input};
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::lines::CrossedLine;
use kehai_tracking::names::NameLine;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};

/// The modules that are published, each with its word in topics.
pub(super) fn modules<'a>(frame: &'a Snapshot, site: &Site) -> Vec<(String, &'a ModuleLine)> {
    let lines: Vec<&ModuleLine> = frame.own_modules(site).collect();
    let slugs = slugs(lines.iter().map(|line| line.name.as_str()));
    slugs.into_iter().map(|(_, slug)| slug).zip(lines).collect()
}

fn availability(is: bool) -> State {
    State::at_once(if is { Availability::Online } else { Availability::Offline }.name().to_owned())
}

/// Every state of a frame by its topic, but for [`Topics::status`].
#[must_use]
pub fn states(frame: &Snapshot, site: &Site, topics: &Topics, holds: &Holds) -> BTreeMap<String, State> {
    let mut states = BTreeMap::new();
    states.insert(format!("{}/tracker", topics.site()), tracker_state(frame));
    let (topic, total) = (format!("{}/total", topics.site()), frame.total);
    states.insert(format!("{topic}/availability"), availability(total.state != ZoneKnown::Unknown));
    let occupied = total.count.map(|count| count > 0);
    let payload = Total { count: total.count, occupied, state: total.state };
    states.insert(topic, State::at_once(written(&payload)));
    for (name, slug) in zones(frame, site) {
        let Some(zone) = frame.line.zones.get(name) else { continue };
        let topic = format!("{}/zone/{slug}", topics.site());
        states.insert(format!("{topic}/availability"), availability(zone.state() != ZoneKnown::Unknown));
        let count = zone.count();
        let payload = Zone {
            alarms: faults(frame, About::Zone, name),
            count,
            occupied: holds.is_occupied(name, count),
            state: zone.state(),
        };
        states.insert(topic, State::at_once(written(&payload)));
    }
    for (line, (_, slug)) in frame.lines.iter().zip(lines(frame)) {
        let topic = format!("{}/line/{slug}", topics.site());
        states.insert(format!("{topic}/availability"), availability(line.state != ZoneKnown::Unknown));
        states.insert(topic, line_state(line));
    }
    for (slug, module) in modules(frame, site) {
        let topic = format!("{}/module/{slug}", topics.site());
        states.insert(format!("{topic}/availability"), availability(module.state != DeviceState::Missing));
        states.insert(topic, module_state(module));
    }
    for (door, (_, slug)) in frame.doors.iter().zip(doors(frame)) {
        // Which track shows which card is private, and left out.
        let line = DoorLine { names: Vec::new(), ..door.clone() };
        states.insert(format!("{}/door/{slug}", topics.site()), State::at_once(written(&line)));
    }
    states.extend(named(frame, topics));
    states
}

/// Each ID that is known, by the first digits of its hash. A change of the track or of its
/// zones is told at once, the rest waits.
fn named(frame: &Snapshot, topics: &Topics) -> Vec<(String, State)> {
    let state = |(name, (_, slug)): (&NameLine, (&str, String))| {
        let likeliest = name.tracks.first();
        let track = likeliest
            .and_then(|likeliest| frame.line.tracks.iter().find(|track| track.id == likeliest.track));
        let payload = Name {
            heard_s: name.heard_s,
            probability: likeliest.map(|likeliest| likeliest.probability),
            track: likeliest.map(|likeliest| likeliest.track),
            x: track.map(|track| track.x),
            y: track.map(|track| track.y),
            zones: name.zones.clone(),
        };
        let urgent = format!("{:?} {:?}", likeliest.map(|likeliest| likeliest.track), name.zones);
        (format!("{}/name/{slug}", topics.site()), State { payload: written(&payload), urgent })
    };
    frame.names.iter().zip(slugs(frame.names.iter().map(|name| name.label.as_str()))).map(state).collect()
}

/// The counting lines of a frame with their slugs, in its order.
pub(super) fn lines(frame: &Snapshot) -> Vec<(&str, String)> {
    slugs(frame.lines.iter().map(|line| line.name.as_str()))
}

/// Crossings are told at once; for how long the line was not seen waits.
fn line_state(line: &CrossedLine) -> State {
    let &CrossedLine { inward, outward, state, unknown_s, .. } = line;
    let payload = Line { inward, outward, state, unknown_s };
    State { payload: written(&payload), urgent: format!("{state:?} {inward:?} {outward:?}") }
}

/// The doors of a frame with their slugs, in its order.
pub(super) fn doors(frame: &Snapshot) -> Vec<(&str, String)> {
    slugs(frame.doors.iter().map(|door| door.name.as_str()))
}

/// Zones with the word of each in topics. Of two that are alike the earlier in the site's file has the plain word, so that one which
/// is added takes no other's topic; a zone that the site has no more comes last.
pub(super) fn zones<'a>(frame: &'a Snapshot, site: &Site) -> Vec<(&'a str, String)> {
    let place = |name: &str| site.zones.iter().position(|zone| zone.name == name).unwrap_or(usize::MAX);
    let mut names: Vec<&str> = frame.line.zones.keys().map(String::as_str).collect();
    names.sort_by_key(|name| place(name));
    slugs(names.into_iter())
}

/// Each door with the topic in front of its outputs.
pub fn door_topics(frame: &Snapshot, topics: &Topics) -> Vec<(String, String)> {
    let topic = |(name, slug): (&str, String)| (name.to_owned(), format!("{}/door/{slug}", topics.site()));
    doors(frame).into_iter().map(topic).collect()
}

/// The door and the input a topic is for, if it is for one.
#[must_use]
pub fn door_input(frame: &Snapshot, topics: &Topics, topic: &str) -> Option<(String, Input)> {
    let rest = topic.strip_prefix(&topics.site())?.strip_prefix("/door/")?;
    let (slug, input) = rest.split_once('/')?;
    let name = doors(frame).into_iter().find(|(_, known)| known == slug)?.0;
    Some((name.to_owned(), Input::named(input)?))
}

/// An alarm that stands, with its kind; none if it is about what happens at a door.
fn fault(alarm: &ListedAlarm) -> Option<(AlarmKind, &ListedAlarm)> {
    match alarm.cause {
        Cause::Fault(kind) => Some((kind, alarm)),
        Cause::Door(_) => None,
    }
}

/// Those about something of this name.
fn faults(frame: &Snapshot, about: About, name: &str) -> Vec<AlarmKind> {
    let of = frame.alarms.iter().filter(|alarm| alarm.about == about && alarm.of == name);
    of.filter_map(fault).map(|(kind, _)| kind).collect()
}

/// The words of alarms change with their figures, which wait.
fn tracker_state(frame: &Snapshot) -> State {
    // Those of areas stand where several trackers are one site.
    let own = |alarm: &&ListedAlarm| matches!(alarm.about, About::Tracker | About::Area);
    let own: Vec<(AlarmKind, &ListedAlarm)> = frame.alarms.iter().filter(own).filter_map(fault).collect();
    let alarms: Vec<AlarmKind> = own.iter().map(|(kind, _)| *kind).collect();
    let texts = own.iter().map(|(_, alarm)| alarm.text.as_str());
    let urgent = format!("{alarms:?}");
    let payload = Tracker { alarm: in_one(texts), alarms, version: env!("CARGO_PKG_VERSION") };
    State { payload: written(&payload), urgent }
}

/// Several texts as one, none if there are none. Home Assistant accepts no longer states.
fn in_one<'a>(texts: impl Iterator<Item = &'a str>) -> Option<String> {
    let texts: Vec<&str> = texts.collect();
    (!texts.is_empty()).then(|| texts.join("; ").chars().take(250).collect())
}

fn module_state(module: &ModuleLine) -> State {
    let there = module.state != DeviceState::Missing;
    let of = |value: f64| there.then_some(value);
    let percent = |share: f64| of((share * 1e3).round() / 10.0);
    let alarms: Vec<AlarmKind> = module.alarms.iter().map(|alarm| alarm.kind).collect();
    let urgent = format!("{} {alarms:?}", module.state);
    let payload = Module {
        address: module.address.clone(),
        alarm: in_one(module.alarms.iter().map(|alarm| alarm.text.as_str())),
        alarms,
        background_age_s: module.background_age_s.and_then(of),
        checksum_errors: module.checksum_errors,
        clock_jitter_ms: module.clock_jitter_ms.and_then(of),
        clock_offset_ms: module.clock_offset_ms.and_then(of),
        id: module.id.clone(),
        lost_percent: module.lost_share.and_then(percent),
        scans_hz: of(module.scans_hz),
        state: module.state,
        unknown_percent: percent(module.unknown_share),
    };
    State { payload: written(&payload), urgent }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use kehai_tracking::alarm::AlarmLine;
    use kehai_tracking::jsonl::ZoneLine;
    use kehai_tracking::occupancy::Found;
    use serde_json::{Value, json};

    pub fn topics() -> Topics {
        Topics {
            title: "Front Door".into(),
            prefix: "kehai".into(),
            home_assistant: Some("homeassistant".into()),
        }
    }

    pub fn zone(count: u32, state: ZoneKnown) -> ZoneLine {
        ZoneLine::new(Found::inside(count, vec![1.0]), 1.0, state)
    }

    /// With the module of [`frame`] that is its own.
    pub fn site() -> Site {
        Site::parse("site", "[[module]]\nname = \"left\"\nx = 0\ny = 0.5\n").unwrap()
    }

    /// Two zones and two modules, one of which belongs to another site.
    pub fn frame() -> Snapshot {
        let mut frame = Snapshot { unix_ms: 1, ..Snapshot::default() };
        frame.line.zones.insert("hall".into(), zone(2, ZoneKnown::Known));
        frame.line.zones.insert("玄関".into(), zone(1, ZoneKnown::Unknown));
        let module = |name: &str, state| ModuleLine {
            name: name.into(),
            state,
            scans_hz: 9.8,
            ..ModuleLine::default()
        };
        frame.modules = vec![module("left", DeviceState::Watching), module("stranger", DeviceState::Found)];
        frame
    }

    fn json_of(states: &BTreeMap<String, State>, topic: &str) -> Value {
        serde_json::from_str(&states[topic].payload).unwrap()
    }

    #[test]
    fn a_zone_that_is_added_takes_no_others_topic() {
        let counts = |names: &[&str]| {
            let polygon = "polygon = [[0, 0], [1, 0], [1, 1]]";
            let zones = names.iter().map(|name| format!("[[zone]]\nname = \"{name}\"\n{polygon}\n"));
            let site = Site::parse("site", &zones.collect::<String>()).unwrap();
            let mut frame = Snapshot::default();
            for (name, count) in [("hall", 1), ("Hall", 2), ("gone", 3)] {
                if names.contains(&name) || name == "gone" {
                    frame.line.zones.insert(name.into(), zone(count, ZoneKnown::Known));
                }
            }
            let states = states(&frame, &site, &topics(), &Holds::default());
            let count =
                |slug: &str| json_of(&states, &format!("kehai/front-door/zone/{slug}"))["count"].clone();
            let second = states.contains_key("kehai/front-door/zone/hall-2").then(|| count("hall-2"));
            (count("hall"), second, count("gone"))
        };
        assert_eq!(counts(&["hall"]), (json!(1), None, json!(3)));
        assert_eq!(
            counts(&["hall", "Hall"]),
            (json!(1), Some(json!(2)), json!(3)),
            "the earlier keeps its topic"
        );
        assert_eq!(counts(&["Hall", "hall"]), (json!(2), Some(json!(1)), json!(3)));
    }

    #[test]
    fn a_zone_is_told_with_count_and_occupancy_and_an_unknown_one_with_neither() {
        let mut frame = frame();
        frame.line.zones.insert("part".into(), zone(0, ZoneKnown::Partly));
        let states = states(&frame, &Site::default(), &topics(), &Holds::default());
        let hall = "kehai/front-door/zone/hall";
        assert_eq!(
            json_of(&states, hall),
            json!({ "alarms": [], "state": "known", "occupied": true, "count": 2 })
        );
        assert_eq!(states[&format!("{hall}/availability")].payload, "online");
        let part = json_of(&states, "kehai/front-door/zone/part");
        assert_eq!(part, json!({ "alarms": [], "state": "partly", "occupied": null, "count": null }));
        let unknown = "kehai/front-door/zone/u7384u95a2";
        let nothing = json!({ "alarms": [], "state": "unknown", "occupied": null, "count": null });
        assert_eq!(json_of(&states, unknown), nothing);
        assert_eq!(states[&format!("{unknown}/availability")].payload, "offline");
    }

    #[test]
    fn a_line_is_told_with_both_counts() {
        let line = |counted, state, unknown_s| CrossedLine {
            name: "Front".into(),
            inward: counted,
            outward: counted,
            state,
            unknown_s,
            unfollowed: 0,
        };
        let frame = |line| Snapshot { lines: vec![line], ..Snapshot::default() };
        let topic = "kehai/front-door/line/front";
        let known = states(
            &frame(line(Some(3), ZoneKnown::Known, 0.0)),
            &Site::default(),
            &topics(),
            &Holds::default(),
        );
        let told = json!({ "state": "known", "in": 3, "out": 3, "unknown_s": 0.0 });
        assert_eq!(json_of(&known, topic), told);
        let unknown = states(
            &frame(line(None, ZoneKnown::Unknown, 1.0)),
            &Site::default(),
            &topics(),
            &Holds::default(),
        );
        assert_eq!(json_of(&unknown, topic)["in"], Value::Null);
        assert_eq!(unknown[&format!("{topic}/availability")].payload, "offline");
        let later = states(
            &frame(line(None, ZoneKnown::Unknown, 2.0)),
            &Site::default(),
            &topics(),
            &Holds::default(),
        );
        assert_eq!(later[topic].urgent, unknown[topic].urgent, "time alone is not told at once");
    }

    #[test]
    fn a_module_is_told_with_its_alarms_and_a_missing_one_without_figures() {
        let mut frame = frame();
        let topic = "kehai/front-door/module/left";
        let known = states(&frame, &site(), &topics(), &Holds::default());
        assert!(known.keys().all(|topic| !topic.contains("stranger")), "{known:?}");
        let told = json_of(&known, topic);
        assert_eq!(
            (&told["state"], &told["alarm"], &told["scans_hz"]),
            (&json!("watching"), &Value::Null, &json!(9.8))
        );
        let unmeasured = (&told["lost_percent"], &told["clock_jitter_ms"]);
        assert_eq!(unmeasured, (&Value::Null, &Value::Null), "never measured, not 0");
        frame.modules[0].state = DeviceState::Missing;
        frame.modules[0].alarms = vec![AlarmLine::new(AlarmKind::Silent, "nothing is heard")];
        let missing = states(&frame, &site(), &topics(), &Holds::default());
        let told = json_of(&missing, topic);
        assert_eq!((&told["alarms"], &told["alarm"]), (&json!(["silent"]), &json!("nothing is heard")));
        assert_eq!((&told["scans_hz"], &told["lost_percent"]), (&Value::Null, &Value::Null));
        assert_eq!(missing[&format!("{topic}/availability")].payload, "offline");
        assert_ne!(missing[topic].urgent, known[topic].urgent);
    }

    #[test]
    fn a_module_of_another_site_is_not_told_when_it_is_switched_off_and_a_floor_of_the_site_is() {
        let mut frame = frame();
        frame.modules[1].state = DeviceState::Missing;
        let mat = ModuleLine { name: "mat".into(), state: DeviceState::Watching, ..ModuleLine::default() };
        frame.modules.push(mat);
        let floor = "[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 4\nrows = 4\n";
        let told = |site: &Site| modules(&frame, site).into_iter().map(|(slug, _)| slug).collect::<Vec<_>>();
        assert_eq!(told(&Site::parse("site", floor).unwrap()), ["mat"]);
        assert_eq!(told(&site()), ["left"]);
        assert_eq!(told(&Site::default()), [] as [String; 0]);
    }
}
