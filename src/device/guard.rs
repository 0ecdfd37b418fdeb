//! Which datagrams are listened to, by which right, and what leaves sealed.
//!
//! ```text
//!   datagram ─┬ 0b open ────▶ opened, or refused
//!             ├ sealed ─────▶ opened in its place ─▶ what its key allows
//!             └ in clear ───▶ as long as there is no key: what its address allows; else a cookie, who it is, no more
//!
//!   to a host ─▶ in a session: sealed │ no key at all: in clear │ else not sent
//! ```

use core::net::SocketAddrV4;

use super::cookie::Cookies;
use crate::link::{Dropped, Lane, Outbox};
use crate::seal::handshake::{OPEN, OPENED_LEN, Open};
use crate::seal::sessions::NotOpened;
use crate::seal::{Holder, Keyring, Sessions, Unsealed, datagram};
use crate::wire::{Counter, DATAGRAM_MAX, Header, Identity, Refusal};

/// Keys, sessions, and room to seal a datagram in.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    keyring: Keyring,
    sessions: Sessions,
    sealed: [u8; DATAGRAM_MAX],
}

/// What a datagram is, before anything in it is believed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Admitted {
    /// A request, by this right; it has been opened in its place.
    Request(Holder),
    /// A session was asked for: the answer.
    Opened([u8; OPENED_LEN]),
    /// A session was asked for, and is refused.
    Refused(Open, Refusal),
    /// To be counted as this, and dropped.
    Dropped(Counter),
}

impl Guard {
    pub(super) const fn new(secret: [u8; 16]) -> Self {
        Self { keyring: Keyring::new(), sessions: Sessions::new(secret), sealed: [0; DATAGRAM_MAX] }
    }

    /// The keys in use.
    pub(super) const fn keyring(&self) -> &Keyring {
        &self.keyring
    }

    /// Other keys from now on: sessions of keys that are gone end.
    pub(super) fn set_keyring(&mut self, keyring: Keyring) {
        self.sessions.keep_only(&self.keyring, &keyring);
        self.keyring = keyring;
    }

    /// Whether a host at this address may be a subscriber.
    pub(super) fn may_subscribe(&self, at: SocketAddrV4) -> bool {
        !self.keyring.is_claimed() || self.sessions.has(at)
    }

    /// Looks at a datagram of the host at `from`.
    pub(super) fn admit(
        &mut self,
        bytes: &mut [u8],
        (from, cookies): (SocketAddrV4, &Cookies),
        own: Identity,
        now_us: u64,
    ) -> Admitted {
        // What is no datagram of ours is counted by the reader of requests.
        let Ok((header, _)) = Header::open(bytes) else { return Admitted::Request(Holder::Nothing) };
        if header.kind == OPEN {
            let (to, cookie) = (header.identity, cookies.cookie(from));
            let opened = self.sessions.open(bytes, (from, cookie), (own, to), &self.keyring, now_us);
            return match opened {
                Ok(answer) => Admitted::Opened(answer),
                Err(NotOpened::Cookie(open)) => Admitted::Refused(open, Refusal::BadCookie),
                Err(NotOpened::Full(open)) => Admitted::Refused(open, Refusal::Full),
                Err(NotOpened::Key(open)) => Admitted::Refused(open, Refusal::NoSuchKey),
                Err(NotOpened::Identity) => Admitted::Dropped(Counter::RefusedWrongModule),
                Err(NotOpened::Malformed) => Admitted::Dropped(Counter::RefusedMalformed),
                Err(NotOpened::Forged) => Admitted::Dropped(Counter::OpenForged),
                Err(NotOpened::Replayed) => Admitted::Dropped(Counter::OpenReplayed),
            };
        }
        let Some(named) = datagram::named_key(bytes) else { return Admitted::Request(Holder::Nothing) };
        match self.sessions.unseal(from, bytes, named, now_us) {
            Ok(role) => Admitted::Request(Holder::Key(role)),
            Err(Unsealed::Session) => Admitted::Dropped(Counter::SealedUnknown),
            Err(Unsealed::Replayed) => Admitted::Dropped(Counter::SealedReplayed),
            Err(Unsealed::Forged) => Admitted::Dropped(Counter::SealedForged),
        }
    }

    /// A way out that seals.
    pub(super) const fn over<'a, O>(&'a mut self, out: &'a mut O) -> Sealing<'a, O> {
        Sealing { guard: self, out }
    }
}

/// Seals what goes to hosts with a session; what would leave a device with keys in clear is dropped.
pub(super) struct Sealing<'a, O> {
    guard: &'a mut Guard,
    out: &'a mut O,
}

impl<O: Outbox> Outbox for Sealing<'_, O> {
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        let Guard { keyring, sessions, sealed } = &mut *self.guard;
        if sessions.has(to) {
            let sealed = sealed.get_mut(..datagram.len()).ok_or(Dropped)?;
            sealed.iter_mut().zip(datagram).for_each(|(slot, byte)| *slot = *byte);
            return if sessions.seal(to, sealed) {
                self.out.try_send_to(lane, to, sealed)
            } else {
                Err(Dropped)
            };
        }
        if keyring.is_claimed() {
            return Err(Dropped);
        }
        self.out.try_send_to(lane, to, datagram)
    }

    fn is_empty(&mut self, lane: Lane) -> bool {
        self.out.is_empty(lane)
    }

    fn reopen(&mut self, lane: Lane) {
        self.out.reopen(lane);
    }
}
