//! One network segment with several modules and a host.
//!
//! ```text
//!                    tap1 ┐                              dgram ┐
//!   modules in QEMU  tap2 ┼ bridge ─ host        or      dgram ┼ Switch ─ host, in whole frames
//!                    tap3 ┘                              dgram ┘
//!                    in a network namespace: for root           for every user
//! ```

use std::cell::RefCell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Error, Write as _};
use std::net::{Ipv4Addr, UdpSocket};
use std::os::fd::AsFd;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;

use kehai_emulator::qemu::{GuestTime, Network, PATIENCE_US, Port, STEP_US, Switch};
use mdns_sd::{IfKind, Receiver, ServiceDaemon, ServiceEvent};
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

use super::dns::{self, Found};
use super::segment;
use kehai::wire::{Cookie, Counters, Identity, Message, ModuleId, Request};

/// Between two subscriptions.
const RENEWAL_US: u64 = 500_000;

/// The segment, and the time its modules live in.
pub struct Lan {
    pub time: GuestTime,
    pub kind: Kind,
}

/// What connects the modules.
pub enum Kind {
    Bridge(Bridge),
    Switch(Switch, Rc<Frames>),
}

/// The means by which modules are found.
pub struct Search {
    time: GuestTime,
    kind: SearchKind,
}

enum SearchKind {
    Daemon(ServiceDaemon, Receiver<ServiceEvent>),
    Frames(Rc<Frames>),
}

impl Lan {
    /// Taps on a bridge where that is allowed, else the switch; says which, past what swallows the output of
    /// tests that pass.
    pub fn new(taps: usize) -> Self {
        let (lan, which) = match Bridge::new(taps) {
            // The kernel's network and the search daemon go by this machine's clock.
            Ok(bridge) => (
                Self { time: GuestTime::not_faster_than_real(), kind: Kind::Bridge(bridge) },
                "taps on a bridge in a network namespace".to_owned(),
            ),
            Err(error) => (Self::switch(), format!("the datagram switch, as there is no bridge: {error}")),
        };
        let _ = writeln!(io::stderr(), "segment of {taps}: {which}");
        lan
    }

    pub fn switch() -> Self {
        let time = GuestTime::new();
        let switch = Switch::new(&time).unwrap();
        let port = switch.port();
        Self { time, kind: Kind::Switch(switch, Rc::new(Frames { port, waiting: RefCell::default() })) }
    }

    /// The plug for module `number`, from 0.
    pub fn network(&self, number: usize) -> Network<'_> {
        match &self.kind {
            Kind::Bridge(bridge) => Network::Tap(&bridge.taps[number]),
            Kind::Switch(switch, _) => Network::Switch(switch),
        }
    }

    /// Begins to look for `service`, as in [`dns::question`].
    pub fn search(&self, service: &str) -> Search {
        let kind = match &self.kind {
            Kind::Bridge(_) => {
                let daemon = ServiceDaemon::new().unwrap();
                daemon.disable_interface(IfKind::IPv6).unwrap();
                let events = daemon.browse(&format!("{service}.")).unwrap();
                SearchKind::Daemon(daemon, events)
            }
            Kind::Switch(_, frames) => {
                frames.send((dns::GROUP_MAC, dns::GROUP, dns::PORT), dns::PORT, &dns::question(0, service));
                SearchKind::Frames(Rc::clone(frames))
            }
        };
        Search { time: self.time.clone(), kind }
    }

    /// A host of the module `found` with the hardware address `mac`.
    pub fn subscribe(&self, found: &Found, mac: [u8; 6]) -> Subscriber {
        let way = match &self.kind {
            Kind::Bridge(_) => {
                let socket = UdpSocket::bind((Ipv4Addr::from(segment::HOST), 0)).unwrap();
                socket.connect((Ipv4Addr::from(found.address), found.port)).unwrap();
                socket.set_nonblocking(true).unwrap();
                Way::Socket(socket)
            }
            Kind::Switch(_, frames) => Way::Frames {
                frames: Rc::clone(frames),
                // The last byte tells modules apart.
                port: 6000 + u16::from(found.address[3]),
                to: (mac, found.address, found.port),
            },
        };
        Subscriber {
            time: self.time.clone(),
            way,
            module: ModuleId(mac),
            identity: Identity::default(),
            cookie: Cookie::NONE,
            renewed_us: None,
            sequences: Vec::new(),
            health: None,
            background_version: 0,
        }
    }

    /// Sends a message to the mDNS group.
    pub fn ask_everybody(&self, message: &[u8]) {
        match &self.kind {
            Kind::Bridge(_) => {
                let socket = UdpSocket::bind((Ipv4Addr::from(segment::HOST), 0)).unwrap();
                socket.send_to(message, (Ipv4Addr::from(dns::GROUP), dns::PORT)).unwrap();
            }
            Kind::Switch(_, frames) => {
                frames.send((dns::GROUP_MAC, dns::GROUP, dns::PORT), 6353, message);
            }
        }
    }
}

