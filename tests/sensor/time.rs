//! The times of scans, end to end: through link, reader, session and clock, against the emulator's truth.
//!
//! Rows are those of the table of reported problems with SCIP clients in the field.

use crate::driver_and_sensor::{DriverAndSensor, SECOND_US, config, fault};
use kehai::sensor::SensorSettings;
use kehai_emulator::link::LinkOptions;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::{MODELS, URG_04LX, UST_10LX};
use kehai_emulator::urg::{Config, Start};

/// Largest error in µs after `from_s`.
fn worst_us(pair: &DriverAndSensor, from_s: f64) -> i64 {
    let errors = pair.time_errors();
    errors.iter().filter(|(at_s, ..)| *at_s >= from_s).map(|(_, error_us, _)| error_us.abs()).max().unwrap()
}

fn jittery(seed: u64, jitter_us: u64) -> LinkOptions {
    LinkOptions { jitter_us, seed, ..LinkOptions::default() }
}

#[test]
fn with_drift_jitter_and_a_stall_the_time_is_right_to_5_ms_after_10_s() {
    let mut worst = 0;
    for seed in 0..12 {
        for clock_fast_ppm in [3000, -3000, 0] {
            let faults = [fault(&format!("stall:{},0.39", 5 + seed))];
            let config = Config { clock_fast_ppm, seed, ..config(URG_04LX, Start::Idle, &faults) };
            let mut pair: DriverAndSensor =
                DriverAndSensor::with(config, jittery(seed, 20_000), SensorSettings::SERIAL);
            let first_s = pair.scan_after(0.0);
            pair.run_to(60.0);
            worst = worst.max(worst_us(&pair, first_s + 10.0));
        }
    }
    println!("0.3 % of drift, 0 to 20 ms of jitter, a stall of 390 ms: off by {worst} µs at most");
    assert!(worst <= 5_000);
}

// Row 20: sensors answer at once, on ticks, or on the rhythm of the mirror.
#[test]
fn every_models_time_is_right_on_a_quiet_link() {
    for model in MODELS {
        let mut pair = DriverAndSensor::new(config(model, Start::Idle, &[]));
        let first_s = pair.scan_after(0.0);
        pair.run_to(30.0);
        let worst = worst_us(&pair, first_s + 10.0);
        let uncertainty = pair.scans.last().unwrap().time.uncertainty_us;
        println!("{:<14} off by {worst} µs at most, said ±{uncertainty} µs", model.name);
        assert!(worst <= 2_000 && uncertainty < 5_000, "{}", model.name);
    }
}

// Row 17: the stamp wraps after 4.66 h; and starts anew with the sensor.
#[test]
fn the_stamps_wrap_and_restart_are_followed() {
    let config =
        Config { clock_start_ms: 0xff_0000, ..config(URG_04LX, Start::Idle, &[fault("power-cycle:120,1")]) };
    let mut pair: DriverAndSensor = DriverAndSensor::with(config, jittery(5, 5_000), SensorSettings::SERIAL);
    let first_s = pair.scan_after(0.0);
    pair.run_to(119.0);
    let stamps: Vec<_> = pair.scans.iter().map(|scan| scan.time.sensor_ms).collect();
    assert!(stamps[0] < 1 << 24 && *stamps.last().unwrap() > 1 << 24, "it has wrapped");
    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(worst_us(&pair, first_s + 10.0) <= 5_000);
    let back_s = pair.scan_after(121.0);
    pair.run_to(180.0);
    assert_eq!(pair.counters().clock_restarts, 1);
    assert!(pair.scans.last().unwrap().time.sensor_ms < 60_000);
    assert!(worst_us(&pair, back_s + 10.0) <= 5_000);
}

// Row 19: offsets beyond 32 bits.
#[test]
fn a_module_that_has_run_for_a_year_maps_as_well() {
    let year_us = 365 * 86_400 * SECOND_US;
    let room = StillRoom::new(UST_10LX.geometry);
    let mut pair: DriverAndSensor = DriverAndSensor::on(
        config(UST_10LX, Start::Idle, &[]),
        jittery(1, 2_000),
        SensorSettings::NO_SPEED,
        Box::new(room),
        Vec::new(),
        year_us,
    );
    let year_s = (year_us / SECOND_US) as f64;
    pair.run_to(year_s + 30.0);
    assert!(pair.scans.len() > 1000);
    assert!(worst_us(&pair, year_s + 10.0) <= 3_000);
}

// A stream that was resumed goes on with the times it had. Row 33 (the first scans are unsteady) is tested on
// the clock itself, in src/sensor/clock.rs.
#[test]
fn times_stay_right_through_a_stall_that_was_resumed_from() {
    let mut pair: DriverAndSensor = DriverAndSensor::with(
        config(URG_04LX, Start::Idle, &[fault("stall:30,0.9,40")]),
        jittery(2, 10_000),
        SensorSettings::SERIAL,
    );
    pair.run_to(200.0);
    assert!(pair.counters().resumes >= 3);
    assert_eq!(pair.counters().clock_restarts, 0);
    let worst = worst_us(&pair, 15.0);
    println!("off by {worst} µs at most");
    assert!(worst <= 5_000);
}

#[test]
fn the_uncertainty_covers_the_error() {
    let mut pair: DriverAndSensor = DriverAndSensor::with(
        config(URG_04LX, Start::Scip11, &[]),
        jittery(3, 20_000),
        SensorSettings::SERIAL,
    );
    pair.run_to(300.0);
    let errors = pair.time_errors();
    let outside =
        errors.iter().filter(|(_, error_us, said_us)| error_us.unsigned_abs() > u64::from(*said_us)).count();
    println!("{outside} of {} off by more than they said", errors.len());
    assert!(outside * 100 <= errors.len());
}
