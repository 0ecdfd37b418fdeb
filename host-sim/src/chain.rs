//! A module in memory: an emulated sensor, the library's driver and its pipeline, on simulated time.
//!
//! ```text
//! source ─▶ Urg ─▶ SCIP bytes ─▶ Driver ─▶ Scan ─▶ Pipeline ─▶ Judgement
//!           └────── MemoryLink ──────┘ └── the very code of the board ──┘
//! ```

use embedded_io_async::{Read, Write};
use kehai::background::Fingerprint;
use kehai::pipeline::{ConfigureError, Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, GeometryError, MAX_BEAMS, Scan, ScanTime};
use kehai::scip::{Command, Event, Reader, Width};

use crate::link::{LinkOptions, MemoryLink};
use crate::simulated_time::{SimulatedClock, Stuck, block_on_until};
use crate::source::RangeSource;
use crate::urg::{Config, Urg};

const SILENCE_US: u64 = 3_000_000;

#[derive(Debug, thiserror::Error)]
pub enum ChainError {
    #[error(transparent)]
    Stuck(#[from] Stuck),
    #[error(transparent)]
    Configure(#[from] ConfigureError),
}

pub struct Chain {
    clock: SimulatedClock,
    link: MemoryLink,
    driver: StandIn,
    pipeline: Box<Pipeline<MAX_BEAMS>>,
    settings: Settings,
}
struct StandIn {
    reader: Reader,
    ranges: Vec<u16>,
    geometry: Option<Geometry>,
    pending: Vec<u8>,
    stage: u8,
}

pub struct Judged<'a> {
    pub scan: Scan<'a>,
    pub judgement: &'a Judgement,
    pub world_us: u64,
}

impl Chain {
    pub fn new(source: Box<dyn RangeSource>, config: Config, settings: Settings) -> Self {
        let clock = SimulatedClock::new();
        let link = MemoryLink::new(
            &clock,
            Urg::new(config, source, 0),
            LinkOptions { baud: 19200, ..LinkOptions::default() },
        );
        Self {
            clock,
            link,
            driver: StandIn {
                reader: Reader::new(),
                ranges: vec![0; MAX_BEAMS],
                geometry: None,
                pending: vec![],
                stage: 0,
            },
            pipeline: Box::new(Pipeline::new()),
            settings,
        }
    }
    pub fn restart(&mut self, source: Box<dyn RangeSource>, config: Config) {
        let pipeline = std::mem::take(&mut self.pipeline);
        *self = Self { pipeline, ..Self::new(source, config, self.settings) };
    }
    pub fn pipeline(&self) -> &Pipeline<MAX_BEAMS> {
        &self.pipeline
    }
    pub fn geometry(&self) -> Option<&Geometry> {
        self.driver.geometry.as_ref()
    }
    pub fn lost_scans(&self) -> u64 {
        0
    }
    pub fn state_in_words(&self) -> String {
        "streaming".into()
    }
    pub fn next(&mut self) -> Result<Option<Judged<'_>>, ChainError> {
        let Self { clock, link, driver, pipeline, settings } = self;
        let limit = clock.now_us() + SILENCE_US;
        let header = match block_on_until(clock, limit, driver.next(link, clock)) {
            Ok(h) => h,
            Err(_) => return Ok(None),
            Err(e) => return Err(e.into()),
        };
        let geometry = driver.geometry.as_ref().unwrap();
        pipeline.configure(geometry, *settings, Fingerprint::of(b"sim", geometry))?;
        let truth = link
            .with_sensor(|u, _| u.truth().filter(|t| t.stamp_ms == header.0).map(|t| t.start_us).last())
            .unwrap_or(0);
        let scan = Scan {
            geometry,
            ranges_mm: &driver.ranges[..header.1],
            time: ScanTime { sensor_ms: header.0.into(), stamp_us: truth, uncertainty_us: 0 },
        };
        let judgement = pipeline.process(&scan);
        Ok(Some(Judged { scan, judgement, world_us: truth }))
    }
}
impl StandIn {
    async fn next(&mut self, link: &mut MemoryLink, clock: &SimulatedClock) -> (u32, usize) {
        if self.stage == 0 {
            self.stage = 1;
            let r = Command::Parameters.encode().unwrap();
            self.reader.expect(&r);
            link.write_all(r.as_bytes()).await.unwrap();
        }
        loop {
            while !self.pending.is_empty() {
                let fed = self.reader.feed(&self.pending, clock.now_us(), &mut self.ranges);
                self.pending.drain(..fed.consumed);
                match fed.event {
                    Some(Event::Parameters(p)) => {
                        let m = p.measure_all(1, Width::Three);
                        self.geometry = Some(p.geometry(&m).unwrap());
                        let r = Command::Measure(m).encode().unwrap();
                        self.reader.expect(&r);
                        link.write_all(r.as_bytes()).await.unwrap();
                    }
                    Some(Event::Scan(h)) => return (h.stamp_ms, h.beams.into()),
                    _ => {}
                }
            }
            let mut buffer = [0; 256];
            let n = link.read(&mut buffer).await.unwrap();
            self.pending.extend_from_slice(&buffer[..n]);
        }
    }
}
