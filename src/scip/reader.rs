//! The reader: bytes in, events out, in pieces of any size.
//!
//! ```text
//!                 ┌────────────────────────── empty line ──────────────────────────┐
//!                 ▼                                                                │
//!   ┌─▶ echo ─▶ status ─┬─▶ stamp ─▶ data ────────▶ Scan                           │
//!   │     │             ├─▶ info lines ───────────▶ Version, Parameters, State     │
//!   │     │             ├─▶ clock, state code ─┐                                   │
//!   │     │             ├──────────────────────┴─▶ end ─▶ Reply, Scip11, Time, …   │
//!   │     ▼             │                                                          │
//!   │   not expected    └─▶ skip ─────────────────▶ Unexpected                     │
//!   │
//!   └─ drop ◀─ Lost: any line that does not fit its place
//! ```
//!
//! After a fault everything up to the next empty line is dropped. An expected echo ends that
//! early, wherever it stands: on a line of its own in the middle of another reply, or, for
//! a stream, glued to a line that was cut. So a fault costs the scan it hit and no other.

use super::checksum;
use super::command::{Command, Request};
use super::data_block::{DataBlock, Progress, Step};
use super::encoding;
use super::event::{Dropped, Event, Loss, LossCause, Losses, Reply, ScanHeader, Scip11Reply, TimeReply};
use super::info::{SensorState, StateCode, Version};
use super::parameters::PartialParameters;
use super::status::Status;
use super::text_line::Line;

/// Longest line that may still be an echo, of whatever request, before it is garbage.
const LONGEST_ECHO: usize = 64;

/// What one call of [`Reader::feed`] did.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use]
pub struct Fed {
    /// Bytes taken: at least one of a chunk that is not empty. Feed the rest again.
    pub consumed: usize,
    /// What the last of them completed.
    pub event: Option<Event>,
}

/// Takes a sensor's bytes apart.
#[derive(Clone, Debug)]
pub struct Reader {
    /// The command that waits for its reply.
    pending: Option<Request>,
    /// The measurement whose scans may come at any time.
    stream: Option<Request>,
    losses: Losses,
    line: Line,
    place: Place,
    /// What is being read, once its echo is known.
    reply: Option<ExpectedReply>,
    block: DataBlock,
    info: Info,
}

/// Where in a reply the next byte belongs.
#[derive(Clone, Copy, Debug)]
enum Place {
    Echo,
    Status,
    Stamp,
    Data {
        stamp_ms: u32,
    },
    Info,
    Clock,
    StateCode,
    /// Before the empty line of a reply.
    End(Ending),
    /// In the reply to a request of another client.
    Skip(Status),
    Drop,
}

/// What a reply that is complete but for its empty line will be reported as.
#[derive(Clone, Copy, Debug)]
enum Ending {
    Reply(Status),
    Scip11(u8),
    Time(u32),
    StateCode(StateCode),
}

/// An information reply as far as it has come in.
#[derive(Clone, Copy, Debug)]
enum Info {
    Version(Version),
    Parameters(PartialParameters),
    State(SensorState),
}

/// A reply to something expected.
#[derive(Clone, Copy, Debug)]
struct ExpectedReply {
    command: Command,
    remaining: u8,
    first_byte_us: u64,
}

impl Default for Reader {
    fn default() -> Self {
        Self::new()
    }
}

