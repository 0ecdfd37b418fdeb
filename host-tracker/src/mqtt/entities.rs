//! What Home Assistant shows of each device: where each state is, and how it is read.
//!
//! ```text
//!   site    total, occupancy; alarms, tracker's own; each zone: occupancy, count, crowded; each line: in, out
//!   module  problem, alarm, state, scans, lost scans, unknown beams; buttons, if `run` was told so: learn, restart, identify
//!   door    phase, lock, leaf, alarm, problem, trouble      never anything that opens it
//! ```
//!
//! All but buttons are read only. `None` in a template is *unknown*, which is never *off* and never 0.

use std::collections::BTreeMap;

use super::messages::{lines, zones};
use super::payloads::{AvailabilityTopic, Component};
use super::presses::Button;
use super::topics::Topics;
use kehai_tracking::lines::Direction;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// The entities of a device, by their names.
pub(super) type Components = BTreeMap<String, Component>;

/// People are in it.
const OCCUPIED: &str =
    "{{ 'None' if value_json.occupied is none else 'ON' if value_json.occupied else 'OFF' }}";

/// Phases of a door, as [`Phase`](kehai_tracking::door::Phase) is written.
const PHASES: [&str; 8] =
    ["idle", "asked", "checking", "unlocked", "closing", "held-open", "alarmed", "failed"];

/// What every entity says; there is it while the tracker runs, and `own` says so, too.
fn component(topics: &Topics, topic: &str, own: bool) -> Component {
    let own = own.then(|| format!("{topic}/availability"));
    let availability = std::iter::once(topics.status()).chain(own);
    Component {
        availability: availability.map(|topic| AvailabilityTopic { topic }).collect(),
        availability_mode: "all",
        state_topic: Some(topic.to_owned()),
        ..Component::default()
    }
}

fn value(key: &str) -> String {
    format!("{{{{ value_json.{key} }}}}")
}

/// The template of a binary sensor that is on when this is true.
fn on_if(condition: &str) -> String {
    format!("{{{{ 'ON' if {condition} else 'OFF' }}}}")
}

/// Of the site's own device.
pub(super) fn of_site(frame: &Snapshot, site: &Site, topics: &Topics) -> Components {
    let mut components = of_whole(topics);
    components.extend(of_zones(frame, site, topics));
    components.extend(of_lines(frame, topics));
    components
}

fn of_whole(topics: &Topics) -> Components {
    let mut components = Components::new();
    let mut add = |kind: &str, name: &str, more: Component| {
        let unique_id = format!("{}_{kind}", topics.device());
        components.insert(kind.to_owned(), Component { name: name.to_owned(), unique_id, ..more });
    };
    let total = format!("{}/total", topics.site());
    let occupancy = Component {
        device_class: Some("occupancy"),
        json_attributes_topic: Some(total.clone()),
        platform: "binary_sensor",
        value_template: Some(OCCUPIED.to_owned()),
        ..component(topics, &total, true)
    };
    let count = Component {
        icon: Some("mdi:account-group"),
        json_attributes_topic: Some(total.clone()),
        platform: "sensor",
        state_class: Some("measurement"),
        value_template: Some(value("count")),
        ..component(topics, &total, true)
    };
    let alarms = format!("{}/alarms", topics.site());
    let standing = |key: &str| Component {
        entity_category: Some("diagnostic"),
        icon: Some("mdi:bell-alert"),
        json_attributes_topic: Some(alarms.clone()),
        platform: "sensor",
        state_class: Some("measurement"),
        value_template: Some(value(key)),
        ..component(topics, &alarms, false)
    };
    let own = format!("{}/tracker", topics.site());
    let alarm = Component {
        entity_category: Some("diagnostic"),
        platform: "sensor",
        value_template: Some(value("alarm")),
        ..component(topics, &own, false)
    };
    let problem = Component {
        device_class: Some("problem"),
        entity_category: Some("diagnostic"),
        json_attributes_topic: Some(own.clone()),
        platform: "binary_sensor",
        value_template: Some(on_if("value_json.alarms")),
        ..component(topics, &own, false)
    };
    add("total_occupancy", "occupancy", occupancy);
    add("total_count", "people", count);
    add("alarms", "alarms", standing("standing"));
    add("alarms_unacknowledged", "alarms not acknowledged", standing("unacknowledged"));
    add("tracker_alarm", "tracker alarm", alarm);
    add("tracker_problem", "tracker problem", problem);
    components
}

fn of_zones(frame: &Snapshot, site: &Site, topics: &Topics) -> Components {
    let mut components = Components::new();
    for (name, slug) in zones(frame, site) {
        let topic = format!("{}/zone/{slug}", topics.site());
        let mut add = |kind: &str, more: Component| {
            let component = Component {
                json_attributes_topic: Some(topic.clone()),
                name: format!("{name} {kind}"),
                unique_id: format!("{}_zone_{slug}_{kind}", topics.device()),
                ..more
            };
            components.insert(format!("zone_{slug}_{kind}"), component);
        };
        let occupancy = Component {
            device_class: Some("occupancy"),
            platform: "binary_sensor",
            value_template: Some(OCCUPIED.to_owned()),
            ..component(topics, &topic, true)
        };
        let count = Component {
            icon: Some("mdi:account-multiple"),
            platform: "sensor",
            state_class: Some("measurement"),
            value_template: Some(value("count")),
            ..component(topics, &topic, true)
        };
        add("occupancy", occupancy);
        add("count", count);
        // A zone without a limit is never crowded.
        if site.zones.iter().any(|zone| zone.name == name && zone.people_max.is_some()) {
            let crowded = Component {
                device_class: Some("problem"),
                platform: "binary_sensor",
                value_template: Some(on_if("'crowded' in value_json.alarms")),
                ..component(topics, &topic, true)
            };
            add("crowded", crowded);
        }
    }
    components
}

