//! The module's tasks as a whole, on simulated time: what hosts see of them.

mod on_host;

use host_sim::urg::model::{URG_04LX, UST_10LX};
use host_sim::urg::{Config, Start};
use kehai::background::Absorb;
use kehai::wire::{
    Alarms, Cookie, Counter, EventKind, Identity, Message, ModuleId, Refusal, Request, SensorCode,
    SettingFault,
};
use on_host::{MODULE, SECOND_US, World};

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
fn the_sequence_runs_with_nobody_listening() {
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
fn a_wrong_start_a_wrong_module_and_a_stale_cookie_are_refused_by_name() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let refused = async |request: Request<'_>, to: Identity| {
            let begin = host.mark();
            host.ask_as(request, 77, to);
            host.answer(begin, 77).await
        };
        let own = host.identity();
        assert_eq!(
            refused(Request::Learn { scans: 0 }, Identity { boot: 9, ..own }).await,
            Err(Refusal::WrongBoot)
        );
        let other = Identity { module: ModuleId([9; 6]), ..own };
        assert_eq!(refused(Request::Learn { scans: 0 }, other).await, Err(Refusal::WrongModule));
        let cookie = host.cookie.get();
        host.cookie.set(Cookie([1; 8]));
        assert_eq!(refused(Request::Learn { scans: 0 }, own).await, Err(Refusal::BadCookie));
        assert_eq!(refused(Request::Info, own).await, Err(Refusal::BadCookie));
        host.cookie.set(cookie);
        host.order(Request::Restart).await.unwrap();
        world.wait(1.0).await;
        assert_eq!(refused(Request::Restart, own).await, Err(Refusal::WrongBoot));
        host.subscribe().await.unwrap();
        assert_eq!(host.boot.get(), own.boot + 1);
        assert_ne!(host.cookie.get(), cookie, "cookies belong to a start");
    });
    assert_eq!(world.starts.get(), 2);
}

#[test]
fn a_repeated_request_gets_the_stored_answer_and_is_done_once() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.stay(5.0).await;
        for _ in 0..3 {
            let begin = host.mark();
            host.ask_as(Request::Learn { scans: 40 }, 500, host.identity());
            assert_eq!(host.answer(begin, 500).await, Ok(()));
        }
        let begin = host.mark();
        host.ask_as(Request::Learn { scans: 10 }, 501, host.identity());
        assert_eq!(host.answer(begin, 501).await, Err(Refusal::TooFewScans));
        let begin = host.mark();
        host.ask_as(Request::Learn { scans: 40 }, 501, host.identity());
        assert_eq!(
            host.answer(begin, 501).await,
            Err(Refusal::TooFewScans),
            "the same number, the same answer"
        );
        let begin = host.mark();
        host.stay(1.1).await;
        let starts = host.all(begin, |_, message| match message {
            Message::Health(health) => {
                let asked = health.events.iter().filter(|event| event.by == [10, 0, 0, 1]);
                Some((asked.count(), health.counters.get(Counter::RequestsRepeated)))
            }
            _ => None,
        });
        assert_eq!(starts.last(), Some(&(1, 3)));
    });
}

