//! Requests that keep a subscription alive and fetch what the session still needs.
//!
//! ```text
//!   subscribe ─▶ cookie ─▶ subscribe, T1, every second ─▶ subscribed: T1, T2, T3
//!       the session needs info ────▶ info?        ╮ again after a second, until the need is met
//!       the session needs a profile ▶ profile?    ╯
//! ```
//!
//! It does no I/O: the time and the session's need go in, datagrams to send come out.

use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Message, Request};

use super::outstanding::{Kind, Outstanding};

/// Between two renewals, and before anything is asked for again, µs: a fifth of the time after which a device forgets a
/// subscriber.
const AGAIN_US: u64 = 1_000_000;

/// Longest between two requests to an address that has never answered, µs: a request a minute is no flood, wherever it goes.
const SELDOM_US: u64 = 60_000_000;

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
    /// Makes ids that cannot be guessed.
    seed: u64,
    /// Requests sent.
    sent: u64,
    outstanding: Outstanding,
    /// Before the next request while there has been no answer, of one that waits longer each time.
    backs_off_us: Option<u64>,
    renew_us: u64,
    ask_us: u64,
}

impl Default for Subscription {
    fn default() -> Self {
        Self::new(true, 0)
    }
}

impl Subscription {
    /// One that has sent nothing yet. With a random `seed` its request ids cannot be guessed.
    #[must_use]
    pub fn new(wants_reports: bool, seed: u64) -> Self {
        let (outstanding, backs_off_us) = (Outstanding::default(), None);
        Self {
            wants_reports,
            cookie: Cookie::NONE,
            seed,
            sent: 0,
            outstanding,
            backs_off_us,
            renew_us: 0,
            ask_us: 0,
        }
    }

    /// The same to an address that was only announced: until it answers it is asked after a second, two, four, and so
    /// on, at last once a minute.
    #[must_use]
    pub fn backing_off(mut self) -> Self {
        self.backs_off_us = Some(AGAIN_US);
        self
    }

    /// Starts again with a device that has restarted. Request ids go on: the device may remember the last ones.
    pub fn restart(&mut self) {
        *self = Self { sent: self.sent, ..Self::new(self.wants_reports, self.seed) };
    }

    /// What a message of the device is that came at `now_us`.
    #[must_use]
    pub fn kind(&self, message: &Message<'_>, now_us: u64) -> Kind {
        self.outstanding.kind(message, now_us)
    }

    /// The same; the request is answered by it.
    pub fn consume(&mut self, message: &Message<'_>, now_us: u64) -> Kind {
        self.outstanding.consume(message, now_us)
    }

    /// What answers a request of `other` answers one of this, too: both ask the same device.
    pub fn adopt(&mut self, other: &Self) {
        self.outstanding.adopt(&other.outstanding);
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
        self.backs_off_us = None;
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

    /// The device is looked for elsewhere from now on: it is asked there without a wait.
    pub const fn renew_at_once(&mut self) {
        self.renew_us = 0;
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
        self.ask(now_us, to, request, &mut send);
    }

    /// When [`poll`](Self::poll) has something to send next, µs.
    #[must_use]
    pub fn next_us(&self, need: Need) -> u64 {
        let waits = self.wants_reports && need != Need::Nothing;
        if self.cookie != Cookie::NONE && waits { self.renew_us.min(self.ask_us) } else { self.renew_us }
    }

    fn renew(&mut self, now_us: u64, to: Identity, send: &mut impl FnMut(&[u8])) {
        self.renew_us = now_us + self.backs_off_us.unwrap_or(AGAIN_US);
        self.backs_off_us = self.backs_off_us.map(|wait_us| (2 * wait_us).min(SELDOM_US));
        if self.cookie != Cookie::NONE && !self.wants_reports {
            return self.ask(now_us, to, Request::Info, send);
        }
        self.ask(now_us, to, Request::Subscribe { t1: now_us.to_le_bytes() }, send);
    }

    fn ask(&mut self, now_us: u64, to: Identity, request: Request<'_>, send: &mut impl FnMut(&[u8])) {
        let mut datagram = [0; DATAGRAM_MAX];
        self.sent += 1;
        let id = scattered(self.seed.wrapping_add(self.sent));
        self.outstanding.note(id, request, now_us);
        let length = request.encode(to, id, self.cookie, &mut datagram).unwrap_or(0);
        send(datagram.get(..length).unwrap_or(&[]));
    }
}

/// A number that tells nothing of the others of its row: the finaliser of SplitMix64 (Steele, Lea, Flood 2014).
const fn scattered(number: u64) -> u32 {
    let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed >> 32) as u32
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
        let mut subscription = Subscription::new(true, 0);
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
    fn f7_an_address_that_never_answers_is_asked_ever_more_seldom() {
        let mut subscription = Subscription::new(false, 0).backing_off();
        let mut asked_s = Vec::new();
        for second in 0..300 {
            if sent(&mut subscription, second * 1_000_000, Need::Nothing) > 0 {
                asked_s.push(second);
            }
        }
        assert_eq!(asked_s, [0, 1, 3, 7, 15, 31, 63, 123, 183, 243]);
        subscription.grant(Cookie([7; 8]));
        assert_eq!(
            [300, 301].map(|second| sent(&mut subscription, second * 1_000_000, Need::Nothing)),
            [1, 1]
        );
    }

    #[test]
    fn a_host_that_wants_no_reports_asks_for_info_alone() {
        let mut subscription = Subscription::new(false, 0);
        assert_eq!(sent(&mut subscription, 0, Need::Info), 1, "subscribe without a cookie takes no place");
        subscription.grant(Cookie([7; 8]));
        assert_eq!(sent(&mut subscription, 1000, Need::Info), 1);
        assert_eq!(subscription.next_us(Need::Info), 1_001_000);
    }
}
