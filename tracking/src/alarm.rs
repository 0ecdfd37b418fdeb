//! What is wrong, and where: the alarms of devices, of their poses, of the tracker itself and of doors, as one set.
//!
//! ```text
//!   device monitor, pose watch ─▶ ModuleLine.alarms ╮
//!   database, recording ────────▶ Snapshot.alarms   ├─▶ Active ─▶ Alarms: which have begun, which are over
//!   door machine ───────────────▶ DoorLine.alarm    ╯
//! ```

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::door;

/// How much an alarm takes away; the order is that of the enum, the least first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
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
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
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
    /// Raw scans in the database are not all there.
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
            Self::Store | Self::Suspect | Self::Watchdog | Self::Unknown => Severity::Notice,
        }
    }
}

impl fmt::Display for AlarmKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// An alarm of a device or of the tracker, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Source {
    /// The tracker itself.
    Tracker,
    /// The device of this name.
    Device(String),
    /// The door of this name.
    Door(String),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tracker => f.write_str("the tracker"),
            Self::Device(name) => write!(f, "module {name}"),
            Self::Door(name) => write!(f, "door {name}"),
        }
    }
}

/// Why there is an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// Something is wrong with a device or with the tracker.
    Fault(AlarmKind),
    /// Something has happened at a door.
    Door(door::Alarm),
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

impl Active {
    /// Name of the alarm beside its source.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self.cause {
            Cause::Fault(kind) => kind.name(),
            Cause::Door(_) => "alarm",
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        self.source == other.source && self.cause == other.cause
    }
}

/// The alarms that are on, from one snapshot to the next.
#[derive(Clone, Debug, Default)]
pub struct Alarms(Vec<Active>);

/// What a snapshot changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// Alarms that have begun.
    pub begun: Vec<Active>,
    /// Alarms that are over.
    pub over: Vec<Active>,
}

impl Alarms {
    /// Goes on to the alarms that are on `now`; what has changed. An alarm that goes on with another text has not.
    pub fn update(&mut self, now: impl Iterator<Item = Active>) -> Changes {
        let now: Vec<Active> = now.collect();
        let missing = |from: &[Active], of: &[Active]| -> Vec<Active> {
            of.iter().filter(|alarm| !from.iter().any(|other| other.is_same(alarm))).cloned().collect()
        };
        let changes = Changes { begun: missing(&self.0, &now), over: missing(&now, &self.0) };
        self.0 = now;
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alarm(kind: AlarmKind, text: &str) -> Active {
        Active { source: Source::Device("left".into()), cause: Cause::Fault(kind), text: text.into() }
    }

    #[test]
    fn an_alarm_begins_once_and_ends_once_whatever_its_text() {
        let mut alarms = Alarms::default();
        let (slow, slower) = (alarm(AlarmKind::Slow, "4 of 10"), alarm(AlarmKind::Slow, "3 of 10"));
        let begun = alarms.update([slow.clone()].into_iter());
        assert_eq!(begun, Changes { begun: vec![slow], over: vec![] });
        assert_eq!(alarms.update([slower.clone()].into_iter()), Changes::default());
        let other = Active { source: Source::Tracker, ..slower.clone() };
        let moved = alarms.update([other.clone()].into_iter());
        assert_eq!(moved, Changes { begun: vec![other], over: vec![slower] });
    }

    #[test]
    fn every_kind_is_written_by_its_name() {
        for name in ["silent", "clock-off", "raw-scans", "moved", "same-name", "recording"] {
            let kind: AlarmKind = serde_json::from_value(name.into()).unwrap();
            assert_eq!((kind.name(), serde_json::to_value(kind).unwrap()), (name, name.into()));
        }
        assert_eq!(serde_json::from_value::<AlarmKind>("of-tomorrow".into()).unwrap(), AlarmKind::Unknown);
    }
}
