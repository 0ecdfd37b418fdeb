//! A second way to a module, by another address of this machine: a module has two places for one address, and three trackers ask it.
//!
//! ```text
//!   tracker ─▶ 127.0.0.2 ┄┄ 127.0.0.2 ─▶ module at 127.0.0.1
//! ```

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Another address of this machine than that of everything else.
const OTHER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 2);

/// Room for any datagram.
const DATAGRAM: usize = 2048;

/// So often a way looks whether it is to end.
const LOOKS: Duration = Duration::from_millis(200);

/// Passes datagrams between one host and a module, both ways. It ends when it is dropped.
pub(super) struct Relay {
    at: SocketAddr,
    ends: Arc<AtomicBool>,
    ways: Vec<JoinHandle<()>>,
}

impl Relay {
    /// To the module at an address.
    ///
    /// # Errors
    /// This machine has no such address, or no port.
    pub(super) fn to(module: SocketAddr) -> io::Result<Self> {
        let [near, far] = [UdpSocket::bind((OTHER, 0))?, UdpSocket::bind((OTHER, 0))?];
        far.connect(module)?;
        near.set_read_timeout(Some(LOOKS))?;
        far.set_read_timeout(Some(LOOKS))?;
        let at = near.local_addr()?;
        let ends = Arc::new(AtomicBool::new(false));
        let (back, answers) = (near.try_clone()?, far.try_clone()?);
        let (first, second) = (Arc::clone(&ends), Arc::clone(&ends));
        let (asks, asked) = std::sync::mpsc::channel();
        let out = move || {
            pass(&first, |buffer| {
                let (length, host) = near.recv_from(buffer)?;
                let _ = asks.send(host);
                far.send(buffer.get(..length).unwrap_or_default())
            });
        };
        let home = move || {
            let mut host = None;
            pass(&second, |buffer| {
                let length = answers.recv(buffer)?;
                host = asked.try_iter().last().or(host);
                host.map_or(Ok(0), |host| back.send_to(buffer.get(..length).unwrap_or_default(), host))
            });
        };
        Ok(Self { at, ends, ways: vec![thread::spawn(out), thread::spawn(home)] })
    }

    /// Where the host finds the module.
    pub(super) const fn at(&self) -> SocketAddr {
        self.at
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        for way in self.ways.drain(..) {
            let _ = way.join();
        }
    }
}

/// Passes one datagram after another until it is to end, or a socket is of no use any more.
fn pass(ends: &AtomicBool, mut one: impl FnMut(&mut [u8]) -> io::Result<usize>) {
    let mut buffer = [0; DATAGRAM];
    while !ends.load(Ordering::Relaxed) {
        match one(&mut buffer) {
            Ok(_) => {}
            // Nothing came, or no socket listens there at the moment.
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::ConnectionRefused
                ) => {}
            Err(_) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_and_answered_passes_by_another_address() {
        let [host, module] = [0; 2].map(|_| UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap());
        let relay = Relay::to(module.local_addr().unwrap()).unwrap();
        host.send_to(b"who are you", relay.at()).unwrap();
        let mut buffer = [0; 64];
        let (length, from) = module.recv_from(&mut buffer).unwrap();
        assert_eq!((&buffer[..length], from.ip()), (&b"who are you"[..], OTHER.into()));
        module.send_to(b"a module", from).unwrap();
        let (length, from) = host.recv_from(&mut buffer).unwrap();
        assert_eq!((&buffer[..length], from), (&b"a module"[..], relay.at()));
    }
}
