//! A module that is well, until a test says otherwise: each tenth of a second a scan, each second info, health and an exchange of clocks.

use std::sync::Arc;

use super::super::doubt::tests::{geometry, report};
use super::super::*;
use crate::clock::Exchange;
use crate::session::datagram::Datagram;
use crate::session::subscription::Subscription;
use crate::session::{Placement, Session};
use crate::site::{self, Site};
use crate::snapshot::Drops;
use kehai::background::Suspect;
use kehai::candidate::Candidate;
use kehai::centre::Estimator;
use kehai::unseen::UnseenSpan;
use kehai::wire::{Alarms, Counters, Event, Identity, List, Message, SensorHealth, SensorInfo};

const ID: ModuleId = ModuleId([2, 0, 0, 0, 0, 7]);

/// Of an emulated URG-04LX beside its module.
pub struct Module {
    pub session: Session,
    pub clock: ModuleClock,
    pub now_us: u64,
    /// Tenths of a second since it was switched on.
    pub tenths: u32,
    pub boot: u32,
    pub health: HealthHead,
    pub counters: Counters,
    pub events: Vec<Event>,
    pub candidates: Vec<Candidate>,
    pub unseen: Vec<UnseenSpan>,
    /// Of a hundred reports, this many are lost on the way.
    pub lost: u32,
    /// Of a hundred scans, this many are made.
    pub made: u32,
    pub sequence: u32,
    pub lost_scans: u32,
    /// How much later than they should reports arrive, µs.
    pub late_us: i64,
    /// By how much the exchanges of the clocks are off, one way and the other, µs.
    pub jitter_us: u64,
    pub suspects: Vec<Suspect>,
    /// What the site says of them.
    pub furniture: Vec<[f64; 2]>,
    /// Whether the site has it head down.
    pub upside_down: bool,
}

impl Module {
    /// One that has been watched for 90 s and is well.
    pub fn well() -> Self {
        let health = HealthHead {
            uptime_us: 0,
            sequence: 0,
            setup: 1,
            background_version: 1,
            sensor: SensorHealth { code: SensorCode::Streaming, detail: (0, 0) },
            alarms: Alarms::default(),
            storing: false,
            subscribers: 1,
            learning: None,
        };
        let mut module = Self {
            session: Session::new(ID, Subscription::default()),
            clock: ModuleClock::default(),
            now_us: 0,
            tenths: 0,
            boot: 1,
            health,
            counters: Counters::new(),
            events: Vec::new(),
            candidates: Vec::new(),
            unseen: Vec::new(),
            lost: 0,
            made: 100,
            sequence: 0,
            lost_scans: 0,
            late_us: 0,
            suspects: Vec::new(),
            furniture: Vec::new(),
            upside_down: false,
            jitter_us: 200,
        };
        module.session.monitor_from(0);
        assert_eq!(module.alarms_after(90), [""; 0]);
        module
    }

    pub fn monitor(&mut self) -> &mut Monitor {
        self.session.monitor.as_mut().unwrap()
    }

    pub fn send(&mut self, message: &Message<'_>, at_us: u64) {
        let mut datagram = [0; 1400];
        let length = message.encode(Identity { module: ID, boot: self.boot }, &mut datagram).unwrap();
        let datagram = Datagram::decode(&datagram[..length]).unwrap();
        let hall = site::Module { upside_down: self.upside_down, ..site::Module::unplaced("hall".into()) };
        let site = Arc::new(Site { modules: vec![hall], ..Site::default() });
        let placement = Placement { site, estimator: Estimator::default() };
        self.session.receive(&datagram, at_us, &placement, &mut Drops::default());
    }

    /// A tenth of a second with a scan; info, health and an exchange every second.
    pub fn tenth(&mut self) {
        self.now_us += 100_000;
        self.tenths += 1;
        let module_us = u64::from(self.tenths) * 100_000;
        if self.tenths % 100 < self.made {
            self.sequence += 1;
            let (candidates, unseen) = (self.candidates.clone(), self.unseen.clone());
            let mut report = report(0.0, &candidates, &unseen);
            report.head.stamp_us = module_us - 100_000;
            report.head.sequence = self.sequence;
            report.head.lost_scans = self.lost_scans;
            report.head.background_version = self.health.background_version;
            if self.tenths % 100 >= self.lost {
                self.send(&Message::Report(report), self.now_us.saturating_add_signed(self.late_us));
            }
        }
        if self.tenths % 10 == 1 {
            let sensor = Some(SensorInfo::new(["URG-04LX", "H1", "1"], &geometry(), 0, 2000));
            let info = Info {
                request_id: 1,
                version_min: 1,
                version_max: 1,
                firmware: "1",
                build: "1",
                board: "pc",
                name: "hall",
                uptime_us: module_us,
                setup: 1,
                background_version: 1,
                sensor,
            };
            self.send(&Message::Info(info), self.now_us);
            self.health.uptime_us = module_us;
            let (head, counters, events) = (self.health, self.counters, self.events.clone());
            let suspects = self.suspects.clone();
            let health =
                Health { head, counters, suspects: List::new(&suspects), events: List::new(&events) };
            self.send(&Message::Health(health), self.now_us);
            let swing_us = if self.tenths % 20 == 1 { self.jitter_us } else { 0 };
            let (t1_us, t2_us) = (self.now_us - 400 - self.jitter_us, module_us - 200 - swing_us);
            self.clock.add(Exchange { t1_us, t2_us, t3_us: t2_us, t4_us: self.now_us });
        }
    }

    pub fn line(&mut self) -> ModuleLine {
        let (clock, now_us, furniture) = (self.clock.clone(), self.now_us, self.furniture.clone());
        let monitor = self.monitor();
        monitor.know_furniture(&furniture);
        monitor.line("hall", ID, Some(&clock), now_us)
    }

    pub fn alarms(&mut self) -> Vec<String> {
        self.line().alarms.into_iter().map(|alarm| alarm.kind.name().to_owned()).collect()
    }

    /// All alarms within the next seconds, each once.
    pub fn alarms_after(&mut self, seconds: u32) -> Vec<String> {
        let mut seen = Vec::new();
        for _ in 0..10 * seconds {
            self.tenth();
            for alarm in self.alarms() {
                if !seen.contains(&alarm) {
                    seen.push(alarm);
                }
            }
        }
        seen
    }

    /// The text of the only alarm there is, and that it has this name.
    #[track_caller]
    pub fn only(&mut self, name: &str) -> String {
        let alarms = self.line().alarms;
        assert_eq!(alarms.iter().map(|alarm| alarm.kind.name()).collect::<Vec<_>>(), [name]);
        alarms[0].text.clone()
    }

    /// It is well again after so many seconds, and stays so.
    #[track_caller]
    pub fn is_well_after(&mut self, seconds: u32) {
        self.alarms_after(seconds);
        assert_eq!(self.alarms_after(30), [""; 0]);
    }
}
