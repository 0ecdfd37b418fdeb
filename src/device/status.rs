//! The module's status for code outside its tasks: the LED, the announcement on the network.

use super::Module;
use crate::background::Learning;
use crate::scip::Text;
use crate::wire::{Alarms, Counter, SensorCode};

/// A consistent copy of the module's status.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Status {
    /// What the sensor is doing.
    pub sensor: SensorCode,
    /// What needs attention.
    pub alarms: Alarms,
    /// The room is being learned.
    pub learning: bool,
    /// Something is being stored; the stream is stopped meanwhile.
    pub storing: bool,
    /// It blinks, so that a person finds it.
    pub identifying: bool,
    /// A host has subscribed since the start.
    pub had_subscriber: bool,
    /// Model of the sensor; empty until it has been found.
    pub model: Text<16>,
    /// Its serial number; empty until it is known.
    pub serial: Text<16>,
}

impl Status {
    /// A module that has just been switched on.
    pub const NEW: Self = Self {
        sensor: SensorCode::Searching,
        alarms: Alarms::NO_SCANS.with(Alarms::NO_BACKGROUND),
        learning: false,
        storing: false,
        identifying: false,
        had_subscriber: false,
        model: Text::EMPTY,
        serial: Text::EMPTY,
    };
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// How the module is now.
    #[must_use]
    pub fn status(&self, now_us: u64) -> Status {
        let (model, serial) = self.setup.sensor();
        Status {
            sensor: self.sensor_health(now_us).code,
            alarms: self.alarms(now_us),
            learning: self.observed.learning != Learning::Idle,
            storing: self.storing,
            identifying: now_us < self.identify_until_us,
            had_subscriber: self.subscribers.had_one(),
            model,
            serial,
        }
    }

    /// So many datagrams of the service discovery have been dropped since the start.
    pub fn discovery_dropped(&mut self, datagrams: u32) {
        self.counters.set(Counter::DiscoveryDropped, datagrams);
    }
}
