//! The bytes of one datagram of every kind, which must never change: `tests/data/wire/*.hex`.
//!
//! A difference means that modules and hosts in the field no longer understand each other. New kinds
//! get new files; `KEHAI_WRITE_GOLDEN=1 cargo test --test wire golden::` writes those that are missing.

use std::fmt::Write;
use std::path::PathBuf;

use kehai::background::{Absorb, BeamProfile, BeamState, Suspect};
use kehai::candidate::{Candidate, End, EndKind, Neck};
use kehai::floor::Fault;
use kehai::scan::{Geometry, ScanTime, URG_04LX};
use kehai::sensor::SensorState;
use kehai::unseen::{UnseenReason, UnseenSpan};
use kehai::wire::{
    Alarms, COUNTERS, Cookie, Counter, Counters, DATAGRAM_MAX, Event, EventKind, FaultyPanel, Health,
    HealthHead, Identity, ImageFault, Incoming, Info, LearningProgress, List, Message, ModuleId, PartHead,
    Pressed, ProfilePart, RawPart, Refusal, Refused, Report, ReportHead, Request, SensorInfo, SettingFault,
    Size, Subscribed,
};

const MODULE: Identity = Identity { module: ModuleId([0x52, 0x54, 0x00, 0x12, 0x34, 0x01]), boot: 7 };
const COOKIE: Cookie = Cookie([0xc0, 0x0c, 1, 2, 3, 4, 5, 6]);
const T1: [u8; 8] = *b"host t1.";
const REQUEST_ID: u32 = 0x0102_0304;

