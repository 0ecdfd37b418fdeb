//! Between a socket and everything that reads or writes messages: sealed to and from devices with a key, in clear the others.
//!
//! ```text
//!   request ─▶ of a device with a key? ─┬ no ──▶ as it is
//!                                       └ yes ─▶ the link with its address ─▶ sealed, or what opens a session
//!
//!   datagram ─▶ of a device with a key? ─┬ no ──▶ as it is, if the site believes devices in clear; else only who it is
//!                                        └ yes ─▶ its link ─┬ opened in its place ─▶ used
//!                                                           └ all else ────────────▶ counted by cause, dropped
//! ```
//!
//! A link belongs to an address, as a device may be looked for at several; what comes from one changes none of the others. It is
//! another device's only once the one whose session is open there has been silent for three seconds.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use kehai::seal::handshake::COOKIE;
use kehai::seal::{Channel, Incoming, Nonce, Nonces, Role, Unsealed};
use kehai::wire::{DATAGRAM_MAX, Header, Message, ModuleId};

use super::Keys;
use crate::registry::PEERS;
use crate::session::datagram::Datagram;
use crate::session::outstanding::is_answer;
use crate::snapshot::Drops;

/// Most links: twice the devices that are looked for, as one may be looked for at two addresses.
const LINKS: usize = 2 * PEERS;

/// A link over which nothing was sent for so long is given up, µs: requests are sent each second, or once a minute where no device
/// has answered.
const IDLE_US: u64 = 120_000_000;

/// The way to one address.
#[derive(Debug)]
struct Link {
    device: ModuleId,
    channel: Channel,
    /// The request that waits for a session, in clear.
    waiting: Vec<u8>,
    used_us: u64,
}

/// What a datagram that has arrived is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Arrived {
    /// To be used: it was sealed, and has been opened in its place.
    Message,
    /// In clear, of a device without a key: to be used if it is [believed](Links::believe).
    Clear,
    /// Not to be used: the device has no room for a session, and there is none.
    Full,
    /// Not to be used.
    Dropped,
}

/// How a device stands to the keys of its site.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Standing {
    /// It has a key.
    Sealed,
    /// It has none, and is believed.
    InClear,
    /// It has none, and is not believed.
    NotBelieved,
}

/// All links.
#[derive(Debug)]
pub struct Links {
    keys: Arc<Keys>,
    role: Role,
    nonces: Nonces,
    clear: Clear,
    at: BTreeMap<SocketAddr, Link>,
}

/// What becomes of devices without a key, in a site whose others have one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Clear {
    /// They are listed, and what they say of people is not used.
    #[default]
    Listed,
    /// They are believed, except under the name of a device that has a key.
    Believed,
}

impl Links {
    /// Links by the keys of this role. The nonces are to be seeded at random.
    #[must_use]
    pub const fn new(keys: Arc<Keys>, role: Role, nonces: Nonces, clear: Clear) -> Self {
        Self { keys, role, nonces, clear, at: BTreeMap::new() }
    }

    /// The keys they are made with.
    #[must_use]
    pub const fn keys(&self) -> &Arc<Keys> {
        &self.keys
    }

    /// Other keys from now on. A session goes on until one is opened with its device's new key; where a device has none any
    /// more, it ends.
    pub fn change(&mut self, keys: Arc<Keys>) {
        self.keys = keys;
        let (keys, role) = (&self.keys, self.role);
        self.at.retain(|_, link| {
            let key = keys.key(link.device, role);
            if let Some((id, key)) = key {
                link.channel.rekey(id, key);
            }
            key.is_some()
        });
    }

    /// A link that opens its session with this key, whatever the site's keys are: for the secret of a label.
    pub fn open_by(&mut self, to: SocketAddr, channel: Channel, device: ModuleId, now_us: u64) {
        self.at.insert(to, Link { device, channel, waiting: Vec::new(), used_us: now_us });
    }

    /// Sends a request that is in clear as it must be sent to `to`.
    pub fn send(&mut self, request: &[u8], to: SocketAddr, now_us: u64, mut send: impl FnMut(&[u8])) {
        let Ok((header, _)) = Header::open(request) else { return };
        let device = header.identity.module;
        let key = self.keys.key(device, self.role);
        if let Some((id, key)) = key
            && self.at.get(&to).is_none_or(|link| link.device != device && !link.channel.is_heard(now_us))
        {
            self.connect(to, device, Channel::new(device, id, key), now_us);
        }
        match self.at.get_mut(&to).filter(|link| device == ModuleId::ANY || link.device == device) {
            // Another device is there, or there are too many links. It is not spoken to in clear.
            None if key.is_some() => {}
            None => send(request),
            Some(link) => {
                link.used_us = now_us;
                link.send(request, now_us, self.nonces.fresh(), &mut send);
            }
        }
    }

