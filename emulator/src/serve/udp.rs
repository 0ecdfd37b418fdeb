//! An emulated sensor in datagrams, as QEMU's serial lines speak them, on the time of the program it speaks to.
//!
//! ```text
//! QEMU ── a datagram a byte ──▶ socket ─▶ sensor ◀─ with(…) the test
//!      ◀── 1024 bytes at most ──   └ to the address that spoke last
//! ```
//!
//! It has no clock: [`UdpSensor::advance`] lets its time pass, takes what has come and sends what is due.

use std::cell::{Cell, RefCell};
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::rc::Rc;

use crate::uart;
use crate::urg::Urg;

/// Bytes of a datagram; QEMU cuts what is longer than 4096.
const DATAGRAM_BYTES: usize = 1024;

/// A sensor and its socket. Clones are the same sensor.
#[derive(Clone)]
pub struct UdpSensor(Rc<Shared>);

struct Shared {
    socket: UdpSocket,
    port: u16,
    sensor: RefCell<Urg>,
    now_us: Cell<u64>,
    client: Cell<Option<SocketAddr>>,
}

impl UdpSensor {
    /// `sensor` on a free port of this machine. Its time is 0.
    ///
    /// # Errors
    /// No socket is to be had.
    pub fn new(sensor: Urg) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.set_nonblocking(true)?;
        let port = socket.local_addr()?.port();
        let sensor = RefCell::new(sensor);
        Ok(Self(Rc::new(Shared { socket, port, sensor, now_us: Cell::new(0), client: Cell::new(None) })))
    }

    /// UDP port to speak to it at.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.0.port
    }

    /// Looks at the sensor, or does something to it, now: the time is the sensor's, µs.
    pub fn with<T>(&self, act: impl FnOnce(&mut Urg, u64) -> T) -> T {
        act(&mut self.0.sensor.borrow_mut(), self.0.now_us.get())
    }

    /// Lets `by_us` pass: the sensor receives what has come and sends what is due by then. With a speed of the
    /// client's end of the line, both ends hear garbage where their speeds differ.
    pub fn advance(&self, by_us: u64, client_baud: Option<u32>) {
        let now_us = self.0.now_us.get() + by_us;
        self.0.now_us.set(now_us);
        let mut sensor = self.0.sensor.borrow_mut();
        let mut received = Vec::new();
        let mut datagram = [0; DATAGRAM_BYTES];
        // An error says that nothing has come, or that the client is gone.
        while let Ok((count, from)) = self.0.socket.recv_from(&mut datagram) {
            self.0.client.set(Some(from));
            received.extend_from_slice(datagram.get(..count).unwrap_or_default());
        }
        if let Some(sent_baud) = client_baud.filter(|_| sensor.paced()) {
            received = uart::received(&received, sent_baud, sensor.baud());
        }
        sensor.receive(&received, now_us);
        for sent in sensor.take_output(now_us) {
            let bytes = match (sent.baud, client_baud) {
                (Some(sent_baud), Some(heard_baud)) => uart::received(&sent.bytes, sent_baud, heard_baud),
                _ => sent.bytes,
            };
            let Some(client) = self.0.client.get() else { continue };
            for datagram in bytes.chunks(DATAGRAM_BYTES) {
                // To a client that is not there any more it is lost, as on a line.
                let _ = self.0.socket.send_to(datagram, client);
            }
        }
    }
}
