//! Several modules on one network segment, each the real image in QEMU: all are found by DNS-SD, and all
//! report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::support::board::{image, wait_for};
use crate::support::dns::Found;
use crate::support::lan::{Datagram, Kind, Lan, Subscriber};
use crate::support::{dns, segment};
use kehai::device::Settings;
use kehai::store::flash::FlashStore;
use kehai::store::save_settings;
use kehai::wire::{Counter, PORT};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::qemu::{Line, Machine, PATIENCE_US, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX_UG01;
use kehai_emulator::urg::{Config, Urg};

const SERVICE: &str = "_kehai._udp.local";
const IGMP: u8 = 2;
/// Kind of an IGMP message: "I am in this group" (RFC 2236).
const MEMBER: u8 = 0x16;

fn mac(number: usize) -> [u8; 6] {
    [0x52, 0x54, 0x00, 0x12, 0x34, 0x81 + number as u8]
}

fn address(number: usize) -> [u8; 4] {
    let [a, b, c, _] = segment::HOST;
    [a, b, c, 129 + number as u8]
}

/// A flash that gives module `number` its address.
fn flash(number: usize, test: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("kehai-flash-{test}-{number}-{}", std::process::id()));
    let _ = std::fs::remove_file(&path);
    let flash = Flash::open(&path, 128 * 1024 / PAGE_LEN).unwrap();
    let mut store = FlashStore::new(flash, 0..128 * 1024).unwrap();
    let [a, b, c, d] = address(number);
    let settings = Settings::new().changed_by(&format!("address={a}.{b}.{c}.{d}/24")).unwrap();
    embassy_futures::block_on(save_settings(&mut store, &settings)).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(16 * 1024 * 1024).unwrap();
    path
}

/// Module `number`, with a sensor that measures ten times a second.
struct Plugged {
    board: Qemu,
    _sensor: UdpSensor,
    flash: PathBuf,
}

impl Plugged {
    fn start(image: &Path, lan: &Lan, number: usize, test: &str) -> Self {
        let flash = flash(number, test);
        let network = lan.network(number);
        let room = StillRoom::new(URG_04LX_UG01.geometry);
        let sensor = UdpSensor::new(Urg::new(Config::new(URG_04LX_UG01), Box::new(room), 0)).unwrap();
        let line = Line::AnySpeed(&sensor);
        let (time, mac) = (&lan.time, mac(number));
        let board =
            Qemu::start(&Machine { image, boot: None, mac, time, line, network, flash: Some(&flash) });
        Self { board: board.unwrap(), _sensor: sensor, flash }
    }
}

impl Drop for Plugged {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.flash);
    }
}

/// Looks until `count` modules with their sensors are found, by instance name.
#[track_caller]
fn find(lan: &Lan, count: usize) -> BTreeMap<String, Found> {
    let (search, end_us) = (lan.search(SERVICE), lan.time.now_us() + PATIENCE_US);
    let mut found = BTreeMap::new();
    while found.len() < count {
        assert!(lan.time.now_us() < end_us, "only {found:#?}");
        let next = search.next(SERVICE);
        // It says more once its sensor is found.
        if !next.txt["model"].is_empty() {
            found.insert(next.name.clone(), next);
        }
    }
    found
}

fn are_found_and_report(lan: impl FnOnce() -> Lan, count: usize, test: &str) {
    let Some(image) = image() else { return };
    let lan = lan();
    let _modules: Vec<Plugged> = (0..count).map(|number| Plugged::start(image, &lan, number, test)).collect();
    let found = find(&lan, count);
    let mut hosts = Vec::new();
    for number in 0..count {
        let [.., a, b, c] = mac(number);
        let name = format!("kehai-{a:02x}{b:02x}{c:02x}");
        let found = found.get(&name).unwrap_or_else(|| panic!("no {name} in {found:#?}"));
        assert_eq!((found.address, found.port), (address(number), PORT));
        assert_eq!(found.txt["protocol"], "1");
        assert_eq!(found.txt["firmware"], env!("CARGO_PKG_VERSION"));
        assert_eq!(found.txt["id"], format!("52540012{:02x}{:02x}", 0x34, 0x81 + number));
        assert!(found.txt["model"].starts_with("URG-04LX"), "{found:?}");
        assert_eq!(found.txt["serial"], URG_04LX_UG01.serial);
        hosts.push(lan.subscribe(found, mac(number)));
    }
    // All at the same time.
    let end_us = lan.time.now_us() + PATIENCE_US;
    while hosts.iter().any(|host| host.sequences.len() < 30) {
        let counts: Vec<usize> = hosts.iter().map(|host| host.sequences.len()).collect();
        assert!(lan.time.now_us() < end_us, "reports from each: {counts:?}");
        hosts.iter_mut().for_each(|host| while host.turn() {});
        lan.time.step();
    }
    hosts.iter().for_each(Subscriber::assert_no_report_missing);
}

