//! A frame as devices of Home Assistant.
//!
//! ```text
//!   site ──▶ homeassistant/device/kehai_SITE/config            the whole site, zones, lines, alarms
//!   module ▶ homeassistant/device/kehai_SITE_MODULE/config     what it measures and what is wrong with it
//!   door ──▶ homeassistant/device/kehai_SITE_door_DOOR/config  its phase, lock, leaf and alarm
//!              └ device: map, version, identity, room; components: `entities`
//! ```
//!
//! A device that is named no more is taken away by an empty message. A component that is named no more stays: it goes when it is
//! named once with its platform alone.
//!
//! Source: Home Assistant's MQTT discovery, *device discovery payload*, and its device registry.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value;

use super::entities::{Components, buttons, of_door, of_module, of_site};
use super::messages::{doors, modules};
use super::payloads::{Device, Discovery, Entity, Gone, Origin, written};
use super::topics::Topics;
use kehai_tracking::geometry::{Point, inside};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};

/// Our version, for Home Assistant.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What no frame says, and Home Assistant is told.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// The site in use.
    pub site: Arc<Site>,
    /// Where the live map is, for others than this machine.
    pub map_url: Option<String>,
    /// Whether modules have buttons.
    pub buttons: bool,
}

/// The discovery messages for Home Assistant, by topic; none if there is no prefix.
#[must_use]
pub fn discovery(frame: &Snapshot, about: &About, topics: &Topics) -> BTreeMap<String, String> {
    let Some(prefix) = &topics.home_assistant else { return BTreeMap::new() };
    let (id, site) = (topics.device(), &*about.site);
    let mut configs = BTreeMap::new();
    let mut add = |device: Device, components: Components| {
        let [id] = &device.identifiers;
        let topic = format!("{prefix}/device/{id}/config");
        let origin = Origin { name: "kehai", sw_version: VERSION };
        let there = |(name, component)| (name, Entity::There(Box::new(component)));
        let components = components.into_iter().map(there).collect();
        configs.insert(topic, written(&Discovery { components, device, origin }));
    };
    let device = |id: String, name: String, model| Device {
        configuration_url: about.map_url.clone(),
        identifiers: [id],
        manufacturer: "kehai",
        model,
        name,
        ..Device::default()
    };
    let tracker = Device {
        sw_version: Some(VERSION.to_owned()),
        ..device(id.clone(), topics.title.clone(), "tracker")
    };
    add(tracker, of_site(frame, site, topics));
    for (slug, module) in modules(frame, site) {
        let own = format!("{id}_{slug}");
        let said = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        let device = Device {
            // An identity is the address of its network interface.
            connections: said(&module.id).map(|mac| ["mac".to_owned(), mac]).into_iter().collect(),
            serial_number: said(&module.id),
            suggested_area: room_of(module, site),
            sw_version: said(&module.firmware),
            via_device: Some(id.clone()),
            ..device(own.clone(), format!("{} {}", topics.title, module.name), "module")
        };
        let mut components = of_module(&own, &slug, topics);
        if about.buttons {
            components.extend(buttons(&own, &slug, site, topics));
        }
        add(device, components);
    }
    for (name, slug) in doors(frame) {
        let own = format!("{id}_door_{slug}");
        let zone = site.doors.iter().find(|door| door.name == name).map(|door| door.zone.clone());
        let device = Device {
            suggested_area: zone,
            via_device: Some(id.clone()),
            ..device(own.clone(), format!("{} {name}", topics.title), "door")
        };
        add(device, of_door(&own, &slug, topics));
    }
    configs
}

/// Components of a device by their names, as they would be removed.
pub(super) type Removable = BTreeMap<String, Gone>;

/// Those of a discovery message, of this version or another; none of any other payload.
pub(super) fn removable(payload: &[u8]) -> Removable {
    #[derive(Deserialize)]
    struct Named {
        components: Removable,
    }
    serde_json::from_slice(payload).map_or_else(|_| Removable::new(), |named: Named| named.components)
}

