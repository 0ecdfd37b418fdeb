//! What the reader reports, and what it counts.

use super::{command::Command, info::SensorState, info::StateCode, info::Version};
use super::{parameters::Parameters, status::Status};

/// Something the sensor said, complete and correct; or something that had to be dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A reply that carries no data: to a command that has none, a refusal, the start of a
    /// measurement (`00`), or a report of trouble inside one (`0M`, `0L`, 21 to 98).
    Reply(Reply),
    /// A reply in SCIP 1.1: one character of status, no checksum.
    Scip11(Scip11Reply),
    /// `VV`.
    Version(Version),
    /// `PP`.
    Parameters(Parameters),
    /// `II`.
    State(SensorState),
    /// `%ST`.
    StateCode(StateCode),
    /// `TM1`.
    Time(TimeReply),
    /// A whole scan is in the caller's buffer.
    Scan(ScanHeader),
    /// A whole reply to nothing that is expected now: a late one, one to the request of another client,
    /// or one whose echo was damaged. Counted in [`Losses::unexpected`]. A status of SCIP 1.1 has
    /// a space for its second character.
    Unexpected(Status),
    /// Something was dropped.
    Lost(Loss),
}

/// A reply without data.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reply {
    /// What it replies to.
    pub command: Command,
    /// Its status.
    pub status: Status,
    /// The clock when the chunk with its first byte was fed.
    pub first_byte_us: u64,
}

/// A reply in SCIP 1.1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scip11Reply {
    /// What it replies to.
    pub command: Command,
    /// `b'0'` accepted; `b'E'` not known.
    pub status: u8,
}

/// The sensor's clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TimeReply {
    /// Milliseconds in 24 bits.
    pub stamp_ms: u32,
    /// The clock when the chunk with the reply's first byte was fed.
    pub first_byte_us: u64,
}

/// What came with a scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScanHeader {
    /// Whether it was streamed (`MD`, `MS`) or asked for (`GD`, `GS`).
    pub streamed: bool,
    /// The sensor's clock when step 0 passed, ms in 24 bits.
    pub stamp_ms: u32,
    /// Values in the buffer, from its start.
    pub beams: u16,
    /// Scans still to come; 0 in a stream without end and for `GD` and `GS`.
    pub remaining: u8,
    /// The clock when the chunk with the first byte of the echo was fed. When the end of a broken reply
    /// was glued to the echo: the chunk with its last byte, at most one line later.
    pub first_byte_us: u64,
}

/// Something was dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loss {
    /// Why.
    pub cause: LossCause,
    /// What.
    pub dropped: Dropped,
}

/// What was dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Dropped {
    /// One scan.
    Scan,
    /// The reply to this command, which stays expected.
    Reply(Command),
    /// One line of a `VV` or `II` reply, which goes on.
    Line,
    /// Bytes that were not part of an expected reply.
    Bytes,
}

/// Why something was dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LossCause {
    /// A checksum was wrong.
    Checksum,
    /// A character outside the code in a data or stamp line.
    Character,
    /// A line longer or shorter than its place in the reply allows.
    LineLength,
    /// More or fewer values than asked for, or a last value cut short.
    ValueCount,
    /// The caller's buffer is too short for the scan.
    BufferTooShort,
    /// A line that is no expected echo, and what follows is no status.
    Echo,
    /// No status behind an expected echo.
    Status,
    /// Another reply began inside this one.
    ForeignReply,
    /// A `PP` reply without one of its seven numbers.
    Parameters,
    /// An info line without `KEY:VALUE;S`.
    InfoLine,
}

impl core::fmt::Display for LossCause {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Checksum => "wrong checksum",
            Self::Character => "illegal character",
            Self::LineLength => "wrong length of a line",
            Self::ValueCount => "wrong number of values",
            Self::BufferTooShort => "the scan is larger than its buffer",
            Self::Echo => "neither an expected echo nor a reply",
            Self::Status => "no status behind the echo",
            Self::ForeignReply => "another reply began in the middle",
            Self::Parameters => "a sensor parameter is missing",
            Self::InfoLine => "a malformed info line",
        })
    }
}

impl core::error::Error for LossCause {}

/// Everything dropped since the reader was made, by cause. Counters stop at their largest value.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Losses {
    /// [`LossCause::Checksum`].
    pub checksum: u32,
    /// [`LossCause::Character`].
    pub character: u32,
    /// [`LossCause::LineLength`].
    pub line_length: u32,
    /// [`LossCause::ValueCount`].
    pub value_count: u32,
    /// [`LossCause::BufferTooShort`].
    pub buffer_too_short: u32,
    /// [`LossCause::Echo`].
    pub echo: u32,
    /// [`LossCause::Status`].
    pub status: u32,
    /// [`LossCause::ForeignReply`].
    pub foreign_reply: u32,
    /// [`LossCause::Parameters`].
    pub parameters: u32,
    /// [`LossCause::InfoLine`].
    pub info_line: u32,
    /// Replies reported as [`Event::Unexpected`].
    pub unexpected: u32,
    /// Scans among all these.
    pub scans: u32,
}

impl Losses {
    pub(super) const NONE: Self = Self {
        checksum: 0,
        character: 0,
        line_length: 0,
        value_count: 0,
        buffer_too_short: 0,
        echo: 0,
        status: 0,
        foreign_reply: 0,
        parameters: 0,
        info_line: 0,
        unexpected: 0,
        scans: 0,
    };

    pub(super) fn count(&mut self, loss: Loss) {
        let counter = match loss.cause {
            LossCause::Checksum => &mut self.checksum,
            LossCause::Character => &mut self.character,
            LossCause::LineLength => &mut self.line_length,
            LossCause::ValueCount => &mut self.value_count,
            LossCause::BufferTooShort => &mut self.buffer_too_short,
            LossCause::Echo => &mut self.echo,
            LossCause::Status => &mut self.status,
            LossCause::ForeignReply => &mut self.foreign_reply,
            LossCause::Parameters => &mut self.parameters,
            LossCause::InfoLine => &mut self.info_line,
        };
        *counter = counter.saturating_add(1);
        if loss.dropped == Dropped::Scan {
            self.scans = self.scans.saturating_add(1);
        }
    }
}
