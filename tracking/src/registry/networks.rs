//! The networks that this host is in: what is announced elsewhere is sent nothing.
//!
//! ```text
//!   interface 192.168.7.9/24 ─▶ 192.168.7.1 … 192.168.7.254     203.0.113.7, 192.168.7.255: refused
//! ```
//!
//! An announcement can name any address. Without this the tracker would send requests there for as long as
//! the announcement says.

use std::net::{Ipv4Addr, SocketAddr};

/// Address and mask of each interface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Networks(Vec<(Ipv4Addr, Ipv4Addr)>);

impl Networks {
    /// Of interfaces with these addresses and masks.
    #[must_use]
    pub fn of(interfaces: impl IntoIterator<Item = (Ipv4Addr, Ipv4Addr)>) -> Self {
        Self(interfaces.into_iter().collect())
    }

    /// Whether one host at this address may be reached without leaving them. Loopback is one of them: a device may run
    /// beside the tracker, and what is announced wrongly costs a local port one request a minute.
    #[must_use]
    pub fn hold(&self, address: SocketAddr) -> bool {
        let SocketAddr::V4(address) = address else { return false };
        let ip = *address.ip();
        let is_host = !ip.is_multicast() && !ip.is_broadcast() && !ip.is_unspecified();
        is_host && address.port() != 0 && self.0.iter().any(|(own, mask)| is_within(ip, *own, *mask))
    }
}

/// Whether an address is one of the network's hosts; its first and last address are none, unless it has no others.
fn is_within(ip: Ipv4Addr, own: Ipv4Addr, mask: Ipv4Addr) -> bool {
    let [ip, own, mask] = [ip, own, mask].map(u32::from);
    let host = ip & !mask;
    let is_first_or_last = host == 0 || host == !mask;
    // A mask of nothing is of an interface that leads everywhere: no network of this host.
    mask != 0 && ip & mask == own & mask && (!is_first_or_last || !mask < 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f7_only_hosts_of_own_networks_are_sent_anything() {
        let networks = Networks::of([
            (Ipv4Addr::LOCALHOST, Ipv4Addr::new(255, 0, 0, 0)),
            (Ipv4Addr::new(192, 168, 7, 9), Ipv4Addr::new(255, 255, 255, 0)),
            (Ipv4Addr::new(10, 1, 1, 1), Ipv4Addr::BROADCAST),
            (Ipv4Addr::new(100, 64, 0, 1), Ipv4Addr::UNSPECIFIED),
        ]);
        let hold = |text: &str| networks.hold(text.parse().unwrap());
        for own in ["127.0.0.1:4040", "192.168.7.1:4040", "192.168.7.254:53", "10.1.1.1:4040"] {
            assert!(hold(own), "{own}");
        }
        for other in [
            "203.0.113.7:53",
            "192.168.8.1:4040",
            "192.168.7.0:4040",
            "192.168.7.255:4040",
            "192.168.7.1:0",
            "127.255.255.255:4040",
            "224.0.0.251:5353",
            "255.255.255.255:4040",
            "0.0.0.0:4040",
            "10.1.1.2:4040",
            "100.64.0.2:4040",
            "[::1]:4040",
        ] {
            assert!(!hold(other), "{other}");
        }
    }
}
