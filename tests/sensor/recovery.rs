//! Damage costs the scans it hits and no others; a sensor that falls silent or vanishes is found again.
//!
//! Rows are those of the table of reported problems with SCIP clients in the field.

use crate::driver_and_sensor::{DriverAndSensor, SECOND_US, config, fault};
use kehai::link::Clock;
use kehai::sensor::{SensorSettings, SensorState};
use kehai_emulator::link::LinkOptions;
use kehai_emulator::simulated_time::block_on;
use kehai_emulator::source::Rows;
use kehai_emulator::urg::faults::Fault;
use kehai_emulator::urg::model::{Interface, URG_04LX, URG_04LX_UG01, UST_10LX, UTM_30LX};
use kehai_emulator::urg::{Config, Start};

/// A pair with these faults, after a minute.
fn minute(faults: &[&str]) -> DriverAndSensor {
    let faults: Vec<Fault> = faults.iter().map(|text| fault(text)).collect();
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &faults));
    pair.run_to(60.0);
    pair
}

/// Nothing but single scans was lost, and all of them counted.
fn assert_only_scans_lost(pair: &DriverAndSensor) {
    pair.assert_all_accounted_for();
    let counters = pair.counters();
    assert_eq!((counters.stalls, counters.resumes, counters.starts), (0, 0, 1), "{pair:?}");
}

// Row 6: scans stop in mid-stream: a short stall loses nothing, a long one is resumed from.
#[test]
fn a_stall_of_390_ms_loses_no_scan_and_restarts_nothing() {
    let pair = minute(&["stall:5,0.39,7"]);
    assert_only_scans_lost(&pair);
    assert_eq!(pair.counters().scans_missing, 0);
}

// Row 6.
#[test]
fn a_long_stall_is_reported_and_resumed_from() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[fault("stall:5,3")]));
    pair.run_to(5.7);
    assert_eq!(pair.state(), SensorState::Stalled);
    let back_s = pair.scan_after(7.0);
    println!("silent from 5 s to 8 s, scans again from {back_s:.2} s");
    // For 2.5 s the line is busy with the bytes held back.
    assert!(back_s < 11.5);
    pair.run_to(20.0);
    assert_eq!(pair.state(), SensorState::Streaming);
}

// Row 6: it answers everything and sends no scan: asked again, reset, and, where it can be, rebooted.
#[test]
fn a_sensor_that_answers_but_never_measures_is_reset_and_rebooted() {
    let geometry = UST_10LX.geometry;
    let source = Box::new(Rows::new(geometry, Vec::new()));
    let mut pair: DriverAndSensor = DriverAndSensor::on(
        config(UST_10LX, Start::Idle, &[]),
        LinkOptions::default(),
        SensorSettings::NO_SPEED,
        source,
        Vec::new(),
        0,
    );
    pair.run_to(600.0);
    println!("{} starts, {} RS, {} RB", pair.counters().starts, pair.requests("RS"), pair.requests("RB"));
    assert!(pair.requests("RS") >= 1 && pair.requests("RB") >= 2);
    assert!(pair.requests("MD") < 120, "and not in haste: {}", pair.requests("MD"));
}

// Rows 7, 8: the cable is pulled and put back; reads return nothing, an error, or wait.
#[test]
fn a_link_that_vanishes_and_returns_is_used_again() {
    for closed_is_error in [false, true] {
        for (model, pull) in [(UST_10LX, true), (UTM_30LX, true), (URG_04LX, false)] {
            let options = LinkOptions { closed_is_error, ..LinkOptions::default() };
            let settings = if pull { SensorSettings::NO_SPEED } else { SensorSettings::SERIAL };
            let mut pair: DriverAndSensor =
                DriverAndSensor::with(config(model, Start::Idle, &[]), options, settings);
            pair.run_to(5.0);
            if pull {
                pair.link.disconnect()
            } else {
                pair.link.unplug()
            }
            pair.run_to(20.0);
            assert_eq!(pair.state(), SensorState::Searching, "{}", model.name);
            let failures = pair.counters().link_failures;
            assert!(failures < 15 * 10, "no busy loop: {failures}");
            pair.link.replug();
            let back_s = pair.scan_after(20.0);
            println!("{}: back after {:.2} s, {failures} failures of the link", model.name, back_s - 20.0);
            assert!(back_s < 23.5, "{}", model.name);
        }
    }
}

