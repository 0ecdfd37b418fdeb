//! How hosts get a module's reports, and keep them.

use crate::on_host::{MODULE, SECOND_US, World};
use kehai::sensor::LineSettings;
use kehai::wire::{Alarms, Cookie, Counter, Message, Refusal, Request, SensorCode};
use kehai_emulator::urg::model::{Interface, Model, URG_04LX, UST_10LX, UTM_30LX};
use kehai_emulator::urg::{Config, Start};

#[test]
fn a_host_gets_a_cookie_then_a_place_then_a_report_for_every_scan_of_an_empty_room() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        let subscribed = host.subscribe().await.unwrap();
        assert!(subscribed.may_control);
        assert_eq!((subscribed.subscribers, subscribed.lease_ms), (1, 5000));
        host.stay(20.0).await;
        let begin = host.mark();
        host.stay(10.0).await;
        let sequences = host.sequences(begin);
        assert!(sequences.len() >= 99, "{} reports in 10 s", sequences.len());
        assert!(sequences.windows(2).all(|pair| pair[1] == pair[0] + 1), "{sequences:?}");
        let found = host.all(begin, |_, message| match message {
            Message::Report(report) => Some((report.candidates.len(), report.head.background_version)),
            _ => None,
        });
        assert!(found.iter().all(|found| *found == (0, 1)), "an empty room: {found:?}");
        let health = host.all(begin, |_, message| match message {
            Message::Health(health) => Some(health.head),
            _ => None,
        });
        assert!((9..=11).contains(&health.len()), "{} health messages in 10 s", health.len());
        assert!(
            health
                .iter()
                .all(|head| head.sensor.code == SensorCode::Streaming && head.alarms == Alarms::default())
        );
    });
    assert!(world.fed.count() > 50);
}

// The stream is stopped to store the background 1.5 s after it began: what was learned of the sensor's clock before
// still counts after.
#[test]
fn the_time_of_a_fast_sensor_is_as_good_after_its_background_was_stored_as_before() {
    for model in [UTM_30LX, UST_10LX] {
        let world = World::new(Config::new(model));
        world.run(async || {
            let host = world.host(1);
            host.subscribe().await.unwrap();
            host.learned().await;
            host.stay(20.0).await;
            let begin = host.mark();
            host.stay(2.0).await;
            let uncertainty_us = host.all(begin, |_, message| match message {
                Message::Report(report) => Some(report.head.uncertainty_us),
                _ => None,
            });
            let worst_us = uncertainty_us.iter().max().copied().unwrap();
            println!("{}: ±{worst_us} µs 20 s after the background was stored", model.name);
            assert!(uncertainty_us.len() > 70 && worst_us < 2_500);
        });
    }
}

// A scan of 3372 bytes takes 1.756 s at 19 200 baud, so one of 71 turns of 25 ms is sent.
#[test]
fn scans_that_come_slowly_are_no_alarm_until_ten_intervals_pass_without() {
    const INTERVAL_US: u64 = 71 * 25_000;
    let slowest = Model { interface: Interface::Rs232, ..UTM_30LX };
    let line = LineSettings::Serial { last_baud: None, wanted_baud: None, fastest_baud: 19_200 };
    let world = World { line, ..World::new(Config::new(slowest)) };
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let is_report = |message: &Message<'_>| matches!(message, Message::Report(_));
        host.expect(host.mark(), "report", |_, message| is_report(message).then_some(())).await;
        let begin = host.mark();
        host.stay(60.0).await;
        world.link.unplug();
        host.stay(30.0).await;
        let scans_us = host.all(begin, |at_us, message| is_report(message).then_some(at_us));
        let gaps_us: Vec<u64> = scans_us.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_slow = |gap_us: &u64| gap_us.abs_diff(INTERVAL_US) < 100_000;
        assert!(gaps_us.len() > 20 && gaps_us.iter().all(is_slow), "{gaps_us:?}");
        let alarms_us = host.all(begin, |at_us, message| match message {
            Message::Health(health) => health.head.alarms.has(Alarms::NO_SCANS).then_some(at_us),
            _ => None,
        });
        let silent_us = alarms_us.first().unwrap() - scans_us.last().unwrap();
        assert!(silent_us.abs_diff(10 * INTERVAL_US) < 100_000, "alarm {silent_us} µs after the last scan");
    });
}

