//! A frame as topics and payloads. Nothing here knows a broker or a time.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use kehai_tracking::door::{DoorLine, Input};
use kehai_tracking::jsonl::{ZoneKnown, ZoneLine};
use kehai_tracking::names::NameLine;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};

/// Where everything goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// The site's name, as people read it.
    pub title: String,
    /// In front of everything.
    pub prefix: String,
    /// Prefix of the topics of Home Assistant's discovery; none: nothing is published there.
    pub home_assistant: Option<String>,
}

/// A state: what is sent, and the part of it that is sent at once when it changes; the rest waits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    pub payload: String,
    pub urgent: String,
}

impl State {
    fn at_once(payload: String) -> Self {
        Self { urgent: payload.clone(), payload }
    }
}

impl Topics {
    /// Of the site itself: whether the tracker runs.
    #[must_use]
    pub fn status(&self) -> String {
        format!("{}/status", self.site())
    }

    /// In front of everything about this site.
    #[must_use]
    pub fn site(&self) -> String {
        format!("{}/{}", self.prefix, slug(&self.title))
    }

    /// Where readers of cards and tags publish what they have read.
    #[must_use]
    pub fn sign(&self) -> String {
        format!("{}/sign", self.site())
    }

    /// The site among Home Assistant's devices. Slugs have no `_`: one site's devices are never another's.
    fn device(&self) -> String {
        format!("kehai_{}", slug(&self.title))
    }

    /// Whether a topic is one of this site's, by any sender at any time.
    #[must_use]
    pub fn owns(&self, topic: &str) -> bool {
        if topic.strip_prefix(&self.site()).is_some_and(|rest| rest.starts_with('/')) {
            return true;
        }
        let Some(prefix) = &self.home_assistant else { return false };
        let device = topic
            .strip_prefix(prefix)
            .and_then(|rest| rest.strip_prefix("/device/"))
            .and_then(|rest| rest.strip_suffix("/config"))
            .and_then(|id| id.strip_prefix(&self.device()));
        device.is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    }

    /// What to subscribe to, to see everything that [`owns`](Self::owns) is true of.
    #[must_use]
    pub fn filters(&self) -> Vec<String> {
        let discovery = self.home_assistant.iter().map(|prefix| format!("{prefix}/device/+/config"));
        std::iter::once(format!("{}/#", self.site())).chain(discovery).collect()
    }
}

/// Letters and digits of ASCII in lower case, `-` for the rest of it, other letters by their number: what every
/// topic and identifier may hold.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for letter in name.chars() {
        if letter.is_ascii_alphanumeric() {
            slug.push(letter.to_ascii_lowercase());
        } else if letter.is_ascii() {
            slug.push('-');
        } else {
            slug.push_str(&format!("u{:x}", u32::from(letter)));
        }
    }
    slug
}

/// Names with their slugs, each its own: the second of two that are alike gets a number.
fn slugs<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, String)> {
    let mut slugs: Vec<(&str, String)> = Vec::new();
    for name in names {
        let plain = slug(name);
        let taken = |slug: &str| slugs.iter().any(|(_, known)| known == slug);
        let numbered = (2..).map(|number| format!("{plain}-{number}"));
        let own = std::iter::once(plain.clone()).chain(numbered).find(|slug| !taken(slug));
        slugs.push((name, own.unwrap_or_default()));
    }
    slugs
}

/// The modules that are published: those of the site. A module that was only found is not this site's.
fn modules(frame: &Snapshot) -> Vec<(String, &ModuleLine)> {
    let lines = frame.modules.iter().filter(|line| line.state != DeviceState::Found);
    let lines: Vec<&ModuleLine> = lines.collect();
    let slugs = slugs(lines.iter().map(|line| line.name.as_str()));
    slugs.into_iter().map(|(_, slug)| slug).zip(lines).collect()
}

fn availability(is: bool) -> State {
    State::at_once(if is { "online" } else { "offline" }.to_owned())
}

