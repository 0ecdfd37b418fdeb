//! Messages to try things on, and the largest there can be.

use kehai::background::{Absorb, BeamProfile, BeamState, Suspect};
use kehai::candidate::{CONTOUR_POINTS_WIDE, Candidate, End, EndKind, NECKS, Neck};
use kehai::floor::Fault;
use kehai::scan::{Geometry, GeometryParts, ScanTime};
use kehai::unseen::{UnseenReason, UnseenSpan};
use kehai::update::manifest::MANIFEST_LEN;
use kehai::wire::{
    Alarms, CHUNK_MAX, Cookie, Counter, Counters, DATAGRAM_MAX, Event, EventKind, FaultyPanel, Health,
    HealthHead, Identity, Info, LearningProgress, List, Message, ModuleId, PartHead, Pressed, ProfilePart,
    RawPart, Refusal, Refused, Report, ReportHead, Request, SensorCode, SensorHealth, SensorInfo, Size,
    Subscribed,
};

pub const MODULE: Identity = Identity { module: ModuleId([2, 0, 0, 0, 0, 9]), boot: 7 };
pub const VERSION_AT: usize = 3;
pub const BOOT_AT: usize = 4;
pub const KIND_AT: usize = 14;

pub fn datagram(message: Message<'_>) -> Vec<u8> {
    let mut out = [0; DATAGRAM_MAX];
    let length = message.encode(MODULE, &mut out).unwrap();
    out[..length].to_vec()
}

pub fn request(request: Request<'_>) -> Vec<u8> {
    let mut out = [0; DATAGRAM_MAX];
    let length = request.encode(MODULE, 5, Cookie([1; 8]), &mut out).unwrap();
    out[..length].to_vec()
}

pub const REQUESTS: [Request<'_>; 14] = [
    Request::Subscribe { t1: [9; 8] },
    Request::Info,
    Request::GetSettings,
    Request::SetSettings { text: "name=x" },
    Request::Learn { scans: 300 },
    Request::Absorb(Absorb { sequence: 1, first_step: 2, last_step: 300, nearest_mm: 4, farthest_mm: 5000 }),
    Request::Profile { version: 1, parts: 7 },
    Request::Raw { seconds: 2 },
    Request::RawAgain { object: 8, parts: 1 },
    Request::Restart,
    Request::Update { manifest: &[7; MANIFEST_LEN] },
    Request::UpdateChunk { offset: 2048, bytes: &[3; CHUNK_MAX] },
    Request::UpdateInstall,
    Request::Identify { seconds: 10 },
];

pub fn widest_candidate() -> Candidate {
    let end = End { kind: EndKind::Neck, step_mm: i16::MIN };
    Candidate {
        first_step: u16::MAX,
        last_step: u16::MAX,
        first_mm: u16::MAX,
        mid_mm: u16::MAX,
        last_mm: u16::MAX,
        near_mm: u16::MAX,
        near_step: u16::MAX,
        beams: u16::MAX,
        first_end: end,
        last_end: end,
        contour: [255; CONTOUR_POINTS_WIDE].into_iter().collect(),
        necks: [Neck { step: u16::MAX, depth_mm: u16::MAX }; NECKS].into_iter().collect(),
        touches: true,
        narrow: true,
        static_ds: u16::MAX,
    }
}

pub const WIDEST_SPAN: UnseenSpan =
    UnseenSpan { first_step: u16::MAX, beams: u16::MAX, reason: UnseenReason::Overflow, near_mm: Some(1) };

pub const SIZE: Size = Size { volume_l: u16::MAX, top_cm: u8::MAX };

pub const HEAD: ReportHead = ReportHead {
    sequence: u32::MAX,
    setup: u16::MAX,
    background_version: u16::MAX,
    stamp_us: u64::MAX,
    sensor_ms: u64::MAX,
    uncertainty_us: u32::MAX,
    lost_scans: u32::MAX,
};

