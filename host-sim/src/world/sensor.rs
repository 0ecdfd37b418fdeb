//! A sensor of the world as a source of ranges for an emulated range finder.
//!
//! ```text
//!   RangeSource::scan(revolution) ─▶ cast: every step at its own moment ─▶ noise ─▶ mm
//! ```

use std::sync::Arc;

use super::geometry::Pose;
use super::moving::Moving;
use super::noise::{Noise, NoiseLevel, Seen};
use super::optics::SensorModel;
use super::person::Person;
use super::random::{Purpose, Stream};
use super::raycast::{Caster, FIRST_PERSON};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::Config;

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
    /// The ray casters that replace `caster`, each from its time on, µs; in order of time.
    later: Vec<(u64, Caster)>,
    noise: Noise,
    people: Arc<[Person]>,
    moving: Arc<[Moving]>,
    facing: Vec<Facing>,
    seed: u64,
    number: u64,
}

/// Cross-talk: another sensor in view; now and then both beams meet.
#[derive(Clone, Copy, Debug)]
struct Facing {
    /// The entry that points at it, and how far it is.
    entry: usize,
    distance_m: f64,
    /// When it points at this one for the first time, and again and again after its period.
    first_us: f64,
    period_us: f64,
}

/// Both beams meet if they pass within this time.
const MEETING_US: f64 = 300.0;
/// Entries to either side that read the other's light.
const DAZZLED: usize = 2;

impl WorldSensor {
    /// Sensor number `sensor` of a world.
    #[must_use]
    pub fn new(
        model: SensorModel,
        level: NoiseLevel,
        caster: Caster,
        (people, moving): (Arc<[Person]>, Arc<[Moving]>),
        seed: u64,
        sensor: u64,
    ) -> Self {
        let noise = Noise::new(level, model.optics(), seed, sensor);
        let clock = SensorClock::new(model, seed, sensor);
        let (later, facing) = (Vec::new(), Vec::new());
        Self { model, clock, caster, later, noise, people, moving, facing, seed, number: sensor }
    }

    /// From `from_s` on the ranges come from `caster`; to be called in order of time.
    pub fn replace_caster(&mut self, from_s: f64, caster: Caster) {
        self.later.push(((from_s.max(0.0) * 1e6) as u64, caster));
    }

    /// From now on the light of the sensors in `others` that are in view interferes with this sensor from time to time.
    pub fn look_at(&mut self, others: &[Self]) {
        let facing = |other: &Self| {
            if other.number == self.number || !self.caster.is_level_with(&other.caster) {
                return None;
            }
            let (entry, distance_m) = self.caster.entry_of(other.pose().at)?;
            let (from_there, _) = other.caster.entry_of(self.pose().at)?;
            let geometry = other.model.optics().geometry;
            let step = from_there as f64 + f64::from(geometry.first_step);
            let period_us = f64::from(other.clock.period_us);
            let first_us =
                other.clock.phase_us as f64 + period_us * step / f64::from(geometry.steps_per_turn);
            Some(Facing { entry, distance_m, first_us, period_us })
        };
        self.facing = others.iter().filter_map(facing).collect();
    }

    /// Where the other's beam meets this one's, readings are short by chance.
    fn dazzle(&self, revolution: Revolution, seen: &[Option<Seen>], readings: &mut [u32]) {
        for facing in &self.facing {
            let blocked = |seen: &Seen| seen.range_m < facing.distance_m;
            if seen.get(facing.entry).and_then(Option::as_ref).is_some_and(blocked) {
                continue;
            }
            let geometry = self.model.optics().geometry;
            let step = facing.entry as f64 + f64::from(geometry.first_step);
            let own_us = revolution.start_us as f64
                + f64::from(revolution.period_us) * step / f64::from(geometry.steps_per_turn);
            let turns = (own_us - facing.first_us) / facing.period_us;
            if ((turns - turns.round()) * facing.period_us).abs() > MEETING_US {
                continue;
            }
            let mut stream = Stream::new(self.seed, Purpose::CrossTalk, [self.number, revolution.start_us]);
            let first = facing.entry.saturating_sub(DAZZLED);
            for reading in readings.iter_mut().skip(first).take(2 * DAZZLED + 1) {
                let false_mm = stream.between(f64::from(geometry.range_min_mm), facing.distance_m * 1000.0);
                if stream.chance(0.7) {
                    *reading = false_mm as u32;
                }
            }
        }
    }

    /// Its model.
    #[must_use]
    pub const fn model(&self) -> SensorModel {
        self.model
    }

    /// Its pose: from its own frame to the site's.
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
            // Nothing asks for them here; the sensor itself for the last one.
            kept_scans: 1,
            ..Config::new(self.model.emulated())
        }
    }

    /// Revolution number `index` by the sensor's own phase and period.
    #[must_use]
    pub fn revolution(&self, index: u64) -> Revolution {
        let start_us = self.clock.phase_us + index * u64::from(self.clock.period_us);
        Revolution { start_us, period_us: self.clock.period_us, earliest_us: start_us }
    }

    /// Measurements of a perfect sensor, per step.
    #[must_use]
    pub fn seen(&self, revolution: Revolution) -> Vec<Option<Seen>> {
        let now = self.later.iter().rev().find(|(from_us, _)| revolution.start_us >= *from_us);
        now.map_or(&self.caster, |(_, caster)| caster).cast(revolution, &self.people, &self.moving)
    }

    /// How many beams meet each person, in the order of the world's people.
    #[must_use]
    pub fn beams_on_people(&self, revolution: Revolution) -> Vec<u32> {
        self.count_beams(&self.seen(revolution))
    }

    fn count_beams(&self, seen: &[Option<Seen>]) -> Vec<u32> {
        let mut beams = vec![0; self.people.len()];
        for seen in seen.iter().flatten() {
            let person = seen.thing.checked_sub(FIRST_PERSON).map(usize::from);
            if let Some(count) = person.and_then(|person| beams.get_mut(person)) {
                *count += 1;
            }
        }
        beams
    }

    /// The scan of one revolution, and how many beams met each person.
    #[must_use]
    pub fn observe(&self, revolution: Revolution) -> (SourceScan, Vec<u32>) {
        let seen = self.seen(revolution);
        let mut ranges_mm = self.noise.readings(revolution.start_us, &seen);
        self.dazzle(revolution, &seen, &mut ranges_mm);
        let ready_us = revolution.start_us + u64::from(revolution.period_us);
        let scan = SourceScan { start_us: revolution.start_us, ready_us, ranges_mm };
        (scan, self.count_beams(&seen))
    }

    /// The readings of one revolution.
    #[must_use]
    pub fn readings(&self, revolution: Revolution) -> Vec<u32> {
        self.observe(revolution).0.ranges_mm
    }
}

impl RangeSource for WorldSensor {
    fn geometry(&self) -> SensorGeometry {
        self.model.optics().geometry
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        Some(self.observe(revolution).0)
    }
}
