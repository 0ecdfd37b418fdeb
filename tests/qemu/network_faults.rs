//! What goes wrong on the network and in the box, with the real firmware image in QEMU: afterwards there
//! are reports again, without a hand.

use std::net::UdpSocket;

use crate::support::board::{MAC, host_of, image, start, wait_for};
use crate::support::observer::{Observer, SECOND_US, sensor};
use crate::support::station::Segment;
use kehai::wire::{Alarms, Cookie, Counter, Identity, MAGIC, Request};
use kehai_emulator::pc::host::{Condition, Host, Way};
use kehai_emulator::qemu::{Forwarded, GuestTime, Line, Machine, Network, Qemu, Switch};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::Config;
use kehai_emulator::urg::model::URG_04LX_UG01;

/// Ten scans a second of a room in which nothing moves.
fn still_room() -> UdpSensor {
    sensor(Config::new(URG_04LX_UG01), StillRoom::new(URG_04LX_UG01.geometry))
}

#[test]
fn after_the_link_was_down_reports_come_again() {
    let Some(image) = image() else { return };
    let sensor = still_room();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.settle();
    host.more(5);
    host.assert_every_scan_reported(&sensor);
    wait_for(&mut board, "address 10.0.2.15");
    board.set_link(false).unwrap();
    wait_for(&mut board, "address lost");
    board.set_link(true).unwrap();
    let again = wait_for(&mut board, "address 10.0.2.15");
    host.reports.clear();
    let first = host.more(10);
    let since_us = first.head.stamp_us as i64 - again.at_us as i64;
    println!("first scan reported began {} ms after the address was there", since_us / 1000);
    assert!(first.head.stamp_us < again.at_us + SECOND_US, "{again}: {:?}", first.head);
    host.assert_every_scan_reported(&sensor);
    let health = host.health(|_| true);
    assert_eq!(health.counters.get(Counter::LinkLosses), 1);
    assert_eq!((first.boot, health.counters.get(Counter::LostScans)), (1, 0));
}

#[test]
fn a_host_that_leaves_is_forgotten_and_served_again_when_it_comes_back() {
    let Some(image) = image() else { return };
    let sensor = still_room();
    let board = start(image, Line::AnySpeed(&sensor), None);
    let (mut stays, mut leaves) = (host_of(&board), host_of(&board));
    stays.settle();
    leaves.more(1);
    stays.health(|health| health.head.subscribers == 2);
    // Its port is closed: datagrams to it are answered by ICMP as unreachable.
    let address = leaves.way.address().unwrap();
    drop(leaves);
    let alone = stays.health(|health| health.head.subscribers == 1);
    assert_eq!(alone.counters.get(Counter::SubscribersForgotten), 1);
    let mut back = Host::at(Forwarded::from(address, board.module(), board.time()).unwrap());
    back.more(5);
    back.assert_every_scan_reported(&sensor);
    stays.more(5);
    stays.assert_every_scan_reported(&sensor);
    assert_eq!(stays.health(|_| true).counters.get(Counter::ReportsDropped), 0);
}

/// Invalid datagram number `n`.
fn rubbish(n: u32, known: Identity) -> Vec<u8> {
    let mut random = n.wrapping_mul(0x9e37_79b9);
    let mut bytes = |len: usize| -> Vec<u8> {
        let next = |_| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as u8
        };
        (0..len).map(next).collect()
    };
    let mut request = vec![0; 1400];
    let len = Request::SetSettings { text: "name=x" }
        .encode(known, n, Cookie(n.to_le_bytes().repeat(2).try_into().unwrap()), &mut request)
        .unwrap();
    request.truncate(len);
    match n % 8 {
        // Foreign, of any length.
        0 => bytes(n as usize % 60),
        1 => bytes(1472),
        // Ours, with nothing behind it, or with anything.
        2 => MAGIC.to_vec(),
        3 => [&MAGIC[..], &[1], &bytes(300)].concat(),
        // A module's own report.
        4 => [&MAGIC[..], &[1], &bytes(10), &[0x81], &bytes(100)].concat(),
        // A request with a wrong cookie, cut off, of another version.
        5 => request,
        6 => request[..42].to_vec(),
        _ => {
            request[3] = 200;
            request
        }
    }
}

/// All datagrams the module has looked at and thrown away, or answered no.
fn thrown_away(health: &Condition) -> u32 {
    [
        Counter::DatagramsForeign,
        Counter::DatagramsTooShort,
        Counter::DatagramsTooLong,
        Counter::DatagramsWrongDirection,
        Counter::DatagramsDropped,
        Counter::CookiesGiven,
        Counter::RefusedVersion,
        Counter::RefusedUnsupported,
        Counter::RefusedMalformed,
        Counter::RefusedBadCookie,
        Counter::RefusedWrongModule,
        Counter::RefusedWrongBoot,
    ]
    .iter()
    .map(|&counter| health.counters.get(counter))
    .sum()
}

