//! Background profiles and raw scans: larger than a datagram, and so sent in parts. Each can be asked
//! for again.
//!
//! ```text
//!                       profile part                        raw scan part
//!    0  object     u32  the background version              the report's sequence
//!    4  part       u8   from 0                              same
//!    5  parts      u8   of how many                         same
//!    6  first step u16  of the first beam in this part      same
//!    8  setup      u16  as in the reports                   same
//!   10             list of beams, 220 at most:              10  stamp         u64, µs
//!                    0  far     u16, mm; 0: none            18  sensor stamp  u64, ms
//!                    2  near    u16, mm; 0: none            26  uncertainty   u32, µs
//!                    4  spread  u8, mm                      30  list of ranges, 640 at most: u16, mm
//!                    5  state   u8: 0 unknown, 1 open, 2 wall
//! ```
//!
//! Fixed and little endian, but the numbers in front of the lists, which are varints. A scan of
//! 1081 beams is two parts, its profile five.

use super::codec::{Item, List, Malformed, Reader, TooLong, Writer, count_bytes};
use super::{DATAGRAM_MAX, HEADER_LEN};
use crate::background::{BeamProfile, BeamState};
use crate::scan::{MAX_BEAMS, ScanTime};
use serde::{Deserialize, Serialize};

/// Beams in a part of a profile: as many as fit a datagram with some room for fields to come.
pub const PROFILE_PART_BEAMS: usize = 220;

/// Beams in a part of a raw scan: as many as fit a datagram with some room for fields to come.
pub const RAW_PART_BEAMS: usize = 640;

const HEAD_LEN: usize = 4 + 1 + 1 + 2 + 2;

/// Most bytes of a profile part's message.
pub const PROFILE_PART_MAX: usize =
    HEAD_LEN + count_bytes(PROFILE_PART_BEAMS) + PROFILE_PART_BEAMS * BeamProfile::MAX;

/// Most bytes of a raw scan part's message.
pub const RAW_PART_MAX: usize =
    HEAD_LEN + 8 + 8 + 4 + count_bytes(RAW_PART_BEAMS) + RAW_PART_BEAMS * <u16 as Item>::MAX;

const _: () = assert!(HEADER_LEN + PROFILE_PART_MAX <= DATAGRAM_MAX);
const _: () = assert!(HEADER_LEN + RAW_PART_MAX <= DATAGRAM_MAX);
const _: () = assert!(MAX_BEAMS.div_ceil(PROFILE_PART_BEAMS) <= 32, "the bits of a request for parts");
const _: () = assert!(MAX_BEAMS.div_ceil(RAW_PART_BEAMS) <= 32, "the bits of a request for parts");

/// Which part of what.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PartHead {
    /// Background version, or sequence of the report of the same scan.
    #[serde(with = "postcard::fixint::le")]
    pub object: u32,
    /// Number of this part, from 0.
    pub part: u8,
    /// Number of parts.
    pub parts: u8,
    /// Step of the first beam of this part.
    #[serde(with = "postcard::fixint::le")]
    pub first_step: u16,
    /// As in the reports.
    #[serde(with = "postcard::fixint::le")]
    pub setup: u16,
}

/// A part of a background profile.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProfilePart<'a> {
    /// Which.
    pub head: PartHead,
    /// Its beams, in order.
    pub beams: List<'a, BeamProfile>,
}

impl<'a> ProfilePart<'a> {
    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&self.head)?;
        self.beams.write(writer)
    }

    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        Ok(Self { head: reader.required()?, beams: reader.list()? })
    }
}

/// A part of a scan as the sensor measured it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RawPart<'a> {
    /// Which.
    pub head: PartHead,
    /// When the scan was taken.
    pub time: ScanTime,
    /// Its values in mm, in order, codes and all.
    pub ranges_mm: List<'a, u16>,
}

impl<'a> RawPart<'a> {
    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        let ScanTime { sensor_ms, stamp_us, uncertainty_us } = self.time;
        writer.put(&self.head)?;
        writer.put(&(stamp_us.to_le_bytes(), sensor_ms.to_le_bytes(), uncertainty_us.to_le_bytes()))?;
        self.ranges_mm.write(writer)
    }

    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        let head = reader.required()?;
        let (stamp_us, sensor_ms, uncertainty_us) = reader.required()?;
        let time = ScanTime {
            sensor_ms: u64::from_le_bytes(sensor_ms),
            stamp_us: u64::from_le_bytes(stamp_us),
            uncertainty_us: u32::from_le_bytes(uncertainty_us),
        };
        Ok(Self { head, time, ranges_mm: reader.list()? })
    }
}

impl Item for BeamProfile {
    const MAX: usize = 6;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        let state: u8 = match self.state {
            BeamState::Unknown => 0,
            BeamState::Open => 1,
            BeamState::Wall => 2,
        };
        writer.put(&(self.far_mm.to_le_bytes(), self.near_mm.to_le_bytes(), self.spread_mm, state))
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let (far_mm, near_mm, spread_mm, state) = reader.required()?;
        Ok(Self {
            far_mm: u16::from_le_bytes(far_mm),
            near_mm: u16::from_le_bytes(near_mm),
            spread_mm,
            state: match state {
                1u8 => BeamState::Open,
                2 => BeamState::Wall,
                _ => BeamState::Unknown,
            },
        })
    }
}
