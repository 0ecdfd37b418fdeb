//! Threads that run until they are asked to end: one that ends by itself is an alarm, and is started again.
//!
//! ```text
//!   work ─┬─ Ok: it was asked to end ─▶ the thread ends
//!         └─ Err, or a panic ─▶ alarm `thread`, a line in the log ─▶ 0.2 s ─▶ work again
//! ```
//!
//! The tracking thread is not among them. What it knows cannot be begun again in its middle: its end is the end of the
//! process, with one line, and the service manager starts that again.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::tracker_alarms::TrackerAlarms;

/// Before the work begins again. The doors fail after a second without tracks, so their watchdog must be back before.
const PAUSE: Duration = Duration::from_millis(200);

/// A thread that works until it is dropped. Dropping waits for it.
#[derive(Debug)]
pub struct Worker {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts it. `work` ends when the flag that it is given says so.
    ///
    /// # Errors
    /// There is no thread for it.
    pub fn start(
        thread: &'static str,
        alarms: TrackerAlarms,
        mut work: impl FnMut(&AtomicBool) -> Result<(), String> + Send + 'static,
    ) -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let supervised = move || run(thread, &alarms, || work(&stopped));
        let handle = std::thread::Builder::new().name(thread.into()).spawn(supervised)?;
        Ok(Self { stop, thread: Some(handle) })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Does the work until that says it was asked to end.
pub fn run(thread: &'static str, alarms: &TrackerAlarms, mut work: impl FnMut() -> Result<(), String>) {
    loop {
        // What a panic leaves half done is thrown away or written anew by the work's next beginning.
        let why = match catch_unwind(AssertUnwindSafe(&mut work)) {
            Ok(Ok(())) => return,
            Ok(Err(why)) => why,
            Err(panic) => in_words(&*panic),
        };
        let times = alarms.thread_ended(thread, &why);
        // A fault that comes back at once must not fill the log.
        if times.is_power_of_two() {
            tracing::error!("the thread {thread} has ended ({times}): {why}; it is started again");
        }
        std::thread::sleep(PAUSE);
    }
}

/// What a panic said.
pub fn in_words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "without a word".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::alarm::AlarmKind;

    #[test]
    fn f12_a_thread_that_ends_is_an_alarm_and_is_started_again() {
        let alarms = TrackerAlarms::default();
        let mut times = 0;
        run("doors", &alarms, || {
            times += 1;
            match times {
                1 => panic!("number {times}"),
                2 => Err("the listener is gone".to_owned()),
                _ => Ok(()),
            }
        });
        run("mqtt", &alarms, || Ok(()));
        let lines = alarms.lines();
        let [line] = &lines[..] else { unreachable!("{lines:?}") };
        assert_eq!((times, line.kind), (3, AlarmKind::Thread));
        assert!(line.text.contains("doors ended 2 times"), "{}", line.text);
        assert!(line.text.contains("the listener is gone") && !line.text.contains("mqtt"), "{}", line.text);
    }
}
