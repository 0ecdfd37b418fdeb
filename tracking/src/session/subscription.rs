//! Requests that keep a subscription alive and fetch what the session still needs.
//!
//! ```text
//!   subscribe ─▶ cookie ─▶ subscribe, T1, every second ─▶ subscribed: T1, T2, T3
//!       the session needs info ────▶ info?        ╮ again after a second, until the need is met
//!       the session needs a profile ▶ profile?    ╯
//! ```
//!
//! It does no I/O: the time and the session's need go in, datagrams to send come out.

use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Request};

/// Between two renewals, and before anything is asked for again, µs: a fifth of the time after which a device forgets a
/// subscriber.
const AGAIN_US: u64 = 1_000_000;

/// What a session lacks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Need {
    /// Nothing.
    Nothing,
    /// The description of the device's setup.
    Info,
    /// Parts of a background profile.
    Profile {
        /// Its version.
        version: u16,
        /// Bit i for part i; 0: all parts.
        parts: u32,
    },
}

/// The requests to one device.
#[derive(Clone, Debug)]
pub struct Subscription {
    /// Whether the host wants reports, and so a place among the subscribers, or only the device's info.
    wants_reports: bool,
    cookie: Cookie,
    next_id: u32,
    renew_us: u64,
    ask_us: u64,
}

impl Default for Subscription {
    fn default() -> Self {
        Self::new(true)
    }
}

impl Subscription {
    /// One that has sent nothing yet.
    #[must_use]
    pub const fn new(wants_reports: bool) -> Self {
        Self { wants_reports, cookie: Cookie::NONE, next_id: 1, renew_us: 0, ask_us: 0 }
    }

    /// Starts again with a device that has restarted. Request numbers go on: the device may remember the last ones.
    pub fn restart(&mut self) {
        *self = Self { next_id: self.next_id, ..Self::new(self.wants_reports) };
    }

    /// Sets whether the host wants reports.
    pub const fn want_reports(&mut self, wants: bool) {
        self.wants_reports = wants;
    }

    /// Whether the host wants reports.
    #[must_use]
    pub const fn wants_reports(&self) -> bool {
        self.wants_reports
    }

    /// The device gave a cookie; a new one is used at once.
    pub fn grant(&mut self, cookie: Cookie) {
        if cookie != self.cookie {
            (self.cookie, self.renew_us) = (cookie, 0);
        }
    }

    /// The device no longer accepts the cookie.
    pub const fn revoke(&mut self) {
        self.cookie = Cookie::NONE;
    }

    /// The info has come, so the next need is asked for without a wait.
    pub const fn ask_at(&mut self, now_us: u64) {
        self.ask_us = now_us;
    }

    /// Sends to device `to` what is due at `now_us`.
    pub fn poll(&mut self, now_us: u64, to: Identity, need: Need, mut send: impl FnMut(&[u8])) {
        if now_us >= self.renew_us {
            self.renew(now_us, to, &mut send);
        }
        if self.cookie == Cookie::NONE || now_us < self.ask_us || !self.wants_reports {
            return;
        }
        let request = match need {
            Need::Nothing => return,
            Need::Info => Request::Info,
            Need::Profile { version, parts } => Request::Profile { version, parts },
        };
        self.ask_us = now_us + AGAIN_US;
        self.ask(to, request, &mut send);
    }

    /// When [`poll`](Self::poll) has something to send next, µs.
    #[must_use]
    pub fn next_us(&self, need: Need) -> u64 {
        let waits = self.wants_reports && need != Need::Nothing;
        if self.cookie != Cookie::NONE && waits { self.renew_us.min(self.ask_us) } else { self.renew_us }
    }

    fn renew(&mut self, now_us: u64, to: Identity, send: &mut impl FnMut(&[u8])) {
        self.renew_us = now_us + AGAIN_US;
        if self.cookie != Cookie::NONE && !self.wants_reports {
            return self.ask(to, Request::Info, send);
        }
        self.ask(to, Request::Subscribe { t1: now_us.to_le_bytes() }, send);
    }

    fn ask(&mut self, to: Identity, request: Request<'_>, send: &mut impl FnMut(&[u8])) {
        let mut datagram = [0; DATAGRAM_MAX];
        let length = request.encode(to, self.next_id, self.cookie, &mut datagram).unwrap_or(0);
        self.next_id = self.next_id.wrapping_add(1);
        send(datagram.get(..length).unwrap_or(&[]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEVICE: Identity = Identity { module: kehai::wire::ModuleId([2, 0, 0, 0, 0, 1]), boot: 1 };

    fn sent(subscription: &mut Subscription, now_us: u64, need: Need) -> usize {
        let mut sent = 0;
        subscription.poll(now_us, DEVICE, need, |_| sent += 1);
        sent
    }

    #[test]
    fn a_need_is_asked_for_once_a_second_and_only_with_a_cookie() {
        let mut subscription = Subscription::new(true);
        assert_eq!(sent(&mut subscription, 0, Need::Info), 1, "subscribe without a cookie");
        subscription.grant(Cookie([7; 8]));
        assert_eq!(sent(&mut subscription, 1000, Need::Info), 2, "subscribe with the cookie, info");
        assert_eq!(sent(&mut subscription, 1000, Need::Info), 0);
        subscription.grant(Cookie([7; 8]));
        assert_eq!(sent(&mut subscription, 1000, Need::Info), 0, "the same cookie again is no news");
        assert_eq!(subscription.next_us(Need::Info), 1_001_000);
        assert_eq!(sent(&mut subscription, 1_001_000, Need::Nothing), 1, "only the renewal");
    }

    #[test]
    fn a_host_that_wants_no_reports_asks_for_info_alone() {
        let mut subscription = Subscription::new(false);
        assert_eq!(sent(&mut subscription, 0, Need::Info), 1, "subscribe without a cookie takes no place");
        subscription.grant(Cookie([7; 8]));
        assert_eq!(sent(&mut subscription, 1000, Need::Info), 1);
        assert_eq!(subscription.next_us(Need::Info), 1_001_000);
    }
}