#[test]
fn the_answer_to_a_stranger_is_no_longer_than_his_request() {
    let world = World::urg();
    world.run(async || {
        let stranger = world.host(1);
        stranger.boot.set(1);
        let requests = [
            Request::Subscribe { t1: [0; 8] },
            Request::Info,
            Request::GetSettings,
            Request::SetSettings { text: "" },
            Request::Learn { scans: 0 },
            Request::Profile { version: 0, parts: 0 },
            Request::Raw { seconds: 9 },
            Request::RawAgain { object: 1, parts: 0 },
            Request::Restart,
            Request::Identify { seconds: 10 },
        ];
        for request in requests {
            let mut datagram = [0; 1400];
            let length = request.encode(stranger.identity(), 1, Cookie::NONE, &mut datagram).unwrap();
            stranger.socket.send(&datagram[..length]);
            let (_, answer) = stranger.socket.receive(world.now_us() + SECOND_US).await.expect("an answer");
            assert!(answer.len() <= length, "{request:?}: {} after {length}", answer.len());
            assert_eq!(stranger.socket.take(), None, "one answer only");
        }
        world.wait(10.0).await;
        assert_eq!(stranger.socket.take(), None, "no reports for a stranger");
    });
}

#[test]
fn the_fifth_is_refused_and_those_who_renew_are_never_put_out() {
    let world = World::urg();
    world.run(async || {
        let hosts: Vec<_> = (1..=5).map(|last| world.host(last)).collect();
        for host in &hosts[..4] {
            host.subscribe().await.unwrap();
        }
        for _ in 0..10 {
            assert_eq!(hosts[4].subscribe().await, Err(Refusal::Full));
            for host in &hosts[..4] {
                host.stay(0.3).await;
            }
        }
        let begin = hosts[3].mark();
        hosts[3].be_silent(6.0).await;
        let last_us = hosts[3].all(begin, |at_us, _| Some(at_us)).pop().unwrap();
        assert!(last_us <= world.now_us() - SECOND_US / 2, "forgotten after 5 s");
    });
}

#[test]
fn the_sequence_runs_without_subscribers() {
    let world = World::urg();
    world.run(async || {
        world.wait(20.0).await;
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.stay(1.0).await;
        let first = host.sequences(host.start())[0];
        assert!((150..200).contains(&first), "{first}");
    });
}

#[test]
fn parts_of_the_profile_come_one_a_report_and_again_when_asked_for() {
    let world = World::new(Config::new(UST_10LX));
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        assert_eq!(host.order(Request::Profile { version: 0, parts: 0 }).await, Err(Refusal::NoBackground));
        let version = host.learned().await;
        let parts = async |wanted: u32| {
            let begin = host.mark();
            host.ask(Request::Profile { version, parts: wanted });
            host.stay(1.0).await;
            let mut reports = 0;
            host.all(begin, |_, message| match message {
                Message::Report(_) => {
                    reports += 1;
                    None
                }
                Message::ProfilePart(part) => {
                    assert!(std::mem::take(&mut reports) >= 1, "one part a report");
                    assert_eq!((part.head.object, part.head.parts), (u32::from(version), 5));
                    Some((part.head.part, part.head.first_step, part.beams.len()))
                }
                _ => None,
            })
        };
        assert_eq!(parts(0).await, [(0, 0, 220), (1, 220, 220), (2, 440, 220), (3, 660, 220), (4, 880, 201)]);
        assert_eq!(parts(0b1_0010).await, [(1, 220, 220), (4, 880, 201)]);
        assert_eq!(
            host.order(Request::Profile { version: version + 1, parts: 0 }).await,
            Err(Refusal::Superseded)
        );
    });
}

#[test]
fn raw_scans_come_to_who_asked_for_as_long_as_he_asked() {
    let world = World::new(Config::new(UST_10LX));
    world.run(async || {
        let (host, other) = (world.host(1), world.host(2));
        host.subscribe().await.unwrap();
        other.subscribe().await.unwrap();
        host.learned().await;
        other.subscribe().await.unwrap();
        let (begin, others) = (host.mark(), other.mark());
        host.order(Request::Raw { seconds: 2 }).await.unwrap();
        host.stay(3.0).await;
        let raw = host.all(begin, |_, message| match message {
            Message::RawPart(part) => Some((part.head.object, part.head.part, part.ranges_mm.len())),
            _ => None,
        });
        assert!((155..=165).contains(&raw.len()), "{} parts in 2 s at 40 Hz", raw.len());
        assert!(raw.chunks(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].2 + pair[1].2 == 1081));
        other.stay(0.1).await;
        assert!(!other.kinds(others).contains(&0x93), "to the requester only");
        let (object, ..) = *raw.last().unwrap();
        let begin = host.mark();
        host.ask(Request::RawAgain { object, parts: 0b10 });
        host.stay(0.1).await;
        let again = host.all(begin, |_, message| match message {
            Message::RawPart(part) => Some((part.head.object, part.head.part)),
            _ => None,
        });
        assert_eq!(again, [(object, 1)]);
        assert_eq!(
            host.order(Request::RawAgain { object: object - 1, parts: 0 }).await,
            Err(Refusal::Superseded)
        );
    });
}

