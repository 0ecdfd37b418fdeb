//! A module in memory: an emulated sensor, the library's driver and its pipeline, on simulated time.
//!
//! ```text
//! source ─▶ Urg ─▶ SCIP bytes ─▶ Driver ─▶ Scan ─▶ Pipeline ─▶ Judgement
//!           └────── MemoryLink ──────┘ └── the very code of the board ──┘
//! ```

use kehai::background::Fingerprint;
use kehai::pipeline::{ConfigureError, Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, Scan, ScanTime};
use kehai::sensor::{Driver, SensorCounters, SensorEvent, SensorSettings, SensorState};

use crate::link::{LinkOptions, MemoryLink};
use crate::simulated_time::{SimulatedClock, Stuck, block_on_until};
use crate::source::RangeSource;
use crate::urg::{Config, Urg};

/// Longest time without a scan or a change of state, in µs of simulated time: the driver looks for a silent
/// sensor at every speed there is, several times.
const PATIENCE_US: u64 = 60_000_000;

/// Why the chain stopped before its source did.
#[derive(Debug, thiserror::Error)]
pub enum ChainError {
    /// No scan came, for longer than any recovery takes.
    #[error("no scan any more: {0}")]
    Stuck(#[from] Stuck),
    /// The pipeline has no room for the sensor.
    #[error(transparent)]
    Configure(#[from] ConfigureError),
    /// The driver cannot use the sensor.
    #[error("the driver refuses the sensor: {0:?}")]
    Refused(SensorState),
}

/// An emulated sensor and the module beside it.
pub struct Chain {
    clock: SimulatedClock,
    link: MemoryLink,
    driver: Box<Driver<MemoryLink, SimulatedClock, MAX_BEAMS>>,
    pipeline: Box<Pipeline<MAX_BEAMS>>,
    settings: Settings,
    /// Of the sensor.
    serial: &'static str,
    /// The scan last judged.
    geometry: Option<Geometry>,
    ranges_mm: Vec<u16>,
}

/// A scan and what the pipeline made of it.
pub struct JudgedScan<'a> {
    /// The scan as the driver handed it on; its stamp is the time of the simulated world.
    pub scan: Scan<'a>,
    /// The judgement.
    pub judgement: &'a Judgement,
}

impl Chain {
    /// A sensor set up by `config` that measures `source`, and a module that knows nothing yet.
    #[must_use]
    pub fn new(source: Box<dyn RangeSource>, config: Config, settings: Settings) -> Self {
        let line = if config.paced { SensorSettings::SERIAL } else { SensorSettings::NO_SPEED };
        let (clock, serial) = (SimulatedClock::new(), config.model.serial);
        let link = MemoryLink::new(&clock, Urg::new(config, source, 0), LinkOptions::default());
        let driver = Box::new(Driver::new(link.clone(), clock.clone(), line));
        Self {
            clock,
            link,
            driver,
            pipeline: Box::new(Pipeline::new()),
            settings,
            serial,
            geometry: None,
            ranges_mm: Vec::new(),
        }
    }

    /// Another sensor, and time from its beginning, for a module that keeps what it has learned.
    pub fn restart(&mut self, source: Box<dyn RangeSource>, config: Config) {
        let pipeline = std::mem::take(&mut self.pipeline);
        *self = Self { pipeline, ..Self::new(source, config, self.settings) };
    }

    /// The next scan; None once the source has no more.
    ///
    /// # Errors
    /// [`ChainError`].
    pub fn next_scan(&mut self) -> Result<Option<JudgedScan<'_>>, ChainError> {
        let Some(time) = self.wait()? else { return Ok(None) };
        let Self { pipeline, settings, serial, geometry: Some(geometry), ranges_mm, .. } = self else {
            return Ok(None);
        };
        let fingerprint = Fingerprint::of(serial.as_bytes(), geometry);
        if pipeline.background().fingerprint() != fingerprint {
            pipeline.configure(geometry, *settings, fingerprint)?;
        }
        let scan = Scan { geometry, ranges_mm, time };
        let judgement = pipeline.process(&scan);
        Ok(Some(JudgedScan { scan, judgement }))
    }

    /// Lets time pass until the driver hands on a scan.
    fn wait(&mut self) -> Result<Option<ScanTime>, ChainError> {
        loop {
            let limit_us = self.clock.now_us() + PATIENCE_US;
            match block_on_until(&self.clock, limit_us, self.driver.event_until(u64::MAX))? {
                SensorEvent::State(state @ (SensorState::TooLarge { .. } | SensorState::Unusable(_))) => {
                    return Err(ChainError::Refused(state));
                }
                SensorEvent::State(SensorState::Stalled) => {
                    if self.link.with_sensor(|sensor, _| sensor.source_ended()) {
                        return Ok(None);
                    }
                }
                SensorEvent::State(_) | SensorEvent::Timeout => {}
                SensorEvent::Scan => {
                    let Some(scan) = self.driver.scan() else { continue };
                    self.ranges_mm.clear();
                    self.ranges_mm.extend_from_slice(scan.ranges_mm);
                    self.geometry = Some(*scan.geometry);
                    return Ok(Some(scan.time));
                }
            }
        }
    }

    /// Background and latest judgement.
    #[must_use]
    pub fn pipeline(&self) -> &Pipeline<MAX_BEAMS> {
        &self.pipeline
    }

    /// Where the beams point, once the sensor has said so.
    #[must_use]
    pub const fn geometry(&self) -> Option<&Geometry> {
        self.geometry.as_ref()
    }

    /// What the driver counted.
    #[must_use]
    pub fn counters(&self) -> SensorCounters {
        *self.driver.session().counters()
    }

    /// What the driver is doing.
    #[must_use]
    pub fn state(&self) -> SensorState {
        self.driver.session().state()
    }
}
