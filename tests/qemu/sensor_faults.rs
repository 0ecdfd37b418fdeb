//! What goes wrong with the sensor and its line, with the real firmware image in QEMU: afterwards there are
//! reports again, without a hand, and no report that was not measured.

use std::sync::Arc;

use crate::support::board::{host_of, image, start};
use crate::support::observer::{Measured, Noted, Observer, SECOND_US, from_now_on, sensor, sent_ms};
use kehai::background::Fingerprint;
use kehai::device::Settings;
use kehai::pipeline::Pipeline;
use kehai::scan::{Geometry, GeometryParts, MAX_BEAMS, Scan};
use kehai::wire::{Alarms, Counter, Counters, DATAGRAM_MAX, Identity, Message, Report, SensorCode};
use kehai_emulator::pc::host::{Condition, Host, Seen};
use kehai_emulator::qemu::{Forwarded, Line, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan, StillRoom};
use kehai_emulator::urg::model::{Interface, Model, URG_04LX};
use kehai_emulator::urg::{Config, LinkState, Start, State};

/// A sensor that is there at once, where its line does not matter.
const URG: Model = Model { interface: Interface::Usb, ..URG_04LX };

/// Scan period, ms.
const PERIOD_MS: u64 = 100;

fn room() -> StillRoom {
    StillRoom::new(URG.geometry)
}

/// The board with a sensor that streams, and a host that has seen it learn.
fn settled(sensor: &UdpSensor) -> Option<(Qemu, Host<Forwarded>)> {
    let board = start(image()?, Line::AnySpeed(sensor), None);
    let mut host = host_of(&board);
    host.settle();
    Some((board, host))
}

/// Nothing needs attention.
fn is_well(health: &Condition) -> bool {
    health.head.alarms == Alarms::default()
}

#[test]
fn an_empty_scene_gives_a_report_for_every_scan_and_a_dead_sensor_is_reported_within_ten_periods() {
    let sensor = sensor(Config::new(URG), room());
    let Some((_board, mut host)) = settled(&sensor) else { return };
    host.more(20);
    host.assert_every_scan_reported(&sensor);
    let nothing: Vec<bool> = host.reports.iter().map(|report| report.found[0] == 0).collect();
    assert!(nothing.iter().all(|nothing| *nothing), "candidates in an empty room");
    assert!(!host.health(|_| true).head.alarms.has(Alarms::NO_SCANS));

    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Silent));
    let dead = host.health(|health| health.head.alarms.has(Alarms::NO_SCANS));
    let silent_us = dead.head.uptime_us - host.reports.last().unwrap().head.stamp_us;
    println!("no scan: said {silent_us} µs after the last one began");
    // It began a period before it was there, and arrives within another.
    assert!(silent_us <= 12 * PERIOD_MS * 1000, "{silent_us}");
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Up));
    host.health(is_well);
}

#[test]
fn after_three_silent_seconds_reports_come_again() {
    let sensor = sensor(Config::new(URG), room());
    let Some((_board, mut host)) = settled(&sensor) else { return };
    let begin_ms = from_now_on(&sensor, &["stall:0,3"]);
    host.health(|health| health.head.alarms.has(Alarms::NO_SCANS));
    host.reports.clear();
    let first = host.more(20);
    println!("silent for 3 s: reports again from {} ms on", first.head.sensor_ms - begin_ms);
    host.assert_every_scan_reported(&sensor);
    host.health(is_well);
}

#[test]
fn a_sensor_unplugged_and_plugged_in_again_is_found_again() {
    let sensor = sensor(Config::new(URG), room());
    let Some((_board, mut host)) = settled(&sensor) else { return };
    sensor.with(|urg, now_us| urg.set_link(now_us, LinkState::Silent));
    host.health(|health| health.head.sensor.code == SensorCode::Searching);
    let plugged_ms = sensor.with(|urg, now_us| {
        urg.set_link(now_us, LinkState::Up);
        u64::from(urg.stamp_ms(now_us))
    });
    host.reports.clear();
    let first = host.more(20);
    println!("plugged in: reports again from {} ms on", first.head.sensor_ms - plugged_ms);
    host.assert_every_scan_reported(&sensor);
    assert_eq!(first.head.background_version, 1, "its background is still good");
    host.health(is_well);
}

