//! Something that happened: its kind, what it is about, and words.
//!
//! ```text
//!   EventKind::Alarm ◀─▶ "alarm"      in the database and in JSON, by this name alone
//!   alarm "dirty" ──▶ text "dirty: clean its window" ──▶ name: dirty
//! ```
//!
//! A new kind is a line of `kinds!`; the compiler then asks how often it happens.

use std::borrow::Cow;

use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::snapshot::{DeviceEvent, DeviceState};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::Error;
use serde::de::{DeserializeOwned, IntoDeserializer};
use serde::{Serialize, Serializer};

macro_rules! kinds {
    ($($(#[$about:meta])* $kind:ident = $name:literal,)*) => {
        /// What has happened.
        #[derive(Clone, PartialEq, Eq, Debug)]
        pub enum EventKind {
            $($(#[$about])* $kind,)*
            /// A device has done something.
            Device(DeviceEvent),
            /// A kind of another version of the tracker, by its name.
            Other(String),
        }

        impl EventKind {
            /// The names of those that are no device's.
            const NAMES: &[&str] = &[$($name),*];

            /// Its name, for programs.
            #[must_use]
            pub fn name(&self) -> &str {
                match self {
                    $(Self::$kind => $name,)*
                    Self::Device(event) => event.name(),
                    Self::Other(name) => name,
                }
            }

            /// The kind of this name.
            #[must_use]
            pub fn named(name: &str) -> Self {
                match name {
                    $($name => Self::$kind,)*
                    _ => known(name, DeviceEvent::name).map_or_else(|| Self::Other(name.to_owned()), Self::Device),
                }
            }
        }
    };
}

kinds! {
    /// A person came into a zone.
    Enter = "enter",
    /// A person left a zone.
    Leave = "leave",
    /// An alarm of a device has begun.
    Alarm = "alarm",
    /// An alarm of a device is over.
    Cleared = "cleared",
    /// A device does something else than before.
    State = "state",
    /// A passage through a guarded door is over.
    Passage = "passage",
    /// The same, with an alarm.
    DoorAlarm = "door-alarm",
    /// The tracks of an earlier process were taken back.
    Restored = "restored",
    /// They were too old for that.
    Discarded = "discarded",
    /// A damaged database was set aside.
    SetAside = "set-aside",
    /// Raw scans of a device are kept from now on.
    Raw = "raw",
}

impl EventKind {
    /// Whether there are too many of them to be shown of a long time: the counts show how people moved between zones.
    #[must_use]
    pub const fn is_frequent(&self) -> bool {
        match self {
            Self::Enter | Self::Leave | Self::State => true,
            Self::Alarm | Self::Cleared | Self::Passage | Self::DoorAlarm | Self::Raw => false,
            Self::Restored | Self::Discarded | Self::SetAside | Self::Device(_) | Self::Other(_) => false,
        }
    }
}

impl Serialize for EventKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl JsonSchema for EventKind {
    fn schema_name() -> Cow<'static, str> {
        "EventKind".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let about =
            format!("{}, what a device has done, or a kind of another version.", Self::NAMES.join(", "));
        json_schema!({ "type": "string", "description": about })
    }
}

/// What an event is about, by its name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum EventName {
    /// The alarm that has begun or is over.
    Alarm(AlarmKind),
    /// What the device does now.
    State(DeviceState),
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Event {
    /// ms since 1970.
    pub at_ms: u64,
    /// What.
    pub kind: EventKind,
    /// Zone, module or door.
    pub subject: String,
    /// The track, if the event is about one.
    pub track: Option<u64>,
    /// The alarm or the state, if the event is about one that this version knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<EventName>,
    /// In words.
    pub text: String,
}

impl Event {
    /// One that is about neither an alarm nor a state.
    #[must_use]
    pub fn new(at_ms: u64, kind: EventKind, subject: impl Into<String>, text: impl Into<String>) -> Self {
        Self { at_ms, kind, subject: subject.into(), track: None, name: None, text: text.into() }
    }

    /// One of any kind, as the database has it: its name is in its text.
    #[must_use]
    pub fn stored(at_ms: u64, kind: EventKind, subject: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        let alarm = |name| known(name, AlarmKind::name).map(EventName::Alarm);
        let name = match kind {
            EventKind::Alarm => text.split_once(": ").and_then(|(name, _)| alarm(name)),
            EventKind::Cleared => alarm(&text),
            EventKind::State => known(&text, DeviceState::name).map(EventName::State),
            _ => None,
        };
        Self { name, ..Self::new(at_ms, kind, subject, text) }
    }

    /// An alarm of a device has begun, which says this.
    #[must_use]
    pub fn alarm(at_ms: u64, device: &str, alarm: AlarmKind, text: &str) -> Self {
        Self::new(at_ms, EventKind::Alarm, device, format!("{alarm}: {text}")).named(EventName::Alarm(alarm))
    }

    /// An alarm of a device is over.
    #[must_use]
    pub fn cleared(at_ms: u64, device: &str, alarm: AlarmKind) -> Self {
        Self::new(at_ms, EventKind::Cleared, device, alarm.name()).named(EventName::Alarm(alarm))
    }

    /// A device does this from now on.
    #[must_use]
    pub fn state(at_ms: u64, device: &str, state: DeviceState) -> Self {
        Self::new(at_ms, EventKind::State, device, state.name()).named(EventName::State(state))
    }

    fn named(self, name: EventName) -> Self {
        Self { name: Some(name), ..self }
    }

    /// The same, about a track.
    #[must_use]
    pub fn of(self, track: Option<u64>) -> Self {
        Self { track, ..self }
    }
}

/// The member of a set that has this name, if this version knows it: what it does not know is read as another.
fn known<T: DeserializeOwned + Copy>(name: &str, name_of: fn(T) -> &'static str) -> Option<T> {
    let deserializer = IntoDeserializer::<Error>::into_deserializer(name);
    T::deserialize(deserializer).ok().filter(|member| name_of(*member) == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_kind_is_read_by_its_name_and_one_of_another_version_keeps_it() {
        for name in EventKind::NAMES {
            let kind = EventKind::named(name);
            assert_eq!(kind.name(), *name);
            assert!(!matches!(kind, EventKind::Device(_) | EventKind::Other(_)), "{name}");
            assert!(known(name, DeviceEvent::name).is_none(), "{name} is a device's, too");
        }
        assert_eq!(EventKind::named("learned"), EventKind::Device(DeviceEvent::Learned));
        assert_eq!(EventKind::named("started").name(), "started");
        assert_eq!(serde_json::to_value(EventKind::DoorAlarm).unwrap(), "door-alarm");
    }

    #[test]
    fn an_alarm_and_a_state_are_known_by_their_names_again() {
        let alarm = Event::alarm(1, "left", AlarmKind::Dirty, "clean it: now");
        let told = json!({ "at_ms": 1, "kind": "alarm", "subject": "left", "track": null, "name": "dirty",
            "text": "dirty: clean it: now" });
        assert_eq!(serde_json::to_value(&alarm).unwrap(), told);
        let read = |event: &Event| {
            Event::stored(event.at_ms, EventKind::named(event.kind.name()), &*event.subject, &*event.text)
        };
        for event in [
            alarm,
            Event::cleared(2, "left", AlarmKind::ClockOff),
            Event::state(3, "left", DeviceState::Watching),
            Event::new(4, EventKind::Enter, "hall", ""),
        ] {
            assert_eq!(read(&event), event);
            assert_eq!(event.name.is_none(), event.kind == EventKind::Enter);
        }
        let other = Event::stored(5, EventKind::State, "left", "dancing");
        assert_eq!(other.name, None, "of a newer version");
        assert_eq!(Event::stored(6, EventKind::Alarm, "left", "dancing: all night").name, None);
        assert_eq!(serde_json::to_value(&other).unwrap().get("name"), None);
    }

    #[test]
    fn the_page_knows_kinds_by_the_names_they_have() {
        let page = include_str!("../web/page/names.js");
        let (_, rest) = page.split_once("export const EVENT = {").unwrap();
        let (names, _) = rest.split_once('}').unwrap();
        for name in names.split('"').skip(1).step_by(2) {
            assert!(EventKind::NAMES.contains(&name), "{name}");
        }
        assert!(names.contains('"'), "{names}");
    }
}