/// A discovery message that also removes those of the components `before` that it names no more; none if it names all.
pub(super) fn parting(payload: &str, before: Removable) -> Option<String> {
    if before.is_empty() {
        return None;
    }
    let mut config: Value = serde_json::from_str(payload).ok()?;
    let components = config.get_mut("components")?.as_object_mut()?;
    let named = components.len();
    for (name, gone) in before {
        let gone = serde_json::to_value(Entity::Gone(gone)).ok()?;
        components.entry(name).or_insert(gone);
    }
    (components.len() > named).then(|| config.to_string())
}

/// The zone in which a module stands: the first that the site has there.
fn room_of(line: &ModuleLine, site: &Site) -> Option<String> {
    let module = site.modules.iter().find(|module| module.name == line.name)?;
    let at = Point::new(module.x, module.y);
    site.zones.iter().find(|zone| inside(at, &zone.corners())).map(|zone| zone.name.clone())
}

#[cfg(test)]
mod tests {
    use super::super::holds::Holds;
    use super::super::messages::states;
    use super::super::messages::tests::{frame, site, topics};
    use super::*;
    use kehai_tracking::jsonl::ZoneKnown;
    use kehai_tracking::lines::CrossedLine;
    use serde_json::{Value, json};

    #[test]
    fn a_line_is_two_sensors_that_only_grow() {
        let line = CrossedLine {
            name: "Front".into(),
            inward: Some(3),
            outward: Some(3),
            state: ZoneKnown::Known,
            unknown_s: 0.0,
            unfollowed: 0,
        };
        let topic = "kehai/front-door/line/front";
        let configs =
            discovery(&Snapshot { lines: vec![line], ..Snapshot::default() }, &About::default(), &topics());
        let site: Value =
            serde_json::from_str(&configs["homeassistant/device/kehai_front-door/config"]).unwrap();
        let inward = &site["components"]["line_front_in"];
        assert_eq!(inward["state_class"], "total_increasing");
        assert_eq!(
            (&inward["state_topic"], &inward["value_template"]),
            (&json!(topic), &json!("{{ value_json['in'] }}"))
        );
        assert!(site["components"]["line_front_out"].is_object());
    }

    #[test]
    fn home_assistant_gets_a_device_for_the_site_and_one_for_each_module() {
        let about = About { site: Arc::new(site()), ..About::default() };
        let configs = discovery(&frame(), &about, &topics());
        let topics_of: Vec<&String> = configs.keys().collect();
        let (whole, left) = (
            "homeassistant/device/kehai_front-door/config",
            "homeassistant/device/kehai_front-door_left/config",
        );
        assert_eq!(topics_of, [whole, left]);
        let config: Value = serde_json::from_str(&configs[whole]).unwrap();
        let mut states = states(&frame(), &site(), &topics(), &Holds::default());
        states.extend(super::super::alarms::states(&frame(), &site(), &topics()));
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
        assert_eq!((ids.len(), many), (16, 16));
        let occupancy = &config["components"]["zone_hall_occupancy"];
        assert_eq!(
            (&occupancy["platform"], &occupancy["device_class"]),
            (&json!("binary_sensor"), &json!("occupancy"))
        );
        assert_eq!(occupancy["availability"][1]["topic"], "kehai/front-door/zone/hall/availability");
        let silent = Topics { home_assistant: None, ..topics() };
        assert_eq!(discovery(&frame(), &about, &silent), BTreeMap::new());
    }

    #[test]
    fn a_module_has_buttons_only_if_that_was_said_and_on_a_site_with_a_door_it_only_blinks() {
        let buttons_of = |site: &str, buttons: bool| -> Vec<String> {
            let about = About { site: Arc::new(Site::parse("site", site).unwrap()), map_url: None, buttons };
            let config =
                &discovery(&frame(), &about, &topics())["homeassistant/device/kehai_front-door_left/config"];
            let config: Value = serde_json::from_str(config).unwrap();
            let all = config["components"].as_object().unwrap().iter();
            let buttons = all.filter(|(_, component)| component["platform"] == "button");
            buttons.map(|(_, button)| button["command_topic"].as_str().unwrap().to_owned()).collect()
        };
        let topic = |name: &str| format!("kehai/front-door/module/left/{name}");
        let left = "[[module]]\nname = \"left\"\nx = 0\ny = 0.5\n";
        assert_eq!(buttons_of(left, false), [] as [String; 0]);
        assert_eq!(buttons_of(left, true), ["identify", "learn", "restart"].map(topic));
        assert_eq!(buttons_of(SITE, true), [topic("identify")]);
    }

