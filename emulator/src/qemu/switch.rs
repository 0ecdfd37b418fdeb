//! An Ethernet switch with a port for the test. Each frame of a machine travels in a UDP datagram.
//!
//! ```text
//! QEMU ──▶┐          ┌──▶ QEMU
//! QEMU ──▶┼─ frames ─┼──▶ QEMU      to every port but the one it came from
//! test ──▶┘          └──▶ test
//! ```
//!
//! A machine is plugged in with the first frame it sends, and every module sends one when it boots. Frames are
//! forwarded between the steps of the machines' time.

use std::cell::RefCell;
use std::collections::{HashSet, VecDeque};
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::rc::Rc;

use super::lockstep::{Forward, GuestTime};

/// Longer than any frame.
const FRAME_LEN: usize = 2048;

/// A switch of machines that live in one time.
pub struct Switch {
    ports: Rc<SwitchPorts>,
    time: GuestTime,
}

/// The test's own port. Clones are the same port.
#[derive(Clone)]
pub struct Port {
    ports: Rc<SwitchPorts>,
    time: GuestTime,
}

/// Ports of the machines plugged in.
struct SwitchPorts {
    socket: UdpSocket,
    port: u16,
    machines: RefCell<HashSet<SocketAddr>>,
    for_test: RefCell<VecDeque<Vec<u8>>>,
}

impl Switch {
    /// A switch with no machine plugged in.
    ///
    /// # Errors
    /// No socket is available.
    pub fn new(time: &GuestTime) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.set_nonblocking(true)?;
        let port = socket.local_addr()?.port();
        let (machines, for_test) = Default::default();
        let ports = Rc::new(SwitchPorts { socket, port, machines, for_test });
        time.add_switch(Rc::clone(&ports) as Rc<dyn Forward>);
        Ok(Self { ports, time: time.clone() })
    }

    /// UDP port that machines send their frames to.
    #[must_use]
    pub fn udp_port(&self) -> u16 {
        self.ports.port
    }

    /// The test's port.
    #[must_use]
    pub fn port(&self) -> Port {
        Port { ports: Rc::clone(&self.ports), time: self.time.clone() }
    }
}

impl Port {
    /// Sends `frame`, from its destination address on and without checksum.
    pub fn send(&self, frame: &[u8]) {
        self.ports.send(frame, None);
    }

    /// The next frame from any machine, or `None` after `wait_us` of the machines' time.
    #[must_use]
    pub fn receive(&self, wait_us: u64) -> Option<Vec<u8>> {
        self.time.until(wait_us, || self.ports.for_test.borrow_mut().pop_front())
    }

    /// The machines' time.
    #[must_use]
    pub fn time(&self) -> &GuestTime {
        &self.time
    }
}

impl Forward for SwitchPorts {
    fn forward(&self) {
        let mut buffer = [0; FRAME_LEN];
        // An error is a machine that has just gone, or that nothing has come.
        while let Ok((len, from)) = self.socket.recv_from(&mut buffer) {
            let frame = buffer.get(..len).unwrap_or_default();
            self.machines.borrow_mut().insert(from);
            self.for_test.borrow_mut().push_back(frame.to_vec());
            self.send(frame, Some(from));
        }
    }
}

impl SwitchPorts {
    fn send(&self, frame: &[u8], from: Option<SocketAddr>) {
        for machine in self.machines.borrow().iter().filter(|&&machine| Some(machine) != from) {
            // To a machine that has gone it is lost.
            let _ = self.socket.send_to(frame, machine);
        }
    }
}