/// Every state of a frame by its topic, but for [`Topics::status`].
#[must_use]
pub fn states(frame: &Snapshot, topics: &Topics) -> BTreeMap<String, State> {
    let mut states = BTreeMap::new();
    for ((_, slug), zone) in
        slugs(frame.line.zones.keys().map(String::as_str)).iter().zip(frame.line.zones.values())
    {
        let topic = format!("{}/zone/{slug}", topics.site());
        states.insert(format!("{topic}/availability"), availability(zone.state() != ZoneKnown::Unknown));
        states.insert(topic, State::at_once(zone_payload(zone)));
    }
    for (slug, module) in modules(frame) {
        let topic = format!("{}/module/{slug}", topics.site());
        states.insert(format!("{topic}/availability"), availability(module.state != DeviceState::Missing));
        states.insert(topic, module_state(module));
    }
    for (door, (_, slug)) in frame.doors.iter().zip(doors(frame)) {
        // Which track shows which card is private, and left out.
        let line = DoorLine { names: Vec::new(), ..door.clone() };
        let payload = serde_json::to_string(&line).unwrap_or_default();
        states.insert(format!("{}/door/{slug}", topics.site()), State::at_once(payload));
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
        let payload = json!({
            "track": likeliest.map(|likeliest| likeliest.track),
            "probability": likeliest.map(|likeliest| likeliest.probability),
            "x": track.map(|track| track.x),
            "y": track.map(|track| track.y),
            "zones": name.zones,
            "heard_s": name.heard_s,
        });
        let urgent = format!("{:?} {:?}", likeliest.map(|likeliest| likeliest.track), name.zones);
        (format!("{}/name/{slug}", topics.site()), State { payload: payload.to_string(), urgent })
    };
    frame.names.iter().zip(slugs(frame.names.iter().map(|name| name.label.as_str()))).map(state).collect()
}

