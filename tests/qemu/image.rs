//! The real firmware image, run in QEMU. Guest time is read from its log.

use std::collections::BTreeSet;
use std::net::UdpSocket;
use std::path::Path;

use crate::support::board::{MAC, host_of, image, start, wait_for};
use crate::support::{dns, hostile, segment};
use kehai::address;
use kehai::device::led::{LedState, SLOT_US};
use kehai::wire::{Counter, Message, ModuleId, Request};
use kehai_emulator::qemu::{GuestTime, Line, Machine, Network, PATIENCE_US, Port, Qemu, STEP_US, Switch};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};

/// Slots of the LED's picture, and how late in a slot the LED may turn, µs.
const SLOTS: u64 = 20;
const LATE_US: u64 = 20_000;

/// The module answers a subscriber; the number of its start.
fn answers(board: &Qemu) -> u32 {
    let mut host = host_of(board);
    host.health(|_| true);
    assert_eq!(host.identity.module, ModuleId(MAC));
    host.identity.boot
}

/// Looks at frames from the module until one will do.
fn frame<T>(port: &Port, mut look: impl FnMut(&[u8]) -> Option<T>) -> T {
    let found = port.time().until(PATIENCE_US, || port.receive(0).and_then(|frame| look(&frame)));
    found.expect("no such frame")
}

#[test]
fn the_image_boots_names_itself_and_gets_an_address_by_dhcp() {
    let Some(image) = image() else { return };
    let mut board = start(image, Line::Open, None);
    let build = wait_for(&mut board, "kehai ");
    assert!(build.text.starts_with(concat!("kehai ", env!("CARGO_PKG_VERSION"), " ")), "{}", build.text);
    assert!(build.text.ends_with(" mps2-an386"), "{}", build.text);
    let maths = wait_for(&mut board, "maths ").text;
    assert_eq!(maths, format!("maths {:08x}", kehai::math::digest()), "board and PC calculate differently");
    assert_eq!(wait_for(&mut board, "mac ").text, "mac 52:54:00:12:34:81");
    assert_eq!(wait_for(&mut board, "host ").text, "host kehai-123481");
    let lease = wait_for(&mut board, "address ");
    assert!(lease.text.ends_with("10.0.2.15/24"), "{}", lease.text);
    assert!(lease.at_us < 4_000_000, "before it would have given up: {lease}");
    println!("boot to DHCP lease: {} ms of guest time", lease.at_us as f64 / 1000.0);
}

#[test]
fn a_host_gets_a_report_for_every_scan_and_the_background_survives_a_reset() {
    let Some(image) = image() else { return };
    let urg = Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0);
    let sensor = UdpSensor::new(urg).unwrap();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.more(20);
    let mut pairs = host.reports.windows(2);
    assert!(pairs.all(|pair| pair[1].head.sequence == pair[0].head.sequence + 1), "{:?}", host.reports);
    host.health(|health| health.head.storing);
    host.health(|health| !health.head.storing);
    // It has learned and stored; reports go on.
    while host.more(1).head.background_version != 1 {}
    board.reset().unwrap();
    wait_for(&mut board, "boot 2");
    let mut host = host_of(&board);
    host.more(5);
    assert!(host.reports.iter().all(|report| report.head.background_version == 1), "the background is back");
    assert_eq!(host.identity.boot, 2);
}

/// Everything that goes deep: start, network, learning, storing background and settings, requests.
#[test]
fn the_stack_stays_within_its_budget() {
    // All but 4 KiB of it while the module is made, before it moves to its place.
    const BUDGET: usize = 64 * 1024;
    let Some(image) = image() else { return };
    let urg = Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0);
    let sensor = UdpSensor::new(urg).unwrap();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.health(|health| health.head.background_version == 1 && health.head.storing);
    host.health(|health| !health.head.storing);
    for request in [Request::Info, Request::Profile { version: 0, parts: 0 }] {
        host.ask(request);
        host.more(1);
    }
    host.ask(Request::SetSettings { text: "name=hall" });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    host.more(20);
    let used = board.stack_used().unwrap();
    println!("stack of mps2-an386: {used} bytes at most, budget {BUDGET}");
    assert!((256..=BUDGET).contains(&used), "{used} bytes of stack");
}

#[test]
fn datagrams_of_any_length_and_content_do_no_harm() {
    let Some(image) = image() else { return };
    let board = start(image, Line::Open, None);
    let boot = answers(&board);
    let mut host = host_of(&board);
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    stranger.connect(board.module()).unwrap();
    // As many as it takes: a burst may overrun the network's buffers on the way.
    let mut foreign = 0;
    while foreign < 40 {
        for len in [1, 2, 3, 39, 40, 51, 100, 1400, 1401, 1472] {
            for byte in [0x5a, 0xe6] {
                stranger.send(&vec![byte; len]).unwrap();
            }
        }
        foreign = host.health(|_| true).counters.get(Counter::DatagramsForeign);
    }
    assert_eq!(answers(&board), boot);
}

