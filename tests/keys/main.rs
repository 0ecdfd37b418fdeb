//! Who may ask a module what: each request in clear and by the holder of each key, at a module with keys and at one without.
//!
//! ```text
//!   Channel ─▶ sealed ─▶ Module::receive ─▶ sealed ─▶ Channel ─▶ answer
//! ```
//!
//! The table of docs/wire.md is what these tests print.

mod attack;
mod exchange;
mod images;
mod python;

use std::net::{Ipv4Addr, SocketAddrV4};

use kehai::device::{About, ImageWork, Module, Settings, Stored};
use kehai::link::{Dropped, Lane, Outbox};
use kehai::seal::{Channel, Incoming, Key, Keyring, LABEL_ID, Nonce, Role};
use kehai::update::manifest::MANIFEST_LEN;
use kehai::update::standing::Standing;
use kehai::wire::{Cookie, Counter, DATAGRAM_MAX, Identity, Message, ModuleId, Refusal, Request};

const ID: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);
const LABEL: [u8; 16] = [5; 16];

/// Keeps what a module sends.
#[derive(Default)]
struct Sent(Vec<(SocketAddrV4, Vec<u8>)>);

impl Outbox for Sent {
    fn try_send_to(&mut self, _: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        self.0.push((to, datagram.to_vec()));
        Ok(())
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

fn host(port: u16) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), port)
}

const fn key(role: Role) -> (u8, Key) {
    match role {
        Role::Label => (LABEL_ID, Key([0; 32])),
        Role::Read => (1, Key([11; 32])),
        Role::Raw => (2, Key([12; 32])),
        Role::Control => (3, Key([13; 32])),
    }
}

fn records(roles: &[Role]) -> Vec<u8> {
    roles
        .iter()
        .flat_map(|&role| {
            let (id, key) = key(role);
            [id, role.into()].into_iter().chain(key.0)
        })
        .collect()
}

fn module(keyring: Keyring) -> Box<Module<1>> {
    started(3, [7; 16], keyring)
}

fn started(boot: u32, secret: [u8; 16], keyring: Keyring) -> Box<Module<1>> {
    let about = About { module: ID, secret, firmware: "1", build: "", board: "pc", watchdog_reset: false };
    let mut module = Box::new(Module::new(about));
    module.begin(boot, Settings::new());
    module.begin_keys(keyring);
    module
}

fn owned() -> Keyring {
    let mut keyring = Keyring::restored(Ok(&records(&[Role::Read, Role::Raw, Role::Control])));
    keyring.set_label(&LABEL);
    keyring
}

fn claimed() -> Box<Module<1>> {
    let mut module = module(owned());
    module.begin_images(Ok(Standing { room: 16, ..Standing::NO_BOOT_LOADER }));
    module
}

fn unclaimed() -> Box<Module<1>> {
    let mut keyring = Keyring::new();
    keyring.set_label(&LABEL);
    module(keyring)
}

/// A program of a host, with a key or without.
struct Program {
    at: SocketAddrV4,
    channel: Option<Channel>,
    cookie: Cookie,
    requests: u32,
    now_us: u64,
    /// What its last request asks of flash.
    work: Option<ImageWork>,
}

impl Program {
    fn in_clear(port: u16) -> Self {
        Self { at: host(port), channel: None, cookie: Cookie::NONE, requests: 0, now_us: 1000, work: None }
    }

    fn with(port: u16, id: u8, key: Key) -> Self {
        Self { channel: Some(Channel::new(ID, id, key)), ..Self::in_clear(port) }
    }

    fn of(port: u16, role: Role) -> Self {
        let (id, known) = key(role);
        Self::with(port, id, if role == Role::Label { Key::of_label(&LABEL) } else { known })
    }

    /// A request as it is sent.
    fn sealed(&mut self, request: Request<'_>) -> Vec<u8> {
        self.requests += 1;
        self.now_us += 1000;
        let mut bytes = [0; DATAGRAM_MAX];
        let to = Identity { module: ID, boot: 3 };
        let mut length = request.encode(to, self.requests, self.cookie, &mut bytes).unwrap();
        if let Some(channel) = &mut self.channel {
            let mut fresh = [0; 16];
            fresh[..4].copy_from_slice(&self.requests.to_le_bytes());
            (fresh[4], fresh[5]) = (self.at.port() as u8, (self.at.port() >> 8) as u8);
            length = channel.seal(&mut bytes, length, Nonce(fresh), self.now_us);
        }
        bytes[..length].to_vec()
    }

    /// What a datagram of the module says, in clear.
    fn opened(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        let mut bytes = bytes.to_vec();
        match &mut self.channel {
            None => Some(bytes),
            Some(channel) => {
                let incoming = channel.take(&mut bytes, self.now_us);
                (incoming == Incoming::Message).then_some(bytes)
            }
        }
    }

    /// Takes a datagram of the module: a cookie is kept.
    fn take(&mut self, bytes: &[u8]) {
        let opened = self.opened(bytes);
        if let Some(Ok((_, Message::Cookie { cookie, .. }))) = opened.as_deref().map(Message::decode) {
            self.cookie = cookie;
        }
    }

