//! One request after the other to one module, for commands: asked again until it is answered or refused.
//!
//! ```text
//!   connect   subscribe, no cookie ─▶ cookie           nothing is taken: no place among the subscribers
//!   ask       request ─▶ answer │ refusal │ nothing: the same request again, up to two seconds
//!   stay      subscribe, every second                  for requests that control, health and raw scans
//! ```
//!
//! With the keys of a site it speaks sealed to modules that have one.
//!
//! It blocks, and takes no place among the subscribers unless it controls. The tracker has a
//! [`Session`](kehai_tracking::session::Session) instead.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use kehai::seal::{Channel, Key, LABEL_ID, Role};
use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Message, Refusal, Request, Unreadable};
use kehai_tracking::keys::{Arrived, Clear, Keys, Links};
use kehai_tracking::snapshot::Drops;

use crate::key_file;

/// Wait for an answer before the request is sent again.
const AGAIN: Duration = Duration::from_millis(400);

/// How often a request is sent.
const TRIES: u32 = 5;

/// Wait before a busy module is asked again: it stores something for about a second; or its places for subscribers are
/// those of commands that have ended, free again after five.
const BUSY: Duration = Duration::from_millis(500);

/// How often a busy module is asked.
const BUSY_TRIES: u32 = 20;

/// Between two subscriptions.
const RENEWAL: Duration = Duration::from_secs(1);

/// A module that sends nothing for so long while subscribed is gone.
const GONE: Duration = Duration::from_secs(5);

/// Why a module did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No answer.
    #[error("no module answers at {0}: is it switched on, and is the address right?")]
    Silent(SocketAddr),
    /// It said no.
    #[error("refused: {0}")]
    Refused(Refusal),
    /// It speaks another version of the protocol.
    #[error("the module at {0} speaks version {1} of the protocol: use a kehai-tracker of its age")]
    Version(SocketAddr, u8),
    /// No socket.
    #[error("no way to {0}: {1}")]
    Io(SocketAddr, io::Error),
}

/// What a message leads to while a module is watched.
#[derive(Debug)]
pub enum Reaction<T> {
    /// Ask this, once: the answer is a message as any other.
    Ask(Request<'static>),
    /// It has been found.
    Done(T),
}

/// A host that talks to one module.
#[derive(Debug)]
pub struct Client {
    socket: UdpSocket,
    address: SocketAddr,
    identity: Identity,
    cookie: Cookie,
    next_id: u32,
    renewed: Option<Instant>,
    links: Links,
    drops: Drops,
    begun: Instant,
}

impl Client {
    /// Meets the module at `address`.
    ///
    /// # Errors
    /// [`ClientError`]: nothing answers there.
    pub fn connect(address: SocketAddr) -> Result<Self, ClientError> {
        Self::with_keys(address, Arc::new(Keys::none()))
    }

    /// The same with the keys of a site.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn with_keys(address: SocketAddr, keys: Arc<Keys>) -> Result<Self, ClientError> {
        let error = |error| ClientError::Io(address, error);
        let socket = UdpSocket::bind("0.0.0.0:0").map_err(error)?;
        socket.connect(address).map_err(error)?;
        // Requests of another run from the same port are not these.
        let next_id = std::process::id().wrapping_mul(1 << 12) | 1;
        let (identity, cookie) = (Identity::default(), Cookie::NONE);
        let nonces = key_file::nonces().map_err(|no| error(io::Error::other(no)))?;
        let links = Links::new(keys, Role::Control, nonces, Clear::Believed);
        let (renewed, drops, begun) = (None, Drops::default(), Instant::now());
        let mut client = Self { socket, address, identity, cookie, next_id, renewed, links, drops, begun };
        (client.identity, client.cookie) =
            client.ask(Request::Subscribe { t1: [0; 8] }, |identity, message| match message {
                Message::Cookie { cookie, .. } => Some((identity, *cookie)),
                _ => None,
            })?;
        Ok(client)
    }

    /// Speaks from now on by the key of the module's label.
    pub fn open_by_label(&mut self, label: &Key) {
        let device = self.identity.module;
        let now_us = self.now_us();
        self.links.open_by(self.address, Channel::new(device, LABEL_ID, *label), device, now_us);
    }

