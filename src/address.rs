//! Identity of a module on its network: hardware address, host name, and a link-local address when
//! no DHCP server gives it one.
//!
//! ```text
//! unique id of the chip ──hash──▶ 02:hh:hh:hh:hh:hh      boards without a hardware address of their own
//! 52:54:00:12:34:01 ────────────▶ kehai-123401           host name, from the last three bytes
//! 52:54:00:12:34:01 ────hash────▶ 169.254.h.h            link-local address, while DHCP keeps trying
//! ```
//!
//! A module that has fallen back to its link-local address goes on asking for a DHCP server with
//! [`dhcp_question`], without giving its address up, until [`is_dhcp_answer`] says that one is there.
//!
//! Sources: RFC 3927 part 2.1 (link-local addresses; conflicts are not detected), IEEE 802c (the
//! bit for locally administered addresses), RFC 2131 part 2 and RFC 2132 part 9.6 (DHCP messages).

mod interface;

use core::fmt::Write;

use heapless::String;

pub use interface::{InterfaceAddress, UnusableAddress, is_unicast};

/// Six-byte Ethernet hardware address.
pub type Mac = [u8; 6];

/// Bytes of a host name: `kehai-` and six hexadecimal digits.
pub const HOST_NAME_LEN: usize = 12;

/// Bytes of a question for a DHCP server: the least a BOOTP relay must pass on (RFC 1542 part 2.1).
pub const DHCP_QUESTION_LEN: usize = 300;

/// First of the four bytes that tell DHCP from plain BOOTP, after the 236 fixed ones.
const MAGIC_COOKIE: [u8; 4] = [99, 130, 83, 99];

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

/// A DHCPDISCOVER that asks whether any server is there; to be sent from UDP port 68 to
/// 255.255.255.255 port 67. The answer is asked for as a broadcast, so that it arrives whatever
/// address the module has.
#[must_use]
pub fn dhcp_question(mac: Mac, transaction: u32) -> [u8; DHCP_QUESTION_LEN] {
    const BOOT_REQUEST: u8 = 1;
    const ETHERNET: u8 = 1;
    const BROADCAST_FLAG: u8 = 0x80;
    const MESSAGE_TYPE: [u8; 3] = [53, 1, 1];
    const END: u8 = 255;
    let fields: [(usize, &[u8]); 6] = [
        (0, &[BOOT_REQUEST, ETHERNET, 6, 0]),
        (4, &transaction.to_be_bytes()),
        (10, &[BROADCAST_FLAG]),
        (28, &mac),
        (236, &MAGIC_COOKIE),
        (240, &[MESSAGE_TYPE[0], MESSAGE_TYPE[1], MESSAGE_TYPE[2], END]),
    ];
    let mut message = [0; DHCP_QUESTION_LEN];
    for (offset, bytes) in fields {
        for (place, &byte) in message.iter_mut().skip(offset).zip(bytes) {
            *place = byte;
        }
    }
    message
}

/// Whether `datagram`, received on UDP port 68, answers [`dhcp_question`] with the same arguments.
#[must_use]
pub fn is_dhcp_answer(datagram: &[u8], mac: Mac, transaction: u32) -> bool {
    const BOOT_REPLY: u8 = 2;
    let at = |offset: usize, len: usize| datagram.get(offset..offset.saturating_add(len)).unwrap_or_default();
    at(0, 1) == [BOOT_REPLY]
        && at(4, 4) == transaction.to_be_bytes()
        && at(28, 6) == mac
        && at(236, 4) == MAGIC_COOKIE
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

    #[test]
    fn the_question_is_a_discover_for_this_hardware_address() {
        let question = dhcp_question(MAC, 0x0102_0304);
        assert_eq!(question[..12], [1, 1, 6, 0, 1, 2, 3, 4, 0, 0, 0x80, 0]);
        assert_eq!(question[28..34], MAC);
        assert_eq!(question[236..244], [99, 130, 83, 99, 53, 1, 1, 255]);
    }

    #[test]
    fn only_a_reply_to_the_own_question_counts_as_an_answer() {
        let mut answer = dhcp_question(MAC, 7);
        assert!(!is_dhcp_answer(&answer, MAC, 7), "a question is no answer");
        answer[0] = 2;
        assert!(is_dhcp_answer(&answer, MAC, 7));
        assert!(!is_dhcp_answer(&answer, MAC, 8));
        assert!(!is_dhcp_answer(&answer, [2; 6], 7));
        assert!((0..240).all(|len| !is_dhcp_answer(&answer[..len], MAC, 7)));
    }
}
