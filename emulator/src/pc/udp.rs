//! The module's port as a UDP socket of the PC. Its queues are the system's; all lanes share them.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::AsFd;
use std::rc::Rc;
use std::task::Poll;

use kehai::link::{Datagrams, Dropped, Lane, Outbox};
use rustix::event::PollFlags;

use super::reactor::Reactor;

/// Failures in a row, each the answer to an earlier datagram, before the next sleep.
const TRIES: usize = 64;

/// A port.
pub struct Udp {
    socket: Rc<UdpSocket>,
    reactor: Reactor,
}

impl Udp {
    /// Listens at `address`.
    ///
    /// # Errors
    /// The address cannot be had.
    pub fn bind(address: SocketAddrV4, reactor: &Reactor) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket: Rc::new(socket), reactor: reactor.clone() })
    }

    /// The same port, for another start of the module.
    #[must_use]
    pub fn again(&self, reactor: &Reactor) -> Self {
        Self { socket: Rc::clone(&self.socket), reactor: reactor.clone() }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system does not say.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }
}

impl Outbox for Udp {
    fn try_send_to(&mut self, _: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        match self.socket.send_to(datagram, to) {
            // The answer to an earlier datagram: its port was closed. This datagram is sent all the same.
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
                self.socket.send_to(datagram, to).map(|_| ()).map_err(|_| Dropped)
            }
            result => result.map(|_| ()).map_err(|_| Dropped),
        }
    }

    /// The system's queues are not seen.
    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

impl Datagrams for Udp {
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4) {
        std::future::poll_fn(|_| {
            for _ in 0..TRIES {
                match self.socket.recv_from(buffer) {
                    Ok((length, SocketAddr::V4(from))) => return Poll::Ready((length, from)),
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    // Not IPv4, or the answer to an earlier datagram.
                    Ok(_) | Err(_) => {}
                }
            }
            let socket: Rc<dyn AsFd> = self.socket.clone();
            self.reactor.wait_for(socket, PollFlags::IN);
            Poll::Pending
        })
        .await
    }
}
