//! The reader: bytes in, events out.

use super::command::{Command, Request};
use super::event::{Event, Losses};

/// What one call of [`Reader::feed`] did.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use]
pub struct Fed {
    /// Bytes taken; feed the rest again.
    pub consumed: usize,
    /// What they completed.
    pub event: Option<Event>,
}

/// Takes a sensor's bytes apart.
#[derive(Clone, Debug, Default)]
pub struct Reader {
    pending: Option<Request>,
    stream: Option<Request>,
    losses: Losses,
}

impl Reader {
    /// A reader that expects nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// From now on the replies to `request` are legitimate: for `MD` and `MS` all of its stream, beside
    /// the reply to one other command.
    pub fn expect(&mut self, request: &Request) {
        match request.command() {
            Command::Measure(_) => self.stream = Some(*request),
            _ => self.pending = Some(*request),
        }
    }

    /// Nothing is expected any more. A reply that is being read is still read to its end.
    pub fn forget(&mut self) {
        self.pending = None;
        self.stream = None;
    }

    /// Drops what is half read, for when the link was opened anew or runs at another speed.
    pub fn restart(&mut self) {}

    /// Takes bytes up to the first event. Call again with the rest until all are consumed.
    pub fn feed(&mut self, bytes: &[u8], now_us: u64, ranges_mm: &mut [u16]) -> Fed {
        let _ = (now_us, ranges_mm);
        Fed { consumed: bytes.len(), event: None }
    }

    /// What was dropped so far.
    #[must_use]
    pub const fn losses(&self) -> &Losses {
        &self.losses
    }
}
