//! Values to bytes and back with `postcard`, and what it leaves open: lists, added fields, codes.
//!
//! ```text
//!  message body   field │ field │ … │ list │ … │ field added later │ fields of a newer peer
//!                 ╰── required: an end in here is malformed ──╯ ╰ absent: default ╯ ╰ ignored ╯
//!
//!  list           number of items (varint) │ item │ item │ …
//! ```
//!
//! Wire format of `postcard` 1 (<https://postcard.jamesmunns.com/wire-format>): integers of more than
//! one byte are varints, seven bits a byte, the lowest first; `i16` and so on are zigzagged before;
//! `[u8; N]` is N bytes; a `str` is its length and its bytes; an option is 0, or 1 and the value. Fields
//! marked fixed are little endian and as long as their type.

use postcard::ser_flavors::{Flavor, Slice};
use serde::{Deserialize, Serialize};

/// The buffer is too short for the message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TooLong;

impl core::fmt::Display for TooLong {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the message is longer than the buffer")
    }
}

impl core::error::Error for TooLong {}

/// The bytes end too soon or hold a value that cannot be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Malformed;

/// Writes values one behind the other.
pub struct Writer<'a> {
    serializer: postcard::Serializer<Slice<'a>>,
}

impl<'a> Writer<'a> {
    pub(super) fn new(room: &'a mut [u8]) -> Self {
        Self { serializer: postcard::Serializer { output: Slice::new(room) } }
    }

    pub(super) fn put<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), TooLong> {
        value.serialize(&mut self.serializer).map_err(|_| TooLong)
    }

    /// A fixed `u16`.
    pub(super) fn put_u16(&mut self, value: u16) -> Result<(), TooLong> {
        self.put(&value.to_le_bytes())
    }
    pub(super) fn finish(self) -> usize {
        self.serializer.output.finalize().map_or(0, |written| written.len())
    }
}

/// Reads values one behind the other.
#[derive(Clone, Copy)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// What has not been read.
    pub(super) const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// A field that every peer sends.
    pub(super) fn required<T: Deserialize<'a>>(&mut self) -> Result<T, Malformed> {
        let (value, rest) = postcard::take_from_bytes(self.rest).map_err(|_| Malformed)?;
        self.rest = rest;
        Ok(value)
    }

    /// A fixed `u16`.
    pub(super) fn required_u16(&mut self) -> Result<u16, Malformed> {
        self.required().map(u16::from_le_bytes)
    }

    /// A list that every peer sends.
    pub(super) fn list<T: Item>(&mut self) -> Result<List<'a, T>, Malformed> {
        let count: u16 = self.required()?;
        let items = self.rest;
        for _ in 0..count {
            T::read(self)?;
        }
        Ok(List(Items::Received { count: count.into(), reader: Self::new(items) }))
    }

    /// `field`, or its default when the peer is older than this part of the message.
    pub(super) fn added<T: Default>(
        &mut self,
        field: impl FnOnce(&mut Self) -> Result<T, Malformed>,
    ) -> Result<T, Malformed> {
        if self.rest.is_empty() { Ok(T::default()) } else { field(self) }
    }
}

/// An item of a list.
pub trait Item: Clone {
    /// Most bytes of one.
    const MAX: usize;
    /// Appends this one.
    ///
    /// # Errors
    /// [`TooLong`].
    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong>;
    /// Takes one.
    ///
    /// # Errors
    /// [`Malformed`].
    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed>;
}

/// A fixed `u16`, such as a range.
impl Item for u16 {
    const MAX: usize = 2;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put_u16(*self)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.required_u16()
    }
}

/// Items to be sent, or items received: those are checked once and decoded as they are asked for.
pub struct List<'a, T>(Items<'a, T>);

enum Items<'a, T> {
    ToSend(&'a [T]),
    Received { count: usize, reader: Reader<'a> },
}

impl<'a, T> List<'a, T> {
    /// A list to be sent.
    #[must_use]
    pub const fn new(items: &'a [T]) -> Self {
        Self(Items::ToSend(items))
    }

    /// Number of items.
    #[must_use]
    pub const fn len(&self) -> usize {
        match &self.0 {
            Items::ToSend(items) => items.len(),
            Items::Received { count, .. } => *count,
        }
    }

    /// Whether there are no items.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a, T: Item> List<'a, T> {
    /// The items.
    pub fn iter(&self) -> impl Iterator<Item = T> + use<'a, T> {
        let Self(items) = *self;
        let (slice, mut reader, count) = match items {
            Items::ToSend(items) => (items, Reader::new(&[]), 0),
            Items::Received { count, reader } => (&[][..], reader, count),
        };
        slice.iter().cloned().chain((0..count).map_while(move |_| T::read(&mut reader).ok()))
    }

    /// Appends the number of items and the items.
    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&u16::try_from(self.len()).map_err(|_| TooLong)?)?;
        self.iter().try_for_each(|item| item.write(writer))
    }
}

impl<T> Clone for List<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for List<'_, T> {}

impl<T> Clone for Items<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Items<'_, T> {}

impl<T> Default for List<'_, T> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<T: Item + PartialEq> PartialEq for List<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

impl<T: Item + core::fmt::Debug> core::fmt::Debug for List<'_, T> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Most bytes of the varint of a `u16`.
pub(super) const VARINT_U16: usize = 3;
/// Most bytes of the varint of a `u32` or `i32`.
pub(super) const VARINT_U32: usize = 5;
/// Most bytes of the varint of a `u64`.
pub(super) const VARINT_U64: usize = 10;

/// Most bytes of a text of at most `bytes` bytes.
pub(super) const fn text_max(bytes: usize) -> usize {
    count_bytes(bytes) + bytes
}

/// Bytes of the number of items, or bytes, in front of them.
pub(super) const fn count_bytes(count: usize) -> usize {
    if count < 1 << 7 {
        1
    } else if count < 1 << 14 {
        2
    } else {
        3
    }
}

/// Serialises at most the first `BYTES` bytes of a text, whole characters only.
pub(super) fn cut<S: serde::Serializer, const BYTES: usize>(
    text: &str,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    // A character ends at least every fourth byte.
    let kept = (0..=BYTES).rev().take(4).find_map(|bytes| text.get(..bytes));
    serializer.serialize_str(if text.len() <= BYTES { text } else { kept.unwrap_or("") })
}

/// An enum that is one byte on the wire. Codes are only ever added; one that is not known here, from a
/// newer peer, reads as `Unknown`.
macro_rules! code_enum {
    ($(#[$meta:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $code:literal, $text:literal;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[serde(from = "u8", into = "u8")]
        pub enum $name {
            $($(#[$doc])* $variant,)*
            /// A code of a newer peer.
            Unknown,
        }

        impl $name {
            /// All that are known, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];
        }

        impl From<u8> for $name {
            fn from(code: u8) -> Self {
                match code {
                    $($code => Self::$variant,)*
                    _ => Self::Unknown,
                }
            }
        }

        impl From<$name> for u8 {
            fn from(value: $name) -> Self {
                match value {
                    $($name::$variant => $code,)*
                    $name::Unknown => Self::MAX,
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(match self {
                    $(Self::$variant => $text,)*
                    Self::Unknown => "unknown to this program",
                })
            }
        }
    };
}
pub(super) use code_enum;
