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

use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;
use sha2::{Digest, Sha256};

use super::derived::DERIVED;
use super::format::{Cause, DATAGRAMS, ELSEWHERE, LINES, LOST, Lost, RecordError, SITE, Told};
use kehai::wire::ModuleId;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site_tracker::SiteTracker;

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

/// Follows a recording again; every line goes to `give`, which may take its time, with the tracker's time in µs.
///
/// # Errors
/// The file cannot be read, or is no recording. One that was cut off is followed up to there.
pub fn replay(
    file: &Path,
    mut give: impl FnMut(u64, &TracksLine) -> std::io::Result<()>,
) -> Result<Outcome, RecordError> {
    let failed = |error: Cause| RecordError { file: file.to_path_buf(), error };
    let input = File::open(file).map_err(|error| failed(error.into()))?;
    let mut outcome = Outcome::default();
    let (mut recorded, mut replayed) = (Sha256::new(), Sha256::new());
    let mut site_tracker: Option<SiteTracker> = None;
    let mut begun_ns = 0;
    // A chunk's checksum is compared at its end, not before: of a file that was cut off, its last chunk counts, too.
    let options = LinearReaderOptions::default().with_record_length_limit(RECORD_MAX);
    let mut messages = MessageReader::new_with_options(BufReader::new(input), options);
    loop {
        // The reader counts with what it reads, and panics where that does not add up.
        let message = match catch_unwind(AssertUnwindSafe(|| messages.next())) {
            Ok(None) => break,
            Ok(Some(Ok(message))) => message,
            Ok(Some(Err(error))) if site_tracker.is_none() => return Err(failed(error.into())),
            Ok(Some(Err(error))) => {
                outcome.cut_off = Some(error.to_string());
                break;
            }
            Err(_) if site_tracker.is_none() => return Err(failed(Cause::Damaged)),
            Err(_) => {
                outcome.cut_off = Some(Cause::Damaged.to_string());
                break;
            }
        };
        if message.channel.metadata.contains_key(DERIVED) {
            continue;
        }
        let now_us = message.log_time.saturating_sub(begun_ns) / 1000;
        match (message.channel.topic.as_str(), &mut site_tracker) {
            (SITE, None) => {
                let told: Told =
                    serde_json::from_slice(&message.data).map_err(|error| failed(error.into()))?;
                begun_ns = message.log_time;
                let tracker = told
                    .tracker
                    .parse::<kehai_tracking::tracker::Selected>()
                    .map_err(|error: kehai_tracking::tracker::UnknownTracker| failed(error.into()))?;
                told.site.check().map_err(|error| failed(Cause::Site(error)))?;
                let mut begun = SiteTracker::new(&Arc::new(told.site), tracker);
                if let Some((line, age_s)) = &told.restored {
                    begun.restore(line, *age_s);
                }
                site_tracker = Some(begun);
            }
            (_, None) => return Err(failed(Cause::Foreign)),
            (SITE, Some(site_tracker)) => {
                let told: Told =
                    serde_json::from_slice(&message.data).map_err(|error| failed(error.into()))?;
                told.site.check().map_err(|error| failed(Cause::Site(error)))?;
                site_tracker.change_site(&Arc::new(told.site));
            }
            (DATAGRAMS, Some(site_tracker)) => {
                site_tracker.receive(&message.data, now_us);
                outcome.datagrams += 1;
            }
            (ELSEWHERE, Some(site_tracker)) => {
                if let Ok(device) = <[u8; 6]>::try_from(&*message.data) {
                    site_tracker.sessions_mut().note_new_address(ModuleId(device), now_us);
                }
            }
            (LOST, Some(_)) => {
                let note: Lost =
                    serde_json::from_slice(&message.data).map_err(|error| failed(error.into()))?;
                outcome.lost = outcome.lost.saturating_add(note.messages);
            }
            (LINES, Some(site_tracker)) => {
                let line = site_tracker.line(now_us as f64 * 1e-6);
                let bytes = serde_json::to_vec(&line).map_err(|error| failed(error.into()))?;
                recorded.update(&message.data);
                replayed.update(&bytes);
                outcome.lines += 1;
                outcome.different += u64::from(*message.data != *bytes);
                give(now_us, &line).map_err(|error| failed(error.into()))?;
            }
            _ => {}
        }
    }
    if site_tracker.is_none() {
        return Err(failed(Cause::Foreign));
    }
    outcome.recorded = hexadecimal(&recorded.finalize());
    outcome.replayed = hexadecimal(&replayed.finalize());
    Ok(outcome)
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
