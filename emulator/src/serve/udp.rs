//! An emulated sensor or floor in datagrams, as QEMU's serial lines speak them, on the time of the program it speaks to.
//!
//! ```text
//! QEMU ── a datagram a byte ──▶ socket ─▶ device ◀─ with(…) the test
//!      ◀── 1024 bytes at most ──   └ to the address that spoke last
//! ```
//!
//! It has no clock: [`UdpSensor::advance`] lets its time pass, takes what has come and sends what is due.

use std::cell::{Cell, RefCell};
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::rc::Rc;

use crate::uart;
use crate::urg::{Sent, Urg};

/// Bytes of a datagram; QEMU cuts what is longer than 4096.
const DATAGRAM_BYTES: usize = 1024;

/// A device at the end of a serial line, on the time of its caller.
pub trait SerialDevice {
    /// Takes bytes that arrived at `now_us`.
    fn receive(&mut self, bytes: &[u8], now_us: u64);
    /// The bytes that have left it at `now_us`, in order.
    fn take_output(&mut self, now_us: u64) -> Vec<Sent>;
    /// Bit rate at which it listens.
    fn baud(&self) -> u32;
    /// Whether the speed of the line matters.
    fn paced(&self) -> bool;
}

impl SerialDevice for Urg {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        Self::receive(self, bytes, now_us);
    }

    fn take_output(&mut self, now_us: u64) -> Vec<Sent> {
        Self::take_output(self, now_us)
    }

    fn baud(&self) -> u32 {
        Self::baud(self)
    }

    fn paced(&self) -> bool {
        Self::paced(self)
    }
}

/// A device and its socket. Clones are the same device.
pub struct UdpSensor<D: ?Sized = Urg>(Rc<Shared<D>>);

struct Shared<D: ?Sized> {
    socket: UdpSocket,
    port: u16,
    now_us: Cell<u64>,
    client: Cell<Option<SocketAddr>>,
    device: RefCell<D>,
}

impl<D: ?Sized> Clone for UdpSensor<D> {
    fn clone(&self) -> Self {
        Self(Rc::clone(&self.0))
    }
}

impl<D: SerialDevice + 'static> UdpSensor<D> {
    /// `device` on a free port of this machine. Its time is 0.
    ///
    /// # Errors
    /// No socket is to be had.
    pub fn new(device: D) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.set_nonblocking(true)?;
        let port = socket.local_addr()?.port();
        let device = RefCell::new(device);
        Ok(Self(Rc::new(Shared { socket, port, now_us: Cell::new(0), client: Cell::new(None), device })))
    }

    /// Looks at the device, or does something to it, now: the time is the device's, µs.
    pub fn with<T>(&self, act: impl FnOnce(&mut D, u64) -> T) -> T {
        act(&mut self.0.device.borrow_mut(), self.0.now_us.get())
    }

    /// The same, whatever it is.
    #[must_use]
    pub fn of_any_kind(&self) -> UdpSensor<dyn SerialDevice> {
        let shared: Rc<Shared<D>> = Rc::clone(&self.0);
        UdpSensor(shared)
    }
}

impl<D: SerialDevice + ?Sized> UdpSensor<D> {
    /// UDP port to speak to it at.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.0.port
    }

    /// Lets `by_us` pass: the device receives what has come and sends what is due by then. With a speed of the
    /// client's end of the line, both ends hear garbage where their speeds differ.
    pub fn advance(&self, by_us: u64, client_baud: Option<u32>) {
        let now_us = self.0.now_us.get() + by_us;
        self.0.now_us.set(now_us);
        let mut device = self.0.device.borrow_mut();
        let mut received = Vec::new();
        let mut datagram = [0; DATAGRAM_BYTES];
        // An error says that nothing has come, or that the client is gone.
        while let Ok((count, from)) = self.0.socket.recv_from(&mut datagram) {
            self.0.client.set(Some(from));
            received.extend_from_slice(datagram.get(..count).unwrap_or_default());
        }
        if let Some(sent_baud) = client_baud.filter(|_| device.paced()) {
            received = uart::received(&received, sent_baud, device.baud());
        }
        device.receive(&received, now_us);
        for sent in device.take_output(now_us) {
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
