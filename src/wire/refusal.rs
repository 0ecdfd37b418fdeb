//! Why a request is refused.
//!
//! ```text
//!    0  request id   u32    of the refused request
//!    4  kind         u8     its kind
//!    5  code         u8     see the table in the source; codes are only ever added
//!    6  detail       2 u8   Version: oldest and newest version spoken; Setting: line and fault; Image: fault
//! ```
//!
//! Fixed, and so short that a refusal is never longer than the request: an attacker that forges a
//! host's address cannot flood that host with answers. Code 0 and its detail are frozen for ever.

use super::codec::{Malformed, Reader, TooLong, Writer, code_enum};
use super::counters::Counter;
use super::header::{VERSION, VERSION_MIN};
use crate::background::{AbsorbRefusal, LearnRefusal};

code_enum! {
    /// What is wrong with a setting.
    SettingFault {
        /// No `key=value`.
        Syntax = 1, "not of the form key=value";
        /// There is no such key.
        Key = 2, "no such setting";
        /// The value is of the wrong kind.
        Value = 3, "not a value of the right kind";
        /// The value is too small, too large or too long.
        Range = 4, "the value is out of range";
        /// It does not go together with another setting.
        Conflict = 5, "does not go together with another setting";
    }
}

code_enum! {
    /// Why an image is not received.
    ImageFault {
        /// The manifest is none.
        Manifest = 1, "not the manifest of an image";
        /// It is for another board, or another program.
        Program = 2, "for another board, or another program";
        /// Its version is below the least that may start.
        TooOld = 3, "older than the module may go back to";
        /// There is no room for it.
        TooLarge = 4, "larger than there is room for";
        /// That piece is not the next, or no image is being received.
        Sequence = 5, "not the next piece of it";
        /// The image that runs is on trial itself.
        OnTrial = 6, "the running image is on trial itself";
    }
}

/// Why a request is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The module speaks other versions of the protocol.
    Version {
        /// The oldest.
        min: u8,
        /// The newest.
        max: u8,
    },
    /// No such request in this module.
    Unsupported,
    /// The request ends too soon or holds a value that cannot be.
    Malformed,
    /// A cookie of another address, another start of the module, or none.
    BadCookie,
    /// All places for subscribers are taken.
    Full,
    /// Meant for another module.
    WrongModule,
    /// The module has started anew since.
    WrongBoot,
    /// The sender is not listed as one that may control.
    NotAllowed,
    /// That version of the background, or that scan, is gone.
    Superseded,
    /// Something else is there now.
    Moved,
    /// No background has been learned.
    NoBackground,
    /// Steps or ranges in the wrong order, or none of the scan.
    Span,
    /// That report is too old or was never made.
    Report,
    /// A background needs more scans.
    TooFewScans,
    /// No sensor is known yet.
    NoSensor,
    /// Settings are being stored, or another request of the kind is under way: ask again.
    Busy,
    /// A setting cannot be: none of the request's was taken.
    Setting {
        /// Line of the request, from 0.
        line: u8,
        /// What is wrong with it.
        fault: SettingFault,
    },
    /// The store failed; the old settings are in use.
    NotStored,
    /// The module listens to holders of a key only.
    NeedsKey,
    /// The module has no such key.
    NoSuchKey,
    /// These are no keys of a module.
    BadKeys,
    /// An image is not received.
    Image(ImageFault),
    /// A code of a newer module.
    Unknown(u8),
}

impl Refusal {
    /// The refusal of every version but those spoken here.
    pub const VERSION: Self = Self::Version { min: VERSION_MIN, max: VERSION };
    fn code(self) -> [u8; 3] {
        match self {
            Self::Version { min, max } => [0, min, max],
            Self::Unsupported => [1, 0, 0],
            Self::Malformed => [2, 0, 0],
            Self::BadCookie => [3, 0, 0],
            Self::Full => [4, 0, 0],
            Self::WrongModule => [5, 0, 0],
            Self::WrongBoot => [6, 0, 0],
            Self::NotAllowed => [7, 0, 0],
            Self::Superseded => [8, 0, 0],
            Self::Moved => [9, 0, 0],
            Self::NoBackground => [10, 0, 0],
            Self::Span => [11, 0, 0],
            Self::Report => [12, 0, 0],
            Self::TooFewScans => [13, 0, 0],
            Self::NoSensor => [14, 0, 0],
            Self::Busy => [15, 0, 0],
            Self::Setting { line, fault } => [16, line, fault.into()],
            Self::NotStored => [17, 0, 0],
            Self::NeedsKey => [18, 0, 0],
            Self::NoSuchKey => [19, 0, 0],
            Self::BadKeys => [20, 0, 0],
            Self::Image(fault) => [21, fault.into(), 0],
            Self::Unknown(code) => [code, 0, 0],
        }
    }