    /// One request, and what the module sends this program.
    fn send(&mut self, module: &mut Module<1>, request: Request<'_>) -> Vec<Vec<u8>> {
        let mut bytes = self.sealed(request);
        let mut sent = Sent::default();
        self.work = module.receive(self.at, &mut bytes, self.now_us, &mut sent);
        let at = self.at;
        let mine = sent.0.into_iter().filter(|(to, _)| *to == at);
        mine.filter_map(|(_, bytes)| self.opened(&bytes)).collect()
    }

    /// Asks until there is an answer: what it is, in a word.
    fn ask(&mut self, module: &mut Module<1>, request: Request<'_>) -> String {
        for _ in 0..4 {
            for bytes in self.send(module, request) {
                match Message::decode(&bytes).unwrap().1 {
                    Message::Cookie { cookie, .. } => self.cookie = cookie,
                    Message::Refused(refused) => return format!("{:?}", refused.refusal),
                    Message::Report(_) | Message::Health(_) => {}
                    _ => return "done".into(),
                }
            }
            if self.work.is_some() || module.keys_to_store().is_some() || module.settings_to_store().is_some()
            {
                return "done".into();
            }
        }
        "no answer".into()
    }

    /// A program that has a cookie, and a session if it has a key.
    fn met(mut self, module: &mut Module<1>) -> Self {
        for _ in 0..4 {
            for bytes in self.send(module, Request::Subscribe { t1: [0; 8] }) {
                if let Message::Cookie { cookie, .. } = Message::decode(&bytes).unwrap().1 {
                    self.cookie = cookie;
                }
            }
        }
        self
    }
}

fn requests<'a>(keys: &'a [u8], manifest: &'a [u8; MANIFEST_LEN]) -> [(&'static str, Request<'a>); 15] {
    let absorb =
        kehai::background::Absorb { sequence: 1, first_step: 1, last_step: 1, nearest_mm: 1, farthest_mm: 1 };
    [
        ("01 subscribe", Request::Subscribe { t1: [0; 8] }),
        ("02 info", Request::Info),
        ("03 get settings", Request::GetSettings),
        ("04 set settings", Request::SetSettings { text: "skip=1" }),
        ("05 learn", Request::Learn { scans: 50 }),
        ("06 absorb", Request::Absorb(absorb)),
        ("07 profile", Request::Profile { version: 0, parts: 0 }),
        ("08 raw scans", Request::Raw { seconds: 1 }),
        ("09 raw scan again", Request::RawAgain { object: 1, parts: 0 }),
        ("0a restart", Request::Restart),
        ("0c set keys", Request::SetKeys { keys }),
        ("0d update", Request::Update { manifest }),
        ("0e update chunk", Request::UpdateChunk { offset: 0, bytes: &[1; 16] }),
        ("0f update install", Request::UpdateInstall),
        ("10 identify", Request::Identify { seconds: 10 }),
    ]
}

/// Whether the module did what it was asked, or would have, had it a sensor.
fn outcome(answer: &str) -> &str {
    match answer {
        "NoBackground" | "NoSensor" | "Superseded" | "Image(Sequence)" => "done",
        other => other,
    }
}

