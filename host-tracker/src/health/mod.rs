//! How a module is: its messages and the time in, a line and alarms with a reason out.
//!
//! ```text
//!   report ─┬─▶ tally    rates and losses       ╮
//!           └─▶ doubt    background not seen    ├─▶ bell ─▶ alarms in words
//!   health ───▶ states, counters                │
//!      └──────▶ news     what it did            │
//!   clock ────▶ offset, jitter, age             ╯──────────▶ ModuleLine
//! ```
//!
//! No I/O, no clock of its own: the same messages at the same times give the same alarms.

mod alarms;
mod doubt;
mod news;
mod tally;

use kehai::wire::{EventKind, Health, HealthHead, Info, Message, ModuleId, Report, SensorCode};

use crate::clock::ModuleClock;
use crate::frame::ModuleLine;
use alarms::{Bell, Facts, SILENT_US};
use doubt::Doubt;
use news::News;
use tally::Tally;

/// Watches over one module.
#[derive(Clone, Debug)]
pub struct Watch {
    since_us: u64,
    last_heard_us: Option<u64>,
    boot: u32,
    told: Option<Told>,
    health: Option<Condition>,
    /// µs of the module's clock.
    learned_us: Option<u64>,
    newest: Option<Arrival>,
    tally: Tally,
    doubt: Option<Doubt>,
    bell: Bell,
    news: News,
}

/// What its info says.
#[derive(Clone, Debug)]
struct Told {
    name: String,
    expected_hz: Option<f64>,
    /// Time of a scan, s.
    scan_s: f64,
}

/// Its newest health.
#[derive(Clone, Copy, Debug)]
struct Condition {
    head: HealthHead,
    suspects: usize,
    at_us: u64,
}

/// The newest report: when its scan began by the module's clock, and when it came by the host's.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    stamp_us: u64,
    at_us: u64,
}

impl Watch {
    /// Over a module that is asked for from `now_us` on.
    #[must_use]
    pub fn new(now_us: u64) -> Self {
        Self {
            since_us: now_us,
            last_heard_us: None,
            boot: 0,
            told: None,
            health: None,
            learned_us: None,
            newest: None,
            tally: Tally::default(),
            doubt: None,
            bell: Bell::default(),
            news: News::default(),
        }
    }

    /// Takes a datagram of it.
    pub fn receive(&mut self, datagram: &[u8], now_us: u64) {
        let Ok((header, message)) = Message::decode(datagram) else { return };
        let boot = header.identity.boot;
        // A late datagram of an earlier start says nothing any more.
        if boot < self.boot {
            return;
        }
        if boot > self.boot {
            let (since_us, bell, told) = (self.since_us, std::mem::take(&mut self.bell), self.told.take());
            let news = std::mem::take(&mut self.news);
            *self = Self { boot, bell, told, news, ..Self::new(since_us) };
        }
        self.last_heard_us = Some(now_us);
        match message {
            Message::Info(info) => self.info(&info),
            Message::Report(report) => self.report(&report, now_us),
            Message::Health(health) => self.take_health(&health, now_us),
            _ => {}
        }
    }

    fn info(&mut self, info: &Info<'_>) {
        let sensor = info.sensor.and_then(|sensor| Some((sensor.geometry().ok()?, sensor.skip)));
        if let Some((geometry, _)) = sensor
            && self.doubt.as_ref().is_none_or(|doubt| *doubt.geometry() != geometry)
        {
            self.doubt = Some(Doubt::new(geometry));
        }
        let scan_s = sensor.map(|(geometry, _)| f64::from(geometry.period_us()) * 1e-6);
        self.told = Some(Told {
            name: info.name.to_owned(),
            expected_hz: sensor
                .zip(scan_s)
                .map(|((_, skip), scan_s)| 1.0 / (scan_s * (1.0 + f64::from(skip)))),
            scan_s: scan_s.unwrap_or(0.0),
        });
    }

    fn report(&mut self, report: &Report<'_>, now_us: u64) {
        self.tally.report(&report.head);
        let stamp_us = report.head.stamp_us;
        if self.newest.is_none_or(|newest| stamp_us > newest.stamp_us) {
            self.newest = Some(Arrival { stamp_us, at_us: now_us });
        }
        if let Some(doubt) = &mut self.doubt {
            doubt.take(report);
        }
    }