#[test]
fn frames_with_any_bytes_changed_do_no_harm() {
    const FRAMES: u32 = 3000;
    let Some(image) = image() else { return };
    let time = GuestTime::new();
    let switch = Switch::new(&time).unwrap();
    let segment = switch.port();
    let mut board = on_switch(image, &switch, &time);
    let (mut lease, end_us) = (Vec::new(), time.now_us() + PATIENCE_US);
    while !board.messages().unwrap().iter().any(|message| message.text.contains("address 10.1.2.77/24")) {
        assert!(time.now_us() < end_us, "{:?}", board.messages());
        let frame = segment.receive(STEP_US);
        if let Some(answer) = frame.as_deref().and_then(segment::dhcp_answer) {
            segment.send(&answer);
            lease = answer;
        }
    }
    let question = dns::question(7, "_kehai._udp.local");
    let asked = segment::datagram(dns::PORT, (dns::GROUP_MAC, dns::GROUP, dns::PORT), &question);
    let fragment = [&asked[..20], &[0x20, 0x01][..], &asked[22..]].concat();
    let igmp =
        [&dns::GROUP_MAC[..], &[2, 0, 0, 0, 0, 0xfe, 8, 0, 0x46, 0, 0, 32, 0, 0, 0, 0, 1, 2, 0, 0]].concat();
    let igmp =
        [&igmp[..], &segment::HOST, &dns::GROUP, &[0x94, 4, 0, 0, 0x11, 100, 0, 0], &dns::GROUP].concat();
    let kinds = [lease, segment::who_has(segment::GIVEN, segment::HOST), asked, fragment, igmp];
    let mut random = hostile::Random(1);
    for number in 0..FRAMES {
        let mut frame = kinds[number as usize % kinds.len()].clone();
        for _ in 0..1 + random.below(4) {
            // The hardware address stays: it is for the board.
            let at = 6 + random.below(frame.len() - 6);
            frame[at] = random.next() as u8;
        }
        if random.below(8) == 0 {
            frame.truncate(14 + random.below(frame.len() - 14));
        }
        segment.send(&frame);
        if number.is_multiple_of(4) {
            time.step();
        }
    }
    segment.send(&segment::who_has(segment::GIVEN, [10, 1, 2, 9]));
    frame(&segment, |frame| segment::has(frame, MAC, segment::GIVEN).then_some(()));
    let starts = board.messages().unwrap().iter().filter(|message| message.text.starts_with("boot ")).count();
    assert_eq!(starts, 1, "{:#?}", board.messages());
}

#[test]
fn a_restart_asked_for_is_a_new_start() {
    let Some(image) = image() else { return };
    let mut board = start(image, Line::Open, None);
    let mut host = host_of(&board);
    host.subscribe();
    host.ask(Request::Restart);
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    wait_for(&mut board, "restart");
    wait_for(&mut board, "boot 2");
    assert_eq!(answers(&board), 2);
}

#[test]
fn its_led_says_which_board_it_is_and_then_its_state_again() {
    let Some(image) = image() else { return };
    let sensor =
        UdpSensor::new(Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0));
    let sensor = sensor.unwrap();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    // Learned, and stored.
    while host.more(1).head.background_version != 1 {}
    let time = board.time().clone();
    time.until(3_000_000, || None::<()>);
    shows(&mut board, LedState::Working);
    host.ask(Request::Identify { seconds: 30 });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    time.until(2 * SLOT_US, || None::<()>);
    shows(&mut board, LedState::Identify);
    host.ask(Request::Identify { seconds: 0 });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    time.until(2 * SLOT_US, || None::<()>);
    shows(&mut board, LedState::Working);
}

/// The LED shows this state, in every slot of its picture. Time goes on while QEMU is asked: what may have been seen in
/// two slots says nothing.
#[track_caller]
fn shows(board: &mut Qemu, state: LedState) {
    let time = board.time().clone();
    let slot = |at_us: u64| at_us / SLOT_US % SLOTS;
    let mut judged = BTreeSet::new();
    let end_us = time.now_us() + PATIENCE_US;
    while judged.len() < SLOTS as usize {
        let from_us = time.now_us();
        let lit = board.is_lit().unwrap();
        let to_us = time.now_us();
        assert!(to_us < end_us, "only {} slots were seen", judged.len());
        if slot(from_us - LATE_US) == slot(to_us) {
            assert_eq!(lit, state.is_lit(to_us), "{state:?} at {to_us} us");
            judged.insert(slot(to_us));
        }
        time.step();
    }
}

