//! The session by itself: bytes and times by hand, wild ones too.
//!
//! Rows are those of the table of reported problems with SCIP clients in the field.

use kehai::scip::checksum;
use kehai::sensor::{Action, SensorSettings, SensorState, Session};
use proptest::prelude::*;

/// A session, and what came of it.
struct Talk {
    session: Session,
    now_us: u64,
    ranges_mm: [u16; 16],
    scans: usize,
    rates_baud: Vec<u32>,
}

impl Talk {
    fn new() -> Self {
        Self::with(SensorSettings::NO_SPEED)
    }

    fn with(settings: SensorSettings) -> Self {
        let session = Session::new(settings, 16);
        Self { session, now_us: 0, ranges_mm: [0; 16], scans: 0, rates_baud: Vec::new() }
    }

    /// The next request, however long it takes.
    fn asked(&mut self) -> String {
        for _ in 0..1000 {
            match self.session.poll(self.now_us) {
                Action::Send(message) => {
                    return message.parts().map(|part| String::from_utf8_lossy(part).into_owned()).concat();
                }
                Action::Wait(until_us) | Action::Pause(until_us) => self.now_us = until_us.max(self.now_us),
                Action::SetBaud(rate_baud) => self.rates_baud.push(rate_baud),
            }
        }
        panic!("nothing is asked");
    }

    fn hears(&mut self, text: &str) -> &mut Self {
        self.now_us += 1000;
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            let received = self.session.receive(rest, self.now_us, &mut self.ranges_mm);
            self.scans += usize::from(received.scan.is_some());
            rest = &rest[received.consumed..];
        }
        self
    }

    /// Up to the running stream.
    fn streaming(&mut self) -> &mut Self {
        assert_eq!(self.asked(), "\nQT\n");
        self.hears("QT\n00P\n\n");
        assert_eq!(self.asked(), "VV\n");
        self.hears("VV\n00P\n\n");
        assert_eq!(self.asked(), "PP\n");
        self.hears(&parameters(15));
        assert_eq!(self.asked(), "TM0\n");
        self.hears("TM0\n0Ee\n\n");
        assert_eq!(self.asked(), "MD0000001501000\n");
        self.hears("MD0000001501000\n00P\n\n")
    }
}

fn line(text: &str) -> String {
    format!("{text};{}\n", char::from(checksum::of(text.as_bytes())))
}

/// A sensor of 10 Hz with this last step.
fn parameters(last_step: u16) -> String {
    let amax = format!("AMAX:{last_step}");
    let keys = ["MODL:X", "DMIN:20", "DMAX:5600", "ARES:1024", "AMIN:0", &amax, "AFRT:8", "SCAN:600"];
    format!("PP\n00P\n{}\n", keys.map(line).concat())
}

fn scan(stamp_ms: u32) -> String {
    let code = |shift: u32| char::from((stamp_ms >> shift & 63) as u8 + 0x30);
    let stamp: String = [18, 12, 6, 0].map(code).into_iter().collect();
    let data = "0C4".repeat(16);
    let sum = |text: &str| char::from(checksum::of(text.as_bytes()));
    format!("MD0000001501000\n99b\n{stamp}{}\n{data}{}\n\n", sum(&stamp), sum(&data))
}

#[test]
fn a_sensor_is_set_up_and_its_scans_are_taken() {
    let mut talk = Talk::new();
    talk.streaming().hears(&scan(1000)).hears(&scan(1100));
    assert_eq!(talk.scans, 2);
    assert_eq!(talk.session.state(), SensorState::Streaming);
}

#[test]
fn what_buffers_held_at_another_rate_is_not_taken_for_garbage_at_this_one() {
    let (garbage, text) = ("\u{1}".repeat(100), "0C4".repeat(40));
    for (late_us, rates_baud) in [(0, vec![19_200]), (60_000, vec![19_200, 115_200])] {
        let mut talk = Talk::with(SensorSettings::SERIAL);
        assert_eq!(talk.asked(), "\nQT\n");
        let asked_us = talk.now_us;
        talk.now_us += late_us;
        talk.hears(&garbage);
        talk.now_us = asked_us + 80_000;
        talk.hears(&text);
        talk.asked();
        assert_eq!(talk.rates_baud, rates_baud, "garbage after {late_us} µs");
    }
}

