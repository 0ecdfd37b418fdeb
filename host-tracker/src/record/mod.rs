//! Everything that came in, in a file, so that a run can be followed again bit for bit. MCAP.
//!
//! ```text
//!   /site       JSON      what the tracker was told: its name and the site; again when the site changed
//!   /datagrams  bytes     every datagram, as it arrived            ┐ log time: arrival, exact to the µs
//!   /elsewhere  6 bytes   a device answers at another address      │ of the tracker's own clock
//!   /lines      JSON      every line of tracks, as it was given    ┘
//!   /lost       JSON      how many messages are missing here: the disk was full, or too slow
//! ```
//!
//! The first message is a site, and its time is the beginning of the tracker's clock. Messages are in the order in
//! which the tracker took and gave them. A file that was cut off is good up to its last chunk, a second. A disk that is
//! full is tried again each second. Beside these there is what Foxglove shows, derived from them: `derived`.
//!
//! Format: <https://mcap.dev/spec>.

mod derived;
mod format;
pub mod replay;
mod writer;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use format::{Cause, Losses, Message};
pub use format::{RecordError, Told};
use kehai::wire::ModuleId;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::observation::Observation;
use kehai_tracking::site::Site;
use kehai_tracking::tracker::Selected;
use parking_lot::Mutex;
use writer::Writer;

use crate::alarm_handle::AlarmChange;
use crate::output_file;
use crate::scans::Scan;

/// What waits while the disk is busy: five seconds of a hundred modules.
const QUEUE: usize = 8192;

/// Between two chunks.
const CHUNK: Duration = Duration::from_secs(1);

/// Between two scans of a module that are shown, µs. One is 5 kB, as much as thirty reports: at this pace what is seen to be
/// free takes as much room as what is needed to follow the recording again.
const SHOWN_US: u64 = 1_000_000;

/// A recording under way. It is closed when dropped.
#[derive(Debug)]
pub struct Recorder {
    file: PathBuf,
    tracker: Selected,
    queue: Option<SyncSender<Message>>,
    lost: Losses,
    trouble: Arc<Mutex<Option<String>>>,
    /// A site that the queue had no room for, and when it changed, µs: without it nothing that follows means anything.
    untold: Mutex<Option<(u64, Box<Told>)>>,
    thread: Option<JoinHandle<()>>,
    /// When a scan of each module, by its number, is shown next, µs.
    shown_us: BTreeMap<usize, u64>,
    alarms: Option<Receiver<AlarmChange>>,
}

impl Recorder {
    /// Begins a recording in `file`, of a tracker whose clock stood at 0 at `begun_unix_ns` and which took back what is
    /// `restored`. A recording that is there is kept under another name.
    ///
    /// # Errors
    /// The file cannot be written, or something else is in it.
    pub fn create(
        file: &Path,
        begun_unix_ns: u64,
        tracker: Selected,
        site: &Site,
        restored: Option<(TracksLine, f64)>,
    ) -> Result<Self, RecordError> {
        let failed = |error: Cause| RecordError { file: file.to_path_buf(), error };
        let out = output_file::begin(file).map_err(|error| failed(error.into()))?;
        let lost = Losses::default();
        let mut writer = Writer::new(out, begun_unix_ns, lost.clone()).map_err(failed)?;
        let told = Told { tracker: tracker.to_string(), site: site.clone(), restored };
        writer.write(Message::Told(0, Box::new(told))).map_err(failed)?;
        let (queue, messages) = sync_channel(QUEUE);
        let trouble = Arc::new(Mutex::new(None));
        let state = State { file: file.to_path_buf(), lost: lost.clone(), trouble: Arc::clone(&trouble) };
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || write(&mut writer, &messages, &state))
            .map_err(|error| failed(error.into()))?;
        let (queue, thread) = (Some(queue), Some(thread));
        let (file, shown_us, untold) = (file.to_path_buf(), BTreeMap::new(), Mutex::new(None));
        Ok(Self { file, tracker, queue, lost, trouble, untold, thread, shown_us, alarms: None })
    }

    /// Shows these alarms, too.
    #[must_use]
    pub fn with_alarms(mut self, alarms: Receiver<AlarmChange>) -> Self {
        self.alarms = Some(alarms);
        self
    }

    /// The site has changed, at `now_us` of the tracker's clock.
    pub fn told(&self, now_us: u64, site: &Site) {
        let told = Told { tracker: self.tracker.to_string(), site: site.clone(), restored: None };
        self.send(Message::Told(now_us, Box::new(told)));
    }

    /// A datagram has arrived, and is about to be taken.
    pub fn datagram(&self, now_us: u64, datagram: &[u8]) {
        self.send(Message::Datagram(now_us, datagram.into()));
    }

    /// A device answers at another address than before, and its times were forgotten for that.
    pub fn elsewhere(&self, now_us: u64, device: ModuleId) {
        self.send(Message::Elsewhere(now_us, device));
    }

    /// A line of tracks was given.
    pub fn line(&self, at_us: u64, line: &TracksLine) {
        self.send(Message::Line(at_us, Box::new(line.clone())));
    }

    /// A module saw something, in one of its scans: one a second is shown.
    pub fn scan(&mut self, now_us: u64, module: &str, observation: &Observation) {
        let next_us = self.shown_us.entry(observation.view.module).or_default();
        if now_us >= *next_us {
            *next_us = now_us + SHOWN_US;
            self.send(Message::Scan(now_us, Box::new(Scan::of(module, observation))));
        }
    }

    /// Shows what has become of alarms by `now_us`.
    pub fn alarms(&self, now_us: u64) {
        for change in self.alarms.iter().flat_map(Receiver::try_iter) {
            self.send(Message::Alarm(now_us, Box::new(change)));
        }
    }

    /// Messages that were not recorded, because the disk was too slow, full or gone: the recording cannot be followed
    /// again bit for bit.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.so_far().messages
    }

    /// Why messages are being lost, in words, and how many were; none while none are.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        self.trouble.lock().clone()
    }

    /// Sends a message, and before it a site that waits. While there is no room a site waits, or takes the place of the one that does;
    /// any other message is lost.
    fn send(&self, message: Message) {
        let Some(queue) = &self.queue else { return };
        let (is_shown, is_site) = (message.is_shown(), matches!(message, Message::Told(..)));
        let mut untold = self.untold.lock();
        let sent = match untold.take() {
            Some((at_us, told)) if !is_site => {
                queue.try_send(Message::Told(at_us, told)).and_then(|()| queue.try_send(message))
            }
            _ => queue.try_send(message),
        };
        let Err(error) = sent else { return };
        let has_ended = matches!(error, TrySendError::Disconnected(_));
        if let TrySendError::Full(Message::Told(at_us, told)) = error {
            *untold = Some((at_us, told));
            if is_site {
                return;
            }
        }
        self.lost.add(is_shown);
        // While the thread goes on it says by itself what is lost.
        if has_ended {
            let (file, lost) = (self.file.display(), self.lost());
            let text = format!(
                "{file}: the thread that records has ended: {lost} messages are lost so far; start the tracker anew"
            );
            *self.trouble.lock() = Some(text);
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let (queue, untold) = (self.queue.take(), self.untold.get_mut().take());
        if let Some((queue, (at_us, told))) = queue.zip(untold) {
            // Waits for room; a thread that has ended takes nothing.
            let _ = queue.send(Message::Told(at_us, told));
        }
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has said so.
            let _ = thread.join();
        }
    }
}

