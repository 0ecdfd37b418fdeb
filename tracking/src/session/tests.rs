//! What a session asks for, and what it remembers over a restart.

use super::*;
use kehai::wire::{
    Alarms, Cookie, Counters, DATAGRAM_MAX, HealthHead, List, Report, ReportHead, SensorCode, SensorHealth,
};

const DEVICE: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);

fn placement() -> Placement {
    Placement { site: Arc::default(), estimator: Estimator::default() }
}

/// What the session sends when these messages of one start of the device come at once.
fn sent(session: &mut Session, boot: u32, messages: &[Message<'_>]) -> usize {
    let mut sent = 0;
    let mut bytes = [0; DATAGRAM_MAX];
    for message in messages {
        let length = message.encode(Identity { module: DEVICE, boot }, &mut bytes).unwrap();
        let datagram = Datagram::decode(&bytes[..length]).unwrap();
        session.receive(&datagram, 1000, &placement(), &mut Drops::default());
        session.poll(1000, |_| sent += 1);
    }
    sent
}

fn info(setup: u16) -> Message<'static> {
    Message::Info(Info {
        request_id: 1,
        version_min: 1,
        version_max: 1,
        firmware: "",
        build: "",
        board: "",
        name: "hall",
        uptime_us: 0,
        setup,
        background_version: 0,
        sensor: None,
    })
}

const COOKIE: Message<'static> = Message::Cookie { request_id: 1, t1: [0; 8], cookie: Cookie([7; 8]) };

fn report(sequence: u32, setup: u16) -> Message<'static> {
    let head = ReportHead { sequence, setup, ..ReportHead::default() };
    Message::Report(Report {
        head,
        candidates: List::default(),
        unseen: List::default(),
        sizes: List::default(),
    })
}

#[test]
fn an_info_before_the_first_report_is_enough_and_asked_for_no_more() {
    let mut session = Session::new(DEVICE, Subscription::default());
    assert_eq!(sent(&mut session, 1, &[COOKIE]), 2, "subscribe with the cookie, info");
    assert_eq!(sent(&mut session, 1, &[info(1), info(1), info(1)]), 0);
    assert!(session.next_us() > 1000);
}

#[test]
fn a_report_of_another_setup_makes_the_session_ask_what_it_is() {
    let mut session = Session::new(DEVICE, Subscription::default());
    sent(&mut session, 1, &[COOKIE, info(1)]);
    assert_eq!(session.need(), Need::Nothing);
    sent(&mut session, 1, &[report(5, 2)]);
    assert_eq!(session.need(), Need::Info);
    sent(&mut session, 1, &[report(4, 1)]);
    assert_eq!(session.need(), Need::Info, "an overtaken report says nothing of the present");
}

#[test]
fn a_change_of_its_settings_makes_the_session_ask_again_who_it_is() {
    let mut session = Session::new(DEVICE, Subscription::default());
    sent(&mut session, 1, &[COOKIE, info(1), report(5, 1)]);
    assert_eq!(session.need(), Need::Nothing);
    let event = |number, kind| Event { number, at_us: 0, kind, background_version: 0, by: [0; 4] };
    let events = [event(1, EventKind::Learned), event(2, EventKind::SettingsChanged)];
    let health = |events| {
        let sensor = SensorHealth { code: SensorCode::Streaming, detail: (0, 0) };
        let (alarms, learning) = (Alarms::default(), None);
        let (uptime_us, sequence, setup, background_version) = (0, 0, 1, 0);
        let (storing, subscribers, counters) = (false, 1, Counters::new());
        let head = HealthHead {
            uptime_us,
            sequence,
            setup,
            background_version,
            sensor,
            alarms,
            storing,
            subscribers,
            learning,
        };
        Message::Health(Health { head, counters, suspects: List::default(), events: List::new(events) })
    };
    sent(&mut session, 1, &[health(&events[..1])]);
    assert_eq!(session.need(), Need::Nothing);
    sent(&mut session, 1, &[health(&events)]);
    assert_eq!(session.need(), Need::Info);
    sent(&mut session, 1, &[info(1)]);
    assert_eq!(session.need(), Need::Nothing);
    sent(&mut session, 1, &[health(&events)]);
    assert_eq!(session.need(), Need::Nothing, "the same change");
}

#[test]
fn a_restart_forgets_everything_but_the_name_and_a_stale_datagram_changes_nothing() {
    let mut session = Session::new(DEVICE, Subscription::default());
    sent(&mut session, 1, &[COOKIE, info(1), report(5, 1)]);
    assert_eq!(sent(&mut session, 2, &[report(1, 1)]), 1, "subscribe anew, without a cookie");
    assert_eq!((session.name(), session.need()), ("hall", Need::Info));
    let mut drops = Drops::default();
    let mut bytes = [0; DATAGRAM_MAX];
    let length = info(1).encode(Identity { module: DEVICE, boot: 1 }, &mut bytes).unwrap();
    session.receive(&Datagram::decode(&bytes[..length]).unwrap(), 1000, &placement(), &mut drops);
    assert_eq!((drops.stale_boot, session.need()), (1, Need::Info));
}

#[test]
fn f12_a_name_that_moves_a_terminal_is_told_without_that() {
    let mut session = Session::new(DEVICE, Subscription::default());
    let Message::Info(honest) = info(1) else { unreachable!() };
    sent(&mut session, 1, &[COOKIE, Message::Info(Info { name: "hall\u{1b}[2J\n", ..honest })]);
    assert_eq!(session.name(), "hall\u{fffd}[2J\u{fffd}");
}