/// Seconds from a scan until it is no longer taken for streaming, and until it is asked to go on, of a sensor that says
/// only this from then on, ten times a second.
fn patience_s(status: &str) -> (f64, f64) {
    let mut talk = Talk::new();
    talk.streaming().hears(&scan(1000));
    let scan_us = talk.now_us;
    let since_s = |now_us: u64| (now_us - scan_us) as f64 / 1e6;
    let sum = char::from(checksum::of(status.as_bytes()));
    let mut stalled_s = None;
    for _ in 0..1000 {
        talk.now_us += 99_000;
        talk.hears(&format!("MD0000001501000\n{status}{sum}\n\n"));
        let action = talk.session.poll(talk.now_us);
        if talk.session.state() == SensorState::Stalled {
            stalled_s = stalled_s.or(Some(since_s(talk.now_us)));
        }
        if let Action::Send(message) = action {
            assert_eq!(message.parts().concat(), b"\nQT\n");
            return (stalled_s.expect("stalled before it is asked"), since_s(talk.now_us));
        }
    }
    panic!("{status} is waited for for ever");
}

#[test]
fn a_sensor_that_talks_and_sends_no_scans_is_asked_to_go_on() {
    for verifying in ["21", "49"] {
        let (stalled_s, asked_s) = patience_s(verifying);
        assert!(stalled_s <= 10.1 && (10.0..10.2).contains(&asked_s), "{stalled_s} s, {asked_s} s");
    }
    for going_on in ["00", "98"] {
        let (stalled_s, asked_s) = patience_s(going_on);
        assert!(stalled_s < 1.0 && (30.0..30.2).contains(&asked_s), "{stalled_s} s, {asked_s} s");
    }
}

// Row 29: a late reply to QT is not taken for the answer to what is asked now.
#[test]
fn stale_replies_are_no_answers() {
    let mut talk = Talk::new();
    assert_eq!(talk.asked(), "\nQT\n");
    talk.hears("QT\n00P\n\n");
    assert_eq!(talk.asked(), "VV\n");
    talk.hears("QT\n00P\n\nQT\n0Bb\n\n");
    assert!(matches!(talk.session.poll(talk.now_us), Action::Wait(_)), "VV is still unanswered");
    talk.hears("VV\n00P\n\n");
    assert_eq!(talk.asked(), "PP\n");
    talk.hears("VV\n00P\n\nQT\n00P\n\n");
    assert!(matches!(talk.session.poll(talk.now_us), Action::Wait(_)), "PP is still unanswered");
    talk.hears(&parameters(15));
    assert_eq!(talk.asked(), "TM0\n");
}

// Row 29: an unanswered request is given up.
#[test]
fn an_unanswered_request_is_repeated_and_then_the_search_begins_anew() {
    let mut talk = Talk::new();
    assert_eq!(talk.asked(), "\nQT\n");
    talk.hears("QT\n00P\n\n");
    assert_eq!(talk.asked(), "VV\n");
    for _ in 0..3 {
        assert_eq!(talk.asked(), "PP\n");
    }
    assert_eq!(talk.asked(), "\nQT\n");
    assert!(talk.now_us < 2_000_000);
}