#[test]
fn only_listed_hosts_control_and_by_default_the_first_subscriber() {
    let world = World::urg();
    world.run(async || {
        let (first, second) = (world.host(1), world.host(2));
        assert!(first.subscribe().await.unwrap().may_control);
        assert!(!second.subscribe().await.unwrap().may_control);
        assert_eq!(second.order(Request::SetSettings { text: "skip=1" }).await, Err(Refusal::NotAllowed));
        assert_eq!(second.order(Request::Learn { scans: 0 }).await, Err(Refusal::NotAllowed));
        assert_eq!(second.order(Request::Restart).await, Err(Refusal::NotAllowed));
        assert_eq!(second.order(Request::Raw { seconds: 1 }).await, Ok(()), "looking is free");
        first.order(Request::SetSettings { text: "hosts=10.0.0.2" }).await.unwrap();
        second.subscribe().await.unwrap();
        assert_eq!(first.order(Request::Learn { scans: 0 }).await, Err(Refusal::NotAllowed));
        second.stay(8.0).await;
        assert_eq!(second.order(Request::Learn { scans: 0 }).await, Ok(()));
        assert!(second.settings().await.contains("hosts=10.0.0.2\n"));
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
fn somebody_is_a_candidate_and_what_stands_still_is_absorbed_only_while_it_is_there() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        *world.somebody.lock().unwrap() = Some((360, 420, 900));
        host.stay(1.0).await;
        let (sequence, first_step, last_step) = host
            .expect(host.mark(), "candidate", |_, message| match message {
                Message::Report(report) => {
                    let candidate = report.candidates.iter().next()?;
                    Some((report.head.sequence, candidate.first_step, candidate.last_step))
                }
                _ => None,
            })
            .await;
        assert!((358..=362).contains(&first_step) && (418..=422).contains(&last_step));
        let wish = Absorb { sequence, first_step: 360, last_step: 420, nearest_mm: 800, farthest_mm: 1000 };
        *world.somebody.lock().unwrap() = None;
        host.stay(0.5).await;
        assert_eq!(host.order(Request::Absorb(wish)).await, Err(Refusal::Moved));
        *world.somebody.lock().unwrap() = Some((360, 420, 900));
        host.stay(0.5).await;
        let begin = host.mark();
        assert_eq!(host.order(Request::Absorb(wish)).await, Ok(()));
        host.stay(3.0).await;
        let last = host.all(begin, |_, message| match message {
            Message::Report(report) => Some((report.head.background_version, report.candidates.len())),
            _ => None,
        });
        assert_eq!(last.last(), Some(&(2, 0)), "absorbed");
        let events = host.all(begin, |_, message| match message {
            Message::Health(health) => Some(health.events.iter().map(|event| event.kind).collect::<Vec<_>>()),
            _ => None,
        });
        assert!(events.last().unwrap().ends_with(&[EventKind::Absorbed]), "{events:?}");
    });
}

#[test]
fn learning_over_the_wire_tells_how_far_it_is_and_gives_a_new_version() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let version = host.learned().await;
        let begin = host.mark();
        host.order(Request::Learn { scans: 50 }).await.unwrap();
        host.stay(9.0).await;
        let progress = host.all(begin, |_, message| match message {
            Message::Health(health) => health.head.learning.map(|learning| (learning.scans, learning.of)),
            _ => None,
        });
        assert!(progress.len() >= 5 && progress.iter().all(|(_, of)| *of == 50), "{progress:?}");
        assert!(progress.is_sorted());
        let versions = host.all(begin, |_, message| match message {
            Message::Report(report) => Some(report.head.background_version),
            _ => None,
        });
        assert_eq!((versions[0], *versions.last().unwrap()), (version, version + 1));
    });
}

#[test]
fn a_dead_sensor_is_told_within_ten_scan_periods() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        let begin = host.mark();
        let dead_us = world.now_us();
        world.link.unplug();
        let told_us = host
            .expect(begin, "health", |at_us, message| match message {
                Message::Health(health) if health.head.sensor.code != SensorCode::Streaming => Some(at_us),
                _ => None,
            })
            .await;
        assert!(told_us - dead_us <= SECOND_US, "told after {} µs", told_us - dead_us);
        host.expect(begin, "alarm", |_, message| match message {
            Message::Health(health) if health.head.alarms.has(Alarms::NO_SCANS) => Some(()),
            _ => None,
        })
        .await;
        host.stay(60.0).await;
        let fed = world.fed.count();
        host.stay(60.0).await;
        assert!(world.fed.count() > fed + 100, "waiting for a sensor is a life too");
        world.link.replug();
        let begin = host.mark();
        host.stay(10.0).await;
        assert!(!host.sequences(begin).is_empty(), "reports again");
    });
}

