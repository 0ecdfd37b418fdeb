//! Settings that the real firmware image could not start with, in QEMU: it starts, and is heard again by DHCP.
//!
//! `KEHAI_HOSTILE_VALUES=200` tries all hostile values of each setting; without it, ten of each.

use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::support::board::{host_of, image, start, wait_for};
use crate::support::hostile;
use crate::support::hostile::Sort;
use kehai::device::{Addressing, Settings};
use kehai::link::Store;
use kehai::store::flash::FlashStore;
use kehai::wire::{EventKind, HEADER_LEN, Message, Refusal, Request, SETTINGS_TEXT_MAX};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::pc::host::{Host, Way};
use kehai_emulator::qemu::{Forwarded, Line, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};

/// Bytes of the image's flash.
const FLASH_LEN: usize = 128 * 1024;
/// Bytes of the file that QEMU takes for it.
const FILE_LEN: u64 = 16 * 1024 * 1024;
/// Key of the settings in the store.
const SETTINGS: u8 = 1;

/// Flash with these settings as they stand, as an older firmware stored them unchecked.
struct Unchecked(PathBuf);

impl Unchecked {
    fn new(settings: &str) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("kehai-settings-{}-{number}", std::process::id()));
        let flash = Flash::open(&path, FLASH_LEN / PAGE_LEN).unwrap();
        let mut store = FlashStore::new(flash, 0..FLASH_LEN as u32).unwrap();
        embassy_futures::block_on(store.save(SETTINGS, settings.as_bytes())).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_len(FILE_LEN).unwrap();
        Self(path)
    }
}

impl Drop for Unchecked {
    fn drop(&mut self) {
        // It may be gone with the whole folder.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn f2_a_stored_address_that_bricked_older_images_leads_to_dhcp_and_is_said() {
    let Some(image) = image() else { return };
    for address in ["224.0.0.1/24", "255.255.255.255/30", "239.1.2.3/4,239.1.2.4"] {
        let flash = Unchecked::new(&format!("name=hall\naddress={address}\nskip=1\n"));
        let sensor =
            UdpSensor::new(Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0));
        let sensor = sensor.unwrap();
        let mut board = start(image, Line::AnySpeed(&sensor), Some(&flash.0));
        wait_for(&mut board, "address 10.0.2.15/24");
        let mut host = host_of(&board);
        host.subscribe();
        host.look(|_, message| match message {
            Message::Health(health) => {
                health.events.iter().any(|event| event.kind == EventKind::AddressUnusable).then_some(())
            }
            _ => None,
        });
    }
}

/// Address of the host, as a board on QEMU's own network sees it.
const HOST: Ipv4Addr = Ipv4Addr::new(10, 0, 2, 2);
/// A start that lasts so long, with a sensor that delivers for most of it, is none of a row of restarts.
const LASTS_US: u64 = 2 * SECOND_US;
const SECOND_US: u64 = 1_000_000;
/// Starts over a wrong address before the one before it comes back.
const TRIAL_STARTS: u32 = 3;

/// A board with a sensor and flash of its own, and its one host.
struct Bench {
    image: &'static Path,
    board: Qemu,
    host: Host<Forwarded>,
    settings: Settings,
    sensor: UdpSensor,
    flash: Unchecked,
}