    #[test]
    fn a_component_that_is_named_no_more_is_removed_by_its_platform_alone() {
        let payload = |names: &[&str]| {
            let component = |name: &&str| ((*name).to_owned(), json!({ "platform": "sensor", "name": name }));
            let components: serde_json::Map<String, Value> = names.iter().map(component).collect();
            json!({ "components": components, "device": {} }).to_string()
        };
        let before = removable(payload(&["hall", "cellar"]).as_bytes());
        let parting_of = |names: &[&str]| parting(&payload(names), before.clone());
        let said: Value = serde_json::from_str(&parting_of(&["hall", "attic"]).unwrap()).unwrap();
        assert_eq!(said["components"]["cellar"], json!({ "platform": "sensor" }));
        assert_eq!(said["components"]["hall"]["name"], "hall");
        assert_eq!(said["components"].as_object().unwrap().len(), 3);
        assert_eq!(parting_of(&["attic", "cellar", "hall"]), None);
        for other in ["", "online", "{}", "[]", "{\"components\": {\"hall\": {}}}"] {
            assert!(removable(other.as_bytes()).is_empty(), "{other}");
        }
        assert_eq!(parting(&payload(&[]), Removable::new()), None);
    }

    const SITE: &str = "[[module]]\nname = \"left\"\nx = 0\ny = 0.5\n\
        [[zone]]\nname = \"hall\"\nsecure = true\npeople_max = 4\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\n\
        [[door]]\nname = \"front\"\nzone = \"hall\"\nline = [[-0.45, 1.0], [0.45, 1.0]]\nfail = \"secure\"\n";

    #[test]
    fn a_device_says_where_it_is_looked_after_which_it_is_and_in_which_room() {
        let site = Arc::new(Site::parse("site", SITE).unwrap());
        let map_url = Some("https://hall.local:8420/".into());
        let about = About { site: Arc::clone(&site), map_url, buttons: false };
        let mut frame = frame();
        frame.modules[0].id = "02:00:00:00:00:01".into();
        frame.modules[0].firmware = "0.2.0".into();
        let doors = crate::doors::DoorHandle::new(&site, None).states();
        frame.doors = doors.into_iter().map(|door| door.line).collect();
        let configs = discovery(&frame, &about, &topics());
        let config = |id: &str| -> Value {
            serde_json::from_str(&configs[&format!("homeassistant/device/{id}/config")]).unwrap()
        };
        let device = config("kehai_front-door_left")["device"].clone();
        let expected = json!({
            "configuration_url": "https://hall.local:8420/", "connections": [["mac", "02:00:00:00:00:01"]],
            "identifiers": ["kehai_front-door_left"], "manufacturer": "kehai", "model": "module",
            "name": "Front Door left", "serial_number": "02:00:00:00:00:01", "suggested_area": "hall",
            "sw_version": "0.2.0", "via_device": "kehai_front-door",
        });
        assert_eq!(device, expected);
        let door = config("kehai_front-door_door_front");
        assert_eq!(door["device"]["suggested_area"], "hall");
        assert!(door["components"].as_object().unwrap().values().all(|entity| {
            entity["platform"].as_str().unwrap().ends_with("sensor") && entity.get("command_topic").is_none()
        }));
        let zones = config("kehai_front-door")["components"].clone();
        assert!(zones["zone_hall_crowded"].is_object(), "it has a limit");
        assert!(zones["zone_u7384u95a2_crowded"].is_null());
        assert!(zones["total_count"].is_object() && zones["tracker_problem"].is_object());
    }
}
