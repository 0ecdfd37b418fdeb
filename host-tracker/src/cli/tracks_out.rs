//! `--tracks-out`: a JSON line every 0.1 s into a file or pipe, which may be full, gone or not read.
//!
//! ```text
//!   snapshot ─▶ (queue of 64) ─▶ the rest of a line that was cut, first ─▶ the line ─┬─ Ok
//!                └ full: counted, alarm `tracks-out`                                 └─ fails: likewise, next line tried
//! ```
//!
//! A line that was begun is finished before another is: what is in the file are whole lines. A thread of its own writes them, as
//! a reader that stands still holds up each write for as long.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread;
use std::time::Duration;

use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::snapshot::Snapshot;
use parking_lot::Mutex;

/// Lines that wait while one is being written: six seconds of them.
const QUEUE: usize = 64;

/// How often a write that was interrupted is begun again at once, before it counts as failed.
const INTERRUPTIONS: u32 = 16;

/// Lines on their way to the thread that writes them.
pub(super) struct TracksQueue {
    snapshots: SyncSender<Arc<Snapshot>>,
    shared: Arc<Shared>,
    /// Closed when the thread has ended.
    end: Receiver<()>,
    name: String,
    handed_over: u64,
    /// The queue was full, and has not been empty since.
    is_behind: bool,
}

/// What the thread says of its lines.
#[derive(Default)]
struct Shared {
    taken: AtomicU64,
    lost: AtomicU64,
    trouble: Mutex<Option<String>>,
    is_closed: AtomicBool,
}

impl TracksQueue {
    /// Writes lines into `out`, which is called `name` in messages.
    ///
    /// # Errors
    /// There is no thread to be had.
    pub(super) fn start(out: Box<dyn Write + Send>, name: String) -> io::Result<Self> {
        let (snapshots, waiting) = mpsc::sync_channel::<Arc<Snapshot>>(QUEUE);
        let (ended, end) = mpsc::channel();
        let shared = Arc::new(Shared::default());
        let (told, called) = (Arc::clone(&shared), name.clone());
        thread::Builder::new().name("tracks-out".into()).spawn(move || {
            let mut out = TracksOut::new(out);
            for snapshot in waiting {
                told.take(out.line(&snapshot.line), &called);
            }
            drop(ended);
        })?;
        Ok(Self { snapshots, shared, end, name, handed_over: 0, is_behind: false })
    }

    /// Hands a snapshot's line over, or counts it as lost. It never waits.
    pub(super) fn line(&mut self, snapshot: &Arc<Snapshot>) {
        self.is_behind &= self.shared.taken.load(Ordering::Relaxed) < self.handed_over;
        match self.snapshots.try_send(Arc::clone(snapshot)) {
            Ok(()) => self.handed_over += 1,
            Err(_) => {
                self.shared.lost.fetch_add(1, Ordering::Relaxed);
                self.is_behind = true;
            }
        }
    }

    /// Whether the reader has closed a pipe.
    pub(super) fn is_closed(&self) -> bool {
        self.shared.is_closed.load(Ordering::Relaxed)
    }

    /// What is wrong, in words, if anything is.
    pub(super) fn trouble(&self) -> Option<String> {
        if self.is_behind {
            return Some(self.shared.in_words(&self.name, "its reader or the disk is too slow"));
        }
        self.shared.trouble.lock().clone()
    }

    /// Waits until all lines are written, and no longer than `within`: a reader that stands still does not hold up the end.
    pub(super) fn close(self, within: Duration) {
        drop(self.snapshots);
        if self.end.recv_timeout(within) == Err(mpsc::RecvTimeoutError::Timeout) {
            let unwritten = self.handed_over.saturating_sub(self.shared.taken.load(Ordering::Relaxed));
            tracing::error!("{}: {unwritten} lines could not be written at the end", self.name);
        }
    }
}

impl Shared {
    /// Notes what became of a line.
    fn take(&self, done: io::Result<()>, name: &str) {
        let trouble = done.err().map(|error| {
            self.lost.fetch_add(1, Ordering::Relaxed);
            self.is_closed.fetch_or(error.kind() == io::ErrorKind::BrokenPipe, Ordering::Relaxed);
            self.in_words(name, &error.to_string())
        });
        *self.trouble.lock() = trouble;
        self.taken.fetch_add(1, Ordering::Relaxed);
    }