    /// Takes a datagram that has come from `from`: it is opened in its place. What has to be sent for it is sent back.
    pub fn take(
        &mut self,
        bytes: &mut [u8],
        from: SocketAddr,
        now_us: u64,
        drops: &mut Drops,
        mut send: impl FnMut(&[u8]),
    ) -> Arrived {
        let Ok((header, _)) = Header::open(bytes) else { return Arrived::Clear };
        let device = header.identity.module;
        let link = self.at.get(&from);
        if link.is_none_or(|link| link.device != device) {
            let Some((id, key)) = self.keys.key(device, self.role) else { return Arrived::Clear };
            // A device with a key is met: from here on it is spoken to under its key. The sender of this learns nothing. Where
            // another device is heard, the datagram is not from there: no session ends for it.
            let is_held = link.is_some_and(|link| link.channel.is_heard(now_us));
            if is_held || (header.kind, header.key) != (COOKIE, 0) {
                drops.clear += 1;
                return Arrived::Dropped;
            }
            self.connect(from, device, Channel::new(device, id, key), now_us);
        }
        let Some(link) = self.at.get_mut(&from) else { return Arrived::Dropped };
        match link.channel.take(bytes, now_us) {
            Incoming::Message => return Arrived::Message,
            Incoming::Session => {
                let waiting = std::mem::take(&mut link.waiting);
                if !waiting.is_empty() {
                    link.send(&waiting, now_us, self.nonces.fresh(), &mut send);
                }
            }
            // Callers repeat what they ask; a session that is open goes on.
            Incoming::Full if !link.channel.is_open() => return Arrived::Full,
            Incoming::Full => {}
            Incoming::Refused => drops.key += 1,
            Incoming::Clear => drops.clear += 1,
            Incoming::Unsealed(Unsealed::Replayed) => drops.replayed += 1,
            Incoming::Unsealed(Unsealed::Forged | Unsealed::Session) => drops.forged += 1,
        }
        Arrived::Dropped
    }

    /// What a device says, and its alarm if it is not believed for want of a key.
    #[must_use]
    pub fn standing(&self, device: ModuleId) -> Standing {
        if self.keys.get(device).is_some() {
            Standing::Sealed
        } else if self.keys.is_empty() || self.clear == Clear::Believed {
            Standing::InClear
        } else {
            Standing::NotBelieved
        }
    }

    /// Whether what a device without a key says is to be used; if not, it is counted. It may not take the name of one that has a
    /// key, nor name a key itself, by which a [session](crate::session::Session) knows what was sealed; and where it is not
    /// believed only says who it is.
    pub fn believe(&self, datagram: &Datagram<'_>, drops: &mut Drops) -> bool {
        if datagram.header.key != 0 {
            drops.forged += 1;
            return false;
        }
        let is_usable = match (&datagram.message, self.standing(datagram.device())) {
            (Message::Info(info), _) => !self.keys.has_name(info.name),
            (_, Standing::Sealed | Standing::InClear) => true,
            (message, Standing::NotBelieved) => is_answer(message),
        };
        drops.clear += u64::from(!is_usable);
        is_usable
    }

    fn connect(&mut self, to: SocketAddr, device: ModuleId, channel: Channel, now_us: u64) {
        if self.at.len() >= LINKS {
            self.at.retain(|_, link| now_us.saturating_sub(link.used_us) < IDLE_US);
        }
        if self.at.len() < LINKS {
            self.at.insert(to, Link { device, channel, waiting: Vec::new(), used_us: now_us });
        }
    }
}

impl Link {
    fn send(&mut self, request: &[u8], now_us: u64, fresh: Nonce, send: &mut impl FnMut(&[u8])) {
        let mut bytes = [0; DATAGRAM_MAX];
        let length = request.len().min(DATAGRAM_MAX);
        bytes.iter_mut().zip(request).for_each(|(slot, byte)| *slot = *byte);
        let length = self.channel.seal(&mut bytes, length, fresh, now_us);
        if !self.channel.is_open() {
            self.waiting = request.to_vec();
        }
        send(bytes.get(..length).unwrap_or(&[]));
    }
}
