//! What a host asks of a module.
//!
//! ```text
//!    0  request id   u32    chosen by the host: a repeat gets the stored answer
//!    4  cookie       8 u8   from the module's Cookie; 0 in a first subscribe
//!   12  what the kind needs
//!
//!  kind                 then
//!  01  subscribe        t1        8 u8    opaque, echoed
//!  02  info             –
//!  03  get settings     –
//!  04  set settings     text              key=value, a line each
//!  05  learn            scans     varint  0: as many as set
//!  06  absorb           sequence  varint, first and last step, nearest and farthest mm  varints
//!  07  profile          version   varint  0: the newest;  parts  varint, bit i for part i, 0: all
//!  08  raw scans        seconds   varint  to the sender only; 0: no more
//!  09  raw scan again   object    varint, parts  varint, as above
//!  0a  restart          –
//!  0c  set keys         keys      bytes   34 a key; sealed only
//!  0d  update           manifest  bytes   192, see `update::manifest`: an image is about to come, or to go on
//!  0e  update chunk     offset    varint, bytes  at most 1024
//!  0f  update install   –                 all of it has come: start anew with it
//!  10  identify         seconds   varint  blink for so long; 0: no more
//! ```
//!
//! The first twelve bytes, subscribe and info are frozen for ever. Subscribe is as long as the cookie
//! it is answered with, and every request longer than a refusal: a host cannot
//! have more bytes sent to an address than it spends, until it has shown that the address is its own.

use super::DATAGRAM_MAX;
use super::codec::{Malformed, Reader, TooLong, VARINT_U32, text_max};
use super::header::{FROM_MODULE, HEADER_LEN, Header, Identity, ModuleId, Unreadable, VERSION, VERSION_MIN};
use super::refusal::{Refusal, Refused};
use super::role::Role;
use crate::background::Absorb;
use crate::update::manifest::MANIFEST_LEN;

/// Shows that a host receives what is sent to its address. All 0: none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cookie(pub [u8; 8]);

impl Cookie {
    /// What a host sends that has none yet.
    pub const NONE: Self = Self([0; 8]);
}

/// Bytes in front of what the kind needs.
pub(super) const COMMON_LEN: usize = 4 + 8;

/// Longest text of settings, bytes: leaves room in a datagram for fields to come.
pub const SETTINGS_TEXT_MAX: usize = 1024;

/// Most bytes of a request's message.
pub const REQUEST_MAX: usize = COMMON_LEN + VARINT_U32 + text_max(CHUNK_MAX);

const _: () = assert!(HEADER_LEN + REQUEST_MAX <= DATAGRAM_MAX);
const _: () =
    assert!(REQUEST_MAX >= COMMON_LEN + text_max(SETTINGS_TEXT_MAX), "a piece of an image is the longest");
const _: () = assert!(Refused::LEN <= COMMON_LEN, "the shortest request and its refusal");

/// A request.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request<'a> {
    /// Send reports and health; again every second.
    Subscribe {
        /// The host's time, in whatever form it likes: comes back with the answer.
        t1: [u8; 8],
    },
    /// The module's identity, sensor and geometry.
    Info,
    /// All settings.
    GetSettings,
    /// Change settings; all of the text or none of it is taken.
    SetSettings {
        /// `key=value`, a line each, at most [`SETTINGS_TEXT_MAX`] bytes.
        text: &'a str,
    },
    /// Learn a new background.
    Learn {
        /// Scans to learn from; 0: as many as set.
        scans: u16,
    },
    /// Make a part of what a report showed background.
    Absorb(Absorb),
    /// Send a background profile.
    Profile {
        /// Its version; 0: the newest.
        version: u16,
        /// The parts wanted, bit i for part i; 0: all.
        parts: u32,
    },
    /// Send raw scans, to this host only.
    Raw {
        /// For so long; 0: no more.
        seconds: u16,
    },
    /// Send parts of a raw scan again.
    RawAgain {
        /// The scan's object id.
        object: u32,
        /// The parts wanted, bit i for part i; 0: all.
        parts: u32,
    },
    /// Start anew.
    Restart,
    /// Replace all keys: sealed only, by the holder of one that controls, or of the label of a module without keys.
    SetKeys {
        /// See `seal::keyring`.
        keys: &'a [u8],
    },
    /// An image is about to come. One that had begun to come goes on if it is the same.
    Update {
        /// See [`Manifest`](crate::update::manifest::Manifest).
        manifest: &'a [u8; MANIFEST_LEN],
    },
    /// A piece of the image, in order.
    UpdateChunk {
        /// Where it begins.
        offset: u32,
        /// At most [`CHUNK_MAX`] bytes, and a multiple of [`WORD_LEN`](crate::update::notes::WORD_LEN) but at the end of
        /// the image.
        bytes: &'a [u8],
    },
    /// All of the image has come: start anew, and let the boot loader look at it.
    UpdateInstall,
    /// Let the LED blink so that a person finds the module.
    Identify {
        /// For so long, at most [`IDENTIFY_MAX_S`]; 0: no more.
        seconds: u16,
    },
}

