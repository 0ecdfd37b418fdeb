//! What is forged, and what goes wrong by itself: three bytes decide on the fields.
#![allow(dead_code, reason = "each test uses its own part of it")]

use kehai::background::{BeamProfile, BeamState};
use kehai::candidate::Candidate;
use kehai::wire::{
    Alarms, Counters, Health, HealthHead, Identity, List, Message, ModuleId, PartHead, ProfilePart, Refusal,
    Refused, Report, ReportHead, Request, SensorCode, SensorHealth,
};
use kehai_tracking::registry::{Finding, Found};

use super::fake::{Fake, id};
use super::scene::BEAMS;
use super::times::{SECOND_US, WAY_US};
use super::world::{NAMESAKE, PEER, PEERS_NAME, Sender, World, address};

impl World {
    /// A module, as a forger knows it, and the address that its datagram seems to come from.
    fn forger(&mut self, a: u8) -> (usize, Fake) {
        self.judge.forged_us = self.now_us;
        let mut fake = self.honest[usize::from(a >> 2 & 1)].fake.clone();
        let boot = fake.identity.boot;
        fake.identity.boot = match a >> 3 & 7 {
            4 => boot.wrapping_add(1),
            5 => boot.wrapping_sub(1),
            6 => u32::MAX,
            7 => 0,
            _ => boot,
        };
        // Mostly from its own address.
        let from = if a & 0xc0 == 0 { usize::from(a & 3) } else { usize::from(a >> 2 & 1) };
        (from, fake)
    }

    /// Stamps that say nothing true, and some that do.
    fn stamp_us(&mut self, fake: &Fake, choice: u8, c: u8) -> u64 {
        let now_us = fake.clock_us(self.now_us);
        let more = |seconds: u64| now_us.wrapping_add(seconds * SECOND_US);
        match choice & 15 {
            4 => now_us + 60_000,
            5 => more(1),
            6 => more(20),
            7 => more(3600),
            8 => now_us.wrapping_add(1 << 62),
            9 => now_us.saturating_sub(250_000),
            10 => now_us.saturating_sub(SECOND_US),
            11 => now_us.saturating_sub(3600 * SECOND_US),
            12 => 0,
            13 => u64::MAX,
            14 => now_us.saturating_add(u64::from(c) * 1000),
            15 => now_us.saturating_sub(u64::from(c) * 4000),
            _ => now_us.saturating_sub(100_000),
        }
    }

    pub fn forge_report(&mut self, [a, b, c]: [u8; 3]) {
        let (from, fake) = self.forger(a);
        let sequence = fake.sequence.wrapping_add(match b & 7 {
            2 => 2 + u32::from(c),
            3 => 999,
            4 => 1 << 30,
            5 => (1_u32 << 30).wrapping_neg(),
            6 => 1001,
            7 => 0,
            _ => 1,
        });
        let stamp_us = self.stamp_us(&fake, b >> 3, c);
        let mut head =
            ReportHead { sequence, setup: 1, background_version: 1, stamp_us, ..ReportHead::default() };
        match c & 7 {
            0 => head.setup = 2,
            1 => head.background_version = u16::from(c),
            _ => {}
        }
        let phantom = Candidate {
            first_step: 380,
            last_step: 400,
            near_mm: 1500,
            mid_mm: 1500,
            first_mm: 1500,
            last_mm: 1500,
            ..Candidate::default()
        };
        let seen: &[Candidate] = if c & 8 == 0 { &[] } else { &[phantom] };
        let (candidates, unseen) = (List::new(seen), List::default());
        let report = fake.say(&Message::Report(Report { head, candidates, unseen, sizes: List::default() }));
        self.send(from, Sender::Forged, report, 0);
    }