#[test]
fn malformed_and_foreign_datagrams_are_counted_and_cost_no_report() {
    let world = World::urg();
    world.run(async || {
        let (host, stranger) = (world.host(1), world.host(2));
        host.subscribe().await.unwrap();
        host.learned().await;
        let begin = host.mark();
        let mut ours = [0; 1402];
        let length =
            Request::Learn { scans: 50 }.encode(host.identity(), 1, Cookie::NONE, &mut ours).unwrap();
        let mut theirs = ours;
        theirs[14] = 0x90;
        for turn in 0..200 {
            for datagram in [&b"GET / HTTP/1.1"[..], &[], &ours[..length - 5], &ours[..1402], &theirs[..60]] {
                stranger.socket.send(datagram);
            }
            let mut broken = ours;
            broken[turn % 60] ^= 1 << (turn % 8);
            stranger.socket.send(&broken[..length]);
            host.stay(0.05).await;
        }
        let sequences = host.sequences(begin);
        assert!(sequences.len() >= 99, "{}", sequences.len());
        assert!(sequences.windows(2).all(|pair| pair[1] == pair[0] + 1));
        host.stay(1.1).await;
        let counters = host
            .expect(host.mark(), "health", |_, message| match message {
                Message::Health(health) => Some(health.counters),
                _ => None,
            })
            .await;
        assert!(counters.get(Counter::DatagramsForeign) >= 200);
        assert!(counters.get(Counter::DatagramsTooShort) >= 400);
        assert_eq!(counters.get(Counter::DatagramsTooLong), 200);
        assert!(counters.get(Counter::DatagramsWrongDirection) >= 200);
        assert!(counters.get(Counter::RefusedBadCookie) >= 1);
    });
}

#[test]
fn a_host_that_answers_no_arp_delays_no_other_and_its_lane_is_opened_anew() {
    let world = World::urg();
    world.run(async || {
        let (host, lost) = (world.host(1), world.host(2));
        host.subscribe().await.unwrap();
        host.learned().await;
        lost.subscribe().await.unwrap();
        world.network.set_reachable(lost.socket.address(), false);
        let begin = host.mark();
        // It goes on renewing, as a host behind a cable that is cut one way.
        for _ in 0..10 {
            lost.ask(Request::Subscribe { t1: [0; 8] });
            host.stay(1.0).await;
        }
        let sequences = host.sequences(begin);
        assert!(sequences.len() >= 99);
        assert!(sequences.windows(2).all(|pair| pair[1] == pair[0] + 1));
        assert!(host.counter(Counter::ReportsDropped).await > 50);
        assert!(host.counter(Counter::SocketsReopened).await >= 3);
        assert!(host.counter(Counter::AnswersDropped).await >= 1);
        assert!(world.network.reopened() >= 3);
    });
}

#[test]
fn info_says_who_it_is_and_what_it_measures() {
    let world = World::new(Config { start: Start::Streaming, baud: 115_200, ..Config::new(URG_04LX) });
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let info = async || {
            let begin = host.mark();
            let id = host.ask(Request::Info);
            host.expect(begin, "info", |_, message| match message {
                Message::Info(info) if info.request_id == id => {
                    let sensor = info
                        .sensor
                        .map(|sensor| (sensor.model.to_owned(), sensor.geometry().unwrap().beams()));
                    Some((info.name.to_owned(), info.board.to_owned(), info.setup, sensor))
                }
                _ => None,
            })
            .await
        };
        let (name, board, setup, sensor) = info().await;
        assert_eq!((name.as_str(), board.as_str(), setup, sensor), ("kehai-000001", "simulated", 0, None));
        host.learned().await;
        let (_, _, setup, sensor) = info().await;
        assert_eq!(setup, 1);
        let (model, beams) = sensor.unwrap();
        assert!(model.starts_with("URG-04LX"), "{model}");
        assert_eq!(beams, 682);
        host.order(Request::SetSettings { text: "cluster=2" }).await.unwrap();
        host.stay(5.0).await;
        let (_, _, setup, sensor) = info().await;
        assert_eq!((setup, sensor.unwrap().1), (2, 341));
        assert_eq!(host.counter(Counter::DatagramsForeign).await, 0);
        assert_eq!(MODULE, host.identity().module);
    });
}
