//! Health of the module: counters, events and alarms; and the times at which it is sent.
//!
//! ```text
//!   every second ──────────────────────────────────────────┐
//!   sensor's state, alarms, storing, background, events ───┴─▶ health
//!        └ any of them changed: at once
//! ```

use super::Module;
use super::panels::NO_READING_US;
use crate::background::Learning;
use crate::link::Outbox;
use crate::sensor::Session;
use crate::sensor::timeouts::NO_SCAN_INTERVALS;
use crate::wire::{
    Alarms, Counter, Counters, EVENTS, Event, EventKind, Health, HealthHead, LearningProgress, List, Message,
    SensorHealth,
};
use heapless::Vec;

/// Between two health messages without a change, µs.
pub(super) const HEALTH_US: u64 = 1_000_000;

/// Uncertainty of the stamps that raises an alarm, µs.
const UNCERTAIN_US: u32 = 20_000;
#[derive(Clone, Debug)]
pub(super) struct Events {
    newest: Vec<Event, EVENTS>,
    count: u32,
}

impl Events {
    pub(super) const fn new() -> Self {
        Self { newest: Vec::new(), count: 0 }
    }

    pub(super) fn add(&mut self, at_us: u64, kind: EventKind, background_version: u16, by: [u8; 4]) {
        self.count = self.count.wrapping_add(1);
        let event = Event { number: self.count, at_us, kind, background_version, by };
        if let Err(event) = self.newest.push(event) {
            // The oldest goes: the others move up.
            self.newest.rotate_left(1);
            if let Some(last) = self.newest.last_mut() {
                *last = event;
            }
        }
    }
}

/// Values whose change makes the module send health at once.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct HealthTriggers {
    sensor: Option<SensorHealth>,
    alarms: Alarms,
    storing: bool,
    background_version: u16,
    learning: bool,
    events: u32,
}

/// When health is sent next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HealthSchedule {
    sent: HealthTriggers,
    pub(super) due_us: u64,
}

impl HealthSchedule {
    /// Whether health must be sent now: a trigger has changed, or [`HEALTH_US`] has passed since the last time. If so,
    /// it counts as sent.
    fn begin_if_due(&mut self, triggers: HealthTriggers, now_us: u64) -> bool {
        let due = triggers != self.sent || now_us >= self.due_us;
        if due {
            *self = Self { sent: triggers, due_us: now_us.saturating_add(HEALTH_US) };
        }
        due
    }
}

/// Sets the counters to the driver's counts.
pub(super) fn count_sensor(counters: &mut Counters, session: &Session) {
    counters.set_sensor(session.counters());
    counters.set_reader(session.losses());
    counters.set(Counter::LostScans, session.counters().scans_missing);
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// When the alarm for missing scans, or readings of a floor, is due, µs; 0 before the first one.
    pub(super) fn no_scan_us(&self) -> u64 {
        let of_floor_us = self.has_floor().then_some(NO_READING_US);
        let interval_us = self.setup.interval_us();
        let limit_us = of_floor_us.or(interval_us.map(|us| us.saturating_mul(NO_SCAN_INTERVALS)));
        match (self.observed.last_scan_us, limit_us) {
            (Some(last_us), Some(limit_us)) => last_us.saturating_add(limit_us),
            _ => 0,
        }
    }

    pub(super) fn alarms(&self, now_us: u64) -> Alarms {
        let background = self.pipeline.background();
        let waits = matches!(self.observed.learning, Learning::Running { restarts: 1.., .. });
        let pairs = [
            (Alarms::NO_SCANS, !self.storing && now_us >= self.no_scan_us()),
            (Alarms::NO_BACKGROUND, !background.is_known() && !self.has_floor()),
            (Alarms::LEARNING_WAITS, waits),
            (Alarms::SUSPECTS, !background.suspects().is_empty()),
            (Alarms::STORE_FAILED, self.store_failed),
            (Alarms::CLOCK_UNCERTAIN, self.observed.uncertainty_us > UNCERTAIN_US),
            (Alarms::WATCHDOG, self.watchdog_reset),
        ];
        pairs
            .into_iter()
            .filter(|(_, on)| *on)
            .fold(Alarms::default(), |alarms, (alarm, _)| alarms.with(alarm))
    }

    /// What the sensor is doing, or the floor in its place.
    pub(super) fn sensor_health(&self, now_us: u64) -> SensorHealth {
        self.floor_health(now_us).unwrap_or_else(|| SensorHealth::from(self.observed.sensor))
    }

    /// Sends health if it is time for it, or something has changed.
    pub(super) fn publish_health(&mut self, now_us: u64, out: &mut impl Outbox) {
        let alarms = self.alarms(now_us);
        let background_version = self.pipeline.background().version();
        let sensor = self.sensor_health(now_us);
        let triggers = HealthTriggers {
            sensor: Some(sensor),
            alarms,
            storing: self.storing,
            background_version,
            learning: self.observed.learning != Learning::Idle,
            events: self.events.count,
        };
        if !self.health.begin_if_due(triggers, now_us) {
            return;
        }
        self.counters.set_pipeline(&self.pipeline.counters());
        let head = HealthHead {
            uptime_us: now_us,
            sequence: self.pipeline.judgement().sequence,
            setup: self.setup.number(),
            background_version,
            sensor,
            alarms,
            storing: self.storing,
            subscribers: self.subscribers.len(),
            learning: LearningProgress::of(self.observed.learning),
        };
        let health = Health {
            head,
            counters: self.counters,
            suspects: List::new(self.pipeline.background().suspects()),
            events: List::new(&self.events.newest),
        };
        let encoded = Message::Health(health).encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        let drops = self.counters.get(Counter::HealthDropped);
        let dropped = (&mut self.counters, Counter::HealthDropped);
        self.subscribers.send(datagram, |_| true, dropped, now_us, &mut self.guard.over(out));
        if !self.subscribers.is_empty() && self.counters.get(Counter::HealthDropped) == drops {
            self.update.health_sent();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn health_is_sent_each_second_and_at_every_change() {
        let mut schedule = HealthSchedule::default();
        let quiet = HealthTriggers::default();
        assert!(schedule.begin_if_due(quiet, 0), "the first");
        assert!(!schedule.begin_if_due(quiet, HEALTH_US - 1));
        let storing = HealthTriggers { storing: true, ..quiet };
        assert!(schedule.begin_if_due(storing, HEALTH_US - 1), "a change");
        assert!(!schedule.begin_if_due(storing, 2 * HEALTH_US - 2));
        assert!(schedule.begin_if_due(storing, 2 * HEALTH_US - 1), "a second later");
    }
}
