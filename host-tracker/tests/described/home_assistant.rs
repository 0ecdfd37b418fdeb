//! What Home Assistant's MQTT discovery asks of a device, as facts: a payload that breaks one is dropped there with a line in
//! its log, which no test here would see.
//!
//! ```text
//!   device     identifiers or connections; configuration_url of http or https; connections are pairs
//!   origin     name
//!   component  platform, unique_id, state_topic, or of a button command_topic; classes and categories of its platform;
//!              or its platform alone, which removes it
//!   sensor     state_class only of numbers; options only, and always, of the class enum
//! ```
//!
//! Source: Home Assistant's documentation, *MQTT*, *device discovery payload*, *binary sensor*, *sensor*, *button*; version 2024.11.

use serde_json::Value;

const DEVICE: [&str; 10] = [
    "configuration_url",
    "connections",
    "identifiers",
    "manufacturer",
    "model",
    "name",
    "serial_number",
    "suggested_area",
    "sw_version",
    "via_device",
];
const COMMON: [&str; 9] = [
    "availability",
    "availability_mode",
    "device_class",
    "entity_category",
    "icon",
    "json_attributes_topic",
    "name",
    "platform",
    "state_topic",
];
const BINARY_CLASSES: [&str; 4] = ["door", "lock", "occupancy", "problem"];

/// Whether a device is discovered as it is.
#[track_caller]
pub fn discovers(payload: &str) {
    let config: Value = serde_json::from_str(payload).unwrap();
    let device = config["device"].as_object().expect("a device");
    for key in device.keys() {
        assert!(DEVICE.contains(&key.as_str()), "a device has no {key}: {device:?}");
    }
    let many = |key: &str| device.get(key).and_then(Value::as_array).map_or(0, Vec::len);
    assert!(many("identifiers") + many("connections") > 0, "it is known by nothing: {device:?}");
    for pair in device.get("connections").and_then(Value::as_array).into_iter().flatten() {
        assert!(pair.as_array().is_some_and(|pair| pair.len() == 2 && pair.iter().all(Value::is_string)));
    }
    if let Some(url) = device.get("configuration_url") {
        let url = url.as_str().unwrap();
        assert!(url.starts_with("http://") || url.starts_with("https://"), "{url}");
    }
    assert!(config["origin"]["name"].is_string(), "who says so: {config}");
    let all = config["components"].as_object().expect("components");
    let is_gone = |entity: &Value| entity.as_object().is_some_and(|entity| entity.keys().eq(["platform"]));
    let (gone, there): (Vec<_>, Vec<_>) = all.iter().partition(|(_, entity)| is_gone(entity));
    for (name, component) in &gone {
        let platform = component["platform"].as_str().unwrap();
        assert!(["binary_sensor", "sensor", "button"].contains(&platform), "{name}: {platform}");
    }
    for (name, component) in &there {
        entity(name, component);
    }
    let mut ids: Vec<&str> = there.iter().map(|(_, entity)| entity["unique_id"].as_str().unwrap()).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), there.len(), "identifiers are unique");
}

#[track_caller]
fn entity(name: &str, entity: &Value) {
    assert!(
        name.chars().all(|letter| letter.is_ascii_alphanumeric() || "_-".contains(letter))
            && !name.is_empty(),
        "{name} is no identifier"
    );
    let is_button = entity["platform"] == "button";
    let asked: &[&str] = if is_button { &["command_topic"] } else { &["state_topic", "value_template"] };
    for key in ["name", "platform", "unique_id"].iter().chain(asked) {
        assert!(entity[key].as_str().is_some_and(|text| !text.is_empty()), "{name} without {key}: {entity}");
    }
    let topic = entity[asked[0]].as_str().unwrap();
    assert!(!topic.contains(['#', '+', '\0']) && topic.len() < 65536, "{topic}");
    let template = entity.get("value_template").map_or("{{ }}", |template| template.as_str().unwrap());
    assert!(template.starts_with("{{ ") && template.ends_with(" }}"), "{name}: {template}");
    assert!(
        entity["availability"].as_array().is_some_and(|all| all.iter().all(|one| one["topic"].is_string()))
    );
    assert!(["all", "any", "latest"].contains(&entity["availability_mode"].as_str().unwrap()));
    if let Some(category) = entity.get("entity_category") {
        let wanted = if is_button { "config" } else { "diagnostic" };
        assert_eq!(category, wanted, "what is only read is no config: {name}");
    }
    let class = entity.get("device_class").map(|class| class.as_str().unwrap());
    let more: &[&str] = match entity["platform"].as_str().unwrap() {
        "binary_sensor" => {
            assert!(class.is_none_or(|class| BINARY_CLASSES.contains(&class)), "{name}: {class:?}");
            &[]
        }
        "sensor" => {
            assert!(class.is_none_or(|class| class == "enum"), "{name}: {class:?}");
            let has = |key: &str| entity.get(key).is_some();
            assert_eq!(has("options"), class == Some("enum"), "{name}: options are of an enum");
            assert!(!(class == Some("enum") && (has("state_class") || has("unit_of_measurement"))), "{name}");
            if let Some(class) = entity.get("state_class") {
                assert!(["measurement", "total_increasing"].contains(&class.as_str().unwrap()), "{class}");
            }
            &["options", "state_class", "unit_of_measurement"]
        }
        "button" => {
            assert!(
                class.is_none_or(|class| ["identify", "restart", "update"].contains(&class)),
                "{name}: {class:?}"
            );
            let slash = topic.rsplit_once('/').map(|(_, button)| button).unwrap();
            assert!(["learn", "restart", "identify"].contains(&slash), "{name} presses {topic}");
            &["command_topic"]
        }
        platform => panic!("{name}: {platform} is no platform"),
    };
    for key in entity.as_object().unwrap().keys().map(String::as_str) {
        let known =
            COMMON.contains(&key) || ["unique_id", "value_template"].contains(&key) || more.contains(&key);
        assert!(known, "{name}: a {} has no {key}", entity["platform"]);
    }
}
