//! The module's DNS-SD service in packets: what [`kehai::device::discovery`] decides, through edge-mdns
//! and embassy-net.
//!
//! ```text
//!   listener  port 5353, in and out: questions, announcements      first in the stack: it gets every datagram
//!   direct    port 5353, out: answers to one host alone            one that answers no ARP blocks only this
//! ```

use core::task::{Context, Poll, Waker};

use defmt::{info, warn};
use edge_mdns::domain::base::iana::{Class, Opcode};
use edge_mdns::domain::base::{Message, MessageBuilder, ParsedName, Question, ToName, Ttl};
use edge_mdns::domain::rdata::{A, Ptr, Srv};
use edge_mdns::{Buf, DNS_SD_OWNER, MdnsError, NameSlice, Txt, set_header};
use embassy_futures::select::{Either3, select, select3};
use embassy_net::udp::{PacketMetadata, UdpSocket};
use embassy_net::{IpAddress, IpEndpoint, Ipv4Address, Ipv4Cidr, Stack};
use embassy_time::{Instant, Timer};
use kehai::address::Mac;
use kehai::device::discovery::{Action, Discovery, GROUP, LIFETIME_S, MDNS_PORT, SERVICE, Service, is_near};
use kehai::link::Clock;
use kehai::tasks::Notices;
use kehai::wire::{ModuleId, PORT};
use static_cell::ConstStaticCell;

use super::clock::BoardClock;
use super::watched;

/// The longest datagram in an Ethernet frame fits.
const RECEIVED_LEN: usize = 1536;
const RECEIVED: usize = 4;
/// All records are 400 bytes, and a question for one of them 40.
const ANSWER_LEN: usize = 512;
/// RFC 6762 part 11.
const HOP_LIMIT: u8 = 255;
const DOMAIN: &str = "local";
/// "Cache flush", in front of the class IN.
const OWNED: u16 = 0x8001;

/// Apart from the bytes: those are zero at first and take no flash, as one static with these they would.
struct Metadata {
    received: [PacketMetadata; RECEIVED],
    to_send: [PacketMetadata; 1],
    /// `direct` receives nothing.
    nothing: [PacketMetadata; 1],
    direct: [PacketMetadata; 1],
}

struct Bytes {
    received: [u8; RECEIVED_LEN],
    to_send: [u8; ANSWER_LEN],
    nothing: [u8; 1],
    direct: [u8; ANSWER_LEN],
    answer: [u8; ANSWER_LEN],
}

/// The sockets, and room for an answer.
struct Sockets {
    listener: UdpSocket<'static>,
    direct: UdpSocket<'static>,
    answer: &'static mut [u8],
}

impl Sockets {
    /// To be called once.
    fn open(stack: Stack<'static>) -> Self {
        static METADATA: ConstStaticCell<Metadata> = ConstStaticCell::new(Metadata {
            received: [PacketMetadata::EMPTY; _],
            to_send: [PacketMetadata::EMPTY; _],
            nothing: [PacketMetadata::EMPTY; _],
            direct: [PacketMetadata::EMPTY; _],
        });
        static BYTES: ConstStaticCell<Bytes> = ConstStaticCell::new(Bytes {
            received: [0; _],
            to_send: [0; _],
            nothing: [0; _],
            direct: [0; _],
            answer: [0; _],
        });
        let (metadata, bytes) = (METADATA.take(), BYTES.take());
        let Metadata { received, to_send, nothing, direct } = metadata;
        let mut listener = UdpSocket::new(stack, received, &mut bytes.received, to_send, &mut bytes.to_send);
        let mut direct = UdpSocket::new(stack, nothing, &mut bytes.nothing, direct, &mut bytes.direct);
        for socket in [&mut listener, &mut direct] {
            socket.set_hop_limit(Some(HOP_LIMIT));
            bind(socket);
        }
        Self { listener, direct, answer: &mut bytes.answer }
    }
}

