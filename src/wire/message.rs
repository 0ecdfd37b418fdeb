//! What a module sends.
//!
//! ```text
//!  kind              message                                                     frozen
//!  80  refused       see `refusal`                                                 yes
//!  81  cookie        request id u32, t1 8 u8, cookie 8 u8                          yes
//!  82  subscribed    request id u32, t1 8 u8, t2 u64, t3 u64, lease ms u16,        yes
//!                    may control u8, subscribers u8
//!  83  info          see `info`                                                    yes
//!  84  done          request id u32
//!  85  settings      request id u32, text
//!  86  absorbed      request id u32, beams u16, background version u16
//!  88  receiving     request id u32, next offset u32
//!  90  report        see `report`
//!  91  health        see `health`
//!  92  profile part  see `part`
//!  93  raw part      see `part`
//!  94  pressed       see `pressed`
//! ```
//!
//! The integers of answers are fixed. *t2* is when the module received the request and *t3* when it sent
//! the answer, µs since boot: the clock of all stamps.

use super::DATAGRAM_MAX;
use super::codec::{Reader, TooLong, text_max};
use super::header::{FROM_MODULE, HEADER_LEN, Header, Identity, Unreadable, VERSION, VERSION_MIN};
use super::health::Health;
use super::info::Info;
use super::part::{ProfilePart, RawPart};
use super::pressed::Pressed;
use super::refusal::Refused;
use super::report::Report;
use super::request::{COMMON_LEN, Cookie, SETTINGS_TEXT_MAX};
use serde::{Deserialize, Serialize};

/// Bytes of a cookie's message.
const COOKIE_LEN: usize = 4 + 8 + 8;

/// Most bytes of a settings message.
pub const SETTINGS_MAX: usize = 4 + text_max(SETTINGS_TEXT_MAX);

const _: () = assert!(HEADER_LEN + SETTINGS_MAX <= DATAGRAM_MAX);
const _: () = assert!(COOKIE_LEN == COMMON_LEN + 8, "a first subscribe and its answer");

