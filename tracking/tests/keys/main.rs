//! A device with keys and the tracker's links to it: what genuine datagrams do, and what an attacker without a key cannot do.
//!
//! ```text
//!   Links ─▶ sealed ─▶ Module ─▶ sealed ─▶ attacker ─▶ flipped, cut, again, made up, in clear ─▶ Links ─▶ decode
//! ```
//!
//! 100 000 datagrams in every run, and a million with `KEHAI_ATTACK=1000000`; the same ones each time.
#![allow(missing_docs, reason = "a test program")]

use std::collections::BTreeMap;
use std::net::{SocketAddr, SocketAddrV4};
use std::sync::Arc;

use kehai::device::{About, Module, Settings};
use kehai::link::{Dropped, Lane, Outbox};
use kehai::seal::{Key, Keyring, Nonces, Role};
use kehai::wire::{
    Cookie, DATAGRAM_MAX, Header, Identity, Info, Message, ModuleId, Report, ReportHead, Request, Subscribed,
};
use kehai_tracking::keys::{Arrived, Claimed, Clear, Keys, Links, Standing};
use kehai_tracking::session::datagram::Datagram;
use kehai_tracking::snapshot::Drops;

const ID: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);
const OTHER: ModuleId = ModuleId([2, 0, 0, 0, 0, 2]);
const HOST: SocketAddrV4 = SocketAddrV4::new(std::net::Ipv4Addr::new(10, 0, 0, 7), 5000);

fn at(last: u8) -> SocketAddr {
    SocketAddr::from(([10, 0, 0, last], 4040))
}

#[derive(Default)]
struct Sent(Vec<Vec<u8>>);