/// Announces the module and answers queries for it, for ever. To be called once.
///
/// # Cancellation
/// The module is no longer found.
pub async fn announce(stack: Stack<'static>, mac: Mac, notices: &Notices) {
    let Sockets { mut listener, mut direct, answer } = Sockets::open(stack);
    let mut discovery = Discovery::new(mac);
    let mut service = describe(mac, notices);
    // Datagrams received here, of all that the controller has seen.
    let mut received = watched::mdns();
    loop {
        let now_us = BoardClock.now_us();
        let described = describe(mac, notices);
        if described != service {
            service = described;
            discovery.changed(now_us);
        }
        let address = address(stack);
        match discovery.poll(now_us, address.map(|address| address.address().octets())) {
            Action::Join => {
                join(stack, &service);
                // Datagrams that came before the join were for others.
                received = watched::mdns();
            }
            Action::Leave => {
                info!("mdns: no address");
                // Refused only for an address that is not multicast.
                let _ = stack.leave_multicast_group(group());
            }
            Action::Announce => {
                let Some(address) = address else { continue };
                if !tell_all(&mut listener, &service, address, answer) {
                    notices.discovery_dropped(1);
                }
            }
            Action::Wait(until_us) => {
                if listener.poll_recv_ready(&mut Context::from_waker(Waker::noop())).is_pending() {
                    // No datagram waits: the stack had no room for those that came and were not received.
                    let lost = watched::mdns().wrapping_sub(received);
                    received = watched::mdns();
                    notices.discovery_dropped(lost);
                }
                let next = listener.recv_from_with(|datagram, from| {
                    received = received.wrapping_add(1);
                    receive(&mut discovery, &service, address, datagram, from.endpoint, answer)
                });
                let time = Timer::at(Instant::from_micros(until_us));
                match select3(next, time, change(stack, address.is_some())).await {
                    Either3::First(Received::ForOne(to, length)) => {
                        let answer = answer.get(..length).unwrap_or_default();
                        if !send(&mut direct, answer, to) {
                            notices.discovery_dropped(1);
                        }
                    }
                    Either3::First(Received::Dropped) => notices.discovery_dropped(1),
                    Either3::First(Received::Done) | Either3::Second(()) | Either3::Third(()) => {}
                }
            }
        }
    }
}

fn group() -> IpAddress {
    IpAddress::Ipv4(Ipv4Address::from(GROUP))
}

fn join(stack: Stack<'static>, service: &Service) {
    match stack.join_multicast_group(group()) {
        Ok(()) => info!("mdns: {=str}", service.instance()),
        Err(error) => warn!("mdns: {}", error),
    }
}

/// Announces the service at this address; true if that was queued.
fn tell_all(
    listener: &mut UdpSocket<'static>,
    service: &Service,
    address: Ipv4Cidr,
    answer: &mut [u8],
) -> bool {
    compose(service, address.address(), None, answer)
        .is_ok_and(|announcement| send(listener, announcement, (group(), MDNS_PORT).into()))
}

fn describe(mac: Mac, notices: &Notices) -> Service {
    Service::new(ModuleId(mac), env!("CARGO_PKG_VERSION"), &notices.status())
}

/// The address, if there is one and a link to use it on.
fn address(stack: Stack<'static>) -> Option<Ipv4Cidr> {
    stack.config_v4().filter(|_| stack.is_link_up()).map(|config| config.address)
}

/// Returns when link or address come or go.
///
/// # Cancellation
/// Nothing is lost.
async fn change(stack: Stack<'static>, has_address: bool) {
    if has_address {
        select(stack.wait_link_down(), stack.wait_config_down()).await;
    } else {
        stack.wait_link_up().await;
        stack.wait_config_up().await;
    }
}

/// Refused only for a socket that is open, or port 0.
fn bind(socket: &mut UdpSocket<'static>) {
    let _ = socket.bind(MDNS_PORT);
}

/// Queues a datagram without waiting; true if it was queued. Datagrams still in the queue are dropped for it.
fn send(socket: &mut UdpSocket<'static>, datagram: &[u8], to: IpEndpoint) -> bool {
    for _ in 0..2 {
        match socket.poll_send_to(datagram, to, &mut Context::from_waker(Waker::noop())) {
            Poll::Ready(sent) => return sent.is_ok(),
            Poll::Pending => {
                socket.close();
                bind(socket);
            }
        }
    }
    false
}

