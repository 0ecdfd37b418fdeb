//! A module that says what it is told to: its datagrams, byte by byte, for tests of what a host believes.
//!
//! ```text
//!   (0, 0) ─▶ ┌──────┐            │ wall, 4 m all around
//!    module   │ area │            │
//!             └──────┘            │
//!             1 m   2 m           4 m
//! ```
#![allow(dead_code, reason = "each test uses its own part of it")]

use kehai::background::{BeamProfile, BeamState};
use kehai::candidate::Candidate;
use kehai::scan::{Geometry, GeometryParts, URG_04LX};
use kehai::wire::{
    Cookie, DATAGRAM_MAX, Identity, Incoming, Info, List, Message, ModuleId, PROFILE_PART_BEAMS, PartHead,
    ProfilePart, Refusal, Refused, Report, ReportHead, Request, SensorInfo, Subscribed,
};

/// One module that sees all of one zone.
pub const SITE: &str = r#"
    [[module]]
    name = "left"
    x = 0.0
    y = 0.0
    [[zone]]
    name = "area"
    polygon = [[1, -0.5], [2, -0.5], [2, 0.5], [1, 0.5]]
"#;

/// Identity of the first module; the others count on.
pub const fn id(number: u8) -> ModuleId {
    ModuleId([2, 0, 0, 0, 0, number])
}

/// A module and what it says of itself.
#[derive(Clone, Debug)]
pub struct Fake {
    pub identity: Identity,
    pub name: &'static str,
    /// Number of the key that its datagrams name, as those do that were sealed; 0: none.
    pub key: u8,
    /// Of its newest report.
    pub sequence: u32,
    /// Its clock less the host's, µs.
    pub offset_us: i64,
    /// Its beams.
    pub parts: GeometryParts,
    /// Bodies that stood there while it learned its background, as it saw them: they are in it.
    pub learned: Vec<Candidate>,
}

impl Fake {
    pub const fn new(number: u8, boot: u32, name: &'static str) -> Self {
        let identity = Identity { module: id(number), boot };
        Self { identity, name, key: 0, sequence: 0, offset_us: 0, parts: URG_04LX, learned: Vec::new() }
    }

    pub fn geometry(&self) -> Geometry {
        Geometry::new(self.parts).unwrap()
    }

    /// Its clock at a time of the host's.
    pub const fn clock_us(&self, host_us: u64) -> u64 {
        host_us.saturating_add_signed(self.offset_us)
    }

    pub fn say(&self, message: &Message<'_>) -> Vec<u8> {
        let mut datagram = [0; DATAGRAM_MAX];
        let length = message.encode(self.identity, &mut datagram).unwrap();
        datagram[15] = self.key;
        datagram[..length].to_vec()
    }

    pub fn cookie(&self, request_id: u32, t1: [u8; 8]) -> Vec<u8> {
        self.say(&Message::Cookie { request_id, t1, cookie: Cookie([7; 8]) })
    }

    /// The answer to a subscription of `t1_us` that arrives at `t4_us`.
    pub fn subscribed(&self, request_id: u32, t1_us: u64, t4_us: u64) -> Vec<u8> {
        let t2_us = self.clock_us(t1_us + (t4_us - t1_us) / 2);
        self.exchanged(request_id, t1_us, t2_us, t2_us)
    }

    pub fn exchanged(&self, request_id: u32, t1_us: u64, t2_us: u64, t3_us: u64) -> Vec<u8> {
        self.say(&Message::Subscribed(Subscribed {
            request_id,
            t1: t1_us.to_le_bytes(),
            t2_us,
            t3_us,
            lease_ms: 5000,
            subscribers: 1,
            may_control: true,
        }))
    }

    pub fn info(&self, request_id: u32) -> Vec<u8> {
        let geometry = self.geometry();
        self.say(&Message::Info(Info {
            request_id,
            version_min: 1,
            version_max: 1,
            firmware: "",
            build: "",
            board: "",
            name: self.name,
            uptime_us: 0,
            setup: 1,
            background_version: 1,
            sensor: Some(SensorInfo::new(["URG-04LX", "H1", "1"], &geometry, 0, 2000)),
        }))
    }

    /// Its background: walls at 4 m, and what it learned.
    pub fn profile(&self) -> Vec<Vec<u8>> {
        let geometry = self.geometry();
        let far_mm = |beam: u16| {
            let step = geometry.step(beam);
            let is_on = |body: &&Candidate| (body.first_step..=body.last_step).contains(&step);
            self.learned.iter().find(is_on).map_or(4000, |body| body.near_mm)
        };
        let wall =
            |beam| BeamProfile { far_mm: far_mm(beam), near_mm: 0, spread_mm: 5, state: BeamState::Wall };
        let walls: Vec<BeamProfile> = (0..geometry.beams()).map(wall).collect();
        let parts = walls.len().div_ceil(PROFILE_PART_BEAMS);
        let part = |(part, beams): (usize, &[BeamProfile])| {
            let head = PartHead {
                object: 1,
                part: part as u8,
                parts: parts as u8,
                first_step: self.parts.first_step + (part * PROFILE_PART_BEAMS) as u16 * self.parts.cluster,
                setup: 1,
            };
            self.say(&Message::ProfilePart(ProfilePart { head, beams: List::new(beams) }))
        };
        walls.chunks(PROFILE_PART_BEAMS).enumerate().map(part).collect()
    }

    /// The next report, of an empty room, whose scan began at `host_us` of the host's clock.
    pub fn report(&mut self, host_us: u64) -> Vec<u8> {
        self.sequence = self.sequence.wrapping_add(1);
        self.reported(self.sequence, self.clock_us(host_us))
    }

    pub fn reported(&self, sequence: u32, stamp_us: u64) -> Vec<u8> {
        self.reported_with(sequence, stamp_us, &[])
    }

    pub fn reported_with(&self, sequence: u32, stamp_us: u64, seen: &[Candidate]) -> Vec<u8> {
        let head =
            ReportHead { sequence, setup: 1, background_version: 1, stamp_us, ..ReportHead::default() };
        self.say(&Message::Report(Report {
            head,
            candidates: List::new(seen),
            unseen: List::default(),
            sizes: List::default(),
        }))
    }

    /// What it answers to a request that came at `t2_us` of its clock.
    pub fn answers(&self, request: &[u8], t2_us: u64) -> Vec<Vec<u8>> {
        let Ok(incoming) = Incoming::open(request) else { return Vec::new() };
        let (request_id, kind) = (incoming.request_id, incoming.header.kind);
        let refuse = |refusal| vec![self.say(&Message::Refused(Refused { request_id, kind, refusal }))];
        match incoming.request(self.identity) {
            Err(refusal) => refuse(refusal),
            Ok(Request::Subscribe { t1 }) if incoming.cookie == Cookie::NONE => {
                vec![self.cookie(request_id, t1)]
            }
            Ok(Request::Subscribe { t1 }) => {
                vec![self.exchanged(request_id, u64::from_le_bytes(t1), t2_us, t2_us)]
            }
            Ok(Request::Info) => vec![self.info(request_id)],
            Ok(Request::Profile { .. }) => self.profile(),
            Ok(_) => refuse(Refusal::Unsupported),
        }
    }
}
