//! Identity of a module on its network: hardware address, host name, and a link-local address when
//! no DHCP server gives it one.
//!
//! ```text
//! unique id of the chip ──hash──▶ 02:hh:hh:hh:hh:hh      boards without a hardware address of their own
//! 52:54:00:12:34:01 ────────────▶ kehai-123401           host name, from the last three bytes
//! 52:54:00:12:34:01 ────hash────▶ 169.254.h.h            link-local address, while DHCP keeps trying
//! ```
//!
//! A module that has fallen back to its link-local address goes on asking for a lease, without giving its address up,
//! until [`dhcp`] says that a server gives one.
//!
//! Sources: RFC 3927 part 2.1 (link-local addresses; conflicts are not detected), IEEE 802c (the
//! bit for locally administered addresses).

pub mod dhcp;
mod interface;

use core::fmt::Write;

use heapless::String;

pub use interface::{InterfaceAddress, UnusableAddress, is_unicast};

/// Six-byte Ethernet hardware address.
pub type Mac = [u8; 6];

/// Bytes of a host name: `kehai-` and six hexadecimal digits.
pub const HOST_NAME_LEN: usize = 12;

/// FNV-1a over `bytes`, 64 bits: spreads serial numbers that differ in one digit.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// A locally administered hardware address for a chip that only has a unique id.
#[must_use]
pub fn mac_from_unique_id(unique_id: &[u8]) -> Mac {
    let [.., a, b, c, d, e] = hash(unique_id).to_be_bytes();
    [0x02, a, b, c, d, e]
}

/// The host name that goes into DHCP requests and the module's instance name: `kehai-123401`.
#[must_use]
pub fn host_name(mac: Mac) -> String<HOST_NAME_LEN> {
    let [.., a, b, c] = mac;
    let mut name = String::new();
    // Twelve characters always fit.
    let _ = write!(name, "kehai-{a:02x}{b:02x}{c:02x}");
    name
}

/// The module's link-local address: 169.254.1.0 to 169.254.254.255, always the same for one `mac`.
#[must_use]
pub fn link_local(mac: Mac) -> [u8; 4] {
    /// The first and the last 256 addresses of 169.254.0.0/16 are reserved.
    const ADDRESSES: u64 = 254 * 256;
    let [.., high, low] = (256 + hash(&mac) % ADDRESSES).to_be_bytes();
    [169, 254, high, low]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;
    use std::vec::Vec;

    const MAC: Mac = [0x52, 0x54, 0x00, 0x12, 0x34, 0x01];

    #[test]
    fn a_made_up_hardware_address_is_local_and_unicast_and_differs_between_neighbours() {
        let macs: HashSet<Mac> = (0..1000u32).map(|chip| mac_from_unique_id(&chip.to_le_bytes())).collect();
        assert_eq!(macs.len(), 1000);
        assert!(macs.iter().all(|mac| mac[0] == 0x02));
    }

    #[test]
    fn the_host_name_ends_in_the_last_three_bytes() {
        assert_eq!(host_name(MAC), "kehai-123401");
        assert_eq!(host_name([0xff; 6]), "kehai-ffffff");
    }

    #[test]
    fn link_local_addresses_stay_in_the_permitted_range_and_spread() {
        let addresses: Vec<[u8; 4]> = (0..=u8::MAX).map(|last| link_local([2, 0, 0, 0, 0, last])).collect();
        assert!(addresses.iter().all(|a| a[..2] == [169, 254] && (1..=254).contains(&a[2])));
        assert!(addresses.iter().collect::<HashSet<_>>().len() > 250);
        assert_eq!(link_local(MAC), link_local(MAC));
    }
}
