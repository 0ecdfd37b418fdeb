//! How a module is: its messages and the time in, a line and alarms with a reason out.
//!
//! ```text
//!   report ─┬─▶ statistics   rates and losses       ╮
//!           └─▶ doubt        background not seen    ├─▶ alarm set ─▶ alarms in words
//!   health ───▶ states, counters                    │
//!      └──────▶ events       what it did            │
//!   clock ────▶ offset, jitter, age                 ╯──────────▶ ModuleLine
//! ```
//!
//! No I/O, no clock of its own: the same messages at the same times give the same alarms.

mod alarms;
mod doubt;
mod events;
mod panels;
mod statistics;
mod suspects;

use kehai::background::SUSPECTS;
use kehai::wire::{EventKind, Health, HealthHead, Info, ModuleId, Report, ReportHead, SensorCode};

use super::sequence::Arrival;
use crate::alarm::AlarmKind;
use crate::clock::ModuleClock;
use crate::explain::alarm::AlarmCondition;
use crate::figures::{rounded, seconds};
use crate::snapshot::{DeviceState, ModuleLine};
use alarms::{AlarmSet, Facts, SILENT_US};
use doubt::Doubt;
use events::Events;
pub use panels::Panels;
use statistics::Statistics;
use suspects::{Furniture, Suspects};

/// Watches over one device.
#[derive(Clone, Debug)]
pub struct Monitor {
    since_us: u64,
    last_heard_us: Option<u64>,
    /// Whether the host wants its reports: else it sends neither them nor its health.
    is_subscribed: bool,
    pace: Option<Pace>,
    health: Option<Condition>,
    /// µs of the device's clock.
    learned_us: Option<u64>,
    newest: Option<Newest>,
    statistics: Statistics,
    doubt: Option<Doubt>,
    /// Whether it hangs head down: its beams are numbered from right to left.
    upside_down: bool,
    /// Of a floor.
    panels: Option<Panels>,
    /// What the site says of shapes of people in the background.
    furniture: Furniture,
    alarms: AlarmSet,
    events: Events,
}

/// How fast the sensor measures, as the newest info says.
#[derive(Clone, Copy, Debug)]
struct Pace {
    /// Scans a second that are to be reported.
    expected_hz: Option<f64>,
    /// Time of a scan, s.
    scan_s: f64,
}

/// Its newest health.
#[derive(Clone, Debug)]
struct Condition {
    head: HealthHead,
    suspects: Suspects,
    at_us: u64,
}

/// The newest report: when its scan began by the module's clock, and when it came by the host's.
#[derive(Clone, Copy, Debug)]
struct Newest {
    stamp_us: u64,
    at_us: u64,
}

impl Monitor {
    /// Over a device that is asked for from `now_us` on.
    #[must_use]
    pub fn new(now_us: u64) -> Self {
        Self {
            since_us: now_us,
            last_heard_us: None,
            is_subscribed: true,
            pace: None,
            health: None,
            learned_us: None,
            newest: None,
            statistics: Statistics::default(),
            doubt: None,
            upside_down: false,
            panels: None,
            furniture: Furniture::default(),
            alarms: AlarmSet::default(),
            events: Events::default(),
        }
    }

    /// The device has restarted: its events and its active alarms stay known.
    pub fn restart(&mut self) {
        let (alarms, events) = (std::mem::take(&mut self.alarms), std::mem::take(&mut self.events));
        let furniture = std::mem::take(&mut self.furniture);
        let (pace, is_subscribed, upside_down) = (self.pace, self.is_subscribed, self.upside_down);
        let new = Self::new(self.since_us);
        *self = Self { alarms, events, furniture, pace, is_subscribed, upside_down, ..new };
    }

    /// Whether the host wants its reports, from now on. What was measured before a time without them says nothing of the time after.
    pub fn subscribe(&mut self, is_subscribed: bool) {
        if is_subscribed && !self.is_subscribed {
            let (last_heard_us, doubt) = (self.last_heard_us, self.doubt.take());
            self.restart();
            self.last_heard_us = last_heard_us;
            self.doubt = doubt.map(|doubt| Doubt::new(*doubt.geometry()));
        }
        self.is_subscribed = is_subscribed;
    }

