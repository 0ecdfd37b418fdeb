//! What sealed datagrams cost: one that leaves, one that is taken, one that is refused.

use core::fmt::Write;
use core::hint::black_box;
use core::net::{Ipv4Addr, SocketAddrV4};

use kehai::seal::{Channel, Key, Keyring, Nonce, Sessions, datagram};
use kehai::wire::{Cookie, DATAGRAM_MAX, HEADER_LEN, Header, Identity, Message, ModuleId, Request};

use super::console::Console;
use super::counter::Counter;

/// Bytes of a subscribe; of a report with two people, and with many; of the longest datagram.
const LENGTHS: [usize; 4] = [68, 220, 600, DATAGRAM_MAX];

const DEVICE: Identity = Identity { module: ModuleId([2, 0, 0, 0, 0, 1]), boot: 1 };
const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), 5000);
const COOKIE: Cookie = Cookie([3; 8]);

/// Both ends of a session that is open.
struct Pair {
    channel: Channel,
    sessions: Sessions,
    nonces: u8,
}

impl Pair {
    fn new() -> Self {
        let mut record = [9; 34];
        (record[0], record[1]) = (1, 3);
        let keyring = Keyring::restored(Ok(&record));
        let channel = Channel::new(DEVICE.module, 1, Key([9; 32]));
        let mut pair = Self { channel, sessions: Sessions::new([1; 16]), nonces: 0 };
        let (subscribe, _) = pair.request(HEADER_LEN);
        let (_, message) = Header::open(&subscribe).expect("a subscribe");
        let id = message.first_chunk::<4>().copied().unwrap_or_default();
        let cookie = Message::Cookie { request_id: u32::from_le_bytes(id), t1: [0; 8], cookie: COOKIE };
        let mut bytes = [0; DATAGRAM_MAX];
        let length = cookie.encode(DEVICE, &mut bytes).expect("room");
        pair.channel.take(&mut bytes[..length], 0);
        let (open, length) = pair.request(HEADER_LEN);
        let opened = pair.sessions.open(&open[..length], (HOST, COOKIE), (DEVICE, DEVICE), &keyring, 0);
        pair.channel.take(&mut opened.expect("a genuine wish"), 0);
        assert!(pair.channel.is_open(), "no session");
        pair
    }

    /// What the host sends in the place of a request of so many bytes.
    fn request(&mut self, length: usize) -> ([u8; DATAGRAM_MAX], usize) {
        let mut bytes = [0; DATAGRAM_MAX];
        let _ = Request::Info.encode(DEVICE, 7, COOKIE, &mut bytes);
        self.nonces += 1;
        let length = self.channel.seal(&mut bytes, length, Nonce([self.nonces; 16]), 0);
        (bytes, length)
    }

    fn unseal(&mut self, bytes: &mut [u8]) -> bool {
        let Some(named) = datagram::named_key(bytes) else { return false };
        self.sessions.unseal(HOST, bytes, named, 0).is_ok()
    }
}

/// Counts, and prints a row for each length.
pub fn run() {
    let (mut pair, counter) = (Pair::new(), Counter::new());
    let _ = Console.write_str("instructions a sealed datagram\n");
    for title in ["bytes", "seal", "open", "refuse", "sent twice"] {
        let _ = write!(Console, "{title:>11}");
    }
    let _ = Console.write_str("\n");
    for length in LENGTHS {
        let (mut request, _) = pair.request(length);
        let mut forged = request;
        forged[length - 1] ^= 1;
        let mut again = request;
        let (refuse, was_taken) = counter.count(|| pair.unseal(black_box(&mut forged[..length])));
        assert!(!was_taken, "a forged datagram was taken");
        let (open, was_taken) = counter.count(|| pair.unseal(black_box(&mut request[..length])));
        assert!(was_taken, "a genuine datagram was refused");
        let (repeated, was_taken) = counter.count(|| pair.unseal(black_box(&mut again[..length])));
        assert!(!was_taken, "a datagram was taken twice");
        let mut report = [0; DATAGRAM_MAX];
        let (seal, was_sealed) = counter.count(|| pair.sessions.seal(HOST, black_box(&mut report[..length])));
        assert!(was_sealed, "there is no session");
        for column in [length as u32, seal, open, refuse, repeated] {
            let _ = write!(Console, "{column:>11}");
        }
        let _ = Console.write_str("\n");
    }
}
