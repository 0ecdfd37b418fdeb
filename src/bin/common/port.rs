//! The module's UDP port over embassy-net: one socket that receives, one for each way out.
//!
//! ```text
//!   requests   receives everything                       first in the stack: the stack gives it every datagram
//!   answer 0   sends answers                             a datagram whose receiver answers no ARP
//!   answer 1   …                                         blocks its own socket and no other
//!   place 0    sends reports to the subscriber there
//!   place 1    …
//! ```

use core::future::{Future, poll_fn};
use core::net::SocketAddrV4;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embassy_net::udp::{PacketMetadata, UdpMetadata, UdpSocket};
use embassy_net::{IpAddress, Stack};
use kehai::device::PLACES;
use kehai::link::{ANSWER_LANES, Datagrams, Dropped, Lane, NetworkLosses, Outbox};
use kehai::wire::{DATAGRAM_MAX, HEADER_LEN, PORT, REQUEST_MAX};
use static_cell::ConstStaticCell;

use super::watched;

/// Datagrams to one host that wait in memory: a report, two parts and health, and one more.
const WAITING: usize = 5;
/// Bytes of them: two of the longest.
const WAITING_LEN: usize = 2 * DATAGRAM_MAX;
/// Requests that wait, and their bytes: every subscriber's and some of strangers, 68 bytes each, and two pieces of an image.
const REQUESTS: usize = 16;
const REQUESTS_LEN: usize = 16 * 68 + 2 * (HEADER_LEN + REQUEST_MAX);

/// Sending sockets: the lanes for answers come first.
const LANES: usize = ANSWER_LANES + PLACES;

/// Sockets of the port.
pub const PORT_SOCKETS: usize = 1 + LANES;

/// Apart from the bytes: those are zero at first and take no flash, as one static with these they would.
struct Metadata {
    received: [PacketMetadata; REQUESTS],
    /// The socket that receives sends nothing.
    no_waiting: [PacketMetadata; 1],
    /// Lanes receive nothing.
    nothing: [[PacketMetadata; 1]; LANES],
    waiting: [[PacketMetadata; WAITING]; LANES],
}

struct Bytes {
    received: [u8; REQUESTS_LEN],
    no_waiting: [u8; 1],
    nothing: [[u8; 1]; LANES],
    waiting: [[u8; WAITING_LEN]; LANES],
}

/// The port.
pub struct Port {
    stack: Stack<'static>,
    requests: UdpSocket<'static>,
    lanes: heapless::Vec<UdpSocket<'static>, LANES>,
    /// Datagrams received and datagrams lost: counted whenever none wait.
    received: u32,
    lost: u32,
}

impl Port {
    /// Opens the port. To be called once, before any other socket for it.
    pub fn open(stack: Stack<'static>) -> Self {
        static METADATA: ConstStaticCell<Metadata> = ConstStaticCell::new(Metadata {
            received: [PacketMetadata::EMPTY; _],
            no_waiting: [PacketMetadata::EMPTY; _],
            nothing: [[PacketMetadata::EMPTY; _]; _],
            waiting: [[PacketMetadata::EMPTY; _]; _],
        });
        static BYTES: ConstStaticCell<Bytes> = ConstStaticCell::new(Bytes {
            received: [0; _],
            no_waiting: [0; _],
            nothing: [[0; _]; _],
            waiting: [[0; _]; _],
        });
        let (metadata, bytes) = (METADATA.take(), BYTES.take());
        let mut requests = UdpSocket::new(
            stack,
            &mut metadata.received,
            &mut bytes.received,
            &mut metadata.no_waiting,
            &mut bytes.no_waiting,
        );
        bind(&mut requests);
        let mut lanes = heapless::Vec::new();
        let nothing = metadata.nothing.iter_mut().zip(&mut bytes.nothing);
        let waiting = metadata.waiting.iter_mut().zip(&mut bytes.waiting);
        for ((no_metadata, no_bytes), (metadata, bytes)) in nothing.zip(waiting) {
            let mut lane = UdpSocket::new(stack, no_metadata, no_bytes, metadata, bytes);
            bind(&mut lane);
            // As many as there are lanes.
            let _ = lanes.push(lane);
        }
        // Datagrams that came before the port was open do not count as lost.
        Self { stack, requests, lanes, received: watched::datagrams(), lost: 0 }
    }

    fn lane(&mut self, lane: Lane) -> Option<&mut UdpSocket<'static>> {
        let index = match lane {
            Lane::Answers(lane) => usize::from(lane),
            Lane::Place(place) => usize::from(place).saturating_add(ANSWER_LANES),
        };
        self.lanes.get_mut(index)
    }
}

/// Refused only for a socket that is open, or port 0.
fn bind(socket: &mut UdpSocket<'static>) {
    let _ = socket.bind(PORT);
}

impl Outbox for Port {
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        if !self.stack.is_link_up() || !self.stack.is_config_up() {
            // The stack would take it, and lose it.
            return Err(Dropped);
        }
        let socket = self.lane(lane).ok_or(Dropped)?;
        // This never waits: a datagram that cannot be queued now is dropped.
        let mut context = Context::from_waker(Waker::noop());
        let (address, port) = (IpAddress::Ipv4(*to.ip()), to.port());
        match socket.poll_send_to(datagram, (address, port), &mut context) {
            Poll::Ready(Ok(())) => Ok(()),
            Poll::Ready(Err(_)) | Poll::Pending => Err(Dropped),
        }
    }

    fn is_empty(&mut self, lane: Lane) -> bool {
        let mut context = Context::from_waker(Waker::noop());
        self.lane(lane).is_none_or(|socket| pin!(socket.flush()).poll(&mut context).is_ready())
    }

    fn reopen(&mut self, lane: Lane) {
        if let Some(socket) = self.lane(lane) {
            socket.close();
            bind(socket);
        }
    }
}

impl Datagrams for Port {
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4) {
        // Waits first: a datagram read from the socket is handed on at once.
        poll_fn(|context| self.requests.poll_recv_ready(context)).await;
        self.received = self.received.wrapping_add(1);
        let copy = |datagram: &[u8], from: UdpMetadata| {
            let length = datagram.len().min(buffer.len());
            buffer.iter_mut().zip(datagram).for_each(|(place, &byte)| *place = byte);
            let IpAddress::Ipv4(address) = from.endpoint.addr;
            (length, SocketAddrV4::new(address, from.endpoint.port))
        };
        self.requests.recv_from_with(copy).await
    }

    fn losses(&mut self) -> NetworkLosses {
        if !self.requests.may_recv() {
            self.lost = watched::datagrams().wrapping_sub(self.received);
        }
        NetworkLosses { links: watched::link_losses(), datagrams: self.lost }
    }
}