impl Bench {
    /// With default settings.
    fn new(image: &'static Path) -> Self {
        let sensor =
            UdpSensor::new(Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0));
        let (sensor, flash) = (sensor.unwrap(), Unchecked::new(""));
        let board = start(image, Line::AnySpeed(&sensor), Some(&flash.0));
        let mut host = host_of(&board);
        host.health(|_| true);
        Self { image, board, host, settings: Settings::new(), sensor, flash }
    }

    /// Cuts the power, and gives it again. A reset would count the start before as one that did not last.
    fn power_up(&mut self) {
        self.board = start(self.image, Line::AnySpeed(&self.sensor), Some(&self.flash.0));
        self.host = host_of(&self.board);
    }

    /// Asks to set `text`: the answer.
    fn set(&mut self, text: &[u8], id: u32) -> Result<(), Refusal> {
        let mut asked_us = None;
        loop {
            let now_us = self.host.way.now_us();
            if asked_us.is_none_or(|asked_us| now_us > asked_us + SECOND_US) {
                self.host.way.send(&request(&self.host, text, id));
                asked_us = Some(now_us);
            }
            let answer = self.host.turn(|_, message| match message {
                Message::Done { request_id } if *request_id == id => Some(Ok(())),
                Message::Refused(refused) if refused.request_id == id => Some(Err(refused.refusal)),
                _ => None,
            });
            match answer {
                Some(Err(Refusal::Busy)) | None => {}
                Some(answer) => return answer,
            }
        }
    }

    /// Starts anew, over the settings just taken: the image is heard again, and stays.
    fn starts_and_is_heard(&mut self) {
        if let Addressing::Static(address) = self.settings.addressing {
            let own = format!("address {}/{}", address.address(), address.prefix_bits());
            for _ in 0..TRIAL_STARTS {
                self.power_up();
                wait_for(&mut self.board, &own);
            }
        }
        self.power_up();
        self.host.health(|health| health.head.uptime_us > LASTS_US);
        let log = self.board.messages().unwrap();
        let starts = log.iter().filter(|message| message.text.starts_with("boot ")).count();
        assert_eq!(starts, 1, "{log:#?}");
    }

    /// Whether it takes settings of us.
    fn obeys(&self) -> bool {
        self.settings.addressing == Addressing::Dhcp
            && (self.settings.hosts.is_empty() || self.settings.hosts.contains(&HOST))
    }
}

/// The datagram that asks to set `text`, which may be one that [`Request::encode`] would not take.
fn request(host: &Host<Forwarded>, text: &[u8], id: u32) -> Vec<u8> {
    /// Place of the kind in the header, and of the text's length.
    const KIND: usize = 14;
    const LENGTH: usize = HEADER_LEN + 12;
    let mut datagram = [0; 1400];
    let set = Request::SetSettings { text: "" };
    set.encode(host.identity, id, host.cookie, &mut datagram).unwrap();
    assert_eq!(datagram[KIND], set.kind());
    let length = [text.len() as u8 & 0x7f | 0x80, (text.len() >> 7) as u8];
    [&datagram[..LENGTH], &length, text].concat()
}

/// The settings that `text` makes of these.
fn expected(settings: &Settings, text: &[u8]) -> Result<Settings, Refusal> {
    let text = std::str::from_utf8(text).ok().filter(|text| text.len() <= SETTINGS_TEXT_MAX);
    let text = text.ok_or(Refusal::Malformed)?;
    settings.changed_by(text).map_err(|bad| Refusal::Setting { line: bad.line, fault: bad.fault })
}

/// Values of each setting: a share of them, unless all are asked for.
fn share() -> usize {
    const SHARE: usize = 10;
    std::env::var("KEHAI_HOSTILE_VALUES")
        .map_or(SHARE, |count| count.parse().expect("KEHAI_HOSTILE_VALUES: a number"))
}

/// Sets hostile values one after the other. What is refused is refused by line and fault; with what is taken the image
/// starts, and is heard again.
fn no_value_keeps_it_from_starting(keys: &[(&str, Sort)]) {
    let Some(image) = image() else { return };
    let mut bench = Bench::new(image);
    for &(key, sort) in keys {
        let (mut refused, mut taken) = (0, 0);
        for (number, text) in hostile::texts(key, sort, share()).iter().enumerate() {
            if !bench.obeys() {
                bench = Bench::new(image);
            }
            let what = format!("{key}, value {number}: {:?}", String::from_utf8_lossy(text));
            let expected = expected(&bench.settings, text);
            let answer = bench.set(text, 1_000_000 + number as u32);
            assert_eq!(answer, expected.clone().map(|_| ()), "{what}");
            match expected {
                Err(_) => refused += 1,
                Ok(settings) => {
                    println!("taken: {what}");
                    let changed = settings != bench.settings;
                    bench.settings = settings;
                    if changed {
                        bench.starts_and_is_heard();
                    }
                    taken += 1;
                }
            }
        }
        println!("{key}: {refused} values refused, {taken} taken; heard after each start");
    }
}

#[test]
fn with_no_value_of_a_number_the_image_fails_to_start() {
    let numbers: Vec<_> =
        hostile::KEYS.into_iter().filter(|(_, sort)| matches!(sort, Sort::Number(..))).collect();
    no_value_keeps_it_from_starting(&numbers);
}

#[test]
fn with_no_name_address_or_hosts_the_image_fails_to_start() {
    let others: Vec<_> =
        hostile::KEYS.into_iter().filter(|(_, sort)| !matches!(sort, Sort::Number(..))).collect();
    no_value_keeps_it_from_starting(&others);
}
