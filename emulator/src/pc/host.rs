//! A host of one module, on the time of its way to it: it subscribes, renews, and keeps every report. For tests.
//!
//! ```text
//!   turn:  subscribe, if it is time to ─▶ take one datagram ─▶ keep reports and health ─▶ look at it
//! ```

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use kehai::wire::{Cookie, Counters, HEADER_LEN, HealthHead, Identity, Message, ReportHead, Request};

/// Longest wait for anything, on the time of the way: a hundred times what it needs.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Between two subscriptions, µs.
const RENEWAL_US: u64 = 500_000;

/// Wait for a datagram.
const WAIT: Duration = Duration::from_millis(20);

/// Bytes of a report in front of its candidates.
const REPORT_HEAD_LEN: usize = HEADER_LEN + 32;

/// The way to the module.
pub trait Way {
    /// What is not sent is lost.
    fn send(&self, datagram: &[u8]);
    /// The next datagram, if one comes soon.
    fn receive(&self, buffer: &mut [u8]) -> Option<usize>;
    /// The time at its end, µs.
    fn now_us(&self) -> u64;
}

impl Way for UdpSocket {
    fn send(&self, datagram: &[u8]) {
        // Refused while the port is not there yet.
        let _ = Self::send(self, datagram);
    }

    fn receive(&self, buffer: &mut [u8]) -> Option<usize> {
        self.recv(buffer).ok()
    }

    fn now_us(&self) -> u64 {
        static BEGIN: OnceLock<Instant> = OnceLock::new();
        u64::try_from(BEGIN.get_or_init(Instant::now).elapsed().as_micros()).unwrap_or(u64::MAX)
    }
}

/// A report as it came.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Seen {
    /// Number of the module's start.
    pub boot: u32,
    /// Everything in front of the candidates.
    pub head: ReportHead,
    /// Candidates and unseen spans, as on the wire.
    pub found: Vec<u8>,
}

impl Seen {
    /// What `datagram` reports, if it is a report.
    #[must_use]
    pub fn of(datagram: &[u8]) -> Option<Self> {
        let (header, Message::Report(report)) = Message::decode(datagram).ok()? else { return None };
        let found = datagram.get(REPORT_HEAD_LEN..)?.to_vec();
        Some(Self { boot: header.identity.boot, head: report.head, found })
    }
}

/// The newest health.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    /// States and alarms.
    pub head: HealthHead,
    /// All counters.
    pub counters: Counters,
}

/// The host.
pub struct Host<W: Way = UdpSocket> {
    /// To the module.
    pub way: W,
    /// The module's identity, once it has answered.
    pub identity: Identity,
    /// What the module has given us to show.
    pub cookie: Cookie,
    /// All reports so far.
    pub reports: Vec<Seen>,
    /// The newest health so far.
    pub health: Option<Condition>,
    renewed_us: Option<u64>,
    request_id: u32,
}

impl Host {
    /// A host, on a socket of its own, of the module at `module`.
    ///
    /// # Errors
    /// No socket is to be had.
    pub fn new(module: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        socket.connect(module)?;
        socket.set_read_timeout(Some(WAIT))?;
        Ok(Self::at(socket))
    }
}

impl<W: Way> Host<W> {
    /// A host of the module at the end of `way`.
    pub fn at(way: W) -> Self {
        let (identity, cookie) = (Identity::default(), Cookie::NONE);
        Self { way, identity, cookie, reports: Vec::new(), health: None, renewed_us: None, request_id: 0 }
    }

    /// Sends a request.
    ///
    /// # Panics
    /// It is longer than a datagram.
    pub fn ask(&mut self, request: Request<'_>) {
        self.request_id += 1;
        let mut datagram = [0; 1400];
        let length = request
            .encode(self.identity, self.request_id, self.cookie, &mut datagram)
            .expect("the request fits a datagram");
        self.way.send(&datagram[..length]);
    }

    /// Subscribes if it is time to, and takes one datagram, if there is one.
    ///
    /// # Panics
    /// What the module sends is no message.
    pub fn turn<T>(&mut self, look: impl FnOnce(&mut Self, &Message<'_>) -> Option<T>) -> Option<T> {
        let now_us = self.way.now_us();
        if self.renewed_us.is_none_or(|renewed_us| now_us - renewed_us > RENEWAL_US) {
            self.ask(Request::Subscribe { t1: [0; 8] });
            self.renewed_us = Some(now_us);
        }
        let mut buffer = [0; 2000];
        let length = self.way.receive(&mut buffer)?;
        let datagram = &buffer[..length];
        let (header, message) = Message::decode(datagram).expect("a message of the module");
        if header.identity != self.identity {
            // It has started anew; so do we.
            (self.identity, self.cookie) = (header.identity, Cookie::NONE);
        }
        match &message {
            Message::Cookie { cookie, .. } => (self.cookie, self.renewed_us) = (*cookie, None),
            Message::Report(_) => self.reports.extend(Seen::of(datagram)),
            Message::Health(health) => {
                self.health = Some(Condition { head: health.head, counters: health.counters });
            }
            _ => {}
        }
        look(self, &message)
    }

    /// Until `found` finds something.
    ///
    /// # Panics
    /// It does not, for as long as [`PATIENCE`].
    #[track_caller]
    pub fn look<T>(&mut self, mut found: impl FnMut(&mut Self, &Message<'_>) -> Option<T>) -> T {
        let begin_us = self.way.now_us();
        while u128::from(self.way.now_us() - begin_us) < PATIENCE.as_micros() {
            if let Some(found) = self.turn(&mut found) {
                return found;
            }
        }
        panic!("nothing of the kind; last health: {:?}", self.health);
    }

    /// Until it is subscribed.
    ///
    /// # Panics
    /// It is not, for as long as [`PATIENCE`].
    #[track_caller]
    pub fn subscribe(&mut self) {
        self.look(|_, message| matches!(message, Message::Subscribed(_)).then_some(()));
    }

    /// `count` more reports, the first of which is returned.
    ///
    /// # Panics
    /// They do not come within [`PATIENCE`].
    #[track_caller]
    pub fn more(&mut self, count: usize) -> Seen {
        let before = self.reports.len();
        self.look(|host, _| {
            (host.reports.len() >= before + count).then(|| host.reports.get(before).cloned())?
        })
    }

    /// Health of which `wanted` is true.
    ///
    /// # Panics
    /// None comes within [`PATIENCE`].
    #[track_caller]
    pub fn health(&mut self, wanted: impl Fn(&Condition) -> bool) -> Condition {
        self.look(|host, message| {
            host.health.filter(|health| matches!(message, Message::Health(_)) && wanted(health))
        })
    }
}
