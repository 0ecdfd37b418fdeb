//! A sensor of the world as a source of ranges for an emulated range finder.
//!
//! ```text
//!   RangeSource::scan(revolution) ─▶ cast: every step at its own moment ─▶ noise ─▶ mm
//! ```

use std::sync::Arc;

use super::door::Door;
use super::geometry::Pose;
use super::noise::{Noise, NoiseLevel, Seen};
use super::optics::SensorModel;
use super::random::{Purpose, Stream};
use super::raycast::{Caster, FIRST_PERSON, Person};
use crate::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use crate::urg::Config;

/// How one sensor's time differs from the world's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SensorClock {
    /// When its first revolution begins, in µs of the world.
    pub phase_us: u64,
    /// True time of one revolution, in µs.
    pub period_us: u32,
    /// What its millisecond counter shows at time 0 of the world.
    pub start_ms: u32,
    /// Millionths by which its clock, and with it the mirror, runs fast: recorded sensors turn 0.3 % fast,
    /// and no two alike (± 0.2 %).
    pub fast_ppm: i32,
}

impl SensorClock {
    fn new(model: SensorModel, seed: u64, sensor: u64) -> Self {
        let mut stream = Stream::new(seed, Purpose::Sensor, [sensor, 1]);
        let nominal_us = f64::from(model.optics().geometry.period_us);
        let fast_ppm = stream.between(1000.0, 5000.0).round();
        Self {
            phase_us: (nominal_us * stream.uniform()) as u64,
            period_us: (nominal_us / (1.0 + fast_ppm * 1e-6)).round() as u32,
            start_ms: stream.between(0.0, 500_000.0) as u32,
            fast_ppm: fast_ppm as i32,
        }
    }
}

/// One sensor among the people and things of a world.
#[derive(Clone, Debug)]
pub struct WorldSensor {
    model: SensorModel,
    clock: SensorClock,
    caster: Caster,
    noise: Noise,
    people: Arc<[Person]>,
    doors: Arc<[Door]>,
}

impl WorldSensor {
    /// Sensor number `sensor` of a world.
    #[must_use]
    pub fn new(
        model: SensorModel,
        level: NoiseLevel,
        caster: Caster,
        (people, doors): (Arc<[Person]>, Arc<[Door]>),
        seed: u64,
        sensor: u64,
    ) -> Self {
        let noise = Noise::new(level, model.optics(), seed, sensor);
        Self { model, clock: SensorClock::new(model, seed, sensor), caster, noise, people, doors }
    }

    /// The model it is.
    #[must_use]
    pub const fn model(&self) -> SensorModel {
        self.model
    }

    /// Where it is: between the site's frame and its own.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.caster.pose()
    }

    /// Its phase, period and clock.
    #[must_use]
    pub const fn clock(&self) -> SensorClock {
        self.clock
    }

    /// The emulated sensor that this one is the source of.
    #[must_use]
    pub fn config(&self) -> Config {
        Config {
            clock_start_ms: self.clock.start_ms,
            clock_fast_ppm: self.clock.fast_ppm,
            ..Config::new(self.model.emulated())
        }
    }

    /// Revolution number `index` by the sensor's own phase and period.
    #[must_use]
    pub fn revolution(&self, index: u64) -> Revolution {
        let start_us = self.clock.phase_us + index * u64::from(self.clock.period_us);
        Revolution { start_us, period_us: self.clock.period_us, earliest_us: start_us }
    }

    /// What a perfect sensor would see, per step.
    #[must_use]
    pub fn seen(&self, revolution: Revolution) -> Vec<Option<Seen>> {
        self.caster.cast(revolution, &self.people, &self.doors)
    }

    /// How many beams meet each person, in the order of the world's people.
    #[must_use]
    pub fn beams_on_people(&self, revolution: Revolution) -> Vec<u32> {
        let mut beams = vec![0; self.people.len()];
        for seen in self.seen(revolution).into_iter().flatten() {
            let person = seen.thing.checked_sub(FIRST_PERSON).map(usize::from);
            if let Some(count) = person.and_then(|person| beams.get_mut(person)) {
                *count += 1;
            }
        }
        beams
    }

    /// The readings of one revolution.
    #[must_use]
    pub fn readings(&self, revolution: Revolution) -> Vec<u32> {
        self.noise.readings(revolution.start_us, &self.seen(revolution))
    }
}

impl RangeSource for WorldSensor {
    fn geometry(&self) -> SensorGeometry {
        self.model.optics().geometry
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        Some(SourceScan {
            start_us: revolution.start_us,
            ready_us: revolution.start_us + u64::from(revolution.period_us),
            ranges_mm: self.readings(revolution),
        })
    }
}
