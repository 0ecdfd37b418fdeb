//! Both ends against each other.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::sessions::NotOpened;
use super::*;
use crate::wire::{Cookie, DATAGRAM_MAX, Header, Identity, Message, ModuleId, Refusal, Refused, Request};

const DEVICE: Identity = Identity { module: ModuleId([2, 0, 0, 0, 0, 1]), boot: 7 };
const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), 5000);
const COOKIE: Cookie = Cookie([3; 8]);
const KEY: Key = Key([9; 32]);

fn keyring() -> Keyring {
    let mut record = [9; 34];
    (record[0], record[1]) = (1, Role::Control.into());
    Keyring::restored(Ok(&record))
}

/// A host and a device on one table.
struct Pair {
    channel: Channel,
    sessions: Sessions,
    nonces: u8,
}

impl Pair {
    fn new() -> Self {
        let channel = Channel::new(DEVICE.module, 1, KEY);
        Self { channel, sessions: Sessions::new([1; 16]), nonces: 0 }
    }

    /// What the host sends in the place of a request.
    fn request(&mut self, now_us: u64) -> std::vec::Vec<u8> {
        let mut bytes = [0; DATAGRAM_MAX];
        let length = Request::Info.encode(DEVICE, 77, Cookie::NONE, &mut bytes).unwrap();
        self.nonces += 1;
        let length = self.channel.seal(&mut bytes, length, Nonce([self.nonces; 16]), now_us);
        bytes[..length].to_vec()
    }

    fn open(&mut self, bytes: &[u8], now_us: u64) -> Result<[u8; handshake::OPENED_LEN], NotOpened> {
        self.sessions.open(bytes, (HOST, COOKIE), (DEVICE, DEVICE), &keyring(), now_us)
    }

    /// Answers what asks for a cookie.
    fn give_cookie(&mut self, subscribe: &[u8], now_us: u64) {
        let [a, b, c, d] = subscribe[40..44].try_into().unwrap();
        let message =
            Message::Cookie { request_id: u32::from_le_bytes([a, b, c, d]), t1: [0; 8], cookie: COOKIE };
        let mut bytes = [0; DATAGRAM_MAX];
        let length = message.encode(DEVICE, &mut bytes).unwrap();
        assert_eq!(self.channel.take(&mut bytes[..length], now_us), Incoming::Session);
    }

    /// Until a session is open.
    fn meet(&mut self, now_us: u64) {
        let subscribe = self.request(now_us);
        self.give_cookie(&subscribe, now_us);
        let open = self.request(now_us);
        let mut opened = self.open(&open, now_us).unwrap();
        assert_eq!(self.channel.take(&mut opened, now_us), Incoming::Session);
        assert!(self.channel.is_open());
    }

    fn unseal(&mut self, bytes: &mut [u8], now_us: u64) -> Result<Role, Unsealed> {
        let named = datagram::named_key(bytes).unwrap();
        self.sessions.unseal(HOST, bytes, named, now_us)
    }

    /// A message of the device, sealed.
    fn message(&mut self) -> std::vec::Vec<u8> {
        let mut bytes = [0; DATAGRAM_MAX];
        let length = Message::Done { request_id: 5 }.encode(DEVICE, &mut bytes).unwrap();
        assert!(self.sessions.seal(HOST, &mut bytes[..length]));
        bytes[..length].to_vec()
    }
}

#[test]
fn both_ends_understand_each_other_and_no_third_does() {
    let mut pair = Pair::new();
    pair.meet(0);
    let mut request = pair.request(1);
    assert_eq!(&request[40..44], &request[40..44]);
    assert_ne!(&request[40..44], &77_u32.to_le_bytes(), "the message is encrypted");
    assert!(!pair.sessions.has(HOST), "open, but not proven");
    assert_eq!(pair.unseal(&mut request, 1), Ok(Role::Control));
    assert_eq!(&request[40..44], &77_u32.to_le_bytes());
    let mut message = pair.message();
    assert_eq!(pair.channel.take(&mut message, 2), Incoming::Message);
    assert_eq!(Message::decode(&message).map(|(_, message)| message), Ok(Message::Done { request_id: 5 }));
}

