//! The address of an interface: the conditions for it to work on a network.
//!
//! ```text
//!   10.1.2.77/24, gateway 10.1.2.1
//!   └ host ┘  │           └ another host of the same network
//!             └ 1 to 30 bits of network
//!
//!   refused   0.x  127.x  224.x to 255.x     no host has such an address; smoltcp panics at some of them
//!             10.1.2.0  10.1.2.255           the network itself, and all of its hosts
//!             /0  /31  /32                   no room for a host, a network and a broadcast address
//! ```
//!
//! A setting, a record of the store and a DHCP server's offer all pass the same check: there is no
//! [`InterfaceAddress`] that a network stack cannot start with.
//!
//! Sources: RFC 1122 part 3.2.1.3 (special addresses), RFC 5735 (their ranges), smoltcp 0.13
//! `InterfaceInner::check_ip_addrs` (panics at an address that is not unicast).

use core::net::Ipv4Addr;
use core::ops::RangeInclusive;

/// Bits of a network that has a network address, a broadcast address and at least two hosts.
pub const PREFIX_BITS: RangeInclusive<u8> = 1..=30;

/// Why an address cannot be used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum UnusableAddress {
    /// Not in `PREFIX_BITS`.
    Prefix,
    /// The address is not that of one host.
    Host,
    /// The gateway is not another host of the network.
    Gateway,
}

/// An address that an interface can have: one host's, in a network with room for others.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InterfaceAddress {
    address: Ipv4Addr,
    prefix_bits: u8,
    gateway: Option<Ipv4Addr>,
}

impl InterfaceAddress {
    /// Checks an address, the bits of its network, and the way out of it.
    ///
    /// # Errors
    /// The first [`UnusableAddress`].
    pub const fn new(
        address: Ipv4Addr,
        prefix_bits: u8,
        gateway: Option<Ipv4Addr>,
    ) -> Result<Self, UnusableAddress> {
        if prefix_bits < *PREFIX_BITS.start() || prefix_bits > *PREFIX_BITS.end() {
            return Err(UnusableAddress::Prefix);
        }
        let hosts = u32::MAX >> prefix_bits;
        if !is_host(address, hosts) {
            return Err(UnusableAddress::Host);
        }
        if let Some(gateway) = gateway {
            let (own, other) = (address.to_bits(), gateway.to_bits());
            if !is_host(gateway, hosts) || own == other || (own ^ other) & !hosts != 0 {
                return Err(UnusableAddress::Gateway);
            }
        }
        Ok(Self { address, prefix_bits, gateway })
    }

    /// The host's address.
    #[must_use]
    pub const fn address(&self) -> Ipv4Addr {
        self.address
    }

    /// Bits of its network, in `PREFIX_BITS`.
    #[must_use]
    pub const fn prefix_bits(&self) -> u8 {
        self.prefix_bits
    }

    /// Another host of the network: the way out of it.
    #[must_use]
    pub const fn gateway(&self) -> Option<Ipv4Addr> {
        self.gateway
    }
}

/// Whether this is the address of one host; `hosts` has the bits set that tell the hosts of its network apart.
const fn is_host(address: Ipv4Addr, hosts: u32) -> bool {
    let host = address.to_bits() & hosts;
    is_unicast(address) && host != 0 && host != hosts
}

/// Whether a datagram to or from this address is to or from one host, whatever the network.
#[must_use]
pub const fn is_unicast(address: Ipv4Addr) -> bool {
    /// First of the multicast addresses; behind them are the reserved ones and 255.255.255.255.
    const MULTICAST: u8 = 224;
    let [first, ..] = address.octets();
    first != 0 && !address.is_loopback() && first < MULTICAST
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(address: &str, prefix_bits: u8, gateway: Option<&str>) -> Result<(), UnusableAddress> {
        let of = |text: &str| text.parse().unwrap();
        InterfaceAddress::new(of(address), prefix_bits, gateway.map(of)).map(|_| ())
    }

    #[test]
    fn addresses_that_are_not_one_hosts_are_refused() {
        for address in [
            "0.0.0.0",
            "0.1.2.3",
            "127.0.0.1",
            "224.0.0.1",
            "239.255.255.250",
            "240.0.0.1",
            "255.255.255.254",
            "255.255.255.255",
            "10.1.2.0",
            "10.1.2.255",
        ] {
            assert_eq!(check(address, 24, None), Err(UnusableAddress::Host), "{address}");
        }
        for prefix_bits in [0, 31, 32, 33, 255] {
            assert_eq!(check("10.1.2.3", prefix_bits, None), Err(UnusableAddress::Prefix));
        }
        for gateway in ["10.1.2.77", "10.1.2.0", "10.1.2.255", "10.1.3.1", "0.0.0.0", "224.0.0.1"] {
            assert_eq!(check("10.1.2.77", 24, Some(gateway)), Err(UnusableAddress::Gateway), "{gateway}");
        }
    }

    #[test]
    fn addresses_of_hosts_are_taken() {
        for (address, prefix_bits) in
            [("10.0.0.1", 30), ("169.254.1.0", 16), ("223.255.255.253", 30), ("1.0.0.1", 1)]
        {
            assert_eq!(check(address, prefix_bits, None), Ok(()), "{address}/{prefix_bits}");
        }
        assert_eq!(check("10.1.2.77", 24, Some("10.1.2.1")), Ok(()));
    }

    proptest! {
        /// Said once more, with the standard library's own words.
        #[test]
        fn what_is_taken_is_one_host_among_others(
            address: u32,
            prefix_bits in 0..=40u8,
            gateway in prop::option::of(any::<u32>()),
            near: bool,
        ) {
            let address = Ipv4Addr::from(address);
            let gateway = gateway.map(|bits| {
                let hosts = u32::MAX.checked_shr(prefix_bits.into()).unwrap_or(0);
                let network = address.to_bits() & !hosts;
                Ipv4Addr::from(if near { network | bits & hosts } else { bits })
            });
            let taken = InterfaceAddress::new(address, prefix_bits, gateway);
            let hosts = (1u64 << (32 - u32::from(prefix_bits.min(32)))) - 1;
            let one_host = |of: Ipv4Addr| {
                let host = u64::from(of.to_bits()) & hosts;
                !of.is_multicast() && !of.is_broadcast() && !of.is_unspecified() && !of.is_loopback()
                    && (1..=223).contains(&of.octets()[0])
                    && host != 0 && host != hosts
            };
            let reachable = |gateway: Ipv4Addr| {
                gateway != address
                    && u64::from(gateway.to_bits()) | hosts == u64::from(address.to_bits()) | hosts
            };
            let expected = (1..=30).contains(&prefix_bits)
                && one_host(address)
                && gateway.is_none_or(|gateway| one_host(gateway) && reachable(gateway));
            prop_assert_eq!(taken.is_ok(), expected);
            if let Ok(taken) = taken {
                prop_assert_eq!((taken.address(), taken.prefix_bits(), taken.gateway()), (address, prefix_bits, gateway));
            }
        }
    }
}
