//! An Ethernet switch for machines whose every frame is a UDP datagram, with a port for the test.
//!
//! ```text
//! QEMU ──▶┐          ┌──▶ QEMU
//! QEMU ──▶┼─ frames ─┼──▶ QEMU      to every port but the one it came from
//! test ──▶┘          └──▶ test
//! ```
//!
//! A machine is plugged in with the first frame it sends, and every module sends one when it boots.

use std::collections::HashSet;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::Duration;

/// Longer than any frame.
const FRAME_LEN: usize = 2048;

type Frame = Vec<u8>;

/// A running switch. It ends with the process.
pub struct Switch {
    port: u16,
    test: Option<Port>,
}

/// The test's own port.
pub struct Port {
    socket: UdpSocket,
    frames: Receiver<Frame>,
}

impl Switch {
    /// Starts a switch with no machine plugged in.
    ///
    /// # Errors
    /// No socket or thread is to be had.
    pub fn start() -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        let port = socket.local_addr()?.port();
        let test = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        test.connect((Ipv4Addr::LOCALHOST, port))?;
        let test_address = test.local_addr()?;
        let (to_test, frames) = mpsc::channel();
        thread::Builder::new()
            .name("switch".into())
            .spawn(move || forward(&socket, test_address, &to_test))?;
        Ok(Self { port, test: Some(Port { socket: test, frames }) })
    }

    /// UDP port that machines send their frames to.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// The test's port; it is there once.
    pub fn take_port(&mut self) -> Option<Port> {
        self.test.take()
    }
}

impl Port {
    /// Sends `frame`, from its destination address on and without checksum.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn send(&self, frame: &[u8]) -> io::Result<()> {
        self.socket.send(frame).map(|_| ())
    }

    /// The next frame from any machine, or `None` after `wait`.
    #[must_use]
    pub fn receive(&self, wait: Duration) -> Option<Vec<u8>> {
        self.frames.recv_timeout(wait).ok()
    }
}

fn forward(socket: &UdpSocket, test: SocketAddr, to_test: &Sender<Frame>) {
    let mut machines = HashSet::new();
    let mut buffer = [0; FRAME_LEN];
    loop {
        // An error is a machine that has just gone: its frames are lost.
        let Ok((len, from)) = socket.recv_from(&mut buffer) else { continue };
        let frame = &buffer[..len];
        if from != test {
            machines.insert(from);
            // Nobody may be listening any more.
            let _ = to_test.send(frame.to_vec());
        }
        for machine in machines.iter().filter(|&&machine| machine != from) {
            let _ = socket.send_to(frame, machine);
        }
    }
}
