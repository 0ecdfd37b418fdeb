//! What is published, as types: each payload is written from one, and its schema is made from the same.
//!
//! ```text
//!   messages, alarms, publisher ─▶ Zone, Line, Module, … ─ serde ─▶ payload
//!                                                        └ schemars ─▶ docs/schemas/asyncapi.json
//! ```
//!
//! What is not known is null, never 0. Times with `_ms` are ms since 1970.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use kehai_tracking::alarm::{AlarmKind, Severity};
use kehai_tracking::alarm_list::Acknowledged;
use kehai_tracking::door::Alarm as DoorAlarm;
use kehai_tracking::door::event::LockOrder;
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::snapshot::DeviceState;

/// As it is published. Nothing in a payload can fail to be written.
pub(super) fn written(payload: &impl Serialize) -> String {
    serde_json::to_string(payload).unwrap_or_default()
}

/// Whether something is there.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Availability {
    /// It is, and the rest of what is said of it is true.
    Online,
    /// It is not.
    Offline,
}

impl Availability {
    /// As it is published: not as JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Online => "online",
            Self::Offline => "offline",
        }
    }
}

/// The tracker itself.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttTracker")]
pub struct Tracker {
    /// What is wrong with it, in words; null if nothing is.
    pub alarm: Option<String>,
    /// The same by name.
    pub alarms: Vec<AlarmKind>,
    /// Its version.
    pub version: &'static str,
}

/// That a tracker is there, to others under the same topics.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MqttPresence")]
pub struct Present {
    /// A number that each start of a tracker makes for itself.
    pub instance: String,
}

/// The whole site.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttTotal")]
pub struct Total {
    /// How many people are in it; null where that is not known.
    pub count: Option<u32>,
    /// Whether a person is in it; null with the count.
    pub occupied: Option<bool>,
    /// How much of it is known.
    pub state: ZoneKnown,
}

/// A zone.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttZone")]
pub struct Zone {
    /// Alarms about it that stand, by name.
    pub alarms: Vec<AlarmKind>,
    /// How many people are in it; null where that is not known.
    pub count: Option<u32>,
    /// Whether a person is in it, or was within the zone's `hold_s`; null with the count.
    pub occupied: Option<bool>,
    /// How much of it is seen.
    pub state: ZoneKnown,
}

/// A counting line.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttLine")]
pub struct Line {
    /// Crossings inward; null if it was never seen.
    #[serde(rename = "in")]
    pub inward: Option<u64>,
    /// Crossings outward; null if it was never seen.
    #[serde(rename = "out")]
    pub outward: Option<u64>,
    /// Whether it is seen now.
    pub state: ZoneKnown,
    /// For how long it was not known since the start, s.
    pub unknown_s: f64,
}

/// A module; figures are null while it is missing.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttModule")]
pub struct Module {
    /// Where it answers; empty until it is found.
    pub address: String,
    /// What is wrong, in words; null if nothing is.
    pub alarm: Option<String>,
    /// The same by name.
    pub alarms: Vec<AlarmKind>,
    /// Age of its background, s.
    pub background_age_s: Option<f64>,
    /// Checksum errors on its sensor's line since it started.
    pub checksum_errors: u64,
    /// How much its clock's offset scatters, ms.
    pub clock_jitter_ms: Option<f64>,
    /// Its clock minus the tracker's, ms.
    pub clock_offset_ms: Option<f64>,
    /// Its identity; empty until it has answered.
    pub id: String,
    /// Scans that were lost within a minute, in a hundred.
    pub lost_percent: Option<f64>,
    /// Scans a second.
    pub scans_hz: Option<f64>,
    /// What it is doing.
    pub state: DeviceState,
    /// Beams that could not be judged, in a hundred.
    pub unknown_percent: Option<f64>,
}

/// An ID that was read, and the likeliest of the tracks that it may be.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttName")]
pub struct Name {
    /// Since it was read last, s.
    pub heard_s: f64,
    /// How probable it is that the track is this ID, 0 to 1.
    pub probability: Option<f64>,
    /// The track; null while it is not known.
    pub track: Option<u64>,
    /// Where it is, m.
    pub x: Option<f64>,
    /// m.
    pub y: Option<f64>,
    /// The zones in which it is.
    pub zones: Vec<String>,
}