#[test]
fn nothing_is_taken_twice_nor_sent_back_nor_by_another_address() {
    let mut pair = Pair::new();
    pair.meet(0);
    let request = pair.request(1);
    assert_eq!(pair.unseal(&mut request.clone(), 1), Ok(Role::Control));
    assert_eq!(pair.unseal(&mut request.clone(), 1), Err(Unsealed::Replayed));
    let message = pair.message();
    assert_eq!(pair.channel.take(&mut message.clone(), 2), Incoming::Message);
    assert_eq!(pair.channel.take(&mut message.clone(), 2), Incoming::Unsealed(Unsealed::Replayed));
    let next = pair.message();
    assert_eq!(pair.unseal(&mut next.clone(), 2), Err(Unsealed::Forged), "reflected");
    let other = SocketAddrV4::new(*HOST.ip(), 5001);
    let named = datagram::named_key(&request).unwrap();
    let refused = pair.sessions.unseal(other, &mut request.clone(), named, 2);
    assert_eq!(refused, Err(Unsealed::Session));
    let mut again = Pair::new();
    again.nonces = 100;
    again.meet(0);
    let mut own = again.request(1);
    assert_eq!(again.unseal(&mut own, 1), Ok(Role::Control));
    assert_eq!(again.unseal(&mut request.clone(), 1), Err(Unsealed::Replayed), "of another session");
    let mut later = request;
    later[16] = 50;
    assert_eq!(again.unseal(&mut later, 1), Err(Unsealed::Forged), "of another session, renumbered");
}

#[test]
fn a_bit_changed_anywhere_is_refused_by_both_ends() {
    let mut pair = Pair::new();
    pair.meet(0);
    let mut first = pair.request(1);
    assert_eq!(pair.unseal(&mut first, 1), Ok(Role::Control));
    let (request, message) = (pair.request(1), pair.message());
    for bit in 0..request.len() * 8 {
        let mut forged = request.clone();
        forged[bit / 8] ^= 1 << (bit % 8);
        let named = datagram::named_key(&forged);
        let taken = named.map(|named| pair.sessions.unseal(HOST, &mut forged, named, 2));
        assert!(!matches!(taken, Some(Ok(_))), "request, bit {bit}");
    }
    for bit in 0..message.len() * 8 {
        let mut forged = message.clone();
        forged[bit / 8] ^= 1 << (bit % 8);
        assert_ne!(pair.channel.take(&mut forged, 2), Incoming::Message, "message, bit {bit}");
    }
    assert_eq!(pair.unseal(&mut request.clone(), 2), Ok(Role::Control));
    assert_eq!(pair.channel.take(&mut message.clone(), 2), Incoming::Message);
}

#[test]
fn an_open_sent_again_opens_nothing_more_and_drives_no_proven_session_out() {
    let mut pair = Pair::new();
    pair.meet(0);
    let mut request = pair.request(1);
    assert_eq!(pair.unseal(&mut request, 1), Ok(Role::Control));
    let mut others = std::vec::Vec::new();
    for nonce in 0..20_u8 {
        let open = handshake::Open {
            key_id: 1,
            request_id: 1,
            cookie: COOKIE,
            host: Nonce([nonce.wrapping_add(100); 16]),
        };
        others.push(open.bytes(DEVICE, KEY));
    }
    for open in &others {
        let first = pair.open(open, 2).unwrap();
        assert_eq!(pair.open(open, 2), Ok(first), "the same answer");
    }
    assert!(pair.sessions.has(HOST));
    let mut message = pair.message();
    assert_eq!(pair.channel.take(&mut message, 3), Incoming::Message);
}

#[test]
fn no_session_without_cookie_key_or_for_another_device() {
    let mut pair = Pair::new();
    let open = handshake::Open { key_id: 1, request_id: 1, cookie: COOKIE, host: Nonce([1; 16]) };
    let refused = |pair: &mut Pair, open: handshake::Open, to: Identity, key: Key| {
        pair.sessions.open(&open.bytes(to, key), (HOST, COOKIE), (DEVICE, to), &keyring(), 0).unwrap_err()
    };
    let guessed = handshake::Open { cookie: Cookie([4; 8]), ..open };
    assert_eq!(refused(&mut pair, guessed, DEVICE, KEY), NotOpened::Cookie(guessed));
    assert_eq!(refused(&mut pair, open, DEVICE, Key([8; 32])), NotOpened::Forged);
    let unknown = handshake::Open { key_id: 2, ..open };
    assert_eq!(refused(&mut pair, unknown, DEVICE, KEY), NotOpened::Key(unknown));
    let other = Identity { module: ModuleId([9; 6]), boot: 7 };
    assert_eq!(refused(&mut pair, open, other, KEY), NotOpened::Identity);
    assert!(!pair.sessions.has(HOST));
}