#[test]
fn a_thousand_useless_datagrams_a_second_cost_no_report() {
    const COUNT: u32 = 10_000;
    let Some(image) = image() else { return };
    let sensor = still_room();
    let board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.settle();
    let before = host.health(|_| true);
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    stranger.connect(board.module()).unwrap();
    let begin_us = board.time().now_us();
    for sent in 0..COUNT {
        while board.time().now_us() < begin_us + u64::from(sent) * 1000 {
            host.turn(|_, _| None::<()>);
        }
        stranger.send(&rubbish(sent, host.identity)).unwrap();
    }
    host.more(20);
    host.assert_every_scan_reported(&sensor);
    let after = host.health(|health| health.head.uptime_us > before.head.uptime_us + 11 * SECOND_US);
    let arrived = thrown_away(&after) - thrown_away(&before);
    println!(
        "{} reports, none missing; {arrived} of {COUNT} datagrams counted, {} of them dropped unread",
        host.reports.len(),
        after.counters.get(Counter::DatagramsDropped)
    );
    assert!((COUNT / 2..=COUNT).contains(&arrived), "{arrived}");
    assert_eq!(after.counters.get(Counter::ReportsDropped), 0);
    assert_eq!(host.identity.boot, 1);
}

#[test]
fn datagrams_for_which_there_was_no_room_are_counted() {
    let Some(image) = image() else { return };
    let sensor = still_room();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    let before = host.health(|_| true);
    // More at once than wait in the module's memory, but not more than the controller holds.
    board.freeze().unwrap();
    for n in 0..100u8 {
        host.way.send(&[n; 4]);
    }
    board.take_datagrams(100).unwrap();
    board.resume().unwrap();
    let after = host.health(|health| health.counters.get(Counter::DatagramsDropped) > 0);
    println!("{} of 100 dropped", after.counters.get(Counter::DatagramsDropped));
    assert!(thrown_away(&after) - thrown_away(&before) <= 100);
}

#[test]
fn a_hung_task_is_ended_by_the_watchdog_and_reports_come_again() {
    let Some(image) = image() else { return };
    let sensor = still_room();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.settle();
    board.hang().unwrap();
    wait_for(&mut board, "watchdog: a task hangs");
    wait_for(&mut board, "boot 2");
    host.look(|host, _| (host.identity.boot == 2).then_some(()));
    host.reports.clear();
    let first = host.more(10);
    assert_eq!((first.boot, first.head.background_version), (2, 1));
    host.assert_every_scan_reported(&sensor);
    let health = host.health(|_| true);
    assert_eq!(health.counters.get(Counter::WatchdogResets), 1);
    assert!(health.head.alarms.has(Alarms::WATCHDOG), "{:?}", health.head.alarms);
    // Once it is started anew for another reason, that is over.
    board.reset().unwrap();
    host.look(|host, _| (host.identity.boot == 3).then_some(()));
    let health = host.health(|_| true);
    assert_eq!(health.counters.get(Counter::WatchdogResets), 0);
    assert!(!health.head.alarms.has(Alarms::WATCHDOG), "{:?}", health.head.alarms);
}

#[test]
fn a_subscriber_that_answers_no_arp_delays_no_reports_and_no_answers() {
    let Some(image) = image() else { return };
    let sensor = still_room();
    let time = &GuestTime::new();
    let switch = Switch::new(time).unwrap();
    let segment = Segment::new(switch.port());
    let (line, network) = (Line::AnySpeed(&sensor), Network::Switch(&switch));
    let _board =
        Qemu::start(&Machine { image, boot: None, mac: MAC, time, line, network, flash: None }).unwrap();
    let mut host = Host::at(segment.station([10, 1, 2, 2], true));
    host.settle();
    let before = segment.unanswered();
    let mut mute = Host::at(segment.station([10, 1, 2, 3], false));
    let mut another = None;
    for turn in 0..80 {
        let reports = host.reports.len();
        mute.ask(Request::Subscribe { t1: [0; 8] });
        while host.reports.len() == reports {
            host.turn(|_, _| None::<()>);
        }
        // A host that comes now, and asks once a scan, is answered like any other.
        if turn == 40 {
            another = Some(Host::at(segment.station([10, 1, 2, 4], true)));
        }
        if let Some(another) = &mut another {
            for _ in 0..4 {
                another.turn(|_, _| None::<()>);
            }
        }
    }
    println!("{} questions for the host that answers none", segment.unanswered() - before);
    assert!(segment.unanswered() - before >= 3);
    host.assert_every_scan_reported(&sensor);
    let another = another.unwrap();
    let asked = host.reports[40].head.sequence;
    let first = another.reports[0].head.sequence;
    println!("another host asked at report {asked} and got {first} as its first");
    assert!(first <= asked + 5);
    another.assert_every_scan_reported(&sensor);
    let health = host.health(|_| true);
    assert_eq!(health.counters.get(Counter::ReportsDropped), 0);
    assert!(health.counters.get(Counter::AnswersDropped) > 0, "{:?}", health.counters);
}