/// How many alarms stand.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttAlarms")]
pub struct Alarms {
    /// The gravest that stands; null if none does.
    pub severity: Option<Severity>,
    /// How many stand.
    pub standing: usize,
    /// How many of those are not acknowledged.
    pub unacknowledged: usize,
}

/// An alarm that stands.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttAlarm")]
pub struct Alarm {
    /// Who has acknowledged it; null until then.
    pub acknowledged: Option<Acknowledged>,
    /// How much it takes away.
    pub severity: Severity,
    /// When it began.
    pub since_ms: u64,
    /// What it is and what to do, in words.
    pub text: String,
}

/// What the lock of a door is to be.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttLock")]
pub struct Lock {
    /// When it was said.
    pub at_ms: u64,
    /// The order.
    #[serde(flatten)]
    pub order: LockOrder,
}

/// What the alarm of a door is to be.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttDoorAlarm")]
pub struct DoorAlarmOrder {
    /// What for; null: it is over.
    pub alarm: Option<DoorAlarm>,
    /// When it was said.
    pub at_ms: u64,
    /// Number of the output.
    pub id: u64,
}

/// A message that changed nothing.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MqttRefused")]
pub struct Refused {
    /// When it came.
    pub at_ms: u64,
    /// Why.
    pub why: String,
}

/// A device, as Home Assistant discovers it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "HomeAssistantDiscovery")]
pub struct Discovery {
    /// Its entities by their names, which are this site's own.
    pub components: BTreeMap<String, Entity>,
    /// The device.
    pub device: Device,
    /// Who says so.
    pub origin: Origin,
}

/// A device of Home Assistant.
#[derive(Debug, Default, Serialize, JsonSchema)]
#[schemars(rename = "HomeAssistantDevice")]
pub struct Device {
    /// Where it is looked after: the live map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub configuration_url: Option<String>,
    /// Addresses by which other integrations know it: kind and address.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub connections: Vec<[String; 2]>,
    /// What it is known by.
    pub identifiers: [String; 1],
    /// Its maker.
    pub manufacturer: &'static str,
    /// `tracker`, `module` or `door`.
    pub model: &'static str,
    /// As people call it.
    pub name: String,
    /// By which its maker knows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub serial_number: Option<String>,
    /// The room it is in: a zone of the site.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub suggested_area: Option<String>,
    /// The version of its program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sw_version: Option<String>,
    /// The device that speaks for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub via_device: Option<String>,
}

/// The program that speaks to Home Assistant.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "HomeAssistantOrigin")]
pub struct Origin {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub sw_version: &'static str,
}

/// What is said of an entity of Home Assistant.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "HomeAssistantEntity")]
pub enum Entity {
    /// It is there.
    There(Box<Component>),
    /// It is there no more: said once, before it is named no longer.
    Gone(Gone),
}

/// An entity that Home Assistant is to remove.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "HomeAssistantGone")]
pub struct Gone {
    /// What it was.
    pub platform: String,
}

/// An entity of Home Assistant.
#[derive(Debug, Default, Serialize, JsonSchema)]
#[schemars(rename = "HomeAssistantComponent")]
pub struct Component {
    /// Where it is said whether there is it.
    pub availability: Vec<AvailabilityTopic>,
    /// Each of those topics must say so.
    pub availability_mode: &'static str,
    /// Its class.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device_class: Option<&'static str>,
    /// Its place among the entities of a device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub entity_category: Option<&'static str>,
    /// Its icon.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub icon: Option<&'static str>,
    /// Where its attributes are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub json_attributes_topic: Option<String>,
    /// Where a button is pressed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command_topic: Option<String>,
    /// As people call it.
    pub name: String,
    /// All values that a sensor of the class `enum` has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub options: Option<Vec<&'static str>>,
    /// `sensor`, `binary_sensor` or `button`.
    pub platform: &'static str,
    /// How its numbers are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_class: Option<&'static str>,
    /// Where its state is; a button has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_topic: Option<String>,
    /// What it is known by.
    pub unique_id: String,
    /// Of its numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit_of_measurement: Option<&'static str>,
    /// How the state is read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value_template: Option<String>,
}

/// A topic that says whether something is there.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "HomeAssistantAvailability")]
pub struct AvailabilityTopic {
    /// It.
    pub topic: String,
}
