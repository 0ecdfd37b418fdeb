//! What an attacker without a key cannot do to a module that has keys, in as many datagrams as there is time for.
//!
//! ```text
//!   genuine requests ─▶ recorded ─┬ flipped, cut, renumbered, sent again, sent back, from elsewhere ─▶ module
//!   nothing ──────────────────────┴ made up: sealed, open, in clear, of other versions and identities ─▶
//! ```
//!
//! 100 000 datagrams in every run, and a million with `KEHAI_ATTACK=1000000`; the same ones each time.

use std::collections::BTreeMap;

use kehai::link::Outbox;
use kehai::seal::handshake::Open;
use kehai::seal::{Key, Nonce};
use kehai::wire::{Cookie, Counter, DATAGRAM_MAX, Header, Identity, ModuleId, Request};

use super::{ID, Module, Program, Role, Sent, claimed, host};

/// How a datagram comes about.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Attack {
    Flipped,
    Cut,
    Replayed,
    Renumbered,
    Reflected,
    Elsewhere,
    Forged,
    OpenForged,
    OpenReplayed,
    WrongDevice,
    WrongStart,
    Downgraded,
    Clear,
}

const ALL: [Attack; 13] = [
    Attack::Flipped,
    Attack::Cut,
    Attack::Replayed,
    Attack::Renumbered,
    Attack::Reflected,
    Attack::Elsewhere,
    Attack::Forged,
    Attack::OpenForged,
    Attack::OpenReplayed,
    Attack::WrongDevice,
    Attack::WrongStart,
    Attack::Downgraded,
    Attack::Clear,
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

    fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.byte()).collect()
    }
}

/// What an attacker who sees everything has recorded.
struct Recorded {
    /// Wishes for a session that were granted.
    opens: Vec<Vec<u8>>,
    /// Sealed requests that the module has taken.
    taken: Vec<Vec<u8>>,
    /// Sealed requests that it has not seen.
    withheld: Vec<Vec<u8>>,
    /// What it has sent, sealed.
    sent: Vec<Vec<u8>>,
    /// The cookie of the host's address, which is no secret.
    cookie: Cookie,
}

/// A module with keys whose owner has talked to it, and what there was to see.
fn victim() -> (Box<Module<1>>, Program, Recorded) {
    let mut module = claimed();
    let mut own = Program::of(5000, Role::Control);
    let mut seen = Recorded {
        opens: Vec::new(),
        taken: Vec::new(),
        withheld: Vec::new(),
        sent: Vec::new(),
        cookie: Cookie::NONE,
    };
    let subscribe = Request::Subscribe { t1: [0; 8] };
    for turn in 0..40 {
        let request = own.sealed(if turn < 8 { subscribe } else { Request::GetSettings });
        let is_open = request.len() == kehai::seal::handshake::OPEN_LEN && request[14] == 0x0b;
        let mut sent = Sent::default();
        module.receive(own.at, &mut request.clone(), own.now_us, &mut sent);
        let answers: Vec<Vec<u8>> = sent.0.into_iter().map(|(_, bytes)| bytes).collect();
        answers.iter().for_each(|answer| own.take(answer));
        match (is_open, request[15]) {
            (true, _) => seen.opens.push(request),
            (false, 0) => {}
            (false, _) => {
                seen.taken.push(request);
                seen.sent.extend(answers.into_iter().filter(|answer| answer[15] != 0));
            }
        }
    }
    for request in [Request::Restart, Request::Learn { scans: 0 }, Request::SetSettings { text: "skip=3" }] {
        seen.withheld.extend((0..5).map(|_| own.sealed(request)));
    }
    seen.cookie = own.cookie;
    (module, own, seen)
}