#[test]
fn a_sensor_on_a_serial_line_is_found_at_a_rare_speed_and_its_line_made_faster() {
    let Some(image) = image() else { return };
    let config = Config { baud: 57_600, ..Config::new(URG_04LX) };
    let urg = Urg::new(config, Box::new(StillRoom::new(URG_04LX.geometry)), 0);
    let sensor = UdpSensor::new(urg).unwrap();
    let board = start(image, Line::Serial(&sensor), None);
    let mut host = host_of(&board);
    let health = host.health(|health| health.counters.get(Counter::ScansAccepted) > 0);
    assert!(health.counters.get(Counter::SensorBaudChanges) > 0);
    assert!(sensor.with(|urg, _| urg.baud()) > 57_600);
}

#[test]
fn a_hung_task_is_ended_by_the_watchdog_and_the_module_comes_back() {
    let Some(image) = image() else { return };
    let mut board = start(image, Line::Open, None);
    wait_for(&mut board, "boot 1");
    // The last one for now: a program that hangs while it logs can say nothing more.
    wait_for(&mut board, "mdns: ");
    board.hang().unwrap();
    wait_for(&mut board, "watchdog: a task hangs");
    wait_for(&mut board, "kehai ");
    wait_for(&mut board, "boot 2");
    assert_eq!(answers(&board), 2);
}

#[test]
fn a_program_that_was_watched_runs_on() {
    let Some(image) = image() else { return };
    let mut board = start(image, Line::Open, None);
    let before = answers(&board);
    // Dropped while it stands, and while it runs.
    drop(board.watch_storage().unwrap());
    assert_eq!(answers(&board), before);
    let mut watch = board.watch_storage().unwrap();
    assert!(!watch.next(50 * STEP_US).unwrap(), "it has nothing to store");
    drop(watch);
    assert_eq!(answers(&board), before);
    // A command to the monitor is answered whatever the program does.
    board.freeze().unwrap();
    board.take_datagrams(3).unwrap();
    board.resume().unwrap();
    assert_eq!(answers(&board), before);
}

#[test]
fn after_the_link_was_down_the_module_gets_its_address_again() {
    let Some(image) = image() else { return };
    let mut board = start(image, Line::Open, None);
    wait_for(&mut board, "address 10.0.2.15");
    board.set_link(false).unwrap();
    wait_for(&mut board, "address lost");
    board.set_link(true).unwrap();
    wait_for(&mut board, "address 10.0.2.15");
    answers(&board);
}

#[test]
fn boots_are_counted_through_resets_and_power_cuts() {
    let Some(image) = image() else { return };
    let flash = std::env::temp_dir().join(format!("kehai-flash-{}", std::process::id()));
    let mut board = start(image, Line::Open, Some(&flash));
    wait_for(&mut board, "boot 1");
    board.reset().unwrap();
    wait_for(&mut board, "boot 2");
    drop(board);
    let mut board = start(image, Line::Open, Some(&flash));
    wait_for(&mut board, "boot 3");
    drop(board);
    std::fs::remove_file(&flash).unwrap();
}

/// A board without a sensor on `switch`.
fn on_switch(image: &Path, switch: &Switch, time: &GuestTime) -> Qemu {
    let (line, network) = (Line::Open, Network::Switch(switch));
    Qemu::start(&Machine { image, boot: None, mac: MAC, time, line, network, flash: None }).unwrap()
}

#[test]
fn a_lost_dhcp_request_is_sent_again() {
    let Some(image) = image() else { return };
    let time = GuestTime::new();
    let switch = Switch::new(&time).unwrap();
    let segment = switch.port();
    let mut board = on_switch(image, &switch, &time);
    for lost in [true, false, true, false] {
        let answer = frame(&segment, segment::dhcp_answer);
        if !lost {
            segment.send(&answer);
        }
    }
    let lease = wait_for(&mut board, "address ");
    assert!(lease.text.ends_with("10.1.2.77/24"), "{lease}");
}

#[test]
fn without_dhcp_the_module_is_at_its_link_local_address_until_a_server_comes() {
    let Some(image) = image() else { return };
    let time = GuestTime::new();
    let switch = Switch::new(&time).unwrap();
    let segment = switch.port();
    let mut board = on_switch(image, &switch, &time);
    assert_eq!(frame(&segment, segment::host_name), "kehai-123481");

    let own = address::link_local(MAC);
    let fallback = wait_for(&mut board, "address 169.254.");
    assert!(fallback.text.ends_with(&format!("169.254.{}.{}/16", own[2], own[3])), "{}", fallback.text);
    assert!(fallback.at_us >= 4_000_000, "not before DHCP had its time: {fallback}");
    segment.send(&segment::who_has(own, [169, 254, 9, 9]));
    frame(&segment, |frame| segment::has(frame, MAC, own).then_some(()));

    // Now there is a server. It answers the question, then the DHCP that follows.
    let end_us = time.now_us() + PATIENCE_US;
    while !board.messages().unwrap().iter().any(|message| message.text.contains("address 10.1.2.77/24")) {
        assert!(time.now_us() < end_us, "{:?}", board.messages());
        let frame = segment.receive(STEP_US);
        if let Some(answer) = frame.as_deref().and_then(segment::dhcp_answer) {
            segment.send(&answer);
        }
    }
}
