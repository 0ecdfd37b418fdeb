//! Each alarm: raised, cleared, and not raised by what is normal.

mod module;

use super::doubt::tests::{standing, unseen};
use super::*;
use crate::alarm::AlarmKind;
use crate::explain::alarm::{Measured, Unit};
use kehai::background::Suspect;
use kehai::unseen::UnseenReason;
use kehai::wire::{Alarms, Counter, Counters, Event, LearningProgress, List, Message};
use module::Module;

#[test]
fn the_line_of_a_module_that_is_well_has_true_figures() {
    let mut module = Module::well();
    module.counters.set(Counter::SensorChecksum, 1);
    module.unseen = vec![unseen(100, 68, UnseenReason::NoReturn)];
    let learned = EventKind::Learned;
    module.events =
        vec![Event { number: 1, at_us: 20_000_000, kind: learned, background_version: 1, by: [0; 4] }];
    module.alarms_after(10);
    let line = module.line();
    assert_eq!((line.name.as_str(), line.state), ("hall", DeviceState::Watching));
    assert_eq!(line.id, "02:00:00:00:00:07");
    assert_eq!((line.scans_hz, line.lost_share, line.checksum_errors), (10.0, Some(0.0), 1));
    assert_eq!(line.unknown_share, rounded(68.0 / 682.0, 1e4));
    assert!(line.clock_offset_ms.unwrap().abs() < 1.0 && line.clock_jitter_ms.unwrap() < 0.5, "{line:?}");
    assert_eq!((line.background_age_s, line.silent_s), (Some(80.0), Some(0.0)));
    assert_eq!(module.session.name(), "hall");
    let unheard = Monitor::new(1_000_000).line("hall", ModuleId::ANY, None, 2_000_000);
    assert_eq!((unheard.lost_share, unheard.clock_jitter_ms), (None, None), "never measured, not 0");
}

#[test]
fn what_a_module_does_is_told_for_a_minute_in_each_of_its_lives_and_nothing_from_before() {
    let mut module = Module::well();
    let event = |number, at_us, kind| Event { number, at_us, kind, background_version: 2, by: [0; 4] };
    let asked = Event { by: [10, 0, 0, 7], ..event(3, 91_000_000, EventKind::Absorbed) };
    let told = |module: &mut Module| -> Vec<(u32, String, String)> {
        module
            .line()
            .events
            .into_iter()
            .map(|event| (event.number, event.kind.name().to_owned(), event.text))
            .collect()
    };
    module.tenth();
    module.session.monitor_from(module.now_us);
    module.events =
        vec![event(1, 20_000_000, EventKind::LearnStarted), event(2, 90_500_000, EventKind::Learned)];
    module.alarms_after(3);
    let learned = (2, "learned".to_owned(), "a new background was learned".to_owned());
    assert_eq!(told(&mut module), std::slice::from_ref(&learned));
    module.events.push(asked);
    module.alarms_after(3);
    let absorbed = (3, "absorbed".to_owned(), "a place became background, as 10.0.0.7 asked".to_owned());
    assert_eq!(told(&mut module), [learned, absorbed]);
    let ago_s = module.line().events[1].ago_s;
    assert!((4.0..6.0).contains(&ago_s), "{ago_s}");
    (module.boot, module.tenths, module.sequence) = (2, 0, 0);
    module.events = vec![event(1, 200_000, EventKind::LearnStarted)];
    module.alarms_after(3);
    assert_eq!(told(&mut module)[2].1, "learn-started");
    module.alarms_after(70);
    assert_eq!(told(&mut module), []);
    // Reset to factory settings it counts its starts from 1; it is believed once the start before has been silent for 3 s.
    module.now_us += 4_000_000;
    (module.boot, module.tenths, module.sequence) = (1, 0, 0);
    module.events = vec![event(1, 200_000, EventKind::FactoryReset)];
    module.alarms_after(3);
    assert_eq!(told(&mut module).len(), 1, "once");
}

#[test]
fn silent_is_who_says_nothing_for_three_seconds_and_nothing_else_is_said_of_it() {
    let mut module = Module::well();
    module.health.sensor.code = SensorCode::Abnormal;
    module.alarms_after(5);
    module.only("sensor");
    module.now_us += 2_900_000;
    module.only("sensor");
    module.now_us += 200_000;
    assert!(module.only("silent").contains("check its power"));
    assert_eq!(module.line().state, DeviceState::Missing);
    module.tenths += 31;
    module.health.sensor.code = SensorCode::Streaming;
    module.is_well_after(1);
}

