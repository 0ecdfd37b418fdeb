//! The thread that writes: frames and events in, a transaction each half second.
//!
//! ```text
//!   messages ─▶ recorder ─▶ rows ─▶ every 0.5 s: one transaction ─▶ FILE
//!                             ▲         └ fails: said, kept, tried again after 2 s; damaged: set aside, begun anew
//!                             └ kept until they are written          every minute: what is too old is deleted
//! ```

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::recorder::ChangeRecorder;
use super::retention::Keep;
use super::writer::Writer;
use super::{Dropped, Message, StoreError, StoreState, error, lock, locked, open, raw, set_aside};
use kehai_tracking::snapshot::{STALE_MS, Snapshot, unix_ms};

/// Between two transactions. The promise is a second.
const BATCH: Duration = Duration::from_millis(500);

/// Between two looks for what is too old.
const FORGET: Duration = Duration::from_secs(60);

/// Between two tries to open a file that could not be.
const AGAIN: Duration = Duration::from_secs(2);

/// The alarm is over when all could be written for so long: on a full disk some can now and then.
const STEADY: Duration = Duration::from_secs(10);

/// What the thread has.
pub struct Work {
    pub file: PathBuf,
    pub keep: Keep,
    pub writer: Option<Writer>,
    pub lock: Option<lock::Lock>,
    /// What was found to be wrong with the file itself while it was open.
    pub damage: Option<String>,
    pub recorder: ChangeRecorder,
    pub newest: Option<Arc<Snapshot>>,
    /// When the newest snapshot was made by the tracker's own clock, which is never set, s.
    pub newest_s: f64,
    /// The run's number, while the file is not open.
    pub run: Option<i64>,
    /// When it could not be written last.
    pub failed: Option<Instant>,
    /// What was dropped by the last batch.
    pub dropped: Dropped,
    pub state: Arc<Mutex<StoreState>>,
}

impl Work {
    pub fn run(&mut self, messages: &Receiver<Message>) {
        let begun = Instant::now();
        let (mut batch_at, mut open_at, mut forget_at) = (begun + BATCH, begun, begun);
        loop {
            let ended = match messages.recv_timeout(batch_at.saturating_duration_since(Instant::now())) {
                Ok(message) => {
                    self.handle(message);
                    false
                }
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => true,
            };
            let now = Instant::now();
            if !ended && now < batch_at {
                continue;
            }
            batch_at = now + BATCH;
            if self.writer.is_none() && (ended || now >= open_at) {
                open_at = now + AGAIN;
                self.open();
            }
            self.note_dropped();
            self.write();
            if now >= forget_at {
                forget_at = now + if self.forget() { BATCH } else { FORGET };
            }
            if ended {
                return self.give_up();
            }
        }
    }

    /// What is not written by now never will be.
    fn give_up(&mut self) {
        let unwritten = self.recorder.give_up();
        if unwritten > 0 {
            self.note_dropped();
            let trouble = locked(&self.state, |state| state.trouble.clone()).unwrap_or_default();
            tracing::error!("database: {unwritten} rows could not be written at the end: {trouble}");
        }
    }

    fn open(&mut self) {
        if self.lock.is_none() {
            match lock::acquire(&self.file) {
                Ok(lock) => self.lock = lock,
                Err(lock::Taken) => {
                    return self.trouble(&StoreError::Taken { file: self.file.clone() }.to_string());
                }
            }
        }
        let now_ms = unix_ms();
        if let Some(why) = self.damage.take() {
            match set_aside(&self.file, now_ms, &why) {
                Ok(event) => self.recorder.happened(event),
                Err(error) => self.trouble(&error.to_string()),
            }
        }
        match open(&self.file, now_ms, self.run) {
            Ok((writer, event)) => {
                self.lock.iter_mut().for_each(lock::Lock::mark);
                // Alarms are written when they change alone.
                if let Some(frame) = &self.newest {
                    self.recorder.stand(&frame.alarms);
                }
                event.into_iter().for_each(|event| self.recorder.happened(event));
                self.writer = Some(writer);
            }
            Err(error) => self.trouble(&error.to_string()),
        }
    }

    /// After a fault of this program: what was not written is still there, and is tried again with a new connection.
    pub fn begin_again(&mut self, why: &str) {
        self.run = self.writer.take().map(|writer| writer.run()).or(self.run);
        self.trouble(&format!("the thread that writes has failed and begins again: {why}"));
        std::thread::sleep(BATCH);
    }

