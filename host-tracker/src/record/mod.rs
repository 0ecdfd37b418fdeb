//! Everything that came in, in a file, so that a run can be followed again bit for bit. MCAP.
//!
//! ```text
//!   /site       JSON      what the tracker was told: its name and the site; again when the site changed
//!   /datagrams  bytes     every datagram, as it arrived            ┐ log time: arrival, exact to the µs
//!   /lines      JSON      every line of tracks, as it was given    ┘ of the tracker's own clock
//!   /people     JSON      the same for Foxglove: foxglove.SceneUpdate
//! ```
//!
//! The first message is a site, and its time is the beginning of the tracker's clock. Messages are in the order in
//! which the tracker took and gave them. A file that was cut off is good up to its last chunk, a second.
//!
//! Format: <https://mcap.dev/spec>; scene: <https://docs.foxglove.dev/docs/sdk/schemas/scene-update>.

mod format;
mod people;
pub mod replay;
mod writer;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use format::Cause;
pub use format::{RecordError, Told};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site::Site;
use kehai_tracking::tracker::Ideas;
use parking_lot::Mutex;
use writer::Writer;

/// What waits while the disk is busy: five seconds of a hundred modules.
const QUEUE: usize = 8192;

/// Between two chunks.
const CHUNK: Duration = Duration::from_secs(1);

enum Message {
    Told(u64, Box<Told>),
    Datagram(u64, Box<[u8]>),
    Line(u64, Box<TracksLine>),
}

/// A recording under way. It is closed when dropped.
#[derive(Debug)]
pub struct Recorder {
    tracker: Ideas,
    queue: Option<SyncSender<Message>>,
    lost: AtomicU64,
    trouble: Arc<Mutex<String>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    /// Begins a recording in `file`, of a tracker whose clock stood at 0 at `begun_unix_ns` and which took back what is
    /// `restored`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(
        file: &Path,
        begun_unix_ns: u64,
        tracker: Ideas,
        site: &Site,
        restored: Option<(TracksLine, f64)>,
    ) -> Result<Self, RecordError> {
        let failed = |error: Cause| RecordError { file: file.to_path_buf(), error };
        let mut writer = Writer::create(file, begun_unix_ns).map_err(failed)?;
        writer
            .told(0, &Told { tracker: tracker.to_string(), site: site.clone(), restored })
            .map_err(failed)?;
        let (queue, messages) = sync_channel(QUEUE);
        let trouble = Arc::new(Mutex::new(String::new()));
        let (file, said) = (file.to_path_buf(), Arc::clone(&trouble));
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn({
                let file = file.clone();
                move || {
                    if let Err(error) = write(&mut writer, &messages) {
                        let text = RecordError { file, error }.to_string();
                        *said.lock() = text;
                    }
                }
            })
            .map_err(|error| RecordError { file, error: error.into() })?;
        Ok(Self { tracker, queue: Some(queue), lost: AtomicU64::new(0), trouble, thread: Some(thread) })
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

    /// A line of tracks was given.
    pub fn line(&self, at_us: u64, line: &TracksLine) {
        self.send(Message::Line(at_us, Box::new(line.clone())));
    }

    /// Messages that were not recorded, because the disk was too slow, full or gone: the recording cannot be followed
    /// again bit for bit.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Why it has ended early, in words; empty if it has not.
    #[must_use]
    pub fn trouble(&self) -> String {
        self.trouble.lock().clone()
    }

    fn send(&self, message: Message) {
        let sent = self.queue.as_ref().is_some_and(|queue| queue.try_send(message).is_ok());
        if !sent {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has said so.
            let _ = thread.join();
        }
    }
}

/// Until the recorder is dropped, or the file cannot be written.
fn write(writer: &mut Writer, messages: &Receiver<Message>) -> Result<(), Cause> {
    let mut chunk_at = Instant::now() + CHUNK;
    loop {
        match messages.recv_timeout(chunk_at.saturating_duration_since(Instant::now())) {
            Ok(Message::Told(now_us, told)) => writer.told(now_us, &told)?,
            Ok(Message::Datagram(now_us, datagram)) => writer.datagram(now_us, &datagram)?,
            Ok(Message::Line(at_us, line)) => writer.line(at_us, &line)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
        if Instant::now() >= chunk_at {
            chunk_at = Instant::now() + CHUNK;
            writer.flush()?;
        }
    }
}