#[test]
fn a_sensor_of_another_model_that_does_not_answer_vv_is_not_taken_for_the_one_before() {
    let other = parameters(15).replace(&line("MODL:X"), &line("MODL:Y"));
    for (parameters_after, serial) in [(parameters(15), Some("H123")), (other, None)] {
        let mut talk = Talk::new();
        assert_eq!(talk.asked(), "\nQT\n");
        talk.hears("QT\n00P\n\n");
        assert_eq!(talk.asked(), "VV\n");
        talk.hears(&format!("VV\n00P\n{}\n", line("SERI:H123")));
        assert_eq!(talk.asked(), "PP\n");
        talk.hears(&parameters(15));
        // It falls silent: a full start.
        while talk.asked() != "\nQT\n" {}
        talk.hears("QT\n00P\n\n");
        assert_eq!(talk.asked(), "VV\n");
        assert_eq!(talk.asked(), "PP\n");
        talk.hears(&parameters_after);
        assert_eq!(talk.session.version().map(|version| version.serial.as_str()), serial);
    }
}

#[test]
fn a_damaged_reply_is_asked_for_again_at_once() {
    let mut talk = Talk::new();
    assert_eq!(talk.asked(), "\nQT\n");
    talk.hears("QT\n00P\n\n");
    assert_eq!(talk.asked(), "VV\n");
    talk.hears("VV\n00P\n\n");
    assert_eq!(talk.asked(), "PP\n");
    let before_us = talk.now_us;
    talk.hears(&parameters(15).replace("AMAX:15", "AMAX:16"));
    assert_eq!(talk.asked(), "PP\n");
    assert!(talk.now_us < before_us + 10_000);
}

// Row 13: TM0 and QT denied for ever.
#[test]
fn a_sensor_that_denies_everything_is_brought_out_of_time_sync_then_reset_then_rebooted() {
    let mut talk = Talk::new();
    let mut asked: Vec<(u64, String)> = Vec::new();
    while talk.now_us < 300_000_000 {
        let request = talk.asked();
        let command = request.trim();
        let reply = if command == "RB" { "RB\n01Q\n\n".to_owned() } else { format!("{command}\n10Q\n\n") };
        asked.push((talk.now_us / 1_000_000, command.to_owned()));
        talk.hears(&reply);
    }
    let times = |wanted: &str| -> Vec<u64> {
        asked.iter().filter(|(_, command)| command == wanted).map(|(at_s, _)| *at_s).collect()
    };
    let (resets, reboots) = (times("RS"), times("RB"));
    println!("RS at {resets:?} s, RB at {reboots:?} s, TM2 {} times", times("TM2").len());
    assert_eq!(asked[1].1, "TM2", "at once");
    assert_eq!(resets.len(), 1);
    assert!((30..60).contains(&resets[0]), "after a boot, be it a long one");
    assert!(reboots.len() >= 4 && (50..90).contains(&reboots[0]), "twice each");
    assert!(times("TM2").len() < 50, "once a round");
}

#[test]
fn more_beams_than_there_is_memory_for_are_refused() {
    let mut talk = Talk::new();
    assert_eq!(talk.asked(), "\nQT\n");
    talk.hears("QT\n00P\n\n");
    assert_eq!(talk.asked(), "VV\n");
    talk.hears("VV\n00P\n\n");
    assert_eq!(talk.asked(), "PP\n");
    talk.hears(&parameters(16));
    assert_eq!(talk.session.state(), SensorState::TooLarge { beams: 17, capacity: 16 });
    let before_us = talk.now_us;
    assert_eq!(talk.asked(), "\nQT\n");
    assert!((before_us + 1_000_000..before_us + 10_000_000).contains(&talk.now_us), "slowly");
}

#[test]
fn a_failing_link_pauses_reading_ever_longer_and_never_long() {
    let mut talk = Talk::new();
    talk.streaming().hears(&scan(1000));
    let mut pauses = Vec::new();
    for _ in 0..40 {
        talk.session.link_failed(talk.now_us);
        if let Action::Pause(until_us) = talk.session.poll(talk.now_us) {
            pauses.push(until_us - talk.now_us);
        }
    }
    assert!(pauses.is_sorted() && pauses[0] <= 10_000 && *pauses.last().unwrap() <= 500_000, "{pauses:?}");
    assert_ne!(talk.session.state(), SensorState::Streaming);
}