#[test]
fn who_has_never_answered_is_said_to_be_missing_after_a_while() {
    let mut monitor = Monitor::new(1_000_000);
    assert_eq!(monitor.line("hall", ModuleId::ANY, None, 5_000_000).alarms, []);
    let line = monitor.line("hall", ModuleId::ANY, None, 6_000_000);
    assert!(line.alarms[0].text.contains("has not been found"), "{line:?}");
    assert_eq!((line.state, line.silent_s, line.id.as_str()), (DeviceState::Missing, None, ""));
}

#[test]
fn a_sensor_that_says_it_is_faulty_is_told_at_once_and_one_that_starts_is_given_time() {
    let mut module = Module::well();
    module.health.sensor.code = SensorCode::Abnormal;
    module.alarms_after(4);
    assert!(module.only("sensor").starts_with("the sensor reports a fault of its own: clean its window"));
    module.health.sensor.code = SensorCode::Streaming;
    module.is_well_after(1);
    module.health.sensor.code = SensorCode::Booting;
    assert_eq!(module.alarms_after(19), [""; 0]);
    module.health.sensor.code = SensorCode::Streaming;
    module.is_well_after(1);
    module.health.sensor.code = SensorCode::Searching;
    module.made = 0;
    module.alarms_after(22);
    assert!(module.only("sensor").contains("no sensor answers: check the sensor's power"));
    assert_eq!(module.line().state, DeviceState::Searching);
    (module.health.sensor.code, module.made) = (SensorCode::Streaming, 100);
    module.is_well_after(15);
}

#[test]
fn a_disturbed_line_is_told_and_a_single_damaged_scan_is_not() {
    let mut module = Module::well();
    module.counters.set(Counter::ScansDamaged, 5);
    assert_eq!(module.alarms_after(120), [""; 0]);
    // What the sensor says of itself has checksums, too, and is no scan.
    for second in 1..=60 {
        module.counters.set(Counter::SensorChecksum, 5 + second / 2);
        assert_eq!(module.alarms_after(1), [""; 0]);
    }
    // A scan that has lost bytes is damaged, whatever its lines' checksums say.
    for second in 1..=60 {
        module.counters.set(Counter::ScansDamaged, 5 + second / 2);
        module.alarms_after(1);
    }
    assert!(module.only("line").contains("% of the sensor's scans arrive damaged"));
    module.is_well_after(60);
}

#[test]
fn a_module_that_is_covered_or_moved_is_told_and_a_crowd_is_not() {
    let mut module = Module::well();
    // Ten people sway: each beam is at its background now and then.
    for second in 0..600u16 {
        let shift = 30 * (second % 5);
        module.candidates =
            (0..10).map(|i| standing(50 + 66 * i + shift % 60, 75 + 66 * i + shift % 60)).collect();
        assert_eq!(module.alarms_after(1), [""; 0]);
    }
    // One person stands very near for an hour: 57°.
    module.candidates = vec![standing(300, 461)];
    assert_eq!(module.alarms_after(3600), [""; 0]);
    module.candidates = vec![standing(200, 455)];
    assert_eq!(module.alarms_after(55), [""; 0]);
    module.alarms_after(10);
    let text = module.only("covered");
    assert!(text.starts_with("over 90°, between -65° and 25° from ahead,"), "{text}");
    assert!(text.ends_with("kehai-tracker module learn hall"), "{text}");
    module.candidates.clear();
    module.is_well_after(16);
    // Head down, its left is on its right.
    module.upside_down = true;
    module.candidates = vec![standing(200, 455)];
    module.alarms_after(70);
    let text = module.only("covered");
    assert!(text.starts_with("over 90°, between -25° and 65° from ahead,"), "{text}");
    module.candidates.clear();
    module.is_well_after(16);
    // A cloth over it returns nothing at all.
    module.unseen = vec![unseen(44, 682, UnseenReason::NoReturn)];
    module.alarms_after(70);
    module.only("covered");
}

#[test]
fn a_new_background_ends_the_alarm() {
    let mut module = Module::well();
    module.candidates = vec![standing(200, 455)];
    module.alarms_after(70);
    module.only("covered");
    (module.health.background_version, module.health.learning) = (0, Some(LearningProgress::default()));
    module.is_well_after(1);
    assert_eq!(module.line().unknown_share, 1.0);
    assert_eq!(module.line().background_age_s, None);
}