    fn now_us(&self) -> u64 {
        u64::try_from(self.begun.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// Which device it is.
    #[must_use]
    pub const fn identity(&self) -> Identity {
        self.identity
    }

    /// Where it is.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Drops what has come since the last question: reports of then say nothing of now.
    ///
    /// # Errors
    /// [`ClientError::Io`].
    pub fn skip_what_has_come(&mut self) -> Result<(), ClientError> {
        let error = |error| ClientError::Io(self.address, error);
        self.socket.set_nonblocking(true).map_err(error)?;
        while self.socket.recv(&mut [0; 2048]).is_ok() {}
        self.socket.set_nonblocking(false).map_err(error)
    }

    /// Asks until `wanted` finds what it wants in an answer; it is shown answers to this request only.
    ///
    /// # Errors
    /// [`ClientError`]: it is refused, or not answered.
    pub fn ask<T>(
        &mut self,
        request: Request<'_>,
        mut wanted: impl FnMut(Identity, &Message<'_>) -> Option<T>,
    ) -> Result<T, ClientError> {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let (mut tries, mut busy) = (0, 0);
        while tries < TRIES {
            tries += 1;
            self.send(request, id);
            let end = Instant::now() + AGAIN;
            let answer = self.next_before(end, |identity, message| match message {
                Message::Refused(refused) if refused.request_id == id => {
                    Some(Err(ClientError::Refused(refused.refusal)))
                }
                message if answers(message) == Some(id) => wanted(identity, message).map(Ok),
                _ => None,
            });
            let answer = match answer {
                Err(error @ ClientError::Refused(_)) => Some(Err(error)),
                answer => answer?,
            };
            match answer {
                None => {}
                Some(Err(ClientError::Refused(Refusal::Busy | Refusal::Full))) if busy < BUSY_TRIES => {
                    (busy, tries) = (busy + 1, 0);
                    std::thread::sleep(BUSY);
                }
                Some(answer) => return answer,
            }
        }
        Err(ClientError::Silent(self.address))
    }

    /// Takes a place among the subscribers, or keeps it: whether this host may control the module.
    ///
    /// # Errors
    /// [`ClientError`]: all places are taken, or it does not answer.
    pub fn subscribe(&mut self) -> Result<bool, ClientError> {
        let may_control = self.ask(Request::Subscribe { t1: [0; 8] }, |_, message| match message {
            Message::Subscribed(subscribed) => Some(subscribed.may_control),
            _ => None,
        })?;
        self.renewed = Some(Instant::now());
        Ok(may_control)
    }

    /// Stays subscribed and shows `look` everything that comes, until it is [done](Reaction::Done) or `end`.
    ///
    /// # Errors
    /// [`ClientError`]: nothing comes any more.
    pub fn watch<T>(
        &mut self,
        end: Option<Instant>,
        mut look: impl FnMut(&Message<'_>) -> Option<Reaction<T>>,
    ) -> Result<Option<T>, ClientError> {
        let mut heard = Instant::now();
        while end.is_none_or(|end| Instant::now() < end) {
            if self.renewed.is_none_or(|renewed| renewed.elapsed() >= RENEWAL) {
                self.renewed = Some(Instant::now());
                self.send_once(Request::Subscribe { t1: [0; 8] });
            }
            let wait = Instant::now() + Duration::from_millis(100);
            let mut came = false;
            let found = self.next_before(wait.min(end.unwrap_or(wait)), |_, message| {
                came = true;
                look(message).map(Some).or(Some(None))
            })?;
            match found.flatten() {
                Some(Reaction::Done(found)) => return Ok(Some(found)),
                Some(Reaction::Ask(request)) => self.send_once(request),
                None => {}
            }
            if came {
                heard = Instant::now();
            } else if heard.elapsed() > GONE {
                return Err(ClientError::Silent(self.address));
            }
        }
        Ok(None)
    }

    fn send_once(&mut self, request: Request<'_>) {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        self.send(request, id);
    }

    fn send(&mut self, request: Request<'_>, id: u32) {
        let mut datagram = [0; DATAGRAM_MAX];
        let length = request.encode(self.identity, id, self.cookie, &mut datagram).unwrap_or(0);
        // Refused while the port is not open; what is not sent is sent again.
        let now_us = self.now_us();
        let socket = &self.socket;
        let send = |bytes: &[u8]| drop(socket.send(bytes));
        self.links.send(datagram.get(..length).unwrap_or(&[]), self.address, now_us, send);
    }

    /// What `look` finds in a message of the module that comes before `end`.
    fn next_before<T>(
        &mut self,
        end: Instant,
        mut look: impl FnMut(Identity, &Message<'_>) -> Option<T>,
    ) -> Result<Option<T>, ClientError> {
        let mut buffer = [0; 2048];
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.socket.set_read_timeout(Some(left)).map_err(|error| ClientError::Io(self.address, error))?;
            let Ok(length) = self.socket.recv(&mut buffer) else {
                // The port is not open yet, or the time is over.
                std::thread::sleep(Duration::from_millis(2));
                continue;
            };
            let now_us = self.now_us();
            let (socket, received) = (&self.socket, buffer.get_mut(..length).unwrap_or(&mut []));
            let send = |bytes: &[u8]| drop(socket.send(bytes));
            let arrived = self.links.take(received, self.address, now_us, &mut self.drops, send);
            if arrived == Arrived::Full {
                return Err(ClientError::Refused(Refusal::Full));
            }
            if arrived == Arrived::Dropped {
                if self.drops.key > 0 {
                    return Err(ClientError::Refused(Refusal::NoSuchKey));
                }
                continue;
            }
            match Message::decode(received) {
                Ok((header, message)) => {
                    let known = self.cookie != Cookie::NONE;
                    if (!known || header.identity == self.identity)
                        && let Some(found) = look(header.identity, &message)
                    {
                        return Ok(Some(found));
                    }
                }
                Err(Unreadable::Version(version)) => return Err(ClientError::Version(self.address, version)),
                Err(_) => {}
            }
        }
    }
}

/// The request a message answers.
const fn answers(message: &Message<'_>) -> Option<u32> {
    match message {
        Message::Cookie { request_id, .. }
        | Message::Done { request_id }
        | Message::Settings { request_id, .. }
        | Message::Absorbed { request_id, .. }
        | Message::Receiving { request_id, .. } => Some(*request_id),
        Message::Subscribed(subscribed) => Some(subscribed.request_id),
        Message::Info(info) => Some(info.request_id),
        Message::Refused(refused) => Some(refused.request_id),
        Message::Report(_)
        | Message::Health(_)
        | Message::ProfilePart(_)
        | Message::RawPart(_)
        | Message::Pressed(_) => None,
    }
}
