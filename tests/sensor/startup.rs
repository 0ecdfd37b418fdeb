//! The driver finds a sensor in whatever state it was left, and soon.
//!
//! Rows are those of the table of reported problems with SCIP clients in the field.

use crate::driver_and_sensor::{DriverAndSensor, config, fault, remembering};
use kehai::scan::GeometryError;
use kehai::scip::Width;
use kehai::sensor::{LineSettings, SensorSettings, SensorState};
use kehai_emulator::link::LinkOptions;
use kehai_emulator::source::SensorGeometry;
use kehai_emulator::urg::faults::Fault;
use kehai_emulator::urg::model::{
    Interface, MODELS, Model, QuitInTimeSync, UHG_08LX, URG_04LX, UST_10LX, UTM_30LX, WhileBooting,
};
use kehai_emulator::urg::{Config, Start};

/// Scan periods until the first scan is handed on.
fn periods(pair: &mut DriverAndSensor) -> f64 {
    let period_us = pair.link.with_sensor(|sensor, _| sensor.period_us());
    let periods = pair.scan_after(0.0) * 1e6 / f64::from(period_us);
    assert_eq!(pair.state(), SensorState::Streaming);
    periods
}

#[test]
fn the_first_scan_comes_within_20_periods_and_within_40_at_other_rates() {
    let mut late = Vec::new();
    let mut check = |name: String, limit: f64, mut pair: DriverAndSensor| {
        let periods = periods(&mut pair);
        println!("{name:<42} {periods:5.1} periods of {limit}");
        if periods > limit {
            late.push(name);
        }
    };
    for start in [Start::Idle, Start::Scip11, Start::TimeSync] {
        check(format!("19200 {start:?}"), 20.0, DriverAndSensor::new(config(URG_04LX, start, &[])));
    }
    for baud in [19_200, 57_600, 115_200, 250_000, 500_000, 750_000] {
        for start in [Start::Idle, Start::Streaming] {
            let config = Config { start, baud, ..Config::new(URG_04LX) };
            let known = DriverAndSensor::with(config.clone(), LinkOptions::default(), remembering(baud));
            check(format!("{baud} remembered, {start:?}"), 20.0, known);
            let limit = if baud >= 115_200 && start == Start::Streaming { 20.0 } else { 40.0 };
            check(format!("{baud} unknown, {start:?}"), limit, DriverAndSensor::new(config));
        }
    }
    assert_eq!(late, Vec::<String>::new());
}

#[test]
fn every_model_is_found_in_every_state() {
    for model in MODELS {
        for start in [Start::Idle, Start::Streaming, Start::TimeSync, Start::Booting, Start::Abnormal] {
            let mut pair = DriverAndSensor::new(config(model, start, &[]));
            let first_s = pair.scan_after(0.0);
            println!("{:<14} {start:?}: {first_s:.2} s", model.name);
            let steps = model.geometry.steps();
            assert!(pair.scans.iter().all(|scan| scan.beams == steps));
            assert!(first_s < 12.0, "{} {start:?}: {first_s} s", model.name);
            pair.run_to(first_s + 5.0);
            let wanted = 5e6 / model.geometry.period_us as f64;
            assert!(pair.scans.len() as f64 >= wanted, "{} {start:?} {pair:?}", model.name);
            assert_eq!(pair.counters().scans_missing, 0, "{} {start:?}", model.name);
        }
    }
}

// Row 1: a stream of the last session still runs; a client that waits for silence waits for ever.
#[test]
fn a_stream_left_running_is_ended_at_10_and_40_hz_whatever_it_carries() {
    let streams = [
        (URG_04LX, "MD0044072501000"),
        (URG_04LX, "MS0000076801000"),
        (UTM_30LX, "MD0000108001000"),
        (UTM_30LX, "ME0000108001000"),
        (UST_10LX, "ND0000108001000"),
        (UST_10LX, "NE0000108001000;left"),
    ];
    for (model, left_running) in streams {
        let left_running = Some(left_running.to_string());
        let config = Config { start: Start::Streaming, baud: 750_000, left_running, ..Config::new(model) };
        let first_s = DriverAndSensor::new(config).scan_after(0.0);
        assert!(first_s < 2.0, "{}: {first_s} s", model.name);
    }
}

// Row 1: at 19 200 baud a scan in flight takes 1.1 s.
#[test]
fn a_slow_stream_left_running_is_waited_for_and_no_longer() {
    for quits_ignored in [0, 1, 3] {
        let fault = Fault::IgnoreQuit(quits_ignored);
        let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Streaming, &[fault]));
        assert!(pair.scan_after(0.0) < 4.0, "{pair:?}");
    }
}