/// A datagram of this kind, and the port of 10.0.0.7 that it says it is from.
fn made(attack: Attack, seen: &Recorded, dice: &mut Dice) -> (u16, Vec<u8>) {
    let pick = |row: &[Vec<u8>], dice: &mut Dice| row[dice.below(row.len())].clone();
    let mut bytes = match attack {
        Attack::Replayed => pick(&seen.taken, dice),
        Attack::OpenReplayed => pick(&seen.opens, dice),
        Attack::Reflected => pick(&seen.sent, dice),
        _ => pick(&seen.withheld, dice),
    };
    match attack {
        Attack::Flipped => {
            let bit = dice.below(bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        Attack::Cut => bytes.truncate(dice.below(bytes.len())),
        Attack::Renumbered => bytes[16..24].copy_from_slice(&dice.next().to_le_bytes()),
        Attack::Reflected => bytes[14] &= if dice.below(2) == 0 { 0x7f } else { 0xff },
        Attack::Forged => {
            let length = dice.below(300);
            bytes.truncate(24);
            bytes.extend(dice.bytes(16 + length));
            bytes[14] = dice.byte() & 0x7f;
        }
        Attack::OpenForged => {
            let host = Nonce(dice.bytes(16).try_into().unwrap());
            let key = Key(dice.bytes(32).try_into().unwrap());
            let key_id = [1, 2, 3, 255, dice.byte().max(1)][dice.below(5)];
            let open = Open { key_id, request_id: 1, cookie: seen.cookie, host };
            bytes = open.bytes(Identity { module: ID, boot: 3 }, key).to_vec();
        }
        Attack::WrongDevice => bytes[8 + dice.below(6)] ^= dice.byte().max(1),
        Attack::WrongStart => bytes[4 + dice.below(4)] ^= dice.byte().max(1),
        Attack::Downgraded | Attack::Clear => {
            let manifest = super::images::manifest(&[1; 16], [1, 0, 0]);
            let requests = super::requests(&[], &manifest);
            let (_, request) = requests[dice.below(requests.len())];
            let mut room = [0; DATAGRAM_MAX];
            let to = Identity { module: if dice.below(2) == 0 { ID } else { ModuleId::ANY }, boot: 3 };
            let length = request.encode(to, 5, seen.cookie, &mut room).unwrap();
            bytes = room[..length].to_vec();
            if attack == Attack::Downgraded {
                bytes[3] = dice.byte();
            }
        }
        Attack::Replayed | Attack::OpenReplayed | Attack::Elsewhere => {}
    }
    (if attack == Attack::Elsewhere { 5001 } else { 5000 }, bytes)
}

/// Everything about a module that a request might change.
fn state(module: &Module<1>) -> String {
    let (wish, settings, version) =
        (module.wish(), module.settings(), module.pipeline().background().version());
    format!("{wish:?} {settings:?} {version} {:?}", module.pipeline().judgement().learning)
}

#[test]
fn nothing_made_without_a_key_is_taken_and_each_is_counted_under_its_name() {
    let wanted = std::env::var("KEHAI_ATTACK").ok().and_then(|text| text.parse().ok());
    let datagrams: u32 = wanted.unwrap_or(100_000);
    let (mut module, mut own, seen) = victim();
    assert!(seen.taken.len() > 20 && seen.withheld.len() == 15 && !seen.opens.is_empty());
    let (before, mut dice) = (state(&module), Dice(7));
    let mut counted: BTreeMap<Attack, BTreeMap<&str, u32>> = BTreeMap::new();
    for number in 0..datagrams {
        let attack = ALL[number as usize % ALL.len()];
        let (port, mut bytes) = made(attack, &seen, &mut dice);
        let counters = *module.counters();
        let (length, kind) = (bytes.len(), Header::open(&bytes).map(|(header, _)| header.kind));
        let mut sent = Sent::default();
        let work = module.receive(host(port), &mut bytes, own.now_us, &mut sent);
        assert_eq!(work, None, "{attack:?}, number {number}");
        assert_eq!(state(&module), before, "{attack:?}, number {number}");
        for (to, answer) in &sent.0 {
            // In clear: a cookie, a refusal, who it is, or the same answer to an open that was granted before.
            let is_clear = answer[15] == 0 || answer[14] == 0x87;
            assert!(*to == host(port) && is_clear, "{attack:?}, number {number}: {answer:02x?}");
            let is_info = kind == Ok(0x02);
            assert!(answer.len() <= length || is_info, "{attack:?}: more bytes than were sent");
        }
        let changed =
            Counter::ALL.iter().filter(|counter| module.counters().get(**counter) != counters.get(**counter));
        let names: Vec<&str> = changed.map(|counter| counter.name()).collect();
        let is_told = kind == Ok(0x02) && names.is_empty() && !sent.0.is_empty();
        assert!(names.len() == 1 || is_told, "{attack:?}, number {number}: counted as {names:?}");
        let name = names.first().copied().unwrap_or("who it is");
        *counted.entry(attack).or_default().entry(name).or_default() += 1;
    }
    println!("{datagrams} datagrams without a key: 0 taken");
    for (attack, names) in &counted {
        println!("{attack:?}: {names:?}");
    }
    assert_eq!(own.ask(&mut module, Request::GetSettings), "done", "its owner is heard as before");
}

/// Nothing that is sealed leaves a module without keys, and nothing in clear one that has some.
#[test]
fn a_module_with_keys_tells_a_stranger_who_it_is_and_no_more() {
    let mut module = claimed();
    let mut stranger = Program::in_clear(6000).met(&mut module);
    let mut heard = Vec::new();
    for (_, request) in super::requests(&[], &[0; 192]) {
        heard.extend(stranger.send(&mut module, request));
    }
    let mut out = Sent::default();
    module.poll(60_000_000, &mut out);
    assert!(out.is_empty(kehai::link::Lane::Place(0)) && out.0.is_empty());
    let kinds: Vec<u8> = heard.iter().map(|bytes| bytes[14]).collect();
    assert!(kinds.iter().all(|kind| matches!(kind, 0x80 | 0x81 | 0x83)), "{kinds:02x?}");
}