#[test]
fn a_silent_session_is_given_up_and_an_old_one_replaced_without_a_gap() {
    let mut pair = Pair::new();
    pair.meet(0);
    let mut request = pair.request(1);
    assert_eq!(pair.unseal(&mut request, 1), Ok(Role::Control));
    let hour_us = 3_600_000_000;
    let mut now_us = 1;
    while now_us < hour_us - 1_000_000 {
        now_us += 1_000_000;
        let mut message = pair.message();
        assert_eq!(pair.channel.take(&mut message, now_us), Incoming::Message);
    }
    let open = pair.request(hour_us);
    assert_eq!(open.len(), handshake::OPEN_LEN, "a new session is asked for");
    let mut opened = pair.open(&open, hour_us).unwrap();
    let mut late = pair.message();
    assert_eq!(pair.channel.take(&mut opened, hour_us), Incoming::Session);
    assert_eq!(pair.channel.take(&mut late, hour_us), Incoming::Message, "sealed under the old one");
    let mut request = pair.request(hour_us);
    assert_eq!(pair.unseal(&mut request, hour_us), Ok(Role::Control));
    let mut message = pair.message();
    assert_eq!(pair.channel.take(&mut message, hour_us), Incoming::Message);
    assert!(pair.request(hour_us + 4_000_000).len() == handshake::OPEN_LEN, "the device has fallen silent");
}

#[test]
fn a_session_whose_successor_is_refused_seals_nine_renewals_of_ten_meanwhile() {
    let mut pair = Pair::new();
    pair.meet(0);
    let mut request = pair.request(1);
    assert_eq!(pair.unseal(&mut request, 1), Ok(Role::Control));
    pair.channel.rekey(2, Key([8; 32]));
    let mut asked_s = std::vec::Vec::new();
    for second in 1..=60_u64 {
        let now_us = second * 1_000_000;
        let mut renewal = pair.request(now_us);
        if let Some(open) = handshake::Open::read(&renewal) {
            asked_s.push(second);
            let refused =
                Refused { request_id: open.request_id, kind: handshake::OPEN, refusal: Refusal::Full };
            let mut bytes = [0; DATAGRAM_MAX];
            let length = Message::Refused(refused).encode(DEVICE, &mut bytes).unwrap();
            assert_eq!(pair.channel.take(&mut bytes[..length], now_us), Incoming::Full);
        } else {
            assert_eq!(pair.unseal(&mut renewal, now_us), Ok(Role::Control), "at {second} s");
        }
        let mut message = pair.message();
        assert_eq!(pair.channel.take(&mut message, now_us), Incoming::Message);
    }
    assert_eq!(asked_s, [1, 11, 21, 31, 41, 51]);
}

#[test]
fn only_a_device_that_has_no_such_key_refuses_for_good() {
    let mut pair = Pair::new();
    pair.meet(0);
    // The device is silent for a while: a session is asked for with the cookie that is known.
    let mut now_us = 0;
    let mut refused = |pair: &mut Pair, refusal| {
        now_us += 5_000_000;
        let mut open = pair.request(now_us);
        if Header::open(&open).unwrap().0.kind != handshake::OPEN {
            pair.give_cookie(&open, now_us);
            open = pair.request(now_us);
        }
        let request_id = handshake::Open::read(&open).unwrap().request_id;
        let mut bytes = [0; DATAGRAM_MAX];
        let message = Message::Refused(Refused { request_id, kind: handshake::OPEN, refusal });
        let length = message.encode(DEVICE, &mut bytes).unwrap();
        let incoming = pair.channel.take(&mut bytes[..length], now_us);
        (incoming, Header::open(&pair.request(now_us)).unwrap().0.kind == handshake::OPEN)
    };
    assert_eq!(refused(&mut pair, Refusal::Full), (Incoming::Full, true), "the cookie is good");
    assert_eq!(refused(&mut pair, Refusal::BadCookie), (Incoming::Session, false), "asks for another");
    assert_eq!(refused(&mut pair, Refusal::NoSuchKey), (Incoming::Refused, false));
}