    fn of_code([code, one, two]: [u8; 3]) -> Self {
        match code {
            0 => Self::Version { min: one, max: two },
            1 => Self::Unsupported,
            2 => Self::Malformed,
            3 => Self::BadCookie,
            4 => Self::Full,
            5 => Self::WrongModule,
            6 => Self::WrongBoot,
            7 => Self::NotAllowed,
            8 => Self::Superseded,
            9 => Self::Moved,
            10 => Self::NoBackground,
            11 => Self::Span,
            12 => Self::Report,
            13 => Self::TooFewScans,
            14 => Self::NoSensor,
            15 => Self::Busy,
            16 => Self::Setting { line: one, fault: two.into() },
            17 => Self::NotStored,
            18 => Self::NeedsKey,
            19 => Self::NoSuchKey,
            20 => Self::BadKeys,
            21 => Self::Image(one.into()),
            code => Self::Unknown(code),
        }
    }

    /// Where the module counts it.
    #[must_use]
    pub const fn counter(self) -> Counter {
        match self {
            Self::Version { .. } => Counter::RefusedVersion,
            Self::Unsupported | Self::Unknown(_) => Counter::RefusedUnsupported,
            Self::Malformed => Counter::RefusedMalformed,
            Self::BadCookie => Counter::RefusedBadCookie,
            Self::Full => Counter::RefusedFull,
            Self::WrongModule => Counter::RefusedWrongModule,
            Self::WrongBoot => Counter::RefusedWrongBoot,
            Self::NotAllowed => Counter::RefusedNotAllowed,
            Self::Superseded => Counter::RefusedSuperseded,
            Self::Moved | Self::NoBackground | Self::Span | Self::Report => Counter::RefusedAbsorb,
            Self::TooFewScans | Self::NoSensor => Counter::RefusedLearn,
            Self::Busy => Counter::RefusedBusy,
            Self::Setting { .. } | Self::NotStored | Self::BadKeys => Counter::RefusedSetting,
            Self::NeedsKey | Self::NoSuchKey => Counter::RefusedKey,
            Self::Image(_) => Counter::RefusedImage,
        }
    }
}

impl From<AbsorbRefusal> for Refusal {
    fn from(refusal: AbsorbRefusal) -> Self {
        match refusal {
            AbsorbRefusal::NoBackground => Self::NoBackground,
            AbsorbRefusal::Span => Self::Span,
            AbsorbRefusal::Report => Self::Report,
            AbsorbRefusal::Moved => Self::Moved,
        }
    }
}

impl From<LearnRefusal> for Refusal {
    fn from(refusal: LearnRefusal) -> Self {
        match refusal {
            LearnRefusal::TooFewScans => Self::TooFewScans,
            LearnRefusal::NotConfigured => Self::NoSensor,
        }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Version { min, max } => {
                return write!(f, "the module speaks versions {min} to {max} of the protocol");
            }
            Self::Setting { line, fault } => return write!(f, "line {line} of the settings: {fault}"),
            Self::Unknown(code) => return write!(f, "refused by a newer module, code {code}"),
            Self::Image(fault) => return write!(f, "the image: {fault}"),
            Self::Unsupported => "the module has no such request",
            Self::Malformed => "the request is malformed",
            Self::BadCookie => "not subscribed, or no longer",
            Self::Full => "all places for subscribers are taken",
            Self::WrongModule => "another module is at this address",
            Self::WrongBoot => "the module has started anew",
            Self::NotAllowed => "this host may not control the module",
            Self::Superseded => "a newer one has taken its place",
            Self::Moved => "something else is there now",
            Self::NoBackground => "no background has been learned",
            Self::Span => "no such steps or ranges",
            Self::Report => "that report is too old or was never made",
            Self::TooFewScans => "a background needs at least 30 scans",
            Self::NoSensor => "no sensor is known yet",
            Self::NotStored => "it cannot be stored; nothing has changed",
            Self::NeedsKey => "the module listens to holders of a key only",
            Self::NoSuchKey => "the module has no such key",
            Self::BadKeys => "these are no keys of a module",
            Self::Busy => "busy with an earlier request; ask again",
        })
    }
}

impl core::error::Error for Refusal {}

/// A refusal on the wire: of which request, and why.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refused {
    /// The refused request's id.
    pub request_id: u32,
    /// Its kind.
    pub kind: u8,
    /// Why.
    pub refusal: Refusal,
}

impl Refused {
    /// Bytes of the message.
    pub const LEN: usize = 4 + 1 + 3;

    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&(self.request_id.to_le_bytes(), self.kind, self.refusal.code()))
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let (request_id, kind, code) = reader.required()?;
        Ok(Self { request_id: u32::from_le_bytes(request_id), kind, refusal: Refusal::of_code(code) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_refusal_reads_as_it_was_written_and_new_codes_are_kept() {
        for code in 0..=255 {
            for detail in [[0, 0], [1, 5], [2, 1]] {
                let refusal = Refusal::of_code([code, detail[0], detail[1]]);
                assert_eq!(Refusal::of_code(refusal.code()), refusal);
                assert_eq!(refusal.code()[0], code);
            }
        }
        assert_eq!(Refusal::of_code([200, 1, 1]), Refusal::Unknown(200));
        assert_eq!(Refusal::VERSION.code(), [0, 1, 1]);
    }
}