impl Outbox for Sent {
    fn try_send_to(&mut self, _: Lane, _: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        self.0.push(datagram.to_vec());
        Ok(())
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

fn keys() -> Keys {
    let mut keys = Keys::new(Key([1; 32]));
    keys.insert(ID, Claimed { name: "left".to_owned(), generation: 1 });
    keys
}

/// A device that knows its keys, and the tracker's links, on one table.
struct Table {
    module: Box<Module<1>>,
    links: Links,
    drops: Drops,
    now_us: u64,
    requests: u32,
    cookie: Cookie,
}

impl Table {
    fn new(device_keys: &[u8]) -> Self {
        let about =
            About { module: ID, secret: [7; 16], firmware: "1", build: "", board: "", watchdog_reset: false };
        let mut module = Box::new(Module::new(about));
        module.begin(3, Settings::new());
        module.begin_keys(Keyring::restored(Ok(device_keys)));
        let links = Links::new(Arc::new(keys()), Role::Control, Nonces::new([3; 16]), Clear::Listed);
        Self { module, links, drops: Drops::default(), now_us: 0, requests: 0, cookie: Cookie::NONE }
    }

    fn met() -> Self {
        let mut table = Self::new(&keys().records(ID, &[1]));
        for _ in 0..6 {
            table.ask(Request::Subscribe { t1: [0; 8] });
        }
        table
    }

    /// What the links send for a request.
    fn request(&mut self, request: Request<'_>) -> Vec<Vec<u8>> {
        self.requests += 1;
        self.now_us += 1000;
        let mut bytes = [0; DATAGRAM_MAX];
        let to = Identity { module: ID, boot: 3 };
        let length = request.encode(to, self.requests, self.cookie, &mut bytes).unwrap();
        let mut sent = Vec::new();
        self.links.send(&bytes[..length], at(1), self.now_us, |bytes| sent.push(bytes.to_vec()));
        sent
    }

    /// Which device is asked at the address when this one is to be.
    fn asked(&mut self, module: ModuleId) -> Option<ModuleId> {
        let mut bytes = [0; DATAGRAM_MAX];
        let to = Identity { module, boot: 0 };
        let length = Request::Subscribe { t1: [0; 8] }.encode(to, 1, Cookie::NONE, &mut bytes).unwrap();
        let mut asked = None;
        let send = |bytes: &[u8]| asked = Header::open(bytes).ok().map(|(header, _)| header.identity.module);
        self.links.send(&bytes[..length], at(1), self.now_us, send);
        asked
    }

    /// Asks, and hands on what is sent until nothing more is: the messages that came through.
    fn ask(&mut self, request: Request<'_>) -> Vec<Vec<u8>> {
        let (mut under_way, mut came) = (self.request(request), Vec::new());
        while let Some(mut bytes) = under_way.pop() {
            let mut answers = Sent::default();
            self.module.receive(HOST, &mut bytes, self.now_us, &mut answers);
            for mut answer in answers.0 {
                let send = |bytes: &[u8]| under_way.push(bytes.to_vec());
                let arrived = self.links.take(&mut answer, at(1), self.now_us, &mut self.drops, send);
                if arrived == Arrived::Message {
                    if let Ok((_, Message::Cookie { cookie, .. })) = Message::decode(&answer) {
                        self.cookie = cookie;
                    }
                    came.push(answer);
                }
            }
        }
        came
    }

    /// What the device sends now, sealed: an answer on its way.
    fn message(&mut self) -> Vec<u8> {
        let mut request = self.request(Request::GetSettings).pop().expect("a request");
        let mut sent = Sent::default();
        self.module.receive(HOST, &mut request, self.now_us, &mut sent);
        sent.0.remove(0)
    }

    /// Whether the links take a datagram for one of a device to be used.
    fn takes(&mut self, bytes: &[u8], from: SocketAddr) -> bool {
        let mut bytes = bytes.to_vec();
        let arrived = self.links.take(&mut bytes, from, self.now_us, &mut self.drops, |_| {});
        let Ok(datagram) = Datagram::decode(&bytes) else { return false };
        match arrived {
            Arrived::Message => true,
            Arrived::Clear => self.links.believe(&datagram, &mut self.drops),
            Arrived::Full | Arrived::Dropped => false,
        }
    }
}

fn encoded(from: ModuleId, message: Message<'_>) -> Vec<u8> {
    let mut bytes = [0; DATAGRAM_MAX];
    let length = message.encode(Identity { module: from, boot: 3 }, &mut bytes).unwrap();
    bytes[..length].to_vec()
}

/// A scan of the empty room.
fn empty_scan() -> Message<'static> {
    let head = ReportHead { sequence: 1, setup: 1, ..ReportHead::default() };
    Message::Report(Report {
        head,
        candidates: kehai::wire::List::default(),
        unseen: kehai::wire::List::default(),
        sizes: kehai::wire::List::default(),
    })
}

const fn info(name: &str) -> Info<'_> {
    Info {
        request_id: 1,
        version_min: 1,
        version_max: 1,
        firmware: "1",
        build: "",
        board: "",
        name,
        uptime_us: 0,
        setup: 1,
        background_version: 0,
        sensor: None,
    }
}

#[test]
fn a_device_is_met_asked_and_heard_under_its_key() {
    let mut table = Table::met();
    assert_ne!(table.cookie, Cookie::NONE);
    let answers = table.ask(Request::GetSettings);
    let is_settings = |bytes: &Vec<u8>| matches!(Message::decode(bytes), Ok((_, Message::Settings { .. })));
    assert!(answers.iter().any(is_settings));
    let message = table.message();
    assert!(table.takes(&message, at(1)));
    assert_eq!(table.drops, Drops::default(), "nothing was dropped on the way");
    assert_eq!(table.links.standing(ID), Standing::Sealed);
}

#[test]
fn other_keys_are_used_once_they_are_there_and_without_a_gap() {
    let mut table = Table::met();
    let mut next = keys();
    next.insert(ID, Claimed { name: "left".to_owned(), generation: 2 });
    let both = keys().records(ID, &[1, 2]);
    table.module.begin_keys(Keyring::restored(Ok(&both)));
    let message = table.message();
    table.links.change(Arc::new(next));
    assert!(table.takes(&message, at(1)), "under the old key");
    table.now_us += 2_000_000;
    table.ask(Request::GetSettings);
    assert!(!table.ask(Request::GetSettings).is_empty(), "under the new one");
    table.module.begin_keys(Keyring::restored(Ok(&keys().records(ID, &[2]))));
    let message = table.message();
    assert!(table.takes(&message, at(1)), "its session is of the key that stays");
}