// Row 2: a URG-04LX wakes up in SCIP 1.1. That it is found is in the table above; here in mid-session.
#[test]
fn a_power_cycle_into_scip_1_1_at_the_default_rate_is_recovered_from() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Scip11, &[fault("power-cycle:10,1")]));
    let before_s = pair.scan_after(9.5);
    assert_eq!(pair.sensor_baud(), 250_000);
    let back_s = pair.scan_after(11.0);
    println!("power back at 11 s, booted at 13 s; scans until {before_s:.1} s, then from {back_s:.2} s");
    assert!(back_s < 13.0 + 2.5, "{pair:?}");
    assert_eq!(pair.sensor_baud(), 250_000);
    assert_eq!((pair.counters().clock_restarts, pair.counters().baud_changes), (1, 2));
}

// Row 3: a stray line and a wrong sum in VV; and VV asked again and again makes some sensors mute.
#[test]
fn a_bad_version_is_taken_as_it_is_and_not_asked_for_again() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[Fault::BadVersion]));
    pair.run_to(30.0);
    assert_eq!(pair.requests("VV"), 1);
    assert_eq!(pair.driver.session().version().unwrap().serial.as_str(), URG_04LX.serial);
}

// Rows 4, 9, 24, 30: an unsupported request wedges some sensors, II during a stream splits scans, STX-framed
// AR00 hangs others, %SL takes a second: none of them is ever sent. Row 25: nor is intensity asked for, under
// which UTM-30LX firmware 1.16.01 crashes.
#[test]
fn nothing_is_probed_by_trial_and_a_stream_is_left_alone() {
    for model in MODELS {
        let mut pair =
            DriverAndSensor::new(config(model, Start::Idle, &[Fault::Wedge, fault("power-cycle:4,1")]));
        pair.run_to(20.0);
        assert_eq!(pair.state(), SensorState::Streaming);
        let requests = pair.tapped.borrow().requests.clone();
        let known = ["QT", "SCIP2.0", "VV", "PP", "SS", "TM0", "TM1", "TM2", "MD", "BM"];
        let odd = requests.iter().find(|(_, text)| !known.iter().any(|start| text.starts_with(start)));
        assert_eq!(odd, None, "{}", model.name);
        let streaming = |at_us: u64| (1_500_000..4_000_000).contains(&at_us) || at_us > 12_000_000;
        assert!(requests.iter().all(|(at_us, _)| !streaming(*at_us)), "{}: {requests:?}", model.name);
    }
}

// Row 5: what failed in one bad first connection is tried again in the next.
#[test]
fn a_faster_line_that_failed_once_is_tried_again_at_the_next_start() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[fault("power-cycle:20,1")]));
    // Everything after SS is lost.
    pair.run_to(0.42);
    assert_eq!(pair.requests("SS"), 1);
    pair.link.unplug();
    pair.run_to(1.2);
    pair.link.replug();
    pair.scan_after(1.2);
    pair.scan_after(22.0);
    pair.run_to(40.0);
    assert_eq!((pair.state(), pair.sensor_baud()), (SensorState::Streaming, 250_000), "{pair:?}");
    assert!(pair.counters().baud_changes >= 1);
}

// Row 12 concerns the emulated sensor: requests that come in several pieces. The driver sends each whole.

// Row 13: QT ignored; TM0 answered 10 although QT was answered 00.
#[test]
fn ignored_quits_and_denied_time_requests_are_repeated() {
    for start in [Start::Idle, Start::Streaming] {
        for count in 1..=3 {
            let faults = [Fault::IgnoreQuit(count), Fault::TimeBusy(count)];
            let mut pair = DriverAndSensor::new(config(URG_04LX, start, &faults));
            let first_s = pair.scan_after(0.0);
            assert!(first_s < 12.0, "{start:?} {count}: {first_s} s");
            assert!(pair.requests("TM1") >= 4, "its clock was read after all");
        }
    }
}

// Row 13: a sensor that never lets its clock be read still measures.
#[test]
fn a_sensor_without_time_requests_is_used_without_them() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[Fault::TimeBusy(1_000_000)]));
    assert!(pair.scan_after(0.0) < 2.5);
    assert_eq!(pair.requests("TM1"), 0);
}

