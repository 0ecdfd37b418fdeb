//! Why an alarm of a device rings or not: what it is decided on, as it is now.
//!
//! ```text
//!   measured  ──────╱▔▔▔▔▔▔▔▔    limit ┄┄┄┄┄    it holds for 4 s; the alarm rings after 10 s
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm::AlarmKind;

/// What an alarm is decided on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AlarmCondition {
    /// The alarm.
    pub kind: AlarmKind,
    /// Whether it rings.
    pub is_on: bool,
    /// Whether its condition holds now.
    pub holds: bool,
    /// What is measured for it, if that is a number; null while it is not known.
    pub measured: Option<Measured>,
    /// For how long the condition has been other than the alarm, s.
    pub for_s: f64,
    /// For how long it must hold until the alarm rings, s.
    pub raise_s: f64,
}

/// A figure and its limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Measured {
    /// It is so much.
    pub value: f64,
    /// The alarm's condition holds beyond this.
    pub limit: f64,
    /// In this unit.
    pub unit: Unit,
}

/// What a figure is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Seconds since it was heard.
    SilentS,
    /// Share of the scans that came damaged.
    DamagedShare,
    /// Degrees over which the background is not seen.
    CoveredDeg,
    /// Scans a second: the alarm's condition holds below the limit.
    ScansHz,
    /// Seconds by which times are uncertain.
    ClockS,
    /// Share of the beams that return nothing usable.
    MissingShare,
}

/// The condition at a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeviceCondition {
    /// As the site calls it.
    pub device: String,
    /// What the alarm is decided on there; null where it cannot ring: of that device nothing is measured for it.
    pub condition: Option<AlarmCondition>,
}