#[test]
fn too_few_scans_are_told_with_whether_the_sensor_or_the_network_loses_them() {
    let mut module = Module::well();
    module.lost = 10;
    assert_eq!(module.alarms_after(120), [""; 0], "one in ten is lost on Wi-Fi");
    module.lost = 50;
    let mut texts = Vec::new();
    for _ in 0..30 {
        module.alarms_after(1);
        texts.extend(module.line().alarms);
    }
    assert!(texts.iter().all(|alarm| alarm.kind == AlarmKind::Slow), "{texts:?}");
    assert!(texts[0].text.contains("get lost on the network"), "{texts:?}");
    module.lost = 0;
    module.is_well_after(20);
    module.made = 50;
    module.alarms_after(100);
    // Half a minute of scans in every hundred tenths; the alarm needs ten seconds of too few.
    module.made = 0;
    module.alarms_after(25);
    assert!(module.only("slow").contains("the sensor or its line is too slow"));
    module.made = 100;
    module.is_well_after(20);
}

#[test]
fn storing_stops_the_stream_and_is_no_alarm() {
    let mut module = Module::well();
    (module.health.storing, module.made) = (true, 0);
    assert_eq!(module.alarms_after(30), [""; 0]);
    assert_eq!(module.line().state, DeviceState::Storing);
}

#[test]
fn a_clock_that_is_off_is_told_and_a_network_s_usual_jitter_is_not() {
    let mut module = Module::well();
    module.jitter_us = 5_000;
    assert_eq!(module.alarms_after(130), [""; 0]);
    let mut module = Module::well();
    module.jitter_us = 150_000;
    module.alarms_after(130);
    assert!(module.only("clock-off").contains("delays unevenly"));
    module.jitter_us = 200;
    module.is_well_after(150);
    module.late_us = 500_000;
    module.alarms_after(15);
    assert!(module.only("clock-off").contains("500 ms late and are not used"));
    module.late_us = 0;
    module.is_well_after(15);
    module.late_us = -200_000;
    module.alarms_after(15);
    assert!(module.only("clock-off").contains("200 ms before they were made"));
    module.late_us = 0;
    module.is_well_after(15);
    module.health.alarms = Alarms::CLOCK_UNCERTAIN;
    module.alarms_after(15);
    assert!(module.only("clock-off").contains("cannot be followed to 20 ms"));
}

#[test]
fn a_dirty_window_is_told_and_a_few_drop_outs_are_not() {
    let mut module = Module::well();
    module.unseen = (0..14).map(|i| unseen(50 + 40 * i, 6, UnseenReason::NoReturn)).collect();
    assert_eq!(module.alarms_after(200), [""; 0], "one beam in eight");
    module.unseen = (0..14).map(|i| unseen(50 + 40 * i, 10, UnseenReason::NoReturn)).collect();
    module.alarms_after(300);
    assert!(module.only("dirty").contains("clean its window"));
    module.unseen.clear();
    module.is_well_after(60);
}

#[test]
fn what_the_module_says_of_store_background_and_watchdog_is_told() {
    let mut module = Module::well();
    module.health.alarms = Alarms::STORE_FAILED;
    module.alarms_after(2);
    module.only("store");
    module.health.alarms = Alarms::WATCHDOG;
    module.alarms_after(2);
    module.only("watchdog");
    module.health.alarms = Alarms::SUSPECTS;
    module.alarms_after(2);
    module.only("suspect");
    module.health.alarms = Alarms::LEARNING_WAITS;
    module.health.learning =
        Some(LearningProgress { moved: Some((100, 130)), ..LearningProgress::default() });
    assert_eq!(module.alarms_after(55), [""; 0], "people may leave first");
    module.alarms_after(10);
    assert!(module.only("background").contains("something moves at steps 100 to 130"));
    (module.health.alarms, module.health.learning) = (Alarms::default(), None);
    module.is_well_after(2);
}

#[test]
fn a_shape_that_is_furniture_is_no_suspect() {
    let mut module = Module::well();
    module.health.alarms = Alarms::SUSPECTS;
    let suspect = |first_step| Suspect { first_step, last_step: first_step + 20, near_mm: 2000 };
    module.suspects = vec![suspect(374), suspect(500)];
    module.alarms_after(2);
    assert!(module.only("suspect").contains("2 things"));
    let places = module.line().suspects;
    assert_eq!(places.len(), 2);
    module.furniture = vec![places[0]];
    module.alarms_after(2);
    assert!(module.only("suspect").contains("something"), "one of them is furniture");
    assert_eq!(module.line().suspects, [places[1]]);
    module.furniture = places;
    module.is_well_after(2);
    module.suspects.push(suspect(200));
    module.alarms_after(2);
    assert_eq!(module.line().suspects.len(), 1, "a third one is not");
    module.only("suspect");
}