// Row 7: out for a moment only: the stream goes on where it was.
#[test]
fn a_short_interruption_needs_no_full_start() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[fault("unplug:5,0.35,6")]));
    pair.run_to(60.0);
    assert_only_scans_lost(&pair);
    assert!((30..=60).contains(&pair.counters().scans_missing));
}

// Row 8: single failed reads, as after an overrun of the receiver.
#[test]
fn failed_reads_cost_no_more_than_the_scans_they_hit() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[]));
    for second in 3..20 {
        pair.tapped.borrow_mut().broken = Some((second * SECOND_US, second * SECOND_US + 3_000));
        pair.run_to(second as f64 + 0.9);
    }
    assert_eq!(pair.counters().starts, 1);
    assert!(pair.counters().link_failures >= 17);
}

// Row 9: counters only ever grow, and no status query is needed to keep them.
#[test]
fn counters_are_monotonic_through_every_kind_of_trouble() {
    let faults = ["bit-flip:0.0002", "power-cycle:6,1,17", "stall:11,2,23", "half-scan:7"];
    let faults = faults.map(fault);
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &faults));
    let mut before = pair.counters();
    for tenth in 1..600 {
        pair.run_to(f64::from(tenth) / 10.0);
        let now = pair.counters();
        assert!(now.scans_accepted >= before.scans_accepted && now.scans_missing >= before.scans_missing);
        assert!(now.stalls >= before.stalls && now.starts >= before.starts);
        before = now;
    }
    assert!(before.starts >= 3 && before.scans_accepted > 150, "{pair:?}");
}

// Row 10: a whole reply to another command in the middle of a scan.
#[test]
fn a_foreign_reply_costs_the_scan_it_splits_and_no_other() {
    let pair = minute(&["foreign-reply:10"]);
    assert_only_scans_lost(&pair);
    let damaged = pair.truth().iter().filter(|truth| truth.damaged).count();
    assert!(damaged > 50);
    let missing = pair.counters().scans_missing as usize;
    assert!((damaged - 1..=damaged).contains(&missing), "{missing} of {damaged}");
}

// Row 11: several replies in one read, or one byte in each. Every cut through every reply is tested on the
// reader itself, in tests/scip/reader.rs.
#[test]
fn the_size_of_the_pieces_makes_no_difference() {
    for model in [URG_04LX_UG01, UST_10LX] {
        let scans = [1, 7, 64, 4096].map(|chunk_bytes| {
            let options = LinkOptions { chunk_bytes, ..LinkOptions::default() };
            let mut pair: DriverAndSensor = DriverAndSensor::with(
                config(model, Start::Streaming, &[]),
                options,
                SensorSettings::NO_SPEED,
            );
            pair.run_to(5.0);
            assert_eq!(pair.counters().scans_missing, 0);
            pair.scans.iter().map(|scan| scan.time.sensor_ms).collect::<Vec<_>>()
        });
        assert!(scans.iter().all(|one| *one == scans[0]));
    }
}

// Row 14: a fault in mid-stream.
#[test]
fn a_sensor_that_breaks_in_mid_stream_is_rebooted() {
    for model in [URG_04LX, UST_10LX] {
        let mut pair = DriverAndSensor::new(config(model, Start::Idle, &[fault("abnormal:6,0")]));
        let back_s = pair.scan_after(7.0);
        println!("{}: broken at 6 s, scans again from {back_s:.2} s", model.name);
        assert!(pair.was(SensorState::Abnormal) && back_s < 14.0);
        // In SCIP 2.0 there is no RB: it is refused, and the sensor reset.
        let (reboots, resets) = (pair.requests("RB"), pair.requests("RS"));
        let cured = if model == UST_10LX { reboots >= 2 } else { reboots >= 1 && resets >= 1 };
        assert!(cured, "{}: {reboots} RB, {resets} RS", model.name);
    }
}

// Row 15: 0M in a stream: this scan has no data, the next has.
#[test]
fn an_unstable_scan_is_passed_over() {
    let pair = minute(&["unstable:5"]);
    let counters = pair.counters();
    assert_eq!((counters.stalls, counters.starts, counters.resumes), (0, 1, 0));
    assert!(counters.scans_unstable > 100);
    assert!(counters.scans_missing.abs_diff(counters.scans_unstable) <= 1, "{counters:?}");
}

// Row 18: the same stamp again and again.
#[test]
fn a_stuck_sensor_is_noticed_and_started_again() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[fault("stuck:5,2")]));
    pair.run_to(20.0);
    let stamps: Vec<_> = pair.scans.iter().map(|scan| scan.time.sensor_ms).collect();
    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]), "no scan is handed on twice");
    assert!(pair.counters().scans_repeated >= 3 && pair.counters().stalls >= 1);
    assert!(pair.was(SensorState::Stalled));
    assert_eq!(pair.state(), SensorState::Streaming);
}

