//! Live modules over UDP: one socket for all of them, and the conversation with each.
//!
//! ```text
//!   socket ─▶ whose? ─▶ conversation ─▶ subscribe, info, profile ─▶ socket
//!                  └──▶ follower ─▶ a line of tracks every 0.1 s
//! ```

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use kehai::wire::ModuleId;

use crate::conversation::Conversation;
use crate::follower::Follower;
use crate::jsonl::TracksLine;
use crate::site::Site;

/// Between two lines of tracks.
pub const LINE_US: u64 = 100_000;

/// Longest wait for a datagram: a tenth of a line's time.
const WAIT: Duration = Duration::from_millis(10);

/// Longer than any datagram of a module, so that a longer one is seen to be.
const BUFFER: usize = 2048;

/// Follows live modules.
pub struct Live {
    socket: UdpSocket,
    modules: BTreeMap<SocketAddr, Conversation>,
    follower: Follower,
    begun: Instant,
    next_line_us: u64,
    /// Datagrams from addresses that are no module of ours.
    strangers: u64,
}

impl Live {
    /// A socket for [`with`](Self::with).
    ///
    /// # Errors
    /// None can be had.
    pub fn bind() -> io::Result<UdpSocket> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        socket.set_read_timeout(Some(WAIT))?;
        Ok(socket)
    }

    /// Listens to the modules at `addresses`, over a socket of [`bind`](Self::bind).
    #[must_use]
    pub fn with(socket: UdpSocket, addresses: &[SocketAddr], follower: Follower) -> Self {
        let begin = |&address| (address, Conversation::new(ModuleId::ANY));
        let modules = addresses.iter().map(begin).collect();
        Self { socket, modules, follower, begun: Instant::now(), next_line_us: LINE_US, strangers: 0 }
    }

    /// Listens to the modules at `addresses`.
    ///
    /// # Errors
    /// No socket can be had.
    pub fn new(addresses: &[SocketAddr], follower: Follower) -> io::Result<Self> {
        Ok(Self::with(Self::bind()?, addresses, follower))
    }

    /// Goes on with another site.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.follower.change_site(site);
    }

    /// µs since it began: the clock of all that follows.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        u64::try_from(self.begun.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// Sends what is due and takes what arrives, until the next line of tracks is.
    ///
    /// # Errors
    /// The socket fails for good.
    pub fn line(&mut self) -> io::Result<TracksLine> {
        let mut buffer = [0; BUFFER];
        loop {
            let now_us = self.now_us();
            if now_us >= self.next_line_us {
                let at_us = self.next_line_us;
                // After a stall the lines missed are left out.
                self.next_line_us = (now_us / LINE_US + 1) * LINE_US;
                return Ok(self.follower.line(at_us as f64 * 1e-6));
            }
            for (address, conversation) in &mut self.modules {
                conversation.poll(now_us, |datagram| send(&self.socket, datagram, *address));
            }
            let (len, from) = match self.socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if is_passing(&error) => continue,
                Err(error) => return Err(error),
            };
            let Some(datagram) = buffer.get(..len) else { continue };
            let now_us = self.now_us();
            let Some(conversation) = self.modules.get_mut(&from) else {
                self.strangers += 1;
                continue;
            };
            self.follower.receive(datagram, now_us);
            conversation.receive(now_us, datagram, |datagram| send(&self.socket, datagram, from));
        }
    }

    /// The follower.
    #[must_use]
    pub const fn follower(&self) -> &Follower {
        &self.follower
    }

    /// Datagrams from addresses that are no module of ours.
    #[must_use]
    pub const fn strangers(&self) -> u64 {
        self.strangers
    }
}

/// What cannot be sent now is due again in a second.
fn send(socket: &UdpSocket, datagram: &[u8], to: SocketAddr) {
    let _ = socket.send_to(datagram, to);
}

/// Nothing came in time, or a module's host said that nobody listens there yet.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock
            | io::ErrorKind::TimedOut
            | io::ErrorKind::Interrupted
            | io::ErrorKind::ConnectionRefused
            | io::ErrorKind::ConnectionReset
    )
}