fn golden(name: &str, datagram: &[u8]) -> Vec<u8> {
    let path =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/wire").join(name).with_extension("hex");
    let mut text = String::new();
    for line in datagram.chunks(16) {
        line.iter().for_each(|byte| write!(text, "{byte:02x} ").unwrap());
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    if !path.exists() && std::env::var_os("KEHAI_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let expected =
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert_eq!(expected, text, "{name}: the bytes on the wire have changed");
    expected.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn check_message(name: &str, message: Message<'_>) {
    let mut out = [0; DATAGRAM_MAX];
    let length = message.encode(MODULE, &mut out).unwrap();
    let bytes = golden(name, &out[..length]);
    let (header, decoded) = Message::decode(&bytes).unwrap();
    assert_eq!((header.identity, header.kind), (MODULE, message.kind()), "{name}");
    assert_eq!(decoded, message, "{name}");
}

fn check_request(name: &str, to: Identity, cookie: Cookie, request: Request<'_>) {
    let mut out = [0; DATAGRAM_MAX];
    let length = request.encode(to, REQUEST_ID, cookie, &mut out).unwrap();
    let bytes = golden(name, &out[..length]);
    let incoming = Incoming::open(&bytes).unwrap();
    assert_eq!((incoming.request_id, incoming.cookie), (REQUEST_ID, cookie), "{name}");
    assert_eq!(incoming.request(MODULE), Ok(request), "{name}");
}

#[test]
fn every_datagram_ever_sent_is_understood() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/wire");
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let bytes: Vec<u8> =
            text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let request = Incoming::open(&bytes).is_ok_and(|incoming| incoming.request(MODULE).is_ok());
        assert!(request || Message::decode(&bytes).is_ok(), "{}", path.display());
    }
}

#[test]
fn the_description_shows_these_bytes_and_names_every_counter() {
    let project = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let description = std::fs::read_to_string(project.join("docs/wire.md")).unwrap();
    let report = std::fs::read_to_string(project.join("tests/data/wire/report.hex")).unwrap();
    let indented: String = report.lines().map(|line| format!("    {line}\n")).collect();
    assert!(description.contains(&indented), "the worked example of docs/wire.md is not the golden report");
    for (at, counter) in Counter::ALL.iter().enumerate() {
        let row = format!("| {at} | `{}` |", counter.name());
        assert!(description.contains(&row), "docs/wire.md misses {row}");
    }
}

#[test]
fn requests_have_their_bytes() {
    let any = Identity { module: ModuleId::ANY, boot: 0 };
    let absorb =
        Absorb { sequence: 1234, first_step: 300, last_step: 340, nearest_mm: 1500, farthest_mm: 1800 };
    check_request("subscribe-first", any, Cookie::NONE, Request::Subscribe { t1: T1 });
    check_request("subscribe", MODULE, COOKIE, Request::Subscribe { t1: T1 });
    check_request("get-info", MODULE, COOKIE, Request::Info);
    check_request("get-settings", MODULE, COOKIE, Request::GetSettings);
    check_request("set-settings", MODULE, COOKIE, Request::SetSettings { text: "name=door left\nskip=1\n" });
    check_request("learn", MODULE, COOKIE, Request::Learn { scans: 60 });
    check_request("absorb", MODULE, COOKIE, Request::Absorb(absorb));
    check_request("get-profile", MODULE, COOKIE, Request::Profile { version: 300, parts: 0b101 });
    check_request("raw", MODULE, COOKIE, Request::Raw { seconds: 10 });
    check_request("raw-again", MODULE, COOKIE, Request::RawAgain { object: 1234, parts: 0b10 });
    check_request("restart", MODULE, COOKIE, Request::Restart);
    let manifest = core::array::from_fn(|index| index as u8);
    check_request("update", MODULE, COOKIE, Request::Update { manifest: &manifest });
    let bytes = [0xde, 0xad, 0xbe, 0xef];
    check_request("update-chunk", MODULE, COOKIE, Request::UpdateChunk { offset: 70_000, bytes: &bytes });
    check_request("update-install", MODULE, COOKIE, Request::UpdateInstall);
    check_request("identify", MODULE, COOKIE, Request::Identify { seconds: 300 });
}

#[test]
fn answers_have_their_bytes() {
    let request_id = REQUEST_ID;
    let refused = |kind, refusal| Message::Refused(Refused { request_id, kind, refusal });
    check_message("refused-version", refused(0x05, Refusal::VERSION));
    check_message("refused-setting", refused(0x04, Refusal::Setting { line: 1, fault: SettingFault::Range }));
    check_message("cookie", Message::Cookie { request_id, t1: T1, cookie: COOKIE });
    let (t2_us, t3_us) = (0x1122_3344_5566_7788, 0x1122_3344_5566_7799);
    let subscribed =
        Subscribed { request_id, t1: T1, t2_us, t3_us, lease_ms: 5000, may_control: true, subscribers: 2 };
    check_message("subscribed", Message::Subscribed(subscribed));
    check_message("done", Message::Done { request_id });
    check_message("settings", Message::Settings { request_id, text: "name=door left\nskip=0\n" });
    check_message("absorbed", Message::Absorbed { request_id, beams: 38, background_version: 301 });
    check_message("receiving", Message::Receiving { request_id, next: 70_000 });
    let fault = ImageFault::TooOld;
    check_message("refused-image", refused(0x0d, Refusal::Image(fault)));
    let geometry = Geometry::new(URG_04LX).unwrap();
    let info = Info {
        request_id,
        version_min: 1,
        version_max: 1,
        firmware: "0.1.0",
        build: "v0.1.0-3-g0123abc",
        board: "mps2-an386",
        name: "Tür links",
        uptime_us: 90_000_000,
        setup: 2,
        background_version: 3,
        sensor: Some(SensorInfo::new(["URG-04LX", "H0503678", "3.0.00"], &geometry, 0, 2500)),
    };
    check_message("info", Message::Info(info));
    check_message("info-no-sensor", Message::Info(Info { sensor: None, ..info }));
}

#[test]
fn a_report_has_its_bytes() {
    let head = ReportHead {
        sequence: 1234,
        setup: 2,
        background_version: 3,
        stamp_us: 123_456_789,
        sensor_ms: 98_765,
        uncertainty_us: 1500,
        lost_scans: 4,
    };
    let torso = Candidate {
        first_step: 300,
        last_step: 331,
        first_mm: 2010,
        mid_mm: 1905,
        last_mm: 2000,
        near_mm: 1900,
        near_step: 314,
        beams: 32,
        first_end: End { kind: EndKind::Free, step_mm: 1300 },
        last_end: End { kind: EndKind::Body, step_mm: -400 },
        contour: heapless::Vec::from_slice(&[20, 8, 2, 1, 3, 9, 19]).unwrap(),
        touches: true,
        static_ds: 25,
        ..Candidate::default()
    };
    let pair = Candidate {
        first_step: 332,
        last_step: 400,
        first_mm: 1600,
        mid_mm: 1700,
        last_mm: 1650,
        near_mm: 1550,
        near_step: 340,
        beams: 67,
        first_end: End { kind: EndKind::Neck, step_mm: 0 },
        last_end: End { kind: EndKind::View, step_mm: i16::MAX },
        contour: heapless::Vec::from_slice(&[1, 2, 3, 4, 5, 6, 60, 255, 60, 6, 5, 4, 3, 2, 1]).unwrap(),
        necks: heapless::Vec::from_slice(&[
            Neck { step: 365, depth_mm: 200 },
            Neck { step: 390, depth_mm: 52 },
        ])
        .unwrap(),
        touches: true,
        narrow: false,
        static_ds: 0,
    };
    let leg = Candidate {
        first_step: 500,
        last_step: 502,
        first_mm: 3000,
        mid_mm: 2990,
        last_mm: 3010,
        near_mm: 2990,
        near_step: 501,
        beams: 3,
        last_end: End { kind: EndKind::Wall, step_mm: -1000 },
        contour: heapless::Vec::from_slice(&[0]).unwrap(),
        narrow: true,
        static_ds: 600,
        ..Candidate::default()
    };
    let unseen = [
        UnseenSpan { first_step: 120, beams: 8, reason: UnseenReason::NoReturn, near_mm: None },
        UnseenSpan { first_step: 450, beams: 2, reason: UnseenReason::TooShort, near_mm: Some(1234) },
        UnseenSpan { first_step: 600, beams: 99, reason: UnseenReason::Overflow, near_mm: Some(800) },
    ];
    let candidates = [torso, pair, leg];
    let full = Report {
        head,
        candidates: List::new(&candidates),
        unseen: List::new(&unseen),
        sizes: List::default(),
    };
    check_message("report", Message::Report(full));
    let empty = Report { head, candidates: List::default(), unseen: List::default(), sizes: List::default() };
    check_message("report-empty", Message::Report(empty));
    // As a depth camera sends it: of the leg nothing is known.
    let sizes = [Size { volume_l: 56, top_cm: 171 }, Size { volume_l: 300, top_cm: 255 }, Size::UNKNOWN];
    check_message("report-sizes", Message::Report(Report { sizes: List::new(&sizes), ..full }));
}

#[test]
fn a_floor_has_its_bytes() {
    let head = ReportHead {
        sequence: 1234,
        setup: 1,
        stamp_us: 123_456_789,
        uncertainty_us: 1500,
        lost_scans: 4,
        ..ReportHead::default()
    };
    // 5 × 3 panels: a sole over (1, 0), (2, 0) and (2, 1).
    let down = [0b1000_0110, 0];
    let faulty =
        [FaultyPanel { panel: 14, fault: Fault::Stuck }, FaultyPanel { panel: 5, fault: Fault::Dead }];
    let pressed = Pressed { head, columns: 5, rows: 3, down: List::new(&down), faulty: List::new(&faulty) };
    check_message("pressed", Message::Pressed(pressed));
}

#[test]
fn health_has_its_bytes() {
    let mut counters = Counters::new();
    for (at, &counter) in Counter::ALL.iter().enumerate() {
        counters.set(counter, at as u32 * 9);
    }
    let head = HealthHead {
        uptime_us: 3_600_000_000,
        sequence: 36_000,
        setup: 2,
        background_version: 3,
        sensor: SensorState::Streaming.into(),
        alarms: Alarms::LEARNING_WAITS.with(Alarms::SUSPECTS),
        storing: false,
        subscribers: 2,
        learning: Some(LearningProgress { scans: 12, of: 60, restarts: 1, moved: Some((310, 340)) }),
    };
    let suspects = [Suspect { first_step: 200, last_step: 230, near_mm: 1800 }];
    let events = [
        Event { number: 1, at_us: 2_000_000, kind: EventKind::Learned, background_version: 1, by: [0; 4] },
        Event {
            number: 2,
            at_us: 3_500_000_000,
            kind: EventKind::LearnStarted,
            background_version: 3,
            by: [192, 168, 1, 20],
        },
    ];
    let full = Health { head, counters, suspects: List::new(&suspects), events: List::new(&events) };
    // A counter more is a file more: the older ones stay readable.
    check_message(&format!("health-{COUNTERS}-counters"), Message::Health(full));
    let sensor = SensorState::TooLarge { beams: 1081, capacity: 682 }.into();
    let head = HealthHead { learning: None, alarms: Alarms::default(), sensor, ..head };
    let quiet =
        Health { head, counters: Counters::new(), suspects: List::default(), events: List::default() };
    check_message(&format!("health-quiet-{COUNTERS}-counters"), Message::Health(quiet));
}

#[test]
fn parts_have_their_bytes() {
    let head = PartHead { object: 300, part: 1, parts: 5, first_step: 264, setup: 2 };
    let beams = [
        BeamProfile { far_mm: 2500, near_mm: 0, spread_mm: 9, state: BeamState::Wall },
        BeamProfile { far_mm: 2510, near_mm: 1200, spread_mm: 12, state: BeamState::Wall },
        BeamProfile { far_mm: 0, near_mm: 0, spread_mm: 0, state: BeamState::Open },
        BeamProfile::default(),
    ];
    check_message("profile-part", Message::ProfilePart(ProfilePart { head, beams: List::new(&beams) }));
    let time = ScanTime { sensor_ms: 98_765, stamp_us: 123_456_789, uncertainty_us: 1500 };
    let ranges_mm = List::new(&[2500, 2510, 7, 0, 65_535]);
    let head = PartHead { object: 1234, part: 0, parts: 2, first_step: 44, setup: 2 };
    check_message("raw-part", Message::RawPart(RawPart { head, time, ranges_mm }));
}
