//! The module's UDP port over embassy-net: one socket for requests and answers, one for each subscriber.
//!
//! ```text
//!   answers   receives everything, answers it           first in the stack: the stack gives it every datagram
//!   place 0   sends reports to the subscriber there     a datagram whose receiver answers no ARP
//!   place 1   …                                         blocks its own socket and no other
//! ```

use core::future::poll_fn;
use core::net::SocketAddrV4;
use core::task::{Context, Poll, Waker};

use embassy_net::udp::{PacketMetadata, UdpMetadata, UdpSocket};
use embassy_net::{IpAddress, Stack};
use kehai::link::{Datagrams, Dropped, Lane, Outbox};
use kehai::module::PLACES;
use kehai::wire::{DATAGRAM_MAX, PORT};
use static_cell::ConstStaticCell;

/// Datagrams to one host that wait in memory: a report, two parts and health, and one more.
const WAITING: usize = 5;
/// Bytes of them: two of the longest.
const WAITING_LEN: usize = 2 * DATAGRAM_MAX;
/// Requests that wait, and their bytes: every subscriber's and some of strangers.
const REQUESTS: usize = 16;
const REQUESTS_LEN: usize = 4096;

struct Memory {
    received_metadata: [PacketMetadata; REQUESTS],
    received: [u8; REQUESTS_LEN],
    /// Places receive nothing.
    nothing_metadata: [[PacketMetadata; 1]; PLACES],
    nothing: [[u8; 1]; PLACES],
    waiting_metadata: [[PacketMetadata; WAITING]; PLACES + 1],
    waiting: [[u8; WAITING_LEN]; PLACES + 1],
}

/// The port.
pub struct Port {
    answers: UdpSocket<'static>,
    places: heapless::Vec<UdpSocket<'static>, PLACES>,
}

impl Port {
    /// Opens the port. To be called once, before any other socket for it.
    pub fn open(stack: Stack<'static>) -> Self {
        static MEMORY: ConstStaticCell<Memory> = ConstStaticCell::new(Memory {
            received_metadata: [PacketMetadata::EMPTY; _],
            received: [0; _],
            nothing_metadata: [[PacketMetadata::EMPTY; _]; _],
            nothing: [[0; _]; _],
            waiting_metadata: [[PacketMetadata::EMPTY; _]; _],
            waiting: [[0; _]; _],
        });
        let memory = MEMORY.take();
        let mut to_send = memory.waiting_metadata.iter_mut().zip(&mut memory.waiting);
        let (metadata, bytes) = to_send.next().expect("one more than places");
        let answers =
            UdpSocket::new(stack, &mut memory.received_metadata, &mut memory.received, metadata, bytes);
        let mut port = Self { answers, places: heapless::Vec::new() };
        let nothing = memory.nothing_metadata.iter_mut().zip(&mut memory.nothing);
        for ((no_metadata, no_bytes), (metadata, bytes)) in nothing.zip(to_send) {
            // As many as there are places.
            let _ = port.places.push(UdpSocket::new(stack, no_metadata, no_bytes, metadata, bytes));
        }
        bind(&mut port.answers);
        port.places.iter_mut().for_each(bind);
        port
    }

    fn lane(&mut self, lane: Lane) -> Option<&mut UdpSocket<'static>> {
        match lane {
            Lane::Answers => Some(&mut self.answers),
            Lane::Place(place) => self.places.get_mut(usize::from(place)),
        }
    }
}

/// Refused only for a socket that is open, or port 0.
fn bind(socket: &mut UdpSocket<'static>) {
    let _ = socket.bind(PORT);
}

impl Outbox for Port {
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        let socket = self.lane(lane).ok_or(Dropped)?;
        // Nobody waits: what is not queued now is dropped.
        let mut context = Context::from_waker(Waker::noop());
        let (address, port) = (IpAddress::Ipv4(*to.ip()), to.port());
        match socket.poll_send_to(datagram, (address, port), &mut context) {
            Poll::Ready(Ok(())) => Ok(()),
            Poll::Ready(Err(_)) | Poll::Pending => Err(Dropped),
        }
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
        // Waits first: what is taken from the socket is handed on at once.
        poll_fn(|context| self.answers.poll_recv_ready(context)).await;
        let copy = |datagram: &[u8], from: UdpMetadata| {
            let length = datagram.len().min(buffer.len());
            buffer.iter_mut().zip(datagram).for_each(|(place, &byte)| *place = byte);
            let IpAddress::Ipv4(address) = from.endpoint.addr;
            (length, SocketAddrV4::new(address, from.endpoint.port))
        };
        self.answers.recv_from_with(copy).await
    }
}