// The text of SCIP 2.2 lets a sensor deny QT in the time-sync state, which the driver enters at every start: a restart
// at that moment must not strand a sensor on a line that does not tell it of the restart.
#[test]
fn a_sensor_that_denies_quitting_is_brought_out_of_time_sync() {
    for interface in [Interface::Ethernet, Interface::Usb, Interface::Rs232] {
        let model = Model { quit_in_time_sync: QuitInTimeSync::Refused, interface, ..UST_10LX };
        let mut pair = DriverAndSensor::new(config(model, Start::TimeSync, &[]));
        let first_s = pair.scan_after(0.0);
        println!("{interface:?}: first scan at {first_s:.2} s");
        assert!(first_s < 2.0, "{pair:?}");
        // Once to leave the state it was found in, once after its clock was read.
        assert_eq!(pair.requests("TM2"), 2);
        assert_eq!(pair.counters().reboots, 0);
    }
}

// Row 16: a sensor that answers everything while it starts, and sends no scan yet. Told to reboot, it would start anew.
#[test]
fn a_sensor_that_answers_while_booting_is_left_to_boot() {
    for boot_s in [8, 15, 30] {
        let model = Model { while_booting: WhileBooting::Accepts, ..UTM_30LX };
        let config = Config { boot_us: boot_s * 1_000_000, ..config(model, Start::Booting, &[]) };
        let mut pair = DriverAndSensor::new(config);
        let first_s = pair.scan_after(0.0);
        println!("ready at {boot_s} s, first scan at {first_s:.2} s");
        assert!(first_s < boot_s as f64 + 2.0, "{pair:?}");
        assert_eq!((pair.requests("RS"), pair.requests("RB")), (0, 0));
    }
}

// Row 14: 0L to everything but RB, and RB's answer may be missing.
#[test]
fn an_abnormal_sensor_is_rebooted_even_without_an_answer() {
    for faults in [vec![], vec![Fault::SilentReboot]] {
        let mut pair = DriverAndSensor::new(config(UST_10LX, Start::Abnormal, &faults));
        let first_s = pair.scan_after(0.0);
        assert!(pair.was(SensorState::Abnormal));
        assert!(first_s < 5.0, "{first_s} s");
        assert_eq!(pair.counters().reboots, 1);
    }
}

// Row 16: just plugged in: silence, or refusals 10 and 01.
#[test]
fn a_booting_sensor_is_waited_for() {
    for model in MODELS {
        let config = Config { boot_us: 6_000_000, ..config(model, Start::Booting, &[]) };
        let mut pair = DriverAndSensor::new(config);
        let first_s = pair.scan_after(0.0);
        println!("{}: ready at 6 s, first scan at {first_s:.2} s", model.name);
        assert!(first_s < 6.0 + 3.5, "{}", model.name);
    }
    let mut pair = DriverAndSensor::new(config(UST_10LX, Start::Booting, &[]));
    pair.run_to(1.0);
    assert_eq!(pair.state(), SensorState::Booting);
    pair.scan_after(1.0);
    assert!(pair.requests("TM1") > 0, "its clock is read once it is ready");
}

// Row 22: garbage before the first echo.
#[test]
fn garbage_before_the_first_reply_does_no_harm() {
    for bytes in [1, 40, 500, 5000] {
        for model in [URG_04LX, UST_10LX] {
            let mut pair = DriverAndSensor::new(config(model, Start::Idle, &[Fault::Garbage(bytes)]));
            let first_s = pair.scan_after(0.0);
            // At 19 200 baud 5000 bytes take 2.6 s.
            assert!(first_s < 5.0, "{} {bytes}: {first_s} s", model.name);
        }
    }
}

// Row 28: FIRM without a bracket and a product that no table lists: nothing is decided by them.
#[test]
fn every_models_version_is_read() {
    for model in MODELS {
        let mut pair = DriverAndSensor::new(config(model, Start::Idle, &[]));
        pair.scan_after(0.0);
        let version = pair.driver.session().version().unwrap();
        assert_eq!((version.serial.as_str(), version.firmware.as_str()), (model.serial, model.firmware));
    }
}

// Row 29 (stale replies taken as answers) is tested on the session itself, in src/sensor/session/mod.rs.

// Row 31: a device that never answers: every rate is tried for a bounded time, again and again.
#[test]
fn a_silent_device_is_searched_without_end_and_found_once_it_speaks() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[]));
    pair.link.unplug();
    pair.run_to(60.0);
    assert_eq!(pair.state(), SensorState::Searching);
    let asked = pair.requests("QT");
    println!("{asked} requests in 60 s of silence");
    assert!((100..=300).contains(&asked));
    pair.link.replug();
    assert!(pair.scan_after(60.0) < 64.0);
}