#[test]
fn a_sensor_switched_off_and_on_comes_back_from_scip_11() {
    let sensor = sensor(Config::new(URG), room());
    let Some((_board, mut host)) = settled(&sensor) else { return };
    sensor.with(|urg, now_us| urg.power_cycle(now_us, SECOND_US));
    host.health(|health| health.head.alarms.has(Alarms::NO_SCANS));
    let state = sensor.with(|urg, _| urg.state());
    assert!(matches!(state, State::Off | State::Booting | State::Scip11), "{state:?}");
    host.reports.clear();
    let first = host.more(20);
    // The boot takes 2 s; its clock begins with it.
    println!("switched on: reports again from {} ms on", first.head.sensor_ms & 0xff_ffff);
    host.assert_no_report_missing();
    assert_eq!(first.head.background_version, 1, "its background is still good");
    let health = host.health(is_well);
    assert!(health.counters.get(Counter::SensorClockRestarts) > 0, "{:?}", health.counters);
}

/// A room through which something goes to and fro, once the background is learned: no two scans alike.
#[derive(Clone)]
struct Restless {
    room: StillRoom,
    scans: usize,
}

impl RangeSource for Restless {
    fn geometry(&self) -> SensorGeometry {
        self.room.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.scans += 1;
        let mut scan = self.room.scan(revolution)?;
        if self.scans > 100 {
            let first = 100 + self.scans * 7 % 400;
            for (step, range_mm) in scan.ranges_mm[first..first + 60].iter_mut().enumerate() {
                *range_mm = 700 + (self.scans % 50) as u32 * 5 + step.abs_diff(30) as u32 / 2;
            }
        }
        Some(scan)
    }
}

/// The pipeline on the ranges of the reported scans must give the same results as the board's reports.
#[track_caller]
fn assert_as_measured(host: &Host<Forwarded>, sensor: &UdpSensor, measured: &Measured) {
    let SensorGeometry { first_step, last_step, front_step, steps_per_turn, period_us, .. } = URG.geometry;
    let geometry = Geometry::new(GeometryParts {
        first_step,
        last_step,
        cluster: 1,
        front_step,
        steps_per_turn,
        period_us,
        range_min_mm: URG.geometry.range_min_mm as u16,
        range_max_mm: URG.geometry.range_max_mm as u16,
    })
    .unwrap();
    let mut pipeline = Box::new(Pipeline::<MAX_BEAMS>::new());
    let settings = Settings::new().pipeline(URG.model_text, geometry.range_max_mm());
    pipeline.configure(&geometry, settings, Fingerprint::of(b"reference", &geometry)).unwrap();
    let measured = measured.lock().unwrap();
    let truth: Vec<_> = sensor.with(|urg, _| urg.truth().collect());
    let mut found = 0;
    for report in &host.reports {
        let stamp_ms = (report.head.sensor_ms & 0xff_ffff) as u32;
        let sent = truth.iter().find(|truth| truth.stamp_ms == stamp_ms).expect("a scan that was sent");
        let ranges_mm: Vec<u16> = measured[&sent.start_us].iter().map(|range_mm| *range_mm as u16).collect();
        let scan = Scan { geometry: &geometry, ranges_mm: &ranges_mm, time: report.head.time() };
        let expected = Message::Report(Report::of(pipeline.process(&scan), 0, 0));
        let mut datagram = [0; DATAGRAM_MAX];
        let length = expected.encode(Identity::default(), &mut datagram).unwrap();
        let expected = Seen::of(&datagram[..length]).unwrap();
        assert_eq!(report.head.sequence, expected.head.sequence);
        assert_eq!(report.head.background_version, expected.head.background_version);
        assert_eq!(report.found, expected.found, "scan {}", report.head.sequence);
        found += usize::from(report.found[0] > 0);
    }
    println!("{} reports are as measured, {found} of them with candidates", host.reports.len());
    assert!(found > 50);
}

