//! Requests of hosts to a module, and their effects.

use crate::on_host::{SECOND_US, World};
use kehai::background::Absorb;
use kehai::device::led::LedState;
use kehai::wire::{
    Alarms, Cookie, Counter, EventKind, IDENTIFY_MAX_S, Identity, Message, ModuleId, Refusal, Request,
    SensorCode,
};

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
fn any_host_controls_until_some_are_listed_and_then_only_those() {
    let world = World::urg();
    world.run(async || {
        let (first, second) = (world.host(1), world.host(2));
        assert!(first.subscribe().await.unwrap().may_control);
        assert!(second.subscribe().await.unwrap().may_control, "who came first does not matter");
        first.learned().await;
        first.stay(20.0).await;
        assert_eq!(second.order(Request::Learn { scans: 0 }).await, Ok(()));
        assert_eq!(first.order(Request::Raw { seconds: 1000 }).await, Ok(()));
        second.order(Request::SetSettings { text: "hosts=10.0.0.2" }).await.unwrap();
        assert!(!first.subscribe().await.unwrap().may_control);
        let begin = first.mark();
        let orders = [
            Request::SetSettings { text: "skip=1" },
            Request::Learn { scans: 0 },
            Request::Restart,
            Request::Raw { seconds: 1 },
        ];
        for order in orders {
            assert_eq!(first.order(order).await, Err(Refusal::NotAllowed), "{order:?}");
        }
        let again = first.order(Request::RawAgain { object: 1, parts: 0 });
        assert_eq!(again.await, Err(Refusal::NotAllowed));
        first.stay(1.0).await;
        let raw = |_: u64, message: &Message<'_>| matches!(message, Message::RawPart(_)).then_some(());
        assert_eq!(first.all(begin, raw).len(), 0, "the raw scans it had are withdrawn");
        assert_eq!(second.order(Request::Raw { seconds: 1 }).await, Ok(()));
        assert!(second.settings().await.contains("hosts=10.0.0.2\n"));
    });
}

#[test]
fn it_blinks_for_any_host_that_may_read_for_a_minute_at_most_and_ends_when_told() {
    let world = World::urg();
    world.run(async || {
        let (first, second) = (world.host(1), world.host(2));
        first.subscribe().await.unwrap();
        first.learned().await;
        second.subscribe().await.unwrap();
        second.order(Request::SetSettings { text: "hosts=10.0.0.2" }).await.unwrap();
        first.stay(2.0).await;
        let shown = || LedState::of(&world.notices.status(), true, world.now_us());
        assert_eq!(shown(), LedState::Working);
        assert_eq!(first.order(Request::Identify { seconds: 5 }).await, Ok(()));
        first.stay(4.0).await;
        assert_eq!(shown(), LedState::Identify);
        first.stay(1.5).await;
        assert_eq!(shown(), LedState::Working, "after its time");
        assert_eq!(first.order(Request::Identify { seconds: u16::MAX }).await, Ok(()));
        first.stay(f64::from(IDENTIFY_MAX_S) - 1.0).await;
        assert_eq!(shown(), LedState::Identify);
        first.stay(1.5).await;
        assert_eq!(shown(), LedState::Working, "after the longest time");
        assert_eq!(first.order(Request::Identify { seconds: 60 }).await, Ok(()));
        assert_eq!(shown(), LedState::Identify);
        assert_eq!(first.order(Request::Identify { seconds: 0 }).await, Ok(()));
        assert_eq!(shown(), LedState::Working, "once it is told to end");
    });
}

#[test]
fn a_person_is_a_candidate_and_what_stands_still_is_absorbed_only_while_it_is_there() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        *world.person.lock().unwrap() = Some((360, 420, 900));
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
        *world.person.lock().unwrap() = None;
        host.stay(0.5).await;
        assert_eq!(host.order(Request::Absorb(wish)).await, Err(Refusal::Moved));
        *world.person.lock().unwrap() = Some((360, 420, 900));
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
