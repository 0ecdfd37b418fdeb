//! Sealed datagrams from anywhere, at a module with keys and at a host: no panic, and nothing made without the key is taken.
//!
//! ```text
//!   input:  step │ step │ …
//!   step:   0–199   that many bytes, as a datagram to both
//!           200–    a genuine datagram of the other end; the next two bytes say which of its bytes is changed, and by what
//! ```
#![no_main]

use std::net::{Ipv4Addr, SocketAddrV4};

use kehai::device::{About, Module, Settings};
use kehai::link::{Dropped, Lane, Outbox};
use kehai::seal::{Channel, Incoming, Key, Keyring, Nonce};
use kehai::wire::{Cookie, Counter, DATAGRAM_MAX, Identity, Message, ModuleId, Request};
use libfuzzer_sys::fuzz_target;

const ID: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);
const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), 5000);

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

struct Pair {
    module: Module<1>,
    channel: Channel,
    cookie: Cookie,
    nonces: u8,
    now_us: u64,
}

impl Pair {
    fn new() -> Self {
        let mut record = [9; 34];
        (record[0], record[1]) = (1, 3);
        let about =
            About { module: ID, secret: [7; 16], firmware: "", build: "", board: "", watchdog_reset: false };
        let mut module = Module::new(about);
        module.begin(1, Settings::new());
        module.begin_keys(Keyring::restored(Ok(&record)));
        let channel = Channel::new(ID, 1, Key([9; 32]));
        let mut pair = Self { module, channel, cookie: Cookie::NONE, nonces: 0, now_us: 0 };
        for _ in 0..4 {
            let mut request = pair.request();
            for mut answer in pair.deliver(&mut request) {
                if pair.channel.take(&mut answer, pair.now_us) == Incoming::Message
                    && let Ok((_, Message::Cookie { cookie, .. })) = Message::decode(&answer)
                {
                    pair.cookie = cookie;
                }
            }
        }
        assert!(pair.channel.is_open());
        pair
    }

    fn request(&mut self) -> Vec<u8> {
        let mut bytes = [0; DATAGRAM_MAX];
        let to = Identity { module: ID, boot: 1 };
        let length = Request::GetSettings.encode(to, 7, self.cookie, &mut bytes).unwrap();
        self.nonces = self.nonces.wrapping_add(1);
        let length = self.channel.seal(&mut bytes, length, Nonce([self.nonces; 16]), self.now_us);
        bytes[..length].to_vec()
    }

    fn deliver(&mut self, bytes: &mut [u8]) -> Vec<Vec<u8>> {
        self.now_us += 1000;
        let mut sent = Sent::default();
        self.module.receive(HOST, bytes, self.now_us, &mut sent);
        sent.0
    }
}

fuzz_target!(|input: &[u8]| {
    let mut pair = Pair::new();
    let mut rest = input;
    while let Some((&step, more)) = rest.split_first() {
        rest = more;
        if step < 200 {
            let (bytes, more) = rest.split_at(rest.len().min(step.into()));
            rest = more;
            let mut datagram = [&[0xe6, 0xb0, 0x97, 1][..], bytes].concat();
            pair.deliver(&mut datagram.clone());
            assert_ne!(pair.channel.take(&mut datagram, pair.now_us), Incoming::Message);
            continue;
        }
        let (&place, &change) = (rest.first().unwrap_or(&0), rest.get(1).unwrap_or(&0));
        rest = rest.get(2..).unwrap_or(&[]);
        let settings = |module: &Module<1>| module.counters().get(Counter::SealedForged);
        let before = settings(&pair.module);
        let mut request = pair.request();
        let at = usize::from(place) % request.len();
        request[at] ^= change;
        let answers = pair.deliver(&mut request);
        // The first three bytes say whether it is ours, the fourth which version, the kind whether it opens a session.
        if change != 0 && at > 15 {
            assert!(settings(&pair.module) > before || at < 24, "taken, though byte {at} was changed");
        }
        for answer in answers {
            let at = usize::from(place) % answer.len();
            let mut forged = answer.clone();
            forged[at] ^= change;
            let is_taken = pair.channel.take(&mut forged, pair.now_us) == Incoming::Message;
            assert!(!is_taken || change == 0, "taken, though byte {at} was changed");
        }
    }
});
