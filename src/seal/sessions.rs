//! The device's end: up to six sessions, each with one address of a host.
//!
//! ```text
//!   open, genuine ─▶ session: open ── sealed by the host ─▶ proven ── silent for a minute, or room is wanted ─▶ gone
//!                      │ sends nothing                        │ sends
//!                      └ at most two at a time                └ the older ones of its address end
//! ```
//!
//! A recorded *open* can be sent again: it gets a session that its sender cannot use, in the place of another open one, never
//! of a proven one.

use core::net::SocketAddrV4;

use super::derive::{SessionKeys, nonce};
use super::handshake::{OPENED_LEN, Open, Opened};
use super::keyring::Keyring;
use super::window::Window;
use super::{Nonce, Unsealed, datagram};
use crate::wire::{Cookie, Identity, Role};

/// Most sessions: four subscribers and two programs that ask.
pub const SESSIONS: usize = 6;

/// Most sessions that wait for their proof.
const OPEN: usize = 2;

/// A session without a datagram of its host for so long gives way, µs: subscribers renew each second.
const SILENT_US: u64 = 60_000_000;

/// Why no session is opened.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NotOpened {
    /// Not the bytes of *open*.
    Malformed,
    /// For another device or another start.
    Identity,
    /// The cookie is not the host's.
    Cookie(Open),
    /// There is no such key here.
    Key(Open),
    /// Not made by the holder of its key.
    Forged,
    /// This *open* has opened a session already.
    Replayed,
    /// All places are taken by sessions in use.
    Full(Open),
}

/// One session.
#[derive(Clone, Debug)]
struct Session {
    at: SocketAddrV4,
    key_id: u8,
    role: Role,
    keys: SessionKeys,
    host: Nonce,
    device: Nonce,
    /// Counter of the next datagram to the host; 0 was *opened*.
    next: u64,
    window: Window,
    is_proven: bool,
    heard_us: u64,
}

/// All sessions of a device.
#[derive(Clone, Debug)]
pub struct Sessions {
    places: [Option<Session>; SESSIONS],
    secret: [u8; 16],
    /// Sessions opened in this start.
    opened: u64,
}

impl Sessions {
    /// None yet. With a secret nonces cannot be told in advance.
    #[must_use]
    pub const fn new(secret: [u8; 16]) -> Self {
        Self { places: [const { None }; SESSIONS], secret, opened: 0 }
    }

    /// Opens a session for the host at `from`, whose cookie is `cookie`: the answer.
    ///
    /// # Errors
    /// [`NotOpened`]; nothing has changed.
    pub fn open(
        &mut self,
        bytes: &[u8],
        (from, cookie): (SocketAddrV4, Cookie),
        (own, to): (Identity, Identity),
        keyring: &Keyring,
        now_us: u64,
    ) -> Result<[u8; OPENED_LEN], NotOpened> {
        let open = Open::read(bytes).ok_or(NotOpened::Malformed)?;
        if to.module != own.module {
            return Err(NotOpened::Identity);
        }
        // Nothing is computed for a host that has not shown that it is there.
        if open.cookie != cookie || cookie == Cookie::NONE {
            return Err(NotOpened::Cookie(open));
        }
        let key = keyring.get(open.key_id).ok_or(NotOpened::Key(open))?;
        if !open.is_genuine(bytes, to, key.key) {
            return Err(NotOpened::Forged);
        }
        let (request_id, same) = (open.request_id, |session: &Session| session.host == open.host);
        let places = || (1_u8..).zip(&self.places);
        if let Some((number, session)) =
            places().find_map(|(number, place)| Some((number, place.as_ref().filter(|s| same(s))?)))
        {
            if session.is_proven || session.at != from {
                return Err(NotOpened::Replayed);
            }
            let opened = Opened { request_id, session: number, device: session.device };
            return Ok(opened.bytes(own, &session.keys));
        }
        let device = nonce(self.secret, own.boot, self.opened);
        let keys = SessionKeys::of(key.key, own, open.host, device);
        let (number, place) = self.place(now_us).ok_or(NotOpened::Full(open))?;
        *place = Some(Session {
            at: from,
            key_id: key.id,
            role: key.role,
            keys,
            host: open.host,
            device,
            next: 1,
            window: Window::new(),
            is_proven: false,
            heard_us: now_us,
        });
        self.opened = self.opened.saturating_add(1);
        Ok(Opened { request_id, session: number, device }.bytes(own, &keys))
    }

    /// A place for one session more: that of the oldest open one if there are as many as may be, else a free one, else that
    /// of the one that has been silent longest.
    fn place(&mut self, now_us: u64) -> Option<(u8, &mut Option<Session>)> {
        let open = self.places.iter().flatten().filter(|session| !session.is_proven).count();
        let order = |place: &Option<Session>| match place {
            Some(session) if !session.is_proven && open >= OPEN => (0, session.heard_us),
            None => (1, 0),
            Some(session) if !session.is_proven => (2, session.heard_us),
            Some(session) => (3, session.heard_us),
        };
        let (number, place) = (1_u8..).zip(&mut self.places).min_by_key(|(_, place)| order(place))?;
        let is_free = place
            .as_ref()
            .is_none_or(|session| !session.is_proven || now_us >= session.heard_us.saturating_add(SILENT_US));
        is_free.then_some((number, place))
    }

    /// Opens a sealed datagram of the host at `from` in its place: what its key allows.
    ///
    /// # Errors
    /// [`Unsealed`]; nothing has changed.
    pub fn unseal(
        &mut self,
        from: SocketAddrV4,
        bytes: &mut [u8],
        (number, counter): (u8, u64),
        now_us: u64,
    ) -> Result<Role, Unsealed> {
        let place = usize::from(number).checked_sub(1).and_then(|place| self.places.get_mut(place));
        let session = place.and_then(Option::as_mut).filter(|session| session.at == from);
        let session = session.ok_or(Unsealed::Session)?;
        if !session.window.admits(counter) {
            return Err(Unsealed::Replayed);
        }
        if !datagram::open(bytes, &session.keys.inward, counter) {
            return Err(Unsealed::Forged);
        }
        session.window.take(counter);
        session.heard_us = now_us;
        let (role, is_new) = (session.role, !session.is_proven);
        session.is_proven = true;
        if is_new {
            self.end(|other_number, other| other.at == from && other_number != number);
        }
        Ok(role)
    }

    fn end(&mut self, ends: impl Fn(u8, &Session) -> bool) {
        for (number, place) in (1_u8..).zip(&mut self.places) {
            if place.as_ref().is_some_and(|session| ends(number, session)) {
                *place = None;
            }
        }
    }

    /// Ends the sessions whose key is not among these any more, or is another.
    pub fn keep_only(&mut self, before: &Keyring, now: &Keyring) {
        self.end(|_, session| now.get(session.key_id) != before.get(session.key_id));
    }

    /// Whether there is a proven session with the host at `at`.
    #[must_use]
    pub fn has(&self, at: SocketAddrV4) -> bool {
        self.places.iter().flatten().any(|session| session.at == at && session.is_proven)
    }

    /// Seals a datagram to the host at `to` in its place, if there is a proven session.
    #[must_use]
    pub fn seal(&mut self, to: SocketAddrV4, bytes: &mut [u8]) -> bool {
        let proven = |(number, place): (u8, &'_ mut Option<Session>)| {
            let session = place.as_mut().filter(|session| session.at == to && session.is_proven)?;
            datagram::seal(bytes, &session.keys.outward, number, session.next);
            session.next = session.next.saturating_add(1);
            Some(())
        };
        (1_u8..).zip(&mut self.places).find_map(proven).is_some()
    }
}
