//! The host's end of a session with one device, between a socket and everything that reads or writes messages.
//!
//! ```text
//!   request ─▶ seal ─┬ session ──▶ sealed
//!                    ├ cookie ───▶ open, in its place
//!                    └ nothing ──▶ subscribe for a cookie, in its place
//!
//!   datagram ─▶ take ─┬ cookie, opened ─▶ kept here
//!                     ├ sealed, right ──▶ the message, opened in its place
//!                     └ all else ───────▶ dropped, and counted by cause
//! ```
//!
//! Callers repeat their requests until they are answered, so nothing is sent again here, and a lost *open* costs them one
//! repeat. A session that says nothing for three seconds is given up for a new one: the device may have started anew.

use super::derive::SessionKeys;
use super::handshake::{Open, Opened};
use super::window::Window;
use super::{Key, Nonce, Unsealed, datagram};
use crate::wire::{Cookie, DATAGRAM_MAX, Header, Identity, Message, ModuleId, Refusal, Request};

/// Subscriptions are renewed so often, µs.
const RENEWAL_US: u64 = 1_000_000;

/// A session whose device is silent for so long is given up, µs: three renewals.
const SILENT_US: u64 = 3 * RENEWAL_US;

/// A session is replaced after so long, µs: what one key protects stays small.
const HOUR_US: u64 = 3_600_000_000;

/// Where one is open, a new session is asked for again after so long, µs. What asks takes the place of a
/// renewal: while the device refuses, nine of ten go out sealed. A subscription lasts five seconds without.
const AGAIN_US: u64 = 10 * RENEWAL_US;

/// The session before is still listened to for so long, µs: datagrams on their way.
const LAST_US: u64 = 10_000_000;

/// What a datagram of the device is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Incoming {
    /// A message, opened in its place.
    Message,
    /// It concerned the session only.
    Session,
    /// The device knows no such key: it was reset, or the key is not its.
    Refused,
    /// The device has no room for a session now: it is asked again later.
    Full,
    /// In clear, where the device has a key: anybody may have sent it.
    Clear,
    /// Dropped.
    Unsealed(Unsealed),
}

/// A session, from *opened* on.
#[derive(Clone, Copy, Debug)]
struct Session {
    number: u8,
    keys: SessionKeys,
    next: u64,
    window: Window,
    since_us: u64,
    heard_us: u64,
}

/// A request that is under way: *open*, or the subscribe for its cookie.
#[derive(Clone, Copy, Debug)]
struct Asked {
    request_id: u32,
    host: Nonce,
    at_us: u64,
}

/// The way to one device.
#[derive(Clone, Debug)]
pub struct Channel {
    device: ModuleId,
    key_id: u8,
    role_key: Key,
    identity: Identity,
    cookie: Cookie,
    asked: Option<Asked>,
    session: Option<Session>,
    before: Option<Session>,
    /// The session was opened with another key.
    is_stale: bool,
}

impl Channel {
    /// A way to `device` with one of its keys.
    #[must_use]
    pub const fn new(device: ModuleId, key_id: u8, role_key: Key) -> Self {
        let identity = Identity { module: device, boot: 0 };
        Self {
            device,
            key_id,
            role_key,
            identity,
            cookie: Cookie::NONE,
            asked: None,
            session: None,
            before: None,
            is_stale: false,
        }
    }

    /// Opens its next session with another key; the present one goes on until then.
    pub fn rekey(&mut self, key_id: u8, role_key: Key) {
        if (self.key_id, self.role_key) != (key_id, role_key) {
            (self.key_id, self.role_key) = (key_id, role_key);
            self.is_stale = true;
        }
    }