#[test]
fn malformed_and_foreign_datagrams_are_counted_and_cost_nobody_a_report() {
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
fn a_host_that_answers_no_arp_delays_nobody_and_its_lane_is_opened_anew() {
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
fn settings_are_validated_stored_with_the_stream_stopped_and_there_after_a_restart() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        let fault = |line, fault| Err(Refusal::Setting { line, fault });
        let set = async |text| host.order(Request::SetSettings { text }).await;
        assert_eq!(set("skip=1\nspeed=9").await, fault(1, SettingFault::Key));
        assert_eq!(set("body_radius_mm=19").await, fault(0, SettingFault::Range));
        assert_eq!(set("first_step=500\nlast_step=100").await, fault(1, SettingFault::Conflict));
        assert!(host.settings().await.contains("skip=0\n"), "nothing of it was taken");
        let begin = host.mark();
        let operations = world.flash.operations();
        assert_eq!(set("name=hall\nskip=1\nbody_radius_mm=210").await, Ok(()));
        assert!(world.flash.operations() > operations);
        host.stay(5.0).await;
        let told = host.all(begin, |_, message| match message {
            Message::Health(health) => {
                Some((health.head.storing, health.head.sensor.code, health.head.setup))
            }
            _ => None,
        });
        assert!(told[0].0, "storing is announced before anything else: {told:?}");
        assert!(
            told.iter().any(|(storing, sensor, _)| *storing && *sensor == SensorCode::Paused),
            "{told:?}"
        );
        let (storing, sensor, setup) = *told.last().unwrap();
        assert_eq!((storing, sensor, setup), (false, SensorCode::Streaming, 2));
        let begin = host.mark();
        host.stay(4.0).await;
        assert!((19..=21).contains(&host.sequences(begin).len()), "every second scan is skipped");
        host.order(Request::Restart).await.unwrap();
        host.be_silent(1.0).await;
        host.subscribe().await.unwrap();
        assert!(host.settings().await.starts_with("name=hall\nbody_radius_mm=210\n"));
        let begin = host.mark();
        host.stay(8.0).await;
        let versions = host.all(begin, |_, message| match message {
            Message::Report(report) => Some(report.head.background_version),
            _ => None,
        });
        assert!(
            versions.len() > 20 && versions.iter().all(|version| *version == 1),
            "the background is back"
        );
    });
}

#[test]
fn the_stream_is_stopped_while_flash_is_written() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let mut last = world.flash.operations();
        for _ in 0..2000 {
            world.wait(0.01).await;
            let operations = world.flash.operations();
            if operations != last {
                let state = world.link.with_sensor(|sensor, _| sensor.state());
                assert_ne!(state, host_sim::urg::State::Streaming, "{operations} operations");
            }
            last = operations;
        }
        host.stay(0.1).await;
        assert!(world.flash.operations() > 10, "the background was stored");
    });
}

#[test]
fn settings_survive_a_power_cut_at_any_write() {
    let mut outcomes = [0, 0];
    for cut in 0.. {
        let world = World::urg();
        let prepare = async || {
            let host = world.host(1);
            host.subscribe().await.unwrap();
            host.order(Request::SetSettings { text: "name=old" }).await.unwrap();
            world.flash.cut_after(cut);
            let begin = host.mark();
            let id = host.ask(Request::SetSettings { text: "name=new" });
            host.answer(begin, id).await
        };
        let answer = world.run(prepare);
        let off = world.flash.power_on();
        assert!(answer == Ok(()) || off && answer == Err(Refusal::NotStored), "{answer:?}, cut {cut}");
        // Another board with the same flash: power-up.
        let name = world.run(async || {
            let host = world.host(2);
            host.subscribe().await.unwrap();
            host.settings().await.lines().next().unwrap().to_owned()
        });
        let new = name == "name=new";
        assert!(new || answer.is_err() && name == "name=old", "{name} after cut {cut} and {answer:?}");
        outcomes[usize::from(new)] += 1;
        if !off {
            break;
        }
    }
    assert!(outcomes[0] >= 2 && outcomes[1] >= 1, "{outcomes:?}");
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