#[test]
fn a_restart_begins_anew_without_an_alarm() {
    let mut module = Module::well();
    module.counters.set(Counter::SensorChecksum, 100_000);
    (module.boot, module.tenths, module.sequence) = (2, 0, 0);
    module.clock = ModuleClock::default();
    module.counters = Counters::new();
    assert_eq!(module.alarms_after(90), [""; 0]);
    assert_eq!(module.line().scans_hz, 10.0);
    // What is still on the way from its last life changes nothing.
    (module.boot, module.health.alarms) = (1, Alarms::STORE_FAILED);
    let health = Health {
        head: module.health,
        counters: Counters::new(),
        suspects: List::default(),
        events: List::default(),
    };
    let now_us = module.now_us;
    module.send(&Message::Health(health), now_us);
    assert_eq!(module.alarms(), [""; 0]);
}

#[test]
fn why_an_alarm_rings_or_not_is_said_by_what_it_is_decided_on() {
    let mut module = Module::well();
    let condition = |module: &mut Module, kind| {
        module.line();
        let (clock, now_us) = (module.clock.clone(), module.now_us);
        module.monitor().condition(kind, Some(&clock), now_us)
    };
    let slow = condition(&mut module, AlarmKind::Slow).unwrap();
    let Measured { value, limit, unit } = slow.measured.unwrap();
    assert_eq!((slow.is_on, slow.holds, unit), (false, false, Unit::ScansHz));
    assert!((value - 10.0).abs() < 0.2 && (limit - 8.0).abs() < 0.01, "{slow:?}");
    // Four scans in ten are not made: within ten seconds the rate is too low, and the alarm rings ten later.
    module.made = 60;
    module.tenths = 60;
    let mut before = None;
    while !condition(&mut module, AlarmKind::Slow).unwrap().is_on {
        let slow = condition(&mut module, AlarmKind::Slow).unwrap();
        before = if slow.holds { Some(slow) } else { before };
        module.tenth();
        assert!(module.tenths < 1000, "{before:?}");
    }
    let before = before.unwrap();
    assert!(before.for_s > 0.0 && before.for_s <= before.raise_s && !before.is_on, "{before:?}");
    assert_eq!(before.raise_s, 10.0);
    assert!(module.alarms().contains(&"slow".to_owned()));
    // A module that says nothing has no other alarm, and the reason for that one is how long.
    module.now_us += 4_000_000;
    let silent = condition(&mut module, AlarmKind::Silent).unwrap();
    assert!(silent.is_on && silent.measured.unwrap().value > 3.0, "{silent:?}");
    assert_eq!(condition(&mut module, AlarmKind::Slow), None);
    assert_eq!(condition(&mut module, AlarmKind::Moved), None, "the watch of poses raises it");
}

#[test]
fn f1_one_stamp_from_the_future_silences_no_alarm() {
    let mut module = Module::well();
    module.sequence += 1;
    let mut report = doubt::tests::report(0.0, &[], &[]);
    (report.head.sequence, report.head.stamp_us) = (module.sequence, u64::MAX);
    module.send(&Message::Report(report), module.now_us);
    module.candidates = vec![standing(200, 455)];
    assert_eq!(module.alarms_after(65), ["covered"]);
}

#[test]
fn a_device_that_is_not_subscribed_to_any_more_has_no_alarm_about_what_it_does_not_send() {
    let mut module = Module::well();
    let alarms = |module: &mut Module| -> Vec<String> {
        let line = module.session.line("hall", &[], module.now_us).unwrap();
        line.alarms.into_iter().map(|alarm| alarm.kind.name().to_owned()).collect()
    };
    // Taken out of the site it goes on answering, and sends no scans.
    (module.made, module.candidates) = (0, vec![standing(200, 455)]);
    module.session.want_reports(false);
    for _ in 0..600 {
        module.tenth();
        assert_eq!(alarms(&mut module), [""; 0]);
        assert!(module.session.condition(AlarmKind::Slow, module.now_us).is_none());
    }
    // Back in it, its rate is that from then on.
    module.made = 100;
    module.session.want_reports(true);
    module.candidates.clear();
    for _ in 0..300 {
        module.tenth();
        assert_eq!(alarms(&mut module), [""; 0]);
    }
    module.made = 10;
    let slow = (0..300).any(|_| {
        module.tenth();
        alarms(&mut module) == ["slow"]
    });
    assert!(slow, "and it is judged again");
}