impl Reader {
    /// A reader that expects nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            pending: None,
            stream: None,
            losses: Losses::NONE,
            line: Line::EMPTY,
            place: Place::Echo,
            reply: None,
            block: DataBlock::NONE,
            info: Info::Parameters(PartialParameters::NONE),
        }
    }

    /// From now on the replies to `request` are legitimate: for `MD` and `MS` all of its stream; for any
    /// other command one reply, beside those of the stream. A later request takes the place of
    /// an earlier one of its kind.
    pub const fn expect(&mut self, request: &Request) {
        match request.command() {
            Command::Measure(_) => self.stream = Some(*request),
            _ => self.pending = Some(*request),
        }
    }

    /// Nothing is expected any more. A reply whose echo is in already is still read to its end.
    pub const fn forget(&mut self) {
        self.pending = None;
        self.stream = None;
    }

    /// Drops what is half read, for when the link was opened anew or runs at another speed. What is
    /// expected stays so.
    pub fn restart(&mut self) {
        self.place = Place::Echo;
        self.line.clear();
    }

    /// What was dropped so far.
    #[must_use]
    pub const fn losses(&self) -> &Losses {
        &self.losses
    }

    /// Takes bytes up to the first event; call again with the rest until all are consumed.
    ///
    /// `now_us` is the clock when the bytes arrived. The values of a scan are written to the start
    /// of `ranges_mm` as they arrive, so every call until [`Event::Scan`] needs the same buffer,
    /// and until then its content means nothing. One with less than
    /// [`Measurement::beams`](super::Measurement::beams) places costs the scan.
    pub fn feed(&mut self, bytes: &[u8], now_us: u64, ranges_mm: &mut [u16]) -> Fed {
        let mut rest = bytes;
        while let Some((&byte, behind)) = rest.split_first() {
            let event;
            if let Place::Data { stamp_ms } = self.place {
                let progress = self.block.feed(rest, ranges_mm);
                rest = progress.rest;
                event = self.data(progress, stamp_ms, now_us);
            } else {
                rest = behind;
                event = self.byte(byte, now_us);
            }
            if event.is_some() {
                return Fed { consumed: bytes.len().wrapping_sub(rest.len()), event };
            }
        }
        Fed { consumed: bytes.len(), event: None }
    }

    /// Part of a data block was decoded.
    fn data(&mut self, progress: Progress<'_>, stamp_ms: u32, now_us: u64) -> Option<Event> {
        if progress.fresh {
            self.line.clear();
        }
        match progress.step {
            Step::More => {
                self.line.note(progress.line, now_us);
                None
            }
            Step::Complete(beams) => {
                self.line.clear();
                self.place = Place::Echo;
                let ExpectedReply { command, remaining, first_byte_us } = self.reply.take()?;
                self.answered(command);
                let streamed = matches!(command, Command::Measure(_));
                Some(Event::Scan(ScanHeader { streamed, stamp_ms, beams, remaining, first_byte_us }))
            }
            Step::Wrong(cause) => {
                let (ended, text) = match progress.line {
                    [text @ .., b'\n'] => (true, text),
                    text => (false, text),
                };
                self.line.note(text, now_us);
                Some(if ended { self.line_failed(cause, now_us) } else { self.failed(cause) })
            }
        }
    }

    /// A byte anywhere but in the data block.
    fn byte(&mut self, byte: u8, now_us: u64) -> Option<Event> {
        if byte == b'\n' {
            let event = self.line_end(now_us);
            self.line.clear();
            return event;
        }
        self.line.push(byte, now_us);
        match self.place {
            Place::Drop => None,
            Place::Echo if self.line.as_slice().len() > LONGEST_ECHO => Some(self.failed(LossCause::Echo)),
            _ if self.line.is_full() => Some(self.failed(LossCause::LineLength)),
            _ => None,
        }
    }

    /// A line, possibly empty, is complete.
    fn line_end(&mut self, now_us: u64) -> Option<Event> {
        if self.line.is_empty() {
            return self.reply_end();
        }
        if let Some((begun, glued)) = self.expected_echo(now_us) {
            let cause = match self.place {
                Place::Drop => None,
                Place::Echo => glued.then_some(LossCause::Echo),
                Place::Status if self.reply.is_none() => Some(LossCause::Echo),
                _ => Some(LossCause::ForeignReply),
            };
            let event = cause.map(|cause| self.failed(cause));
            self.begin(begun);
            return event;
        }
        let next = match self.place {
            Place::Echo => {
                self.reply = None;
                Ok(Place::Status)
            }
            Place::Status => self.status(),
            Place::Stamp => self.stamp().map(|stamp_ms| Place::Data { stamp_ms }),
            Place::Clock => self.stamp().map(|stamp_ms| Place::End(Ending::Time(stamp_ms))),
            Place::StateCode => match checksum::verified(self.line.as_slice()) {
                Some(digits) => Ok(Place::End(Ending::StateCode(StateCode::new(digits)))),
                None => Err(LossCause::Checksum),
            },
            Place::Info => return self.info_line(),
            Place::End(_) => Err(LossCause::LineLength),
            // Data lines do not come here.
            Place::Skip(_) | Place::Drop | Place::Data { .. } => Ok(self.place),
        };
        match next {
            Ok(place) => self.place = place,
            Err(cause) => return Some(self.failed(cause)),
        }
        None
    }

    /// The line behind an echo.
    fn status(&mut self) -> Result<Place, LossCause> {
        let status = match *self.line.as_slice() {
            [first, second, sum]
                if first.is_ascii_alphanumeric()
                    && second.is_ascii_alphanumeric()
                    && sum == checksum::of(&[first, second]) =>
            {
                Status([first, second])
            }
            [only] if only.is_ascii_alphanumeric() => {
                let foreign = Place::Skip(Status([only, b' ']));
                return Ok(self.reply.map_or(foreign, |_| Place::End(Ending::Scip11(only))));
            }
            _ => return Err(self.status_missing()),
        };
        let Some(ExpectedReply { command, .. }) = self.reply else { return Ok(Place::Skip(status)) };
        let info = match (command, status) {
            (Command::Measure(measurement), Status::DATA) | (Command::Get(measurement), Status::OK) => {
                self.block = DataBlock::new(&measurement);
                return Ok(Place::Stamp);
            }
            (Command::Version, Status::OK) => Info::Version(Version::default()),
            (Command::Parameters, Status::OK) => Info::Parameters(PartialParameters::NONE),
            (Command::State, Status::OK) => Info::State(SensorState::default()),
            (Command::TimeRead, Status::OK) => return Ok(Place::Clock),
            (Command::StateCode, Status::OK) => return Ok(Place::StateCode),
            _ => return Ok(Place::End(Ending::Reply(status))),
        };
        self.info = info;
        Ok(Place::Info)
    }

    /// No status where there should be one: the line before was no echo, or its reply is damaged.
    fn status_missing(&self) -> LossCause {
        if self.reply.is_some() { LossCause::Status } else { LossCause::Echo }
    }

    /// The stamp of a scan, or the reply to `TM1`.
    fn stamp(&self) -> Result<u32, LossCause> {
        let line = self.line.as_slice();
        if line.len() != 5 {
            return Err(LossCause::LineLength);
        }
        let characters = checksum::verified(line).ok_or(LossCause::Checksum)?;
        encoding::decode(characters).ok_or(LossCause::Character)
    }

    /// A line of `VV`, `PP` or `II`. `VV` is taken with wrong checksums, and odd lines of `VV` and `II`
    /// cost only themselves.
    fn info_line(&mut self) -> Option<Event> {
        let parsed = checksum::info_line(self.line.as_slice()).and_then(|(content, right)| {
            let colon = content.iter().position(|&c| c == b':')?;
            let (key, value) = content.split_at_checked(colon)?;
            Some((key, value.split_first()?.1, right))
        });
        let cause = match (parsed, &mut self.info) {
            (None, _) => LossCause::InfoLine,
            (Some((key, value, _)), Info::Version(version)) => {
                version.set_field(key, value);
                return None;
            }
            (Some((.., false)), _) => LossCause::Checksum,
            (Some((key, value, true)), Info::Parameters(parameters)) => {
                parameters.set_field(key, value);
                return None;
            }
            (Some((key, value, true)), Info::State(state)) => {
                state.set_field(key, value);
                return None;
            }
        };
        let strict = matches!(self.info, Info::Parameters(_));
        Some(if strict { self.failed(cause) } else { self.lost(Loss { cause, dropped: Dropped::Line }) })
    }

    /// An empty line: the end of a reply.
    fn reply_end(&mut self) -> Option<Event> {
        let event = match self.place {
            Place::Echo => return None,
            Place::Drop => {
                self.place = Place::Echo;
                return None;
            }
            Place::Skip(status) => {
                self.losses.unexpected = self.losses.unexpected.saturating_add(1);
                Event::Unexpected(status)
            }
            Place::Info => match self.info {
                Info::Version(version) => Event::Version(version),
                Info::State(state) => Event::State(state),
                Info::Parameters(parameters) => match parameters.complete() {
                    Some(parameters) => Event::Parameters(parameters),
                    None => return Some(self.failed(LossCause::Parameters)),
                },
            },
            Place::End(ending) => {
                let ExpectedReply { command, first_byte_us, .. } = self.reply?;
                match ending {
                    Ending::Reply(status) => Event::Reply(Reply { command, status, first_byte_us }),
                    Ending::Scip11(status) => Event::Scip11(Scip11Reply { command, status }),
                    Ending::Time(stamp_ms) => Event::Time(TimeReply { stamp_ms, first_byte_us }),
                    Ending::StateCode(code) => Event::StateCode(code),
                }
            }
            Place::Status => {
                let cause = self.status_missing();
                return Some(self.failed(cause));
            }
            Place::Stamp | Place::Clock | Place::StateCode | Place::Data { .. } => {
                return Some(self.failed(LossCause::LineLength));
            }
        };
        if let Some(ExpectedReply { command, .. }) = self.reply.take() {
            self.answered(command);
        }
        self.place = Place::Echo;
        Some(event)
    }

    /// The expected reply whose echo the line is or, for a stream, ends with; and whether it was
    /// glued to something else.
    fn expected_echo(&self, now_us: u64) -> Option<(ExpectedReply, bool)> {
        if let Some(request) = &self.pending
            && let Some((echo, Some(first_byte_us))) = self.line.end(request.echo().len())
            && echo == request.echo()
        {
            return Some((ExpectedReply { command: request.command(), remaining: 0, first_byte_us }, false));
        }
        let request = self.stream.as_ref()?;
        let (echo, first_byte_us) = self.line.end(request.echo().len())?;
        let remaining = request.remaining(echo)?;
        let glued = first_byte_us.is_none();
        let first_byte_us = first_byte_us.unwrap_or(now_us);
        Some((ExpectedReply { command: request.command(), remaining, first_byte_us }, glued))
    }

    fn begin(&mut self, begun: ExpectedReply) {
        self.reply = Some(begun);
        self.place = Place::Status;
    }

    /// The command has its reply; the stream of a measurement goes on.
    fn answered(&mut self, command: Command) {
        if self.pending.is_some_and(|request| request.command() == command) {
            self.pending = None;
        }
    }

    /// A data line that ended is wrong; it may be an echo.
    fn line_failed(&mut self, cause: LossCause, now_us: u64) -> Event {
        let begun = self.expected_echo(now_us);
        let event = self.failed(if begun.is_some() { LossCause::ForeignReply } else { cause });
        if let Some((begun, _)) = begun {
            self.begin(begun);
        }
        self.line.clear();
        event
    }

    /// What is being read does not fit its place: drops it, up to the next empty line, which may be
    /// the one just read.
    fn failed(&mut self, cause: LossCause) -> Event {
        let dropped = match self.reply.take() {
            None => Dropped::Bytes,
            Some(ExpectedReply { command: Command::Measure(_) | Command::Get(_), .. }) => Dropped::Scan,
            Some(ExpectedReply { command, .. }) => Dropped::Reply(command),
        };
        self.place = if self.line.is_empty() { Place::Echo } else { Place::Drop };
        self.lost(Loss { cause, dropped })
    }

    fn lost(&mut self, loss: Loss) -> Event {
        self.losses.count(loss);
        Event::Lost(loss)
    }
}