impl Search {
    /// The next module that was found or has changed.
    #[track_caller]
    pub fn next(&self, service: &str) -> Found {
        let look = || match &self.kind {
            SearchKind::Daemon(_, events) => events.try_iter().find_map(|event| resolved(event, service)),
            SearchKind::Frames(frames) => frames
                .look(|datagram| datagram.to_port == dns::PORT)
                .and_then(|datagram| dns::found(&datagram.payload, service)),
        };
        self.time.until(PATIENCE_US, look).expect("no module announces itself")
    }
}

impl Drop for Search {
    fn drop(&mut self) {
        if let SearchKind::Daemon(daemon, _) = &self.kind {
            let _ = daemon.shutdown();
        }
    }
}

fn resolved(event: ServiceEvent, service: &str) -> Option<Found> {
    let ServiceEvent::ServiceResolved(resolved) = event else { return None };
    let addresses = resolved.get_addresses_v4();
    let pair = |pair: &mdns_sd::TxtProperty| (pair.key().to_owned(), pair.val_str().to_owned());
    Some(Found {
        name: resolved.fullname.strip_suffix(&format!(".{service}."))?.to_owned(),
        address: addresses.iter().next()?.octets(),
        port: resolved.port,
        txt: resolved.txt_properties.iter().map(pair).collect(),
    })
}

/// A way to one module.
enum Way {
    Socket(UdpSocket),
    Frames { frames: Rc<Frames>, port: u16, to: ([u8; 6], [u8; 4], u16) },
}

impl Way {
    fn send(&self, datagram: &[u8]) {
        match self {
            // Refused while the port is not there yet.
            Self::Socket(socket) => drop(socket.send(datagram)),
            Self::Frames { frames, port, to } => frames.send(*to, *port, datagram),
        }
    }

    /// The next datagram that has come.
    fn receive(&self) -> Option<Vec<u8>> {
        match self {
            Self::Socket(socket) => {
                let mut buffer = [0; 2000];
                let len = socket.recv(&mut buffer).ok()?;
                Some(buffer[..len].to_vec())
            }
            Self::Frames { frames, port, to } => frames
                .look(|datagram| (datagram.to_port, datagram.from) == (*port, to.1))
                .map(|datagram| datagram.payload),
        }
    }
}

/// A host that subscribes to one module and keeps the sequences of its reports.
pub struct Subscriber {
    time: GuestTime,
    way: Way,
    module: ModuleId,
    identity: Identity,
    cookie: Cookie,
    renewed_us: Option<u64>,
    pub sequences: Vec<u32>,
    /// Counters and whether something is being stored, by the newest health.
    pub health: Option<(Counters, bool)>,
    pub background_version: u16,
}

impl Subscriber {
    /// Subscribes if a renewal is due, and handles one datagram; false if none came.
    pub fn turn(&mut self) -> bool {
        let now_us = self.time.now_us();
        if self.renewed_us.is_none_or(|renewed_us| now_us - renewed_us > RENEWAL_US) {
            let mut datagram = [0; 1400];
            let subscribe = Request::Subscribe { t1: [0; 8] };
            let len = subscribe.encode(self.identity, 1, self.cookie, &mut datagram).unwrap();
            self.way.send(&datagram[..len]);
            self.renewed_us = Some(now_us);
        }
        let Some(datagram) = self.way.receive() else { return false };
        let (header, message) = Message::decode(&datagram).unwrap();
        assert_eq!(header.identity.module, self.module, "another module answers at this address");
        self.identity = header.identity;
        match message {
            Message::Cookie { cookie, .. } => (self.cookie, self.renewed_us) = (cookie, None),
            Message::Report(report) => self.sequences.push(report.head.sequence),
            Message::Health(health) => {
                self.health = Some((health.counters, health.head.storing));
                self.background_version = health.head.background_version;
            }
            _ => {}
        }
        true
    }

    /// Until `done`.
    #[track_caller]
    pub fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end_us = self.time.now_us() + PATIENCE_US;
        while !done(self) {
            assert!(self.time.now_us() < end_us, "no {what}; reports {:?}", self.sequences);
            if !self.turn() {
                self.time.step();
            }
        }
    }

    #[track_caller]
    pub fn assert_no_report_missing(&self) {
        for pair in self.sequences.windows(2) {
            assert_eq!(pair[1], pair[0] + 1);
        }
    }
}