    fn handle(&mut self, message: Message) {
        match message {
            Message::Snapshot(frame) => {
                if self.is_clock_set(&frame) {
                    self.clock_set(frame.unix_ms);
                }
                self.newest_s = frame.line.t;
                self.recorder.record(&frame);
                self.newest = Some(frame);
            }
            Message::Event(event) => self.recorder.happened(event),
            Message::Passage(passed) => self.recorder.passed(*passed),
            Message::Alarm(alarm) => self.recorder.alarm(*alarm),
            Message::Site(site, now_ms, source) => self.recorder.set_site(&site, now_ms, source),
        }
    }

    /// Whether the clock was set before this snapshot: it went back, or farther ahead than the tracker's own clock. It may be ahead by
    /// as much as a snapshot holds; NTP slews it by less between two.
    fn is_clock_set(&self, frame: &Snapshot) -> bool {
        let Some(newest_ms) = self.recorder.newest_ms() else { return false };
        let passed_ms = ((frame.line.t - self.newest_s) * 1e3).max(0.0) as u64;
        frame.unix_ms < newest_ms || frame.unix_ms - newest_ms > passed_ms.saturating_add(STALE_MS)
    }

    /// The clock was set to `now_ms`. Another run begins just before. Of the times that two runs tell of nothing is known; and a run
    /// that reached ahead would tell of all that comes once the clock is right again, and have its history deleted by the wrong clock.
    fn clock_set(&mut self, now_ms: u64) {
        self.recorder.clock_set();
        self.write();
        self.run = None;
        let now_ms = now_ms.saturating_sub(1);
        if let Some(Err(error)) = self.writer.as_mut().map(|writer| writer.begin_run(now_ms)) {
            let file = self.file.clone();
            self.trouble(&StoreError::Sqlite { file, error }.to_string());
            self.writer = None;
        }
    }

    fn write(&mut self) {
        let Some(writer) = &mut self.writer else { return };
        let (rows, paths) = self.recorder.rows();
        if rows.is_empty() && paths.is_empty() && self.newest.is_none() {
            return;
        }
        match writer.write(rows, paths, self.newest.as_deref()) {
            Ok(()) => {
                self.recorder.written();
                self.newest = None;
                let steady = self.failed.is_none_or(|failed| failed.elapsed() >= STEADY);
                locked(&self.state, |state| {
                    if steady {
                        state.trouble = None;
                    }
                    state.written += 1;
                });
            }
            Err(error) => {
                let (file, damaged) = (self.file.clone(), error::is_damage(&error));
                self.run = Some(writer.run());
                let text = StoreError::Sqlite { file, error }.to_string();
                self.damage = damaged.then(|| text.clone());
                self.trouble(&text);
                // A file that was replaced or lost is opened again.
                self.writer = None;
            }
        }
    }

    fn forget(&mut self) -> bool {
        let Some(writer) = &mut self.writer else { return false };
        let now_ms = unix_ms();
        let forgotten = writer
            .forget(now_ms, self.keep)
            .and_then(|more| Ok((more, writer.raw(now_ms)?, writer.doubt(now_ms, self.keep)?)));
        match forgotten {
            Ok((more, kept, doubt)) => {
                let text = raw::in_words(&kept, now_ms);
                let doubt = doubt.map(|doubt| doubt.to_string());
                locked(&self.state, |state| (state.raw, state.doubt) = (text, doubt));
                more
            }
            Err(error) => {
                let file = self.file.clone();
                self.trouble(&StoreError::Sqlite { file, error }.to_string());
                false
            }
        }
    }

    /// Counts the rows that were dropped, and says that something was since the last batch. While the file cannot be written
    /// the next try says it.
    fn note_dropped(&mut self) {
        let rows = self.recorder.dropped();
        let dropped = locked(&self.state, |state| {
            state.dropped.rows = rows;
            state.dropped
        });
        if std::mem::replace(&mut self.dropped, dropped) != dropped && self.writer.is_some() {
            self.trouble(&format!("{}: the disk was full or is too slow", self.file.display()));
        }
    }

    fn trouble(&mut self, text: &str) {
        self.failed = Some(Instant::now());
        locked(&self.state, |state| {
            let lost = state.dropped.in_words().map(|lost| format!(": {lost}")).unwrap_or_default();
            state.trouble = Some(format!("{text}{lost}"));
        });
    }
}
