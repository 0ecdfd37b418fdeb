//! What is wrong, and where: the alarms of devices, of their poses, of the tracker itself and of doors, as one set.
//!
//! ```text
//!   device monitor, pose watch ─▶ ModuleLine.alarms ╮
//!   database, recording ────────▶ the tracker's own ├─▶ Active ─▶ AlarmList: since when, who has acknowledged
//!   door machine ───────────────▶ DoorLine.alarm    │
//!   people in a zone ───────────▶ Capacity          ╯
//! ```

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::door;

/// How much an alarm takes away; the order is that of the enum, the least first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Nothing yet: something is to be looked after.
    #[default]
    Notice,
    /// Tracks are fewer or less certain than they should be.
    Degraded,
    /// What the source is for is not done.
    Failed,
}

/// What is wrong.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmKind {
    /// Nothing comes from the device.
    Silent,
    /// The device's sensor is faulty or missing.
    Sensor,
    /// The line between sensor and device is disturbed.
    Line,
    /// Something stands before the device.
    Covered,
    /// Too few scans arrive.
    Slow,
    /// The device's times are uncertain.
    ClockOff,
    /// The sensor's window is dirty.
    Dirty,
    /// The device cannot store.
    Store,
    /// The device has no background.
    Background,
    /// The background may hold a person.
    Suspect,
    /// The device's firmware hung.
    Watchdog,
    /// The device is not where the site says.
    Moved,
    /// The device sees nothing where people walk.
    Blind,
    /// Two devices have the same place in the site.
    SameName,
    /// Panels of the floor do not work.
    Panels,
    /// The floor has other panels than the site says.
    FloorSize,
    /// The database cannot be written.
    Database,
    /// Raw scans that a user asked to be kept are in the database.
    RawScans,
    /// The recording cannot be written.
    Recording,
    /// The lines of tracks cannot be written.
    TracksOut,
    /// A part of the tracker has ended by itself, and was started again.
    Thread,
    /// The file of keys cannot be read.
    Keys,
    /// The device has no key, in a site that has keys: it is not believed.
    NoKey,
    /// More people are in a zone than may be.
    Crowded,
    /// A kind of a newer version.
    #[serde(other)]
    Unknown,
}

impl AlarmKind {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::Sensor => "sensor",
            Self::Line => "line",
            Self::Covered => "covered",
            Self::Slow => "slow",
            Self::ClockOff => "clock-off",
            Self::Dirty => "dirty",
            Self::Store => "store",
            Self::Background => "background",
            Self::Suspect => "suspect",
            Self::Watchdog => "watchdog",
            Self::Moved => "moved",
            Self::Blind => "blind",
            Self::SameName => "same-name",
            Self::Panels => "panels",
            Self::FloorSize => "floor-size",
            Self::Database => "database",
            Self::RawScans => "raw-scans",
            Self::Recording => "recording",
            Self::TracksOut => "tracks-out",
            Self::Thread => "thread",
            Self::Keys => "keys",
            Self::NoKey => "no-key",
            Self::Crowded => "crowded",
            Self::Unknown => "unknown",
        }
    }

    /// How much it takes away.
    #[must_use]
    pub const fn severity(self) -> Severity {
        match self {
            Self::Silent | Self::Sensor | Self::Covered | Self::Blind | Self::SameName | Self::NoKey => {
                Severity::Failed
            }
            Self::FloorSize | Self::Background | Self::Database | Self::Recording | Self::TracksOut => {
                Severity::Failed
            }
            Self::Keys => Severity::Failed,
            Self::Line | Self::Slow | Self::ClockOff | Self::Dirty | Self::Moved => Severity::Degraded,
            Self::RawScans | Self::Thread | Self::Panels => Severity::Degraded,
            Self::Store | Self::Suspect | Self::Watchdog | Self::Crowded | Self::Unknown => Severity::Notice,
        }
    }
}

impl fmt::Display for AlarmKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// An alarm of a device or of the tracker, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AlarmLine {
    /// What is wrong, for programs. When a device raises which: `tracking/src/session/health/alarms.rs`.
    #[serde(rename = "name")]
    pub kind: AlarmKind,
    /// How much that takes away.
    #[serde(default)]
    pub severity: Severity,
    /// What it is and what to do, in words.
    pub text: String,
}

impl AlarmLine {
    /// An alarm of this kind.
    #[must_use]
    pub fn new(kind: AlarmKind, text: impl Into<String>) -> Self {
        Self { kind, severity: kind.severity(), text: text.into() }
    }
}

/// What an alarm is about.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Source {
    /// The tracker itself.
    Tracker,
    /// The device of this name.
    Device(String),
    /// The door of this name.
    Door(String),
    /// The zone of this name.
    Zone(String),
    /// The area of this name, or its tracker.
    Area(String),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tracker => f.write_str("the tracker"),
            Self::Device(name) => write!(f, "module {name}"),
            Self::Door(name) => write!(f, "door {name}"),
            Self::Zone(name) => write!(f, "zone {name}"),
            Self::Area(name) => write!(f, "area {name}"),
        }
    }
}

/// Why there is an alarm; by its name in JSON. No two of both kinds have the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "AlarmName")]
pub enum Cause {
    /// Something has happened at a door.
    Door(door::Alarm),
    /// Something is wrong with a device or with the tracker.
    Fault(AlarmKind),
}

impl Cause {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Door(alarm) => alarm.name(),
            Self::Fault(kind) => kind.name(),
        }
    }

    /// How much it takes away. A door in alarm lets no person in until it is reset.
    #[must_use]
    pub const fn severity(self) -> Severity {
        match self {
            Self::Door(_) => Severity::Failed,
            Self::Fault(kind) => kind.severity(),
        }
    }
}

/// An alarm that is on.
#[derive(Clone, Debug, PartialEq)]
pub struct Active {
    /// What it is about.
    pub source: Source,
    /// Why.
    pub cause: Cause,
    /// What it is and what to do, in words.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_written_by_its_name() {
        for name in ["silent", "clock-off", "raw-scans", "moved", "same-name", "recording"] {
            let kind: AlarmKind = serde_json::from_value(name.into()).unwrap();
            assert_eq!((kind.name(), serde_json::to_value(kind).unwrap()), (name, name.into()));
        }
        assert_eq!(serde_json::from_value::<AlarmKind>("of-tomorrow".into()).unwrap(), AlarmKind::Unknown);
    }

    #[test]
    fn a_cause_is_read_as_it_is_written_whichever_it_is_of() {
        for cause in [Cause::Door(door::Alarm::HeldOpen), Cause::Fault(AlarmKind::Silent)] {
            let written = serde_json::to_value(cause).unwrap();
            assert_eq!(written, cause.name());
            assert_eq!(serde_json::from_value::<Cause>(written).unwrap(), cause);
        }
    }
}
