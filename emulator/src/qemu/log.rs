//! The image's log, decoded with what its ELF file says about the messages.
//!
//! ```text
//! 00 0d 07 09 … 00 0c cd …  00      frames end in a zero byte (rzCOBS)
//! ```

use std::fmt;
use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use defmt_decoder::{DecodeError, Frame, Table};

use super::Error;

/// One message.
#[derive(Clone, Debug)]
pub struct Message {
    /// Guest time since its last reset.
    pub at_us: u64,
    /// `trace`, `debug`, `info`, `warn` or `error`; empty if printed without a level.
    pub level: &'static str,
    /// Its text.
    pub text: String,
}

impl fmt::Display for Message {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:>10} µs {:5} {}", self.at_us, self.level, self.text)
    }
}

/// The messages of a growing file.
pub struct Log {
    table: Table,
    path: PathBuf,
    /// Bytes of the file that are decoded.
    decoded: u64,
    messages: Vec<Message>,
    /// Messages before this were found.
    next: usize,
}

impl Log {
    /// The log of `image` in the file at `path`, which need not be there yet.
    pub fn new(image: &Path, path: PathBuf) -> Result<Self, Error> {
        let table = Table::parse(&fs::read(image)?)
            .map_err(|error| Error::Log(error.to_string()))?
            .ok_or_else(|| Error::Log(format!("{} has no messages", image.display())))?;
        Ok(Self { table, path, decoded: 0, messages: Vec::new(), next: 0 })
    }

    /// All messages so far.
    pub fn messages(&mut self) -> Result<&[Message], Error> {
        self.read()?;
        Ok(&self.messages)
    }

    /// The next message with `text`, after the last one found.
    pub fn find(&mut self, text: &str) -> Result<Option<Message>, Error> {
        self.read()?;
        let new = self.messages.get(self.next..).unwrap_or_default();
        let Some(at) = new.iter().position(|message| message.text.contains(text)) else { return Ok(None) };
        let found = new.get(at).cloned();
        self.next += at + 1;
        Ok(found)
    }

    /// Decodes the complete frames that have come since.
    fn read(&mut self) -> Result<(), Error> {
        let Ok(mut file) = File::open(&self.path) else { return Ok(()) };
        file.seek(SeekFrom::Start(self.decoded))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let complete = bytes.iter().rposition(|&byte| byte == 0).map_or(0, |last| last + 1);
        bytes.truncate(complete);
        self.decoded += complete as u64;
        let mut decoder = self.table.new_stream_decoder();
        decoder.received(&bytes);
        loop {
            match decoder.decode() {
                Ok(frame) => self.messages.push(message(&frame)),
                Err(DecodeError::UnexpectedEof) => return Ok(()),
                // A reset has cut a message short.
                Err(DecodeError::Malformed) => {}
            }
        }
    }
}

fn message(frame: &Frame<'_>) -> Message {
    let stamp = frame.display_timestamp().map(|stamp| stamp.to_string()).unwrap_or_default();
    Message {
        at_us: stamp.replace('.', "").trim().parse().unwrap_or_default(),
        level: frame.level().map_or("", |level| level.as_str()),
        text: frame.display_message().to_string(),
    }
}