/// The table of docs/wire.md: no row is written by hand.
#[test]
fn each_request_by_each_right_has_the_outcome_of_the_table() {
    let keys = records(&[Role::Control]);
    let mut table = String::from(
        "| | no keys: in clear | keys: in clear | read | raw | control | label, no keys | label, keys |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    let manifest = images::manifest(&[1; 16], [1, 0, 0]);
    for (name, request) in requests(&keys, &manifest) {
        let mut cells = Vec::new();
        for case in 0..7 {
            let mut module = if matches!(case, 0 | 5) { unclaimed() } else { claimed() };
            module.begin_images(Ok(Standing { room: 16, ..Standing::NO_BOOT_LOADER }));
            let program = match case {
                0 | 1 => Program::in_clear(5000),
                2 => Program::of(5000, Role::Read),
                3 => Program::of(5000, Role::Raw),
                4 => Program::of(5000, Role::Control),
                _ => Program::of(5000, Role::Label),
            };
            let mut program = program.met(&mut module);
            let answer = program.ask(&mut module, request);
            cells.push(match (outcome(&answer), name) {
                ("done", "02 info") if case == 1 => "name only".to_owned(),
                ("NeedsKey", _) => "needs a key".to_owned(),
                ("NotAllowed", _) => "not allowed".to_owned(),
                (other, _) => other.to_owned(),
            });
        }
        table += &format!("| {name} | {} |\n", cells.join(" | "));
    }
    println!("{table}");
    let page = include_str!("../../docs/wire.md");
    assert!(page.contains(&table), "docs/wire.md has another table");
}

#[test]
fn a_module_with_keys_sends_its_reports_sealed_and_to_no_host_without_a_session() {
    let mut module = claimed();
    let mut own = Program::of(5000, Role::Read).met(&mut module);
    let mut stranger = Program::in_clear(6000).met(&mut module);
    assert_eq!(stranger.ask(&mut module, Request::Subscribe { t1: [0; 8] }), "NeedsKey");
    let mut sent = Sent::default();
    module.poll(5_000_000 - 2_000_000, &mut sent);
    assert_eq!(sent.0.len(), 1, "health, to the one subscriber");
    let (to, mut health) = sent.0.remove(0);
    assert_eq!(to, own.at);
    assert!(!matches!(Message::decode(&health), Ok((_, Message::Health(_)))), "it is encrypted");
    let channel = own.channel.as_mut().unwrap();
    assert_eq!(channel.take(&mut health, 3_000_000), Incoming::Message);
    assert!(matches!(Message::decode(&health).unwrap().1, Message::Health(_)));
}

#[test]
fn a_label_gives_first_keys_and_then_opens_nothing() {
    let mut module = unclaimed();
    let mut plain = Program::in_clear(6000).met(&mut module);
    assert_eq!(plain.ask(&mut module, Request::Subscribe { t1: [0; 8] }), "done");
    let mut first = Program::of(5000, Role::Label).met(&mut module);
    let keys = records(&[Role::Read, Role::Control]);
    assert_eq!(first.ask(&mut module, Request::SetKeys { keys: &keys }), "done");
    let stored = Stored { keys: Some(true), ..Stored::default() };
    let mut sent = Sent::default();
    module.begin_storing(first.now_us, &mut sent);
    sent.0.clear();
    module.end_storing(stored, first.now_us, &mut sent);
    let done = sent.0.iter().filter(|(to, _)| *to == first.at).any(|(_, bytes)| {
        let mut bytes = bytes.clone();
        first.channel.as_mut().unwrap().take(&mut bytes, first.now_us) == Incoming::Message
    });
    assert!(done, "answered under the label's session");
    assert_eq!(first.ask(&mut module, Request::SetKeys { keys: &keys }), "no answer", "its session is gone");
    assert_eq!(plain.ask(&mut module, Request::Restart), "NeedsKey");
    let mut sent = Sent::default();
    module.poll(20_000_000, &mut sent);
    assert!(sent.0.iter().all(|(to, _)| *to != plain.at), "the subscriber without a key is gone");
    let mut owner = Program::of(5001, Role::Control).met(&mut module);
    assert_eq!(owner.ask(&mut module, Request::GetSettings), "done");
    let mut again = Program::of(5002, Role::Label).met(&mut module);
    assert_eq!(again.ask(&mut module, Request::SetKeys { keys: &keys }), "no answer");
}

#[test]
fn keys_that_were_not_stored_change_nothing() {
    let mut module = unclaimed();
    let mut first = Program::of(5000, Role::Label).met(&mut module);
    let keys = records(&[Role::Control]);
    assert_eq!(first.ask(&mut module, Request::SetKeys { keys: &keys[..30] }), "BadKeys");
    assert_eq!(first.ask(&mut module, Request::SetKeys { keys: &keys }), "done");
    let mut sent = Sent::default();
    module.begin_storing(first.now_us, &mut sent);
    module.end_storing(Stored { keys: Some(false), ..Stored::default() }, first.now_us, &mut sent);
    let mut plain = Program::in_clear(6000).met(&mut module);
    assert_eq!(plain.ask(&mut module, Request::GetSettings), "done");
}

#[test]
fn each_refused_datagram_is_counted_under_its_own_name() {
    let mut module = claimed();
    let mut own = Program::of(5000, Role::Control).met(&mut module);
    let count = |module: &Module<1>, counter| module.counters().get(counter);
    let mut bytes = [0; DATAGRAM_MAX];
    let to = Identity { module: ID, boot: 3 };
    let length = Request::Restart.encode(to, 99, own.cookie, &mut bytes).unwrap();
    let length = own.channel.as_mut().unwrap().seal(&mut bytes, length, Nonce([1; 16]), own.now_us);
    let mut out = Sent::default();
    let mut forged = bytes;
    forged[length - 1] ^= 1;
    module.receive(own.at, &mut forged[..length], own.now_us, &mut out);
    assert_eq!(count(&module, Counter::SealedForged), 1);
    module.receive(host(7000), &mut { bytes }[..length], own.now_us, &mut out);
    assert_eq!(count(&module, Counter::SealedUnknown), 1);
    module.receive(own.at, &mut { bytes }[..length], own.now_us, &mut out);
    module.receive(own.at, &mut { bytes }[..length], own.now_us, &mut out);
    assert_eq!(count(&module, Counter::SealedReplayed), 1);
    let mut other = Program::with(7001, 3, Key([99; 32])).met(&mut module);
    assert!(count(&module, Counter::OpenForged) >= 1);
    assert_eq!(other.ask(&mut module, Request::GetSettings), "no answer");
    let unknown = count(&module, Counter::RefusedKey);
    Program::with(7002, 9, Key([99; 32])).met(&mut module);
    assert!(count(&module, Counter::RefusedKey) > unknown);
    assert_eq!(count(&module, Counter::SessionsOpened), 1);
    assert!(matches!(Refusal::NeedsKey.counter(), Counter::RefusedKey));
}