/// Result of a received datagram.
enum Received {
    /// No answer must be sent now.
    Done,
    /// It was invalid, or over the time budget.
    Dropped,
    /// An answer of this length is for this host alone.
    ForOne(IpEndpoint, usize),
}

fn receive(
    discovery: &mut Discovery,
    service: &Service,
    address: Option<Ipv4Cidr>,
    datagram: &[u8],
    from: IpEndpoint,
    answer: &mut [u8],
) -> Received {
    let now_us = BoardClock.now_us();
    if !discovery.admits(now_us) {
        return Received::Dropped;
    }
    match (asks(service, datagram), address) {
        (Ok(None), _) => Received::Done,
        (Ok(Some(_)), _) if from.port == MDNS_PORT => {
            discovery.asked(now_us);
            Received::Done
        }
        (Ok(Some(question)), Some(address)) => {
            let IpAddress::Ipv4(host) = from.addr;
            let near = is_near(host.octets(), address.address().octets(), address.prefix_len());
            match compose(service, address.address(), Some(question), answer) {
                Ok(answer) if near => Received::ForOne(from, answer.len()),
                _ => Received::Dropped,
            }
        }
        (Err(_), _) | (_, None) => Received::Dropped,
    }
}

/// The question in `datagram` that the module can answer, if that is one.
fn asks<'a>(service: &Service, datagram: &'a [u8]) -> Result<Option<Asked<'a>>, MdnsError> {
    let message = Message::from_octets(datagram)?;
    if message.header().qr() || message.header().opcode() != Opcode::QUERY {
        return Ok(None);
    }
    let [name, protocol] = SERVICE;
    let names: [&[&str]; 3] = [
        &[name, protocol, DOMAIN],
        &[service.instance(), name, protocol, DOMAIN],
        &[service.instance(), DOMAIN],
    ];
    for question in message.question() {
        let question = question?;
        let asks = |name: &[&str]| question.qname().name_eq(&NameSlice::new(name));
        if question.qname().name_eq(&DNS_SD_OWNER) || names.into_iter().any(asks) {
            return Ok(Some(Asked { id: message.header().id(), question }));
        }
    }
    Ok(None)
}

/// A question, and the number it was sent with.
struct Asked<'a> {
    id: u16,
    question: Question<ParsedName<&'a [u8]>>,
}

/// Composes all records: for the multicast group, or as the unicast answer to one host.
fn compose<'a>(
    service: &Service,
    address: Ipv4Address,
    asked: Option<Asked<'_>>,
    answer: &'a mut [u8],
) -> Result<&'a [u8], MdnsError> {
    let for_all = asked.is_none();
    let mut message = MessageBuilder::from_target(Buf::new(answer))?;
    set_header(&mut message, asked.as_ref().map_or(0, |asked| asked.id), true);
    let mut questions = message.question();
    if let Some(Asked { question, .. }) = asked {
        questions.push(question)?;
    }

    let [name, protocol] = SERVICE;
    let labels: ([&str; 3], [&str; 4], [&str; 2]) = (
        [name, protocol, DOMAIN],
        [service.instance(), name, protocol, DOMAIN],
        [service.instance(), DOMAIN],
    );
    let (kind, instance, host) =
        (NameSlice::new(&labels.0), NameSlice::new(&labels.1), NameSlice::new(&labels.2));
    let ttl = Ttl::from_secs(LIFETIME_S);
    // No other module has these records: earlier ones in the caches of hosts, an old address for one, are void
    // (RFC 6762 part 10.2). A host that asks for a unicast answer does not know the mark.
    let owned = if for_all { Class::from_int(OWNED) } else { Class::IN };
    let [a, b, c, d] = address.octets();
    let mut answers = questions.answer();
    answers.push((&kind, Class::IN, ttl, Ptr::new(&instance)))?;
    answers.push((&instance, owned, ttl, Srv::new(0, 0, PORT, &host)))?;
    answers.push((&instance, owned, ttl, Txt::new(&service.txt())))?;
    answers.push((&host, owned, ttl, A::from_octets(a, b, c, d)))?;
    answers.push((&DNS_SD_OWNER, Class::IN, ttl, Ptr::new(&kind)))?;
    let Buf(answer, length) = answers.finish();
    answer.get(..length).ok_or(MdnsError::ShortBuf)
}
