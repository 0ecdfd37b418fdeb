//! Hosts on a module's network segment that speak IPv4 and UDP in whole Ethernet frames; some answer no ARP.
//!
//! ```text
//!                    ┌── Station 10.1.2.2   answers ARP
//!  module ═ Segment ─┼── Station 10.1.2.3   answers none
//!                    └── DHCP server (segment.rs)
//! ```

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;

use kehai_emulator::pc::host::Way;
use kehai_emulator::qemu::{Port, STEP_US};

use super::board::MAC;
use super::segment::{GIVEN, dhcp_answer};

/// Port of all stations, and of the module.
const STATION_PORT: u16 = 5000;
const MODULE_PORT: u16 = 4040;

/// Datagrams for stations: address of the station, and content.
type Inbox = VecDeque<([u8; 4], Vec<u8>)>;

/// The segment a module is on.
pub struct Segment {
    port: Port,
    inbox: RefCell<Inbox>,
    /// Addresses that answer ARP.
    answering: RefCell<Vec<[u8; 4]>>,
    /// ARP requests for other addresses.
    unanswered: Cell<u32>,
}

impl Segment {
    pub fn new(port: Port) -> Rc<Self> {
        Rc::new(Self {
            port,
            inbox: RefCell::default(),
            answering: RefCell::default(),
            unanswered: Cell::new(0),
        })
    }

    /// A host at `address`. If it answers ARP it also sends an ARP request for the module, as hosts do; the module
    /// knows its address from then on.
    pub fn station(self: &Rc<Self>, address: [u8; 4], answers_arp: bool) -> Station {
        if answers_arp {
            self.answering.borrow_mut().push(address);
            let own = hardware(address);
            let question = [&[0xff; 6][..], &own, &[8, 6], &[0, 1, 8, 0, 6, 4, 0, 1]].concat();
            self.port.send(&[&question, &own[..], &address, &[0; 6], &GIVEN].concat());
        }
        Station { segment: Rc::clone(self), address }
    }

    /// ARP requests without an answer.
    pub fn unanswered(&self) -> u32 {
        self.unanswered.get()
    }

    /// Takes the frames there are, and those of the next step if there are none.
    pub fn serve(&self) {
        let mut wait_us = STEP_US;
        while let Some(frame) = self.port.receive(wait_us) {
            wait_us = 0;
            if let Some(answer) = dhcp_answer(&frame).or_else(|| self.arp_answer(&frame)) {
                self.port.send(&answer);
            }
            self.inbox.borrow_mut().extend(datagram(&frame));
        }
    }

    /// The answer to an ARP request, if its address is one that answers.
    fn arp_answer(&self, frame: &[u8]) -> Option<Vec<u8>> {
        if frame.len() < 42 || frame[12..14] != [8, 6] || frame[20..22] != [0, 1] || frame[28..32] != GIVEN {
            return None;
        }
        let wanted: [u8; 4] = frame[38..42].try_into().ok()?;
        if !self.answering.borrow().contains(&wanted) {
            self.unanswered.set(self.unanswered.get() + 1);
            return None;
        }
        let own = hardware(wanted);
        let mut answer = [&MAC[..], &own, &[8, 6], &[0, 1, 8, 0, 6, 4, 0, 2]].concat();
        answer.extend([&own[..], &wanted, &MAC, &GIVEN].concat());
        Some(answer)
    }
}

/// A host on the segment.
pub struct Station {
    segment: Rc<Segment>,
    address: [u8; 4],
}

impl Way for Station {
    fn send(&self, datagram: &[u8]) {
        let udp_len = datagram.len() as u16 + 8;
        let ports = [STATION_PORT.to_be_bytes(), MODULE_PORT.to_be_bytes()].concat();
        // Without a sum of its own, as IPv4 allows.
        let udp = [&ports[..], &udp_len.to_be_bytes(), &[0, 0], datagram].concat();
        let length = (udp_len + 20).to_be_bytes();
        let mut header =
            [&[0x45, 0][..], &length, &[0, 0, 0, 0, 64, 17, 0, 0], &self.address, &GIVEN].concat();
        let sum: u32 = header.chunks(2).map(|pair| u32::from(pair[0]) << 8 | u32::from(pair[1])).sum();
        let checksum = !((sum & 0xffff) + (sum >> 16)) as u16;
        header[10..12].copy_from_slice(&checksum.to_be_bytes());
        let frame = [&MAC[..], &hardware(self.address), &[8, 0], &header, &udp].concat();
        self.segment.port.send(&frame);
    }

    fn receive(&self, buffer: &mut [u8]) -> Option<usize> {
        let waiting = || self.segment.inbox.borrow().iter().position(|(to, _)| *to == self.address);
        if waiting().is_none() {
            self.segment.serve();
        }
        let at = waiting()?;
        let (_, datagram) = self.segment.inbox.borrow_mut().remove(at)?;
        buffer[..datagram.len()].copy_from_slice(&datagram);
        Some(datagram.len())
    }

    fn now_us(&self) -> u64 {
        self.segment.port.time().now_us()
    }
}

/// A hardware address for each.
fn hardware(address: [u8; 4]) -> [u8; 6] {
    let [a, b, c, d] = address;
    [0x02, 0, a, b, c, d]
}

/// The datagram to a station in `frame`: the station's address, and the content.
fn datagram(frame: &[u8]) -> Option<([u8; 4], Vec<u8>)> {
    let for_station = frame.len() >= 42
        && frame[12..14] == [8, 0]
        && frame[23] == 17
        && frame[34..36] == MODULE_PORT.to_be_bytes()
        && frame[36..38] == STATION_PORT.to_be_bytes();
    let len = usize::from(u16::from_be_bytes([*frame.get(38)?, *frame.get(39)?]));
    let datagram = frame.get(42..(34 + len).max(42)).filter(|_| for_station)?;
    Some((frame[30..34].try_into().ok()?, datagram.to_vec()))
}
