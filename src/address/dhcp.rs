//! The search for a lease by a module that has its link-local address, and keeps it meanwhile.
//!
//! ```text
//!   every 5 s ─▶ DISCOVER ── offer ─▶ REQUEST ── acknowledged ─▶ leased: the stack's own DHCP takes over
//!                   ▲                    │
//!                   └── refused, silent ─┘
//!
//!   message   0 op  4 transaction  10 flags  16 address given  28 hardware address  236 cookie  240 options
//!   option    number, length, value; 0 is alone, 255 ends them
//! ```
//!
//! An offer is not enough: there are servers that offer and never lease, as their pool is empty or another one's is
//! meant. The stack's own DHCP has no address while it asks, so it would take the module's away for nothing.
//!
//! Sources: RFC 2131 parts 2 and 4.3, RFC 2132 (options).

use core::net::Ipv4Addr;

use super::{InterfaceAddress, Mac, is_unicast};

/// Bytes of a question for a DHCP server: the least a BOOTP relay must pass on (RFC 1542 part 2.1).
pub const DHCP_MESSAGE_LEN: usize = 300;

/// First of the four bytes that tell DHCP from plain BOOTP, after the 236 fixed ones.
const MAGIC_COOKIE: [u8; 4] = [99, 130, 83, 99];
/// First option.
const OPTIONS: usize = 240;

const SUBNET_MASK: u8 = 1;
const ROUTER: u8 = 3;
const REQUESTED_ADDRESS: u8 = 50;
const MESSAGE_TYPE: u8 = 53;
const SERVER: u8 = 54;
const PARAMETERS: u8 = 55;
const CLIENT: u8 = 61;
const PAD: u8 = 0;
const END: u8 = 255;

const DISCOVER: u8 = 1;
const OFFER: u8 = 2;
const REQUEST: u8 = 3;
const ACKNOWLEDGE: u8 = 5;

const ETHERNET: u8 = 1;

/// What a datagram from a server has come to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Heard {
    /// Nothing new.
    Nothing,
    /// A server offers an address: the next [message](LeaseSearch::message) asks for it, and is due now.
    Offer,
    /// A server leases an address that an interface can have.
    Lease,
}

/// What a server offers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Offer {
    address: [u8; 4],
    server: [u8; 4],
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stage {
    /// A server is asked for, or soon will be.
    Discovering,
    /// It is about to be asked for its offer.
    Offered(Offer),
    /// It has been.
    Requesting,
}

/// A search for a DHCP server that leases an address.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LeaseSearch {
    mac: Mac,
    transaction: u32,
    stage: Stage,
}

impl LeaseSearch {
    /// A search of this hardware address; `transaction` tells its answers from those to other clients.
    #[must_use]
    pub const fn new(mac: Mac, transaction: u32) -> Self {
        Self { mac, transaction, stage: Stage::Discovering }
    }

    /// The message to be sent now, from UDP port 68 to 255.255.255.255 port 67: after an [offer](Heard::Offer) the
    /// request for it, else a question for any server. The answer is asked for as a broadcast, so that it arrives
    /// whatever address the module has.
    pub fn message(&mut self) -> [u8; DHCP_MESSAGE_LEN] {
        const BOOT_REQUEST: u8 = 1;
        const BROADCAST_FLAG: u8 = 0x80;
        let Self { mac, transaction, stage } = *self;
        let (kind, offer) = match stage {
            Stage::Offered(offer) => (REQUEST, Some(offer)),
            // A request that was not answered is not repeated: the server may be gone.
            Stage::Discovering | Stage::Requesting => (DISCOVER, None),
        };
        self.stage = if offer.is_some() { Stage::Requesting } else { Stage::Discovering };
        let mut message = [0; DHCP_MESSAGE_LEN];
        let fields: [(usize, &[u8]); 5] = [
            (0, &[BOOT_REQUEST, ETHERNET, 6, 0]),
            (4, &transaction.to_be_bytes()),
            (10, &[BROADCAST_FLAG]),
            (28, &mac),
            (236, &MAGIC_COOKIE),
        ];
        for (offset, bytes) in fields {
            put(&mut message, offset, bytes);
        }
        let [a, b, c, d, e, f] = mac;
        let mut end = OPTIONS;
        let mut add = |number: u8, value: &[u8]| {
            put(&mut message, end, &[number, value.len() as u8]);
            put(&mut message, end.saturating_add(2), value);
            end = end.saturating_add(2).saturating_add(value.len());
        };
        add(MESSAGE_TYPE, &[kind]);
        // By the name that the stack's own DHCP gives itself: the lease is found again.
        add(CLIENT, &[ETHERNET, a, b, c, d, e, f]);
        add(PARAMETERS, &[SUBNET_MASK, ROUTER]);
        if let Some(Offer { address, server }) = offer {
            add(REQUESTED_ADDRESS, &address);
            add(SERVER, &server);
        }
        put(&mut message, end, &[END]);
        message
    }