    fn take_health(&mut self, health: &Health<'_>, now_us: u64) {
        self.tally.counters(&health.counters);
        self.news.take(self.boot, health, self.since_us, now_us);
        let learned = health.events.iter().filter(|event| event.kind == EventKind::Learned);
        self.learned_us = learned.map(|event| event.at_us).max().or(self.learned_us);
        let suspects = health.suspects.len();
        self.health = Some(Condition { head: health.head, suspects, at_us: now_us });
    }

    /// Whether it has been heard of lately.
    #[must_use]
    pub fn is_heard(&self, now_us: u64) -> bool {
        self.last_heard_us.is_some_and(|last_us| now_us.saturating_sub(last_us) < SILENT_US)
    }

    /// The name it gives itself; empty until it has told.
    #[must_use]
    pub fn name(&self) -> &str {
        self.told.as_ref().map_or("", |told| &told.name)
    }

    /// How it is at `now_us`. `name` is its name in the site, or else its own; `clock` its clock on the host's.
    pub fn line(&mut self, name: &str, id: ModuleId, clock: Option<&ModuleClock>, now_us: u64) -> ModuleLine {
        self.tally.poll(now_us);
        let jitter_s = clock.and_then(ModuleClock::jitter_s);
        let expected_hz = self.told.as_ref().and_then(|told| told.expected_hz);
        let facts = Facts {
            now_us,
            name,
            since_us: self.since_us,
            last_heard_us: self.last_heard_us,
            health: self.health.as_ref().map(|health| &health.head),
            suspects: self.health.map_or(0, |health| health.suspects),
            expected_hz,
            tally: &self.tally,
            doubt: self.doubt.as_ref(),
            jitter_s,
            age_s: clock.and_then(|clock| self.age_s(clock)),
        };
        let alarms = self.bell.ring(&facts);
        ModuleLine {
            name: name.to_owned(),
            id: if id == ModuleId::ANY { String::new() } else { id.to_string() },
            state: self.state(now_us).to_owned(),
            scans_hz: rounded(self.tally.rates_hz().0, 10.0),
            lost_share: rounded(self.tally.lost_share(), 1e4),
            checksum_errors: self.tally.checksum_errors(),
            unknown_share: rounded(self.doubt.as_ref().map_or(1.0, Doubt::unseen_share), 1e4),
            clock_offset_ms: clock
                .and_then(ModuleClock::offset_s)
                .map(|offset_s| rounded(offset_s * 1e3, 10.0)),
            clock_jitter_ms: rounded(jitter_s.unwrap_or(0.0) * 1e3, 100.0),
            background_age_s: self.background_age_s(now_us),
            silent_s: self.last_heard_us.map(|last_us| rounded(seconds(last_us, now_us), 10.0)),
            alarms,
            events: self.news.lines(now_us),
            ..ModuleLine::default()
        }
    }

    fn state(&self, now_us: u64) -> &'static str {
        if !self.is_heard(now_us) {
            return "missing";
        }
        match self.health.map(|health| health.head) {
            Some(head) if head.storing => "storing",
            Some(HealthHead { sensor, .. }) if sensor.code != SensorCode::Streaming => "searching",
            Some(head) if head.learning.is_some() || head.background_version == 0 => "learning",
            Some(_) => "watching",
            None => "searching",
        }
    }

    /// How old the newest report seemed when it came, the time of its scan taken off, s.
    fn age_s(&self, clock: &ModuleClock) -> Option<f64> {
        let newest = self.newest?;
        let scan_s = self.told.as_ref()?.scan_s;
        Some(newest.at_us as f64 * 1e-6 - clock.host_s(newest.stamp_us)? - scan_s)
    }

    /// Since it was learned; of one that is older than the module's start, since that.
    fn background_age_s(&self, now_us: u64) -> Option<f64> {
        let Condition { head, at_us, .. } = self.health?;
        if head.background_version == 0 {
            return None;
        }
        let then_s = seconds(self.learned_us.unwrap_or(0), head.uptime_us);
        Some((then_s + seconds(at_us, now_us)).round())
    }
}

fn seconds(from_us: u64, to_us: u64) -> f64 {
    to_us.saturating_sub(from_us) as f64 * 1e-6
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

#[cfg(test)]
mod tests;
