//! The real firmware image with keys, in QEMU: a host with one gets every report while strangers forge, and an update comes by
//! the sealed wire.
//!
//! ```text
//!   Host ─ request ─▶ Sealed ─▶ channel ─▶ datagram ─▶ image
//! ```

use std::cell::{Cell, RefCell};
use std::net::UdpSocket;

use kehai::link::Store;
use kehai::seal::{Channel, Incoming, Key, Nonce, Role};
use kehai::store::flash::FlashStore;
use kehai::store::{KEYS, save_settings};
use kehai::wire::{CHUNK_MAX, Counter, DATAGRAM_MAX, EventKind, Message, ModuleId, Request};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::pc::host::{Host, Way};
use kehai_emulator::qemu::{Forwarded, Line, Qemu};

use crate::support::board::{MAC, image, slot_image, start};
use crate::support::observer::{Observer, SECOND_US, sensor};
use crate::update::{self, board, signed};
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::Config;
use kehai_emulator::urg::model::URG_04LX_UG01;

/// Bytes of the image's flash, and of the file that QEMU takes for it.
const FLASH_LEN: usize = 128 * 1024;
const FILE_LEN: u64 = 16 * 1024 * 1024;

const KEY: (u8, Key) = (3, Key([13; 32]));

/// A way on which everything is sealed.
struct Sealed {
    way: Forwarded,
    channel: RefCell<Channel>,
    sent: Cell<u64>,
}

impl Way for Sealed {
    fn send(&self, datagram: &[u8]) {
        let mut bytes = [0; DATAGRAM_MAX];
        bytes[..datagram.len()].copy_from_slice(datagram);
        self.sent.set(self.sent.get() + 1);
        let mut fresh = [0; 16];
        fresh[..8].copy_from_slice(&self.sent.get().to_le_bytes());
        let now_us = self.way.now_us();
        let length = self.channel.borrow_mut().seal(&mut bytes, datagram.len(), Nonce(fresh), now_us);
        self.way.send(&bytes[..length]);
    }

    fn receive(&self, buffer: &mut [u8]) -> Option<usize> {
        let length = self.way.receive(buffer)?;
        let now_us = self.way.now_us();
        let taken = self.channel.borrow_mut().take(&mut buffer[..length], now_us);
        (taken == Incoming::Message).then_some(length)
    }

    fn now_us(&self) -> u64 {
        self.way.now_us()
    }
}

fn owner(board: &Qemu) -> Host<Sealed> {
    let way = Forwarded::new(board.module(), board.time()).unwrap();
    let channel = RefCell::new(Channel::new(ModuleId(MAC), KEY.0, KEY.1));
    Host::at(Sealed { way, channel, sent: Cell::new(0) })
}

/// The part of a flash that is settings, with a key.
fn claimed(flash: Flash) -> Vec<u8> {
    let record: Vec<u8> = [KEY.0, Role::Control.into()].into_iter().chain(KEY.1.0).collect();
    let mut store = FlashStore::new(flash.clone(), 0..FLASH_LEN as u32).unwrap();
    embassy_futures::block_on(async {
        save_settings(&mut store, &kehai::device::Settings::new()).await.unwrap();
        store.save(KEYS, &record).await.unwrap();
    });
    flash.contents()
}

/// What a stranger sends: in the form of a sealed datagram, of an open, or in clear.
fn forged(number: u32, boot: u32) -> Vec<u8> {
    let mut random = number.wrapping_mul(0x9e37_79b9) | 1;
    let mut byte = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 24) as u8
    };
    let length = [68, 220, 68, 600][number as usize % 4];
    let mut bytes: Vec<u8> = (0..length).map(|_| byte()).collect();
    let mut clear = [0; DATAGRAM_MAX];
    let to = kehai::wire::Identity { module: ModuleId(MAC), boot };
    let cookie = kehai::wire::Cookie([byte(); 8]);
    let length = Request::Restart.encode(to, number, cookie, &mut clear).unwrap();
    // A header as genuine as can be; behind it a session, a counter and a tag that are guessed.
    bytes[..15].copy_from_slice(&clear[..15]);
    bytes[15] = [1, 2, 3, KEY.0][number as usize % 4];
    if number.is_multiple_of(5) {
        return clear[..length].to_vec();
    }
    bytes
}