#[test]
fn a_device_that_does_not_know_the_sites_key_is_not_heard_and_that_is_counted() {
    let mut table = Table::new(&Keys::new(Key([9; 32])).records(ID, &[1]));
    for _ in 0..6 {
        assert!(table.ask(Request::Subscribe { t1: [0; 8] }).is_empty());
    }
    let mut table = Table::new(&Keys::new(Key([1; 32])).records(ID, &[7]));
    for _ in 0..6 {
        assert!(table.ask(Request::Subscribe { t1: [0; 8] }).is_empty());
    }
    assert!(table.drops.key > 0);
}

#[test]
fn in_a_site_with_keys_others_are_listed_and_not_believed() {
    let mut table = Table::met();
    assert_eq!(table.links.standing(OTHER), Standing::NotBelieved);
    assert!(table.takes(&encoded(OTHER, Message::Info(info("right"))), at(2)), "it is listed");
    assert!(!table.takes(&encoded(OTHER, empty_scan()), at(2)));
    assert!(!table.takes(&encoded(OTHER, Message::Info(info("left"))), at(2)), "the name of one with a key");
    let believing = Links::new(Arc::new(keys()), Role::Control, Nonces::new([3; 16]), Clear::Believed);
    table.links = believing;
    assert!(table.takes(&encoded(OTHER, empty_scan()), at(2)));
    assert!(!table.takes(&encoded(OTHER, Message::Info(info("left"))), at(2)));
    assert!(!table.takes(&encoded(ID, empty_scan()), at(3)), "from elsewhere, in the name of one with a key");
    let mut naming_a_key = encoded(OTHER, empty_scan());
    naming_a_key[15] = 4;
    assert!(!table.takes(&naming_a_key, at(2)), "only what was opened names a key");
}

#[test]
fn a_cookie_in_another_devices_name_ends_no_open_session() {
    let mut both = keys();
    both.insert(OTHER, Claimed { name: "right".to_owned(), generation: 1 });
    let cookie = Message::Cookie { request_id: 9, t1: [0; 8], cookie: Cookie([4; 8]) };
    let cookie = encoded(OTHER, cookie);
    let mut table = Table::met();
    table.links.change(Arc::new(both));
    let message = table.message();
    assert!(!table.takes(&cookie, at(1)));
    assert_eq!(table.drops.clear, 1, "it is counted");
    assert!(table.takes(&message, at(1)), "the session that was open goes on");
    // As after a forged announcement of the other one's address.
    let message = table.message();
    assert_eq!(table.asked(OTHER), None);
    assert!(table.takes(&message, at(1)));
    // Once the first device has been silent for three seconds, another one may have its address.
    table.now_us += 3_000_000;
    assert_eq!(table.asked(ModuleId::ANY), Some(ID));
    table.takes(&cookie, at(1));
    assert_eq!(table.asked(ModuleId::ANY), Some(OTHER));
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Attack {
    Flipped,
    Cut,
    Replayed,
    Renumbered,
    Reflected,
    Elsewhere,
    Forged,
    OpenedForged,
    Downgraded,
    Named,
}

const ALL: [Attack; 10] = [
    Attack::Flipped,
    Attack::Cut,
    Attack::Replayed,
    Attack::Renumbered,
    Attack::Reflected,
    Attack::Elsewhere,
    Attack::Forged,
    Attack::OpenedForged,
    Attack::Downgraded,
    Attack::Named,
];

/// The same row of numbers each time: the finaliser of SplitMix64.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Messages that would show an empty room, move the clock, or pass for the device's own.
fn in_clear(dice: &mut Dice) -> Message<'static> {
    match dice.below(4) {
        0 => empty_scan(),
        1 => Message::Info(info("left")),
        2 => Message::Subscribed(Subscribed {
            request_id: 1,
            t1: [0; 8],
            t2_us: dice.next(),
            t3_us: dice.next(),
            lease_ms: 5000,
            may_control: true,
            subscribers: 1,
        }),
        _ => Message::Done { request_id: dice.next() as u32 },
    }
}

