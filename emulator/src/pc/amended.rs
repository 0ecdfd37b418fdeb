//! Datagrams to which something is added on their way out: what only the source of a sensor's ranges knows.
//!
//! ```text
//!   firmware's tasks ─▶ report ─▶ Amend ─▶ the same report and more ─▶ the port
//! ```

use std::net::SocketAddrV4;
use std::sync::Arc;

use kehai::link::{Datagrams, Dropped, Lane, NetworkLosses, Outbox};
use kehai::wire::DATAGRAM_MAX;

/// Adds to datagrams.
pub trait Amend: Send + Sync {
    /// Writes what is sent instead of `datagram` to `room`, and says how long it is; None: it is sent as it is.
    fn amend(&self, datagram: &[u8], room: &mut [u8; DATAGRAM_MAX]) -> Option<usize>;
}

/// A port whose datagrams are amended, if there is anything to amend them by.
pub struct Amended<D> {
    port: D,
    by: Option<Arc<dyn Amend>>,
}

impl<D> Amended<D> {
    /// All datagrams that leave by `port`.
    #[must_use]
    pub const fn new(port: D, by: Option<Arc<dyn Amend>>) -> Self {
        Self { port, by }
    }
}

impl<D: Outbox> Outbox for Amended<D> {
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        let mut room = [0; DATAGRAM_MAX];
        let amended = self.by.as_ref().and_then(|by| by.amend(datagram, &mut room));
        let sent = amended.and_then(|length| room.get(..length)).unwrap_or(datagram);
        self.port.try_send_to(lane, to, sent)
    }

    fn is_empty(&mut self, lane: Lane) -> bool {
        self.port.is_empty(lane)
    }

    fn reopen(&mut self, lane: Lane) {
        self.port.reopen(lane);
    }
}

impl<D: Datagrams> Datagrams for Amended<D> {
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4) {
        self.port.receive_from(buffer).await
    }

    fn losses(&mut self) -> NetworkLosses {
        self.port.losses()
    }
}