#[test]
fn two_modules_on_one_segment_are_all_found_and_all_report() {
    are_found_and_report(|| Lan::new(2), 2, "two");
}

#[test]
fn three_modules_on_one_segment_are_all_found_and_all_report() {
    are_found_and_report(|| Lan::new(3), 3, "three");
}

#[test]
fn on_the_switch_that_needs_no_root_they_are_found_and_report_too() {
    are_found_and_report(Lan::switch, 3, "switch");
}

/// The next message of the module's membership in the group for mDNS.
fn is_membership(datagram: &Datagram) -> bool {
    datagram.protocol == IGMP && datagram.payload.first() == Some(&MEMBER) && datagram.to == dns::GROUP
}

#[test]
fn after_a_lost_link_the_module_joins_its_group_and_announces_itself_anew() {
    let Some(image) = image() else { return };
    let lan = Lan::switch();
    let Kind::Switch(_, frames) = &lan.kind else { unreachable!("it is one") };
    let mut module = Plugged::start(image, &lan, 0, "link");
    let next = |wanted: fn(&Datagram) -> bool| {
        lan.time.until(PATIENCE_US, || frames.look(wanted)).expect("no such frame")
    };
    let announces = |datagram: &Datagram| datagram.to_port == dns::PORT && datagram.to == dns::GROUP;
    let joined = next(is_membership);
    assert_eq!(joined.from, address(0), "joined before there was an address");
    assert!(dns::found(&next(announces).payload, SERVICE).is_some());
    find(&lan, 1);

    module.board.set_link(false).unwrap();
    wait_for(&mut module.board, "mdns: no address");
    // What came before is history.
    while frames.look(|_| true).is_some() {}
    module.board.set_link(true).unwrap();
    assert_eq!(next(is_membership).from, address(0));
    let again = dns::found(&next(announces).payload, SERVICE).expect("an announcement");
    assert_eq!((again.name.as_str(), again.address), ("kehai-123481", address(0)));
}

#[test]
fn a_question_from_any_port_is_answered_to_that_port() {
    let Some(image) = image() else { return };
    let lan = Lan::switch();
    let Kind::Switch(_, frames) = &lan.kind else { unreachable!("it is one") };
    let _module = Plugged::start(image, &lan, 0, "question");
    find(&lan, 1);
    let end_us = lan.time.now_us() + PATIENCE_US;
    let answer = loop {
        assert!(lan.time.now_us() < end_us, "no answer");
        lan.ask_everybody(&dns::question(0x1234, SERVICE));
        let answer = (0..20).find_map(|_| frames.receive(|datagram| datagram.to_port == 6353));
        if let Some(answer) = answer {
            break answer;
        }
    };
    assert_eq!(answer.to, segment::HOST);
    assert_eq!(answer.payload[..2], [0x12, 0x34], "the number of the question");
    let found = dns::found(&answer.payload, SERVICE).expect("all there is to know");
    assert_eq!((found.name.as_str(), found.address), ("kehai-123481", address(0)));
}

#[test]
fn a_flood_of_questions_delays_no_report_and_what_is_dropped_is_counted() {
    let Some(image) = image() else { return };
    let lan = Lan::new(1);
    let _module = Plugged::start(image, &lan, 0, "flood");
    let found = find(&lan, 1);
    let mut host = lan.subscribe(&found["kehai-123481"], mac(0));
    host.until("background", |host| {
        host.background_version > 0 && matches!(host.health, Some((_, storing)) if !storing)
    });
    host.sequences.clear();
    let question = dns::question(1, SERVICE);
    for reports in 1..=30 {
        (0..100).for_each(|_| lan.ask_everybody(&question));
        host.until("report", |host| host.sequences.len() >= reports);
    }
    host.assert_no_report_missing();
    let counted = |host: &Subscriber, counter| host.health.map_or(0, |(counters, _)| counters.get(counter));
    host.until("drop counted", |host| counted(host, Counter::DiscoveryDropped) > 1000);
    assert_eq!(counted(&host, Counter::LostScans), 0);
    assert_eq!(counted(&host, Counter::ReportsDropped), 0);
}
