//! What happened, in a file: paths, counts, events, health. SQLite.
//!
//! ```text
//!   frames ─▶ (queue of 64) ─▶ recorder ─▶ every half second, one transaction ─▶ FILE, FILE-wal
//!                                 ▲                 └ fails: an alarm in words, kept, tried again
//!                                 └ rows until they are written, an hour's at most
//!
//!   time line, export ◀─ reader ◀─ index ─────────────────────────────────────┘
//! ```
//!
//! The thread that writes is the only one that does; tracking never waits for it. The death of the process loses
//! what came since the last transaction, half a second; a power cut may lose the last transactions before that,
//! and never the file.

mod alarm_rows;
pub mod answers;
mod aside;
pub mod card;
mod connection;
pub mod copy;
mod error;
pub mod event;
pub mod export;
pub mod figures;
pub mod heat;
mod lives;
pub(crate) mod lock;
mod numbers;
pub mod path;
pub mod pose;
mod questions;
pub mod raw;
mod raw_rows;
pub mod reader;
pub mod recorder;
mod retention;
pub mod row;
mod schema;
pub mod timeline;
mod walks;
mod work;
mod writer;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

pub use error::StoreError;
use event::{Event, EventKind};
use parking_lot::Mutex;
use pose::Source;
use reader::Reader;
use recorder::ChangeRecorder;
pub use retention::Keep;
pub use schema::{Unfit, VERSION as NEWEST_LAYOUT};
use work::Work;
use writer::Writer;

use crate::supervise;
use kehai_tracking::alarm_list::{LISTED_MS, ListedAlarm};
use kehai_tracking::door::doors::Passed;
use kehai_tracking::lines::Totals;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// People known longer ago than this are not taken back after a restart: they have gone elsewhere.
pub const RESTORE_MS: u64 = 30_000;

/// Frames that wait while a transaction is being written: six seconds of them.
const QUEUE: usize = 64;

/// How the store is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StoreState {
    /// What is wrong, in words, if anything is.
    pub trouble: Option<String>,
    /// Why nothing is deleted, in words, if what is too old is not.
    pub doubt: Option<String>,
    /// Raw scans that a user asked to be kept, in words, if there are any.
    pub raw: Option<String>,
    /// What was to be kept and is not.
    pub dropped: Dropped,
    /// Transactions.
    pub written: u64,
}

/// What was to be kept and is not, since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Snapshots, events, passages and alarms for which there was no room while a transaction was being written.
    pub messages: u64,
    /// Rows and parts of paths, because nothing could be written for too long.
    pub rows: u64,
}

impl Dropped {
    /// In words; none if nothing was.
    fn in_words(self) -> Option<String> {
        let Self { messages, rows } = self;
        (self != Self::default()).then(|| format!("{messages} messages and {rows} rows are lost so far"))
    }
}

enum Message {
    Snapshot(Arc<Snapshot>),
    Event(Event),
    Passage(Box<Passed>),
    Alarm(Box<ListedAlarm>),
    Site(Arc<Site>, u64, Source),
}

/// How a database is, for readers beside its owner. Clones are the same.
#[derive(Clone, Debug, Default)]
pub struct StoreWatch(Arc<Mutex<StoreState>>);

impl StoreWatch {
    /// What was to be kept and is not.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        locked(&self.0, |state| state.dropped)
    }
}

/// A database that is being written.
#[derive(Debug)]
pub struct Store {
    queue: Option<SyncSender<Message>>,
    state: Arc<Mutex<StoreState>>,
    thread: Option<JoinHandle<()>>,
}

impl Store {
    /// Opens `file`, or makes it, and keeps what happens for as long as `keep` says.
    ///
    /// # Errors
    /// It is no database, of another program or of a newer version, or another tracker writes it. A damaged one is set aside, and a new one
    /// begun. A disk that is full or cannot be written is no error: the
    /// state says so, and it is tried again.
    pub fn open(file: &Path, site: &Arc<Site>, keep: Keep) -> Result<Self, StoreError> {
        let now_ms = unix_ms();
        let mut recorder = ChangeRecorder::new(site, now_ms);
        let taken = |lock::Taken| StoreError::Taken { file: file.to_path_buf() };
        let mut lock = lock::acquire_soon(file).map_err(taken)?;
        let writer = match open(file, now_ms, None) {
            Ok((writer, event)) => {
                lock.iter_mut().for_each(lock::Lock::mark);
                event.into_iter().for_each(|event| recorder.happened(event));
                Some(writer)
            }
            Err(error) if error.may_pass() => None,
            Err(error) => {
                lock::remove_unused(file);
                return Err(error);
            }
        };
        let (queue, messages) = sync_channel(QUEUE);
        let state = Arc::new(Mutex::new(StoreState::default()));
        let mut work = Work {
            file: file.to_path_buf(),
            keep,
            writer,
            lock,
            damage: None,
            recorder,
            newest: None,
            newest_s: 0.0,
            run: None,
            failed: None,
            dropped: Dropped::default(),
            state: Arc::clone(&state),
        };
        let thread = std::thread::Builder::new()
            .name("store".into())
            .spawn(move || {
                while let Err(panic) = catch_unwind(AssertUnwindSafe(|| work.run(&messages))) {
                    work.begin_again(&supervise::in_words(&*panic));
                }
            })
            .map_err(|error| StoreError::File { file: file.to_path_buf(), error })?;
        Ok(Self { queue: Some(queue), state, thread: Some(thread) })
    }

    /// Hands a frame over. It never waits.
    pub fn record(&self, frame: Arc<Snapshot>) {
        self.send(Message::Snapshot(frame));
    }

