//! A recording, followed again: the same datagrams at the same times into the same tracker.
//!
//! ```text
//!   /site ─▶ a site's tracker      /datagrams ─▶ receive at the recorded µs      /lines ─▶ line at that time: equal?
//!                            /elsewhere ─▶ that device's times are forgotten
//! ```
//!
//! Channels that are marked as derived are left out, whatever their topics.

use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use data_encoding::HEXLOWER;
use mcap::Message;
use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;
use sha2::{Digest, Sha256};

use super::derived::DERIVED;
use super::format::{Cause, DATAGRAMS, ELSEWHERE, LINES, LOST, Lost, RecordError, SITE, Told};
use kehai::wire::ModuleId;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;

/// Longest record that is read, bytes: a chunk is a second, and a second of a hundred modules is some MB. A damaged length
/// would else be allocated, whatever it says.
const RECORD_MAX: usize = 16 << 20;

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Datagrams taken.
    pub datagrams: u64,
    /// Lines given.
    pub lines: u64,
    /// Lines that differ from the recorded ones.
    pub different: u64,
    /// Messages that are missing, as the disk was full or too slow: lines after them may differ for that alone.
    pub lost: u64,
    /// SHA-256 over the recorded lines.
    pub recorded: String,
    /// The same over those of now.
    pub replayed: String,
    /// Why it ended before the file's end, in words, if it did.
    pub cut_off: Option<String>,
}

/// Why a recording was not followed to its end.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The file cannot be read, or is no recording.
    #[error(transparent)]
    Recording(#[from] RecordError),
    /// A line could not be given on.
    #[error(transparent)]
    Output(std::io::Error),
}

/// Follows a recording again; every line goes to `give`, which may take its time, with the tracker's time in µs.
///
/// # Errors
/// The file cannot be read, or is no recording; or what `give` says. One that was cut off is followed up to there.
pub fn replay(
    file: &Path,
    mut give: impl FnMut(u64, &TracksLine) -> std::io::Result<()>,
) -> Result<Outcome, ReplayError> {
    let mut of_output = None;
    let followed = follow(file, |at_us, line| {
        give(at_us, line).map_err(|error| {
            let kind = error.kind();
            of_output = Some(error);
            kind.into()
        })
    });
    followed.map_err(|error| match of_output {
        Some(error) => ReplayError::Output(error),
        None => RecordError { file: file.to_path_buf(), error }.into(),
    })
}

fn follow(
    file: &Path,
    mut give: impl FnMut(u64, &TracksLine) -> std::io::Result<()>,
) -> Result<Outcome, Cause> {
    // A chunk's checksum is compared at its end, not before: of a file that was cut off, its last chunk counts, too.
    let options = LinearReaderOptions::default().with_record_length_limit(RECORD_MAX);
    let mut messages = MessageReader::new_with_options(BufReader::new(File::open(file)?), options);
    let mut replay: Option<Replay> = None;
    let cut_off = loop {
        let message = match (next(&mut messages), &replay) {
            (Ok(Some(message)), _) => message,
            (Ok(None), _) => break None,
            (Err(Cause::Mcap(error)), None) => return Err(error.into()),
            (Err(cause), None) => return Err(cause),
            (Err(cause), Some(_)) => break Some(cause.to_string()),
        };
        if message.channel.metadata.contains_key(DERIVED) {
            continue;
        }
        match &mut replay {
            Some(replay) => replay.take(&message, &mut give)?,
            None if message.channel.topic == SITE => replay = Some(Replay::begin(&message)?),
            None => return Err(Cause::Foreign),
        }
    };
    Ok(replay.ok_or(Cause::Foreign)?.end(cut_off))
}

/// The next message. The reader counts with what it reads, and panics where that does not add up.
fn next(messages: &mut MessageReader<BufReader<File>>) -> Result<Option<Message<'static>>, Cause> {
    let read = catch_unwind(AssertUnwindSafe(|| messages.next())).map_err(|_| Cause::Damaged)?;
    read.transpose().map_err(Cause::Mcap)
}

/// A recording that has begun.
struct Replay {
    site_tracker: SiteTracker,
    begun_ns: u64,
    outcome: Outcome,
    recorded: Sha256,
    replayed: Sha256,
}

impl Replay {
    /// From its first message, the site.
    fn begin(message: &Message<'_>) -> Result<Self, Cause> {
        let told: Told = serde_json::from_slice(&message.data)?;
        let tracker: Selected = told.tracker.parse()?;
        told.site.check().map_err(Cause::Site)?;
        let mut site_tracker = SiteTracker::new(&Arc::new(told.site), tracker);
        if let Some((line, age_s)) = &told.restored {
            site_tracker.restore(line, *age_s);
        }
        Ok(Self {
            site_tracker,
            begun_ns: message.log_time,
            outcome: Outcome::default(),
            recorded: Sha256::new(),
            replayed: Sha256::new(),
        })
    }

    /// One more message, by its topic; those of other topics are only shown.
    fn take(
        &mut self,
        message: &Message<'_>,
        give: &mut impl FnMut(u64, &TracksLine) -> std::io::Result<()>,
    ) -> Result<(), Cause> {
        let now_us = message.log_time.saturating_sub(self.begun_ns) / 1000;
        match message.channel.topic.as_str() {
            SITE => {
                let told: Told = serde_json::from_slice(&message.data)?;
                told.site.check().map_err(Cause::Site)?;
                self.site_tracker.change_site(&Arc::new(told.site));
            }
            DATAGRAMS => {
                self.site_tracker.receive(&message.data, now_us);
                self.outcome.datagrams += 1;
            }
            ELSEWHERE => {
                if let Ok(device) = <[u8; 6]>::try_from(&*message.data) {
                    self.site_tracker.sessions_mut().note_new_address(ModuleId(device), now_us);
                }
            }
            LOST => {
                let note: Lost = serde_json::from_slice(&message.data)?;
                self.outcome.lost = self.outcome.lost.saturating_add(note.messages);
            }
            LINES => give(now_us, &self.compare(&message.data, now_us)?)?,
            _ => {}
        }
        Ok(())
    }

    /// The tracker's line of now, compared with the recorded one.
    fn compare(&mut self, recorded: &[u8], now_us: u64) -> Result<TracksLine, Cause> {
        let line = self.site_tracker.line(now_us as f64 * 1e-6);
        let replayed = serde_json::to_vec(&line)?;
        self.recorded.update(recorded);
        self.replayed.update(&replayed);
        self.outcome.lines += 1;
        self.outcome.different += u64::from(*recorded != *replayed);
        Ok(line)
    }

    fn end(self, cut_off: Option<String>) -> Outcome {
        let recorded = HEXLOWER.encode(&self.recorded.finalize());
        let replayed = HEXLOWER.encode(&self.replayed.finalize());
        Outcome { recorded, replayed, cut_off, ..self.outcome }
    }
}