/// The doors of a frame with their slugs, in its order.
fn doors(frame: &Snapshot) -> Vec<(&str, String)> {
    slugs(frame.doors.iter().map(|door| door.name.as_str()))
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

/// What is not known is null, never 0.
fn zone_payload(zone: &ZoneLine) -> String {
    let count = zone.count();
    json!({ "state": zone.state(), "occupied": count.map(|count| count > 0), "count": count }).to_string()
}

fn module_state(module: &ModuleLine) -> State {
    let there = module.state != DeviceState::Missing;
    let of = |value: f64| there.then_some(value);
    let percent = |share: f64| of((share * 1e3).round() / 10.0);
    let names: Vec<&str> = module.alarms.iter().map(|alarm| alarm.kind.name()).collect();
    let texts: Vec<&str> = module.alarms.iter().map(|alarm| alarm.text.as_str()).collect();
    let payload = json!({
        "state": module.state,
        "alarms": names,
        // Home Assistant accepts no longer states.
        "alarm": (!texts.is_empty()).then(|| texts.join("; ").chars().take(250).collect::<String>()),
        "scans_hz": of(module.scans_hz),
        "lost_percent": percent(module.lost_share),
        "unknown_percent": percent(module.unknown_share),
        "checksum_errors": module.checksum_errors,
        "clock_offset_ms": module.clock_offset_ms.and_then(of),
        "clock_jitter_ms": of(module.clock_jitter_ms),
        "background_age_s": module.background_age_s.and_then(of),
        "address": module.address,
        "id": module.id,
    });
    State { payload: payload.to_string(), urgent: format!("{} {names:?}", module.state) }
}

/// The discovery messages for Home Assistant, by topic; none if there is no prefix.
#[must_use]
pub fn discovery(frame: &Snapshot, topics: &Topics) -> BTreeMap<String, String> {
    let Some(prefix) = &topics.home_assistant else { return BTreeMap::new() };
    let site = topics.device();
    let mut configs = BTreeMap::new();
    let mut add = |device: Value, id: &str, components: Value| {
        let config = json!({ "device": device, "origin": origin(), "components": components });
        configs.insert(format!("{prefix}/device/{id}/config"), config.to_string());
    };
    let device =
        json!({ "identifiers": [site], "name": topics.title, "manufacturer": "kehai", "model": "tracker" });
    add(device, &site, zone_components(frame, topics));
    for (slug, module) in modules(frame) {
        let id = format!("{site}_{slug}");
        let device = json!({
            "identifiers": [id],
            "name": format!("{} {}", topics.title, module.name),
            "manufacturer": "kehai",
            "model": "module",
            "via_device": site,
        });
        add(device, &id, module_components(&id, &slug, topics));
    }
    configs
}

fn origin() -> Value {
    json!({ "name": "kehai", "sw_version": env!("CARGO_PKG_VERSION") })
}

fn available(topics: &Topics, own: Option<String>) -> Value {
    let topics = std::iter::once(topics.status()).chain(own).map(|topic| json!({ "topic": topic }));
    Value::Array(topics.collect())
}

fn zone_components(frame: &Snapshot, topics: &Topics) -> Value {
    let mut components = serde_json::Map::new();
    for (name, slug) in slugs(frame.line.zones.keys().map(String::as_str)) {
        let topic = format!("{}/zone/{slug}", topics.site());
        let component = |kind: &str, more: Value| {
            let mut component = json!({
                "unique_id": format!("{}_zone_{slug}_{kind}", topics.device()),
                "name": format!("{name} {kind}"),
                "state_topic": topic,
                "json_attributes_topic": topic,
                "availability": available(topics, Some(format!("{topic}/availability"))),
                "availability_mode": "all",
            });
            merge(&mut component, more);
            component
        };
        let occupied =
            "{{ 'None' if value_json.occupied is none else 'ON' if value_json.occupied else 'OFF' }}";
        let occupancy =
            json!({ "platform": "binary_sensor", "device_class": "occupancy", "value_template": occupied });
        let count = json!({
            "platform": "sensor",
            "state_class": "measurement",
            "icon": "mdi:account-multiple",
            "value_template": "{{ value_json.count }}",
        });
        components.insert(format!("zone_{slug}_occupancy"), component("occupancy", occupancy));
        components.insert(format!("zone_{slug}_count"), component("count", count));
    }
    Value::Object(components)
}

fn module_components(id: &str, slug: &str, topics: &Topics) -> Value {
    let topic = format!("{}/module/{slug}", topics.site());
    let component = |kind: &str, name: &str, always: bool, more: Value| {
        let own = (!always).then(|| format!("{topic}/availability"));
        let mut component = json!({
            "unique_id": format!("{id}_{kind}"),
            "name": name,
            "state_topic": topic,
            "entity_category": "diagnostic",
            "availability": available(topics, own),
            "availability_mode": "all",
        });
        merge(&mut component, more);
        component
    };
    let value = |key: &str| format!("{{{{ value_json.{key} }}}}");
    let number = |unit: &str, key: &str| json!({ "platform": "sensor", "state_class": "measurement", "unit_of_measurement": unit, "value_template": value(key) });
    let problem = json!({
        "platform": "binary_sensor",
        "device_class": "problem",
        "json_attributes_topic": topic,
        "value_template": "{{ 'ON' if value_json.alarms else 'OFF' }}",
    });
    json!({
        // That something is wrong is known of a module that is missing, too.
        "problem": component("problem", "problem", true, problem),
        "alarm": component("alarm", "alarm", true, json!({ "platform": "sensor", "value_template": value("alarm") })),
        "state": component("state", "state", true, json!({ "platform": "sensor", "value_template": value("state") })),
        "scans": component("scans", "scans", false, number("Hz", "scans_hz")),
        "lost": component("lost", "lost scans", false, number("%", "lost_percent")),
        "unknown": component("unknown", "unknown beams", false, number("%", "unknown_percent")),
    })
}

fn merge(into: &mut Value, more: Value) {
    if let (Value::Object(into), Value::Object(more)) = (into, more) {
        into.extend(more);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use kehai_tracking::alarm::{AlarmKind, AlarmLine};
    use kehai_tracking::occupancy::Found;

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
    fn a_zone_is_told_with_count_and_occupancy_and_an_unknown_one_with_neither() {
        let mut frame = frame();
        frame.line.zones.insert("part".into(), zone(0, ZoneKnown::Partly));
        let states = states(&frame, &topics());
        let hall = "kehai/front-door/zone/hall";
        assert_eq!(json_of(&states, hall), json!({ "state": "known", "occupied": true, "count": 2 }));
        assert_eq!(states[&format!("{hall}/availability")].payload, "online");
        let part = json_of(&states, "kehai/front-door/zone/part");
        assert_eq!(part, json!({ "state": "partly", "occupied": null, "count": null }));
        let unknown = "kehai/front-door/zone/u7384u95a2";
        assert_eq!(json_of(&states, unknown), json!({ "state": "unknown", "occupied": null, "count": null }));
        assert_eq!(states[&format!("{unknown}/availability")].payload, "offline");
    }

    #[test]
    fn a_module_is_told_with_its_alarms_and_a_missing_one_without_figures() {
        let mut frame = frame();
        let topic = "kehai/front-door/module/left";
        let known = states(&frame, &topics());
        assert!(known.keys().all(|topic| !topic.contains("stranger")), "{known:?}");
        let told = json_of(&known, topic);
        assert_eq!(
            (&told["state"], &told["alarm"], &told["scans_hz"]),
            (&json!("watching"), &Value::Null, &json!(9.8))
        );
        frame.modules[0].state = DeviceState::Missing;
        frame.modules[0].alarms = vec![AlarmLine::new(AlarmKind::Silent, "nothing is heard")];
        let missing = states(&frame, &topics());
        let told = json_of(&missing, topic);
        assert_eq!((&told["alarms"], &told["alarm"]), (&json!(["silent"]), &json!("nothing is heard")));
        assert_eq!((&told["scans_hz"], &told["lost_percent"]), (&Value::Null, &Value::Null));
        assert_eq!(missing[&format!("{topic}/availability")].payload, "offline");
        assert_ne!(missing[topic].urgent, known[topic].urgent);
    }

    #[test]
    fn home_assistant_gets_a_device_for_the_site_and_one_for_each_module() {
        let configs = discovery(&frame(), &topics());
        let topics_of: Vec<&String> = configs.keys().collect();
        let (site, left) = (
            "homeassistant/device/kehai_front-door/config",
            "homeassistant/device/kehai_front-door_left/config",
        );
        assert_eq!(topics_of, [site, left]);
        let config: Value = serde_json::from_str(&configs[site]).unwrap();
        let states = states(&frame(), &topics());
        let mut ids = Vec::new();
        for config in configs.values() {
            let config: Value = serde_json::from_str(config).unwrap();
            for component in config["components"].as_object().unwrap().values() {
                assert!(states.contains_key(component["state_topic"].as_str().unwrap()), "{component}");
                for topic in component["availability"].as_array().unwrap() {
                    let topic = topic["topic"].as_str().unwrap();
                    assert!(topic == "kehai/front-door/status" || states.contains_key(topic), "{topic}");
                }
                ids.push(component["unique_id"].as_str().unwrap().to_owned());
            }
        }
        let many = ids.len();
        ids.sort();
        ids.dedup();
        assert_eq!((ids.len(), many), (10, 10));
        let occupancy = &config["components"]["zone_hall_occupancy"];
        assert_eq!(
            (&occupancy["platform"], &occupancy["device_class"]),
            (&json!("binary_sensor"), &json!("occupancy"))
        );
        assert_eq!(occupancy["availability"][1]["topic"], "kehai/front-door/zone/hall/availability");
        let silent = Topics { home_assistant: None, ..topics() };
        assert_eq!(discovery(&frame(), &silent), BTreeMap::new());
    }

    #[test]
    fn names_that_are_alike_get_topics_of_their_own() {
        let names = ["Hall 1", "hall-1", "hall_1", "hall/1/#"];
        let slugs: Vec<String> = slugs(names.into_iter()).into_iter().map(|(_, slug)| slug).collect();
        assert_eq!(slugs, ["hall-1", "hall-1-2", "hall-1-3", "hall-1--"]);
    }

    #[test]
    fn a_site_owns_its_own_topics_and_no_other_site_s() {
        let topics = topics();
        for own in ["kehai/front-door/zone/x", "homeassistant/device/kehai_front-door/config"] {
            assert!(topics.owns(own), "{own}");
        }
        assert!(topics.owns("homeassistant/device/kehai_front-door_left/config"));
        for other in [
            "kehai/front-door-2/zone/x",
            "homeassistant/device/kehai_front-door-2/config",
            "homeassistant/device/shelly/config",
            "homeassistant/status",
        ] {
            assert!(!topics.owns(other), "{other}");
        }
    }
}
