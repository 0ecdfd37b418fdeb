//! Virtual time: asynchronous code runs as fast as the machine can, on a clock that jumps.
//!
//! ```text
//! poll the future ─▶ all of it waits ─▶ jump to the earliest timer ─▶ wake ─▶ poll …
//! ```
//!
//! Links ([`crate::link`]) register the time of their next byte as a timer, so the same program gives
//! the same times, and the same bytes, in every run. Code that waits for nothing that can come is an error.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::future::Future;
use std::pin::pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// Polls without a step of time after which the future counts as running in circles.
const MAX_POLLS_AT_ONE_TIME: u32 = 1_000_000;

/// A clock that stands still until every task waits. Clones share the same time.
#[derive(Clone, Debug, Default)]
pub struct SimulatedClock(Rc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    now_us: Cell<u64>,
    /// Tasks to wake at each time, in order of registration; the first apart, for there is seldom a second.
    timers: RefCell<BTreeMap<u64, (Waker, Vec<Waker>)>>,
}

/// Why [`block_on`] gave up.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Stuck {
    /// Everything waits and no timer is set.
    #[error("dead-lock at {now_us} µs: everything waits and no timer is set")]
    DeadLock {
        /// When.
        now_us: u64,
    },
    /// The future wakes itself again and again without letting time pass.
    #[error("running in circles at {now_us} µs: polled without end while time stands still")]
    Circles {
        /// When.
        now_us: u64,
    },
    /// The time limit given to [`block_on_until`] has passed.
    #[error("not done at {now_us} µs")]
    Late {
        /// The limit.
        now_us: u64,
    },
}

impl SimulatedClock {
    /// A clock at 0 µs.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A clock that starts at `now_us`.
    #[must_use]
    pub fn starting_at(now_us: u64) -> Self {
        let clock = Self::default();
        clock.0.now_us.set(now_us);
        clock
    }

    /// The time in µs.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.0.now_us.get()
    }

    /// Wakes `waker` once the clock shows `at_us` or more.
    pub fn wake_at(&self, at_us: u64, waker: &Waker) {
        // A task that is polled again registers again: once is enough.
        match self.0.timers.borrow_mut().entry(at_us) {
            Entry::Vacant(entry) => {
                entry.insert((waker.clone(), Vec::new()));
            }
            Entry::Occupied(mut entry) => {
                let (first, others) = entry.get_mut();
                if !first.will_wake(waker) && !others.iter().any(|other| other.will_wake(waker)) {
                    others.push(waker.clone());
                }
            }
        }
    }

    /// Jumps to the earliest timer, if it comes before `limit_us`, and wakes the tasks that set it.
    fn jump(&self, limit_us: u64) -> Result<(), Stuck> {
        let now_us = self.now_us();
        let earliest_us = self.0.timers.borrow().keys().next().copied();
        let at_us = earliest_us.ok_or(Stuck::DeadLock { now_us })?.max(now_us);
        if at_us > limit_us {
            return Err(Stuck::Late { now_us: limit_us });
        }
        self.0.now_us.set(at_us);
        while let Some((first, others)) = self.due(at_us) {
            first.wake();
            others.into_iter().for_each(Waker::wake);
        }
        Ok(())
    }

    /// Removes the earliest timer that is due, and returns the tasks to wake.
    fn due(&self, at_us: u64) -> Option<(Waker, Vec<Waker>)> {
        let mut timers = self.0.timers.borrow_mut();
        timers.first_entry().filter(|entry| *entry.key() <= at_us).map(|entry| entry.remove())
    }
}

impl kehai::link::Clock for SimulatedClock {
    fn now_us(&self) -> u64 {
        Self::now_us(self)
    }

    async fn wait_until(&self, at_us: u64) {
        std::future::poll_fn(|context| {
            if self.now_us() >= at_us {
                return Poll::Ready(());
            }
            self.wake_at(at_us, context.waker());
            Poll::Pending
        })
        .await;
    }
}

#[derive(Default)]
struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs `future` to its end on virtual time.
///
/// # Errors
/// [`Stuck::DeadLock`] when everything waits and no timer is set, [`Stuck::Circles`] when it never waits.
pub fn block_on<F: Future>(clock: &SimulatedClock, future: F) -> Result<F::Output, Stuck> {
    block_on_until(clock, u64::MAX, future)
}

/// As [`block_on`], but gives up when the future would wait beyond `limit_us`; the clock then shows the
/// time of the last event before it.
///
/// # Errors
/// As [`block_on`], and [`Stuck::Late`].
pub fn block_on_until<F: Future>(
    clock: &SimulatedClock,
    limit_us: u64,
    future: F,
) -> Result<F::Output, Stuck> {
    let mut future = pin!(future);
    let flag = Arc::new(Flag::default());
    let waker = Waker::from(Arc::clone(&flag));
    let mut context = Context::from_waker(&waker);
    let mut polls = 0;
    let mut polled_at_us = clock.now_us();
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return Ok(output);
        }
        if clock.now_us() != polled_at_us {
            polled_at_us = clock.now_us();
            polls = 0;
        }
        polls += 1;
        if polls > MAX_POLLS_AT_ONE_TIME {
            return Err(Stuck::Circles { now_us: clock.now_us() });
        }
        while !flag.0.swap(false, Ordering::Relaxed) {
            clock.jump(limit_us)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_futures::join::join;
    use embassy_futures::select::{Either, select};
    use kehai::link::Clock as _;

    #[test]
    fn time_jumps_from_timer_to_timer() {
        let clock = SimulatedClock::new();
        let times = RefCell::new(Vec::new());
        let every = async |step_us: u64| {
            for n in 1..=3 {
                clock.wait_until(n * step_us).await;
                times.borrow_mut().push((step_us, clock.now_us()));
            }
        };
        block_on(&clock, join(every(100), every(150))).unwrap();
        assert_eq!(*times.borrow(), [(100, 100), (150, 150), (100, 200), (100, 300), (150, 300), (150, 450)]);
    }

    #[test]
    fn the_earlier_of_two_waits_wins() {
        let clock = SimulatedClock::starting_at(7);
        let first = block_on(&clock, select(clock.wait_until(5_000_000), clock.wait_until(9))).unwrap();
        assert!(matches!(first, Either::Second(())));
        assert_eq!(clock.now_us(), 9);
    }

    #[test]
    fn waiting_for_nothing_is_a_dead_lock_and_not_a_hang() {
        let clock = SimulatedClock::new();
        let stuck = block_on(&clock, std::future::pending::<()>()).unwrap_err();
        assert_eq!(stuck, Stuck::DeadLock { now_us: 0 });
    }

    #[test]
    fn a_future_that_never_waits_is_found_out() {
        let clock = SimulatedClock::new();
        let restless = std::future::poll_fn(|context| {
            context.waker().wake_by_ref();
            Poll::<()>::Pending
        });
        assert_eq!(block_on(&clock, restless), Err(Stuck::Circles { now_us: 0 }));
    }

    #[test]
    fn a_limit_ends_what_takes_too_long() {
        let clock = SimulatedClock::new();
        let late = block_on_until(&clock, 1000, clock.wait_until(1001));
        assert_eq!(late, Err(Stuck::Late { now_us: 1000 }));
    }
}