/// Longest time that a module blinks for one request, s: meanwhile its LED does not show how it is.
pub const IDENTIFY_MAX_S: u16 = 60;

/// Most bytes in a piece of an image.
pub const CHUNK_MAX: usize = 1024;

impl<'a> Request<'a> {
    /// Its kind in the header.
    #[must_use]
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Subscribe { .. } => 0x01,
            Self::Info => 0x02,
            Self::GetSettings => 0x03,
            Self::SetSettings { .. } => 0x04,
            Self::Learn { .. } => 0x05,
            Self::Absorb(_) => 0x06,
            Self::Profile { .. } => 0x07,
            Self::Raw { .. } => 0x08,
            Self::RawAgain { .. } => 0x09,
            Self::Restart => 0x0a,
            Self::SetKeys { .. } => 0x0c,
            Self::Update { .. } => 0x0d,
            Self::UpdateChunk { .. } => 0x0e,
            Self::UpdateInstall => 0x0f,
            Self::Identify { .. } => 0x10,
        }
    }

    /// What a key must allow for it.
    #[must_use]
    pub const fn needs(&self) -> Role {
        match self {
            Self::SetSettings { .. }
            | Self::Learn { .. }
            | Self::Absorb(_)
            | Self::Restart
            | Self::SetKeys { .. }
            | Self::Update { .. }
            | Self::UpdateChunk { .. }
            | Self::UpdateInstall => Role::Control,
            Self::Raw { .. } | Self::RawAgain { .. } => Role::Raw,
            Self::Subscribe { .. }
            | Self::Info
            | Self::GetSettings
            | Self::Profile { .. }
            | Self::Identify { .. } => Role::Read,
        }
    }

    /// Whether it is understood in every version, and asks for no particular start of the module.
    const fn is_frozen(kind: u8) -> bool {
        matches!(kind, 0x01 | 0x02)
    }

    const fn is_known(kind: u8) -> bool {
        matches!(kind, 0x01..=0x0a | 0x0c..=0x10)
    }

    fn read(kind: u8, reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        Ok(match kind {
            0x01 => Self::Subscribe { t1: reader.required()? },
            0x02 => Self::Info,
            0x03 => Self::GetSettings,
            0x04 => {
                let text: &str = reader.required()?;
                if text.len() > SETTINGS_TEXT_MAX {
                    return Err(Malformed);
                }
                Self::SetSettings { text }
            }
            0x05 => Self::Learn { scans: reader.required()? },
            0x06 => {
                let (sequence, first_step, last_step, nearest_mm, farthest_mm) = reader.required()?;
                Self::Absorb(Absorb { sequence, first_step, last_step, nearest_mm, farthest_mm })
            }
            0x07 => Self::Profile { version: reader.required()?, parts: reader.required()? },
            0x08 => Self::Raw { seconds: reader.required()? },
            0x09 => Self::RawAgain { object: reader.required()?, parts: reader.required()? },
            0x0a => Self::Restart,
            0x0c => Self::SetKeys { keys: reader.required()? },
            0x0d => {
                let manifest: &[u8] = reader.required()?;
                Self::Update { manifest: manifest.try_into().map_err(|_| Malformed)? }
            }
            0x0e => {
                let (offset, bytes): (_, &[u8]) = reader.required()?;
                if bytes.is_empty() || bytes.len() > CHUNK_MAX {
                    return Err(Malformed);
                }
                Self::UpdateChunk { offset, bytes }
            }
            0x0f => Self::UpdateInstall,
            0x10 => Self::Identify { seconds: reader.required()? },
            _ => return Err(Malformed),
        })
    }

    /// Writes the datagram of this request to the start of `out`, for the host to send to `to`; returns
    /// its length.
    ///
    /// # Errors
    /// [`TooLong`] when it does not fit `out`, or a text is longer than [`SETTINGS_TEXT_MAX`]. A
    /// buffer of [`DATAGRAM_MAX`] bytes is always long enough for the rest.
    pub fn encode(
        &self,
        to: Identity,
        request_id: u32,
        cookie: Cookie,
        out: &mut [u8],
    ) -> Result<usize, TooLong> {
        let mut writer = Header::new(to, self.kind()).start(out)?;
        writer.put(&(request_id.to_le_bytes(), cookie.0))?;
        match *self {
            Self::Subscribe { t1 } => writer.put(&t1)?,
            Self::Info | Self::GetSettings | Self::Restart | Self::UpdateInstall => {}
            Self::SetSettings { text } if text.len() > SETTINGS_TEXT_MAX => return Err(TooLong),
            Self::SetSettings { text } => writer.put(text)?,
            Self::Learn { scans } => writer.put(&scans)?,
            Self::Absorb(Absorb { sequence, first_step, last_step, nearest_mm, farthest_mm }) => {
                writer.put(&(sequence, first_step, last_step, nearest_mm, farthest_mm))?;
            }
            Self::Profile { version, parts } => writer.put(&(version, parts))?,
            Self::Raw { seconds } => writer.put(&seconds)?,
            Self::RawAgain { object, parts } => writer.put(&(object, parts))?,
            Self::SetKeys { keys } => writer.put(keys)?,
            Self::Update { manifest } => writer.put(manifest.as_slice())?,
            Self::UpdateChunk { offset, bytes } => writer.put(&(offset, bytes))?,
            Self::Identify { seconds } => writer.put(&seconds)?,
        }
        Ok(HEADER_LEN + writer.finish())
    }
}