#[test]
fn failures_of_the_link_at_one_rate_pause_no_reading_at_the_next() {
    let mut talk = Talk::with(SensorSettings::SERIAL);
    assert_eq!(talk.asked(), "\nQT\n");
    // Line errors, as at a rate that is wrong, until another one is tried.
    for _ in 0..1000 {
        talk.session.link_failed(talk.now_us);
        match talk.session.poll(talk.now_us) {
            Action::SetBaud(_) => break,
            Action::Wait(until_us) | Action::Pause(until_us) => talk.now_us = until_us.max(talk.now_us),
            Action::Send(_) => {}
        }
    }
    assert_eq!(talk.asked(), "\nQT\n");
    assert!(matches!(talk.session.poll(talk.now_us), Action::Wait(_)), "{:?}", talk.session);
}

/// What may happen to a session.
#[derive(Clone, Debug)]
enum Happening {
    Bytes(Vec<u8>),
    Reply(&'static str),
    Scan(u32),
    Parameters,
    Time(u64),
    Failure,
}

fn happening() -> impl Strategy<Value = Happening> {
    let replies = [
        "QT\n00P\n\n",
        "QT\nE\n\n",
        "QT\n0Ee\n\n",
        "QT\n0Ll\n\n",
        "SCIP2.0\n0\n\n",
        "VV\n00P\n\n",
        "SS250000\n00P\n\n",
        "TM0\n00P\n\n",
        "TM0\n10Q\n\n",
        "TM1\n00P\n<SfkP\n\n",
        "TM2\n00P\n\n",
        "TM2\n03S\n\n",
        "BM\n01Q\n\n",
        "RB\n01Q\n\n",
        "MD0000001501000\n00P\n\n",
        "MD0000001501000\n10Q\n\n",
        "MD0000001501000\n0Mm\n\n",
        "MD0000001501000\n21S\n\n",
        "MD0000001501000\n50U\n\n",
        "QT\n",
        "\n\n",
    ];
    prop_oneof![
        2 => proptest::collection::vec(any::<u8>(), 0..200).prop_map(Happening::Bytes),
        8 => proptest::sample::select(replies.to_vec()).prop_map(Happening::Reply),
        3 => any::<u32>().prop_map(|stamp_ms| Happening::Scan(stamp_ms % 50_000 * 100)),
        2 => Just(Happening::Parameters),
        4 => prop_oneof![1u64..300_000, 1u64..20_000_000, Just(1u64 << 50)].prop_map(Happening::Time),
        1 => Just(Happening::Failure),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    // Whatever comes at whatever times: no panic, always a next deadline, and never a busy loop.
    #[test]
    fn anything_is_survived_and_there_is_always_a_deadline(
        serial in any::<bool>(),
        script in proptest::collection::vec(happening(), 1..200),
    ) {
        let settings = if serial { SensorSettings::SERIAL } else { SensorSettings::NO_SPEED };
        let mut talk = Talk { session: Session::new(settings, 16), ..Talk::new() };
        for happening in script {
            match happening {
                Happening::Bytes(bytes) => {
                    let mut rest = &bytes[..];
                    while !rest.is_empty() {
                        let received = talk.session.receive(rest, talk.now_us, &mut talk.ranges_mm);
                        prop_assert!(received.consumed > 0);
                        rest = &rest[received.consumed..];
                    }
                }
                Happening::Reply(reply) => _ = talk.hears(reply),
                Happening::Scan(stamp_ms) => _ = talk.hears(&scan(stamp_ms)),
                Happening::Parameters => _ = talk.hears(&parameters(15)),
                Happening::Time(us) => talk.now_us += us,
                Happening::Failure => talk.session.link_failed(talk.now_us),
            }
            let mut actions = 0;
            loop {
                match talk.session.poll(talk.now_us) {
                    Action::Wait(until_us) | Action::Pause(until_us) if until_us > talk.now_us => {
                        prop_assert!(until_us - talk.now_us <= 60_000_000, "waits until {until_us}");
                        break;
                    }
                    _ => actions += 1,
                }
                prop_assert!(actions < 10, "no end of actions");
            }
        }
    }
}
