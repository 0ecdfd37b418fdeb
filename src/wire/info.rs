//! A module's identity, sensor and geometry. Frozen for ever: a host of any version can read it.
//!
//! ```text
//!  request id         u32, fixed
//!  oldest version     u8              newest version   u8
//!  firmware           text, 24        for example 0.3.1
//!  build              text, 48        git describe of what was built
//!  board              text, 24
//!  name               text, 32        given by the installer
//!  uptime, µs         varint
//!  setup              varint          what follows is true of reports with this number
//!  background         varint          newest version, 0: none
//!  sensor             option of
//!    model            text, 16
//!    serial           text, 16
//!    firmware         text, 48
//!    first step, last step, cluster, front step, steps a turn    varints
//!    period, µs       varint
//!    smallest range, largest range, mm                           varints
//!    scans skipped    u8              between two that are sent
//!    open range, mm   varint          how far black clothing is seen
//! ```

use super::codec::{VARINT_U16, VARINT_U32, VARINT_U64, cut, text_max};
use super::{DATAGRAM_MAX, HEADER_LEN};
use crate::scan::{Geometry, GeometryError, GeometryParts};
use serde::{Deserialize, Serialize};

/// Longest name of a module, bytes.
pub const NAME_MAX: usize = 32;

/// A module's identity, sensor and geometry. Texts are cut at the lengths in the module's picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Info<'a> {
    /// The request this answers.
    #[serde(with = "postcard::fixint::le")]
    pub request_id: u32,
    /// Oldest version of the protocol the module understands.
    pub version_min: u8,
    /// Newest version.
    pub version_max: u8,
    /// Version of the firmware.
    #[serde(serialize_with = "cut::<_, 24>")]
    pub firmware: &'a str,
    /// What it was built from.
    #[serde(serialize_with = "cut::<_, 48>")]
    pub build: &'a str,
    /// The board it runs on.
    #[serde(serialize_with = "cut::<_, 24>")]
    pub board: &'a str,
    /// Its name, given by the installer.
    #[serde(serialize_with = "cut::<_, NAME_MAX>")]
    pub name: &'a str,
    /// µs since boot.
    pub uptime_us: u64,
    /// Number of the present setup.
    pub setup: u16,
    /// Newest background version; 0: none.
    pub background_version: u16,
    /// The sensor of the present setup.
    pub sensor: Option<SensorInfo<'a>>,
}

/// A sensor, what is measured with it, and where its beams point.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorInfo<'a> {
    /// Its model.
    #[serde(serialize_with = "cut::<_, 16>")]
    pub model: &'a str,
    /// Its serial number.
    #[serde(serialize_with = "cut::<_, 16>")]
    pub serial: &'a str,
    /// Its firmware.
    #[serde(serialize_with = "cut::<_, 48>")]
    pub firmware: &'a str,
    /// First step of a scan.
    pub first_step: u16,
    /// Last step of a scan.
    pub last_step: u16,
    /// Steps joined into one beam.
    pub cluster: u16,
    /// The step that points forward.
    pub front_step: u16,
    /// Steps in a full turn.
    pub steps_per_turn: u16,
    /// Time of one revolution, µs.
    pub period_us: u32,
    /// Smallest range, mm; smaller values are codes.
    pub range_min_mm: u16,
    /// Largest range, mm.
    pub range_max_mm: u16,
    /// Revolutions left out between two scans.
    pub skip: u8,
    /// Range at which black clothing is still seen: an open beam is seen empty no farther, mm.
    pub open_range_mm: u16,
}

const SENSOR_MAX: usize = text_max(16)
    + text_max(16)
    + text_max(48)
    + 5 * VARINT_U16
    + VARINT_U32
    + 2 * VARINT_U16
    + 1
    + VARINT_U16;

/// Most bytes of an info message.
pub const INFO_MAX: usize = 4
    + 2
    + text_max(24)
    + text_max(48)
    + text_max(24)
    + text_max(NAME_MAX)
    + VARINT_U64
    + 2 * VARINT_U16
    + 1
    + SENSOR_MAX;

const _: () = assert!(HEADER_LEN + INFO_MAX <= DATAGRAM_MAX);

impl<'a> SensorInfo<'a> {
    /// Describes a sensor and its geometry.
    #[must_use]
    pub const fn new(
        [model, serial, firmware]: [&'a str; 3],
        geometry: &Geometry,
        skip: u8,
        open_range_mm: u16,
    ) -> Self {
        let GeometryParts { first_step, last_step, cluster, front_step, .. } = geometry.parts();
        let GeometryParts { steps_per_turn, period_us, range_min_mm, range_max_mm, .. } = geometry.parts();
        Self {
            model,
            serial,
            firmware,
            first_step,
            last_step,
            cluster,
            front_step,
            steps_per_turn,
            period_us,
            range_min_mm,
            range_max_mm,
            skip,
            open_range_mm,
        }
    }

    /// Where the beams point.
    ///
    /// # Errors
    /// [`GeometryError`]: numbers that describe no sensor.
    pub const fn geometry(&self) -> Result<Geometry, GeometryError> {
        Geometry::new(GeometryParts {
            first_step: self.first_step,
            last_step: self.last_step,
            cluster: self.cluster,
            front_step: self.front_step,
            steps_per_turn: self.steps_per_turn,
            period_us: self.period_us,
            range_min_mm: self.range_min_mm,
            range_max_mm: self.range_max_mm,
        })
    }
}