/// How the recording is, to be seen by others.
struct State {
    file: PathBuf,
    lost: Losses,
    trouble: Arc<Mutex<Option<String>>>,
}

impl State {
    /// What became of a chunk, when so many messages were lost before it.
    fn note(&self, done: Result<(), Cause>, lost_before: u64) {
        let (file, lost) = (self.file.display(), self.lost.so_far().messages);
        *self.trouble.lock() = match done {
            Err(error) => {
                Some(format!("{file}: {error}: {lost} messages are lost so far; it goes on when it can"))
            }
            Ok(()) if lost > lost_before => {
                Some(format!("{file}: the disk was full or is too slow: {lost} messages are lost so far"))
            }
            Ok(()) => None,
        };
    }
}

/// Until the recorder is dropped.
fn write(writer: &mut Writer<File>, messages: &Receiver<Message>, state: &State) {
    let (mut chunk_at, mut lost, mut failed) = (Instant::now() + CHUNK, 0, None);
    loop {
        let taken = match messages.recv_timeout(chunk_at.saturating_duration_since(Instant::now())) {
            Ok(message) => {
                let is_shown = message.is_shown();
                writer.write(message).inspect_err(|_| state.lost.add(is_shown))
            }
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => break,
        };
        failed = taken.err().or(failed);
        if Instant::now() >= chunk_at {
            chunk_at = Instant::now() + CHUNK;
            let before = std::mem::replace(&mut lost, state.lost.so_far().messages);
            let done = writer.chunk();
            state.note(failed.take().map_or(done, Err), before);
        }
    }
    if let Err(error) = writer.finish() {
        tracing::error!("{}: the recording ends early: {error}", state.file.display());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_whose_thread_has_ended_is_in_trouble() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("hall.mcap");
        let site = Site::default();
        let mut recorder = Recorder::create(&file, 0, Selected::default(), &site, None).unwrap();
        // As after a panic of the thread: nothing takes what is sent.
        recorder.queue = Some(sync_channel(1).0);
        recorder.datagram(1, &[]);
        recorder.datagram(2, &[]);
        assert_eq!(recorder.lost(), 2);
        let trouble = recorder.trouble().unwrap();
        assert!(trouble.contains("hall.mcap") && trouble.contains("2 messages are lost"), "{trouble}");
    }

    #[test]
    fn a_site_that_finds_the_queue_full_is_told_before_all_that_follows() {
        let folder = tempfile::tempdir().unwrap();
        let (file, site) = (folder.path().join("hall.mcap"), Site::default());
        let mut recorder = Recorder::create(&file, 0, Selected::default(), &site, None).unwrap();
        let (queue, messages) = sync_channel(2);
        recorder.queue = Some(queue);
        let kind = |message: Message| (matches!(message, Message::Told(..)), message.at_us());
        recorder.datagram(1, &[]);
        recorder.datagram(2, &[]);
        recorder.told(3, &site);
        assert_eq!(recorder.lost(), 0, "it waits");
        recorder.datagram(4, &[]);
        assert_eq!(recorder.lost(), 1, "there is still no room");
        let taken: Vec<(bool, u64)> = messages.try_iter().map(kind).collect();
        assert_eq!(taken, [(false, 1), (false, 2)]);
        recorder.datagram(5, &[]);
        // The last one of a recording, too.
        recorder.told(6, &site);
        let rest = std::thread::spawn(move || messages.iter().map(kind).collect::<Vec<_>>());
        drop(recorder);
        assert_eq!(rest.join().unwrap(), [(true, 3), (false, 5), (true, 6)]);
    }
}
