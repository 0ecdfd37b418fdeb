//! What the file answers: a row of each table, in numbers and names.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::path::Place;
use super::pose::Source;
use kehai_tracking::lines::Direction;
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::snapshot::DeviceState;

/// A person's path.
#[derive(Clone, Debug, PartialEq)]
pub struct Walked {
    /// The start of the tracker it belongs to; numbers of tracks start again with each.
    pub run: i64,
    /// The track's number.
    pub track: u64,
    /// Where, at what times.
    pub places: Vec<Place>,
}

/// How many people were in a zone from some time on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Count {
    /// Its name.
    pub zone: String,
    /// ms since 1970.
    pub at_ms: u64,
    /// People; none where that is not known.
    pub count: Option<u32>,
    /// How far that can be trusted.
    pub state: ZoneKnown,
}

/// Of which zones the site's total was made from some time on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TotalOf {
    /// ms since 1970.
    pub at_ms: u64,
    /// Their names.
    pub zones: BTreeSet<String>,
}

/// A person crossed a counting line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CrossedAt {
    /// Its name.
    pub line: String,
    /// ms since 1970.
    pub at_ms: u64,
    /// Which way.
    pub direction: Direction,
}

/// Whether a counting line was seen from some time on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LineSeen {
    /// Its name.
    pub line: String,
    /// ms since 1970.
    pub at_ms: u64,
    /// Whether it is.
    pub state: ZoneKnown,
}

/// Where a module was from some time on.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Posed {
    /// ms since 1970.
    pub at_ms: u64,
    /// As the site called it.
    pub module: String,
    /// Its place, m.
    pub x_m: f64,
    /// m.
    pub y_m: f64,
    /// Where its front pointed, counter-clockwise.
    pub yaw_deg: f64,
    /// Where the pose came from.
    pub source: Source,
}

/// What a module was doing, by its name in the database.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum WasDoing {
    /// One that this version knows.
    Known(DeviceState),
    /// One of another version of the tracker.
    Other(String),
}

impl WasDoing {
    /// Its name, for programs.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Known(state) => state.name(),
            Self::Other(name) => name,
        }
    }
}

/// How a module was at some time: once a minute.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Was {
    /// ms since 1970.
    pub at_ms: u64,
    /// As the site called it.
    pub module: String,
    /// What it was doing.
    pub state: WasDoing,
    /// Scans a second.
    pub scans_hz: f64,
    /// Share of its scans that were lost within a minute; none if it took none.
    pub lost_share: Option<f64>,
    /// Checksum errors on its sensor's line since its start.
    pub checksum_errors: u64,
    /// Share of its beams that could not be judged.
    pub unknown_share: f64,
    /// Its clock minus the tracker's, ms.
    pub clock_offset_ms: Option<f64>,
    /// How much that scattered, ms; none if it was not compared.
    pub clock_jitter_ms: Option<f64>,
}

/// A card that was held to a reader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CardSeen {
    /// ms since 1970.
    pub at_ms: u64,
    /// Which reader.
    pub place: String,
    /// What is kept of the card: a [`CardHash`](super::card::CardHash)'s bytes.
    pub hash: Vec<u8>,
}