/// A request as it came to a module: enough is known of it to answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Incoming<'a> {
    /// Its header.
    pub header: Header,
    /// Its number.
    pub request_id: u32,
    /// The cookie it came with.
    pub cookie: Cookie,
    content: &'a [u8],
}

impl<'a> Incoming<'a> {
    /// Reads the part that is the same in every version.
    ///
    /// # Errors
    /// [`Unreadable::Foreign`], [`Unreadable::TooLong`], [`Unreadable::TooShort`] or
    /// [`Unreadable::WrongDirection`], in this order: to be counted and dropped.
    pub fn open(datagram: &'a [u8]) -> Result<Self, Unreadable> {
        let (header, message) = Header::open(datagram)?;
        if header.kind & FROM_MODULE != 0 {
            return Err(Unreadable::WrongDirection);
        }
        let mut reader = Reader::new(message);
        let (request_id, cookie) = reader.required().map_err(|_| Unreadable::TooShort)?;
        let content = reader.rest();
        Ok(Self { header, request_id: u32::from_le_bytes(request_id), cookie: Cookie(cookie), content })
    }

    /// The request, for a module of identity `own`. Subscribe and info are read in any version: see
    /// [`speaks_our_version`](Self::speaks_our_version).
    ///
    /// # Errors
    /// [`Refusal::WrongModule`], [`Refusal::Version`], [`Refusal::Unsupported`],
    /// [`Refusal::WrongBoot`] or [`Refusal::Malformed`], in this order.
    pub fn request(&self, own: Identity) -> Result<Request<'a>, Refusal> {
        let Identity { module, boot } = self.header.identity;
        let kind = self.header.kind;
        if module != own.module && module != ModuleId::ANY {
            return Err(Refusal::WrongModule);
        }
        if !Request::is_frozen(kind) {
            if !self.speaks_our_version() {
                return Err(Refusal::VERSION);
            }
            if !Request::is_known(kind) {
                return Err(Refusal::Unsupported);
            }
            if boot != own.boot {
                return Err(Refusal::WrongBoot);
            }
        }
        Request::read(kind, &mut Reader::new(self.content)).map_err(|Malformed| Refusal::Malformed)
    }

    /// Whether reports can be sent to this host.
    #[must_use]
    pub const fn speaks_our_version(&self) -> bool {
        self.header.version >= VERSION_MIN && self.header.version <= VERSION
    }

    /// The refusal of this request.
    #[must_use]
    pub const fn refused(&self, refusal: Refusal) -> Refused {
        Refused { request_id: self.request_id, kind: self.header.kind, refusal }
    }
}