/// A board with a restless room before its sensor, and a host that has every report from the first on, until
/// the background was learned and things have moved for a while.
fn watched_from_the_first_scan() -> Option<(Qemu, Host<Forwarded>, UdpSensor, Measured)> {
    let image = image()?;
    let measured = Measured::default();
    let source = Noted(Restless { room: room(), scans: 0 }, Arc::clone(&measured));
    // It boots for two seconds: the host is there before.
    let sensor = sensor(Config { start: Start::Booting, ..Config::new(URG) }, source);
    let board = start(image, Line::AnySpeed(&sensor), None);
    let mut host = host_of(&board);
    host.health(|health| health.head.background_version == 1 && health.head.storing);
    host.health(|health| !health.head.storing);
    host.more(60);
    Some((board, host, sensor, measured))
}

#[test]
fn with_one_byte_in_twenty_thousand_wrong_every_scan_is_reported_as_measured_or_counted() {
    let Some((_board, mut host, sensor, measured)) = watched_from_the_first_scan() else { return };
    let before = host.health(|_| true).counters;
    let begin = host.reports.len() - 1;
    from_now_on(&sensor, &["bit-flip:0.00005"]);
    host.more(180);
    from_now_on(&sensor, &[]);
    host.more(5);
    let after = host.health(|_| true).counters;
    // The report of a scan counts the scans lost before it.
    let (first, last) = (host.reports[begin].head, host.reports[host.reports.len() - 1].head);
    let all = first.sensor_ms..=last.sensor_ms;
    let sent = sent_ms(&sensor).into_iter().filter(|stamp_ms| all.contains(stamp_ms)).count();
    let (accepted, lost) = (host.reports.len() - begin, (last.lost_scans - first.lost_scans) as usize);
    let share = 100.0 * lost as f64 / sent as f64;
    println!("{sent} scans sent, {accepted} accepted, {lost} counted as lost: {share:.1} %");
    assert_eq!(accepted + lost, sent);
    assert!((5..60).contains(&lost), "not about 20 of 200");
    let [stalls, damaged] = [Counter::SensorStalls, Counter::ScansDamaged]
        .map(|counter| after.get(counter) - before.get(counter));
    assert!(stalls == 0 && damaged as usize >= lost, "{stalls} stalls, {damaged} damaged");
    host.assert_no_report_missing();
    assert_as_measured(&host, &sensor, &measured);
}

#[test]
fn ten_seconds_with_one_byte_in_a_hundred_wrong_bring_no_wrong_report_and_are_over_within_two() {
    let Some((_board, mut host, sensor, measured)) = watched_from_the_first_scan() else { return };
    let before = host.health(|_| true);
    let begin_ms = from_now_on(&sensor, &["bit-flip:0.01"]);
    while sensor.with(|urg, now_us| u64::from(urg.stamp_ms(now_us))) < begin_ms + 10_000 {
        host.turn(|_, _| None::<()>);
    }
    let end_ms = from_now_on(&sensor, &[]);
    let during = host.reports.len();
    host.more(50);
    let after = host.reports[during..].iter().find(|report| report.head.sensor_ms >= end_ms).unwrap();
    println!("reports again {} ms after the noise", after.head.sensor_ms - end_ms);
    assert!(after.head.sensor_ms < end_ms + 2000);
    assert_eq!(host.reports[0].head.sequence, 1);
    host.assert_no_report_missing();
    assert_as_measured(&host, &sensor, &measured);
    let health = host.health(is_well);
    let damaged = |counters: &Counters| counters.get(Counter::ScansDamaged);
    println!("{} scans damaged", damaged(&health.counters) - damaged(&before.counters));
    assert_eq!(host.identity.boot, 1, "it has not started anew");
}
