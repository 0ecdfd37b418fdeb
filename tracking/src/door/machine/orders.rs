//! What a door orders its lock and its alarm to be.
//!
//! ```text
//!   locked            said each second until it is acknowledged
//!   unlocked, exit    a lease of 1.5 s, renewed each half second, whether it is acknowledged or not
//!
//!   lock    ready 41 ────▶      ready 42 ────▶              a number of its own, another each time
//!   door         ◀── unlocked for 1.5 s (41)  ◀── locked (42)
//! ```
//!
//! A lock that says *ready* counts the lease from its own number, and takes no order with a number older than a second:
//! so no order that waited anywhere opens it, and no clocks are compared.

use crate::door::event::{Action, LockOrder};
use crate::door::output::{Hold, LEASE_MS, Output};
use crate::door::terms::{Alarm, Lock, Nonce};

/// Lock and alarm.
#[derive(Clone, Debug)]
pub(super) struct Orders {
    pub(super) lock: Output<Lock>,
    pub(super) alarm: Output<Option<Alarm>>,
    /// The lock's own number, if it has said one.
    nonce: Option<Nonce>,
}

impl Orders {
    /// Locked, and in trouble; orders are numbered from `first_id`.
    pub(super) const fn new(first_id: u64) -> Self {
        let (lock, alarm) =
            (Output::new(Lock::Locked, first_id), Output::new(Some(Alarm::Trouble), first_id));
        Self { lock, alarm, nonce: None }
    }

    /// The lock is there, and waits for an order with this number.
    pub(super) const fn lock_is_ready(&mut self, nonce: Nonce) {
        self.nonce = Some(nonce);
        self.lock.ask();
    }

    /// Says what is due.
    pub(super) fn say(&mut self, now_s: f64, actions: &mut Vec<Action>) {
        let hold = match self.lock.value() {
            Lock::Locked => Hold::Standing,
            Lock::Unlocked | Lock::Exit => Hold::Lease,
        };
        if let Some((id, lock)) = self.lock.due(hold, now_s) {
            let for_ms = (hold == Hold::Lease).then_some(LEASE_MS);
            actions.push(Action::Lock(LockOrder { id, lock, for_ms, nonce: self.nonce }));
        }
        if let Some((id, alarm)) = self.alarm.due(Hold::Standing, now_s) {
            actions.push(Action::Alarm { id, alarm });
        }
    }
}