#[test]
fn nothing_made_without_a_key_is_taken_and_each_is_counted() {
    let wanted = std::env::var("KEHAI_ATTACK").ok().and_then(|text| text.parse().ok());
    let datagrams: usize = wanted.unwrap_or(100_000);
    let (mut table, mut dice) = (Table::met(), Dice(7));
    let requests: Vec<Vec<u8>> = (0..10).flat_map(|_| table.request(Request::GetSettings)).collect();
    let taken: Vec<Vec<u8>> = (0..20).map(|_| table.message()).collect();
    assert!(taken.iter().all(|bytes| table.takes(bytes, at(1))));
    let withheld: Vec<Vec<u8>> = (0..20).map(|_| table.message()).collect();
    let mut counted: BTreeMap<Attack, [u64; 5]> = BTreeMap::new();
    for number in 0..datagrams {
        let attack = ALL[number % ALL.len()];
        let row = match attack {
            Attack::Replayed => &taken,
            Attack::Reflected => &requests,
            _ => &withheld,
        };
        let (mut from, mut bytes) = (at(1), row[dice.below(row.len())].clone());
        match attack {
            Attack::Flipped => {
                let bit = dice.below(bytes.len() * 8);
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            Attack::Cut => bytes.truncate(dice.below(bytes.len())),
            Attack::Renumbered => bytes[16..24].copy_from_slice(&dice.next().to_le_bytes()),
            Attack::Reflected => bytes[14] |= 0x80,
            Attack::Elsewhere => from = at(2),
            Attack::Forged => bytes[24..].iter_mut().for_each(|byte| *byte = dice.next() as u8),
            Attack::OpenedForged => {
                bytes.truncate(61);
                bytes[14] = 0x87;
                bytes[15] = 1 + dice.below(6) as u8;
                (16..61).for_each(|place| bytes[place] = dice.next() as u8);
                bytes[16..24].fill(0);
                bytes[44] = bytes[15];
            }
            Attack::Downgraded => bytes = encoded(ID, in_clear(&mut dice)),
            Attack::Named => bytes = encoded(OTHER, in_clear(&mut dice)),
            Attack::Replayed => {}
        }
        let before = table.drops;
        let taken = table.takes(&bytes, from);
        // Answers of a device without a key only say which it is: the registry asks for none of these.
        let is_listed = attack == Attack::Named && bytes[14] < 0x90;
        let is_other = attack == Attack::Flipped && bytes[8..14] != ID.0;
        assert!(!taken || is_listed || is_other, "{attack:?}, number {number}: {bytes:02x?}");
        let now = table.drops;
        let changes = [
            now.forged - before.forged,
            now.replayed - before.replayed,
            now.clear - before.clear,
            now.key - before.key,
        ];
        let row = counted.entry(attack).or_default();
        row.iter_mut().zip(changes).for_each(|(sum, change)| *sum += change);
        // What is no datagram of ours, or of another device, is counted where it is decoded or admitted.
        row[4] += u64::from(changes == [0; 4]);
        assert!(changes.iter().sum::<u64>() <= 1);
    }
    println!("{datagrams} datagrams without a key: 0 taken");
    println!("{:<14}{:>9}{:>9}{:>9}{:>9}{:>9}", "", "forged", "replayed", "clear", "key", "other");
    for (attack, row) in &counted {
        println!("{:<14}{}", format!("{attack:?}"), row.map(|count| format!("{count:>9}")).concat());
    }
    let message = table.message();
    assert!(table.takes(&message, at(1)), "the device is heard as before");
    assert!(!table.takes(&message, at(1)), "and not twice");
}
