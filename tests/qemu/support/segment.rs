//! A host on a module's network segment that speaks in whole Ethernet frames: it asks for addresses
//! and has one (ARP), gives them out (DHCP), and exchanges datagrams.
//!
//! ```text
//! Ethernet  0 to  6 from  12 type │ ARP   14 … 20 operation  22 sender  32 target          42
//!                                 │ IPv4  14 … 23 protocol   26 source  30 destination
//!                                 │ UDP   34 source  36 destination  38 length
//!                                 │ DHCP  42 … 46 transaction  58 address given  70 hardware address
//!                                 │       282 options: type, length, value
//! ```

/// Hardware address of this host.
const HOST_MAC: [u8; 6] = [0x02, 0, 0, 0, 0, 0xfe];
/// Its address, and that of the DHCP server.
pub const HOST: [u8; 4] = [10, 1, 2, 1];
/// The address it gives out, in a network of 256.
pub const GIVEN: [u8; 4] = [10, 1, 2, 77];

const DISCOVER: u8 = 1;
const OFFER: u8 = 2;
const REQUEST: u8 = 3;
const ACKNOWLEDGE: u8 = 5;
const MESSAGE_TYPE: u8 = 53;
const HOST_NAME: u8 = 12;

/// An ARP request for `address`.
pub fn who_has(address: [u8; 4], asker: [u8; 4]) -> Vec<u8> {
    let mut frame = [&[0xff; 6][..], &HOST_MAC, &[0x08, 0x06], &[0, 1, 8, 0, 6, 4, 0, 1]].concat();
    frame.extend([&HOST_MAC[..], &asker, &[0; 6], &address].concat());
    frame
}

/// Whether `frame` says that `mac` has `address`.
pub fn has(frame: &[u8], mac: [u8; 6], address: [u8; 4]) -> bool {
    frame.len() >= 42
        && frame[12..14] == [8, 6]
        && frame[20..22] == [0, 2]
        && frame[22..28] == mac
        && frame[28..32] == address
}

/// What this host answers to `frame`, if that asks for its address.
pub fn arp_answer(frame: &[u8]) -> Option<Vec<u8>> {
    if frame.len() < 42 || frame[12..14] != [8, 6] || frame[20..22] != [0, 1] || frame[38..42] != HOST {
        return None;
    }
    let (asker_mac, asker) = (&frame[22..28], &frame[28..32]);
    let head = [asker_mac, &HOST_MAC, &[0x08, 0x06], &[0, 1, 8, 0, 6, 4, 0, 2]].concat();
    Some([&head[..], &HOST_MAC, &HOST, asker_mac, asker].concat())
}

/// The name in a DHCP message, or `None` if `frame` is none or has no name.
pub fn host_name(frame: &[u8]) -> Option<String> {
    option(frame, HOST_NAME).map(|name| String::from_utf8_lossy(name).into_owned())
}

/// Answer of a DHCP server to `frame`, if that is a DHCP request.
pub fn dhcp_answer(frame: &[u8]) -> Option<Vec<u8>> {
    let kind = match option(frame, MESSAGE_TYPE)?[0] {
        DISCOVER => OFFER,
        REQUEST => ACKNOWLEDGE,
        _ => return None,
    };
    let mut message = frame[42..282].to_vec();
    message[0] = 2;
    message[16..20].copy_from_slice(&GIVEN);
    let lease_s = 3600u32.to_be_bytes();
    for (code, value) in
        [(MESSAGE_TYPE, &[kind][..]), (54, &HOST), (51, &lease_s), (1, &[255, 255, 255, 0]), (3, &HOST)]
    {
        message.extend([&[code, value.len() as u8], value].concat());
    }
    message.push(255);
    Some(datagram(67, ([0xff; 6], [255; 4], 68), &message))
}

/// The value of a DHCP option in `frame`.
fn option(frame: &[u8], wanted: u8) -> Option<&[u8]> {
    if frame.len() < 282 || frame[12..14] != [8, 0] || frame[23] != 17 || frame[36..38] != [0, 67] {
        return None;
    }
    let mut options = &frame[282..];
    while let [code, len, rest @ ..] = options {
        let (value, rest) = rest.split_at_checked(usize::from(*len))?;
        if *code == wanted {
            return Some(value);
        }
        options = rest;
    }
    None
}

/// A UDP datagram of this host. Its own checksum is left out, as IPv4 allows.
pub fn datagram(from: u16, (mac, address, to): ([u8; 6], [u8; 4], u16), payload: &[u8]) -> Vec<u8> {
    let udp_len = payload.len() as u16 + 8;
    let mut header =
        [&[0x45, 0][..], &(udp_len + 20).to_be_bytes(), &[0, 0, 0, 0, 255, 17, 0, 0], &HOST, &address]
            .concat();
    let sum: u32 = header.chunks(2).map(|pair| u32::from(pair[0]) << 8 | u32::from(pair[1])).sum();
    let checksum = !((sum & 0xffff) + (sum >> 16)) as u16;
    header[10..12].copy_from_slice(&checksum.to_be_bytes());
    let udp = [from.to_be_bytes(), to.to_be_bytes(), udp_len.to_be_bytes(), [0, 0]].concat();
    [&mac[..], &HOST_MAC, &[8, 0], &header, &udp, payload].concat()
}