fn of_lines(frame: &Snapshot, topics: &Topics) -> Components {
    let mut components = Components::new();
    for (name, slug) in lines(frame) {
        let topic = format!("{}/line/{slug}", topics.site());
        for direction in [Direction::In, Direction::Out].map(Direction::name) {
            let component = Component {
                icon: Some("mdi:counter"),
                json_attributes_topic: Some(topic.clone()),
                name: format!("{name} {direction}"),
                platform: "sensor",
                state_class: Some("total_increasing"),
                unique_id: format!("{}_line_{slug}_{direction}", topics.device()),
                value_template: Some(format!("{{{{ value_json['{direction}'] }}}}")),
                ..component(topics, &topic, true)
            };
            components.insert(format!("line_{slug}_{direction}"), component);
        }
    }
    components
}

/// Of a module's device, which has this identifier.
pub(super) fn of_module(id: &str, slug: &str, topics: &Topics) -> Components {
    let topic = format!("{}/module/{slug}", topics.site());
    let component = |kind: &str, name: &str, own: bool, value_template: String| Component {
        entity_category: Some("diagnostic"),
        name: name.to_owned(),
        platform: "sensor",
        unique_id: format!("{id}_{kind}"),
        value_template: Some(value_template),
        ..component(topics, &topic, own)
    };
    let number = |kind: &str, name: &str, unit, key: &str| Component {
        state_class: Some("measurement"),
        unit_of_measurement: Some(unit),
        ..component(kind, name, true, value(key))
    };
    // That something is wrong is known of a module that is missing, too.
    let problem = Component {
        device_class: Some("problem"),
        json_attributes_topic: Some(topic.clone()),
        platform: "binary_sensor",
        ..component("problem", "problem", false, on_if("value_json.alarms"))
    };
    let all = [
        ("problem", problem),
        ("alarm", component("alarm", "alarm", false, value("alarm"))),
        ("state", component("state", "state", false, value("state"))),
        ("scans", number("scans", "scans", "Hz", "scans_hz")),
        ("lost", number("lost", "lost scans", "%", "lost_percent")),
        ("unknown", number("unknown", "unknown beams", "%", "unknown_percent")),
    ];
    all.into_iter().map(|(kind, component)| (kind.to_owned(), component)).collect()
}

/// The buttons of a module's device, which has this identifier: those that the site allows.
pub(super) fn buttons(id: &str, slug: &str, site: &Site, topics: &Topics) -> Components {
    let topic = format!("{}/module/{slug}", topics.site());
    let allowed = Button::NAMED.into_iter().filter(|(button, _)| button.is_allowed(site));
    let of = |(button, kind): (Button, &str)| {
        let (name, class, icon) = match button {
            Button::Learn => ("learn background", None, Some("mdi:cube-scan")),
            Button::Restart => ("restart", Some("restart"), None),
            Button::Identify => ("identify", Some("identify"), None),
        };
        let component = Component {
            command_topic: Some(format!("{topic}/{kind}")),
            device_class: class,
            entity_category: Some("config"),
            icon,
            name: name.to_owned(),
            platform: "button",
            state_topic: None,
            unique_id: format!("{id}_{kind}"),
            ..component(topics, &topic, true)
        };
        (kind.to_owned(), component)
    };
    allowed.map(of).collect()
}

/// Of a door's device, which has this identifier. What is shown of the lock is what it was told: `lock_taken`, among the
/// attributes, says whether it has answered.
pub(super) fn of_door(id: &str, slug: &str, topics: &Topics) -> Components {
    let topic = format!("{}/door/{slug}", topics.site());
    let component = |kind: &str, value_template: String| Component {
        name: kind.to_owned(),
        platform: "sensor",
        unique_id: format!("{id}_{kind}"),
        value_template: Some(value_template),
        ..component(topics, &topic, false)
    };
    let binary = |kind: &str, class, template: String| Component {
        device_class: Some(class),
        platform: "binary_sensor",
        ..component(kind, template)
    };
    let leaf =
        "{{ 'None' if value_json.contact is none else 'ON' if value_json.contact == 'open' else 'OFF' }}";
    let all = [
        (
            "phase",
            Component {
                device_class: Some("enum"),
                json_attributes_topic: Some(topic.clone()),
                options: Some(PHASES.to_vec()),
                ..component("phase", value("phase"))
            },
        ),
        ("lock", binary("lock", "lock", on_if("value_json.lock != 'locked'"))),
        ("leaf", binary("leaf", "door", leaf.to_owned())),
        ("alarm", component("alarm", value("alarm"))),
        ("problem", binary("problem", "problem", on_if("value_json.alarm or value_json.trouble"))),
        (
            "trouble",
            Component { entity_category: Some("diagnostic"), ..component("trouble", value("trouble")) },
        ),
    ];
    all.into_iter().map(|(kind, component)| (kind.to_owned(), component)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::door::Phase;

    #[test]
    fn every_phase_of_a_door_is_an_option() {
        let all = [
            Phase::Idle,
            Phase::Asked,
            Phase::Checking,
            Phase::Unlocked,
            Phase::Closing,
            Phase::HeldOpen,
            Phase::Alarmed,
            Phase::Failed,
        ];
        let written = all.map(|phase| serde_json::to_value(phase).unwrap());
        assert_eq!(written.each_ref().map(|phase| phase.as_str().unwrap()), PHASES);
    }
}