    /// An answer that nothing has asked for, or that was given before.
    pub fn forge_answer(&mut self, [a, b, c]: [u8; 3]) {
        let (from, fake) = self.forger(a);
        let is_answered = |(_, _, at_us): &&(u32, [u8; 8], u64)| self.now_us - at_us > 4 * WAY_US;
        let known = self.spent.get(usize::from(b & 7)).filter(is_answered).map(|(id, t1, _)| (*id, *t1));
        let (request_id, t1) = match b >> 3 & 3 {
            0 => (self.random() as u32, [0; 8]),
            1 => (self.random() as u32, self.now_us.to_le_bytes()),
            2 => known.map_or((1, [0; 8]), |(id, _)| (id, [0; 8])),
            _ => known.unwrap_or((0, [0; 8])),
        };
        let t2_us = self.stamp_us(&fake, c, c);
        let answer = match b >> 5 {
            0..=3 => {
                let t3_us = if c & 16 == 0 { t2_us } else { t2_us.saturating_add(self.now_us) };
                fake.exchanged(request_id, u64::from_le_bytes(t1), t2_us, t3_us)
            }
            4 => fake.cookie(request_id, t1),
            5 => fake.info(request_id),
            6 => Fake { name: "evil", ..fake }.info(request_id),
            _ => {
                let kind = Request::Subscribe { t1 }.kind();
                fake.say(&Message::Refused(Refused { request_id, kind, refusal: Refusal::BadCookie }))
            }
        };
        self.send(from, Sender::Forged, answer, 0);
    }

    pub fn forge_health(&mut self, [a, b, c]: [u8; 3]) {
        let (from, fake) = self.forger(a);
        let head = HealthHead {
            uptime_us: self.stamp_us(&fake, b, c),
            sequence: fake.sequence.wrapping_add(u32::from(c) << (b & 24)),
            setup: u16::from(c),
            background_version: u16::from(b),
            sensor: SensorHealth { code: SensorCode::Abnormal, detail: (0, 0) },
            alarms: Alarms(u32::from(c)),
            storing: b & 1 != 0,
            subscribers: 4,
            learning: None,
        };
        let (suspects, events) = (List::default(), List::default());
        let health = Health { head, counters: Counters::default(), suspects, events };
        let health = fake.say(&Message::Health(health));
        self.send(from, Sender::Forged, health, 0);
    }

    /// A part of a background. That of the version in use can be forged while it is fetched: only keys help there.
    pub fn forge_part(&mut self, [a, b, c]: [u8; 3]) {
        let (from, fake) = self.forger(a);
        let beam = BeamProfile { far_mm: 1000, near_mm: 0, spread_mm: 5, state: BeamState::Wall };
        let beams = vec![beam; usize::from(c.min(220))];
        let head = PartHead {
            object: 2 + u32::from(b >> 4),
            part: b & 3,
            parts: b >> 2 & 3,
            first_step: 44,
            setup: 1,
        };
        let part = fake.say(&Message::ProfilePart(ProfilePart { head, beams: List::new(&beams) }));
        self.send(from, Sender::Forged, part, 0);
    }

    /// What a module said before comes again, from wherever.
    pub fn repeat(&mut self, [a, b, c]: [u8; 3]) {
        let Some((number, bytes)) = self.overheard.get(usize::from(b & 15)).cloned() else { return };
        self.judge.forged_us = self.now_us;
        let from = if a & 0xc0 == 0 { usize::from(a & 3) } else { number };
        self.send(from, Sender::Forged, bytes, 4 * WAY_US + u64::from(c) * 10_000);
    }

    /// An announcement: of a device at an address, or that it is gone.
    pub fn announce_falsely(&mut self, [a, b, c]: [u8; 3]) {
        self.judge.forged_us = self.now_us;
        let instance =
            ["kehai-right", "kehai-left", "kehai-evil", "kehai-peer"][usize::from(a & 3)].to_owned();
        if b & 3 == 0 {
            return self.find(Finding::Lost(instance));
        }
        let id = [id(1), id(2), id(9), ModuleId::ANY][usize::from(a >> 2 & 3)];
        let addresses = match c & 7 {
            0..=3 => vec![address(usize::from(c & 3))],
            4 => vec![address(PEER), address(3)],
            5 => vec![address(1), address(PEER)],
            6 => vec![([203, 0, 113, 7], 53).into()],
            _ => (0..20).map(|port| ([192, 168, 7, 88], 1000 + port).into()).collect(),
        };
        self.find(Finding::Found(Found { instance, id, addresses, ..Found::default() }));
    }