    fn in_words(&self, name: &str, why: &str) -> String {
        format!("{name}: {why}; {} lines are lost so far", self.lost.load(Ordering::Relaxed))
    }
}

/// Where the lines go.
struct TracksOut<W> {
    out: W,
    /// What is still to be written of a line that was begun.
    rest: Vec<u8>,
}

impl<W: Write> TracksOut<W> {
    const fn new(out: W) -> Self {
        Self { out, rest: Vec::new() }
    }

    /// Writes a line.
    ///
    /// # Errors
    /// Why it is lost.
    fn line(&mut self, line: &TracksLine) -> io::Result<()> {
        self.finish()?;
        self.rest = serde_json::to_vec(line)?;
        self.rest.push(b'\n');
        let whole = self.rest.len();
        self.finish().inspect_err(|_| {
            // Nothing of it is written: the next line may be in its place.
            if self.rest.len() == whole {
                self.rest.clear();
            }
        })
    }

    /// Writes what is left of a line.
    fn finish(&mut self) -> io::Result<()> {
        let mut interruptions = 0;
        while !self.rest.is_empty() {
            match self.out.write(&self.rest) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(written) => drop(self.rest.drain(..written.min(self.rest.len()))),
                Err(error) if error.kind() == io::ErrorKind::Interrupted && interruptions < INTERRUPTIONS => {
                    interruptions += 1;
                }
                Err(error) => return Err(error),
            }
        }
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for so many bytes.
    struct Disk {
        written: Vec<u8>,
        room: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let len = bytes.len().min(self.room);
            if len == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= len;
            self.written.extend(&bytes[..len]);
            Ok(len)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn f12_lines_on_a_full_disk_are_counted_and_what_is_written_are_whole_lines() {
        let mut out = TracksOut::new(Disk { written: Vec::new(), room: 100 });
        let shared = Shared::default();
        let mut lost = 0;
        for tenth in 0..30 {
            // Room for half a line each time, from the tenth line on.
            out.out.room += if tenth < 10 { 0 } else { 20 };
            let line = TracksLine { t: f64::from(tenth), ..TracksLine::default() };
            let done = out.line(&line);
            lost += u32::from(done.is_err());
            shared.take(done, "disk");
        }
        assert_eq!(shared.lost.into_inner(), u64::from(lost));
        let text = String::from_utf8(out.out.written).unwrap();
        let whole = text.lines().filter(|line| serde_json::from_str::<TracksLine>(line).is_ok()).count();
        assert!(lost > 5 && whole > 5, "{lost} lost, {whole} whole");
        let torn = text.lines().count() - whole;
        assert!(torn == 0 || torn == 1 && !text.ends_with('\n'), "{text}");
    }

    /// A pipe whose reader stands still until its channel is closed, and then reads all.
    struct Pipe(Receiver<()>, Arc<Mutex<Vec<u8>>>);

    impl Write for Pipe {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let _ = self.0.recv();
            self.1.lock().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn f12_a_reader_that_stands_still_holds_up_no_line_and_its_losses_are_counted() {
        let (reads, stands) = mpsc::channel();
        let read = Arc::new(Mutex::new(Vec::new()));
        let pipe = Pipe(stands, Arc::clone(&read));
        let mut out = TracksQueue::start(Box::new(pipe), "pipe".into()).unwrap();
        let snapshot = Arc::<Snapshot>::default();
        (0..QUEUE + 10).for_each(|_| out.line(&snapshot));
        let trouble = out.trouble().unwrap();
        assert!(trouble.starts_with("pipe: its reader or the disk is too slow; "), "{trouble}");
        let lost = out.shared.lost.load(Ordering::Relaxed);
        assert!((9..=10).contains(&lost), "one is in the hands of the thread, perhaps: {lost}");
        drop(reads);
        while out.trouble().is_some() {
            out.line(&snapshot);
            thread::sleep(Duration::from_millis(1));
        }
        let handed_over = out.handed_over;
        out.close(Duration::from_secs(60));
        let lines = read.lock().iter().filter(|byte| **byte == b'\n').count();
        assert_eq!(lines as u64, handed_over, "all that was handed over is written at the end");
    }

    #[test]
    fn f12_a_reader_that_stands_still_does_not_hold_up_the_end() {
        let (_reads, stands) = mpsc::channel();
        let mut out = TracksQueue::start(Box::new(Pipe(stands, Arc::default())), "pipe".into()).unwrap();
        out.line(&Arc::default());
        out.close(Duration::from_millis(10));
    }
}