// Row 32: mismatched replies on the first tries.
#[test]
fn a_start_on_a_bad_line_succeeds_in_the_end() {
    for (seed, every) in [(1, 100), (2, 50), (3, 30)] {
        let mut pair = DriverAndSensor::new(Config { seed, ..Config::new(URG_04LX) });
        pair.tapped.borrow_mut().noise = Some((0, 8_000_000, every));
        let first_s = pair.scan_after(0.0);
        println!("one byte in {every} wrong for 8 s: first scan at {first_s:.2} s");
        assert!(first_s < if every == 100 { 10.0 } else { 12.0 }, "{pair:?}");
    }
}

// Rows 5, 32: a speed that could not be proven through the noise is not given up for good.
#[test]
fn a_line_left_slow_by_a_bad_start_is_made_faster_later() {
    let mut pair = DriverAndSensor::new(config(URG_04LX, Start::Idle, &[]));
    pair.run_to(0.366);
    assert_eq!(pair.requests("SS"), 1, "asked, but not heard");
    pair.link.unplug();
    pair.run_to(1.2);
    pair.link.replug();
    pair.scan_after(1.2);
    assert_eq!(pair.sensor_baud(), 19_200);
    pair.run_to(100.0);
    assert_eq!((pair.state(), pair.sensor_baud()), (SensorState::Streaming, 250_000), "{pair:?}");
}

#[test]
fn a_sensor_larger_than_the_memory_is_refused_by_name_and_asked_again() {
    let options = LinkOptions::default();
    let mut pair: DriverAndSensor<682> =
        DriverAndSensor::with(config(UHG_08LX, Start::Idle, &[]), options, SensorSettings::NO_SPEED);
    pair.run_to(20.0);
    assert_eq!(pair.state(), SensorState::TooLarge { beams: 769, capacity: 682 });
    assert!((4..=8).contains(&pair.requests("PP")), "{}", pair.requests("PP"));
    assert_eq!(pair.scans.len(), 0);
    // With a cluster of two it fits.
    let settings = SensorSettings { cluster: 2, ..SensorSettings::NO_SPEED };
    let mut pair: DriverAndSensor<682> =
        DriverAndSensor::with(config(UHG_08LX, Start::Idle, &[]), options, settings);
    pair.scan_after(0.0);
    assert_eq!(pair.scans[0].beams, 385);
}

#[test]
fn impossible_parameters_are_refused_by_name() {
    let geometry = SensorGeometry { steps_per_turn: 40, ..URG_04LX.geometry };
    let mut pair = DriverAndSensor::new(config(Model { geometry, ..URG_04LX }, Start::Idle, &[]));
    pair.run_to(10.0);
    assert_eq!(pair.state(), SensorState::Unusable(GeometryError::StepsPerTurn));
}

#[test]
fn settings_choose_steps_cluster_skip_and_width() {
    let settings = SensorSettings {
        first_step: Some(300),
        last_step: Some(500),
        cluster: 10,
        skip: 1,
        width: Width::Two,
        ..SensorSettings::SERIAL
    };
    for drop_incomplete_group in [false, true] {
        let config = Config { drop_incomplete_group, ..Config::new(URG_04LX) };
        let mut pair: DriverAndSensor = DriverAndSensor::with(config, LinkOptions::default(), settings);
        pair.run_to(5.0);
        assert_eq!(pair.requests("MS0300050010100"), 1);
        assert_eq!(pair.sensor_baud(), 19_200, "that is enough for 147 bytes in 200 ms");
        assert_eq!(pair.scans[0].beams, if drop_incomplete_group { 20 } else { 21 });
        assert!(pair.scans.len() > 15);
        assert_eq!(pair.counters().scans_missing, 0);
    }
}

#[test]
fn a_line_too_slow_for_every_scan_still_carries_some() {
    let line = LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 57_600 };
    let settings = SensorSettings { line, ..SensorSettings::SERIAL };
    let mut pair: DriverAndSensor =
        DriverAndSensor::with(config(URG_04LX, Start::Idle, &[]), LinkOptions::default(), settings);
    pair.run_to(30.0);
    assert_eq!(pair.sensor_baud(), 57_600);
    assert!((60..=80).contains(&pair.scans.len()), "{pair:?}");
    assert_eq!((pair.counters().stalls, pair.counters().starts), (0, 1));
}