    /// The peer answers as a module, as another of the same name, or as itself again.
    pub fn pose(&mut self, [a, b, _]: [u8; 3]) {
        self.judge.forged_us = self.now_us;
        let (_, fake) = self.forger(a << 3 & 0x38 | a >> 1 & 4);
        self.peer = match b % 4 {
            0 => Fake { name: "other", ..fake },
            1 => fake,
            2 => Fake { parts: BEAMS, ..Fake::new(NAMESAKE, 1, "left") },
            _ => Fake::new(9, 1, PEERS_NAME),
        };
    }

    /// The network loses, doubles or delays.
    pub fn mishap(&mut self, [a, b, c]: [u8; 3]) {
        self.judge.disturbed_us = self.judge.disturbed_us.max(self.now_us);
        let honest = &mut self.honest[usize::from(a & 1)];
        let count = u32::from(b % 32);
        match a >> 1 & 3 {
            0 => honest.lost = count,
            1 => honest.twice = count,
            _ => honest.late = (count, u64::from(c) * 10_000),
        }
    }

    /// Nothing is heard of a module for a time.
    pub fn silence(&mut self, [a, b, _]: [u8; 3]) {
        let honest = &mut self.honest[usize::from(a & 1)];
        honest.silent_until_us = self.now_us + u64::from(b % 80) * 100_000;
        self.judge.disturbed_us = self.judge.disturbed_us.max(honest.silent_until_us);
    }

    /// A module starts anew, forgets how often it has started, or is another one from now on.
    pub fn restart(&mut self, [a, b, c]: [u8; 3]) {
        self.judge.disturbed_us = self.judge.disturbed_us.max(self.now_us);
        let now_us = self.now_us as i64;
        let fake = &mut self.honest[usize::from(a & 1)].fake;
        let Identity { module, boot } = fake.identity;
        fake.identity = match b % 5 {
            0 => Identity { module, boot: 1 },
            1 => Identity { module, boot: boot.saturating_sub(1 + u32::from(c % 3)) },
            2 if a & 1 == 0 => Identity { module: id(3 + (c & 1)), boot: u32::from(c) },
            _ => Identity { module, boot: boot.saturating_add(1 + u32::from(c % 3)) },
        };
        fake.sequence = 0;
        fake.offset_us = -now_us + 200_000;
    }

    /// A module's clock jumps.
    pub fn jump(&mut self, [a, b, c]: [u8; 3]) {
        self.judge.disturbed_us = self.judge.disturbed_us.max(self.now_us);
        let by_us = match b & 3 {
            0 => i64::from(c) * 1000,
            1 => i64::from(c) * 100_000,
            2 => i64::from(c) * -30_000,
            _ => i64::from(c) * 60_000_000,
        };
        let fake = &mut self.honest[usize::from(a & 1)].fake;
        // No clock goes below 0.
        fake.offset_us = (fake.offset_us + by_us).max(-(self.now_us as i64));
    }

    /// Ends all forging and all disturbances.
    pub fn end(&mut self) {
        self.peer = Fake::new(9, 1, PEERS_NAME);
        self.judge.forged_us = self.now_us;
        for honest in &mut self.honest {
            self.judge.disturbed_us = self.judge.disturbed_us.max(honest.silent_until_us).max(self.now_us);
            (honest.lost, honest.twice, honest.late) = (0, 0, (0, 0));
        }
    }

    /// The host sleeps: the world goes on.
    pub fn suspend(&mut self, [_, b, _]: [u8; 3]) {
        self.now_us += if b & 1 == 0 { 600 * SECOND_US } else { u64::from(b) * 100_000 };
        self.judge.disturbed_us = self.now_us.max(self.judge.disturbed_us);
    }
}
