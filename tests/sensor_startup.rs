//! The driver finds a sensor in whatever state it was left, and soon.
//!
//! Rows are those of the table of reported problems with SCIP clients in the field.

mod rig;

use host_sim::link::LinkOptions;
use host_sim::urg::model::{MODELS, URG_04LX};
use host_sim::urg::{Config, Start};
use kehai::sensor::{SensorSettings, SensorState};
use rig::{Rig, config, remembering};

/// Scan periods until the first scan is handed on.
fn periods(rig: &mut Rig) -> f64 {
    let period_us = rig.link.with_sensor(|sensor, _| sensor.period_us());
    let periods = rig.scan_after(0.0) * 1e6 / f64::from(period_us);
    assert_eq!(rig.state(), SensorState::Streaming);
    periods
}

#[test]
fn the_first_scan_comes_within_20_periods_and_within_40_at_other_rates() {
    let mut late = Vec::new();
    let mut check = |name: String, limit: f64, mut rig: Rig| {
        let periods = periods(&mut rig);
        println!("{name:<42} {periods:5.1} periods of {limit}");
        if periods > limit {
            late.push(name);
        }
    };
    for start in [Start::Idle, Start::Scip11, Start::TimeSync] {
        check(format!("19200 {start:?}"), 20.0, Rig::new(config(URG_04LX, start, &[])));
    }
    for baud in [19_200, 57_600, 115_200, 250_000, 500_000, 750_000] {
        for start in [Start::Idle, Start::Streaming] {
            let config = Config { start, baud, ..Config::new(URG_04LX) };
            let limit = if baud >= 115_200 { 20.0 } else { 40.0 };
            let known = Rig::with(config.clone(), LinkOptions::default(), remembering(baud));
            check(format!("{baud} remembered, {start:?}"), limit, known);
            check(format!("{baud} unknown, {start:?}"), 40.0, Rig::new(config));
        }
    }
    assert_eq!(late, Vec::<String>::new());
}

#[test]
fn every_model_is_found_in_every_state() {
    for model in MODELS {
        for start in [Start::Idle, Start::Streaming, Start::TimeSync, Start::Booting, Start::Abnormal] {
            let mut rig = Rig::new(config(model, start, &[]));
            let first_s = rig.scan_after(0.0);
            println!("{:<14} {start:?}: {first_s:.2} s", model.name);
            let steps = model.geometry.steps();
            assert!(rig.scans.iter().all(|scan| scan.beams == steps));
            assert!(first_s < 12.0, "{} {start:?}: {first_s} s", model.name);
            rig.run_to(first_s + 5.0);
            let wanted = 5e6 / model.geometry.period_us as f64;
            assert!(rig.scans.len() as f64 >= wanted, "{} {start:?} {rig:?}", model.name);
            assert_eq!(rig.counters().scans_missing, 0, "{} {start:?}", model.name);
        }
    }
}

#[test]
fn settings_of_the_rig_default_to_the_serial_line() {
    assert!(SensorSettings::SERIAL.has_speed());
}