    /// Whether a session is open.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.session.is_some()
    }

    /// Whether a session is open, and its device was not silent for too long.
    #[must_use]
    pub fn is_heard(&self, now_us: u64) -> bool {
        self.session.is_some_and(|session| now_us < session.heard_us.saturating_add(SILENT_US))
    }

    /// Makes of a request in clear, the first `length` bytes of `bytes`, what is to be sent in its place; returns its length.
    /// `fresh` is random, another each time.
    #[must_use]
    pub fn seal(
        &mut self,
        bytes: &mut [u8; DATAGRAM_MAX],
        length: usize,
        fresh: Nonce,
        now_us: u64,
    ) -> usize {
        if !self.is_heard(now_us) && self.is_open() {
            (self.session, self.before, self.asked) = (None, None, None);
        }
        let is_asked = self.asked.is_some_and(|asked| now_us < asked.at_us.saturating_add(AGAIN_US));
        let is_stale = self.is_stale;
        if let Some(session) = &mut self.session
            && (is_asked || !is_stale && now_us < session.since_us.saturating_add(HOUR_US))
        {
            let bytes = bytes.get_mut(..length).unwrap_or(&mut []);
            datagram::seal(bytes, &session.keys.inward, session.number, session.next);
            session.next = session.next.saturating_add(1);
            return length;
        }
        let [a, b, c, d, ..] = fresh.0;
        let request_id = u32::from_le_bytes([a, b, c, d]);
        self.asked = Some(Asked { request_id, host: fresh, at_us: now_us });
        if self.cookie == Cookie::NONE {
            let to = Identity { module: self.device, boot: 0 };
            let subscribe = Request::Subscribe { t1: [0; 8] };
            return subscribe.encode(to, request_id, Cookie::NONE, bytes).unwrap_or(0);
        }
        let open = Open { key_id: self.key_id, request_id, cookie: self.cookie, host: fresh };
        let open = open.bytes(self.identity, self.role_key);
        bytes.iter_mut().zip(open).for_each(|(slot, byte)| *slot = byte);
        open.len()
    }

    /// Takes a datagram of the device that came at `now_us`; a message is opened in its place.
    pub fn take(&mut self, bytes: &mut [u8], now_us: u64) -> Incoming {
        if let Some((header, opened)) = Opened::read(bytes) {
            return self.opened(bytes, header.identity, opened, now_us);
        }
        match datagram::named_key(bytes) {
            Some((number, counter)) => match self.unseal(bytes, number, counter, now_us) {
                Ok(()) => Incoming::Message,
                Err(cause) => Incoming::Unsealed(cause),
            },
            None => self.clear(bytes),
        }
    }

    /// A datagram in clear: a cookie, or a refusal of what was asked for a session. Anything else anybody may have sent.
    fn clear(&mut self, bytes: &[u8]) -> Incoming {
        let Ok((Header { identity, .. }, message)) = Message::decode(bytes) else { return Incoming::Clear };
        let asked = self.asked.map(|asked| asked.request_id);
        match message {
            Message::Cookie { request_id, cookie, .. }
                if identity.module == self.device && asked == Some(request_id) =>
            {
                // A forged one costs a refused open.
                (self.identity, self.cookie) = (identity, cookie);
                Incoming::Session
            }
            Message::Refused(refused)
                if identity.module == self.device && asked == Some(refused.request_id) =>
            {
                match refused.refusal {
                    // It has started anew, or the cookie was forged: the next request asks for another one.
                    Refusal::BadCookie => {
                        self.cookie = Cookie::NONE;
                        Incoming::Session
                    }
                    Refusal::Full => Incoming::Full,
                    _ => {
                        self.cookie = Cookie::NONE;
                        Incoming::Refused
                    }
                }
            }
            _ => Incoming::Clear,
        }
    }

    fn opened(&mut self, bytes: &[u8], identity: Identity, opened: Opened, now_us: u64) -> Incoming {
        let Some(asked) = self.asked.filter(|asked| asked.request_id == opened.request_id) else {
            return Incoming::Unsealed(Unsealed::Replayed);
        };
        if identity.module != self.device {
            return Incoming::Unsealed(Unsealed::Session);
        }
        let keys = SessionKeys::of(self.role_key, identity, asked.host, opened.device);
        if !datagram::is_signed(bytes, &keys.outward, 0) {
            return Incoming::Unsealed(Unsealed::Forged);
        }
        let mut window = Window::new();
        window.take(0);
        self.before = self.session.map(|session| Session { since_us: now_us, ..session });
        self.session = Some(Session {
            number: opened.session,
            keys,
            next: 0,
            window,
            since_us: now_us,
            heard_us: now_us,
        });
        (self.identity, self.asked, self.is_stale) = (identity, None, false);
        Incoming::Session
    }

    fn unseal(&mut self, bytes: &mut [u8], number: u8, counter: u64, now_us: u64) -> Result<(), Unsealed> {
        self.before = self.before.filter(|before| now_us < before.since_us.saturating_add(LAST_US));
        let sessions = [&mut self.session, &mut self.before].into_iter().flatten();
        let mut cause = Unsealed::Session;
        for session in sessions.filter(|session| session.number == number) {
            if !session.window.admits(counter) {
                cause = Unsealed::Replayed;
            } else if datagram::open(bytes, &session.keys.outward, counter) {
                session.window.take(counter);
                session.heard_us = now_us;
                return Ok(());
            } else {
                cause = Unsealed::Forged;
            }
        }
        Err(cause)
    }
}
