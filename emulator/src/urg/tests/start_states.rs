//! States in which a sensor is met: SCIP 1.1, abnormal, in time synchronisation, booting.

use super::*;

#[test]
fn scip11_is_left_by_its_own_command_only() {
    let mut urg = Client::new(Config { start: Start::Scip11, ..fast(URG_04LX) });
    assert_eq!(urg.ask("QT"), "QT\nE\n\n");
    let version = urg.ask("V");
    assert!(
        version.starts_with("V\n0\nVEND:Hokuyo Automatic Co.,Ltd.\nPROD:SOKUIKI Sensor URG-04LX\nFIRM:3.")
    );
    assert!(version.ends_with("STAT:FW Normal[FinalDist with shadow  ]\n\n"));
    let scan = urg.ask("G00076801");
    let lines: Vec<_> = scan.lines().collect();
    assert_eq!((lines[0], lines[1], lines.len()), ("G00076801", "0", 2 + 25 + 1));
    assert_eq!((lines[2].len(), lines[26].len()), (64, 2));
    assert!(scan.matches("0C").count() >= 87, "the steps outside the field read 19");
    assert_eq!(urg.ask("SCIP2.0"), "SCIP2.0\n0\n\n");
    assert_eq!(urg.ask("SCIP2.0"), "SCIP2.0\n0Ee\n\n");
    assert_eq!(urg.status("VV"), "00");
}

#[test]
fn a_power_cycle_forgets_scip2_and_the_speed() {
    let mut urg = Client::new(Config {
        start: Start::Streaming,
        baud: 250_000,
        faults: vec!["power-cycle:1,0.5".parse().unwrap()],
        ..Config::new(URG_04LX)
    });
    urg.hear("", 1_200_000);
    assert_eq!((urg.urg.state(), urg.urg.link()), (State::Off, LinkState::Silent));
    urg.hear("", 400_000);
    assert_eq!(urg.urg.state(), State::Booting);
    assert_eq!(urg.hear("QT\n", 2_000_000), "", "a sensor that starts hears nothing");
    assert_eq!((urg.urg.state(), urg.urg.baud()), (State::Scip11, 19_200));
    assert!(urg.urg.stamp_ms(urg.now_us) < 3000, "the clock starts anew");
}

#[test]
fn only_a_reboot_helps_an_abnormal_sensor() {
    let mut ust = Client::new(Config { start: Start::Abnormal, ..fast(UST_10LX) });
    for refused in ["PP", "QT", "RS", "BM", "MD0000108001000", "TM0", "%ST"] {
        assert_eq!(ust.ask(refused), format!("{refused}\n0Ll\n\n"));
    }
    assert_eq!([ust.status("VV"), ust.status("II")], ["00", "00"]);
    assert_eq!(ust.hear("RB\n", 900_000), "RB\n01Q\n\n");
    assert_eq!(ust.hear("RB\n", 900_000), "RB\n00P\n\n");
    assert_eq!(ust.urg.link(), LinkState::Up);
    ust.hear("", 3_000_000);
    assert_eq!(ust.status("QT"), "00");
    assert_eq!(ust.hear("RB\n", 1_100_000), "RB\n01Q\n\n");
    assert_eq!(ust.status("RB"), "01", "too late for the second one");
}

#[test]
fn a_broken_scip20_sensor_refuses_to_measure_until_it_is_reset() {
    for model in [URG_04LX, URG_04LX_UG01, UHG_08LX, UTM_30LX] {
        let mut urg = Client::new(Config { start: Start::Abnormal, ..fast(model) });
        assert_eq!([urg.status("BM"), urg.status("MD0044072501000"), urg.status("RB")], ["01", "50", "0E"]);
        assert_eq!([urg.status("PP"), urg.status("QT"), urg.status("TM0"), urg.status("TM2")], ["00"; 4]);
        assert!(urg.ask("II").contains("STAT:Trouble!! Error No. =[00->33];"));
        assert_eq!(urg.urg.state(), State::Abnormal);
        assert_eq!([urg.status("RS"), urg.status("MD0044072501001")], ["00", "00"], "{}", model.name);
    }
    let faults = vec!["abnormal:0.25".parse().unwrap()];
    let mut urg = Client::new(Config { start: Start::Streaming, faults, ..fast(URG_04LX) });
    assert!(urg.hear("", 1_000_000).ends_with("\n\nMD0044072501000\n50U\n\n"));
}

#[test]
fn scip11_is_a_state_of_the_sensors_that_speak_it() {
    assert_eq!(Start::Scip11.of(&URG_04LX), Ok(Start::Scip11));
    for model in [URG_04LX_UG01, UHG_08LX, UTM_30LX, UST_10LX] {
        assert_eq!(Start::Scip11.of(&model), Err(StartError::NoScip11(model.name)));
        assert_eq!(Start::Booting.of(&model), Ok(Start::Booting));
    }
}

#[test]
fn every_model_states_its_bit_rate_as_recorded() {
    let texts = MODELS.map(|model| {
        let information = Client::new(fast(model)).ask("II");
        let (_, rate) = information.split_once("\nSBPS:").expect("a bit rate");
        rate.split_once(';').expect("a checksum").0.to_owned()
    });
    let of_line = "19200[bps]<-Default setting by user";
    assert_eq!(texts, [of_line, of_line, "USB only", "USB Full Speed", "Ethernet 100[Mbps]"]);
}

#[test]
fn a_sensor_that_denies_quitting_leaves_time_sync_by_its_own_command_only() {
    let model = Model { quit_in_time_sync: QuitInTimeSync::Refused, ..UST_10LX };
    let mut ust = Client::new(Config { start: Start::TimeSync, ..fast(model) });
    assert_eq!([ust.status("QT"), ust.status("QT")], ["10", "10"]);
    assert_eq!([ust.status("TM2"), ust.status("QT")], ["00", "00"]);
}

#[test]
fn a_sensor_that_answers_while_booting_accepts_a_measurement_and_sends_nothing() {
    let model = Model { while_booting: WhileBooting::Accepts, ..UTM_30LX };
    let mut utm = Client::new(Config { start: Start::Booting, ..fast(model) });
    assert_eq!(utm.hear("QT\nTM0\n", 50_000), "QT\n00P\n\nTM0\n10Q\n\n");
    assert_eq!(utm.hear("MD0000108001000\n", 1_000_000), "MD0000108001000\n00P\n\n");
    assert_eq!(utm.hear("QT\n", 50_000), "QT\n00P\n\n");
    assert_eq!(utm.hear("TM0\nTM2\n", 50_000).matches("\n00P\n").count(), 1, "the second comes too early");
    utm.hear("TM2\n", 2_000_000);
    assert_eq!(utm.ask("MD0000108001000").matches("\n99b\n").count(), 39);
}