    /// A datagram has come to UDP port 68.
    pub fn hear(&mut self, datagram: &[u8]) -> Heard {
        let is_ours = is_answer(datagram, self.mac, self.transaction);
        let Some((address, &[kind])) =
            given(datagram).zip(option(datagram, MESSAGE_TYPE)).filter(|_| is_ours)
        else {
            return Heard::Nothing;
        };
        match (self.stage, kind, four(option(datagram, SERVER))) {
            (Stage::Discovering, OFFER, Some(server)) if is_unicast(address.into()) => {
                self.stage = Stage::Offered(Offer { address, server });
                Heard::Offer
            }
            (Stage::Requesting, ACKNOWLEDGE, Some(_)) if is_usable(datagram, address) => {
                self.stage = Stage::Discovering;
                Heard::Lease
            }
            _ => Heard::Nothing,
        }
    }
}

/// Copies `bytes` to `offset`; what does not fit is left out, and all does.
fn put(message: &mut [u8], offset: usize, bytes: &[u8]) {
    for (place, &byte) in message.iter_mut().skip(offset).zip(bytes) {
        *place = byte;
    }
}

/// Whether this is a server's answer to a message of this client.
fn is_answer(datagram: &[u8], mac: Mac, transaction: u32) -> bool {
    const BOOT_REPLY: u8 = 2;
    let at = |offset: usize, len: usize| datagram.get(offset..offset.saturating_add(len)).unwrap_or_default();
    at(0, 1) == [BOOT_REPLY]
        && at(4, 4) == transaction.to_be_bytes()
        && at(28, 6) == mac
        && at(236, 4) == MAGIC_COOKIE
}

/// The address that is given.
fn given(datagram: &[u8]) -> Option<[u8; 4]> {
    four(datagram.get(16..20))
}

/// Whether an interface can have the leased address, with the network and the way out of it that come with it.
fn is_usable(datagram: &[u8], address: [u8; 4]) -> bool {
    let Some(mask) = four(option(datagram, SUBNET_MASK)).map(u32::from_be_bytes) else { return false };
    let bits = mask.leading_ones();
    // Several may be named; the stack takes the first.
    let router = four(option(datagram, ROUTER).and_then(|routers| routers.get(..4)));
    mask.count_ones() == bits
        && InterfaceAddress::new(Ipv4Addr::from(address), bits as u8, router.map(Ipv4Addr::from)).is_ok()
}

fn four(bytes: Option<&[u8]>) -> Option<[u8; 4]> {
    bytes?.try_into().ok()
}

/// The value of an option; none if the options end, or are cut off, before it.
fn option(datagram: &[u8], wanted: u8) -> Option<&[u8]> {
    let mut rest = datagram.get(OPTIONS..)?;
    loop {
        let (&number, behind) = rest.split_first()?;
        if number == END {
            return None;
        }
        rest = behind;
        if number != PAD {
            let (&len, behind) = behind.split_first()?;
            let (value, behind) = behind.split_at_checked(usize::from(len))?;
            if number == wanted {
                return Some(value);
            }
            rest = behind;
        }
    }
}

#[cfg(test)]
mod tests;