/// The host's end of the switch: answers for its address and sorts what comes.
pub struct Frames {
    port: Port,
    waiting: RefCell<VecDeque<Datagram>>,
}

/// Content of one frame: a UDP datagram, or with ports 0 the message of another protocol.
#[derive(Clone, Debug)]
pub struct Datagram {
    pub protocol: u8,
    pub from: [u8; 4],
    pub to: [u8; 4],
    pub to_port: u16,
    pub payload: Vec<u8>,
}

impl Frames {
    fn send(&self, to: ([u8; 6], [u8; 4], u16), from_port: u16, payload: &[u8]) {
        self.port.send(&segment::datagram(from_port, to, payload));
    }

    /// The oldest received datagram that is `wanted`.
    pub fn look(&self, wanted: impl Fn(&Datagram) -> bool) -> Option<Datagram> {
        let waiting = &mut *self.waiting.borrow_mut();
        while let Some(frame) = self.port.receive(0) {
            if let Some(answer) = segment::arp_answer(&frame) {
                self.port.send(&answer);
            }
            waiting.extend(received(&frame));
        }
        let at = waiting.iter().position(wanted)?;
        waiting.remove(at)
    }

    /// The same; waits a step for it.
    pub fn receive(&self, wanted: impl Fn(&Datagram) -> bool) -> Option<Datagram> {
        self.port.time().until(STEP_US, || self.look(&wanted))
    }
}

fn received(frame: &[u8]) -> Option<Datagram> {
    if frame.get(12..14)? != [8, 0] {
        return None;
    }
    let header_len = usize::from(frame.get(14)? & 15) * 4;
    let end = 14 + usize::from(u16::from_be_bytes(frame.get(16..18)?.try_into().ok()?));
    let protocol = *frame.get(23)?;
    let (from, to) = (frame.get(26..30)?.try_into().ok()?, frame.get(30..34)?.try_into().ok()?);
    let body = frame.get(14 + header_len..end)?;
    let (to_port, payload) = match protocol {
        17 => (u16::from_be_bytes(body.get(2..4)?.try_into().ok()?), body.get(8..)?),
        _ => (0, body),
    };
    Some(Datagram { protocol, from, to, to_port, payload: payload.to_vec() })
}

/// A bridge with taps, in a network namespace that ends with it. The thread that made it lives in there until
/// then, and so does everything it starts.
pub struct Bridge {
    taps: Vec<String>,
    namespace: Child,
    /// The thread's own namespace: without a bridge nothing works in the other.
    own: File,
}

impl Bridge {
    fn new(count: usize) -> io::Result<Self> {
        File::options().read(true).write(true).open("/dev/net/tun")?;
        // Keeps the namespace alive until its input is closed: at the latest with this process.
        let namespace = Command::new("unshare")
            .args(["--net", "sh", "-c", "echo; cat"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let own = File::open("/proc/thread-self/ns/net")?;
        let mut bridge = Self { taps: Vec::new(), namespace, own };
        let mut ready = [0];
        io::Read::read_exact(bridge.namespace.stdout.as_mut().unwrap(), &mut ready)?;
        let link = File::open(format!("/proc/{}/ns/net", bridge.namespace.id()))?;
        // From here on its end leads back.
        move_into_link_name_space(link.as_fd(), Some(LinkNameSpaceType::Network))?;
        let address = format!("{}/24", Ipv4Addr::from(segment::HOST));
        ip("link set lo up")?;
        ip("link add br0 type bridge mcast_snooping 0")?;
        ip(&format!("addr add {address} dev br0"))?;
        ip("link set br0 up")?;
        ip("route add 224.0.0.0/4 dev br0")?;
        for number in 1..=count {
            let tap = format!("tap{number}");
            ip(&format!("tuntap add dev {tap} mode tap"))?;
            ip(&format!("link set {tap} master br0 up"))?;
            bridge.taps.push(tap);
        }
        Ok(bridge)
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = move_into_link_name_space(self.own.as_fd(), Some(LinkNameSpaceType::Network));
        drop(self.namespace.stdin.take());
        let _ = self.namespace.wait();
    }
}

fn ip(arguments: &str) -> io::Result<()> {
    let output = Command::new("ip").args(arguments.split(' ')).output()?;
    if output.status.success() {
        return Ok(());
    }
    Err(Error::other(format!("ip {arguments}: {}", String::from_utf8_lossy(&output.stderr).trim())))
}