    /// What the site says is furniture, from now on.
    pub fn know_furniture(&mut self, furniture: &[[f64; 2]]) {
        if self.furniture.0 != furniture {
            self.furniture = Furniture(furniture.to_vec());
        }
    }

    /// Whether it hangs head down, from now on.
    pub const fn hang(&mut self, upside_down: bool) {
        self.upside_down = upside_down;
    }

    /// A datagram came at `now_us`.
    pub const fn heard(&mut self, now_us: u64) {
        self.last_heard_us = Some(now_us);
    }

    /// Info came.
    pub fn info(&mut self, info: &Info<'_>) {
        let sensor = info.sensor.and_then(|sensor| Some((sensor.geometry().ok()?, sensor.skip)));
        if let Some((geometry, _)) = sensor
            && self.doubt.as_ref().is_none_or(|doubt| *doubt.geometry() != geometry)
        {
            self.doubt = Some(Doubt::new(geometry));
        }
        let scan_s = sensor.map(|(geometry, _)| f64::from(geometry.period_us()) * 1e-6);
        self.pace = Some(Pace {
            expected_hz: sensor
                .zip(scan_s)
                .map(|((_, skip), scan_s)| 1.0 / (scan_s * (1.0 + f64::from(skip)))),
            scan_s: scan_s.unwrap_or(0.0),
        });
    }

    /// A report came at `now_us`.
    pub fn report(&mut self, report: &Report<'_>, arrival: Arrival, now_us: u64) {
        self.statistics.report(&report.head, arrival);
        // By its number, not by its stamp: one stamp from the future would be the newest for good.
        if let Arrival::Ahead(_) = arrival {
            self.newest = Some(Newest { stamp_us: report.head.stamp_us, at_us: now_us });
            if let Some(doubt) = &mut self.doubt {
                doubt.update(report, now_us);
            }
        }
    }

    /// A reading of a floor came at `now_us`.
    pub fn reading(&mut self, head: &ReportHead, panels: Panels, arrival: Arrival, now_us: u64) {
        self.statistics.report(head, arrival);
        if let Arrival::Ahead(_) = arrival {
            self.newest = Some(Newest { stamp_us: head.stamp_us, at_us: now_us });
            self.panels = Some(panels);
        }
    }

    /// Health of start `boot` came at `now_us`.
    pub fn health(&mut self, health: &Health<'_>, boot: u32, now_us: u64) {
        self.statistics.counters(&health.counters);
        self.events.record(boot, health, self.since_us, now_us);
        let learned = health.events.iter().filter(|event| event.kind == EventKind::Learned);
        self.learned_us = learned.map(|event| event.at_us).max().or(self.learned_us);
        let suspects = health.suspects.iter().take(SUSPECTS).collect();
        self.health = Some(Condition { head: health.head, suspects, at_us: now_us });
    }

    /// Whether the device has been heard lately.
    #[must_use]
    pub fn is_heard(&self, now_us: u64) -> bool {
        self.last_heard_us.is_some_and(|last_us| now_us.saturating_sub(last_us) < SILENT_US)
    }

    /// How it is at `now_us`. `name` is its name in the site, or else its own; `clock` its clock on the host's.
    pub fn line(&mut self, name: &str, id: ModuleId, clock: Option<&ModuleClock>, now_us: u64) -> ModuleLine {
        self.statistics.poll(now_us);
        let jitter_s = clock.and_then(ModuleClock::jitter_s);
        let mut set = std::mem::take(&mut self.alarms);
        let alarms = set.update(&self.facts(name, clock, now_us));
        self.alarms = set;
        ModuleLine {
            name: name.to_owned(),
            id: if id == ModuleId::ANY { String::new() } else { id.to_string() },
            state: self.state(now_us),
            scans_hz: rounded(self.statistics.rates_hz().0, 10.0),
            lost_share: self.statistics.lost_share().map(|share| rounded(share, 1e4)),
            checksum_errors: self.statistics.checksum_errors(),
            unknown_share: rounded(self.unknown_share(), 1e4),
            clock_offset_ms: clock
                .and_then(ModuleClock::offset_s)
                .map(|offset_s| rounded(offset_s * 1e3, 10.0)),
            clock_jitter_ms: jitter_s.map(|jitter_s| rounded(jitter_s * 1e3, 100.0)),
            background_age_s: self.background_age_s(now_us),
            learned_share: self.learned_share(),
            suspects: self.suspects(),
            silent_s: self.last_heard_us.map(|last_us| rounded(seconds(last_us, now_us), 10.0)),
            alarms,
            events: self.events.lines(now_us),
            ..ModuleLine::default()
        }
    }