/// A message of a module.
#[derive(Clone, Copy, PartialEq, Debug)]
#[allow(clippy::large_enum_variant, reason = "health has all counters, and there is no heap to box it on")]
pub enum Message<'a> {
    /// A request was refused.
    Refused(Refused),
    /// The answer to a subscribe without a valid cookie: here is one, use it.
    Cookie {
        /// The request this answers.
        request_id: u32,
        /// As it came.
        t1: [u8; 8],
        /// What to send from now on.
        cookie: Cookie,
    },
    /// The answer to a subscribe with a cookie.
    Subscribed(Subscribed),
    /// The module's identity, sensor and geometry.
    Info(Info<'a>),
    /// A request was carried out, or what it asked for has begun.
    Done {
        /// The request this answers.
        request_id: u32,
    },
    /// All settings.
    Settings {
        /// The request this answers.
        request_id: u32,
        /// `key=value`, a line each, at most [`SETTINGS_TEXT_MAX`] bytes.
        text: &'a str,
    },
    /// A place became background.
    Absorbed {
        /// The request this answers.
        request_id: u32,
        /// Beams that took it.
        beams: u16,
        /// The background version from now on.
        background_version: u16,
    },
    /// An image is being received.
    Receiving {
        /// The request this answers.
        request_id: u32,
        /// Where the next piece begins: all before it is stored.
        next: u32,
    },
    /// What a scan showed.
    Report(Report<'a>),
    /// How the module is.
    Health(Health<'a>),
    /// A part of a background profile.
    ProfilePart(ProfilePart<'a>),
    /// A part of a raw scan.
    RawPart(RawPart<'a>),
    /// Which panels of a pressure floor are down.
    Pressed(Pressed<'a>),
}

/// A place among the subscribers is taken, or kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Subscribed {
    /// The request this answers.
    #[serde(with = "postcard::fixint::le")]
    pub request_id: u32,
    /// The host's time, as it came.
    pub t1: [u8; 8],
    /// When the request was received, µs since boot.
    #[serde(with = "postcard::fixint::le")]
    pub t2_us: u64,
    /// When this was sent, µs since boot.
    #[serde(with = "postcard::fixint::le")]
    pub t3_us: u64,
    /// Forgotten so long after the last subscribe, ms.
    #[serde(with = "postcard::fixint::le")]
    pub lease_ms: u16,
    /// Whether this host may set, learn, absorb and restart.
    pub may_control: bool,
    /// Subscribers, this one included.
    pub subscribers: u8,
}

impl<'a> Message<'a> {
    /// Its kind in the header.
    #[must_use]
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Refused(_) => 0x80,
            Self::Cookie { .. } => 0x81,
            Self::Subscribed(_) => 0x82,
            Self::Info(_) => 0x83,
            Self::Done { .. } => 0x84,
            Self::Settings { .. } => 0x85,
            Self::Absorbed { .. } => 0x86,
            Self::Receiving { .. } => 0x88,
            Self::Report(_) => 0x90,
            Self::Health(_) => 0x91,
            Self::ProfilePart(_) => 0x92,
            Self::RawPart(_) => 0x93,
            Self::Pressed(_) => 0x94,
        }
    }

    const fn is_frozen(kind: u8) -> bool {
        matches!(kind, 0x80..=0x83)
    }

    fn read(kind: u8, reader: &mut Reader<'a>) -> Result<Self, Unreadable> {
        Ok(match kind {
            0x80 => Self::Refused(Refused::read(reader)?),
            0x81 => {
                let (request_id, t1, cookie) = reader.required()?;
                Self::Cookie { request_id: u32::from_le_bytes(request_id), t1, cookie: Cookie(cookie) }
            }
            0x82 => Self::Subscribed(reader.required()?),
            0x83 => Self::Info(reader.required()?),
            0x84 => Self::Done { request_id: u32::from_le_bytes(reader.required()?) },
            0x85 => {
                let (request_id, text) = reader.required()?;
                Self::Settings { request_id: u32::from_le_bytes(request_id), text }
            }
            0x86 => {
                let (request_id, beams, background_version) = reader.required()?;
                Self::Absorbed {
                    request_id: u32::from_le_bytes(request_id),
                    beams: u16::from_le_bytes(beams),
                    background_version: u16::from_le_bytes(background_version),
                }
            }
            0x88 => {
                let (request_id, next) = reader.required()?;
                Self::Receiving { request_id: u32::from_le_bytes(request_id), next: u32::from_le_bytes(next) }
            }
            0x90 => Self::Report(Report::read(reader)?),
            0x91 => Self::Health(Health::read(reader)?),
            0x92 => Self::ProfilePart(ProfilePart::read(reader)?),
            0x93 => Self::RawPart(RawPart::read(reader)?),
            0x94 => Self::Pressed(Pressed::read(reader)?),
            kind => return Err(Unreadable::Kind(kind)),
        })
    }

    /// Writes the datagram of this message to the start of `out`, for module `from` to send; returns its
    /// length.
    ///
    /// # Errors
    /// [`TooLong`] when it does not fit `out`. A buffer of [`DATAGRAM_MAX`] bytes is long enough for
    /// every message whose lists and texts keep to the stated capacities.
    pub fn encode(&self, from: Identity, out: &mut [u8]) -> Result<usize, TooLong> {
        let mut writer = Header::new(from, self.kind()).start(out)?;
        match self {
            Self::Refused(refused) => refused.write(&mut writer)?,
            Self::Cookie { request_id, t1, cookie } => {
                writer.put(&(request_id.to_le_bytes(), t1, cookie.0))?
            }
            Self::Subscribed(subscribed) => writer.put(subscribed)?,
            Self::Info(info) => writer.put(info)?,
            Self::Done { request_id } => writer.put(&request_id.to_le_bytes())?,
            Self::Settings { request_id, text } => writer.put(&(request_id.to_le_bytes(), text))?,
            Self::Absorbed { request_id, beams, background_version } => {
                let numbers = (beams.to_le_bytes(), background_version.to_le_bytes());
                writer.put(&(request_id.to_le_bytes(), numbers))?;
            }
            Self::Receiving { request_id, next } => {
                writer.put(&(request_id.to_le_bytes(), next.to_le_bytes()))?;
            }
            Self::Report(report) => report.write(&mut writer)?,
            Self::Health(health) => health.write(&mut writer)?,
            Self::ProfilePart(part) => part.write(&mut writer)?,
            Self::RawPart(part) => part.write(&mut writer)?,
            Self::Pressed(pressed) => pressed.write(&mut writer)?,
        }
        Ok(HEADER_LEN + writer.finish())
    }

    /// Reads a datagram of a module.
    ///
    /// # Errors
    /// [`Unreadable`]: to be counted and dropped. With [`Unreadable::Version`] the module is there, and
    /// a host shows both versions.
    pub fn decode(datagram: &'a [u8]) -> Result<(Header, Self), Unreadable> {
        let (header, message) = Header::open(datagram)?;
        if header.kind & FROM_MODULE == 0 {
            return Err(Unreadable::WrongDirection);
        }
        if !matches!(header.version, VERSION_MIN..=VERSION) && !Self::is_frozen(header.kind) {
            return Err(Unreadable::Version(header.version));
        }
        Ok((header, Self::read(header.kind, &mut Reader::new(message))?))
    }
}