pub const HEALTH_HEAD: HealthHead = HealthHead {
    uptime_us: u64::MAX,
    sequence: u32::MAX,
    setup: u16::MAX,
    background_version: u16::MAX,
    sensor: SensorHealth { code: SensorCode::Paused, detail: (u16::MAX, u16::MAX) },
    alarms: Alarms(u32::MAX),
    storing: true,
    subscribers: 4,
    learning: Some(LearningProgress {
        scans: u16::MAX,
        of: u16::MAX,
        restarts: u16::MAX,
        moved: Some((u16::MAX, u16::MAX)),
    }),
};

pub fn largest_counters() -> Counters {
    let mut counters = Counters::new();
    Counter::ALL.iter().for_each(|&counter| counters.set(counter, u32::MAX));
    counters
}

pub const EVENT: Event = Event {
    number: u32::MAX,
    at_us: u64::MAX,
    kind: EventKind::Unknown,
    background_version: u16::MAX,
    by: [255; 4],
};

pub const PROFILE: BeamProfile =
    BeamProfile { far_mm: 2500, near_mm: 800, spread_mm: 9, state: BeamState::Wall };

pub const SUSPECT: Suspect = Suspect { first_step: u16::MAX, last_step: u16::MAX, near_mm: u16::MAX };

pub const LONG: &str = "éééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééé";

pub fn largest_info() -> Info<'static> {
    let geometry = GeometryParts {
        first_step: 16_384,
        last_step: 30_000,
        cluster: 99,
        front_step: 14_399,
        steps_per_turn: 14_400,
        period_us: 10_000_000,
        range_min_mm: 65_000,
        range_max_mm: 65_534,
    };
    let sensor = SensorInfo::new([LONG; 3], &Geometry::new(geometry).unwrap(), 9, u16::MAX);
    let sensor = SensorInfo { period_us: u32::MAX, steps_per_turn: u16::MAX, ..sensor };
    Info {
        request_id: u32::MAX,
        version_min: 1,
        version_max: 255,
        firmware: LONG,
        build: LONG,
        board: LONG,
        name: LONG,
        uptime_us: u64::MAX,
        setup: u16::MAX,
        background_version: u16::MAX,
        sensor: Some(SensorInfo { cluster: u16::MAX, front_step: u16::MAX, ..sensor }),
    }
}

pub fn samples() -> Vec<Vec<u8>> {
    let subscribed = Subscribed {
        request_id: 1,
        t1: [1; 8],
        t2_us: 2,
        t3_us: 3,
        lease_ms: 5000,
        may_control: false,
        subscribers: 1,
    };
    let candidates = [widest_candidate(), Candidate::default()];
    let report = Report {
        head: HEAD,
        candidates: List::new(&candidates),
        unseen: List::new(&[WIDEST_SPAN]),
        sizes: List::new(&[SIZE; 2]),
    };
    let counters = largest_counters();
    let (suspects, events) = (List::new(&[SUSPECT; 2]), List::new(&[EVENT; 2]));
    let health = Health { head: HEALTH_HEAD, counters, suspects, events };
    let head = PartHead { object: 1, part: 1, parts: 2, first_step: 9, setup: 1 };
    let beams = List::new(&[PROFILE]);
    let faulty = List::new(&[FaultyPanel { panel: 8, fault: Fault::Dead }]);
    let raw = RawPart { head, time: ScanTime::default(), ranges_mm: List::new(&[1, 2, 3]) };
    [
        Message::Refused(Refused { request_id: 1, kind: 2, refusal: Refusal::VERSION }),
        Message::Cookie { request_id: 1, t1: [2; 8], cookie: Cookie([3; 8]) },
        Message::Subscribed(subscribed),
        Message::Info(Info { firmware: "1", build: "2", board: "3", name: "4", ..largest_info() }),
        Message::Done { request_id: 9 },
        Message::Settings { request_id: 9, text: "skip=0" },
        Message::Absorbed { request_id: 9, beams: 1, background_version: 2 },
        Message::Report(report),
        Message::Health(health),
        Message::ProfilePart(ProfilePart { head, beams }),
        Message::RawPart(raw),
        Message::Pressed(Pressed { head: HEAD, columns: 3, rows: 3, down: List::new(&[1, 1]), faulty }),
        Message::Receiving { request_id: 9, next: 2048 },
    ]
    .map(datagram)
    .to_vec()
}
