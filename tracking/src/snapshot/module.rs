//! A module in a frame.
//!
//! ```text
//!   ModuleLine   who it is · DeviceState: what it is doing · alarms · figures · each EventLine: what it did
//! ```

use std::fmt;
use std::sync::Arc;

use kehai::wire::EventKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm::AlarmLine;

/// What a device is doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceState {
    /// Nothing is heard of it.
    #[default]
    Missing,
    /// It is there, but has no place in the site.
    Found,
    /// It looks for its sensor.
    Searching,
    /// It learns its background.
    Learning,
    /// It reports.
    Watching,
    /// It stores something, and does not measure for about a second.
    Storing,
}

impl DeviceState {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Found => "found",
            Self::Searching => "searching",
            Self::Learning => "learning",
            Self::Watching => "watching",
            Self::Storing => "storing",
        }
    }
}

impl fmt::Display for DeviceState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How a module is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModuleLine {
    /// As the site calls it, or else as it calls itself.
    pub name: String,
    /// Its identity, as hexadecimal bytes between colons; empty until it has answered.
    pub id: String,
    /// Where it answers; empty until it is found.
    pub address: String,
    /// The version of its firmware; empty until it has said so.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub firmware: String,
    /// What it is doing.
    pub state: DeviceState,
    /// Scans a second over the last ten seconds.
    pub scans_hz: f64,
    /// Share of its scans that were lost over the last minute, on whatever part of the way; null if it took none.
    pub lost_share: Option<f64>,
    /// Checksum errors on its sensor's line since it started.
    pub checksum_errors: u64,
    /// Share of its beams that could not be judged in the newest report.
    pub unknown_share: f64,
    /// Its clock minus this machine's, ms; absent until it was measured.
    pub clock_offset_ms: Option<f64>,
    /// How much that scatters, ms; null until it was measured.
    pub clock_jitter_ms: Option<f64>,
    /// Age of its background, s; absent while it has none.
    pub background_age_s: Option<f64>,
    /// Since its last datagram, s; absent until there was one.
    pub silent_s: Option<f64>,
    /// Since a report of it was used last, s; absent until one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unused_s: Option<f64>,
    /// What its newest scan saw empty, in the site's frame, m: the corners of an area that begins at the module.
    /// Empty while it sees nothing. What lies outside is not seen.
    // Most of the bytes of a frame: clones of it share them.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub free: Arc<Vec<[f64; 2]>>,
    /// How much of what it learns from it has, 0 to 1; absent while it does not learn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub learned_share: Option<f64>,
    /// What stands out in its newest scan, in its own frame, m: of a module that the site has, but not its place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sees: Vec<[f64; 2]>,
    /// Where something in its background has the shape of a person, as far as the site does not say that it is furniture: bearing from its
    /// front to its left, degrees, and range, m, as [`Module::furniture`](crate::site::Module::furniture) has them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub suspects: Vec<[f64; 2]>,
    /// Whether what it says is sealed with a key of the site.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_sealed: bool,
    /// What is wrong, worst first.
    pub alarms: Vec<AlarmLine>,
    /// What it has done within the last minute, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<EventLine>,
}

fn is_nothing(corners: &Arc<Vec<[f64; 2]>>) -> bool {
    corners.is_empty()
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
const fn is_false(value: &bool) -> bool {
    !*value
}

/// What a device did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceEvent {
    /// It began to learn its background.
    LearnStarted,
    /// It has learned its background.
    Learned,
    /// It began to learn again, because something moved.
    LearnRestarted,
    /// It took a place as background.
    Absorbed,
    /// It forgot its background.
    BackgroundForgotten,
    /// Its background has changed by itself.
    BackgroundDrifted,
    /// Its settings were changed.
    SettingsChanged,
    /// It restarts.
    Restarting,
    /// An address was stored that no interface can have.
    AddressUnusable,
    /// No host came over a new address: the previous one is back.
    AddressReturned,
    /// Three starts did not last: this one is over DHCP.
    AddressDefault,
    /// The button erased settings and background.
    FactoryReset,
    /// A host has set its keys.
    KeysSet,
    /// A new image runs, on trial.
    ImageOnTrial,
    /// It works, and stays.
    ImageConfirmed,
    /// It did not work: the one before is back.
    ImageReverted,
    /// An image was not started: not signed by its maker.
    ImageForged,
    /// The same: damaged.
    ImageDamaged,
    /// The same: for another board or program.
    ImageOther,
    /// The same: older than may start.
    ImageTooOld,
    /// An event of a newer device.
    #[default]
    #[serde(other)]
    Unknown,
}

impl DeviceEvent {
    /// Its name, for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LearnStarted => "learn-started",
            Self::Learned => "learned",
            Self::LearnRestarted => "learn-restarted",
            Self::Absorbed => "absorbed",
            Self::BackgroundForgotten => "background-forgotten",
            Self::BackgroundDrifted => "background-drifted",
            Self::SettingsChanged => "settings-changed",
            Self::Restarting => "restarting",
            Self::AddressUnusable => "address-unusable",
            Self::AddressReturned => "address-returned",
            Self::AddressDefault => "address-default",
            Self::FactoryReset => "factory-reset",
            Self::KeysSet => "keys-set",
            Self::ImageOnTrial => "image-on-trial",
            Self::ImageConfirmed => "image-confirmed",
            Self::ImageReverted => "image-reverted",
            Self::ImageForged => "image-forged",
            Self::ImageDamaged => "image-damaged",
            Self::ImageOther => "image-other",
            Self::ImageTooOld => "image-too-old",
            Self::Unknown => "unknown",
        }
    }
}

impl From<EventKind> for DeviceEvent {
    fn from(kind: EventKind) -> Self {
        match kind {
            EventKind::LearnStarted => Self::LearnStarted,
            EventKind::Learned => Self::Learned,
            EventKind::LearnRestarted => Self::LearnRestarted,
            EventKind::Absorbed => Self::Absorbed,
            EventKind::BackgroundForgotten => Self::BackgroundForgotten,
            EventKind::BackgroundDrifted => Self::BackgroundDrifted,
            EventKind::SettingsChanged => Self::SettingsChanged,
            EventKind::Restarting => Self::Restarting,
            EventKind::AddressUnusable => Self::AddressUnusable,
            EventKind::AddressReturned => Self::AddressReturned,
            EventKind::AddressDefault => Self::AddressDefault,
            EventKind::FactoryReset => Self::FactoryReset,
            EventKind::KeysSet => Self::KeysSet,
            EventKind::ImageOnTrial => Self::ImageOnTrial,
            EventKind::ImageConfirmed => Self::ImageConfirmed,
            EventKind::ImageReverted => Self::ImageReverted,
            EventKind::ImageForged => Self::ImageForged,
            EventKind::ImageDamaged => Self::ImageDamaged,
            EventKind::ImageOther => Self::ImageOther,
            EventKind::ImageTooOld => Self::ImageTooOld,
            EventKind::Unknown => Self::Unknown,
        }
    }
}

/// Something that a module did: with its background, its settings or itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EventLine {
    /// In which of its starts.
    pub boot: u32,
    /// Counts the events of that start, from 1.
    pub number: u32,
    /// What it did.
    pub kind: DeviceEvent,
    /// What it is, in words, and which host asked for it, if one did.
    pub text: String,
    /// Since then, s.
    pub ago_s: f64,
}