    /// What an alarm is decided on, at the time of the last line; none where nothing is measured for it.
    #[must_use]
    pub fn condition(
        &self,
        kind: AlarmKind,
        clock: Option<&ModuleClock>,
        now_us: u64,
    ) -> Option<AlarmCondition> {
        self.alarms.condition(kind, &self.facts("", clock, now_us))
    }

    fn facts<'a>(&'a self, name: &'a str, clock: Option<&ModuleClock>, now_us: u64) -> Facts<'a> {
        Facts {
            now_us,
            name,
            since_us: self.since_us,
            last_heard_us: self.last_heard_us,
            is_subscribed: self.is_subscribed,
            health: self.health.as_ref().map(|health| &health.head),
            shapes: self.health.as_ref().map_or(0, |health| health.suspects.len()),
            suspects: self.suspects().len(),
            expected_hz: self.pace.and_then(|pace| pace.expected_hz),
            statistics: &self.statistics,
            doubt: self.doubt.as_ref(),
            upside_down: self.upside_down,
            panels: self.panels.as_ref(),
            jitter_s: clock.and_then(ModuleClock::jitter_s),
            age_s: clock.and_then(|clock| self.age_s(clock)),
        }
    }

    /// Where in its background something has the shape of a person and is no furniture: bearing, degrees, and range, m.
    fn suspects(&self) -> Vec<[f64; 2]> {
        let (Some(health), Some(doubt)) = (&self.health, &self.doubt) else { return Vec::new() };
        let places = health.suspects.iter().map(|suspect| suspects::place(suspect, doubt.geometry()));
        places.filter(|place| !self.furniture.has(*place)).collect()
    }

    /// Share of the beams, or of the panels, that say nothing.
    fn unknown_share(&self) -> f64 {
        if let Some(panels) = &self.panels {
            return panels.unknown_share();
        }
        self.doubt.as_ref().map_or(1.0, Doubt::unseen_share)
    }

    fn state(&self, now_us: u64) -> DeviceState {
        if !self.is_heard(now_us) {
            return DeviceState::Missing;
        }
        match self.health.as_ref().map(|health| health.head) {
            Some(head) if head.storing => DeviceState::Storing,
            Some(HealthHead { sensor, .. }) if sensor.code != SensorCode::Streaming => DeviceState::Searching,
            // A floor has no background to learn.
            Some(_) if self.panels.is_some() => DeviceState::Watching,
            Some(head) if head.learning.is_some() || head.background_version == 0 => DeviceState::Learning,
            Some(_) => DeviceState::Watching,
            None => DeviceState::Searching,
        }
    }

    /// How old the newest report seemed when it came, the time of its scan taken off, s.
    fn age_s(&self, clock: &ModuleClock) -> Option<f64> {
        let newest = self.newest?;
        let scan_s = self.pace?.scan_s;
        Some(newest.at_us as f64 * 1e-6 - clock.host_s(newest.stamp_us)? - scan_s)
    }

    /// How much of what it learns from it has.
    fn learned_share(&self) -> Option<f64> {
        let learning = self.health.as_ref()?.head.learning?;
        Some(rounded(f64::from(learning.scans) / f64::from(learning.of.max(1)), 100.0))
    }

    /// Since it was learned; of one that is older than the module's start, since that.
    fn background_age_s(&self, now_us: u64) -> Option<f64> {
        let Condition { head, at_us, .. } = self.health.as_ref()?;
        if head.background_version == 0 {
            return None;
        }
        let then_s = seconds(self.learned_us.unwrap_or(0), head.uptime_us);
        Some((then_s + seconds(*at_us, now_us)).round())
    }
}

#[cfg(test)]
mod tests;
