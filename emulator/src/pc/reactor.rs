//! Real time on a PC: one thread that sleeps until a descriptor is ready or a time has come.
//!
//! ```text
//!   poll the future ─▶ it notes what it waits for ─▶ poll(2) on all of it ─▶ poll the future …
//! ```
//!
//! Not tokio with tokio-serial: tokio's timers end on whole milliseconds, but the driver paces in microseconds;
//! and a device that restarts keeps its port and gets a new clock, while a tokio socket stays with the runtime
//! that made it. Some hundred lines would go, and two crates would come into the core's own tests.

use std::cell::{Cell, RefCell};
use std::future::Future;
use std::os::fd::AsFd;
use std::pin::pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};
use std::time::{Duration, Instant};

use kehai::link::Clock;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Longest sleep: the stop flag is looked at this often.
const LONGEST_SLEEP_US: u64 = 100_000;

/// The thread's clock and what it waits for. Clones are the same.
#[derive(Clone)]
pub struct Reactor(Rc<Shared>);

struct Shared {
    start: Instant,
    ready_for: RefCell<Vec<(Rc<dyn AsFd>, PollFlags)>>,
    due_us: Cell<u64>,
}

impl Reactor {
    /// Time begins now.
    #[must_use]
    pub fn new() -> Self {
        Self(Rc::new(Shared {
            start: Instant::now(),
            ready_for: RefCell::default(),
            due_us: Cell::new(u64::MAX),
        }))
    }

    /// Comes back to the future that is being polled when `descriptor` is ready.
    pub fn wait_for(&self, descriptor: Rc<dyn AsFd>, flags: PollFlags) {
        self.0.ready_for.borrow_mut().push((descriptor, flags));
    }

    /// Runs `future` to its end; None when `stop` was set before.
    pub fn block_on<F: Future>(&self, stop: &AtomicBool, future: F) -> Option<F::Output> {
        let mut future = pin!(future);
        let again = Arc::new(Flag::default());
        let waker = Waker::from(Arc::clone(&again));
        let mut context = Context::from_waker(&waker);
        while !stop.load(Ordering::Relaxed) {
            self.0.ready_for.borrow_mut().clear();
            self.0.due_us.set(u64::MAX);
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return Some(output);
            }
            if !again.0.swap(false, Ordering::Relaxed) {
                self.sleep();
            }
        }
        None
    }

    fn sleep(&self) {
        let ready_for = self.0.ready_for.borrow();
        let mut polled: Vec<_> =
            ready_for.iter().map(|(fd, flags)| PollFd::from_borrowed_fd(fd.as_fd(), *flags)).collect();
        let sleep_us = self.0.due_us.get().saturating_sub(self.now_us()).min(LONGEST_SLEEP_US);
        let timeout = Timespec::try_from(Duration::from_micros(sleep_us)).ok();
        // An error is an interruption: everything is looked at again anyway.
        let _ = poll(&mut polled, timeout.as_ref());
    }
}

impl Default for Reactor {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Default)]
struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Clock for Reactor {
    fn now_us(&self) -> u64 {
        u64::try_from(self.0.start.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    async fn wait_until(&self, at_us: u64) {
        std::future::poll_fn(|_| {
            if self.now_us() >= at_us {
                return Poll::Ready(());
            }
            self.0.due_us.set(self.0.due_us.get().min(at_us));
            Poll::Pending
        })
        .await;
    }
}