#[test]
fn a_thousand_forged_datagrams_a_second_cost_no_report_and_change_nothing() {
    const COUNT: u32 = 10_000;
    let Some(image) = image() else { return };
    let path = std::env::temp_dir().join(format!("kehai-sealed-{}", std::process::id()));
    std::fs::write(&path, claimed(Flash::new(FLASH_LEN / PAGE_LEN))).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(FILE_LEN).unwrap();
    let sensor = sensor(Config::new(URG_04LX_UG01), StillRoom::new(URG_04LX_UG01.geometry));
    let board = start(image, Line::AnySpeed(&sensor), Some(&path));
    let mut host = owner(&board);
    host.settle();
    let before = host.health(|_| true);
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    stranger.connect(board.module()).unwrap();
    let begin_us = board.time().now_us();
    for sent in 0..COUNT {
        while board.time().now_us() < begin_us + u64::from(sent) * 1000 {
            host.turn(|_, _| None::<()>);
        }
        stranger.send(&forged(sent, host.identity.boot)).unwrap();
    }
    host.more(20);
    host.assert_every_scan_reported(&sensor);
    let after = host.health(|health| health.head.uptime_us > before.head.uptime_us + 11 * SECOND_US);
    let refused = [
        Counter::SealedUnknown,
        Counter::SealedForged,
        Counter::SealedReplayed,
        Counter::OpenForged,
        Counter::RefusedBadCookie,
        Counter::DatagramsDropped,
        Counter::DatagramsTooShort,
    ];
    let counted = refused.map(|counter| after.counters.get(counter) - before.counters.get(counter));
    println!(
        "{} reports, none missing; of {COUNT} forged datagrams counted: {counted:?}",
        host.reports.len()
    );
    let counted: u32 = counted.iter().sum();
    assert!((COUNT / 2..=COUNT).contains(&counted), "{counted}");
    assert_eq!(after.counters.get(Counter::ReportsDropped), 0);
    assert_eq!(
        (host.identity.boot, after.counters.get(Counter::SessionsOpened)),
        (1, before.counters.get(Counter::SessionsOpened))
    );
    // It may be gone with the whole folder.
    let _ = std::fs::remove_file(path);
}

#[test]
fn an_image_comes_by_the_sealed_wire_and_runs() {
    let Some(images) = slot_image() else { return };
    // What is in the spare slot is no image: it is to come.
    let flash = update::Flash::new(images.0, |_| [0; 192]);
    flash.set_settings(&claimed(Flash::new(FLASH_LEN / PAGE_LEN)));
    let sensor = sensor(Config::new(URG_04LX_UG01), StillRoom::new(URG_04LX_UG01.geometry));
    let board = board(images, Line::AnySpeed(&sensor), &flash);
    let mut host = owner(&board);
    host.settle();
    let manifest = signed(&update::about(&flash.new));
    let asked = |host: &mut Host<Sealed>, request: Request<'_>| {
        host.ask(request);
        host.look(|_, message| match message {
            Message::Receiving { next, .. } => Some(*next),
            Message::Done { .. } => Some(u32::MAX),
            Message::Refused(refused) => panic!("{}", refused.refusal),
            _ => None,
        })
    };
    let begin_us = board.time().now_us();
    let mut at = asked(&mut host, Request::Update { manifest: &manifest });
    while (at as usize) < flash.new.len() {
        let rest = &flash.new[at as usize..];
        let bytes = &rest[..rest.len().min(CHUNK_MAX)];
        at = asked(&mut host, Request::UpdateChunk { offset: at, bytes });
    }
    let took_us = board.time().now_us() - begin_us;
    let lost = host.health(|_| true).counters.get(Counter::LostScans);
    println!("{} bytes in {} ms of its time; {lost} scans lost", flash.new.len(), took_us / 1000);
    assert!(flash.runs(&flash.old), "the old image runs meanwhile");
    assert_eq!(asked(&mut host, Request::UpdateInstall), u32::MAX);
    let mut host = owner(&board);
    host.look(|_, message| match message {
        Message::Health(health) => {
            health.events.iter().any(|event| event.kind == EventKind::ImageConfirmed).then_some(())
        }
        _ => None,
    });
    assert!(flash.runs(&flash.new));
    assert_eq!(host.identity.boot, 2);
}