    /// Hands a frame over as soon as there is room: for what is not live.
    pub fn see_waiting(&self, frame: Arc<Snapshot>) {
        let Some(queue) = &self.queue else { return };
        if queue.send(Message::Snapshot(frame)).is_err() {
            locked(&self.state, |state| state.dropped.messages += 1);
        }
    }

    /// Notes that something happened.
    pub fn happened(&self, event: Event) {
        self.send(Message::Event(event));
    }

    /// Keeps a passage through a door, and its card for as long as cards are kept.
    pub fn passed(&self, passed: Box<Passed>) {
        self.send(Message::Passage(passed));
    }

    /// Keeps an alarm as it is now.
    pub fn alarm(&self, alarm: ListedAlarm) {
        self.send(Message::Alarm(Box::new(alarm)));
    }

    /// Notes that the site has changed, and the source of the change; false if there was no room, so that it must be
    /// said again.
    #[must_use]
    pub fn set_site(&self, site: &Arc<Site>, source: Source) -> bool {
        self.try_send(Message::Site(Arc::clone(site), unix_ms(), source))
    }

    /// How it is.
    #[must_use]
    pub fn state(&self) -> StoreState {
        locked(&self.state, |state| state.clone())
    }

    /// The same, for others to read.
    #[must_use]
    pub fn watch(&self) -> StoreWatch {
        StoreWatch(Arc::clone(&self.state))
    }

    /// Writes what is still to be written, and says how it was last. What cannot be written is counted and logged.
    #[must_use]
    pub fn close(mut self) -> StoreState {
        self.end();
        self.state()
    }

    fn end(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has said so.
            let _ = thread.join();
        }
    }

    fn send(&self, message: Message) {
        if !self.try_send(message) {
            locked(&self.state, |state| state.dropped.messages += 1);
        }
    }

    fn try_send(&self, message: Message) -> bool {
        self.queue.as_ref().is_some_and(|queue| queue.try_send(message).is_ok())
    }
}

impl Drop for Store {
    /// Writes what is still to be written. What cannot be is counted and logged.
    fn drop(&mut self) {
        self.end();
    }
}

/// What a database knew last, if that is worth taking back at `now_ms`; else what happened, in words, if there was
/// anything. A database that cannot be read knows nothing: [`Store::open`] says why.
#[must_use]
pub fn known_before(file: &Path, now_ms: u64) -> (Option<Snapshot>, Option<Event>) {
    let frame = Reader::open(file).ok().and_then(|reader| reader.snapshot().ok().flatten());
    let Some(frame) = frame.filter(|frame| !frame.line.tracks.is_empty()) else { return (None, None) };
    let age_ms = now_ms.checked_sub(frame.unix_ms);
    let is_fresh = age_ms.is_some_and(|age_ms| age_ms <= RESTORE_MS);
    let (people, age_s) = (frame.line.tracks.len(), age_ms.unwrap_or_default() as f64 * 1e-3);
    let (kind, text) = if is_fresh {
        (
            EventKind::Restored,
            format!("{people} tracks of {age_s:.1} s ago are taken back, hidden until they are seen"),
        )
    } else {
        (EventKind::Discarded, format!("{people} tracks of {age_s:.0} s ago are too old to be taken back"))
    };
    (is_fresh.then_some(frame), Some(Event::new(now_ms, kind, "", text)))
}

/// How often each counting line has been crossed, by its name. A database that cannot be read has counted nothing:
/// [`Store::open`] says why.
#[must_use]
pub fn counted_before(file: &Path) -> BTreeMap<String, Totals> {
    Reader::open(file).ok().and_then(|reader| reader.line_totals().ok()).unwrap_or_default()
}

/// The alarms that stood when the database was written last, those that ended within the day before `now_ms`, and when it was
/// written last, ms since 1970. A database that cannot be read has none.
#[must_use]
pub fn alarms_before(file: &Path, now_ms: u64) -> (Vec<ListedAlarm>, u64) {
    let Ok(reader) = Reader::open(file) else { return (Vec::new(), 0) };
    let alarms = reader.alarms(now_ms.saturating_sub(LISTED_MS)).unwrap_or_default();
    let written = reader.span_ms().ok().flatten().map_or(0, |(_, last_ms)| last_ms);
    (alarms, written)
}

/// Opens the database, or makes it. A damaged one of a tracker is set aside before, which is an event of the new one.
fn open(file: &Path, now_ms: u64, run: Option<i64>) -> Result<(Writer, Option<Event>), StoreError> {
    let error = match Writer::open(file, now_ms, run) {
        Ok(writer) => return Ok((writer, None)),
        Err(error) => error,
    };
    let damaged = matches!(&error, StoreError::Sqlite { error, .. } if error::is_damage(error));
    if !(damaged && aside::was_ours(file)) {
        return Err(error);
    }
    let event = set_aside(file, now_ms, &error.to_string())?;
    Ok((Writer::open(file, now_ms, None)?, Some(event)))
}

fn set_aside(file: &Path, now_ms: u64, why: &str) -> Result<Event, StoreError> {
    let failed = |error| StoreError::File { file: file.to_path_buf(), error };
    let aside = aside::set_aside(file, now_ms).map_err(failed)?;
    let text = format!("{why}; it is set aside as {}, and a new one is begun", aside.display());
    tracing::error!("database: {text}");
    Ok(Event::new(now_ms, EventKind::SetAside, "", text))
}

fn locked<T>(state: &Mutex<StoreState>, act: impl FnOnce(&mut StoreState) -> T) -> T {
    act(&mut state.lock())
}

#[cfg(test)]
mod tests;