// Row 21: a host too slow for its receiver: some bytes in a row are lost.
#[test]
fn an_overrun_costs_exactly_one_scan() {
    for bytes in [1, 16, 300] {
        let pair = minute(&[&format!("overrun:9,{bytes}")]);
        assert_only_scans_lost(&pair);
        let damaged = pair.truth().iter().filter(|truth| truth.damaged).count() as u32;
        assert!(pair.counters().scans_missing.abs_diff(damaged) <= 1, "{bytes} bytes: {pair:?}");
    }
}

// Row 21: a host held up until its receiver was full. What waits there is read before anything else is tried: were
// reading to pause, the receiver would be full again, answers lost in it, and no end of it.
#[test]
fn a_full_receiver_is_emptied_before_anything_else() {
    for model in [URG_04LX, UTM_30LX, UST_10LX] {
        let options = LinkOptions { receiver_bytes: 4096, ..LinkOptions::default() };
        let settings = match model.interface {
            Interface::Rs232 => SensorSettings::SERIAL,
            Interface::Usb | Interface::Ethernet => SensorSettings::NO_SPEED,
        };
        let mut pair: DriverAndSensor =
            DriverAndSensor::with(config(model, Start::Idle, &[]), options, settings);
        pair.run_to(5.0);
        let held_up_us = 7 * SECOND_US;
        block_on(&pair.clock, pair.clock.wait_until(held_up_us)).unwrap();
        let back_s = pair.scan_after(7.0);
        println!("{}: held up until 7 s, scans again from {back_s:.2} s", model.name);
        assert!(pair.counters().link_failures >= 1, "it was never full: {pair:?}");
        assert!(back_s < 8.0, "{pair:?}");
        pair.run_to(20.0);
        assert_eq!(pair.state(), SensorState::Streaming);
    }
}

#[test]
fn half_scans_cost_themselves() {
    let pair = minute(&["half-scan:8"]);
    assert_only_scans_lost(&pair);
    let damaged = pair.truth().iter().filter(|truth| truth.damaged).count() as u32;
    assert!(pair.counters().scans_missing.abs_diff(damaged) <= 1, "{pair:?}");
}

// Row 23: checksums are verified everywhere: tests/scip/reader.rs flips every bit of a scan. Here every
// accepted scan is compared with the truth (by the pair) while bits flip, bytes vanish and appear.
#[test]
fn with_one_byte_in_20000_damaged_accepted_and_lost_scans_are_those_sent() {
    for (seed, kind) in [(1, "bit-flip"), (2, "lost-byte"), (3, "extra-byte"), (4, "bit-flip")] {
        for model in [URG_04LX, UST_10LX] {
            let fault = fault(&format!("{kind}:0.00005"));
            let mut pair = DriverAndSensor::new(Config { seed, ..config(model, Start::Idle, &[fault]) });
            let seconds = 3e-6 * f64::from(model.geometry.period_us) * 1000.0;
            pair.run_to(seconds);
            print!("{} {kind}: ", model.name);
            assert_only_scans_lost(&pair);
            let lost = pair.counters().scans_missing as f64 / pair.truth().len() as f64;
            assert!((0.04..0.30).contains(&lost), "{lost}");
        }
    }
}

#[test]
fn scans_return_within_2_s_of_the_end_of_10_s_with_one_byte_in_100_damaged() {
    for model in [URG_04LX, UTM_30LX, UST_10LX] {
        for every in [100, 20, 3] {
            let mut pair = DriverAndSensor::new(config(model, Start::Idle, &[]));
            pair.tapped.borrow_mut().noise = Some((5 * SECOND_US, 15 * SECOND_US, every));
            let back_s = pair.scan_after(15.0);
            println!("{}, one byte in {every}: back after {:.2} s", model.name, back_s - 15.0);
            assert!(every < 100 || back_s < 17.0, "{pair:?}");
            assert!(back_s < 19.0, "{pair:?}");
            let during =
                pair.scans.iter().filter(|scan| (6 * SECOND_US..15 * SECOND_US).contains(&scan.at_us));
            println!("  {} scans in between", during.count());
        }
    }
}

// Rows 26 and 27 concern texts and codes: nothing here reads STAT, and codes are typed by kehai::scip.
